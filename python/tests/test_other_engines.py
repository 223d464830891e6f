"""Every line of docs/from-other-engines.md: the calls of MuJoCo and Pinocchio that it names and
ours, within the bound that it gives."""

import inspect
import re
import warnings
from functools import cache
from pathlib import Path

import mujoco
import mujoco.rollout
import numpy as np
import pinocchio as pin
import pytest
from conftest import (
    BY_JOINTS, as_fext, as_forces, file_of, load, of_joints, without_other_forces,
)  # fmt: skip
from conventions import LINEAR_FIRST, of_links, pinocchio_states, turned, turning

import kalmarm

ROBOTS = ["iiwa14", "go2", "g1"]
PAGE = Path(__file__).parents[2] / "docs" / "from-other-engines.md"
HEAD = "| MuJoCo | Pinocchio | Drake | here | conventions | differ by |"
CODE = re.compile(r"`([^`]+)`")
CHECKS = {}


def rows():
    """Cells of every row, by its identifier: the first code in "here", or all of that."""
    found = {}
    for line in PAGE.read_text().splitlines():
        if not line.startswith("|") or line == HEAD or line.startswith("|---"):
            continue
        cells = [cell.strip() for cell in line[1:-1].split("|")]
        assert len(cells) == 6, line
        here = CODE.search(cells[3])
        name = here[1] if here else cells[3]
        assert name not in found, f"two rows are of {name}"
        found[name] = cells
    return found


ROWS = rows()


def check(name):
    """What is registered yields pairs of ours and theirs, and where that is not the largest entry
    of theirs the size by which their difference is measured."""

    def register(function):
        assert name not in CHECKS
        CHECKS[name] = function
        return function

    return register


class Engines:
    """One robot in three engines, and one random state of it in the conventions of each."""

    def __init__(self, name):
        self.name, self.robot = name, load(name)
        self.mujoco = without_other_forces(mujoco.MjModel.from_xml_path(str(file_of(name))))
        self.pinocchio = pin.buildModelFromMJCF(str(file_of(name)))
        self.pinocchio.damping[:] = 0
        self.pinocchio.friction[:] = 0
        self.nv, self.free = self.robot.nv, self.robot.nq != self.robot.nv
        self.states = kalmarm.PinocchioStates(self.pinocchio)
        many = pinocchio_states(self.pinocchio, 2, 21)
        (self.q_pin, self.other_pin), (self.v_pin, self.a_pin), (self.tau_pin, self.x_pin) = many
        self.q, self.other = self.states.q(many[0])
        self.qd = self.states.qd(self.q_pin, self.v_pin)
        self.tau, self.x = (self.states.tau(self.q_pin, one) for one in many[2])
        self.qdd = self.states.qdd(self.q_pin, self.v_pin, self.a_pin)
        self.T = turned(self.states, self.q_pin, self.nv)
        self.dT = turning(self.pinocchio, self.T, self.v_pin)
        of_pin = [frame.name for frame in self.pinocchio.frames if frame.type == pin.BODY]
        bodies = [self.mujoco.body(i).name for i in range(1, self.mujoco.nbody)]
        self.bodies = [one for one in bodies if one in of_pin]
        assert len(self.bodies) > 5
        self.ids = [self.mujoco.body(one).id for one in self.bodies]
        self.frames = [self.pinocchio.getFrameId(one, pin.BODY) for one in self.bodies]
        moving = [i for i in range(len(self.frames)) if self.parent_joint(i)]
        self.acted_on = moving[:: max(len(moving) // 3, 1)]

    def parent_joint(self, i):
        return self.pinocchio.frames[self.frames[i]].parentJoint

    def forwarded(self):
        """MuJoCo's data in the state."""
        data = mujoco.MjData(self.mujoco)
        data.qpos, data.qvel, data.qfrc_applied = self.q, self.qd, self.tau
        mujoco.mj_forward(self.mujoco, data)
        return data

    def moved(self, a=None):
        """Pinocchio's data in the state, of a = 0 unless it is given."""
        data = self.pinocchio.createData()
        a = np.zeros(self.nv) if a is None else a
        pin.forwardKinematics(self.pinocchio, data, self.q_pin, self.v_pin, a)
        pin.computeJointJacobians(self.pinocchio, data, self.q_pin)
        pin.updateFramePlacements(self.pinocchio, data)
        return data

    def compute(self, result, *motion, **axes):
        return self.robot.kinematics(self.bodies).compute([result], self.q, *motion, **axes)[result]

    def jacobians(self, data):
        """MuJoCo's, of all bodies."""
        J = np.zeros((len(self.ids), 2, 3, self.nv))
        for to, body in zip(J, self.ids):
            mujoco.mj_jacBody(self.mujoco, data, to[1], to[0], body)
        return J.reshape(-1, 6, self.nv)


engines = cache(Engines)


# --- states and conventions


@check("q")
def _(at):
    data, there = at.forwarded(), at.moved()
    found = at.compute("velocities", at.qd)
    yield (
        found[:, 3:],
        [
            pin.getFrameVelocity(at.pinocchio, there, i, pin.LOCAL_WORLD_ALIGNED).linear
            for i in at.frames
        ],
    )
    yield found, at.jacobians(data) @ data.qvel
    yield [x.dtype == np.float32 for x in at.robot.random_state(0, dtype=np.float32)], [True] * 3


@check("nq")
def _(at):
    robot = at.robot
    yield [robot.nq, robot.nv, robot.n], [at.mujoco.nq, at.mujoco.nv, at.mujoco.nv]
    yield [robot.nq, robot.nv], [at.pinocchio.nq, at.pinocchio.nv]
    model, ours = every_joint()
    continuous = sum(joint.shortname().startswith("JointModelRUB") for joint in model.joints)
    continuous += sum("RevoluteUnbounded" in joint.shortname() for joint in model.joints)
    planar = sum(joint.shortname() == "JointModelPlanar" for joint in model.joints)
    yield [ours.nq + continuous + planar, ours.nv], [model.nq, model.nv]


@cache
def every_joint():
    model = of_joints(BY_JOINTS["every kind of joint"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return model, kalmarm.from_pinocchio(model)


@check("PinocchioStates.q")
def _(at):
    yield at.states.q(at.q_pin)[at.robot.nq - at.nv + at.nv % 6 :][-5:], at.q_pin[-5:]
    if at.free:
        x, y, z, w = at.q_pin[3:7]
        yield at.states.q(at.q_pin)[:7], [*at.q_pin[:3], w, x, y, z]
    data, there = at.forwarded(), at.moved()
    yield data.xpos[at.ids], [there.oMf[i].translation for i in at.frames]
    yield data.xmat[at.ids].reshape(-1, 3, 3), [there.oMf[i].rotation for i in at.frames]


@check("quaternions of any length")
def _(at):
    q, q_pin = at.q.copy(), at.q_pin.copy()
    if at.free:
        q[3:7] *= 3
        q_pin[3:7] *= 3
    expected = at.robot.forward_dynamics(at.q, at.qd, at.tau)
    yield at.robot.forward_dynamics(q, at.qd, at.tau), expected
    yield at.robot.integrate(q, at.qd), at.robot.integrate(at.q, at.qd)
    yield at.states.q(pin.normalize(at.pinocchio, q_pin)), at.q
    data = at.forwarded()
    data.qpos = q
    mujoco.mj_forward(at.mujoco, data)
    yield expected, data.qacc
    mujoco.mj_normalizeQuat(at.mujoco, q)
    yield q, at.q


@check("PinocchioStates.qd")
def _(at):
    data, there = at.forwarded(), at.moved()
    yield (
        at.jacobians(data) @ at.qd,
        [
            pin.getFrameVelocity(at.pinocchio, there, i, pin.LOCAL_WORLD_ALIGNED).vector[
                LINEAR_FIRST
            ]
            for i in at.frames
        ],
    )
    if at.free:
        R = pin.Quaternion(at.q_pin[3:7]).matrix()
        yield at.states.qd(at.q_pin, at.v_pin)[:6], [*R @ at.v_pin[:3], *at.v_pin[3:6]]


@check("PinocchioStates.qdd")
def _(at):
    yield at.qdd, at.T @ at.a_pin + at.dT @ at.v_pin
    yield at.states.a(at.q_pin, at.v_pin, at.qdd), at.a_pin
    data = at.forwarded()
    data.qacc = at.qdd
    mujoco.mj_inverse(at.mujoco, data)
    truth = pin.rnea(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin, at.a_pin)
    yield at.T.T @ data.qfrc_inverse, truth


@check("tau")
def _(at):
    yield at.tau, at.T @ at.tau_pin
    yield at.tau @ at.qd, at.tau_pin @ at.v_pin
    data = at.forwarded()
    a = pin.aba(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin, at.tau_pin)
    yield at.states.qdd(at.q_pin, at.v_pin, a), data.qacc


@check("an angle")
def _(at):
    model, robot = every_joint()
    ours = kalmarm.PinocchioStates(model)
    (joint,) = (one for one in model.joints if one.shortname() == "JointModelRUBX")
    q = pin.neutral(model)
    dof = robot.dof(model.names[joint.id])
    for angle in (0.3, -3.0):
        q[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
        found = ours.q(q)
        yield found[robot.model.q_index[dof]], angle
        turns = found.copy()
        turns[robot.model.q_index[dof]] += 4 * np.pi
        yield robot.mass_matrix(turns), robot.mass_matrix(found)
        T = turned(ours, q, model.nv)
        M = np.triu(pin.crba(model, model.createData(), q))
        yield T.T @ robot.mass_matrix(found) @ T, M + np.triu(M, 1).T


URDF = """<robot name="r"><link name="base"/>
 <link name="arm"><inertial><origin xyz=".1 .2 .3"/><mass value="2"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="hand"><inertial><origin xyz=".3 .1 .1"/><mass value="1"/>
  <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><link name="tool"/>
 <joint name="z" type="continuous"><parent link="base"/><child link="arm"/></joint>
 <joint name="a" type="prismatic"><parent link="base"/><child link="hand"/>
  <origin xyz="0 .2 .4" rpy=".1 .2 .3"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
 <joint name="f" type="fixed"><parent link="hand"/><child link="tool"/>
  <origin xyz=".1 0 .2" rpy="1 2 3"/></joint></robot>"""


def of_urdf(tmp, **options):
    path = tmp / "r.urdf"
    path.write_text(URDF)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(path, **options)


@check('load(…, dof_order="pinocchio")')
def _(at, tmp):
    model = mujoco.MjModel.from_xml_string(URDF)
    of_mujoco = [model.joint(i).name for i in range(model.njnt)]
    of_pinocchio = list(pin.buildModelFromXML(URDF).names)[1:]
    assert of_mujoco != of_pinocchio
    yield of_urdf(tmp).dofs == of_mujoco, True
    yield of_urdf(tmp, dof_order="pinocchio").dofs == of_pinocchio, True
    last = range(at.mujoco.njnt - 5, at.mujoco.njnt)
    yield at.robot.dofs[-5:] == [at.mujoco.joint(i).name for i in last], True
    yield at.robot.dofs[-5:] == list(at.pinocchio.names)[-5:], True


@check("robot.dof(joint)")
def _(at):
    of = at.robot.model.q_index
    for i in range(at.mujoco.njnt):
        joint = at.mujoco.joint(i)
        if at.free and i == 0:
            yield at.robot.dofs[0].endswith(":x") and at.robot.dofs[5].endswith(":r:z"), True
            continue
        dof = at.robot.dof(joint.name)
        yield [dof, of[dof]], [at.mujoco.jnt_dofadr[i], at.mujoco.jnt_qposadr[i]]
        there = at.pinocchio.joints[at.pinocchio.getJointId(joint.name)]
        yield [dof, of[dof]], [there.idx_v, there.idx_q]


@check("armature")
def _(at):
    model, other = mujoco.MjModel.from_xml_path(str(file_of(at.name))), at.pinocchio.copy()
    added = np.zeros(at.nv)
    added[-5:] = np.arange(1.0, 6.0)
    model.dof_armature += added
    other.armature += added
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        robot = kalmarm.from_mujoco(model)
    M = at.robot.mass_matrix(at.q) + np.diag(added)
    yield robot.mass_matrix(at.q), M
    yield at.T.T @ M @ at.T, pin.crba(other, other.createData(), at.q_pin)
    with_it = pin.rnea(other, other.createData(), at.q_pin, at.v_pin, at.a_pin)
    yield at.T.T @ robot.inverse_dynamics(at.q, at.qd, at.qdd), with_it


@check("robot.model.gravity")
def _(at):
    yield at.robot.model.gravity, at.mujoco.opt.gravity
    yield at.robot.model.gravity, at.pinocchio.gravity.linear


@check("load(path)")
def _(at):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        model = mujoco.MjModel.from_xml_path(str(file_of(at.name)))
        robots = kalmarm.from_mujoco(model), kalmarm.from_pinocchio(at.pinocchio)
    same = pin.buildModelFromMJCF(str(file_of(at.name)))
    yield same.nv, at.nv
    for robot in robots:
        yield robot.mass_matrix(at.q), at.robot.mass_matrix(at.q)


@check("Builder.add_body")
def _(at):
    rng = np.random.default_rng(4)
    spec, model, builder, parent = mujoco.MjSpec(), pin.Model(), kalmarm.Builder(), 0
    body, ours = spec.worldbody, -1
    for i in range(3):
        quaternion, position, center = rng.standard_normal(4), *rng.standard_normal((2, 3))
        quaternion /= np.linalg.norm(quaternion)
        w, x, y, z = quaternion
        placement = pin.SE3(pin.Quaternion(w, x, y, z).matrix(), position)
        moments, mass = np.array([1.0, 1.2, 1.4]), 1.0 + i
        body = body.add_body(name=f"b{i}", pos=position, quat=quaternion)
        body.mass, body.ipos, body.inertia, body.explicitinertial = mass, center, moments, True
        body.add_joint(name=f"j{i}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
        parent = model.addJoint(parent, pin.JointModelRY(), placement, f"j{i}")
        inertia = pin.Inertia(mass, center, np.diag(moments))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        ours = builder.add_body(
            f"b{i}", parent=ours, joint="hinge", axis=(0, 1, 0), position=position,
            rotation=quaternion, mass=mass, center_of_mass=center, inertia=np.diag(moments),
        )  # fmt: skip
    q = rng.standard_normal(3)
    compiled = spec.compile()
    data, M = mujoco.MjData(compiled), np.empty((3, 3))
    data.qpos = q
    mujoco.mj_forward(compiled, data)
    mujoco.mj_fullM(compiled, data, M)
    robot = builder.build()
    yield robot.mass_matrix(q), M
    yield robot.mass_matrix(q), pin.crba(model, model.createData(), q)


@check("load(…, locked=joints, q=q)")
def _(at):
    locked = at.robot.dofs[-3:-1]
    ids = [at.pinocchio.getJointId(one) for one in locked]
    model = pin.buildReducedModel(at.pinocchio, ids, at.q_pin)
    robot = load(at.name, locked=locked, q=at.q)
    kept = [i for i in range(at.nv) if at.robot.dofs[i] not in locked]
    keep = [i for i in range(at.pinocchio.nq) if i - at.pinocchio.nq not in (-3, -2)]
    q, v, tau = at.q_pin[keep], at.v_pin[kept], at.tau_pin[kept]
    a = pin.aba(model, model.createData(), q, v, tau)
    found = robot.forward_dynamics(at.q, at.qd, at.tau)
    yield found, kalmarm.PinocchioStates(model).qdd(q, v, a)
    same = at.robot.replace(locked=locked, q=at.q).forward_dynamics(at.q, at.qd, at.tau)
    yield same, found
    yield [len(found), robot.n], [at.nv - 2, at.nv - 2]
    qd, tau = at.qd.copy(), at.tau.copy()
    qd[-3:-1], tau[-3:-1] = np.nan, np.nan
    yield robot.forward_dynamics(at.q, qd, tau), found


# --- dynamics


@check("forward_dynamics(q, qd, tau)")
def _(at):
    found = at.robot.forward_dynamics(at.q, at.qd, at.tau)
    yield found, at.forwarded().qacc  # mj_forward
    a = pin.aba(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin, at.tau_pin)
    yield found, at.states.qdd(at.q_pin, at.v_pin, a)


@check("inverse_dynamics(q, qd, qdd)")
def _(at):
    data, without = at.forwarded(), np.empty(at.nv)
    data.qacc = at.qdd
    mujoco.mj_inverse(at.mujoco, data)
    found = at.robot.inverse_dynamics(at.q, at.qd, at.qdd)
    yield found, data.qfrc_inverse
    mujoco.mj_rne(at.mujoco, data, 1, without)
    yield found - at.mujoco.dof_armature * at.qdd, without
    truth = pin.rnea(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin, at.a_pin)
    yield at.T.T @ found, truth


@check("bias(q, qd)")
def _(at):
    found = at.robot.bias(at.q, at.qd)
    yield found, at.forwarded().qfrc_bias
    truth = pin.nonLinearEffects(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin)
    beside = at.robot.mass_matrix(at.q) @ at.dT @ at.v_pin  # qdd = T a + dT/dt v
    yield at.T.T @ (found + beside), truth


@check("gravity(q)")
def _(at):
    data = at.forwarded()
    data.qvel = 0
    mujoco.mj_forward(at.mujoco, data)
    found = at.robot.gravity(at.q)
    yield found, data.qfrc_bias
    truth = pin.computeGeneralizedGravity(at.pinocchio, at.pinocchio.createData(), at.q_pin)
    yield at.T.T @ found, truth
    yield found @ at.qd, 9.81 * at.compute("momentum", at.qd)[5]  # what power lifts


@check("mass_matrix(q)")
def _(at):
    M = np.empty((at.nv, at.nv))
    mujoco.mj_fullM(at.mujoco, at.forwarded(), M)
    found = at.robot.mass_matrix(at.q)
    yield found, M
    yield at.T.T @ found @ at.T, pin.crba(at.pinocchio, at.pinocchio.createData(), at.q_pin)


@check("mass_matrix(q) @ x")
def _(at):
    product = np.empty(at.nv)
    mujoco.mj_mulM(at.mujoco, at.forwarded(), product, at.x)
    found = at.robot.mass_matrix(at.q) @ at.x
    yield found, product
    yield at.robot.inverse_dynamics(at.q, 0.0, at.x) - at.robot.gravity(at.q), product
    M = pin.crba(at.pinocchio, at.pinocchio.createData(), at.q_pin)
    yield at.T.T @ found, M @ at.T.T @ at.x


def inverse_of_mujoco(at, rhs=None):
    rhs = np.eye(at.nv) if rhs is None else rhs
    out = np.empty_like(rhs)
    mujoco.mj_solveM(at.mujoco, at.forwarded(), out, rhs)
    return out


def inverse_of_pinocchio(at):
    return pin.computeMinverse(at.pinocchio, at.pinocchio.createData(), at.q_pin)


@check("inverse_mass_matrix(q)")
def _(at):
    """By mj_solveM and computeMinverse."""
    found = at.robot.inverse_mass_matrix(at.q)
    yield found, inverse_of_mujoco(at)
    yield at.T.T @ found @ at.T, inverse_of_pinocchio(at)


@check("diagonal(q)")
def _(at):
    """By computeMinverse."""
    found = at.robot.diagonal(at.q)
    yield found, np.diag(at.T @ inverse_of_pinocchio(at) @ at.T.T)


@check("solve(q, tau)")
def _(at):
    both = np.stack([at.tau, at.x])
    found = at.robot.solve(at.q, both)
    yield found, inverse_of_mujoco(at, both)  # mj_solveM
    data = at.pinocchio.createData()
    pin.crba(at.pinocchio, data, at.q_pin)
    pin.cholesky.decompose(at.pinocchio, data)
    yield at.T.T @ found[0], pin.cholesky.solve(at.pinocchio, data, at.tau_pin)


@check("factor(q).solve(tau)")
def _(at):
    both = np.stack([at.tau, at.x])
    found = at.robot.factor(at.q).solve(both)
    data, out = at.forwarded(), np.empty_like(both)
    mujoco.mj_factorM(at.mujoco, data)
    mujoco.mj_solveM(at.mujoco, data, out, both)
    yield found, out
    there = at.pinocchio.createData()
    pin.crba(at.pinocchio, there, at.q_pin)
    pin.cholesky.decompose(at.pinocchio, there)
    for one, tau in zip(found, (at.tau_pin, at.x_pin)):
        yield at.T.T @ one, pin.cholesky.solve(at.pinocchio, there, tau)


@check("log_det(q)")
def _(at):
    found = at.robot.log_det(at.q)
    yield found, -np.log(at.forwarded().qLDiagInv).sum()
    data = at.pinocchio.createData()
    pin.crba(at.pinocchio, data, at.q_pin)
    pin.cholesky.decompose(at.pinocchio, data)
    yield found, np.log(data.D).sum()


@check("forward_dynamics_derivatives(q, qd, tau)")
def _(at):
    d = at.robot.forward_dynamics_derivatives(at.q, at.qd, at.tau)
    data = at.pinocchio.createData()
    pin.computeABADerivatives(at.pinocchio, data, at.q_pin, at.v_pin, at.tau_pin)
    truth = at.states.derivatives(
        at.q_pin, at.v_pin, at.tau_pin, data.ddq, data.ddq_dq, data.ddq_dv, data.Minv
    )
    yield from zip((d.dq, d.dqd, d.dtau), truth)
    yield d.a, at.forwarded().qacc
    # of an explicit step, by differences
    model = without_other_forces(mujoco.MjModel.from_xml_path(str(file_of(at.name))))
    h, A = 1e-3, np.zeros((2 * at.nv, 2 * at.nv))
    model.opt.timestep = h
    there = mujoco.MjData(model)
    there.qpos, there.qvel, there.qfrc_applied = at.q, at.qd, at.tau
    mujoco.mjd_transitionFD(model, there, 1e-6, True, A, None, None, None)
    differences = np.hstack([h * d.dq, np.eye(at.nv) + h * d.dqd]) - A[at.nv :]
    assert np.abs(differences).max() < 1e-6 * np.abs(A[at.nv :]).max()


@check("-mass_matrix(q) @ d.dq")
def _(at):
    d = at.robot.forward_dynamics_derivatives(at.q, at.qd, at.tau)
    M = at.robot.mass_matrix(at.q)
    ours = -M @ d.dq, -M @ d.dqd, M
    data, theirs = at.forwarded(), np.zeros((3, at.nv, at.nv))
    data.qacc = d.a
    mujoco.mjd_inverseFD(at.mujoco, data, 1e-7, False, *theirs, *[None] * 4)
    for one, other in zip(ours, theirs):
        yield one, other.T
    if not at.free:
        there = at.pinocchio.createData()
        of_pinocchio = pin.computeRNEADerivatives(at.pinocchio, there, at.q_pin, at.v_pin, d.a)
        yield from zip(ours, of_pinocchio)


def random_vectors(at, count):
    return np.random.default_rng(58).standard_normal((count, at.nv))


def derivatives_of_pinocchio(at, model, v, tau):
    """(dq, dqd, dtau) of a, in our conventions."""
    data = model.createData()
    pin.computeABADerivatives(model, data, at.q_pin, v, tau)
    return at.states.derivatives(at.q_pin, v, tau, data.ddq, data.ddq_dq, data.ddq_dv, data.Minv)


@check("forward_dynamics_vjp(q, qd, tau, w)")
def _(at):
    """By computeABADerivatives."""
    w, *along = random_vectors(at, 4)
    truth = derivatives_of_pinocchio(at, at.pinocchio, at.v_pin, at.tau_pin)
    found = at.robot.forward_dynamics_vjp(at.q, at.qd, at.tau, w)
    yield from zip((found.dq, found.dqd, found.dtau), (w @ J for J in truth))
    da = at.robot.forward_dynamics_jvp(at.q, at.qd, at.tau, *along)
    yield da, sum(J @ x for J, x in zip(truth, along))


@check("inverse_dynamics_vjp(q, qd, qdd, w)")
def _(at):
    w, *along = random_vectors(at, 4)
    a, M = at.forwarded().qacc, at.robot.mass_matrix(at.q)
    found = at.robot.inverse_dynamics_vjp(at.q, at.qd, a, w, inertias=True)
    dtau = at.robot.inverse_dynamics_jvp(at.q, at.qd, a, *along)
    if at.free:
        da_dq, da_dqd, _ = derivatives_of_pinocchio(at, at.pinocchio, at.v_pin, at.tau_pin)
        truth = -M @ da_dq, -M @ da_dqd, M
    else:
        there = at.pinocchio.createData()
        truth = *pin.computeRNEADerivatives(at.pinocchio, there, at.q_pin, at.v_pin, a)[:2], M
    yield from zip((found.dq, found.dqd, found.dqdd), (w @ J for J in truth))
    yield dtau, sum(J @ x for J, x in zip(truth, along))
    yield found.inertias.ravel(), w @ at.compute("regressor", at.qd, a)


@check("solve_vjp(q, tau, w)")
def _(at):
    """By computeABADerivatives."""
    w, dq, dtau = random_vectors(at, 3)
    weightless = at.pinocchio.copy()
    weightless.gravity = pin.Motion.Zero()
    truth = derivatives_of_pinocchio(at, weightless, np.zeros(at.nv), at.tau_pin)
    found = at.robot.solve_vjp(at.q, at.tau, w)
    yield found.dq, w @ truth[0]
    yield found.dtau, w @ truth[2]
    assert found.dqd is found.dqdd is None
    dx = at.robot.solve_jvp(at.q, at.tau, dq, dtau)
    yield dx, truth[0] @ dq + truth[2] @ dtau


@check('compute(["coriolis"], q, qd)')
def _(at):
    C, M = at.compute("coriolis", at.qd), at.robot.mass_matrix(at.q)
    truth = pin.computeCoriolisMatrix(at.pinocchio, at.pinocchio.createData(), at.q_pin, at.v_pin)
    yield at.T.T @ (M @ at.dT + C @ at.T), truth
    yield C @ at.qd, at.robot.bias(at.q, at.qd) - at.robot.gravity(at.q)


@check('compute(["regressor"], q, qd, qdd)')
def _(at):
    Y = at.compute("regressor", at.qd, at.qdd)
    L = of_links(at.pinocchio, at.robot, at.bodies)
    data = at.pinocchio.createData()
    truth = pin.computeJointTorqueRegressor(at.pinocchio, data, at.q_pin, at.v_pin, at.a_pin)
    yield at.T.T @ Y @ L, truth
    pi = np.concatenate([one.toDynamicParameters() for one in list(at.pinocchio.inertias)[1:]])
    rotors = at.mujoco.dof_armature * at.qdd
    yield Y @ L @ pi + rotors, at.robot.inverse_dynamics(at.q, at.qd, at.qdd)
    torques = pin.rnea(at.pinocchio, data, at.q_pin, at.v_pin, at.a_pin)
    yield truth @ pi + at.pinocchio.armature * at.a_pin, torques


@check("solve(q, -Y.T).T")
def _(at):
    robot, L = at.robot, of_links(at.pinocchio, at.robot, at.bodies)

    def accelerations(d):
        """By Pinocchio, of parameters that are larger by d."""
        model = at.pinocchio.copy()
        for i in range(1, model.njoints):
            pi = model.inertias[i].toDynamicParameters() + d[10 * i - 10 : 10 * i]
            model.inertias[i] = pin.Inertia.FromDynamicParameters(pi)
        a = pin.aba(model, model.createData(), at.q_pin, at.v_pin, at.tau_pin)
        return a, at.states.qdd(at.q_pin, at.v_pin, a)

    a_pin, a = accelerations(np.zeros(L.shape[1]))
    by_pi = robot.solve(at.q, -at.compute("regressor", at.qd, a).T).T @ L
    data = at.pinocchio.createData()
    Y = pin.computeJointTorqueRegressor(at.pinocchio, data, at.q_pin, at.v_pin, a_pin)
    yield at.T.T @ by_pi, -inverse_of_pinocchio(at) @ Y  # computeMinverse
    d = np.zeros(L.shape[1])
    d[-10:] = 0.3 * at.pinocchio.inertias[at.pinocchio.njoints - 1].toDynamicParameters()
    after = accelerations(d)[1]
    Y = at.compute("regressor", at.qd, after)
    yield robot.solve(at.q, -Y @ L @ d), after - a, np.abs(after).max()
    h, stencil = 0.1, {-3: -1, -2: 9, -1: -45, 1: 45, 2: -9, 3: 1}  # error h^6
    difference = sum(w * accelerations(i * h * d)[1] for i, w in stencil.items()) / (60 * h)
    assert np.abs(by_pi @ d - difference).max() < 1e-6 * np.abs(difference).max()


# --- frames


@check("robot.frames")
def _(at, tmp):
    sites = [at.mujoco.site(i).name for i in range(at.mujoco.nsite)]
    yield {*at.bodies, *sites, "world"} <= set(at.robot.frames), True
    robot, model = of_urdf(tmp, frames=["tool"]), pin.buildModelFromXML(URDF)
    yield {"base", "arm", "hand", "tool"} <= set(robot.frames), True
    yield (
        mujoco.mj_name2id(mujoco.MjModel.from_xml_string(URDF), mujoco.mjtObj.mjOBJ_BODY, "tool"),
        -1,
    )
    q, data = np.array([0.3, 0.2]), model.createData()  # z, a
    pin.framesForwardKinematics(model, data, np.array([q[1], np.cos(q[0]), np.sin(q[0])]))
    place = data.oMf[model.getFrameId("tool")]
    found = robot.kinematics().compute(["positions", "rotations"], q)
    yield found["positions"][0], place.translation
    yield found["rotations"][0], place.rotation


@check('compute(["positions"], q)')
def _(at):
    data, there = at.forwarded(), at.moved()  # updateFramePlacements
    found = at.compute("positions")
    yield found, data.xpos[at.ids]
    yield found, [there.oMf[i].translation for i in at.frames]
    sites = map(at.mujoco.site, range(at.mujoco.nsite))
    sites = [one for one in sites if one.name not in at.bodies]
    if sites:
        of = at.robot.kinematics([one.name for one in sites]).compute(["positions"], at.q)
        yield of["positions"], data.site_xpos[[one.id for one in sites]]


@check('compute(["rotations"], q)')
def _(at):
    data, there = at.forwarded(), at.moved()
    found = at.compute("rotations")
    yield found, data.xmat[at.ids].reshape(-1, 3, 3)
    yield found, [there.oMf[i].rotation for i in at.frames]


@check('compute(["quaternions"], q)')
def _(at):
    data, there = at.forwarded(), at.moved()
    found = at.compute("quaternions")
    assert np.all(found[:, 0] >= 0)
    by_matrix = np.empty(4)
    for one, body, frame in zip(found, at.ids, at.frames):
        mujoco.mju_mat2Quat(by_matrix, data.xmat[body])
        x, y, z, w = pin.Quaternion(there.oMf[frame].rotation).coeffs()
        for quaternion in (data.xquat[body], by_matrix, np.array([w, x, y, z])):
            yield one, np.sign(quaternion @ one) * quaternion


@check('compute(["jacobians"], q)')
def _(at):
    data, there = at.forwarded(), at.moved()  # mj_jacBody, computeJointJacobians
    found = at.compute("jacobians")
    yield found, at.jacobians(data)
    yield at.compute("jacobians", axes="aligned"), found
    theirs = [
        pin.getFrameJacobian(at.pinocchio, there, i, pin.LOCAL_WORLD_ALIGNED)[LINEAR_FIRST]
        for i in at.frames
    ]
    yield found @ at.T, theirs
    for i in range(at.mujoco.nsite):
        name, J = at.mujoco.site(i).name, np.zeros((2, 3, at.nv))
        mujoco.mj_jacSite(at.mujoco, data, J[1], J[0], i)
        if name not in at.bodies:
            of = at.robot.kinematics([name]).compute(["jacobians"], at.q)["jacobians"]
            yield of[0], J.reshape(6, at.nv)


@check('compute(["jacobians"], q, axes="local")')
def _(at):
    there = at.moved()
    for axes, reference in (("local", pin.LOCAL), ("world", pin.WORLD)):
        yield (
            at.compute("jacobians", axes=axes) @ at.T,
            [
                pin.getFrameJacobian(at.pinocchio, there, i, reference)[LINEAR_FIRST]
                for i in at.frames
            ],
        )


REFERENCES = {"aligned": pin.LOCAL_WORLD_ALIGNED, "local": pin.LOCAL, "world": pin.WORLD}


@check('compute(["velocities"], q, qd)')
def _(at):
    data, there = at.forwarded(), at.moved()
    for axes, reference in REFERENCES.items():
        found = at.compute("velocities", at.qd, axes=axes)
        yield found, at.compute("jacobians", axes=axes) @ at.qd
        yield (
            found,
            [
                pin.getFrameVelocity(at.pinocchio, there, i, reference).vector[LINEAR_FIRST]
                for i in at.frames
            ],
        )
        if axes != "world":
            theirs, kind = np.empty_like(found), mujoco.mjtObj.mjOBJ_XBODY
            for to, body in zip(theirs, at.ids):
                mujoco.mj_objectVelocity(at.mujoco, data, kind, body, to, axes == "local")
            yield found, theirs
    for i in range(at.mujoco.nsite):
        name, velocity, kind = at.mujoco.site(i).name, np.empty(6), mujoco.mjtObj.mjOBJ_SITE
        mujoco.mj_objectVelocity(at.mujoco, data, kind, i, velocity, 0)
        if name not in at.bodies:
            of = at.robot.kinematics([name]).compute(["velocities"], at.q, at.qd)
            yield of["velocities"][0], velocity


@check('compute(["accelerations"], q, qd, qdd)')
def _(at):
    data, there = at.forwarded(), at.moved(at.a_pin)
    data.qacc = at.qdd
    mujoco.mj_rnePostConstraint(at.mujoco, data)
    found = at.compute("accelerations", at.qd, at.qdd)
    theirs, kind = np.empty_like(found), mujoco.mjtObj.mjOBJ_XBODY
    for to, body in zip(theirs, at.ids):
        mujoco.mj_objectAcceleration(at.mujoco, data, kind, body, to, 0)
    yield found, theirs - [0, 0, 0, *-at.mujoco.opt.gravity]
    for axes, reference in REFERENCES.items():
        aligned = axes == "aligned"
        get = pin.getFrameClassicalAcceleration if aligned else pin.getFrameAcceleration
        yield (
            at.compute("accelerations", at.qd, at.qdd, axes=axes),
            [get(at.pinocchio, there, i, reference).vector[LINEAR_FIRST] for i in at.frames],
        )


@check('compute(["accelerations"], q, qd)')
def _(at):
    data, found = at.forwarded(), at.compute("accelerations", at.qd)
    J = np.zeros((len(at.ids), 2, 3, at.nv))
    for to, body in zip(J, at.ids):
        mujoco.mj_jacDot(at.mujoco, data, to[1], to[0], data.xpos[body].copy(), body)
    yield found, J.reshape(-1, 6, at.nv) @ data.qvel
    there = at.moved()
    pin.computeJointJacobiansTimeVariation(at.pinocchio, there, at.q_pin, at.v_pin)
    of_v = [
        pin.getFrameJacobianTimeVariation(at.pinocchio, there, i, pin.LOCAL_WORLD_ALIGNED)
        for i in at.frames
    ]
    beside = at.compute("jacobians") @ (at.dT @ at.v_pin)  # d(J T)/dt = dJ/dt T + J dT/dt
    yield found + beside, (of_v @ at.v_pin)[:, LINEAR_FIRST]


# --- whole body


@check("center")
def _(at):
    found, data = at.compute("center"), at.pinocchio.createData()
    pin.centerOfMass(at.pinocchio, data, at.q_pin)
    yield found, data.com[0]
    moving = int(at.mujoco.dof_bodyid[0])
    yield found, at.forwarded().subtree_com[moving]


@check("center_velocity")
def _(at):
    there, data = at.pinocchio.createData(), at.forwarded()
    mujoco.mj_subtreeVel(at.mujoco, data)
    pin.centerOfMass(at.pinocchio, there, at.q_pin, at.v_pin, at.a_pin)
    found = at.compute("center_velocity", at.qd)
    yield found, there.vcom[0]
    yield found, data.subtree_linvel[int(at.mujoco.dof_bodyid[0])]
    yield at.compute("center_acceleration", at.qd, at.qdd), there.acom[0]
    a_pin = at.states.a(at.q_pin, at.v_pin, 0 * at.qdd)
    pin.centerOfMass(at.pinocchio, there, at.q_pin, at.v_pin, a_pin)
    yield at.compute("center_acceleration", at.qd), there.acom[0]


@check("center_jacobian")
def _(at):
    J, found = np.empty((3, at.nv)), at.compute("center_jacobian")
    mujoco.mj_jacSubtreeCom(at.mujoco, at.forwarded(), J, int(at.mujoco.dof_bodyid[0]))
    yield found, J
    there = at.pinocchio.createData()
    yield found @ at.T, pin.jacobianCenterOfMass(at.pinocchio, there, at.q_pin)


@check("momentum")
def _(at):
    data, there, found = at.forwarded(), at.pinocchio.createData(), at.compute("momentum", at.qd)
    mujoco.mj_subtreeVel(at.mujoco, data)
    body = int(at.mujoco.dof_bodyid[0])
    yield found[:3], data.subtree_angmom[body]
    yield found[3:], at.mujoco.body_subtreemass[body] * data.subtree_linvel[body]
    pin.ccrba(at.pinocchio, there, at.q_pin, at.v_pin)
    yield found, there.hg.vector[LINEAR_FIRST]


@check("momentum_matrix")
def _(at):
    there, found = at.pinocchio.createData(), at.compute("momentum_matrix")
    yield found @ at.qd, at.compute("momentum", at.qd)
    map_ = pin.computeCentroidalMap(at.pinocchio, there, at.q_pin)
    yield found @ at.T, map_[LINEAR_FIRST]
    pin.ccrba(at.pinocchio, there, at.q_pin, at.v_pin)
    yield found @ at.T, there.Ag[LINEAR_FIRST]


@check("momentum_rate")
def _(at):
    there = at.pinocchio.createData()
    at_rest = at.states.a(at.q_pin, at.v_pin, 0 * at.qdd)
    for a, qdd in ((at.a_pin, [at.qdd]), (at_rest, [])):
        pin.computeCentroidalMomentumTimeVariation(at.pinocchio, there, at.q_pin, at.v_pin, a)
        yield at.compute("momentum_rate", at.qd, *qdd), there.dhg.vector[LINEAR_FIRST]


@check("kinetic_energy")
def _(at):
    data, found = at.forwarded(), at.compute("kinetic_energy", at.qd)
    mujoco.mj_energyVel(at.mujoco, data)
    yield found, data.energy[1]
    there = at.pinocchio.createData()
    yield found, pin.computeKineticEnergy(at.pinocchio, there, at.q_pin, at.v_pin)
    yield found, at.qd @ at.robot.mass_matrix(at.q) @ at.qd / 2


@check("potential_energy")
def _(at):
    data, found = at.forwarded(), at.compute("potential_energy")
    mujoco.mj_energyPos(at.mujoco, data)
    fixed = at.mujoco.body_weldid == 0
    of_fixed = -at.mujoco.body_mass[fixed] @ data.xipos[fixed] @ at.mujoco.opt.gravity
    yield found + of_fixed, data.energy[0]
    there = at.pinocchio.createData()
    yield found, pin.computePotentialEnergy(at.pinocchio, there, at.q_pin)
    weight = at.robot.kinematics([]).mass * np.array(at.robot.model.gravity)
    yield found, -weight @ at.compute("center")


@check("kinematics([]).mass")
def _(at):
    found = at.robot.kinematics([]).mass
    yield found, pin.computeTotalMass(at.pinocchio)
    fixed = at.mujoco.body_mass[at.mujoco.body_weldid == 0].sum()
    yield found, mujoco.mj_getTotalmass(at.mujoco) - fixed


# --- operational space and forces


def last_moved(at):
    """The number of a frame far out, and its J in MuJoCo, in the frame's axes."""
    data, i = at.forwarded(), len(at.bodies) - 1
    R = data.xmat[at.ids[i]].reshape(3, 3)
    return i, (R.T @ at.jacobians(data)[i].reshape(2, 3, -1)).reshape(6, -1)


def jacobian_of_pinocchio(at, i, axes):
    """Angular first."""
    data = at.pinocchio.createData()
    J = pin.computeFrameJacobian(at.pinocchio, data, at.q_pin, at.frames[i], axes)
    return J[LINEAR_FIRST]


@check("operational(q)")
def _(at):
    """By mj_jacBody, mj_solveM, computeFrameJacobian and computeMinverse."""
    i, J = last_moved(at)
    found = at.robot.replace(frames=[at.bodies[i]]).operational(at.q)
    yield found, J @ inverse_of_mujoco(at, J).T
    J = jacobian_of_pinocchio(at, i, pin.LOCAL)
    yield found, J @ inverse_of_pinocchio(at) @ J.T
    for k in range(at.mujoco.nsite):
        name, J = at.mujoco.site(k).name, np.zeros((2, 3, at.nv))
        if name not in at.bodies:
            data = at.forwarded()
            mujoco.mj_jacSite(at.mujoco, data, J[1], J[0], k)
            J = (data.site_xmat[k].reshape(3, 3).T @ J).reshape(6, -1)
            found = at.robot.replace(frames=[name]).operational(at.q)
            yield found, J @ inverse_of_mujoco(at, J).T


@check("operational_vjp(q, W)")
def _(at):
    """By differences of computeFrameJacobian and computeMinverse along a way of integrate."""
    i, _ = last_moved(at)
    (dq,) = random_vectors(at, 1)
    W = np.random.default_rng(59).standard_normal((6, 6))
    data = at.pinocchio.createData()

    def trace(step):
        q = pin.integrate(at.pinocchio, at.q_pin, step * at.T @ dq)
        J = pin.computeFrameJacobian(at.pinocchio, data, q, at.frames[i], pin.LOCAL)[LINEAR_FIRST]
        return (W * (J @ pin.computeMinverse(at.pinocchio, data, q) @ J.T)).sum()

    h = 2.0**-10
    far, near = (trace(k * h) - trace(-k * h) for k in (2, 1))
    found = at.robot.replace(frames=[at.bodies[i]]).operational_vjp(at.q, W).dq
    yield found @ dq, (8 * near - far) / (12 * h), np.linalg.norm(found) * np.linalg.norm(dq)


@check("operational_inertia(q)")
def _(at):
    i, J = last_moved(at)
    found = at.robot.replace(frames=[at.bodies[i]]).operational_inertia(at.q)
    yield found, np.linalg.inv(J @ inverse_of_mujoco(at, J).T)
    J = jacobian_of_pinocchio(at, i, pin.LOCAL)
    yield found, np.linalg.inv(J @ inverse_of_pinocchio(at) @ J.T)


@check("operational_diagonal(q)")
def _(at):
    i, J = last_moved(at)
    found = at.robot.replace(frames=[at.bodies[i]]).operational_diagonal(at.q)
    yield found, np.diagonal(J @ inverse_of_mujoco(at, J).T)
    J = jacobian_of_pinocchio(at, i, pin.LOCAL)
    yield found, np.diagonal(J @ inverse_of_pinocchio(at) @ J.T)


@check("operational_space(q, J)")
def _(at):
    """By mj_jacBody, mj_solveM, computeFrameJacobian and computeMinverse."""
    i = len(at.bodies) - 1
    J = at.jacobians(at.forwarded())[i]
    found = at.robot.operational_space(at.q, J)
    solved = inverse_of_mujoco(at, J).T
    inertia = np.linalg.inv(J @ solved)
    yield found.inertia, inertia
    yield found.inverse, solved @ inertia
    yield found.projector, np.eye(at.nv) - solved @ inertia @ J
    J = jacobian_of_pinocchio(at, i, pin.LOCAL_WORLD_ALIGNED)
    solved = inverse_of_pinocchio(at) @ J.T
    inertia = np.linalg.inv(J @ solved)
    yield found.inertia, inertia
    yield found.inverse, at.T @ solved @ inertia
    of_v = np.eye(at.nv) - solved @ inertia @ J
    yield found.projector, at.T @ of_v @ np.linalg.inv(at.T)


# --- constraints
EXACT = pin.ProximalSettings(1e-14, 0, 20)  # accuracy, mu, iterations


def weld(at):
    """The last body, held where it is."""
    i, _ = last_moved(at)
    where = at.robot.kinematics([at.bodies[i]]).compute(["positions", "quaternions"], at.q)
    here = kalmarm.Frame(-1, where["quaternions"][0].tolist(), where["positions"][0].tolist())
    return i, kalmarm.ConstrainedDynamics(
        at.robot, [kalmarm.Constraint("weld", "pose", at.bodies[i], here)]
    )


def contact_of_pinocchio(at, i):
    frame = at.pinocchio.frames[at.frames[i]]
    contact = pin.RigidConstraintModel(
        pin.ContactType.CONTACT_6D, at.pinocchio, frame.parentJoint, frame.placement,
        pin.ReferenceFrame.LOCAL,
    )  # fmt: skip
    contacts, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    contacts.append(contact)
    data.append(contact.createData())
    return contacts, data


@check("ConstrainedDynamics(robot).forward_dynamics(q, qd, tau)")
def _(at):
    """Two bodies that a connect holds to the world, and one joint."""
    spec = mujoco.MjSpec.from_file(str(file_of(at.name)))
    for body, anchor in zip(at.bodies[-2:], ([0.1, 0, 0], [0, 0.1, 0.05])):
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY, name1=body,
            name2="world", data=[*anchor, *np.zeros(mujoco.mjNEQDATA - 3)], solref=[0.05, 0.7],
        )  # fmt: skip
    model = spec.compile()
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(
        flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_ACTUATION
    ) | int(flags.mjDSBL_SPRING | flags.mjDSBL_DAMPER | flags.mjDSBL_FRICTIONLOSS)
    model.opt.tolerance = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        robot = kalmarm.from_mujoco(model, takes_constraints=True)
    assert len(robot.constraints) == 2
    data = mujoco.MjData(model)
    data.qpos, data.qvel, data.qfrc_applied = at.q, at.qd, at.tau
    mujoco.mj_forward(model, data)
    found = kalmarm.ConstrainedDynamics(robot).forward_dynamics(at.q, at.qd, at.tau)
    yield found.a, data.qacc
    yield found.forces, data.efc_force


@check("ConstrainedDynamics(robot, constraints)")
def _(at):
    """At a velocity that the constraint allows."""
    i, held = weld(at)
    qd = held.impulse(at.q, at.qd).qd
    v = np.linalg.solve(at.T, qd)
    contacts, of_contacts = contact_of_pinocchio(at, i)
    data = at.pinocchio.createData()
    pin.initConstraintDynamics(at.pinocchio, data, contacts, of_contacts)
    a = pin.constraintDynamics(
        at.pinocchio, data, at.q_pin, v, at.tau_pin, contacts, of_contacts, EXACT
    )
    found = held.forward_dynamics(at.q, qd, at.tau)
    yield found.a, at.states.qdd(at.q_pin, v, a)


@check("impulse(q, qd)")
def _(at):
    i, held = weld(at)
    contacts, of_contacts = contact_of_pinocchio(at, i)
    data = at.pinocchio.createData()
    pin.initConstraintDynamics(at.pinocchio, data, contacts, of_contacts)
    after = pin.impulseDynamics(
        at.pinocchio, data, at.q_pin, at.v_pin, contacts, of_contacts, 0.0, EXACT
    )
    yield held.impulse(at.q, at.qd).qd, at.states.qd(at.q_pin, np.array(after))


def some_forces(at, count):
    return 10 * np.random.default_rng(3).standard_normal((count, 6))


@check("forces=")
def _(at):
    bodies = [at.mujoco.body(i).name for i in range(1, at.mujoco.nbody)]
    robot, data = at.robot.replace(acted_on=bodies), at.forwarded()
    data.xfrc_applied[1:] = some_forces(at, len(bodies))
    forces = as_forces(data, data.xfrc_applied[1:]).ravel()
    torques = np.einsum(
        "fij,fi->j", robot.kinematics(bodies).compute(["jacobians"], at.q)["jacobians"],
        forces.reshape(-1, 6),
    )  # fmt: skip
    mujoco.mj_forward(at.mujoco, data)
    a = robot.forward_dynamics(at.q, at.qd, at.tau, forces=forces, axes="aligned")
    yield a, data.qacc
    without = at.robot.inverse_dynamics(at.q, at.qd, at.qdd)
    found = robot.inverse_dynamics(at.q, at.qd, at.qdd, forces=forces)
    yield found, without - torques
    yield robot.bias(at.q, at.qd, forces=forces), at.robot.bias(at.q, at.qd) - torques


@check('forces=…, axes="local"')
def _(at):
    frames = [at.frames[i] for i in at.acted_on]
    robot = at.robot.replace(acted_on=[at.bodies[i] for i in at.acted_on])
    forces = some_forces(at, len(frames))
    fext = as_fext(at.pinocchio, frames, forces)
    flat, there = {"forces": forces.ravel(), "axes": "local"}, at.pinocchio.createData()
    a = pin.aba(at.pinocchio, there, at.q_pin, at.v_pin, at.tau_pin, fext)
    found = robot.forward_dynamics(at.q, at.qd, at.tau, **flat)
    yield found, at.states.qdd(at.q_pin, at.v_pin, a)
    torques = pin.rnea(at.pinocchio, there, at.q_pin, at.v_pin, at.a_pin, fext)
    yield at.T.T @ robot.inverse_dynamics(at.q, at.qd, at.qdd, **flat), torques
    pin.computeABADerivatives(at.pinocchio, there, at.q_pin, at.v_pin, at.tau_pin, fext)
    truth = at.states.derivatives(
        at.q_pin, at.v_pin, at.tau_pin, there.ddq, there.ddq_dq, there.ddq_dv, there.Minv
    )
    yield from zip(robot.forward_dynamics_derivatives(at.q, at.qd, at.tau, **flat)[:3], truth)


@check("solve(q, tau, contacts=w)")
def _(at):
    """By mj_fullM, mj_jacBody, crba and computeFrameJacobian."""
    robot = at.robot.replace(contacts=[at.bodies[i] for i in at.acted_on])
    w, data, M = some_forces(at, len(at.acted_on)), at.forwarded(), np.empty((at.nv, at.nv))
    mujoco.mj_fullM(at.mujoco, data, M)
    rows = np.einsum("fi,fij->fj", w, at.jacobians(data)[at.acted_on])
    found = robot.solve(at.q, at.tau, contacts=w.ravel())
    yield found, np.linalg.solve(M + rows.T @ rows, at.tau)
    rows = np.stack([
        one @ jacobian_of_pinocchio(at, i, pin.LOCAL_WORLD_ALIGNED) for one, i in zip(w, at.acted_on)
    ])  # fmt: skip
    M = pin.crba(at.pinocchio, at.pinocchio.createData(), at.q_pin)
    yield found, at.T @ np.linalg.solve(M + rows.T @ rows, at.tau_pin)


@check("loads=payload(mass, center, inertia)")
def _(at):
    """By a body that is added to MuJoCo's and Pinocchio's models."""
    rng = np.random.default_rng(2)
    i, mass, center = at.acted_on[-1], 1.5, rng.uniform(-0.1, 0.1, 3)
    moments = mass * np.array([0.02, 0.03, 0.04])
    robot = at.robot.replace(loaded=[at.bodies[i]])
    loads = kalmarm.payload(mass, center, moments)
    spec = mujoco.MjSpec.from_file(str(file_of(at.name)))
    spec.body(at.bodies[i]).add_body(
        mass=mass, ipos=center, inertia=moments, explicitinertial=True
    )
    model = without_other_forces(spec.compile())
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = at.q, at.qd
    mujoco.mj_forward(model, data)
    M = np.empty((at.nv, at.nv))
    mujoco.mj_fullM(model, data, M)
    yield robot.mass_matrix(at.q, loads=loads), M
    yield robot.bias(at.q, at.qd, loads=loads), data.qfrc_bias
    pinocchio, frame = pin.Model(at.pinocchio), at.pinocchio.frames[at.frames[i]]
    body = pin.Inertia(mass, center, np.diag(moments))
    pinocchio.appendBodyToJoint(frame.parentJoint, body, frame.placement)
    M = pin.crba(pinocchio, pinocchio.createData(), at.q_pin)
    yield robot.solve(at.q, at.tau, loads=loads), at.T @ np.linalg.solve(M, at.tau_pin)


@check("bias(q, qd) - bias(q, qd, forces=f)")
def _(at):
    i = at.acted_on[-1]
    robot, data = at.robot.replace(acted_on=[at.bodies[i]]), at.forwarded()
    moment, force = some_forces(at, 1).reshape(2, 3)
    torques, body = np.zeros(at.nv), at.ids[i]
    mujoco.mj_applyFT(at.mujoco, data, force, moment, data.xpos[body].copy(), body, torques)
    pushed = robot.bias(at.q, at.qd, forces=[*moment, *force])
    yield robot.bias(at.q, at.qd) - pushed, torques


# --- steps

H = 0.002


@cache
def with_springs(name):
    """MuJoCo's model of the robot with springs, dampers and two actuators, and ours."""
    spec = mujoco.MjSpec.from_file(str(file_of(name)))
    hinges = [one for one in spec.joints if one.type == mujoco.mjtJoint.mjJNT_HINGE]
    for i, one in enumerate(hinges):
        one.damping, one.stiffness = [0.5 + 0.1 * i, 0, 0], [20.0 + i, 0, 0]
        one.springref = 0.1
    for i in (0, -1):
        motor = spec.add_actuator(name=f"m{i}", target=hinges[i].name)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
        if i:
            motor.set_to_position(kp=200.0, kv=3.0)
        motor.ctrllimited, motor.ctrlrange = True, (-0.5, 0.5)
    model = spec.compile()
    model.opt.timestep = H
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return model, kalmarm.from_mujoco(model, takes_steps=True)


def stepped(at, integrator, ctrl=0.0):
    model, _ = with_springs(at.name)
    model.opt.integrator = integrator
    data = mujoco.MjData(model)
    data.qpos, data.qvel, data.qfrc_applied, data.ctrl = at.q, at.qd, at.tau, ctrl
    mujoco.mj_step(model, data)
    return data


@check("ImplicitStep(robot, h)(q, qd, tau)")
def _(at):
    data = stepped(at, mujoco.mjtIntegrator.mjINT_DISCRETE)  # mj_step
    q, qd, a = kalmarm.ImplicitStep(with_springs(at.name)[1], H)(at.q, at.qd, at.tau)
    yield q, data.qpos
    yield qd, data.qvel
    yield a, (data.qvel - at.qd) / H


@check('ImplicitStep(robot, h, scheme="springs_at_start")')
def _(at):
    data = stepped(at, mujoco.mjtIntegrator.mjINT_IMPLICITFAST)  # mj_step
    robot = with_springs(at.name)[1]
    q, qd, _ = kalmarm.ImplicitStep(robot, H, scheme="springs_at_start")(at.q, at.qd, at.tau)
    yield q, data.qpos
    yield qd, data.qvel


@check("ctrl=")
def _(at):
    model, robot = with_springs(at.name)
    step, discrete = kalmarm.ImplicitStep(robot, H), mujoco.mjtIntegrator.mjINT_DISCRETE
    names = [one.name for one in robot.terms.actuators]
    yield names == [model.actuator(i).name for i in range(model.nu)], True
    for u in ([0.2, -0.3], [0.2, 3.0]):  # the last beyond its range
        yield step(at.q, at.qd, at.tau, ctrl=u).qd, stepped(at, discrete, u).qvel
    yield stepped(at, discrete, [0.2, 3.0]).qvel, stepped(at, discrete, [0.2, 0.5]).qvel


@check("robot.terms")
def _(at):
    model, robot = with_springs(at.name)
    servo = robot.terms.actuators[1]
    of_servo = np.eye(at.nv)[servo.dof]
    yield robot.terms.damping, model.dof_damping + servo.damping * of_servo
    hinge = np.array(robot.model.single)
    joints = model.dof_jntid[hinge]
    stiffness = model.jnt_stiffness[joints]
    yield robot.terms.stiffness[hinge], stiffness + (servo.stiffness * of_servo)[hinge]
    held = stiffness * model.qpos_spring[model.jnt_qposadr[joints]]  # by the servo at zero
    yield (robot.terms.stiffness * robot.terms.reference)[hinge], held


@check("step.acceleration(q, qd, tau)")
def _(at):
    _, robot = with_springs(at.name)
    found, terms = kalmarm.ImplicitStep(robot, H).acceleration(at.q, at.qd, at.tau), robot.terms
    B, K = terms.damping, terms.stiffness
    single = np.array(robot.model.single)
    q = np.zeros(at.nv)
    q[single] = at.q[np.array(robot.model.q_index)[single]]
    M = robot.mass_matrix(at.q) + np.diag(H * B + H**2 * K)
    force = at.tau - B * at.qd - K * (q - terms.reference + H * at.qd) - robot.bias(at.q, at.qd)
    yield found, np.linalg.solve(M, force)
    data = stepped(at, mujoco.mjtIntegrator.mjINT_DISCRETE)  # mj_step
    yield found, (data.qvel - at.qd) / H


@check("step.advance(q, qd, a)")
def _(at):
    q, qd = kalmarm.ImplicitStep(with_springs(at.name)[1], H).advance(at.q, at.qd, at.qdd)
    yield qd, at.qd + H * at.qdd
    moved = at.q.copy()
    mujoco.mj_integratePos(at.mujoco, moved, qd, H)
    yield q, moved


def transition(at, model):
    """A of a step, in which (dq, dqd) after it are A (dq, dqd)."""
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    data, A = mujoco.MjData(model), np.zeros((2 * at.nv, 2 * at.nv))
    data.qpos, data.qvel, data.qfrc_applied = at.q, at.qd, at.tau
    mujoco.mjd_transitionFD(model, data, 1e-6, True, A, None, None, None)
    return A


@check("step.acceleration_vjp(q, qd, tau, w)")
def _(at):
    """By mjd_transitionFD."""
    model, robot = with_springs(at.name)
    A, step = transition(at, model), kalmarm.ImplicitStep(robot, H)
    w, dq, dqd = random_vectors(at, 3)
    found = step.acceleration_vjp(at.q, at.qd, at.tau, w)
    yield H * found.dq, w @ A[at.nv :, : at.nv]
    yield w + H * found.dqd, w @ A[at.nv :, at.nv :]
    da = step.acceleration_jvp(at.q, at.qd, at.tau, dq, dqd, np.zeros(at.nv))
    yield dqd + H * da, A[at.nv :] @ np.concatenate([dq, dqd])


@check("step.derivatives(q, qd, tau)")
def _(at):
    """By mjd_transitionFD."""
    model, robot = with_springs(at.name)
    d, A = kalmarm.ImplicitStep(robot, H).derivatives(at.q, at.qd, at.tau), transition(at, model)
    yield H * d.dq, A[at.nv :, : at.nv]
    yield np.eye(at.nv) + H * d.dqd, A[at.nv :, at.nv :]
    more = [stepped(at, model.opt.integrator).qvel]
    h, k, tau = 1.0, at.nv - 1, at.tau
    for sign in (1, -1):
        at.tau = tau + sign * h * np.eye(at.nv)[k]
        more.append(stepped(at, model.opt.integrator).qvel)
    at.tau = tau
    yield H * d.dtau[:, k], (more[1] - more[2]) / (2 * h)


# --- many states


@check("step(q, qd, tau, threads=2)")
def _(at):
    model, robot = with_springs(at.name)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    q, qd, _ = robot.random_state(3, 4)
    u = np.random.default_rng(5).uniform(-0.1, 0.1, (4, 3, model.nu))
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    initial = np.zeros((4, size))
    initial[:, 1 : 1 + at.robot.nq + at.nv] = np.hstack([q, qd])  # after the time
    data = [mujoco.MjData(model) for _ in range(2)]
    kept, _ = mujoco.rollout.rollout(model, data, initial, u)
    singly = mujoco.MjData(model)
    singly.qpos, singly.qvel = q[0], qd[0]
    step = kalmarm.ImplicitStep(robot, H)
    for i in range(3):
        q, qd, _ = step(q, qd, 0.0, ctrl=u[:, i], threads=2)
        singly.ctrl = u[0, i]
        mujoco.mj_step(model, singly)
        now = kept[:, i, 1 : 1 + at.robot.nq + at.nv]
        yield np.hstack([q, qd]), now
        yield np.hstack([singly.qpos, singly.qvel]), now[0]


@check("threads=")
def _(at):
    pool = pin.ModelPool(at.pinocchio, 2)
    q, v, tau = pinocchio_states(at.pinocchio, 6, 8)
    columns = (np.asfortranarray(x.T) for x in (q, v, tau))
    a = pin.abaInParallel(2, pool, *columns).T
    ours = at.states.q(q), at.states.qd(q, v), at.states.tau(q, tau)
    found = at.robot.forward_dynamics(*ours, threads=2)
    yield found, at.states.qdd(q, v, a)
    assert np.array_equal(found, at.robot.forward_dynamics(*ours))


@check("inverse_dynamics(q, qd, qdd, threads=2)")
def _(at):
    pool = pin.ModelPool(at.pinocchio, 2)
    q, v, a = pinocchio_states(at.pinocchio, 6, 9)
    tau = pin.rneaInParallel(2, pool, *(np.asfortranarray(x.T) for x in (q, v, a))).T
    ours = at.states.q(q), at.states.qd(q, v), at.states.qdd(q, v, a)
    yield at.robot.inverse_dynamics(*ours, threads=2), at.states.tau(q, tau)


# --- configurations


def turns(at):
    """Of qd: what is no position of a free joint, which Pinocchio moves along a screw."""
    return np.arange(3 if at.free else 0, at.nv)


@check("integrate(q, v)")
def _(at):
    v = 0.3 * at.qd
    found, moved = at.robot.integrate(at.q, v), at.q.copy()
    mujoco.mj_integratePos(at.mujoco, moved, v, 1)
    yield found, moved
    there = at.states.q(pin.integrate(at.pinocchio, at.q_pin, 0.3 * at.v_pin))
    entries = slice(3 if at.free else 0, None)
    yield found[entries], there[entries]
    if at.free:  # O(v^2)
        tiny = at.states.q(pin.integrate(at.pinocchio, at.q_pin, 1e-4 * at.v_pin))
        apart = np.abs(tiny - at.robot.integrate(at.q, 1e-4 * at.qd))[:3].max()
        assert np.abs(there - found)[:3].max() > 1e-3 and 1e-12 < apart < 1e-6
        yield found[:3], at.q[:3] + v[:3]


@check("difference(q0, q1)")
def _(at):
    found, theirs = at.robot.difference(at.q, at.other), np.empty(at.nv)
    mujoco.mj_differentiatePos(at.mujoco, theirs, 1, at.q, at.other)
    yield found, theirs
    v = at.states.qd(at.q_pin, pin.difference(at.pinocchio, at.q_pin, at.other_pin))
    yield found[turns(at)], v[turns(at)]
    mujoco.mj_differentiatePos(at.mujoco, theirs, 0.5, at.q, at.other)
    yield 2 * found, theirs


@check("integrate_jacobians(q, v)")
def _(at):
    v, some = 0.3 * at.v_pin, np.ix_(turns(at), turns(at))
    ours = at.robot.integrate_jacobians(at.q, 0.3 * at.qd)
    for one, other in zip(ours, pin.dIntegrate(at.pinocchio, at.q_pin, v)):
        yield one[some], other[some]
    if at.free:
        by_q, by_v, scale = np.zeros(9), np.zeros(9), np.zeros(3)
        mujoco.mjd_quatIntegrate(0.3 * at.qd[3:6], 1.0, by_q, by_v, scale)
        for one, other in zip(ours, (by_q, by_v)):
            yield one[3:6, 3:6], other.reshape(3, 3)
            yield one[:3, :3], np.eye(3)


@check("difference_jacobians(q0, q1)")
def _(at):
    some = np.ix_(turns(at), turns(at))
    ours = at.robot.difference_jacobians(at.q, at.other)
    for one, other in zip(ours, pin.dDifference(at.pinocchio, at.q_pin, at.other_pin)):
        yield one[some], other[some]
    if at.free:
        by_a, by_b = np.zeros((2, 3, 3))
        mujoco.mjd_subQuat(at.other[3:7], at.q[3:7], by_a, by_b)
        yield ours[1][3:6, 3:6], by_a
        yield ours[0][3:6, 3:6], by_b


@check("integrate(q0, s * difference(q0, q1))")
def _(at):
    found = at.robot.integrate(at.q, 0.3 * at.robot.difference(at.q, at.other))
    there = at.states.q(pin.interpolate(at.pinocchio, at.q_pin, at.other_pin, 0.3))
    entries = slice(3 if at.free else 0, None)
    yield found[entries], there[entries]
    if at.free:
        yield found[:3], 0.7 * at.q[:3] + 0.3 * at.other[:3]


@check("robot.q0")
def _(at, tmp):
    yield at.robot.q0, at.mujoco.qpos0
    text = """<mujoco><compiler angle="radian"/><worldbody><body><joint name="j" ref=".2"/>
     <geom size=".1"/></body></worldbody><keyframe><key name="up" qpos=".7"/></keyframe></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    path = tmp / "key.xml"
    path.write_text(text)
    yield kalmarm.load(path, key="up").q0, data.qpos
    yield kalmarm.load(path).q0, model.qpos0


@check("neutral()")
def _(at):
    yield at.robot.neutral(), at.states.q(pin.neutral(at.pinocchio))


@check("random_configuration(lower, upper)")
def _(at):
    lower, upper = at.robot.neutral() - 0.5, at.robot.neutral() + 0.7
    found = at.robot.random_configuration(lower, upper, 0, 50)
    theirs = [at.states.q(pin.randomConfiguration(at.pinocchio, lower, upper)) for _ in range(50)]
    limits = at.pinocchio.lowerPositionLimit, at.pinocchio.upperPositionLimit
    own = at.robot.random_state(0, 50).q
    plain = [i for i in range(at.robot.nq) if not (at.free and i < 7)]
    for q in (found, np.array(theirs)):
        yield np.clip(q, lower, upper)[:, plain], q[:, plain]
    yield np.clip(own, *limits)[:, plain], own[:, plain]
    if at.free:
        yield np.linalg.norm(found[:, 3:7], axis=1).round(12), np.ones(50)
        assert np.abs(found[:, 3:7]).max() > 0.7  # beyond the bounds, which are not read


# --- the page


def test_every_row_has_a_check_and_every_check_a_row():
    assert set(ROWS) == set(CHECKS)


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("row", CHECKS)
def test_row(row, robot, tmp_path):
    bound = float(ROWS[row][5])
    function = CHECKS[row]
    takes_files = "tmp" in inspect.signature(function).parameters
    pairs = function(engines(robot), *([tmp_path] if takes_files else []))
    i = -1
    for i, (is_, should, *size) in enumerate(pairs):
        is_, should = np.asarray(is_, float), np.asarray(should, float)
        assert is_.shape == should.shape
        size = size[0] if size else max(np.abs(should).max(), 1e-3)
        assert np.abs(is_ - should).max() <= bound * size, f"pair {i} of {row}"
    assert i >= 0


# Arguments of their calls, and elements of files.
WORDS = {"body", "site", "q", "v", "tau", "fext", "flg_local", "qfrc_target", "A"}
WORDS |= {"DfDq", "DfDv", "DfDa"}
PLACES = {
    "MuJoCo": [mujoco, mujoco.MjData, mujoco.MjModel, mujoco.MjOption, mujoco.MjSpec,
               mujoco.MjsBody, mujoco.mjtObj, mujoco.mjtIntegrator],
    "Pinocchio": [pin, pin.Model, pin.Data, pin.JointModel],
}  # fmt: skip


def found_in(places, name):
    for place in places:
        at = place
        for part in name.split("."):
            at = getattr(at, part, None)
        if at is not None:
            return at
    return None


@pytest.mark.parametrize("row", ROWS)
def test_names_are_those_of_the_engines_and_calls_are_made(row):
    mujocos, pinocchios, _, _, _, _ = ROWS[row]
    source = inspect.getsource(CHECKS[row]) + inspect.getsource(Engines)
    for engine, cell in (("MuJoCo", mujocos), ("Pinocchio", pinocchios)):
        for code in CODE.findall(cell):
            name = re.match(r"[\w.]+", code)[0]
            if name in WORDS:
                continue
            at = found_in(PLACES[engine], name)
            assert at is not None, f"{engine} has no {name}"
            if inspect.isroutine(at) or callable(at):
                assert name in source, f"{name} is not called"


def test_every_public_call_is_on_the_page():
    text = PAGE.read_text()
    for one in (
        kalmarm.Robot, kalmarm.Kinematics, kalmarm.ImplicitStep, kalmarm.PinocchioStates,
        kalmarm.ConstrainedDynamics,
    ):  # fmt: skip
        for name in dir(one):
            assert name.startswith("_") or re.search(rf"\b{name}\b", text), name
    for result in kalmarm.load(file_of("iiwa14")).kinematics([])._shapes:
        assert re.search(rf"\b{result}\b", text), result
