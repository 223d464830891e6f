"""Products of Jacobians with vectors: shapes, dtypes, outcomes, and that they are those of the matrices."""

import numpy as np
import pytest
from conftest import load

import kalmarm

COUNT = 19  # states, more than one block of lanes
ROUNDOFFS = {np.float64: 1e-10, np.float32: 2e-2}


@pytest.fixture(params=[np.float64, np.float32])
def dtype(request):
    return request.param


@pytest.fixture(params=["panda", "go2"])
def case(request, dtype):
    robot = load(request.param)
    w = np.random.default_rng(3).standard_normal((COUNT, robot.nv)).astype(dtype)
    return robot, *robot.random_state(5, COUNT, dtype=dtype), w


def close(x, truth, dtype):
    size = np.linalg.norm(truth, axis=-1, keepdims=True)
    assert x.dtype == dtype
    assert np.abs(x - truth).max() <= ROUNDOFFS[dtype] * size.max()


def test_rows_are_products_of_the_matrices(case, dtype):
    robot, q, qd, tau, w = case
    d = robot.forward_dynamics_derivatives(*(x.astype(np.float64) for x in (q, qd, tau)))
    found = robot.forward_dynamics_vjp(q, qd, tau, w)
    for ours, J in zip((found.dq, found.dqd, found.dtau), d[:3]):
        close(ours, np.einsum("ri,rij->rj", w, J), dtype)
    assert found.inertias is found.dqdd is found.armature is found.forces is found.loads is None
    along = robot.forward_dynamics_jvp(q, qd, tau, w, -w, w)
    close(along, np.einsum("rij,rj->ri", d.dq - d.dqd + d.dtau, w), dtype)


def test_one_state_is_a_row(case, dtype):
    robot, q, qd, tau, w = case
    rows = robot.forward_dynamics_vjp(q, qd, tau, w, inertias=True, armature=True)
    one = robot.forward_dynamics_vjp(q[4], qd[4], tau[4], w[4], inertias=True, armature=True)
    assert one.inertias.shape == (robot.nv, 10)
    assert rows.inertias.shape == (COUNT, robot.nv, 10)
    for field, many in zip(one, rows):
        if field is not None:
            close(many[4].ravel(), field.ravel(), dtype)
    threaded = robot.forward_dynamics_vjp(q, qd, tau, w, threads=0)
    np.testing.assert_array_equal(threaded.dq, rows.dq)


def test_leading_dimensions_are_broadcast(case, dtype):
    robot, q, qd, tau, w = case
    found = robot.inverse_dynamics_vjp(q[0], qd[:4, None], 0, w[:3])
    assert found.dq.shape == (4, 3, robot.nv)
    again = robot.inverse_dynamics_vjp(q[0], qd[2], 0, w[1])
    close(found.dqd[2, 1], again.dqd, dtype)
    assert robot.solve_vjp(q[:0], tau[:0], w[:0]).dtau.shape == (0, robot.nv)


def test_a_row_that_is_not_finite_fails_alone(case, dtype):
    robot, q, qd, tau, w = case
    sound = robot.forward_dynamics_vjp(q, qd, tau, w)
    q[3, 0] = np.nan
    found, outcomes = robot.forward_dynamics_vjp(q, qd, tau, w, status=True)
    failed = np.arange(COUNT) == 3
    np.testing.assert_array_equal(outcomes["status"] != kalmarm.Status.OK, failed)
    for ours, before in zip(found, sound):
        if ours is None:
            continue
        assert np.isnan(ours[3]).all()
        np.testing.assert_array_equal(ours[~failed], before[~failed])
    da, outcomes = robot.forward_dynamics_jvp(q, qd, tau, w, w, w, status=True)
    np.testing.assert_array_equal(np.isnan(da).all(axis=-1), failed)
    torques, outcomes = robot.inverse_dynamics_vjp(q, qd, tau, w, status=True)
    np.testing.assert_array_equal(outcomes["status"] != kalmarm.Status.OK, failed)
    with pytest.raises(kalmarm.DynamicsError, match="forward_dynamics_vjp: .*q\\[0\\] is nan"):
        robot.forward_dynamics_vjp(q[3], qd[3], tau[3], w[3])


def test_forces_and_loads_are_derived_by(dtype):
    robot = load("go2", acted_on=["base"], loaded=["FL_calf", "base"])
    q, qd, tau = robot.random_state(7, COUNT, dtype=dtype)
    rng = np.random.default_rng(8)
    w, f = (rng.standard_normal((COUNT, n)).astype(dtype) for n in (robot.nv, 6))
    load_ = kalmarm.payload([1.5, 0.5], np.full((2, 3), 0.1), np.full((2, 3), 0.02)).ravel()
    loads = np.broadcast_to(load_.astype(dtype), (COUNT, 20))
    found = robot.inverse_dynamics_vjp(q, qd, tau, w, forces=f, loads=loads)
    with_ = robot.inverse_dynamics(q, qd, tau, forces=f, axes="local", loads=loads)
    change = ((with_ - robot.inverse_dynamics(q, qd, tau)) * w).sum(axis=-1)
    linear = (found.forces * f).sum(axis=-1) + (found.loads * loads).sum(axis=-1)
    size = np.abs(with_).sum(axis=-1).max()
    assert np.abs(change - linear).max() < ROUNDOFFS[dtype] * size
    of_a = robot.forward_dynamics_vjp(q, qd, tau, w, forces=f, loads=loads)
    assert (of_a.forces.shape, of_a.loads.shape) == ((COUNT, 6), (COUNT, 20))


@pytest.mark.parametrize("name", ["iiwa14", "g1"])
def test_every_row_is_a_robot_of_its_own(name, dtype):
    robot = load(name)
    bodies = {"iiwa14": ["link7", "link3"], "g1": ["pelvis", "left_elbow_link", "torso_link"]}[name]
    own = robot.parameters(bodies)
    q, qd, tau = robot.random_state(9, COUNT, dtype=dtype)
    varied, rest = robot.with_parameters(bodies, kept=0.25)
    np.testing.assert_allclose(rest, own / 4, rtol=1e-14, atol=1e-16)
    same = np.tile((own - rest).ravel(), (COUNT, 1)).astype(dtype)
    same = varied.forward_dynamics(q, qd, tau, loads=same)
    close(same, robot.forward_dynamics(q, qd, tau), dtype)
    scale = np.random.default_rng(10).uniform(0.5, 2, (COUNT, len(bodies), 1))
    loads = (scale * own - rest).reshape(COUNT, -1).astype(dtype)
    loads[4, 0] = -1  # no mass of a body
    a, outcomes = varied.forward_dynamics(q, qd, tau, loads=loads, status=True)
    np.testing.assert_array_equal(outcomes["status"] == kalmarm.Status.OK, np.arange(COUNT) != 4)
    # Torques are linear in them, and so are their gradients.
    links = [robot.frames[body].link for body in bodies]
    w, qdd = tau[::-1].copy(), tau
    loads[4] = loads[5]
    found = varied.inverse_dynamics_vjp(q, qd, qdd, w, loads=loads)
    inertias = robot.inverse_dynamics_vjp(q, qd, qdd, w, inertias=True).inertias[:, links]
    close(found.loads, inertias.reshape(COUNT, -1), dtype)
    Y = robot.kinematics(bodies=bodies).compute(["regressor"], q, qd, qdd)["regressor"]
    change = varied.inverse_dynamics(q, qd, qdd, loads=loads) - robot.inverse_dynamics(q, qd, qdd)
    more = loads - (own - rest).ravel().astype(dtype)
    size = np.linalg.norm(robot.inverse_dynamics(q, qd, qdd), axis=-1).max()
    assert np.abs(change - np.einsum("rij,rj->ri", Y, more)).max() < ROUNDOFFS[dtype] * size


def test_parameters_of_what_does_not_move_are_refused(g1):
    with pytest.raises(ValueError, match="with_parameters: body 'world' does not move"):
        g1.with_parameters(["world"])
    with pytest.raises(ValueError, match="with_parameters: kept is 1, from 0 to below 1 is needed"):
        g1.with_parameters(["pelvis"], kept=1)
    with pytest.raises(ValueError, match="parameters: body 'pelvis' is on the link of another one"):
        g1.parameters(["pelvis", "pelvis"])


def test_what_does_not_fit_is_refused_by_name(g1):
    q, qd, tau = g1.random_state(1)
    with pytest.raises(ValueError, match="forward_dynamics_vjp: w has shape"):
        g1.forward_dynamics_vjp(q, qd, tau, tau[:-1])
    with pytest.raises(TypeError, match="solve_jvp: .*dq"):
        g1.solve_jvp(q, tau, tau.astype(np.float32), tau)
    with pytest.raises(ValueError, match="forces \\(of a robot without acted_on\\)"):
        g1.forward_dynamics_vjp(q, qd, tau, tau, forces=np.zeros(6))
    some = g1.replace(locked=g1.dofs[-1:])
    with pytest.raises(ValueError, match="gradients: of a question that leaves joints out"):
        some.forward_dynamics_vjp(q, qd, tau, tau)
    torques = g1.replace(wants=["inverse_dynamics"])
    with pytest.raises(ValueError, match="forward_dynamics_vjp: the robot's question does not want"):
        torques.forward_dynamics_vjp(q, qd, tau, tau)
    assert torques.inverse_dynamics_vjp(q, qd, tau, tau).dqdd.shape == (g1.nv,)
