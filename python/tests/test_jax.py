"""kalmarm.jax: operators against the robot's own calls, to the bit, and their derivatives against differences and matrices."""

import functools
import re
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)
import jax.numpy as jnp  # noqa: E402
from jax.test_util import check_grads  # noqa: E402

import kalmarm  # noqa: E402
import kalmarm.jax as operators  # noqa: E402

ROOT = Path(__file__).parents[2]
ROBOTS = ROOT / "robots" / "models"
BLOCK = re.compile(r"^## (.+?, in JAX)$.*?^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
EXAMPLES = BLOCK.findall((ROOT / "docs" / "jax-and-torch.md").read_text())
NAMES = ["panda", "g1"]
CALLS = ["forward_dynamics", "inverse_dynamics", "solve"]


def load(name, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(ROBOTS / name / f"{name}.xml", **options)


@pytest.fixture(scope="module", params=NAMES)
def robot(request):
    return load(request.param)


@pytest.fixture(scope="module")
def g1():
    return load("g1")


@pytest.fixture(scope="module")
def chain():
    """A free base, a ball and a slide: joints whose q has more entries than qd, and one after them."""
    builder = kalmarm.Builder()
    inertia = (0.3, 0.4, 0.5)
    rest = {"inertia": inertia, "center_of_mass": (0.1, 0.05, 0.2)}
    builder.add_body("base", joint="free", mass=2.0, **rest)
    builder.add_body("ball", parent="base", joint="ball", position=(0.1, 0.2, 0.3), mass=1.5, **rest)
    axis = (0, 0.6, 0.8)
    builder.add_body("slide", parent="ball", joint="slide", axis=axis, position=(0, 0.1, 0.4), mass=1.0, **rest)
    return builder.build()


def given(robot, call, rows=5, dtype=np.float64, seed=0):
    q, qd, tau = robot.random_state(seed, rows, dtype=dtype)
    return (q, tau) if call == "solve" else (q, qd, tau)


def operator(robot, call, **options):
    return lambda *x, **more: getattr(operators, call)(robot, *x, **options, **more)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("call", [*CALLS, "mass_matrix"])
def test_operator_jit_and_vmap_are_the_robots_rows_to_the_bit(robot, call, dtype):
    x = given(robot, call, 33, dtype)[: 1 if call == "mass_matrix" else None]
    truth = getattr(robot, call)(*x)
    one = operator(robot, call)
    for found in (one(*x), jax.jit(one)(*x), jax.vmap(one)(*x), jax.jit(jax.vmap(one))(*x)):
        assert found.dtype == dtype
        assert np.array_equal(found, truth)


def test_rows_are_spread_over_threads_to_the_bit(robot):
    x = given(robot, "forward_dynamics", 257)
    truth = operators.forward_dynamics(robot, *x)
    assert np.array_equal(operators.forward_dynamics(robot, *x, threads=0), truth)


def test_vmap_adds_no_loop(robot):
    x = given(robot, "forward_dynamics", 8)
    program = jax.make_jaxpr(jax.vmap(jax.grad(lambda q: jnp.sum(operators.solve(robot, q, x[2][0])))))(x[0])
    assert "scan" not in str(program) and "while" not in str(program)
    assert str(program).count("kalmarm_gradient") == 1


def test_vmap_over_any_axis_and_over_some_arguments(robot):
    q, qd, tau = given(robot, "forward_dynamics", 6)
    truth = robot.forward_dynamics(q, qd[:1], tau)
    one = jax.vmap(operator(robot, "forward_dynamics"), in_axes=(0, None, 1))
    assert np.array_equal(one(q, qd[0], tau.T), truth)
    nested = jax.vmap(jax.vmap(operator(robot, "forward_dynamics")))
    shape = lambda x: x.reshape(2, 3, -1)  # noqa: E731
    rows = robot.forward_dynamics(q, qd, tau)
    assert np.array_equal(nested(shape(q), shape(qd), shape(tau)), shape(rows))


@pytest.mark.parametrize("call", CALLS)
def test_derivatives_are_those_of_differences(chain, robot, call):
    for one in (chain, robot):
        x = given(one, call, 2, seed=1)
        check_grads(operator(one, call), x, 1, modes=("fwd", "rev"), rtol=1e-5, eps=1e-5)


@pytest.mark.parametrize("call", CALLS)
def test_forward_and_reverse_are_adjoint(chain, robot, call):
    """<w, J v> = <J'w, v> to rounding."""
    rng = np.random.default_rng(2)
    for one in (chain, robot):
        x = given(one, call, 16, seed=3)
        v = [rng.standard_normal(part.shape) for part in x]
        value, along = jax.jvp(operator(one, call), x, tuple(v))
        w = rng.standard_normal(value.shape)
        gradients = jax.vjp(operator(one, call), *x)[1](w)
        terms = [np.sum(g * part, axis=-1) for g, part in zip(gradients, v)]
        scale = np.sum(np.abs(w * along), axis=-1) + sum(map(np.abs, terms))
        assert np.all(np.abs(np.sum(w * along, axis=-1) - sum(terms)) < 1e-10 * scale)


def test_gradients_by_quaternions_are_the_tangent_ones_and_orthogonal_to_them(chain):
    q, qd, tau = given(chain, "forward_dynamics", 4, seed=4)
    w = np.random.default_rng(5).standard_normal(tau.shape)
    by_q = jax.vjp(lambda q: operators.forward_dynamics(chain, q, qd, tau), q)[1](w)[0]
    A = chain.forward_dynamics_derivatives(q, qd, tau).dq
    along = np.einsum("rij,ri->rj", A, w)
    h = 1e-6  # of the tangent: q moved along each axis of qd
    for j in range(chain.nv):
        v = np.zeros_like(qd)
        v[:, j] = h
        moved = (chain.integrate(q, v) - chain.integrate(q, -v)) / (2 * h)
        assert np.allclose(np.sum(moved * by_q, axis=-1), along[:, j], rtol=1e-8, atol=1e-8)
    for i in chain.model.quaternions:
        p = slice(i, i + 4)
        assert np.all(np.abs(np.sum(q[:, p] * by_q[:, p], axis=-1)) < 1e-12 * np.linalg.norm(by_q))


def test_a_quaternions_length_does_nothing_but_scale_its_gradient(chain):
    q, qd, tau = given(chain, "forward_dynamics", 1, seed=6)
    loss = lambda q: jnp.sum(operators.forward_dynamics(chain, q, qd, tau) ** 2)  # noqa: E731
    longer = q.copy()
    for i in chain.model.quaternions:
        longer[:, i : i + 4] *= 3
    assert np.isclose(loss(longer), loss(q), rtol=1e-10)
    for i in chain.model.quaternions:
        p = np.s_[:, i : i + 4]
        assert np.allclose(3 * jax.grad(loss)(longer)[p], jax.grad(loss)(q)[p], rtol=1e-8)


def test_jacobians_of_both_modes_are_the_matrices(robot):
    q, qd, tau = (x[0] for x in given(robot, "forward_dynamics", seed=7))
    truth = robot.forward_dynamics_derivatives(q, qd, tau)
    one = operator(robot, "forward_dynamics")
    for jacobian in (jax.jacfwd, jax.jacrev):
        for argument, matrix in ((1, truth.dqd), (2, truth.dtau)):
            found = jacobian(one, argument)(q, qd, tau)
            assert np.abs(found - matrix).max() < 1e-9 * np.abs(matrix).max()


def test_gradients_of_rows_by_vmap_and_by_a_sum_are_the_same_bits(g1):
    x = given(g1, "forward_dynamics", 19)
    loss = lambda *x: jnp.sum(jnp.sin(operators.forward_dynamics(g1, *x)))  # noqa: E731
    of_sum = jax.jit(jax.grad(loss, (1, 2)))(*x)
    of_rows = jax.jit(jax.vmap(jax.grad(loss, (1, 2))))(*x)
    assert all(np.array_equal(*both) for both in zip(of_sum, of_rows))


def test_float32_gradients_are_float64_ones_within_its_digits(g1):
    x = given(g1, "forward_dynamics", 7)
    gradient = jax.grad(lambda tau, q, qd: jnp.sum(operators.forward_dynamics(g1, q, qd, tau)))
    truth = gradient(x[2], *x[:2])
    found = gradient(*(np.float32(part) for part in (x[2], *x[:2])))
    assert found.dtype == np.float32
    assert np.abs(found - truth).max() < 1e-2 * np.abs(truth).max()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_poses_are_the_kinematics_to_the_bit(g1, dtype):
    kinematics = g1.kinematics(["torso_link", "left_ankle_roll_link"])
    q = g1.random_state(3, 33, dtype=dtype).q
    truth = kinematics.compute(["positions", "rotations"], q)
    one = lambda q: operators.poses(kinematics, q)  # noqa: E731
    for found in (one(q), jax.jit(one)(q), jax.vmap(one)(q), jax.jit(one)(q.reshape(3, 11, -1))):
        for ours, theirs in zip(found, truth.values()):
            assert ours.dtype == dtype
            np.testing.assert_array_equal(np.asarray(ours).reshape(theirs.shape), theirs)


def test_derivatives_of_poses_are_those_of_differences(chain, g1):
    for robot, names in ((chain, ["slide", "ball"]), (g1, ["torso_link"])):
        kinematics = robot.kinematics(names)
        q = robot.random_state(4, 3).q
        check_grads(lambda q: operators.poses(kinematics, q), (q,), 1, rtol=1e-6)  # noqa: B023
        # From the left J'w, from the right J v, of positions.
        w = np.random.default_rng(5).standard_normal((3, len(names), 3))
        J = kinematics.compute(["jacobians"], q)["jacobians"][:, :, 3:]
        by_q = jax.grad(lambda q: (operators.poses(kinematics, q)[0] * w).sum())(q)  # noqa: B023
        if robot.nq == robot.nv:
            np.testing.assert_allclose(by_q, np.einsum("rfkn,rfk->rn", J, w), rtol=1e-12)
    with pytest.raises(NotImplementedError, match="poses: there are no derivatives of second order"):
        jax.hessian(lambda q: operators.poses(kinematics, q)[0].sum())(q[0])
    with pytest.raises(TypeError, match="poses: kinematics is a Robot, a kalmarm.Kinematics is needed"):
        operators.poses(g1, q)
    with pytest.raises(ValueError, match="poses: q has shape"):
        operators.poses(kinematics, q[:, 1:])


def test_gradients_by_loads_are_those_of_differences():
    robot = load("panda", loaded=["hand"])
    q, qd, tau = given(robot, "forward_dynamics", 3)
    load_of = kalmarm.payload(1.5, (0.01, 0.02, 0.1), (0.01, 0.012, 0.006))
    for call in CALLS:
        x = given(robot, call, 3)
        check_grads(
            lambda loads: getattr(operators, call)(robot, *x, loads=loads),  # noqa: B023
            (load_of,),
            1,
            modes=("rev",),
            rtol=1e-5,
            eps=1e-5,
        )
    along = jax.jvp(lambda q: operators.forward_dynamics(robot, q, qd, tau, loads=load_of), (q,), (q,))[1]
    assert np.all(np.isfinite(along))
    with pytest.raises(NotImplementedError, match="loads: derivatives by these are in reverse mode alone"):
        jax.jvp(lambda x: operators.solve(robot, q, tau, loads=x), (load_of,), (load_of,))


def test_gravity_of_rows_is_the_robots_to_the_bit_and_derived_by():
    robot = load("g1", loaded=["torso_link"])
    load_of = kalmarm.payload(1.5, (0.01, 0.02, 0.1), (0.01, 0.012, 0.006))
    for call in ("forward_dynamics", "inverse_dynamics"):
        x = given(robot, call, 3)
        gravity = 5 * np.random.default_rng(1).standard_normal((3, 3))
        for loads in (None, load_of):
            f = lambda gravity: operator(robot, call, loads=loads)(*x, gravity=gravity)  # noqa: B023, E731
            truth = getattr(robot, call)(*x, gravity=gravity, loads=loads)
            np.testing.assert_array_equal(jax.jit(f)(gravity), truth)
            check_grads(f, (gravity,), 1, modes=("rev",), rtol=1e-5)
        by_both = jax.grad(
            lambda loads, gravity: operator(robot, call)(*x, loads=loads, gravity=gravity).sum(), (0, 1)  # noqa: B023
        )(load_of, gravity)
        one = getattr(robot, f"{call}_vjp")(*x, np.ones((3, robot.nv)), loads=load_of, gravity=gravity)
        np.testing.assert_allclose(by_both[0], one.loads.sum(0), rtol=1e-12)
        np.testing.assert_array_equal(by_both[1], one.gravity)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_payload_is_the_packages_with_derivatives(dtype):
    mass, center, moments = dtype([1.5, 0.2]), np.full((3, 1, 3), 0.1, dtype), np.eye(3, dtype=dtype)
    for inertia in (0.0, [0.01, 0.012, 0.006], moments):
        truth = kalmarm.payload(mass, center, np.asarray(inertia, dtype))
        found = operators.payload(mass, center, inertia)
        assert found.dtype == dtype
        assert np.allclose(found, truth, rtol=4 * np.finfo(dtype).eps, atol=0)
    assert operators.payload(1, (0, 0, 1)).tolist() == [1, 0, 0, 1, 1, 1, 0, 0, 0, 0]
    x = tuple(np.float64(part) for part in (mass, center, moments))
    check_grads(operators.payload, x, 2, rtol=1e-5)
    with pytest.raises(ValueError, match=r"payload: center has shape \(2,\)"):
        operators.payload(mass, (0, 0))


def test_a_row_that_fails_is_nan_by_itself_and_says_so(robot):
    q, qd, tau = given(robot, "forward_dynamics")
    qd[3, 1] = np.nan
    a, outcomes = jax.jit(operator(robot, "forward_dynamics", status=True))(q, qd, tau)
    truth, records = robot.forward_dynamics(q, qd, tau, status=True)
    assert np.array_equal(a, truth, equal_nan=True)
    assert np.array_equal(outcomes.status, records["status"])
    assert np.array_equal(outcomes.error, records["error"], equal_nan=True)
    assert outcomes.status[3] == kalmarm.Status.NOT_FINITE
    gradient = jax.grad(lambda tau: jnp.nansum(operators.forward_dynamics(robot, q, qd, tau)))(tau)
    assert np.array_equal(np.isnan(gradient).any(axis=1), np.arange(5) == 3)


def test_result_is_differentiable_where_outcomes_are_asked_for(robot):
    q, qd, tau = given(robot, "forward_dynamics")
    total = lambda tau, **options: operators.forward_dynamics(robot, q, qd, tau, **options)  # noqa: E731
    with_status = jax.grad(lambda tau: jnp.sum(total(tau, status=True)[0]))(tau)
    assert np.array_equal(with_status, jax.grad(lambda tau: jnp.sum(total(tau)))(tau))


def test_no_rows_are_no_rows(robot):
    q, qd, tau = given(robot, "forward_dynamics", 0)
    assert operators.forward_dynamics(robot, q, qd, tau).shape == (0, robot.nv)
    gradient = jax.grad(lambda q: jnp.sum(operators.forward_dynamics(robot, q, qd, tau)))(q)
    assert gradient.shape == q.shape


def test_lists_and_numbers_take_the_dtype_of_arrays(robot):
    q, _, tau = (np.float32(x) for x in given(robot, "forward_dynamics"))
    found = operators.forward_dynamics(robot, q, [0.0] * robot.nv, 0.0)
    assert found.dtype == np.float32
    assert np.array_equal(found, robot.forward_dynamics(q, 0 * tau, 0 * tau))
    integers = [[int(x) for x in robot.neutral()]]
    found = operators.solve(robot, integers, 1)
    assert np.array_equal(found, robot.solve(np.array(integers, float), 1.0))


def test_parts_of_a_question_have_values_and_no_derivatives():
    robot = load("panda", asked=["joint1", "joint3"])
    q, qd, tau = given(robot, "forward_dynamics")
    assert np.array_equal(operators.forward_dynamics(robot, q, qd, tau), robot.forward_dynamics(q, qd, tau))
    with pytest.raises(NotImplementedError, match="all of whose joints are asked about"):
        jax.grad(lambda q: jnp.sum(operators.forward_dynamics(robot, q, qd, tau)))(q)


def bad(robot, q, qd, tau):
    call = operators.forward_dynamics
    return [
        (lambda: call(robot, q, qd[:, :-1], tau), ValueError, r"qd has shape \(5, 34\), \(5, 35\)"),
        (lambda: call(robot, q, qd[:2], tau), ValueError, r"qd has shape \(2, 35\), \(5, 35\)"),
        (lambda: call(robot, q[:, 1:], qd, tau), ValueError, r"q has shape \(5, 35\), \(\.\.\., 36\)"),
        (lambda: call(robot, q, np.float32(qd), tau), TypeError, "qd is float32, arrays before it are float64"),
        (lambda: call(robot, q, qd, np.int32(tau)), TypeError, "tau is int32, float32 or float64"),
        (lambda: call("g1", q, qd, tau), TypeError, "robot is a str"),
        (lambda: call(robot, q, qd, tau, threads=-1), ValueError, "-1 threads"),
        (lambda: call(robot, q, qd, tau, loads=np.zeros(10)), ValueError, "robot without loaded"),
        (
            lambda: operators.solve(robot.replace(wants=["acceleration"]), q, tau),
            ValueError,
            "solve: the robot's question does not want it",
        ),
        (
            lambda: jax.grad(lambda q: jnp.sum(operators.mass_matrix(robot, q)))(q),
            NotImplementedError,
            "mass_matrix has no derivatives",
        ),
        (
            lambda: jax.hessian(lambda tau: jnp.sum(call(robot, q, qd, tau) ** 2))(tau),
            NotImplementedError,
            "of second order",
        ),
        (
            lambda: jax.jit(call, static_argnums=0).trace(robot, q, qd, tau).lower(lowering_platforms=("cuda",)),
            NotImplementedError,
            "runs on the CPU alone",
        ),
    ]


@pytest.mark.parametrize("case", range(12))
def test_bad_input_is_refused_when_it_is_traced(g1, case):
    call, error, message = bad(g1, *given(g1, "forward_dynamics"))[case]
    with pytest.raises(error, match=message):
        call()


def test_threads_share_a_robot(g1):
    x = given(g1, "forward_dynamics", 65)
    truth = g1.forward_dynamics(*x)
    one = jax.jit(operator(g1, "forward_dynamics"))
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: np.asarray(one(*x)), range(40)))
    assert all(np.array_equal(a, truth) for a in found)


def test_a_program_of_another_process_says_so(g1):
    x = given(g1, "forward_dynamics", 2)
    rows, error, status = (2, g1.nv), (2,), jax.ShapeDtypeStruct((2,), jnp.int32)
    results = [*(jax.ShapeDtypeStruct(shape, jnp.float64) for shape in (rows, error)), status]
    call = functools.partial(jax.ffi.ffi_call("kalmarm.forward_dynamics", results), beside="", by="")
    with pytest.raises(Exception, match="a program of another process"):
        jax.block_until_ready(call(*x, robot=np.int64(10**9), threads=np.int64(1)))
    with pytest.raises(Exception, match="argument 2 does not fit the robot"):
        number = np.int64(operators._number(g1))
        jax.block_until_ready(call(*x[:2], x[2][:, :3], robot=number, threads=np.int64(1)))


def test_import_without_jax_names_the_extra():
    code = "import sys; sys.modules['jax'] = None; import kalmarm.jax"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = found.stderr.splitlines()[-1]
    assert last == "ImportError: kalmarm.jax needs JAX: pip install 'kalmarm[jax]'"


@pytest.mark.parametrize("title", [title for title, _ in EXAMPLES])
def test_example_of_the_page_runs(title, monkeypatch):
    monkeypatch.chdir(ROOT)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        exec(compile(dict(EXAMPLES)[title], f"docs/jax-and-torch.md: {title}", "exec"), {"__name__": "__main__"})


def test_page_has_all_its_examples():
    assert len(EXAMPLES) == 3
