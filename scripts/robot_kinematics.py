"""Kinematics of URDF files, of robot.kinematics in Python beside Pinocchio, for scripts/robot_files
--kinematics."""

import collections
import pathlib
import re
import sys
import warnings

import kalmarm
import numpy as np
import pinocchio as pin

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "python/tests"))
from conventions import LINEAR_FIRST, of_links, pinocchio_states, turned, turning  # noqa: E402

STATES = 2
OPERATIONAL = "J M^-1 J'"
BOUNDS = collections.defaultdict(lambda: 1e-12)
BOUNDS[OPERATIONAL] = 1e-9  # M is solved with, which loses digits by its condition number
SUFFIX = r"(:.*|_TX|_TY|_RZ)$"  # of the DoF of a joint that has several
SHORTEST = 1e-3  # [m], where all frames are in one place
OF_THE_CENTRE = {"centre of mass", "its Jacobian", "centroidal matrix", "momentum", "its rate"}


class NotCompared(Exception):
    """Why, in a line."""


class Differs(Exception):
    """How, in a line."""


def load(path, floating):
    """Pinocchio's model and our robot of a URDF, with a free base if that is asked for and can be;
    why it is fixed instead, or "". Links without <inertial> are massless in both, and joints that
    mimic others move on their own."""
    options = {"dof_order": "pinocchio", "urdf_inertia": "none", "imposes_couplings": True}
    try:
        robot = kalmarm.load(path, floating=floating, **options)
    except kalmarm.LoadError as error:
        if floating:
            return *load(path, False)[:2], reason_of(error)
        raise NotCompared(f"refused here: {reason_of(error)}") from None
    base = [pin.JointModelFreeFlyer()] if floating else []
    try:
        model = pin.buildModelFromUrdf(str(path), *base)
    except Exception as error:  # of classes of its own
        raise NotCompared(f"Pinocchio refuses it: {reason_of(error)}") from None
    root = next(frame.name for frame in model.frames if frame.type == pin.BODY)
    if floating and robot.frames[root].link < 0:
        return *load(path, False)[:2], f"the root is '{root}', which stands still here"
    for joint, name in zip(model.joints, model.names):
        own = robot.dofs[joint.idx_v : joint.idx_v + joint.nv] if joint.idx_v >= 0 else []
        own = [dof for dof in own if name not in (dof, "root_joint")]
        if any(re.sub(SUFFIX, "", dof) != name for dof in own):
            raise Differs(f"where Pinocchio has joint '{name}' stands {own}")
    if robot.nv != model.nv:
        raise Differs(f"Pinocchio has {model.nv} DoF, we {robot.nv}")
    return model, robot, ""


def reason_of(error):
    first = str(error).split(".urdf: ", 1)[-1].strip().splitlines()[0]
    return re.sub(r"/\S+", "…", first)


def deepest(model, names):
    """The frame that most joints move."""
    def joints(name):
        return len(model.supports[model.frames[model.getFrameId(name, pin.BODY)].parentJoint])
    return max(names, key=joints)


def compare(path, floating):
    """Errors by quantity, what was compared, and why something was not."""
    mimics = "<mimic" in path.read_text(encoding="utf-8", errors="replace")
    found = {"errors": {}, "floating": False, "mimics": mimics, "dofs": 0, "frames": 0,
             "skipped": [], "fixed": [], "left": [], "rounding": {}, "above": {}, "fault": ""}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of what is no part of these dynamics
            model, robot, why = load(path, floating)
    except NotCompared as error:
        return {**found, "skipped": [str(error)]}
    except Differs as error:
        return {**found, "fault": str(error)}
    bodies = {frame.name for frame in model.frames if frame.type == pin.BODY}
    if bodies - set(robot.frames):
        return {**found, "fault": f"without frame '{min(bodies - set(robot.frames))}'"}
    names = sorted(bodies)
    hand = deepest(model, names)
    asked = robot.replace(frames=[hand], wants=["operational"])
    weighs = pin.computeTotalMass(model) > 0
    left = [] if weighs else ["centre of mass, momenta: nothing weighs"]
    for state in zip(*pinocchio_states(model, STATES, 1)):
        for quantity, ours, theirs, *floor in compared(model, robot, names, state):
            if weighs or quantity not in OF_THE_CENTRE:
                record(found, quantity, ours, theirs, *floor)
        try:
            record(found, OPERATIONAL, *operational(model, asked, hand, state[0]))
        except kalmarm.DynamicsError:
            left = [*dict.fromkeys([*left, f"{OPERATIONAL}: M is singular"])]
    return {**found, "floating": robot.nq != robot.nv, "fixed": [why] if why else [], "left": left,
            "dofs": robot.nv, "frames": len(names)}


def record(found, quantity, ours, theirs, floor=0.0, rounding=0.0):
    """Notes the error, and whether it is above the bound: more than that, and than rounding."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    difference = float(np.abs(ours - theirs).max())
    size = max(float(np.abs(theirs).max()), floor)
    error = difference / size if size else difference
    error = error if error == error else np.inf
    found["errors"][quantity] = max(found["errors"].get(quantity, 0.0), error)
    if error > BOUNDS[quantity]:
        kind = "rounding" if difference <= rounding else "above"
        found[kind][quantity] = max(found[kind].get(quantity, 0.0), error)


def compared(model, robot, names, state):
    """Quantity, ours, theirs and the least size by which the difference is measured: where motions
    cancel, or all is in one place, what they are made of. Then, of sums that cancel in Pinocchio
    alone, what four roundings of their largest summands may leave."""
    q_pin, v_pin, a_pin = state
    ours, data = kalmarm.PinocchioStates(model), model.createData()
    q, qd = ours.q(q_pin), ours.qd(q_pin, v_pin)
    T = turned(ours, q_pin, model.nv)
    at_zero = ours.a(q_pin, v_pin, np.zeros(model.nv))  # Pinocchio's a of qdd = 0
    frames = [model.getFrameId(name, pin.BODY) for name in names]
    speed = np.abs(v_pin).max()

    of = robot.kinematics(names)
    results = ["positions", "rotations", "jacobians", "accelerations", "center", "center_jacobian",
               "momentum_matrix", "momentum", "momentum_rate", "coriolis", "kinetic_energy",
               "potential_energy"]
    aligned = of.compute(results, q, qd)
    local = of.compute(["jacobians", "accelerations"], q, qd, axes="local")
    qdd = ours.qdd(q_pin, v_pin, a_pin)
    regressor = of.compute(["regressor"], q, qd, qdd)["regressor"]

    pin.forwardKinematics(model, data, q_pin, v_pin, at_zero)
    pin.computeJointJacobians(model, data, q_pin)
    pin.updateFramePlacements(model, data)
    places = [data.oMf[i] for i in frames]
    positions = np.array([one.translation for one in places])
    length = max(np.linalg.norm(positions, axis=1).max(), SHORTEST)
    yield "positions", aligned["positions"], positions, length
    yield "rotations", aligned["rotations"], [one.rotation for one in places], 1.0
    for axes, found, acceleration in (
        (pin.LOCAL_WORLD_ALIGNED, aligned, pin.getFrameClassicalAcceleration),
        (pin.LOCAL, local, pin.getFrameAcceleration),
    ):
        where = "local" if axes == pin.LOCAL else "aligned"
        J = [pin.getFrameJacobian(model, data, i, axes)[LINEAR_FIRST] for i in frames]
        J = np.reshape(J, (-1, 6, model.nv))  # of one DoF Pinocchio's are vectors
        a = [acceleration(model, data, i, axes).vector[LINEAR_FIRST] for i in frames]
        yield f"J, {where}", found["jacobians"] @ T, J, length
        yield f"dJ/dt qd, {where}", found["accelerations"], a, np.abs(J).max() * speed**2

    # Pinocchio adds inertias about the base's origin, and moves the sum to the centre of mass.
    mass = pin.computeTotalMass(model)
    rounding = 4 * np.finfo(float).eps * mass * max(length, 1.0) ** 2
    yield "centre of mass", aligned["center"], pin.centerOfMass(model, data, q_pin), length
    J = pin.jacobianCenterOfMass(model, data, q_pin).reshape(3, -1)
    yield "its Jacobian", aligned["center_jacobian"] @ T, J, length
    pin.ccrba(model, data, q_pin, v_pin)
    A, momentum = data.Ag.reshape(6, -1)[LINEAR_FIRST], data.hg.vector[LINEAR_FIRST]
    yield "centroidal matrix", aligned["momentum_matrix"] @ T, A, 0.0, rounding
    yield "momentum", aligned["momentum"], momentum, np.abs(A).max() * speed, rounding * speed
    pin.computeCentroidalMomentumTimeVariation(model, data, q_pin, v_pin, at_zero)
    rate = data.dhg.vector[LINEAR_FIRST]
    yield "its rate", aligned["momentum_rate"], rate, np.abs(A).max() * speed**2

    M, dT = robot.mass_matrix(q), turning(model, T, v_pin)
    C = pin.computeCoriolisMatrix(model, data, q_pin, v_pin).reshape(M.shape)
    of_v = T.T @ (M @ dT + aligned["coriolis"] @ T)
    yield "C", of_v, C, np.abs(M).max() * speed, rounding * speed
    Y = pin.computeJointTorqueRegressor(model, data, q_pin, v_pin, a_pin).reshape(model.nv, -1)
    yield "regressor", T.T @ regressor @ of_links(model, robot, names), Y
    kinetic = pin.computeKineticEnergy(model, data, q_pin, v_pin)
    yield "kinetic energy", aligned["kinetic_energy"], kinetic
    potential = pin.computePotentialEnergy(model, data, q_pin)
    g = np.linalg.norm(model.gravity.linear)
    yield "potential energy", aligned["potential_energy"], potential, mass * g * length


def operational(model, robot, frame, q_pin):
    """J M^-1 J' of one frame in its axes, ours and Pinocchio's."""
    ours, data = kalmarm.PinocchioStates(model), model.createData()
    at = model.getFrameId(frame, pin.BODY)
    J = pin.computeFrameJacobian(model, data, q_pin, at, pin.LOCAL).reshape(6, -1)[LINEAR_FIRST]
    inverse = np.triu(pin.computeMinverse(model, data, q_pin).reshape(model.nv, -1))
    inverse += np.triu(inverse, 1).T
    return robot.operational(ours.q(q_pin)), J @ inverse @ J.T
