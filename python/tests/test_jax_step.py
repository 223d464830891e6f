"""kalmarm.jax.step_acceleration: the step's own rows, to the bit, derivatives against differences, a rollout, refusals."""

import numpy as np
import pytest

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp  # noqa: E402
from conftest import load  # noqa: E402
from jax.test_util import check_grads  # noqa: E402

import kalmarm  # noqa: E402
from kalmarm.jax import step_acceleration  # noqa: E402

H = 0.002


@pytest.fixture(scope="module")
def g1():
    return load("g1")


@pytest.fixture(scope="module")
def panda():
    return load("panda")


def gains(robot, rows, seed, dtype=np.float64):
    random = np.random.default_rng(seed)
    single = np.array(robot.model.single)
    shape = (*rows, robot.nv)
    return {
        "damping": random.uniform(0, 5, shape).astype(dtype),
        "stiffness": (random.uniform(0, 300, shape) * single).astype(dtype),
        "reference": (random.uniform(-1, 1, shape) * single).astype(dtype),
        "armature": random.uniform(0, 0.5, shape).astype(dtype),
    }


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_operator_jit_and_vmap_are_the_steps_rows_to_the_bit(g1, dtype):
    step = kalmarm.ImplicitStep(g1, H, damping=0.5)
    x = g1.random_state(0, 33, dtype=dtype)
    own = gains(g1, (33,), 1, dtype)
    truth = step.acceleration(*x, **own)

    def one(*x):
        return step_acceleration(step, *x[:3], damping=x[3], stiffness=x[4], reference=x[5], armature=x[6])

    for call in (one, jax.jit(one), jax.vmap(one), jax.jit(jax.vmap(one))):
        found = call(*x, *own.values())
        assert found.dtype == dtype
        assert np.array_equal(found, truth)
    none = {name: np.broadcast_to(np.asarray(y, dtype), x[1].shape) for name, y in step._own.items()}
    none["armature"] = np.broadcast_to(np.asarray(step._armature, dtype), x[1].shape)
    assert np.array_equal(step_acceleration(step, *x), step.acceleration(*x, **none))


def test_derivatives_are_those_of_differences(panda, g1):
    for robot in (panda, g1):
        step = kalmarm.ImplicitStep(robot, H)
        x = (*robot.random_state(2, 2), *gains(robot, (2,), 3).values())
        single = np.array(robot.model.single)

        def one(*x):
            of_springs = {"stiffness": x[4] * single, "reference": x[5], "armature": x[6]}
            return step_acceleration(step, *x[:3], damping=x[3], **of_springs)

        check_grads(one, x, 1, modes=("fwd", "rev"), rtol=1e-4, eps=1e-5)


def test_a_rollout_is_derived_through(panda):
    """Of a controller that is tuned: the change of what ten steps miss by, along a change of gains."""
    step = kalmarm.ImplicitStep(panda, H)
    q, qd, _ = panda.random_state(4, 3)
    target = q + 0.1

    def missed(stiffness):
        def move(state, _):
            q, qd = state
            a = step_acceleration(step, q, qd, 0.0, damping=5.0, stiffness=stiffness, reference=target)
            qd = qd + H * a
            return (q + H * qd, qd), None

        (last, _), _ = jax.lax.scan(move, (q, 0 * qd), length=10)
        return jnp.sum((last - target) ** 2)

    k = np.full(q.shape, 200.0)
    along = np.random.default_rng(5).uniform(-1, 1, k.shape)
    e = 1e-3
    difference = (missed(k + e * along) - missed(k - e * along)) / (2 * e)
    assert np.isclose(np.sum(jax.jit(jax.grad(missed))(k) * along), difference, rtol=1e-6)


def test_a_row_that_fails_is_nan_and_so_are_its_gradients(g1):
    step = kalmarm.ImplicitStep(g1, H, damping=1.0)
    q, qd, tau = g1.random_state(6, 5)
    tau[2, 3] = np.nan
    a, outcomes = step_acceleration(step, q, qd, tau, status=True)
    is_sound = np.arange(5) != 2
    assert np.array_equal(np.isfinite(a).all(axis=-1), is_sound)
    assert np.array_equal(np.asarray(outcomes.status) == kalmarm.Status.OK, is_sound)
    g = jax.grad(lambda b: jnp.sum(step_acceleration(step, q, qd, tau, damping=b)))(np.ones_like(qd))
    assert np.array_equal(np.isfinite(g).all(axis=-1), is_sound)


def test_what_is_wrong_is_named(panda, tmp_path):
    step = kalmarm.ImplicitStep(panda, H)
    q, qd, tau = panda.random_state(7, 2)
    with pytest.raises(TypeError, match=r"step is a Robot, a kalmarm\.ImplicitStep is needed"):
        step_acceleration(panda, q, qd, tau)
    with pytest.raises(ValueError, match=r"step_acceleration: damping has shape \(3,\), .* is needed"):
        jax.jit(lambda b: step_acceleration(step, q, qd, tau, damping=b))(np.ones(3))
    with pytest.raises(jax.errors.JaxRuntimeError, match="row 1, DoF 'joint1': damping -1"):
        step_acceleration(step, q, qd, tau, damping=np.array([[1.0], [-1.0]]) * np.ones(panda.nv))
    with pytest.raises(ValueError, match="of a step with rows"):
        step_acceleration(
            kalmarm.ImplicitStep(panda, H, rows=[kalmarm.CoupledRow(np.ones(panda.nv), damping=1)]), q, qd, tau
        )
    path = tmp_path / "arm.xml"
    path.write_text(
        """<mujoco><worldbody><body><joint name="a"/><inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/></body>
        </worldbody><actuator><motor joint="a"/></actuator></mujoco>"""
    )
    robot = kalmarm.load(path, takes_steps=True)
    with pytest.raises(ValueError, match="whose robot's file has actuators"):
        step_acceleration(kalmarm.ImplicitStep(robot, H), *robot.random_state(8, 2))
