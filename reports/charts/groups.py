"""Groups of variants, and the few series of each that a chart shows at first."""

import re
from itertools import zip_longest

from charts.palette import family
from summary.groups import by_key

MOST = 8  # series that are shown at first
LADDER, CHOLESKY, FILTERS, ROOTS, REFINED, PEERS = GROUPS = (
    "Ladder",
    "Cholesky",
    "Filters",
    "Square roots",
    "Refined",
    "Peers",
)
OTHERS = "Others"
LIBRARIES = ("Pinocchio", "MuJoCo", "DART", "Simbody", "Bullet", "KDL")  # all else is ours
ENGINES = (  # beside these in the section of engines
    *("MJX", "MuJoCo Warp", "Drake", "PyBullet", "dynibo", "adam", "Brax", "JaxSim", "frax"),
    *("Newton", "Genesis", "GRiD"),
)
_PATTERNS = (  # the first that fits
    (LADDER, "Ladder<|Kalmarm"),
    (REFINED, "Refined<|WideRefined<|MixedPrecision<"),
    (ROOTS, r"FactoredBias<|StackedQR|AxisFrames<|Scan<SquareRoot>|.*\b(Array\w+|Potter|UD)\b"),
    (CHOLESKY, "(Generated<)?(Batch<|CRBA)"),
    (FILTERS, "(Generated<)?(Sequential<|ClosedForm<|Scan<)"),
)
_FIRST = (  # within a group; others follow by name
    "Ladder<default>",
    "Ladder<last_bits>",
    "Batch<EigenLLT>",
    "Sequential<Conventional>",
    "Sequential<ArrayMGS>",
    "WideRefined<FactoredBias<ArrayGivens>>",
    "Pinocchio<LOCAL>@clang",
    "MuJoCo",
)


def group(variant: str) -> str:
    if family(variant) in (*LIBRARIES, *ENGINES):
        return PEERS
    return next((name for name, pattern in _PATTERNS if re.match(pattern, variant)), OTHERS)


def grouped(variants) -> dict[str, list[str]]:
    """Variants by group, in the order of the groups."""
    found = {name: [] for name in (*GROUPS, OTHERS)}
    for variant in sorted(variants, key=_rank):
        found[group(variant)].append(variant)
    return {name: members for name, members in found.items() if members}


def first_series(series, before=(), most: int = MOST) -> set[tuple[str, str]]:
    """At most so many pairs of variant and precision: those `before`, one of each group, the rest
    of the ladder, then of all groups in turn."""
    members = {name: [] for name in (*GROUPS, OTHERS)}
    for pair in sorted(set(series), key=lambda pair: (pair[1] != "float64", *_rank(pair[0]))):
        members[group(pair[0])].append(pair)
    members[LADDER].sort(key=lambda pair: _rank(pair[0]))
    order = [pair for pair in before if pair in set(series)]
    order += [pairs[0] for pairs in members.values() if pairs]
    order += members[LADDER][1:]
    order += [pair for turn in zip_longest(*members.values()) for pair in turn if pair]
    return set(list(dict.fromkeys(order))[:most])


def _rank(variant: str) -> tuple:
    known = variant in _FIRST
    return not known, _FIRST.index(variant) if known else 0, variant


def mark_first(rows: list[dict], *apart: str, before=()) -> list[dict]:
    """The rows of series that are not shown at first say so; fields that set pictures `apart` give
    each picture first series of its own. Those `before` come first."""
    for own in by_key(rows, lambda row: tuple(map(row.get, apart))).values():
        kept = first_series(((row["variant"], row["precision"]) for row in own), before)
        for row in own:
            if (row["variant"], row["precision"]) not in kept:
                row["more"] = 1
    return rows
