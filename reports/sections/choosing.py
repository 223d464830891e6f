"""Measured on the laboratory’s families; what to take for a robot of your own is said by recommend,
which looks at that robot. Named is, of all variants and precisions that were tried on every family
of the kind and whose largest relative error over all values and seeds is within the digits asked
for, the cheapest. {measured} Task: {task}. The last column asks instead that η be at most {stable}
throughout: as accurate as the robot’s parameters allow, within two digits.
"""

import math
from statistics import median
from typing import NamedTuple

from markupsafe import Markup

from claims.claim import ABA
from page.section import Column, Section, formula, left
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import WILD, U
from sections.common import spaced
from sections.digits import FIRST, breakable, own_task
from summary.groups import by_key

DIGITS = (3, 6, 9, 12)
STABLE = 100  # η
KINDS = {  # of families, in the order of the table; others come last, by their own word
    "long_chain": "Long arms",
    "heavy_outboard": "Heavy outboard of light: payloads, feet",
    "heavy_inboard": "Heavy inboard or mixed masses",
    "uneven_lengths": "Lengths and offsets of all sizes",
    "near_parallel_axes": "Nearly parallel axes",
    "point_masses": "Point masses and rods",
    "inboard_com": "Centres of mass inboard",
    "joint_noise": "Armature and stiff joints",
    "tree": "Trees and floating bases",
    "units": "Other units",
    WILD: "Drawn at random",
    "singular": "Nearly singular, massless bodies",
    "robot": "Robots",
}


class Candidate(NamedTuple):
    """What a variant did, at worst, with all families of a kind."""

    variant: str
    precision: str
    error: float
    eta: float
    cost: float | None  # in units of ABA's time in float64


def section(data: Data) -> Section | None:
    lab = data.laboratory
    kinds = by_key(lab.families, lab.kinds.get)
    costs = relative_costs(data)
    found = {
        kind: of_kind
        for kind in dict.fromkeys([*KINDS, *sorted(kinds)])
        if kind in kinds and (of_kind := candidates(lab, kinds[kind], costs))
    }
    if not found:
        return None
    measured = (
        f"""Cost is a call’s time over that of {ABA} in float64 on the same scene, in the median
        over all timed scenes; only variants that were timed are named."""
        if costs
        else """No times of these variants are in this run: the most accurate that qualifies is
        named, and no cost."""
    )
    kind = formula(
        "Kind of robot",
        lambda it: Markup("{}<br><small>{}</small>").format(
            KINDS.get(it, it), ", ".join(map(spaced, kinds[it]))
        ),
    )

    def cheapest(title: str, enough) -> Column:
        return left(title, lambda kind: _cheapest(found[kind], enough))

    page = Section(
        "Cheapest by kind of mechanism",
        __doc__.format(measured=measured, task=FIRST, stable=STABLE),
    )
    page.table(
        """The cheapest variant that left so many digits on every mechanism of its kind. none: no
        variant did.""",
        [
            kind,
            [cheapest(f"{d} digits", lambda c, d=d: c.error <= 10.0**-d) for d in DIGITS],
            cheapest(f"η ≤ {STABLE}", lambda c: c.eta <= STABLE),
        ],
        found,
    )
    return page


def relative_costs(data: Data) -> dict[tuple[str, str], float]:
    """By variant and precision, in units of ABA's time in float64."""
    times = [time for time in data.times if time.task == "acceleration" and time.nanoseconds]
    units = {it.scene: it.nanoseconds for it in times if it[1:3] == (ABA, "float64")}
    on_these = [time for time in times if time.scene in units]
    return {
        key: median(time.nanoseconds / units[time.scene] for time in own)
        for key, own in by_key(on_these, lambda time: (time.variant, time.precision)).items()
    }


def candidates(lab: Laboratory, families: list[str], costs: dict) -> list[Candidate]:
    """Those that were tried on all families; cheapest first, or else the most accurate."""
    found = []
    tasks = {family: own_task(lab, family, FIRST) for family in families}
    for variant in lab.variants:
        for precision in U:
            series = [
                lab.series(family, task, precision, variant) for family, task in tasks.items()
            ]
            if not all(series) or (costs and (variant, precision) not in costs):
                continue
            points = [point for points in series for point in points]
            worst = [_worst(points, field) for field in ("worst", "worst_eta")]
            cost = costs.get((variant, precision))
            found.append(Candidate(variant, precision, *worst, cost))
    return sorted(found, key=lambda c: (c.cost if costs else c.error, c.error))


def _worst(points: list[Point], field: str) -> float:
    """Infinite where a number is missing: what is not known is not promised."""
    values = [getattr(point, field) for point in points]
    return math.inf if any(map(math.isnan, values)) else max(values)


def _cheapest(found: list[Candidate], enough) -> str | Markup:
    best = next((candidate for candidate in found if enough(candidate)), None)
    if not best:
        return "none"
    cost = f", {best.cost:.2g}×" if best.cost is not None else ""
    return Markup("{}<br>{}{}").format(breakable(best.variant), best.precision, cost)
