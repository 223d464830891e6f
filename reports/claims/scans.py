"""What it costs to evaluate a filter as a scan over blocks of links: C11."""

import math
from typing import NamedTuple

from claims.claim import ABA, GIVENS, Check, Claim, Plot, row_of, within
from claims.structure import LENGTHS
from read.data import Data
from read.laboratory import Laboratory, Point
from summary.points import FIT_FROM, fit_exponent

SCANS = {"Scan<Conventional>": ABA, "Scan<SquareRoot>": GIVENS}  # and what they are in sequence
TASKS = ("random", "dynamics")
ROUNDING = 10  # in units of u: an error below counts as this
TIMES = 10
GROWTH = 0.5


class Pair(NamedTuple):
    """The same filter on the same mechanisms."""

    scan: Point
    sequence: Point

    @property
    def ratio(self) -> float:
        least = ROUNDING * self.sequence.u
        return max(self.scan.error, least) / max(self.sequence.error, least)


def scans(data: Data) -> Claim:
    """C11. Float64, random torques and full dynamics, medians; an error below 10 u counts as 10 u.
    On every swept family and value where the sequential filter answers, the error of the same
    filter as a scan is at most 10 times that of the sequential one, a failure being infinitely
    wrong. And in every family of chains the exponent in N (N >= 15) of the ratio of the two is at
    most 0.5. Of covariances Scan<Conventional> beside ABA, of square roots Scan<SquareRoot> beside
    Givens."""
    lab = data.laboratory
    checks, rows = [], []
    for scan, sequence in SCANS.items():
        pairs = _pairs(lab, scan, sequence)
        checks += [_kept(scan, pairs), _growing(scan, pairs)]
        rows += [row_of(pair.scan, x=pair.sequence.error, share=0) for pair in pairs]
    return Claim(
        "C11",
        "A scan keeps the digits",
        "A filter evaluated as a scan over blocks of links keeps the digits of the sequential "
        "filter: its error is at most ten times the sequential one’s on every family, and the "
        "ratio of the two does not grow with N.",
        checks,
        Plot(
            "median error of the sequential filter",
            "median error of the scan",
            rows,
            lines=False,
        ),
    )


def _pairs(lab: Laboratory, scan: str, sequence: str) -> list[Pair]:
    """Of all swept families, where the sequential filter answers."""
    pairs = []
    for family in lab.swept:
        for task in TASKS:
            answered = {
                point.value: point
                for point in lab.series(family, task, "float64", sequence)
                if math.isfinite(point.error)
            }
            pairs += [
                Pair(point, answered[point.value])
                for point in lab.series(family, task, "float64", scan)
                if point.value in answered
            ]
    return pairs


def _kept(scan: str, pairs: list[Pair]) -> Check:
    worst = max(pairs, key=lambda pair: pair.ratio, default=None)
    where = ""
    if worst:
        point = worst.scan
        where = f"{point.family} {point.value:g}, {point.task}, {len(pairs)} cases"
    what = f"{scan}: largest error / the sequential filter’s"
    return within(what, worst and worst.ratio, -math.inf, TIMES, where)


def _growing(scan: str, pairs: list[Pair]) -> Check:
    """The steepest of the series whose errors are all finite."""
    steepest = {}
    for family in LENGTHS:
        for task in TASKS:
            series = [p for p in pairs if (p.scan.family, p.scan.task) == (family, task)]
            ratios = [(p.scan.value, p.ratio) for p in series if math.isfinite(p.ratio)]
            if fit := fit_exponent(ratios, FIT_FROM):
                steepest[family, task] = fit.exponent
    series = max(steepest, key=steepest.get, default=None)
    what = f"{scan}: exponent of that ratio in N, the steepest family"
    where = ", ".join(series) if series else ""
    return within(what, steepest.get(series), -math.inf, GROWTH, where)
