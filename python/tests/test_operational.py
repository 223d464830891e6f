"""The operational inertia: the inverse of J M^-1 J', and where there is none."""

import warnings

import kalmarm
import numpy as np
import pytest
from conftest import load
from kalmarm.robot import _parameters

FEET = ["left_ankle_roll_link", "right_ankle_roll_link"]


def scaled(X, by):
    s = np.sqrt(np.diagonal(by, axis1=-2, axis2=-1))
    return X / (s[..., :, None] * s[..., None, :])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_inertia_is_the_inverse_within_its_error(g1, dtype):
    robot = g1.replace(frames=FEET)
    q = robot.random_state(1, 50, dtype=dtype).q
    found, outcomes = robot.operational_inertia(q, status=True)
    assert found.shape == (50, 12, 12) and found.dtype == dtype
    assert np.all(outcomes["status"] == kalmarm.Status.OK)
    truth = np.linalg.inv(robot.operational(q).astype(np.float64))
    error = np.abs(scaled(found - truth, truth)).max(axis=(1, 2))
    assert np.all(error <= outcomes["error"])
    one = robot.operational_inertia(q[3])
    assert np.abs(scaled(one - found[3], truth[3])).max() <= outcomes["error"][3]


def test_a_row_that_is_singular_disturbs_no_other():
    robot = load("iiwa14", frames=["link7"])
    q = robot.random_state(2, 5).q
    q[2] = 0  # stretched out
    q[3, 3] = np.nan
    found, outcomes = robot.operational_inertia(q, status=True)
    assert [*outcomes["status"]] == [0, 0, kalmarm.Status.SINGULAR, kalmarm.Status.NOT_FINITE, 0]
    assert np.isnan(found[2:4]).all() and np.isfinite(found[[0, 1, 4]]).all()
    with pytest.raises(kalmarm.DynamicsError, match="operational_inertia: singular"):
        robot.operational_inertia(q[2])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clamped, outcomes = robot.operational_inertia(q[2], clamp=100, status=True)
    assert outcomes["D"] < 1e-12 * outcomes["scale"]
    X = robot.operational(q[2])
    means = np.repeat(np.diag(X).reshape(2, 3).mean(axis=1), 3)
    values = np.linalg.eigvalsh(clamped * np.sqrt(np.outer(means, means)))
    assert values[-1] / values[0] == pytest.approx(100, rel=1e-6)
    damped = robot.operational_inertia(q[2], damping=0.01)
    np.testing.assert_allclose(damped @ (X + 0.01 * np.diag(means)), np.eye(6), atol=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_inverse_and_projector_are_those_of_their_definitions(g1, dtype):
    robot = g1.replace(frames=FEET)
    q = robot.random_state(3, 20, dtype=dtype).q
    J = robot.kinematics().compute(["jacobians"], q, axes="aligned")["jacobians"][:, :, 3:]
    J = J.reshape(20, 6, robot.nv)  # both feet's points
    space, outcomes = robot.operational_space(q, J, status=True)
    assert np.all(outcomes["status"] == kalmarm.Status.OK)
    M = robot.mass_matrix(q.astype(np.float64))
    J = J.astype(np.float64)
    u = np.finfo(dtype).eps
    scale = np.sqrt(np.diagonal(space.inertia, axis1=-2, axis2=-1))[:, :, None]
    assert np.abs(J @ space.inverse - np.eye(6)).max() < 1e4 * u
    assert np.abs(scale * (J @ space.projector)).max() < 1e4 * u * np.abs(scale * J).max()
    # Consistent: M N is symmetric, as Lambda, J and M say that it is.
    MN = M @ space.projector
    assert np.abs(MN - M + J.mT @ space.inertia @ J).max() < 1e4 * u * np.abs(M).max()
    one = robot.operational_space(q[4], J[4].astype(dtype))
    np.testing.assert_allclose(one.inverse, space.inverse[4], atol=1e3 * u)
    same = robot.operational_space(q[4], J.astype(dtype))  # one q, many J
    assert same.projector.shape == (20, robot.nv, robot.nv)


def test_a_row_of_a_task_that_is_singular_disturbs_no_other():
    robot = load("iiwa14")
    hand = robot.kinematics(["link7"])
    q = robot.random_state(2, 4).q
    q[1] = 0  # stretched out
    q[2, 3] = np.nan
    J = hand.compute(["jacobians"], q)["jacobians"][:, 0]
    J[3, 2] = 0
    space, outcomes = robot.operational_space(q, J, status=True, threads=2)
    assert [*outcomes["status"]] == [0, kalmarm.Status.SINGULAR, kalmarm.Status.NOT_FINITE,
                                     kalmarm.Status.SINGULAR]
    for result in space:
        assert np.isfinite(result[0]).all() and np.isnan(result[1:]).all()
    J[3, :3] = 0
    with pytest.raises(kalmarm.DynamicsError, match="at 'row 0 of J'"):
        robot.operational_space(q[3], J[3])
    with pytest.raises(ValueError, match="needed \\(..., k, 7\\)"):
        robot.operational_space(q[0], J[0].T)
    with pytest.raises(ValueError, match="of 4 rows, each 3 alike"):
        robot.operational_space(q[0], J[0, :4])
    assert robot.operational_space(q[0], J[0, 5:]).inertia.shape == (1, 1)


@pytest.mark.parametrize("leading", [(), (3,)])
def test_of_a_mass_matrix_that_is_singular_nothing_is_told(leading):
    builder = kalmarm.Builder()
    builder.add_body("arm", joint="hinge", axis=(0, 1, 0), mass=1, inertia=(1, 1, 1))
    builder.add_body("dust", parent="arm", joint="hinge", axis=(0, 1, 0))
    robot = builder.build()
    space, outcome = robot.operational_space(np.zeros((*leading, 2)), np.eye(2), status=True)
    assert np.all(outcome["status"] == kalmarm.Status.SINGULAR) and np.all(outcome["joint"] == 1)
    assert all(np.isnan(result).all() for result in space)


def test_diagonal_is_that_of_the_whole(g1):
    robot = g1.replace(frames=[*FEET, FEET[0], kalmarm.Frame(-1)])
    q = robot.random_state(4, 30).q
    whole = robot.operational(q)
    diagonal = robot.operational_diagonal(q, threads=2)
    np.testing.assert_allclose(diagonal, np.diagonal(whole, axis1=1, axis2=2), rtol=1e-13)
    np.testing.assert_allclose(robot.operational_diagonal(q[3]), diagonal[3], rtol=1e-12)
    assert np.all(diagonal[:, 18:] == 0)
    with pytest.raises(ValueError, match="no frames are asked about"):
        g1.operational_diagonal(q)


def test_a_frame_that_no_joint_moves_is_named():
    robot = load("iiwa14")
    robot = robot.replace(frames=["link7", kalmarm.Frame(-1)])
    with pytest.raises(kalmarm.DynamicsError, match="at 'turning of frame 1'") as failed:
        robot.operational_inertia(robot.q0, clamp=10)
    assert failed.value.outcome["joint"] == robot.nv + 6
    with pytest.raises(ValueError, match="clamp 0.5, which is below 1"):
        robot.operational_inertia(robot.q0, clamp=0.5)
    with pytest.raises(ValueError, match="no frames are asked about"):
        load("iiwa14").operational_inertia(robot.q0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_derivatives_of_it_are_homogeneous_and_of_rows(g1, dtype):
    """M is linear in inertias and armatures together, so that tr(W'X) is homogeneous of degree -1 in them."""
    robot = g1.replace(frames=FEET)
    q = robot.random_state(4, 19, dtype=dtype).q
    W = np.random.default_rng(5).standard_normal((19, 12, 12)).astype(dtype)
    found, outcomes = robot.operational_vjp(q, W, inertias=True, armature=True, status=True)
    assert np.all(outcomes["status"] == kalmarm.Status.OK)
    assert found.dq.shape == (19, robot.nv) and found.inertias.shape == (19, robot.nv, 10)
    assert found.dqd is found.dtau is found.gravity is None
    S = (W * robot.operational(q)).sum(axis=(1, 2))
    pi = np.array([_parameters(robot.model, k) for k in range(robot.nv)])
    r = kalmarm.ImplicitStep(robot, 0.01)._armature
    sums = (found.inertias * pi).sum(axis=(1, 2)) + found.armature @ r
    assert np.abs(sums + S).max() <= (1e-10 if dtype == np.float64 else 1e-2) * np.abs(S).max()
    one = robot.operational_vjp(q[7], W[7])
    assert np.linalg.norm(one.dq - found.dq[7]) <= 1e-3 * np.linalg.norm(one.dq)
    with pytest.raises(ValueError, match=r"operational_vjp: W has the shape \(19, 12\), needed \(..., 12, 12\)"):
        robot.operational_vjp(q, W[:, 0])
    with pytest.raises(ValueError, match="operational_vjp: no frames are asked about"):
        g1.operational_vjp(q, np.zeros((0, 0)))
