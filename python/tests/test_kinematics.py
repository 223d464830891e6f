"""Frames, momenta and energies against MuJoCo and Pinocchio, and what the calls take and give."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import file_of, load
from conventions import LINEAR_FIRST, pinocchio_states, turned

import kalmarm

STATES = 10
FRAME_RESULTS = [
    "positions", "rotations", "quaternions", "jacobians", "velocities", "accelerations",
]  # fmt: skip
WHOLE_RESULTS = [
    "center", "center_velocity", "center_acceleration", "center_jacobian", "momentum",
    "momentum_rate", "momentum_matrix", "kinetic_energy", "potential_energy",
]  # fmt: skip


def close(is_, should, size=None):
    size = np.abs(should).max() if size is None else size
    np.testing.assert_allclose(is_, should, atol=1e-12 * max(size, 1e-3), rtol=0)


def test_frames_are_mujocos_bodies_and_sites(name):
    robot = load(name)
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    data = mujoco.MjData(model)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    sites = [model.site(i).name for i in range(model.nsite)]
    names = [one for one in dict.fromkeys(bodies + sites) if one in robot.frames]
    assert set(bodies) <= set(robot.frames)
    of = robot.kinematics(names)
    q, qd, _ = robot.random_state(3)
    found = of.compute(FRAME_RESULTS, q, qd)
    data.qpos, data.qvel = q, qd
    mujoco.mj_forward(model, data)
    linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
    for i, one in enumerate(names):
        is_body = one in bodies
        at = data.body(one) if is_body else data.site(one)
        kind = mujoco.mjtObj.mjOBJ_XBODY if is_body else mujoco.mjtObj.mjOBJ_SITE
        close(found["positions"][i], at.xpos)
        close(found["rotations"][i], at.xmat.reshape(3, 3))
        w, x, y, z = found["quaternions"][i]
        assert w >= 0
        quat = np.empty(4)
        mujoco.mju_mat2Quat(quat, at.xmat)
        close(abs(np.dot([w, x, y, z], quat)), 1.0)
        jac = mujoco.mj_jacBody if is_body else mujoco.mj_jacSite
        jac(model, data, linear, angular, at.id)
        close(found["jacobians"][i], np.vstack([angular, linear]))
        velocity = np.empty(6)
        mujoco.mj_objectVelocity(model, data, kind, at.id, velocity, 0)
        close(found["velocities"][i], velocity)


def test_accelerations_are_mujocos(name):
    robot = load(name)
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    model.opt.gravity[:] = 0
    data = mujoco.MjData(model)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    q, qd, qdd = robot.random_state(4)
    of = robot.kinematics(bodies)
    data.qpos, data.qvel, data.qacc = q, qd, qdd
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    data.qacc = qdd
    mujoco.mj_rnePostConstraint(model, data)
    found = of.compute(["accelerations"], q, qd, qdd)["accelerations"]
    truth = np.empty_like(found)
    for i, one in enumerate(bodies):
        kind = mujoco.mjtObj.mjOBJ_XBODY
        mujoco.mj_objectAcceleration(model, data, kind, model.body(one).id, truth[i], 0)
    close(found, truth)


def test_whole_body_is_mujocos(name):
    robot = load(name)
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    data = mujoco.MjData(model)
    q, qd, _ = robot.random_state(5)
    found = robot.kinematics([]).compute(WHOLE_RESULTS, q, qd)
    data.qpos, data.qvel = q, qd
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    mujoco.mj_energyPos(model, data)
    mujoco.mj_energyVel(model, data)
    moving = model.body_mass[model.body_weldid != 0].sum()
    if moving == model.body_subtreemass[0]:  # else MuJoCo counts what stands still too
        close(found["center"], data.subtree_com[0])
        close(found["center_velocity"], data.subtree_linvel[0])
        J = np.empty((3, model.nv))
        mujoco.mj_jacSubtreeCom(model, data, J, 0)
        close(found["center_jacobian"], J)
        close(found["momentum"][:3], data.subtree_angmom[0])
        close(found["momentum"][3:], moving * data.subtree_linvel[0])
    close(found["kinetic_energy"], data.energy[1])
    close(found["momentum_matrix"] @ qd, found["momentum"])


def test_frames_are_pinocchios(peer):
    model, robot, ours = peer
    data = model.createData()
    of_pin = {frame.name: i for i, frame in enumerate(model.frames)}
    names = [one for one in robot.frames if one in of_pin]
    q, v, qdd_pin = pinocchio_states(model, STATES, 11)
    of = robot.kinematics(names)
    references = {
        "local": pin.LOCAL,
        "world": pin.WORLD,
        "aligned": pin.LOCAL_WORLD_ALIGNED,
    }
    for axes, reference in references.items():
        found = of.compute(
            FRAME_RESULTS, ours.q(q), ours.qd(q, v), ours.qdd(q, v, qdd_pin), axes=axes
        )
        for state in range(STATES):
            pin.forwardKinematics(model, data, q[state], v[state], qdd_pin[state])
            pin.computeJointJacobians(model, data, q[state])
            pin.updateFramePlacements(model, data)
            turn = turned(ours, q[state], model.nv)
            for i, one in enumerate(names):
                at = of_pin[one]
                close(found["positions"][state, i], data.oMf[at].translation)
                close(found["rotations"][state, i], data.oMf[at].rotation)
                J = pin.getFrameJacobian(model, data, at, reference)[LINEAR_FIRST]
                close(found["jacobians"][state, i] @ turn, J)
                velocity = pin.getFrameVelocity(model, data, at, reference).vector[LINEAR_FIRST]
                close(found["velocities"][state, i], velocity, np.abs(J).max() * 10)
                get = (
                    pin.getFrameClassicalAcceleration
                    if axes == "aligned"
                    else pin.getFrameAcceleration
                )
                a = get(model, data, at, reference).vector[LINEAR_FIRST]
                close(found["accelerations"][state, i], a, max(np.abs(a).max(), 100))


def test_whole_body_is_pinocchios(peer):
    model, robot, ours = peer
    data = model.createData()
    q, v, qdd_pin = pinocchio_states(model, STATES, 12)
    of = robot.kinematics([])
    found = of.compute(WHOLE_RESULTS, ours.q(q), ours.qd(q, v), ours.qdd(q, v, qdd_pin))
    for i in range(STATES):
        pin.centerOfMass(model, data, q[i], v[i], qdd_pin[i])
        close(found["center"][i], data.com[0])
        close(found["center_velocity"][i], data.vcom[0], 10)
        close(found["center_acceleration"][i], data.acom[0], 100)
        turn = turned(ours, q[i], model.nv)
        close(found["center_jacobian"][i] @ turn, pin.jacobianCenterOfMass(model, data, q[i]))
        pin.ccrba(model, data, q[i], v[i])
        close(found["momentum_matrix"][i] @ turn, data.Ag[LINEAR_FIRST])
        close(found["momentum"][i], data.hg.vector[LINEAR_FIRST], np.abs(data.Ag).max() * 10)
        pin.computeCentroidalMomentumTimeVariation(model, data, q[i], v[i], qdd_pin[i])
        close(found["momentum_rate"][i], data.dhg.vector[LINEAR_FIRST], 1000 * of.mass)
        M = np.triu(pin.crba(model, data, q[i]))
        kinetic = v[i] @ M @ v[i] - np.diag(M) @ v[i] ** 2 / 2  # its own leaves out some armatures
        close(found["kinetic_energy"][i], kinetic)
        close(
            found["potential_energy"][i], pin.computePotentialEnergy(model, data, q[i]), of.mass
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("leading", [(), (1,), (37,), (3, 5), (0,)])
def test_shapes_and_dtype_are_those_of_the_states(g1, dtype, leading):
    count = int(np.prod(leading))
    q, qd, _ = (x.reshape(*leading, -1) if count else x for x in g1.random_state(1, count, dtype=dtype))
    names = ["left_ankle_roll_link", "right_ankle_roll_link"]
    of = g1.kinematics(names)
    found = of.compute(FRAME_RESULTS + WHOLE_RESULTS, q, qd)
    shapes = [(2, 3), (2, 3, 3), (2, 4), (2, 6, g1.nv), (2, 6), (2, 6), (3,), (3,), (3,), (3, g1.nv)]
    shapes += [(6,), (6,), (6, g1.nv), (), ()]
    assert [x.shape for x in found.values()] == [(*leading, *shape) for shape in shapes]
    assert all(x.dtype == dtype for x in found.values())


def test_rows_are_what_single_states_give_on_any_number_of_threads(g1):
    q, qd, qdd = g1.random_state(2, 200)
    of = g1.kinematics(["torso_link"])
    results = FRAME_RESULTS + WHOLE_RESULTS
    rows = of.compute(results, q, qd, qdd, axes="local")
    both = of.compute(results, q, qd, qdd, axes="local", threads=2)
    one = of.compute(results, q[17], qd[17], qdd[17], axes="local")
    for name in results:
        np.testing.assert_array_equal(rows[name], both[name])
        close(rows[name][17], one[name])


def test_float32_rows_are_right_to_its_digits(g1):
    q, qd, _ = g1.random_state(2, 50)
    of = g1.kinematics(["left_rubber_hand"] if "left_rubber_hand" in g1.frames else ["torso_link"])
    truth = of.compute(FRAME_RESULTS, q.astype(np.float32).astype(float), qd.astype(np.float32).astype(float))
    found = of.compute(FRAME_RESULTS, q.astype(np.float32), qd.astype(np.float32))
    for name in FRAME_RESULTS:
        np.testing.assert_allclose(found[name], truth[name], atol=1e-5 * np.abs(truth[name]).max())


def test_a_momentum_changes_by_what_acts(g1):
    """A jump: torques at the joints change no momentum, the weight does."""
    q, qd, tau = g1.random_state(3)
    tau[:6] = 0
    a = g1.forward_dynamics(q, qd, tau)
    of = g1.kinematics([])
    rate = of.compute(["momentum_rate"], q, qd, a)["momentum_rate"]
    close(rate, [0, 0, 0, 0, 0, -9.81 * of.mass], 1000 * of.mass)


def test_what_is_wrong_is_refused(g1):
    of = g1.kinematics(["torso_link"])
    q, qd, qdd = g1.random_state(0)
    with pytest.raises(ValueError, match="velocities needs qd"):
        of.compute(["velocities"], q)
    with pytest.raises(ValueError, match="qdd comes without qd"):
        of.compute(["accelerations"], q, None, qdd)
    with pytest.raises(ValueError, match="result 'speeds' is unknown: positions"):
        of.compute(["speeds"], q)
    with pytest.raises(ValueError, match="axes 'body' is unknown: local, world, aligned"):
        of.compute(["positions"], q, axes="body")
    with pytest.raises(TypeError, match="results is a string"):
        of.compute("positions", q)
    with pytest.raises(ValueError, match="q has shape"):
        of.compute(["positions"], q[:-1])
    with pytest.raises(ValueError, match="torso_lin"):
        g1.kinematics(["torso_lin"])


def test_the_regressor_of_chosen_bodies_is_their_columns(g1):
    state = g1.random_state(5, 4)
    names = ["left_ankle_roll_link", "pelvis"]
    all_of = g1.kinematics([]).compute(["regressor"], *state)["regressor"]
    some = g1.kinematics([], bodies=names).compute(["regressor"], *state)["regressor"]
    columns = [10 * g1.frames[name].link + np.arange(10) for name in names]
    np.testing.assert_array_equal(some, all_of[..., np.concatenate(columns)])
    with pytest.raises(ValueError, match="left_ankle_roll_lin"):
        g1.kinematics([], bodies=["left_ankle_roll_lin"])
    with pytest.raises(ValueError, match="a body on link -1"):
        g1.kinematics([], bodies=[kalmarm.Frame(-1)])


def test_frames_are_those_of_the_question_unless_named(g1):
    asking = g1.replace(frames=["torso_link"])
    assert asking.kinematics().frames == ("torso_link",)
    assert "torso_link" in repr(asking.kinematics())
    assert g1.kinematics().frames == ()
    own = kalmarm.Frame(g1.dof("waist_yaw_joint"), [1, 0, 0, 0], [0, 0, 1])
    assert g1.kinematics([own]).frames == ("frame 0",)
