"""Numbers of many replicates, with limits that hold whatever their distribution.

Of n independent numbers in order, x_1 <= ... <= x_n, the median of the distribution lies in

    [x_j, x_(n+1-j)]    with a probability of at least 1 - 2 P(B < j)                         (1)

where B is binomial, n tosses of a fair coin: the median is below x_j only if fewer than j numbers
are at most as large. Six numbers are the fewest for 95 %.
"""

import math
from statistics import median
from typing import NamedTuple

from scipy.special import bdtrik  # scipy.stats takes a second more to import

from read.replicates import Numbers
from summary.tails import CONFIDENCE


class Spread(NamedTuple):
    median: float
    limits: tuple[float, float] | None  # of the median; None: too few numbers
    middle: tuple[float, float]  # what 95 % of the replicates lie in


def spread(check: Numbers) -> Spread | None:
    """None where no replicate has the number."""
    ordered = [value for value, _ in check.in_order]
    return Spread(median(ordered), median_limits(ordered), middle(ordered)) if ordered else None


def median_limits(
    ordered: list[float], confidence: float = CONFIDENCE
) -> tuple[float, float] | None:
    """(1) with the largest j, or nothing where no j is enough."""
    n = len(ordered)
    j = math.ceil(bdtrik((1 - confidence) / 2, n, 0.5))  # P(B < j) is less, P(B < j + 1) is not
    return (ordered[j - 1], ordered[n - j]) if j else None


def middle(ordered: list[float], share: float = 0.95) -> tuple[float, float]:
    """Between the smallest and the largest, of both ends as many left out as the share allows."""
    out = math.floor((1 - share) / 2 * len(ordered))
    return ordered[out], ordered[-1 - out]
