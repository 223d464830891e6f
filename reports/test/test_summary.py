"""Statistics on cases whose answer is known by hand."""

import math

import pytest

from read.data import Call, Data, Error, Sample, Time
from summary.points import bands, fit_exponent, points, quantiles, summarise


def errors(*values, outcome="ok"):
    return [
        Error("panda:7", "A", "float64", "inverse", state, "relative", value, outcome)
        for state, value in enumerate(values)
    ]


def test_failures_are_counted_and_no_part_of_the_median():
    failures = errors(math.nan, outcome="singular")
    assert summarise(errors(1.0, 3.0, 2.0) + failures) == (2.0, 3.0, 4, 1, "singular")


def test_a_value_that_is_not_finite_is_a_failure():
    assert summarise(errors(1.0, math.inf)) == (1.0, 1.0, 2, 1, "not finite")


def test_where_all_states_fail_there_is_no_median():
    assert summarise(errors(math.nan, math.nan, outcome="indefinite")) == (
        None,
        None,
        2,
        2,
        "indefinite",
    )


def test_a_point_joins_errors_with_their_time():
    time = Time("panda:7", "A", "float64", "inverse", 120.0, 0.01, 5, "")
    other = time._replace(precision="float32", nanoseconds=60.0)
    float32, float64 = points(Data(errors=errors(1.0, 2.0), times=[time, other]))
    assert (float64.time, float64.median, float64.states) == (120.0, 1.5, 2)
    assert (float32.time, float32.median, float32.states) == (60.0, None, 0)


def test_a_refused_benchmark_gives_a_point_without_a_time():
    time = Time("panda:7", "A", "float64", "inverse", None, None, 1, "too far off")
    (point,) = points(Data(errors=errors(1.0), times=[time]))
    assert point.time is None and point.median == 1.0


def test_calls_are_points_of_series_that_times_do_not_have():
    time = Time("panda:7", "A", "float64", "inverse", 120.0, 0.01, 5, "")
    peers = [
        Call(time._replace(scene="panda:8"), None, None, None),
        Call(time._replace(variant="B"), None, None, None),
        Call(time._replace(task="derivatives"), None, None, None),
    ]
    data = Data(errors=errors(1.0), times=[time], peers=peers)
    (alone,) = points(data)
    a_derivatives, a, b = sorted(points(data, calls=True), key=lambda point: point[3:6])
    assert a == alone and a.time == 120
    assert (b.time, b.measure, b.states) == (120, "relative", 0)
    assert (a_derivatives.task, a_derivatives.measure) == ("derivatives", "time")


def test_condition_numbers_are_no_points():
    model = [row._replace(task="model", measure="kappa") for row in errors(1.0)]
    assert points(Data(errors=model)) == []


def test_an_exact_power_has_its_exponent_and_no_scatter():
    fit = fit_exponent([(n, 3 * n**2.5) for n in (15, 31, 63, 127)])
    assert fit.exponent == pytest.approx(2.5)
    assert fit.standard_error == pytest.approx(0, abs=1e-7)
    assert fit.count == 4


def test_the_standard_error_is_that_of_a_straight_line():
    # 0, 1, 1, 2 over 0, 1, 2, 3: slope 0.6, residuals 0.2, spread 5; error sqrt(0.2 / 2 / 5).
    pairs = [(20 * math.e**x, math.e**y) for x, y in zip(range(4), (0, 1, 1, 2))]
    fit = fit_exponent(pairs)
    assert fit.exponent == pytest.approx(0.6)
    assert fit.standard_error == pytest.approx(math.sqrt(0.02))


def test_small_sizes_and_values_without_a_logarithm_are_left_out():
    pairs = [(1, 1e9), (7, 1e9), (15, 15.0), (31, 31.0), (63, 63.0), (127, None), (255, 0.0)]
    fit = fit_exponent(pairs, 15)
    assert fit.exponent == pytest.approx(1) and fit.count == 3


def test_two_sizes_are_no_fit():
    assert fit_exponent([(15, 1.0), (31, 2.0), (31, 2.1)]) is None


def test_all_sizes_count_where_none_is_too_small():
    fit = fit_exponent([(1, 1.0), (4, 0.5), (16, 0.25), (0, 1e-16)])
    assert fit.exponent == pytest.approx(-0.5) and fit.count == 3


def test_quantiles_lie_between_the_values():
    assert quantiles([10.0, *map(float, range(10))]) == (5, 1, 9)
    assert quantiles([0.0, 1.0]) == (0.5, pytest.approx(0.1), pytest.approx(0.9))
    assert quantiles([3.0]) == (3, 3, 3)


def test_a_band_is_over_the_replicas_of_one_number_of_samples():
    def samples(count, scale, *errors):
        return [
            Sample("panda:7", "M", "MonteCarlo", count, i, error, scale * error, 2)
            for i, error in enumerate(errors)
        ]

    first, second = bands(samples(128, 1.0, 8.0) + samples(64, 1e-9, *map(float, range(11))))
    assert first == ("panda:7", "M", "MonteCarlo", 64, 11, 5, 1, 9, pytest.approx(5), 2)
    assert second[3:9] == (128, 1, 8, 8, 8, 8e9)
