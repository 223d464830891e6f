"""M, accelerations and derivatives against C++, MuJoCo and Pinocchio, on the robots that ship."""

import os
import subprocess
import warnings

import conftest
import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import file_of, load, relative, without_other_forces
from conventions import pinocchio_states, turned

import kalmarm

STATES = 100


def mujoco_rows(model, q, qd, tau):
    """M, bias and a of MuJoCo, without passive forces, contacts and actuators."""
    data = mujoco.MjData(without_other_forces(model))
    M, bias = np.empty((len(q), model.nv, model.nv)), np.empty((len(q), model.nv))
    for i in range(len(q)):
        data.qpos, data.qvel = q[i], qd[i]
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, M[i])
        bias[i] = data.qfrc_bias
    return M, bias, np.linalg.solve(M, (tau - bias)[..., None])[..., 0]


def test_mass_bias_and_acceleration_are_mujocos(name):
    robot = load(name)
    q, qd, tau = robot.random_state(1, STATES)
    M, bias, a = mujoco_rows(mujoco.MjModel.from_xml_path(str(file_of(name))), q, qd, tau)
    assert relative(robot.mass_matrix(q), M) < 1e-13
    assert relative(robot.bias(q, qd), bias) < 1e-12
    assert relative(robot.forward_dynamics(q, qd, tau), a) < 1e-9


@pytest.mark.skipif(
    "KALMARM_PRINT_ROBOTS" not in os.environ, reason="scripts/test_python builds it"
)
def test_mass_and_acceleration_are_those_of_cpp(name):
    program = [os.environ["KALMARM_PRINT_ROBOTS"], file_of(name)]
    printed = subprocess.run(program, capture_output=True, check=True, text=True).stdout.split()
    robot = load(name)
    k = np.arange(robot.nv)
    M = robot.mass_matrix(robot.q0)
    a = robot.forward_dynamics(robot.q0, 0.1 * (k + 1), np.where(k % 2, -1.0, 1.0))
    assert int(printed[0]) == robot.nv
    of_cpp = np.array(printed[1:], float)
    assert relative(M.ravel()[None], of_cpp[None, : M.size]) < 1e-15
    assert relative(a[None], of_cpp[None, M.size :]) < 1e-12


def test_from_mujoco_is_load(name):
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        robot, same = load(name, takes_steps=True), kalmarm.from_mujoco(model, takes_steps=True)
    assert (robot.dofs, robot.notes, set(robot.frames)) == (same.dofs, same.notes, set(same.frames))
    np.testing.assert_array_equal(robot.q0, same.q0)
    q, qd, tau = robot.random_state(1, 5)
    for x, y in zip((q, qd, tau), same.random_state(1, 5)):
        np.testing.assert_array_equal(x, y)
    assert relative(same.mass_matrix(q), robot.mass_matrix(q)) < 1e-15
    for one, other in zip(robot.terms.actuators, same.terms.actuators, strict=True):
        np.testing.assert_allclose(one[1:-2], other[1:-2], rtol=1e-13)
        assert one[-2:] == other[-2:]


def test_from_mujoco_takes_a_model_as_it_was_changed(name):
    model = mujoco.MjModel.from_xml_path(str(file_of(name)))
    rng = np.random.default_rng(2)
    model.body_mass *= rng.uniform(0.9, 1.1, model.nbody)
    model.dof_armature[:] = rng.uniform(0, 0.1, model.nv)
    model.opt.gravity[:] = rng.standard_normal(3)
    robot = kalmarm.from_mujoco(model)
    q, qd, tau = robot.random_state(rng, 20)
    M, bias, _ = mujoco_rows(model, q, qd, tau)
    assert relative(robot.mass_matrix(q), M) < 1e-13
    assert relative(robot.bias(q, qd), bias) < 1e-12


ODD = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
 <body pos=".3 .2 -.1" quat=".5 -.4 .7 .3"><joint type="free" name="base" armature=".01"/>
  <inertial pos=".1 -.05 .2" mass="1.3" quat=".8 .1 -.3 .5" diaginertia=".03 .04 .05"/>
  <body pos="0 .1 .4" euler=".3 .2 .1"><joint name="a" axis="1 2 -3" pos=".1 .2 .3" ref=".4"/>
   <joint name="b" type="slide" axis="0 1 0" ref="-.2" armature=".2"/>
   <inertial pos="0 .1 0" mass=".7" diaginertia=".003 .004 .005"/>
   <site name="tip" pos=".1 .2 .3"/>
   <body pos=".2 0 0"><joint name="c" type="ball" pos=".05 -.1 .02"/>
    <inertial pos="0 .1 .2" mass=".9" diaginertia=".006 .004 .005"/>
    <body pos=".1 .1 .1" quat=".1 .2 .3 .4">
     <inertial pos=".3 .1 .2" mass=".2" diaginertia=".006 .004 .005"/></body>
   </body></body></body></worldbody>
 <actuator><motor joint="a" gear="3" armature=".02"/></actuator></mujoco>"""


def test_every_kind_of_joint_is_mujocos():
    model = mujoco.MjModel.from_xml_string(ODD)
    with pytest.warns(UserWarning, match="ignored: 1 actuator"):
        robot = kalmarm.from_mujoco(model, name="odd")
    q, qd, tau = robot.random_state(3, STATES)
    M, bias, a = mujoco_rows(model, q, qd, tau)
    assert relative(robot.mass_matrix(q), M) < 1e-13
    assert relative(robot.bias(q, qd), bias) < 1e-12
    assert relative(robot.forward_dynamics(q, qd, tau), a) < 1e-9
    assert robot.dofs[:6] == [f"base:{at}" for at in ("x", "y", "z", "r:x", "r:y", "r:z")]
    assert robot.dofs[6:] == ["a", "b", "c:x", "c:y", "c:z"]
    np.testing.assert_array_equal(robot.q0, model.qpos0)


def test_a_frame_moves_as_mujocos_site_does():
    model = mujoco.MjModel.from_xml_string(ODD)
    with pytest.warns(UserWarning):
        robot = kalmarm.from_mujoco(model, frames=["tip"])
    data = mujoco.MjData(model)
    q, qd, _ = robot.random_state(4)
    data.qpos, data.qvel = q, qd
    mujoco.mj_forward(model, data)
    linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
    mujoco.mj_jacSite(model, data, linear, angular, 0)
    R = data.site_xmat[0].reshape(3, 3)
    J = np.vstack([R.T @ angular, R.T @ linear])
    truth = J @ np.linalg.solve(robot.mass_matrix(q), J.T)
    np.testing.assert_allclose(robot.operational(q), truth, atol=1e-12 * np.abs(truth).max())


def test_acceleration_is_pinocchios(peer):
    model, robot, ours = peer
    data = model.createData()
    q, v, tau = pinocchio_states(model, STATES, 5)
    truth = np.array([pin.aba(model, data, *state) for state in zip(q, v, tau)])
    a = robot.forward_dynamics(ours.q(q), ours.qd(q, v), ours.tau(q, tau))
    assert relative(ours.a(q, v, a), truth) < 1e-9
    assert relative(ours.qdd(q, v, truth), a) < 1e-9


def test_mass_matrix_is_pinocchios(peer):
    model, robot, ours = peer
    data = model.createData()
    q, _, _ = pinocchio_states(model, STATES, 6)
    for one in q:
        M = pin.crba(model, data, one)
        M = np.triu(M) + np.triu(M, 1).T
        turn = turned(ours, one, model.nv)
        np.testing.assert_allclose(
            turn.T @ robot.mass_matrix(ours.q(one)) @ turn, M, atol=1e-13 * np.abs(M).max()
        )


def test_derivatives_are_pinocchios(peer):
    """Both are analytic and in float64, so what they differ by is rounding; differences, which
    lose half the digits, are below for what a column means."""
    model, robot, ours = peer
    if any(joint.shortname() == "JointModelSphericalZYX" for joint in model.joints):
        pytest.skip(
            "Pinocchio 4.1 leaves out that these axes move: differences of its aba are ours"
        )
    data = model.createData()
    q, v, tau = pinocchio_states(model, STATES, 7)
    a, theirs = np.empty_like(v), [np.empty((STATES, model.nv, model.nv)) for _ in range(3)]
    for i in range(STATES):
        pin.computeABADerivatives(model, data, q[i], v[i], tau[i])
        a[i] = data.ddq
        for to, one in zip(theirs, (data.ddq_dq, data.ddq_dv, data.Minv)):
            to[i] = one
    theirs[2] = np.triu(theirs[2]) + np.transpose(np.triu(theirs[2], 1), (0, 2, 1))
    truth = ours.derivatives(q, v, tau, a, *theirs)
    found = robot.forward_dynamics_derivatives(ours.q(q), ours.qd(q, v), ours.tau(q, tau))
    for one, of_pinocchio in zip(found, truth):
        assert relative(one, of_pinocchio) < 1e-8
    assert relative(found.a, ours.qdd(q, v, a)) < 1e-9


def moved(robot, q, dof, by):
    """q after `by` along the velocity of one DoF."""
    model = robot._description.model
    q = q.copy()
    if not model.quaternions:
        q[dof] += by
    elif dof < 3:
        q[dof] += by
    elif dof < 6:
        half = np.zeros(4)
        half[0], half[dof - 2] = np.cos(by / 2), np.sin(by / 2)
        out = np.zeros(4)
        mujoco.mju_mulQuat(out, q[3:7], half)
        q[3:7] = out
    else:
        q[dof + 1] += by
    return q


@pytest.mark.parametrize("floating", ["go2", "g1"])
def test_derivatives_of_a_floating_robot_are_its_differences(floating):
    robot = load(floating)
    h, stencil = 2e-3, {-2: 1 / 12, -1: -2 / 3, 1: 2 / 3, 2: -1 / 12}  # error h^4
    q, qd, tau = robot.random_state(8)
    d = robot.forward_dynamics_derivatives(q, qd, tau)
    for k in range(robot.nv):
        e = np.eye(robot.nv)[k]
        dq = sum(
            w * robot.forward_dynamics(moved(robot, q, k, i * h), qd, tau)
            for i, w in stencil.items()
        )
        dqd = sum(w * robot.forward_dynamics(q, qd + i * h * e, tau) for i, w in stencil.items())
        np.testing.assert_allclose(d.dq[:, k], dq / h, atol=1e-6 * np.abs(d.dq).max())
        np.testing.assert_allclose(d.dqd[:, k], dqd / h, atol=1e-8 * np.abs(d.dqd).max())
    np.testing.assert_allclose(d.a, robot.forward_dynamics(q, qd, tau), rtol=1e-10)


def test_what_belongs_together_is_consistent(name):
    robot = load(name)
    q, qd, tau = robot.random_state(9, 20)
    M, X = robot.mass_matrix(q), robot.inverse_mass_matrix(q)
    eye = np.broadcast_to(np.eye(robot.nv), M.shape)
    scale = np.linalg.norm(M, axis=(1, 2)) * np.linalg.norm(X, axis=(1, 2))
    assert np.max(np.linalg.norm(M @ X - eye, axis=(1, 2)) / scale) < 1e-14
    np.testing.assert_allclose(robot.diagonal(q), np.diagonal(X, axis1=1, axis2=2), rtol=1e-12)
    np.testing.assert_allclose(robot.log_det(q), np.linalg.slogdet(M)[1], rtol=1e-10, atol=1e-9)
    a = robot.forward_dynamics(q, qd, tau)
    np.testing.assert_allclose(
        robot.inverse_dynamics(q, qd, a), tau, atol=1e-9 * np.abs(robot.bias(q, qd)).max()
    )
    x = robot.solve(q, tau)
    np.testing.assert_allclose((X @ tau[..., None])[..., 0], x, atol=1e-11 * np.abs(x).max())
    factors = robot.factor(q[0])
    np.testing.assert_allclose(factors.solve(tau), tau @ X[0], atol=1e-11 * np.abs(X[0]).max())


def test_the_folder_of_robots_was_found():
    assert len(conftest.NAMES) == 11
