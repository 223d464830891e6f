"""What a claim is made of, and the one rule by which its checks decide it."""

import math
from operator import itemgetter
from typing import NamedTuple

from charts.text import error_text, fit_text
from read.laboratory import Laboratory, Point
from summary.points import Fit, fit_exponent

ABA = "Sequential<Conventional>"
ABSENT = "not in this run"
LOST = 0.1  # an error above follows no law any more
RISING = 100  # in units of u: an error above is more than rounding of the answer


class Number(NamedTuple):
    """What a check decides by; its bounds are the same in every run. None: the run lacks it."""

    what: str
    value: float | None
    low: float
    high: float

    @property
    def holds(self) -> bool | None:
        return None if self.value is None else self.low <= self.value <= self.high


class Check(NamedTuple):
    """One number that a claim predicts, and the texts of the page."""

    what: str
    measured: str
    wanted: str
    number: Number
    timed: bool = False  # a time, which no seed changes

    @property
    def holds(self) -> bool | None:
        return self.number.holds

    @staticmethod
    def of(number: Number, measured: str, wanted: str, what: str = "") -> "Check":
        """Of a number that says itself what it is, unless `what` does."""
        measured = ABSENT if number.value is None else measured
        return Check(what or number.what, measured, wanted, number)

    @staticmethod
    def within(what: str, value: float | None, low: float, high: float, where: str = "") -> "Check":
        """Whether a number lies between two; an infinite one is no bound."""
        measured = "" if value is None else number_text(value) + (f" ({where})" if where else "")
        return Check.of(Number(what, value, low, high), measured, range_text(low, high))

    @staticmethod
    def at_most(what: str, value: float | None, high: float, where: str = "") -> "Check":
        return Check.within(what, value, -math.inf, high, where)

    @staticmethod
    def at_least(what: str, value: float | None, low: float, where: str = "") -> "Check":
        return Check.within(what, value, low, math.inf, where)

    @staticmethod
    def largest(what: str, found: list[tuple[float, str]], high: float) -> "Check":
        """Of numbers the largest, with where it is found."""
        value, where = max(found, key=itemgetter(0), default=(None, ""))
        return Check.at_most(what, value, high, where)

    @staticmethod
    def slope(what: str, fit: Fit | None, expected: float, tolerance: float) -> "Check":
        number = Number(what, fit and fit.exponent, expected - tolerance, expected + tolerance)
        return Check.of(number, fit_text(fit), f"{expected:g} ± {tolerance:g}")


class Plot(NamedTuple):
    """Rows with scene, task, variant, precision, x, error (None: failed), share and seeds."""

    x: str
    y: str
    rows: list[dict]
    lines: bool = True


class Claim(NamedTuple):
    id: str
    title: str
    sentence: str
    checks: list[Check]
    plot: Plot

    @property
    def verdict(self) -> str:
        """Refuted by one check that fails; else open while one is absent; else confirmed."""
        held = [check.holds for check in self.checks]
        if False in held:
            return "refuted"
        return "open" if None in held or not held else "confirmed"


def range_text(low: float, high: float) -> str:
    bounds = [number_text(bound) for bound in (low, high)]
    if math.isinf(low):
        return f"at most {bounds[1]}"
    return f"at least {bounds[0]}" if math.isinf(high) else f"{bounds[0]} to {bounds[1]}"


def slope(points: list[Point], low: float = 0, high: float = math.inf, smallest: float = 0):
    """The exponent of error against value where the error lies between low and high."""
    pairs = ((p.value, p.error) for p in points if low < p.error < high)
    return fit_exponent(pairs, smallest)


def rising(points: list[Point]) -> Fit | None:
    """The exponent where the error is neither rounding of the answer nor lost."""
    return slope(points, RISING * points[0].u, LOST) if points else None


def number_text(value: float) -> str:
    if math.isinf(value):
        return "failed"
    plain = value == 0 or 0.01 <= abs(value) < 1e4
    return f"{value:.3g}".replace("-", "−") if plain else error_text(value)


def row(scene, task, variant, precision, x, error: float | None, share, seeds) -> dict:
    """Of a plot; an infinite error is a failure."""
    place = {"scene": scene, "task": task, "variant": variant, "precision": precision, "x": x}
    error = error if error is None or math.isfinite(error) else None
    return place | {"error": error, "share": share, "seeds": seeds}


def row_of(point: Point, **fields) -> dict:
    """Of a median error against the swept value; other fields may replace these."""
    place = point.family, point.task, point.variant, point.precision, point.value
    return row(*place, point.error, point.failures / point.seeds, point.seeds) | fields


def swept(x: str, *series) -> Plot:
    """Of median errors against what is swept; `series` are those of `collect`."""
    return Plot(x, "median relative error", [row_of(point) for point in collect(*series)])


def collect(lab: Laboratory, families, tasks, precisions, variants) -> list[Point]:
    """All points of these series, in this order."""
    return [
        point
        for family in families
        for task in tasks
        for precision in precisions
        for variant in variants
        for point in lab.series(family, task, precision, variant)
    ]
