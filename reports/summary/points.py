"""Statistics of the records: medians, points of error and time, bands, exponents."""

import math
import statistics
from typing import NamedTuple

from read.data import Data, Error, Sample, Time, scene_name, scene_size
from summary.groups import by_key

TIME_ALONE = "time"  # the measure of a task whose errors are not measured
FIT_FROM = 15  # smaller mechanisms show overheads, not the order of growth


class Summary(NamedTuple):
    """Errors of one series over its states; median and worst are of those that did not fail."""

    median: float | None
    worst: float | None
    states: int
    failures: int
    reasons: str


class Point(NamedTuple):
    """What is known of one scene, variant, precision, task and measure; None where not measured."""

    scene: str
    name: str
    n: int
    variant: str
    precision: str
    task: str
    measure: str
    time: float | None
    variation: float | None
    median: float | None
    worst: float | None
    states: int
    failures: int
    reasons: str


class Band(NamedTuple):
    """Estimates from one number of samples over their replicas; low and high are quantiles."""

    scene: str
    quantity: str
    method: str
    samples: int
    replicas: int
    median: float
    low: float
    high: float
    time: float  # ns, median
    threads: int


class Fit(NamedTuple):
    exponent: float
    standard_error: float
    count: int


def failed(row: Error) -> bool:
    return row.outcome != "ok" or not math.isfinite(row.value)


def summarise(rows: list[Error]) -> Summary:
    bad = [row for row in rows if failed(row)]
    outcomes = sorted({row.outcome if row.outcome != "ok" else "not finite" for row in bad})
    values = [None if failed(row) else row.value for row in rows]
    return Summary(*middle_and_worst(values), ", ".join(outcomes))


def middle_and_worst(values: list[float | None]) -> tuple[float | None, float | None, int, int]:
    """Median and largest, how many there are, and of these how many are None, which failed."""
    known = [value for value in values if value is not None]
    median = statistics.median(known) if known else None
    return median, max(known, default=None), len(values), len(values) - len(known)


def points(data: Data, calls: bool = False) -> list[Point]:
    """One for every series of errors, with its time; for a time without errors, one a measure.

    With calls: of the fast path and of peers as well, unless `times` has the same series, in
    whatever sizes: one curve is of one program, as far as it goes.
    """
    errors = [row for row in data.errors if row.task != "model"]
    series = by_key(errors, lambda row: (*row[:4], row.measure))
    measures = by_key(series, lambda key: key[3])
    times = {time[:4]: time for time in data.times}
    if calls:
        timed = {_series(time) for time in data.times}
        more = [call.time for call in data.dynamics + data.peers]
        times |= {time[:4]: time for time in more if _series(time) not in timed}
    for key in times.keys() - {key[:4] for key in series}:
        for measure in {key[4] for key in measures.get(key[3], [])} or {TIME_ALONE}:
            series[*key, measure] = []
    result = []
    for (scene, *key), rows in series.items():
        time = times.get((scene, *key[:3]))
        spent = (time.nanoseconds, time.variation) if time else (None, None)
        place = scene, scene_name(scene), scene_size(scene), *key
        result.append(Point(*place, *spent, *summarise(rows)))
    return sorted(result, key=lambda point: (point.name, point.n, *point[3:7]))


def _series(time: Time) -> tuple[str, ...]:
    return scene_name(time.scene), *time[1:4]


def bands(samples: list[Sample]) -> list[Band]:
    """One for every scene, quantity, method and number of samples."""
    return [
        Band(
            *key,
            len(rows),
            *quantiles([row.error for row in rows]),
            1e9 * statistics.median(row.seconds for row in rows),
            max(row.threads for row in rows),
        )
        for key, rows in sorted(by_key(samples, lambda sample: sample[:4]).items())
    ]


def quantiles(values: list[float]) -> tuple[float, float, float]:
    """The median, and what 10 % and 90 % of the values lie below, interpolated between values."""
    if len(values) == 1:
        return (values[0],) * 3
    tenths = statistics.quantiles(values, n=10, method="inclusive")
    return tenths[4], tenths[0], tenths[-1]


def fit_exponent(pairs, smallest: float = 0) -> Fit | None:
    """Least squares of log y on log x over x >= smallest, with the slope's standard error.

    None where fewer than three points remain: two points have no scatter to judge by.
    """
    kept = [(math.log(x), math.log(y)) for x, y in pairs if x >= smallest and x > 0 and y and y > 0]
    if len({x for x, _ in kept}) < 3:
        return None
    x, y = zip(*kept)
    slope, intercept = statistics.linear_regression(x, y)
    residual = sum((b - slope * a - intercept) ** 2 for a, b in kept)
    mean = statistics.fmean(x)
    spread = sum((a - mean) ** 2 for a in x)
    return Fit(slope, math.sqrt(residual / (len(kept) - 2) / spread), len(kept))
