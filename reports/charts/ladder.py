"""The names of the ladder's tolerances, and their order."""

import math

from read.ladder import DEFAULT, LAST_BITS, tolerance

NO_LABEL = " "  # an empty one would be replaced by the series' name


def tolerance_name(variant: str) -> str:
    """As the page writes it; of a rung, its name."""
    return {DEFAULT: "default", LAST_BITS: "last bits", "Rung<two_doubles>": "two doubles"}.get(
        variant, variant.partition("<")[2].rstrip(">")
    )


def rank(variant: str, precision: str) -> float | None:
    """Sorts the largest tolerance first; None: a rung alone."""
    within = tolerance(variant, precision)
    return -math.log10(within) if within else None
