"""Gravity of every state: its own weight, results of states one by one, derivatives, and what is refused."""

import numpy as np
import pytest
from conftest import load

import kalmarm

COUNT = 19  # states, more than one block of lanes
ROUNDOFFS = {np.float64: 1e-10, np.float32: 2e-2}
CALLS = ["forward_dynamics", "inverse_dynamics", "forward_dynamics_derivatives", "bias", "gravity"]


@pytest.fixture(params=[np.float64, np.float32])
def dtype(request):
    return request.param


@pytest.fixture(params=["panda", "go2"])
def robot(request):
    return load(request.param)


def given(robot, dtype):
    q, qd, tau = robot.random_state(5, COUNT, dtype=dtype)
    return q, qd, tau, 5 * np.random.default_rng(6).standard_normal((COUNT, 3)).astype(dtype)


def close(x, truth, dtype):
    assert np.linalg.norm(x - truth) <= ROUNDOFFS[dtype] * np.linalg.norm(truth)


@pytest.mark.parametrize("call", CALLS)
def test_each_state_has_its_own(robot, call, dtype):
    q, qd, tau, gravity = given(robot, dtype)
    arguments = (q, qd, tau)[: {"bias": 2, "gravity": 1}.get(call, 3)]
    def answers(x, **options):
        found = getattr(robot, call)(*x, **options)
        return found if isinstance(found, tuple) else (found,)

    rows, plain = answers(arguments, gravity=gravity), answers(arguments)
    for field, same in zip(plain, answers(arguments, gravity=robot.model.gravity)):
        close(same, field, dtype)
    for i in (0, 7, COUNT - 1):
        for field, one in zip(rows, answers([x[i] for x in arguments], gravity=gravity[i])):
            close(field[i], one, dtype)


def test_a_free_robot_has_its_weight(dtype):
    robot = load("go2")
    q, _, _, gravity = given(robot, dtype)
    mass = sum(robot.model.__getstate__()[0][k][8] for k in range(robot.nv))
    force = robot.gravity(q, gravity=gravity)[:, :3]  # along the base's axes
    close(force, -mass * gravity, dtype)


def test_derivatives_by_it_are_those_of_what_is_linear(robot, dtype):
    q, qd, tau, gravity = given(robot, dtype)
    w = np.random.default_rng(7).standard_normal((COUNT, robot.nv)).astype(dtype)
    found = robot.inverse_dynamics_vjp(q, qd, tau, w, gravity=gravity)
    assert found.gravity.shape == (COUNT, 3)
    torque = robot.gravity(q, gravity=gravity)
    assert np.abs((w * torque).sum(-1) - (found.gravity * gravity).sum(-1)).max() <= (
        ROUNDOFFS[dtype] * np.linalg.norm(w) * np.abs(torque).max()
    )
    of_a = robot.forward_dynamics_vjp(q, qd, tau, w, gravity=gravity)
    heavier = robot.forward_dynamics(q, qd, tau, gravity=2 * gravity)
    change = (w * (heavier - robot.forward_dynamics(q, qd, tau, gravity=gravity))).sum(-1)
    close((of_a.gravity * gravity).sum(-1), change, dtype)
    assert robot.forward_dynamics_vjp(q, qd, tau, w).gravity is None
    step = kalmarm.ImplicitStep(robot, 0.01, damping=0.5)
    of_step = step.acceleration_vjp(q, qd, tau, w, gravity=gravity)
    more = step.acceleration(q, qd, tau, gravity=2 * gravity) - step.acceleration(q, qd, tau, gravity=gravity)
    close((of_step.gravity * gravity).sum(-1), (w * more).sum(-1), dtype)


def test_a_body_that_is_compensated_hangs_still(tmp_path):
    path = tmp_path / "still.xml"
    path.write_text(
        '<mujoco><worldbody><body gravcomp="1"><joint axis="0 1 0"/><geom size=".1" pos=".3 0 0"/></body></worldbody></mujoco>'
    )
    robot = kalmarm.load(path, takes_steps=True)
    gravity = np.array([[1.0, 2, 3], [0, 0, -1.6]])
    step = kalmarm.ImplicitStep(robot, 0.01)
    a = step.acceleration(np.array([0.4]), [0.0], 0.0, gravity=gravity)
    assert a.shape == (2, 1)
    assert np.abs(a).max() < 1e-12
    found = step.derivatives([0.4], [0.0], 0.0, gravity=gravity)
    assert np.abs(found.dq).max() < 1e-10


def test_what_is_refused_is_named(robot):
    q, qd, tau, gravity = given(robot, np.float64)
    for wrong in (gravity[:, :2], np.ones(4)):
        with pytest.raises(ValueError, match=r"forward_dynamics: gravity has shape .*3.* is needed"):
            robot.forward_dynamics(q, qd, tau, gravity=wrong)
    gravity[3, 1] = np.nan
    a, outcomes = robot.forward_dynamics(q, qd, tau, gravity=gravity, status=True)
    assert list(np.flatnonzero(outcomes["status"])) == [3]
    assert np.isnan(a[3]).all()
    assert np.isfinite(a[4]).all()
