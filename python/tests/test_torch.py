"""kalmarm.torch: operators against the robot's own calls, to the bit, and their gradients against differences."""

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import kalmarm  # noqa: E402
import kalmarm.torch as operators  # noqa: E402

ROBOTS = Path(__file__).parents[2] / "robots" / "models"
CALLS = ["forward_dynamics", "inverse_dynamics", "solve"]


def load(name, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(ROBOTS / name / f"{name}.xml", **options)


@pytest.fixture(scope="module", params=["panda", "g1"])
def robot(request):
    return load(request.param)


@pytest.fixture(scope="module")
def g1():
    return load("g1")


@pytest.fixture(scope="module")
def ball():
    builder = kalmarm.Builder()
    rest = {"mass": 1.5, "inertia": (0.3, 0.4, 0.5), "center_of_mass": (0.1, 0.05, 0.2)}
    builder.add_body("ball", joint="ball", **rest)
    builder.add_body("hinge", parent="ball", joint="hinge", axis=(0, 1, 0), position=(0, 0, 1), **rest)
    return builder.build()


def given(robot, call, rows=5, dtype=np.float64, seed=0):
    q, qd, tau = robot.random_state(seed, rows, dtype=dtype)
    return [torch.as_tensor(x) for x in ((q, tau) if call == "solve" else (q, qd, tau))]


def operator(robot, call, **options):
    return lambda *x: getattr(operators, call)(robot, *x, **options)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("call", [*CALLS, "mass_matrix"])
def test_operator_and_vmap_are_the_robots_rows_to_the_bit(robot, call, dtype):
    x = given(robot, call, 33, dtype)[: 1 if call == "mass_matrix" else None]
    truth = getattr(robot, call)(*(part.numpy() for part in x))
    one = operator(robot, call)
    for found in (one(*x), torch.func.vmap(one)(*x)):
        assert np.array_equal(found.numpy(), truth)


@pytest.mark.parametrize("call", CALLS)
def test_gradcheck(ball, call):
    robot = load("panda")
    for one in (ball, robot):
        x = [part.requires_grad_() for part in given(one, call, 2)]
        assert torch.autograd.gradcheck(operator(one, call), x, eps=1e-6, atol=1e-5, rtol=1e-5)


def test_operators_are_what_pytorch_asks_of_them(ball):
    """Schemas, fake kernels, and compilation with shapes that vary."""
    name, x = ("forward_dynamics", ball._number, 1), given(ball, "forward_dynamics", 3)
    torch.library.opcheck(operators._value, (*name, *x, None))
    torch.library.opcheck(operators._gradient, (*name, *x, None, torch.ones(3, 4).double()))


def test_compiled_function_is_the_eager_one(ball):
    x = [part.requires_grad_() for part in given(ball, "forward_dynamics", 3)]
    loss = lambda *x: operators.forward_dynamics(ball, *x).sin().sum()  # noqa: E731
    compiled = torch.compile(loss, fullgraph=True, backend="aot_eager")
    assert torch.equal(compiled(*x), loss(*x))
    pairs = zip(torch.autograd.grad(compiled(*x), x), torch.autograd.grad(loss(*x), x))
    assert all(torch.equal(*both) for both in pairs)


def test_gradients_of_rows_by_vmap_and_by_a_sum_are_the_same_bits(g1):
    x = given(g1, "forward_dynamics", 19)
    loss = lambda *x: operators.forward_dynamics(g1, *x).sin().sum()  # noqa: E731
    of_rows = torch.func.vmap(torch.func.grad(loss, (1, 2)))(*x)
    of_sum = torch.func.grad(loss, (1, 2))(*x)
    assert all(torch.equal(*both) for both in zip(of_rows, of_sum))


def test_gradient_is_orthogonal_to_quaternions(ball):
    q, qd, tau = given(ball, "forward_dynamics", 4)
    q.requires_grad_()
    (gradient,) = torch.autograd.grad(operators.forward_dynamics(ball, q, qd, tau).sum(), q)
    assert torch.all((gradient * q)[:, :4].sum(-1).abs() < 1e-12 * gradient.norm())
    assert gradient[:, :4].norm() > 0


def test_gradients_by_gravity():
    robot = load("panda")
    for call in ("forward_dynamics", "inverse_dynamics"):
        x = given(robot, call, 3)
        gravity = torch.as_tensor(5 * np.random.default_rng(1).standard_normal((3, 3))).requires_grad_()
        one = lambda gravity: getattr(operators, call)(robot, *x, gravity=gravity)  # noqa: B023, E731
        truth = getattr(robot, call)(*(part.numpy() for part in x), gravity=gravity.detach().numpy())
        np.testing.assert_array_equal(one(gravity).detach(), truth)
        assert torch.autograd.gradcheck(one, gravity, eps=1e-6, atol=1e-5, rtol=1e-5)


def test_gradients_by_loads():
    robot = load("panda", loaded=["hand"])
    x = given(robot, "forward_dynamics", 3)
    loads = torch.as_tensor(kalmarm.payload(1.5, (0.01, 0.02, 0.1), (0.01, 0.012, 0.006))).requires_grad_()
    one = lambda loads: operators.forward_dynamics(robot, *x, loads=loads)  # noqa: E731
    assert torch.autograd.gradcheck(one, loads, eps=1e-6, atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_payload_is_the_packages_with_gradients(dtype):
    mass = torch.tensor([1.5, 0.2], dtype=dtype)
    center, moments = torch.full((3, 1, 3), 0.1, dtype=dtype), torch.eye(3, dtype=dtype)
    for inertia in (0.0, [0.01, 0.012, 0.006], moments):
        truth = kalmarm.payload(mass.numpy(), center.numpy(), np.asarray(inertia, mass.numpy().dtype))
        found = operators.payload(mass, center, inertia)
        assert found.dtype == dtype
        assert np.allclose(found.numpy(), truth, rtol=4 * torch.finfo(dtype).eps, atol=0)
    assert operators.payload(1, (0, 0, 1)).tolist() == [1, 0, 0, 1, 1, 1, 0, 0, 0, 0]
    x = [part.double().requires_grad_() for part in (mass, center, moments)]
    assert torch.autograd.gradcheck(operators.payload, x)
    with pytest.raises(ValueError, match=r"payload: center has shape \(2,\)"):
        operators.payload(mass, (0, 0))


def test_tensors_with_gaps_and_broadcast_ones(g1):
    q, qd, tau = given(g1, "forward_dynamics", 6)
    truth = g1.forward_dynamics(q.numpy(), qd[:1].numpy(), tau.numpy())
    gaps = torch.stack([tau, tau], -1)[..., 0]
    found = operators.forward_dynamics(g1, q.T.contiguous().T, qd[0], gaps)
    assert np.array_equal(found.numpy(), truth)


def test_a_row_that_fails_is_nan_by_itself_and_says_so(robot):
    q, qd, tau = given(robot, "forward_dynamics")
    qd[3, 1] = torch.nan
    tau.requires_grad_()
    a, outcomes = operators.forward_dynamics(robot, q, qd, tau, status=True)
    assert outcomes.status.tolist() == [0, 0, 0, kalmarm.Status.NOT_FINITE, 0]
    (gradient,) = torch.autograd.grad(a.nansum(), tau)
    rows = torch.arange(5) == 3
    assert torch.equal(a.isnan().any(-1), rows) and torch.equal(gradient.isnan().any(-1), rows)


def test_no_rows_are_no_rows(robot):
    x = given(robot, "forward_dynamics", 0)
    assert operators.forward_dynamics(robot, *x).shape == (0, robot.nv)


def bad(robot, q, qd, tau):
    call = operators.forward_dynamics
    q_leaf = q.clone().requires_grad_()
    return [
        (lambda: call(robot, q, qd[:, :-1], tau), ValueError, r"qd has shape \(5, 34\), \(5, 35\)"),
        (lambda: call(robot, q, qd[:2], tau), ValueError, r"qd has shape \(2, 35\), \(5, 35\)"),
        (lambda: call(robot, q, qd.float(), tau), TypeError, "qd is torch.float32, arrays before it are"),
        (lambda: call(robot, q, qd, tau.int()), TypeError, "tau is torch.int32, float32 or float64"),
        (lambda: call(robot, q, qd.to("meta"), tau), ValueError, "qd is on meta, the CPU is needed"),
        (lambda: call("g1", q, qd, tau), TypeError, "robot is a str"),
        (lambda: call(robot, q, qd, tau, threads=-1), ValueError, "-1 threads"),
        (lambda: call(robot, q, qd, tau, loads=torch.zeros(10).double()), ValueError, "robot without loaded"),
        (
            lambda: operators.mass_matrix(robot, q_leaf).sum().backward(),
            NotImplementedError,
            "mass_matrix has no derivatives",
        ),
        (
            lambda: torch.func.jacrev(torch.func.grad(lambda q: call(robot, q, qd, tau).sum()))(q),
            NotImplementedError,
            "no derivatives of second order",
        ),
    ]


@pytest.mark.parametrize("case", range(10))
def test_bad_input_is_refused(g1, case):
    call, error, message = bad(g1, *given(g1, "forward_dynamics"))[case]
    with pytest.raises(error, match=message):
        call()


def test_import_without_pytorch_names_the_extra():
    code = "import sys; sys.modules['torch'] = None; import kalmarm.torch"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    last = found.stderr.splitlines()[-1]
    assert last == "ImportError: kalmarm.torch needs PyTorch: pip install 'kalmarm[torch]'"
