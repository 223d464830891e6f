"""Positions with quaternions: against MuJoCo and Pinocchio; shapes, dtypes, memory, refusals."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import file_of, load

import kalmarm

STATES = 50


def is_same_rotation(q, other, tolerance):
    """Of rows of quaternions, which are the same with the other sign."""
    sign = np.sign(np.sum(q * other, axis=-1, keepdims=True))
    return np.abs(q - sign * other).max() < tolerance


def test_displacements_are_mujocos(name):
    robot, model = load(name), mujoco.MjModel.from_xml_path(str(file_of(name)))
    q, qd, _ = robot.random_state(1, STATES)
    for h in (1e-9, 0.01, 1.0):
        expected = q.copy()
        for row, v in zip(expected, qd):
            mujoco.mj_integratePos(model, row, v, h)
        found = robot.integrate(q, h * qd)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


def test_differences_are_mujocos(name):
    robot, model = load(name), mujoco.MjModel.from_xml_path(str(file_of(name)))
    q0, q1 = robot.random_state(1, STATES).q, robot.random_state(2, STATES).q
    expected = np.empty((STATES, robot.nv))
    for v, one, other in zip(expected, q0, q1):
        mujoco.mj_differentiatePos(model, v, 1, one, other)
    np.testing.assert_allclose(robot.difference(q0, q1), expected, rtol=0, atol=1e-14)


def pinocchio_ball():
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    return model


def test_turns_and_jacobians_are_pinocchios():
    """Of a ball, whose quaternion is (x, y, z, w) there; the positions of its free joints turn."""
    model, rng = pinocchio_ball(), np.random.default_rng(0)
    builder = kalmarm.Builder()
    builder.add_body("ball", joint="ball", mass=1, inertia=(1, 1, 1))
    robot = builder.build()
    for angle in (1e-6, 0.1, 1, 3):
        q, v = robot.random_state(rng).q, rng.standard_normal(3)
        v *= angle / np.linalg.norm(v)
        theirs = np.roll(q, -1)
        there = pin.integrate(model, theirs, v)
        moved = robot.integrate(q, v)
        assert is_same_rotation(moved, np.roll(there, 1), 1e-14)
        found = robot.difference(q, moved)
        np.testing.assert_allclose(found, pin.difference(model, theirs, there), rtol=0, atol=1e-14)
        for ours, other in (
            (robot.integrate_jacobians(q, v), pin.dIntegrate(model, theirs, v)),
            (robot.difference_jacobians(q, moved), pin.dDifference(model, theirs, there)),
        ):
            np.testing.assert_allclose(ours, other, rtol=0, atol=1e-13)


def test_derivatives_of_dynamics_are_along_displacements(g1):
    q, qd, tau = g1.random_state(0)
    dq = g1.forward_dynamics_derivatives(q, qd, tau).dq
    steps = 1e-6 * np.eye(g1.nv)
    more, less = (g1.forward_dynamics(g1.integrate(q, v), qd, tau) for v in (steps, -steps))
    np.testing.assert_allclose(
        (more - less).T / 2e-6, dq, rtol=0, atol=1e-6 * np.linalg.norm(dq, 2)
    )


CALLS = {  # of a first and a last argument: of which widths they and the result are
    "integrate": ("nq", "nv", ("nq",)),
    "difference": ("nq", "nq", ("nv",)),
    "integrate_jacobians": ("nq", "nv", ("nv", "nv")),
    "difference_jacobians": ("nq", "nq", ("nv", "nv")),
}


@pytest.fixture(params=CALLS)
def call(request):
    return request.param


def arguments(robot, call, count=None, dtype=np.float64):
    state, other = (robot.random_state(seed, count, dtype=dtype) for seed in (0, 1))
    return state.q, other.q if CALLS[call][1] == "nq" else other.qd


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("leading", [(), (1,), (3, 5), (0,)])
def test_shapes_and_dtype_are_those_of_the_states(g1, call, dtype, leading):
    count = int(np.prod(leading))
    given = [
        x.reshape(*leading, x.shape[-1]) if leading else x[0]
        for x in arguments(g1, call, count, dtype)
    ]
    result = getattr(g1, call)(*given)
    shape = (*leading, *(getattr(g1, width) for width in CALLS[call][2]))
    for one in result if isinstance(result, tuple) else (result,):
        assert one.shape == shape
        assert one.dtype == dtype


def test_rows_are_what_single_states_give_and_are_broadcast(g1, call):
    first, second = arguments(g1, call, 6)
    rows = np.asarray(getattr(g1, call)(first, second))
    one = np.asarray(getattr(g1, call)(first[4], second[4]))
    np.testing.assert_array_equal(rows[..., 4, :, :] if rows.ndim == 4 else rows[4], one)
    whole = np.broadcast_to(first[0], first.shape)
    np.testing.assert_array_equal(
        getattr(g1, call)(first[0], second), getattr(g1, call)(whole, second)
    )


def test_out_takes_the_result(g1):
    for call in ("integrate", "difference"):
        given = arguments(g1, call, 4)
        fresh = getattr(g1, call)(*given)
        out = np.full_like(fresh, np.nan)
        assert getattr(g1, call)(*given, out=out) is out
        np.testing.assert_array_equal(out, fresh)
        shared = given[0].ravel()[: fresh.size].reshape(fresh.shape)
        with pytest.raises(ValueError, match=f"{call}: out lies in the same memory as q"):
            getattr(g1, call)(*given, out=shared)


def test_wrong_arguments_are_refused(g1):
    q, qd, _ = g1.random_state(0)
    with pytest.raises(ValueError, match=r"integrate: v has shape \(36,\), \(35,\) is needed"):
        g1.integrate(q, q)
    with pytest.raises(ValueError, match=r"difference: q0 has shape \(35,\), \(36,\) or"):
        g1.difference(qd, q)
    with pytest.raises(TypeError, match="v is float32, arrays before it are float64"):
        g1.integrate_jacobians(q, qd.astype(np.float32))
    with pytest.raises(TypeError, match="q1 is int64, float32 or float64 is needed"):
        g1.difference_jacobians(q, q.astype(int))
    with pytest.raises(TypeError, match="out is float32, float64 is needed"):
        g1.integrate(q, qd, out=q.astype(np.float32))


def test_neutral_is_zero_without_a_turn(g1):
    q = g1.neutral(dtype=np.float32)
    assert q.dtype == np.float32
    np.testing.assert_array_equal(q, [0, 0, 0, 1] + [0] * 32)
    assert np.count_nonzero(g1.neutral()) == 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_random_configurations_keep_their_bounds(g1, dtype):
    lower, upper = np.full(36, -0.1, dtype), np.full(36, 0.2, dtype)
    q = g1.random_configuration(lower, upper, 0, 1000)
    assert q.shape == (1000, 36)
    assert q.dtype == dtype
    single = np.r_[0:3, 7:36]
    assert np.all((q[:, single] >= lower[0]) & (q[:, single] <= upper[0]))
    assert np.ptp(q[:, single], axis=0).min() > 0.28
    length = np.linalg.norm(q[:, 3:7], axis=1)
    np.testing.assert_allclose(length, 1, rtol=4 * np.finfo(dtype).eps)
    assert np.abs(q[:, 3:7].mean(axis=0)).max() < 4 * 0.5 / np.sqrt(1000)
    np.testing.assert_array_equal(g1.random_configuration(lower, upper, 0, 1000), q)
    np.testing.assert_array_equal(g1.random_configuration(lower, upper, 0), q[0])
    rng = np.random.default_rng(0)
    one, other = (g1.random_configuration(lower, upper, rng) for _ in range(2))
    assert np.all(one != other)
    assert g1.random_configuration(lower, 1).shape == (36,)


def test_bounds_that_are_none_are_refused_with_the_dof(g1):
    lower, upper = np.zeros(36), np.ones(36)
    lower[3:7] = np.nan  # of a quaternion: not read
    assert np.isfinite(g1.random_configuration(lower, upper)).all()
    lower[2] = 2
    with pytest.raises(ValueError, match=f"DoF '{g1.dofs[2]}': bounds 2 and 1"):
        g1.random_configuration(lower, upper)
    lower[2], upper[8] = 0, np.inf
    with pytest.raises(ValueError, match=f"DoF '{g1.dofs[7]}': bounds 0 and inf"):
        g1.random_configuration(lower, upper)
    with pytest.raises(ValueError, match="are one for all states"):
        g1.random_configuration(np.zeros((2, 36)), 1)
    with pytest.raises(ValueError, match=r"random_configuration: lower has shape \(35,\)"):
        g1.random_configuration(np.zeros(35), 1)
