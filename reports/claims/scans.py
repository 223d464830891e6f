"""What it costs to evaluate a filter as a scan over blocks of links: C11."""

import math
from itertools import product
from typing import NamedTuple

from claims.claim import Check, Claim, Plot, collect, row_of
from claims.needed import SCANS
from claims.structure import LENGTHS
from read.data import Data
from read.laboratory import Laboratory, Point
from summary.groups import by_key
from summary.points import FIT_FROM, fit_exponent

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
        found = [
            (pair.ratio, f"{p.family} {p.value:g}, {p.task}, {len(pairs)} cases")
            for pair in pairs
            for p in [pair.scan]
        ]
        checks += [
            Check.largest(f"{scan}: largest error / the sequential filter’s", found, TIMES),
            Check.largest(
                f"{scan}: exponent of that ratio in N, the steepest family", _growths(pairs), GROWTH
            ),
        ]
        rows += [row_of(pair.scan, x=pair.sequence.error, share=0) for pair in pairs]
    return Claim(
        "C11",
        "A scan keeps the digits",
        "A filter evaluated as a scan over blocks of links keeps the digits of the sequential "
        "filter: its error is at most ten times the sequential one’s on every family, and the "
        "ratio of the two does not grow with N.",
        checks,
        Plot("median error of the sequential filter", "median error of the scan", rows, False),
    )


def _pairs(lab: Laboratory, scan: str, sequence: str) -> list[Pair]:
    """Of all swept families, where the sequential filter answers."""
    sequential, scans = (
        {
            (point.family, point.task, point.value): point
            for point in collect(lab, lab.swept, TASKS, ["float64"], [variant])
        }
        for variant in (sequence, scan)
    )
    return [
        Pair(point, sequential[key])
        for key, point in scans.items()
        if key in sequential and math.isfinite(sequential[key].error)
    ]


def _growths(pairs: list[Pair]) -> list[tuple[float, str]]:
    """The exponents of all series in N, over the errors that are finite."""
    finite = [(it.scan, it.ratio) for it in pairs if math.isfinite(it.ratio)]
    series = by_key(finite, lambda it: (it[0].family, it[0].task))
    growths = []
    for key in product(LENGTHS, TASKS):
        ratios = [(scan.value, ratio) for scan, ratio in series.get(key, [])]
        if fit := fit_exponent(ratios, FIT_FROM):
            growths.append((fit.exponent, ", ".join(key)))
    return growths
