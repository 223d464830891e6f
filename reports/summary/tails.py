"""How often an error is beyond a bound, with exact binomial limits, from a campaign's counts.

Of n mechanisms k did something. Clopper and Pearson's limits of its probability p are the p at
which k or more, and k or fewer, would have a probability of (1 - confidence) / 2:

    low  = quantile of Beta(k, n - k + 1)      at (1 - confidence) / 2                        (1)
    high = quantile of Beta(k + 1, n - k)      at 1 - (1 - confidence) / 2                    (2)

They hold for every n and p, at least as often as the confidence says.
"""

import math
from collections import defaultdict
from dataclasses import dataclass, field

from scipy.special import betaincinv  # scipy.stats takes a second more to import

from read.campaign import OCTAVE, Campaign, Counts

CONFIDENCE = 0.95
WRONG_BIN = math.floor(OCTAVE * math.log2(0.01))  # an error of 1 % lies within this bin
WRONG = 2 ** (WRONG_BIN / OCTAVE)  # its edge: what is more wrong is no answer


def limits(k: int, n: int, confidence: float = CONFIDENCE) -> tuple[float, float]:
    """Two-sided (1), (2)."""
    tail = (1 - confidence) / 2
    low = float(betaincinv(k, n - k + 1, tail)) if k else 0.0
    return low, upper_limit(k, n, 1 - tail)


def upper_limit(k: int, n: int, confidence: float = CONFIDENCE) -> float:
    """One-sided (2): 1 - (1 - confidence)^(1/n) where k = 0, about 3 / n at 95 %."""
    return float(betaincinv(k + 1, n - k, confidence)) if k < n else 1.0


@dataclass
class Series:
    """All that a campaign has counted of a task, variant, precision and measure in a family."""

    counts: Counts = field(default_factory=Counts)

    @property
    def trials(self) -> int:
        """Mechanisms, whatever came of them."""
        return self.counts.status.total()

    @property
    def refused(self) -> int:
        return self.trials - self.counts.status["ok"]

    @property
    def warned(self) -> int:
        return self.counts.warned.total

    @property
    def silent(self) -> int:
        """Wrong, and nothing said so: the warnings that are missing."""
        return beyond(self.counts.silent, WRONG_BIN)

    @property
    def false_warnings(self) -> int:
        return self.warned - beyond(self.counts.warned, WRONG_BIN)

    @property
    def tail(self) -> list[tuple[float, int]]:
        """Errors x, octave by octave and at last the edge of the largest bin, and how many silent
        answers are at least as wrong. Infinite ones are beyond every x."""
        places = sorted(self.counts.silent.bins)
        if not places:
            return []
        octaves = range(-(-places[0] // OCTAVE) - 1, places[-1] // OCTAVE + 1)
        edges = sorted({*(octave * OCTAVE for octave in octaves), places[-1]})
        return [(2.0 ** (edge / OCTAVE), beyond(self.counts.silent, edge)) for edge in edges]

    def as_wrong(self, error: float) -> int:
        """How many silent answers are at least as wrong, to the bin."""
        return beyond(self.counts.silent, math.floor(OCTAVE * math.log2(error)))


def beyond(errors, place: int) -> int:
    """Errors in this bin or a later one, or infinite. One that is no number is no small one."""
    return errors.inf + errors.nan + sum(n for b, n in errors.bins.items() if b >= place)


def by_condition(campaign: Campaign) -> dict[tuple, dict[int, Series]]:
    """The same, decade by decade of kS; none where groups do not tell it."""
    found = defaultdict(lambda: defaultdict(Series))
    for cell, counts in campaign.groups.items():
        if cell.kS is not None:
            found[cell[:6]][cell.kS].counts.add(counts)
    return {key: dict(sorted(own.items())) for key, own in sorted(found.items())}


def series(campaign: Campaign) -> dict[tuple, Series]:
    """By family, value, task, variant, precision and measure, in order."""
    found = defaultdict(Series)
    for cell, counts in campaign.groups.items():
        found[cell[:6]].counts.add(counts)
    return dict(sorted(found.items()))
