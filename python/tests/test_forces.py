"""Forces from outside against MuJoCo's xfrc_applied and Pinocchio's fext, and what calls take."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import as_fext, as_forces, file_of, load, relative, without_other_forces
from conventions import pinocchio_states

import kalmarm

STATES = 10


def test_forces_are_mujocos_xfrc_applied(name):
    model = without_other_forces(mujoco.MjModel.from_xml_path(str(file_of(name))))
    data = mujoco.MjData(model)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    robot = load(name, acted_on=bodies)
    q, qd, tau = robot.random_state(7, STATES)
    applied = 10 * np.random.default_rng(8).standard_normal((STATES, len(bodies), 6))
    forces, a, torques = np.empty_like(applied), np.empty_like(qd), np.zeros_like(qd)
    for i in range(STATES):
        data.qpos, data.qvel, data.qfrc_applied = q[i], qd[i], tau[i]
        data.xfrc_applied[1:] = applied[i]  # (force; torque) about the centre of mass
        mujoco.mj_forward(model, data)
        forces[i] = as_forces(data, applied[i])
        a[i] = data.qacc
        for body in range(1, model.nbody):
            mujoco.mj_applyFT(
                model, data, *applied[i, body - 1].reshape(2, 3), data.xipos[body], body, torques[i]
            )
    flat = forces.reshape(STATES, -1)
    assert relative(robot.forward_dynamics(q, qd, tau, forces=flat), a) < 1e-9
    assert relative(robot.bias(q, qd) - robot.bias(q, qd, forces=flat), torques) < 1e-12


def test_forces_are_pinocchios_fext(peer):
    """A force in a joint's axes, which turns with it, in Pinocchio as here: derivatives too."""
    model, robot, ours = peer
    data = model.createData()
    of_pin = {frame.name: i for i, frame in enumerate(model.frames)}
    names = [one for one in robot.frames if one in of_pin and model.frames[of_pin[one]].parentJoint]
    names = names[:: max(len(names) // 3, 1)]
    assert names
    robot = robot.replace(acted_on=names)
    q, v, tau = pinocchio_states(model, STATES, 13)
    forces = 10 * np.random.default_rng(9).standard_normal((STATES, len(names), 6))
    a, b = np.empty_like(v), np.empty_like(v)
    for i in range(STATES):
        stacked = as_fext(model, [of_pin[one] for one in names], forces[i])
        a[i] = pin.aba(model, data, q[i], v[i], tau[i], stacked)
        b[i] = pin.rnea(model, data, q[i], v[i], 0 * v[i], stacked)
    flat = forces.reshape(STATES, -1)
    found = robot.forward_dynamics(
        ours.q(q), ours.qd(q, v), ours.tau(q, tau), forces=flat, axes="local"
    )
    assert relative(ours.qdd(q, v, a), found) < 1e-9
    with_motion = ours.qdd(q, v, 0 * v)
    torques = robot.inverse_dynamics(
        ours.q(q), ours.qd(q, v), with_motion, forces=flat, axes="local"
    )
    assert relative(torques, ours.tau(q, b)) < 1e-11


@pytest.mark.parametrize("axes", ["local", "world", "aligned"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_forces_are_torques_of_the_transposed_jacobian(g1, axes, dtype):
    names = ["left_ankle_roll_link", "torso_link"]
    robot = g1.replace(acted_on=names)
    q, qd, tau = g1.random_state(3, 40, dtype=dtype)
    forces = np.random.default_rng(1).standard_normal((40, 2, 6)).astype(dtype)
    J = g1.kinematics(names).compute(["jacobians"], q, axes=axes)["jacobians"]
    pushed = np.einsum("sfij,sfi->sj", J, forces)
    flat = forces.reshape(40, 12)
    u = np.finfo(dtype).eps
    less = robot.bias(q, qd) - robot.bias(q, qd, forces=flat, axes=axes)
    np.testing.assert_allclose(less, pushed, atol=1e3 * u * np.abs(robot.bias(q, qd)).max(), rtol=0)
    found = robot.forward_dynamics(q, qd, tau, forces=flat, axes=axes)
    assert relative(found, g1.forward_dynamics(q, qd, tau + pushed)) < 1e4 * u
    one = robot.forward_dynamics(q[5], qd[5], tau[5], forces=flat[5], axes=axes)
    assert relative(one[None], found[5][None]) < 1e4 * u
    np.testing.assert_array_equal(  # one force for all states
        robot.bias(q, qd, forces=flat[0], axes=axes),
        robot.bias(q, qd, forces=np.tile(flat[0], (40, 1)), axes=axes),
    )


def test_derivatives_turn_forces_with_their_frames(g1):
    robot = g1.replace(acted_on=["torso_link"])
    q, qd, tau = g1.random_state(4)
    force = np.array([1.0, 2, 3, 40, 50, 60])
    d = robot.forward_dynamics_derivatives(q, qd, tau, forces=force, axes="local")
    h, k = 1e-6, robot.dof("waist_yaw_joint")
    moved = [
        robot.forward_dynamics(
            g1.integrate(q, s * h * np.eye(g1.nv)[k]), qd, tau, forces=force, axes="local"
        )
        for s in (1, -1)
    ]
    difference = (moved[0] - moved[1]) / (2 * h)
    assert np.abs(difference - d.dq[:, k]).max() < 1e-6 * np.abs(d.dq[:, k]).max()
    with pytest.raises(ValueError, match="Axes::local"):
        robot.forward_dynamics_derivatives(q, qd, tau, forces=force)


def test_what_is_no_force_is_refused(g1):
    robot = g1.replace(acted_on=["torso_link"])
    q, qd, tau = g1.random_state(4)
    with pytest.raises(ValueError, match="forces"):
        robot.forward_dynamics(q, qd, tau, forces=np.zeros(5))
    with pytest.raises(ValueError, match=r"bias: forces \(of a robot without acted_on\) has shape"):
        g1.bias(q, qd, forces=np.zeros(6))
    with pytest.raises(ValueError, match="axes 'body' is unknown: local, world, aligned"):
        robot.forward_dynamics(q, qd, tau, forces=np.zeros(6), axes="body")
    with pytest.raises(ValueError, match="torso"):
        g1.replace(acted_on=["torso_lin"])
    with pytest.raises(kalmarm.DynamicsError):
        robot.forward_dynamics(q, qd, tau, forces=np.full(6, np.nan))
