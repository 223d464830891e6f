"""What a call takes and gives: shapes, dtypes, memory, failures, threads."""

import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import relative

import kalmarm

CALLS = {  # which of q, qd and tau, and the shape of the result, of a robot with n DoF
    "forward_dynamics": ((0, 1, 2), lambda n: (n,)),
    "inverse_dynamics": ((0, 1, 2), lambda n: (n,)),
    "bias": ((0, 1), lambda n: (n,)),
    "gravity": ((0,), lambda n: (n,)),
    "mass_matrix": ((0,), lambda n: (n, n)),
    "inverse_mass_matrix": ((0,), lambda n: (n, n)),
    "solve": ((0, 2), lambda n: (n,)),
    "diagonal": ((0,), lambda n: (n,)),
    "log_det": ((0,), lambda n: ()),
    "forward_dynamics_derivatives": ((0, 1, 2), None),
}


@pytest.fixture(params=CALLS)
def call(request):
    return request.param


def arguments(robot, call, count=None, dtype=np.float64, seed=0):
    state = robot.random_state(seed, count, dtype=dtype)
    return tuple(state[i] for i in CALLS[call][0])


def flat(result) -> np.ndarray:
    if isinstance(result, kalmarm.Derivatives):
        return np.concatenate([np.ravel(one) for one in result])
    return np.ravel(result)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("leading", [(), (1,), (37,), (3, 5), (0,)])
def test_leading_dimensions_and_dtype_are_those_of_the_states(g1, call, dtype, leading):
    count = int(np.prod(leading))
    given = [
        x.reshape(*leading, x.shape[-1]) if leading else x[0]
        for x in arguments(g1, call, max(count, 1) if leading != (0,) else 0, dtype)
    ]
    result = getattr(g1, call)(*given)
    shapes = CALLS[call][1]
    if shapes is None:
        n = g1.nv
        assert [x.shape for x in result] == [(*leading, n, n)] * 3 + [(*leading, n)]
        assert all(x.dtype == dtype for x in result)
    else:
        assert np.shape(result) == (*leading, *shapes(g1.nv))
        assert result.dtype == dtype


def test_rows_are_what_single_states_give(g1, call):
    given = arguments(g1, call, 21)
    rows = getattr(g1, call)(*given)
    one = getattr(g1, call)(*(x[13] for x in given))
    if call == "forward_dynamics_derivatives":
        for many, single in zip(rows, one):
            np.testing.assert_allclose(many[13], single, atol=1e-11 * np.abs(single).max())
    else:
        np.testing.assert_allclose(rows[13], one, atol=1e-11 * np.abs(one).max())


def test_bits_do_not_depend_on_threads(g1, call):
    given = arguments(g1, call, 301)
    alone = flat(getattr(g1, call)(*given))
    for threads in (2, 3, 0):
        np.testing.assert_array_equal(flat(getattr(g1, call)(*given, threads=threads)), alone)


def test_eight_python_threads_may_share_a_robot(g1, call):
    """Each has states of its own, of one state and of many, in both precisions."""
    jobs = [
        (arguments(g1, call, count, dtype, seed))
        for seed in range(8)
        for count in (None, 33)
        for dtype in (np.float32, np.float64)
    ]
    alone = [flat(getattr(g1, call)(*given)) for given in jobs]

    def repeat(job):
        given, truth = job
        for _ in range(5):
            np.testing.assert_array_equal(flat(getattr(g1, call)(*given, threads=2)), truth)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(repeat, list(zip(jobs, alone)) * 2))


def test_eight_python_threads_may_share_factors(g1):
    factors = g1.factor(g1.q0)
    taus = np.random.default_rng(0).standard_normal((8, g1.nv))
    alone = [factors.solve(tau) for tau in taus]

    def repeat(i):
        for _ in range(200):
            np.testing.assert_array_equal(factors.solve(taus[i]), alone[i])

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(repeat, range(8)))


def test_out_takes_the_result(g1, call):
    for count in (None, 9):
        given = arguments(g1, call, count)
        fresh = getattr(g1, call)(*given)
        out = getattr(g1, call)(*arguments(g1, call, count, seed=1))
        again = getattr(g1, call)(*given, out=out)
        np.testing.assert_array_equal(flat(out), flat(fresh))
        np.testing.assert_array_equal(flat(again), flat(fresh))
        if call != "forward_dynamics_derivatives":
            assert again is out


def test_strided_and_read_only_states_are_taken(iiwa):
    q, qd, tau = iiwa.random_state(0, 12)
    truth = iiwa.forward_dynamics(q[::2], qd[::2], tau[::2])
    wide = np.asfortranarray(q)
    wide.setflags(write=False)
    found = iiwa.forward_dynamics(wide[::2], qd[::-1][::-1][::2], np.ascontiguousarray(tau)[::2])
    np.testing.assert_array_equal(found, truth)
    broadcast = np.broadcast_to(tau[0], (6, 7))
    np.testing.assert_array_equal(
        iiwa.forward_dynamics(q[:6], qd[:6], broadcast),
        iiwa.forward_dynamics(q[:6], qd[:6], broadcast.copy()),
    )
    swapped = q.astype(q.dtype.newbyteorder())
    np.testing.assert_array_equal(iiwa.mass_matrix(swapped), iiwa.mass_matrix(q))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_states_and_numbers_are_broadcast_to_rows(iiwa, dtype):
    q, qd, tau = iiwa.random_state(0, 6, dtype=dtype)
    step = kalmarm.ImplicitStep(iiwa, 0.01, stiffness=1e3)
    for call in (iiwa.forward_dynamics, iiwa.forward_dynamics_derivatives, step, step.derivatives):
        for given in (
            (q, qd[0], 0.5),
            (q, 0, tau),
            (q[0], qd[1], tau),
            (q[0], 0, np.array(2, dtype)),
            (q[:, None], qd[:3], tau[0]),
            (q[:0], qd[0], 0),
        ):
            leading = np.broadcast_shapes(*(np.shape(x)[:-1] for x in given))
            whole = [np.array(np.broadcast_to(x, (*leading, 7)), dtype) for x in given]
            for one, other in zip(call(*given), call(*whole), strict=True):
                np.testing.assert_array_equal(one, other)
    for gain in ("damping", "stiffness", "reference"):
        for value in (3, tau[0] ** 2):
            whole = np.array(np.broadcast_to(value, (6, 7)), dtype)
            np.testing.assert_array_equal(
                step.acceleration(q, qd, tau, **{gain: value}),
                step.acceleration(q, qd, tau, **{gain: whole}),
            )
    x = iiwa.factor(q[0]).solve(tau)
    np.testing.assert_allclose(iiwa.solve(q[0], tau), x, rtol=1e-4 if dtype == np.float32 else 1e-9)


class Lender:
    """What has DLPack alone, as tensors of other libraries have."""

    def __init__(self, array):
        self.array = array

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def test_other_libraries_lend_their_memory(iiwa):
    q, qd, tau = iiwa.random_state(0, 12, dtype=np.float32)
    truth = iiwa.forward_dynamics(q, qd, tau)
    out = np.full((12, 7), np.nan, np.float32)
    returned = iiwa.forward_dynamics(Lender(q), memoryview(qd), Lender(tau), Lender(out))
    np.testing.assert_array_equal(out, truth)
    np.testing.assert_array_equal(returned, truth)


def test_lists_are_float64_or_what_arrays_are(iiwa):
    zeros = [0] * 7
    assert iiwa.forward_dynamics(zeros, zeros, zeros).dtype == np.float64
    assert iiwa.forward_dynamics(np.zeros(7, np.float32), zeros, zeros).dtype == np.float32


@pytest.mark.parametrize(
    ("shapes", "message"),
    [
        (((8,), (7,), (7,)), r"forward_dynamics: q has shape \(8,\), \(7,\) or \(\.\.\., 7\) is"),
        (((4, 7), (4, 6), (4, 7)), r"qd has shape \(4, 6\), \(4, 7\) is needed"),
        (((4, 7), (4, 7), (5, 7)), r"tau has shape \(5, 7\), \(4, 7\) is needed"),
        (((4, 7), (1,), (4, 7)), r"qd has shape \(1,\), \(4, 7\) is needed"),
        (((2, 4, 7), (3, 1, 7), (7,)), r"qd has shape \(3, 1, 7\), \(2, 4, 7\) is needed"),
        (((), (7,), (7,)), r"q has shape \(\), \(7,\) or"),
    ],
)
def test_wrong_shapes_are_refused_with_both(iiwa, shapes, message):
    with pytest.raises(ValueError, match=message):
        iiwa.forward_dynamics(*(np.zeros(shape) for shape in shapes))


def test_wrong_dtypes_are_refused(iiwa):
    q = np.zeros(7)
    with pytest.raises(TypeError, match="q is int64, float32 or float64 is needed"):
        iiwa.mass_matrix(np.zeros(7, int))
    with pytest.raises(TypeError, match="qd is float32, arrays before it are float64"):
        iiwa.bias(q, q.astype(np.float32))
    with pytest.raises(TypeError, match="complex128"):
        iiwa.gravity(q.astype(complex))
    with pytest.raises(TypeError, match="out is float32, float64 is needed"):
        iiwa.gravity(q, np.zeros(7, np.float32))
    with pytest.raises(TypeError, match="the factors are float64"):
        iiwa.factor(q).solve(q.astype(np.float32))
    with pytest.raises((TypeError, ValueError)):
        iiwa.gravity("seven")


def test_results_that_share_memory_are_refused(iiwa):
    state = iiwa.random_state(0, 4)
    for call in (iiwa.forward_dynamics_derivatives, kalmarm.ImplicitStep(iiwa, 0.01).derivatives):
        fresh, out = call(*state), call(*state)
        last = out.dq.base.ravel()[-28:].reshape(4, 7)  # of the memory of dq
        for wrong in (
            out._replace(dqd=out.dq),
            out._replace(dtau=out.dqd),
            out._replace(a=last),
        ):
            with pytest.raises(ValueError, match=r"out\.\w+ lies in the same memory as out\.d"):
                call(*state, out=wrong)
        np.testing.assert_array_equal(flat(call(*state, out=out)), flat(fresh))


def test_masked_arrays_are_refused(iiwa):
    q = np.ma.masked_array(np.zeros((4, 7)), mask=True)
    with pytest.raises(TypeError, match="mass_matrix: q is a masked array, and masks are not kept"):
        iiwa.mass_matrix(q)
    with pytest.raises(TypeError, match="gravity: out is a masked array"):
        iiwa.gravity(q.filled(0), out=q)
    with pytest.raises(TypeError, match="stiffness is a masked array"):
        kalmarm.ImplicitStep(iiwa, 0.01, stiffness=q[0])


def test_derivatives_are_a_named_tuple(iiwa):
    d = iiwa.forward_dynamics_derivatives(*iiwa.random_state(0))
    assert type(d)._fields == ("dq", "dqd", "dtau", "a")
    assert d == type(d)(*d) and d._replace(a=None).a is None
    assert type(kalmarm.ImplicitStep(iiwa, 0.01).derivatives(*iiwa.random_state(0))) is type(d)


def test_out_that_cannot_take_the_result_is_refused(iiwa):
    q = np.zeros((4, 7))
    with pytest.raises(ValueError, match=r"out has shape \(4, 6\), \(4, 7\) is needed"):
        iiwa.gravity(q, np.zeros((4, 6)))
    with pytest.raises(ValueError, match="writeable and contiguous"):
        iiwa.gravity(q, np.zeros((8, 7))[::2])
    with pytest.raises(ValueError, match="out lies in the same memory as q"):
        iiwa.gravity(q, q)
    with pytest.raises(TypeError, match="out is not what an earlier call returned"):
        iiwa.forward_dynamics_derivatives(q, q, q, out=np.zeros(3))
    with pytest.raises(ValueError, match="-1 threads"):
        iiwa.gravity(q, threads=-1)


def test_a_state_that_is_not_finite_is_raised_and_its_row_is_nan(iiwa, call):
    given = arguments(iiwa, call, 5)
    clean = getattr(iiwa, call)(*given)
    broken = [x.copy() for x in given]
    broken[0][2, 1] = np.nan
    with pytest.raises(kalmarm.DynamicsError, match=r"q\[1\] is nan") as error:
        getattr(iiwa, call)(*(x[2] for x in broken))
    assert error.value.outcome["status"] != kalmarm.Status.OK
    assert isinstance(error.value, ArithmeticError)
    rows, outcomes = getattr(iiwa, call)(*broken, status=True)
    assert (outcomes["status"] != kalmarm.Status.OK).tolist() == [False, False, True, False, False]
    quiet = getattr(iiwa, call)(*broken)
    for result in (rows, quiet):
        parts = result if isinstance(result, kalmarm.Derivatives) else (result,)
        of_clean = clean if isinstance(clean, kalmarm.Derivatives) else (clean,)
        for one, expected in zip(parts, of_clean):
            assert np.all(np.isnan(one[2]))
            np.testing.assert_allclose(one[[0, 1, 3, 4]], expected[[0, 1, 3, 4]], rtol=1e-9)


def test_the_input_that_is_not_finite_is_named(iiwa):
    state = iiwa.random_state(0)
    for name, value in (("qd", np.inf), ("tau", -np.inf), ("q", np.nan)):
        bad = state._replace(**{name: np.where(np.arange(7) == 4, value, getattr(state, name))})
        with pytest.raises(kalmarm.DynamicsError, match=rf": {name}\[4\] is {value}"):
            iiwa.forward_dynamics(*bad)
    with pytest.raises(
        kalmarm.DynamicsError, match="inverse_dynamics: not_finite: the result over"
    ):
        iiwa.inverse_dynamics(state.q, state.qd, np.full(7, 1e308))


def test_a_solve_that_is_not_finite_is_raised_and_its_row_is_nan(iiwa):
    factors = iiwa.factor(iiwa.q0)
    taus = np.random.default_rng(0).standard_normal((5, iiwa.nv))
    clean = factors.solve(taus)
    taus[2, 1] = np.nan
    with pytest.raises(kalmarm.DynamicsError, match=r"solve: not_finite: tau\[1\] is nan"):
        factors.solve(taus[2])
    rows = factors.solve(taus)
    assert np.all(np.isnan(rows[2]))
    np.testing.assert_array_equal(rows[[0, 1, 3, 4]], clean[[0, 1, 3, 4]])


def test_status_of_one_state_is_a_record(iiwa):
    a, outcome = iiwa.forward_dynamics(*iiwa.random_state(0), status=True)
    assert a.shape == (7,)
    assert outcome["status"] == kalmarm.Status.OK
    assert 0 < outcome["error"] < 1e-12
    _, outcome = iiwa.inverse_mass_matrix(iiwa.random_state(0)[0], status=True)
    assert np.isnan(outcome["error"])  # none is estimated
    certified = iiwa.replace(tolerance=kalmarm.last_bits)
    _, outcomes = certified.forward_dynamics(*certified.random_state(0, 6), status=True)
    assert outcomes.shape == (6,)
    assert np.all(outcomes["error"] < 1e-15)
    assert np.all(outcomes["rung"] == kalmarm.Rung.REFINED)


def massless_tip() -> kalmarm.Robot:
    builder = kalmarm.Builder("tip")
    builder.add_body("arm", joint="hinge", axis=(0, 1, 0), mass=1, inertia=(1, 1, 1))
    builder.add_body("tip", parent="arm", joint="hinge", position=(0, 0, 1))
    return builder.build()


def test_a_singular_robot_raises_with_the_joint():
    robot = massless_tip()
    with pytest.raises(kalmarm.DynamicsError, match="singular at 'tip'"):
        robot.forward_dynamics([0, 0], [0, 0], [0, 1])
    with pytest.raises(kalmarm.DynamicsError, match="factor: singular"):
        robot.factor([0, 0])
    x, outcome = robot.inverse_mass_matrix([0, 0], status=True)
    assert np.all(np.isnan(x))
    assert outcome["status"] == kalmarm.Status.SINGULAR
    assert outcome["joint"] == 1


def wrist() -> kalmarm.Robot:
    """Its outer axes are parallel at q = 0."""
    builder = kalmarm.Builder("wrist")
    builder.add_body("base", joint="hinge", axis=(0, 1, 0), mass=1, inertia=(1, 1, 1))
    builder.add_body("roll", parent="base", joint="hinge", axis=(0, 0, 1))
    builder.add_body("pitch", parent="roll", joint="hinge", axis=(1, 0, 0))
    builder.add_body(
        "tip", parent="pitch", joint="hinge", axis=(0, 0, 1), mass=1, inertia=(1, 2, 2)
    )
    return builder.build()


def test_rows_that_warn_are_one_warning_with_their_numbers():
    robot = wrist()
    q = np.full((19, 4), 0.5)
    q[[3, 7]] = 1e-13
    with pytest.warns(RuntimeWarning, match="solve: nearly singular at 'base'"):
        robot.solve(q[3], np.ones(4))
    rows = r"solve: 2 of 19 rows warn \(3, 7\), row 3: nearly singular at 'base': D = 1, scale"
    with pytest.warns(RuntimeWarning, match=rows) as warned:
        robot.solve(q, np.ones_like(q))
    assert len(warned) == 1
    q[:] = 1e-13
    with pytest.warns(RuntimeWarning, match=r"19 of 19 rows warn \(0, 1, 2, 3, 4, \.\.\.\)"):
        robot.solve(q, np.ones_like(q))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _, outcomes = robot.solve(q, np.ones_like(q), status=True)
    assert np.all(outcomes["near_singular"])


def test_an_acceleration_of_exactly_zero_is_no_warning():
    """Of a pendulum on a cart that hangs still."""
    builder = kalmarm.Builder()
    builder.add_body("cart", joint="slide", axis=(1, 0, 0), mass=1)
    builder.add_body(
        "rod",
        parent="cart",
        joint="hinge",
        axis=(0, 1, 0),
        mass=1,
        center_of_mass=(0, 0, -0.5),
        inertia=(1, 1, 1),
    )
    robot = builder.build()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for tolerance in (None, kalmarm.last_bits):
            for shape in ((2,), (5, 2)):
                for dtype in (np.float32, np.float64):
                    zero = np.zeros(shape, dtype)
                    one = robot.replace(tolerance=tolerance)
                    a = one.forward_dynamics(zero, zero, zero)
                    _, outcomes = one.forward_dynamics(zero, zero, zero, status=True)
                    assert not np.any(a)
                    assert np.all(outcomes["error"] < 1e-13)


def test_of_many_a_singular_row_fails_alone():
    robot = wrist()
    q = np.random.default_rng(0).uniform(0.5, 1, (19, 4))
    q[7] = 0
    tau = np.ones_like(q)
    regular = np.arange(19) != 7
    for one in (q, q.astype(np.float32)):
        for given in ((robot.inverse_mass_matrix, one), (robot.solve, one, tau.astype(one.dtype))):
            result, outcomes = given[0](*given[1:], status=True)
            assert outcomes["status"][7] == kalmarm.Status.SINGULAR
            assert np.all(np.isnan(result[7]))
            assert np.all(outcomes["status"][regular] == kalmarm.Status.OK)
        M, outcomes = robot.mass_matrix(one, status=True)
        assert np.all(outcomes["status"] == kalmarm.Status.OK)
        x = robot.solve(one, tau.astype(one.dtype))[regular]
        back = np.einsum("nij,nj->ni", M[regular], x)
        assert relative(back, tau[regular]) < 1e4 * np.finfo(one.dtype).eps


def test_no_call_leaves_python_warnings(iiwa):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        iiwa.forward_dynamics(*iiwa.random_state(0))
