"""What repeated trials say: for every family, value, task, precision and variant one point."""

import math
from collections import defaultdict
from typing import NamedTuple

import numpy as np

from read.stress import TEXTS, WILD, WRONG, Family, Stress, U, Variant

GROUP = ("family", "task", "precision", "variant", "value")
MEDIANS = ("eta", "kappa", "kappa_scaled", "kS", "backward", "oettli_prager")
FAILURES = ("singular", "indefinite", "not_finite")


class Point(NamedTuple):
    """Medians over the seeds; a failure counts as an infinite error, for nothing is right of it."""

    family: str
    task: str
    precision: str
    variant: str
    value: float
    n: int
    seeds: int
    error: float
    worst: float
    worst_eta: float
    eta: float
    kappa: float
    kappa_scaled: float
    kS: float
    backward: float
    oettli_prager: float
    singular: int
    indefinite: int
    not_finite: int
    wrong: int  # relative error above 1 %
    silent: int  # of these without a warning

    @property
    def failures(self) -> int:
        return self.singular + self.indefinite + self.not_finite

    @property
    def u(self) -> float:
        return U[self.precision]

    @property
    def outcome(self) -> str:
        """The median's own: ok, the commonest way to fail, wrong, or wrong with a warning."""
        if self.error <= WRONG:
            return "ok"
        if math.isinf(self.error) and self.failures:
            return max(FAILURES, key=lambda status: getattr(self, status))
        return "warned" if self.silent * 2 < self.wrong else "wrong"


class Laboratory:
    """The points, by series; exactly singular mechanisms, which have no right answer, apart."""

    def __init__(
        self, stress: Stress, families: dict[str, Family], known: dict[str, Variant] | None = None
    ):
        self.stress = stress
        self.kinds = {name: families[name].kind for name in stress.present("family")}
        self.known = known or {}  # variants by name
        points = _points(stress)
        singular = {name for name in self.kinds if families[name].singular}
        self.impossible = [p for p in points if p.family in singular and p.value == 0]
        self.points = [p for p in points if not (p.family in singular and p.value == 0)]
        self.singular_families = singular
        self._series = defaultdict(list)
        for point in self.points:
            self._series[point[:4]].append(point)

    def series(self, family: str, task: str, precision: str, variant: str) -> list[Point]:
        """In order of the swept value."""
        return self._series.get((family, task, precision, variant), [])

    @property
    def families(self) -> list[str]:
        return sorted({key[0] for key in self._series})

    @property
    def swept(self) -> list[str]:
        """The families made on purpose and not near a singularity."""
        apart = {*self.wild, *self.singular_families}
        return [family for family in self.families if family not in apart]

    @property
    def wild(self) -> list[str]:
        """The families drawn at random."""
        return sorted(family for family, kind in self.kinds.items() if kind == WILD)

    @property
    def tasks(self) -> set[str]:
        return {key[1] for key in self._series}

    def tasks_of(self, family: str) -> set[str]:
        return {key[1] for key in self._series if key[0] == family}

    @property
    def variants(self) -> list[str]:
        return sorted({key[3] for key in self._series})


def _points(stress: Stress) -> list[Point]:
    if not len(stress):
        return []
    order, new = stress.order(GROUP)
    rows = stress.rows(order)
    group = np.cumsum(new) - 1
    starts = np.flatnonzero(new)
    error = np.where(rows.ok & ~np.isnan(rows["relative"]), rows["relative"], np.inf)
    eta = np.where(rows.ok, rows["eta"], np.where(np.isnan(rows["kS"]), np.nan, np.inf))
    count = np.diff(np.append(starts, len(rows)))

    def total(mask):
        return np.add.reduceat(mask.astype(int), starts).tolist()

    first = rows.rows(starts)
    columns = [first.texts(c) if c in TEXTS else first[c] for c in GROUP]
    medians = {name: _medians(eta if name == "eta" else rows[name], group) for name in MEDIANS}
    return list(
        map(
            Point._make,
            zip(
                *(column.tolist() for column in columns),
                _medians(rows["n"], group).astype(int).tolist(),
                count.tolist(),
                _medians(error, group).tolist(),
                np.maximum.reduceat(error, starts).tolist(),
                np.fmax.reduceat(eta, starts).tolist(),
                *(values.tolist() for values in medians.values()),
                *(total(rows._is("status", status)) for status in FAILURES),
                total(rows.wrong),
                total(rows.silent),
            ),
        )
    )


def _medians(values: np.ndarray, group: np.ndarray) -> np.ndarray:
    """The median of each group's numbers; `group` is sorted, and NaN is no number."""
    ordered = values[np.lexsort((values, group))]  # NaN last
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    numbers = np.add.reduceat((~np.isnan(values)).astype(int), starts)
    low = ordered[starts + np.maximum(numbers - 1, 0) // 2]
    high = ordered[starts + np.minimum(numbers // 2, np.maximum(numbers - 1, 0))]
    return np.where(np.isinf(high), high, low / 2 + high / 2)
