"""Claims decided again and again, by data of other seeds each time: verdicts and numbers.

A replicate is a run of its own. Its verdicts are counted and its numbers kept by its number, so
that records add up to the same record whatever the order.
"""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import NamedTuple

from read.campaign import MergeError, refuse_another

VERDICTS = ("confirmed", "refuted", "open")
MOST = 10_000  # replicates of a record


class Part(NamedTuple):
    """`count` replicates from `first` on."""

    first: int
    count: int

    @property
    def name(self) -> str:
        return f"{self.first}+{self.count}"

    @property
    def end(self) -> int:
        return self.first + self.count


@dataclass
class Numbers:
    """What a check decided by, in each replicate that has it."""

    what: str
    low: float  # minus infinity: none
    high: float
    values: dict[int, float] = field(default_factory=dict)  # by replicate

    @property
    def rule(self) -> tuple:
        return self.what, self.low, self.high

    @property
    def in_order(self) -> list[tuple[float, int]]:
        """Values and their replicates; one that is no number stands last."""

        def rank(pair: tuple[float, int]) -> tuple:
            value, replicate = pair
            return (True, replicate) if math.isnan(value) else (False, value, replicate)

        return sorted(((value, number) for number, value in self.values.items()), key=rank)

    @property
    def held(self) -> int:
        return sum(self.low <= value <= self.high for value in self.values.values())


@dataclass
class Repeated:
    """One claim."""

    id: str
    checks: list[Numbers]
    verdicts: Counter[str] = field(default_factory=Counter)

    @property
    def rule(self) -> tuple:
        return self.id, *(check.rule for check in self.checks)


@dataclass
class Replicates:
    key: dict  # what a verdict depends on beside the seeds; equal in all that is merged
    numbers: set[int] = field(default_factory=set)  # of the replicates
    claims: list[Repeated] = field(default_factory=list)

    @property
    def count(self) -> int:
        return len(self.numbers)

    @property
    def parts(self) -> list[Part]:
        """In order, as long as they can be."""
        result: list[Part] = []
        for number in sorted(self.numbers):
            if result and result[-1].end == number:
                result[-1] = result[-1]._replace(count=result[-1].count + 1)
            else:
                result.append(Part(number, 1))
        return result

    def emptied(self) -> "Replicates":
        claims = [
            Repeated(claim.id, [Numbers(*check.rule) for check in claim.checks])
            for claim in self.claims
        ]
        return Replicates(self.key, set(), claims)

    def add(self, other: "Replicates") -> None:
        """Nothing is added where MergeError is raised."""
        refuse_another(self.key, other.key)
        for ours, theirs in zip(self.claims, other.claims):
            if ours.rule != theirs.rule:
                raise MergeError(f"other checks of {ours.id}")
        if len(self.claims) != len(other.claims):
            raise MergeError(f"{len(other.claims)} claims, not {len(self.claims)}")
        if both := self.numbers & other.numbers:
            raise MergeError(f"replicate {min(both)} is there already")
        if self.count + other.count > MOST:
            raise MergeError(f"more than {MOST} replicates")
        self.numbers |= other.numbers
        for ours, theirs in zip(self.claims, other.claims):
            ours.verdicts.update(theirs.verdicts)
            for check, more in zip(ours.checks, theirs.checks):
                check.values.update(more.values)
