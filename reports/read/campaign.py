"""What a campaign has counted: errors of mechanisms in bins, outcomes, and the worst cases whole.

All of it is whole numbers and total orders, so that records add up to the same record whatever the
order. An error is in bin b if 2^(b/32) <= error < 2^((b+1)/32): 32 bins an octave, each 2.2 % wide.
"""

import bisect
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field

from read.values import Count, Number, Precision, Size, Whole, exact, record

OCTAVE = 32  # bins of a factor of two
SUMMABLE = ("kS", "mass_ratio")  # by which groups may be told apart, or not
Power = Annotated[int, Field(ge=-700, le=700)]  # of ten


@exact
class Range(NamedTuple):
    """Mechanisms of a family: `count` seeds from `first` on."""

    family: Annotated[str, Field(pattern="^[A-Za-z0-9_]+$")]
    value: Number
    first: Count
    count: Whole

    @property
    def name(self) -> str:
        return f"{self.family}/{shortest(self.value)}/{self.first}+{self.count}"

    @property
    def end(self) -> int:
        return self.first + self.count


@record
class Cell(NamedTuple):
    """What the mechanisms and answers of a group have in common."""

    family: str
    value: Number
    task: str
    variant: str
    precision: Precision
    measure: Literal["relative", "energy"]
    kS: Power | None = None  # noqa: N815, floor(log10 kS); None: unknown, or summed over
    mass_ratio: Power | None = None  # floor(log10(heaviest / lightest)); likewise

    @property
    def rank(self) -> tuple:
        """Orders cells; None, which nothing is less than, goes first."""
        return *self[:6], *((number is not None, number or 0) for number in self[6:])


@dataclass
class Errors:
    """How many answers had an error of this size."""

    zero: int = 0
    nan: int = 0
    inf: int = 0
    bins: Counter[int] = field(default_factory=Counter)

    @property
    def total(self) -> int:
        return self.zero + self.nan + self.inf + self.bins.total()

    def add(self, other: "Errors") -> None:
        self.zero += other.zero
        self.nan += other.nan
        self.inf += other.inf
        self.bins.update(other.bins)


@dataclass
class Counts:
    """The outcomes of a group, and the errors of those that are ok."""

    status: Counter[str] = field(default_factory=Counter)
    recomputed: int = 0  # outcomes of the certified form, in the place of a suspect answer
    silent: Errors = field(default_factory=Errors)  # of answers without a warning
    warned: Errors = field(default_factory=Errors)
    beyond_claim: int | None = None  # errors above 4 times the claimed one, where one is claimed

    def add(self, other: "Counts") -> None:
        self.status.update(other.status)
        self.recomputed += other.recomputed
        self.silent.add(other.silent)
        self.warned.add(other.warned)
        if other.beyond_claim is not None:
            self.beyond_claim = (self.beyond_claim or 0) + other.beyond_claim


@exact
class Worst(NamedTuple):
    """One answer without a warning, and the mechanism that it is of."""

    family: str
    value: Number
    seed: Count
    task: str
    variant: str
    precision: Precision
    error: Annotated[str, AfterValidator(float.fromhex), Field(ge=0)]
    kS: Size | None  # noqa: N815
    mass_ratio: Number | None

    @property
    def rank(self) -> tuple:
        """The largest error first; no two cases are alike in all the rest."""
        return -self.error, *self[:6]

    @property
    def series(self) -> tuple[str, str, str]:
        return self.task, self.variant, self.precision


class MergeError(ValueError):
    """Why two records are not of one campaign."""


def refuse_another(ours: dict, theirs: dict) -> None:
    """Of two keys."""
    for name in sorted(ours.keys() | theirs.keys()):
        if ours.get(name) != theirs.get(name):
            raise MergeError(f"another {name}: {theirs.get(name)}, not {ours.get(name)}")


@dataclass
class Campaign:
    key: dict  # what an answer depends on beside the mechanism; equal in all that is merged
    units: list[Range] = field(default_factory=list)  # sorted; neighbours are joined
    no_truth: Counter[str] = field(default_factory=Counter)  # mechanisms left out, by reason
    groups: dict[Cell, Counts] = field(default_factory=dict)
    worst: list[Worst] = field(default_factory=list)  # sorted, the first few of each series
    summed: tuple[str, ...] = ()  # of SUMMABLE, sorted

    @property
    def mechanisms(self) -> int:
        return sum(unit.count for unit in self.units)

    def emptied(self) -> "Campaign":
        return Campaign(self.key, summed=self.summed)

    def add(self, other: "Campaign") -> None:
        """Nothing is added where MergeError is raised."""
        refuse_another(self.key, other.key)
        if self.summed != other.summed:
            raise MergeError(f"summed over {list(other.summed)}, not {list(self.summed)}")
        self.units = joined(self.units, other.units)
        self.no_truth.update(other.no_truth)
        for cell, counts in other.groups.items():
            self.groups.setdefault(cell, Counts()).add(counts)
        self.worst = cut(self.worst + other.worst, self.key["campaign"]["worst"])

    def sum_over(self, names: Iterable[str]) -> "Campaign":
        """The same counts in fewer groups, which these no longer tell apart."""
        summed = tuple(sorted({*self.summed, *names}))
        result = Campaign(self.key, self.units, self.no_truth, {}, self.worst, summed)
        for cell, counts in self.groups.items():
            cell = cell._replace(**dict.fromkeys(summed))
            result.groups.setdefault(cell, Counts()).add(counts)
        return result


def joined(ours: list[Range], theirs: list[Range]) -> list[Range]:
    """Sorted, and neighbours joined: how mechanisms were divided leaves no trace."""
    result = list(ours)
    for unit in theirs:
        place = bisect.bisect_left(result, unit)
        for other in result[max(place - 1, 0) : place + 1]:
            if other[:2] == unit[:2] and other.first < unit.end and unit.first < other.end:
                raise MergeError(f"{unit.name} overlaps {other.name}")
        result.insert(place, unit)
        for i in (place, place - 1):  # with the next one, then with the one before
            if 0 <= i < len(result) - 1 and result[i + 1][:3] == (*result[i][:2], result[i].end):
                result[i : i + 2] = [
                    result[i]._replace(count=result[i].count + result[i + 1].count)
                ]
    return result


def cut(cases: list[Worst], most: int) -> list[Worst]:
    """The first `most` of each series, in order."""
    seen: Counter[tuple] = Counter()
    result = []
    for case in sorted(cases, key=lambda case: case.rank):
        seen[case.series] += 1
        if seen[case.series] <= most:
            result.append(case)
    return result


def shortest(value: float) -> str:
    """The fewest digits that read back."""
    return next(text for d in range(1, 18) if float(text := f"{value:.{d}g}") == value)
