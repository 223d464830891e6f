"""What was measured of kinds of mechanisms: the cheapest variant that left the digits asked for."""

import math
from collections import defaultdict
from statistics import median
from typing import NamedTuple

from markupsafe import Markup

from claims.claim import ABA
from page.section import Section, Table
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import WILD, U
from sections.digits import FIRST, own_task

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
    kinds = defaultdict(list)
    for family in lab.families:
        kinds[lab.kinds[family]].append(family)
    costs = relative_costs(data)
    rows = [
        [
            Markup("{}<br><small>{}</small>").format(
                KINDS.get(kind, kind), ", ".join(name.replace("_", " ") for name in kinds[kind])
            ),
            *(_cheapest(found, lambda c, d=digits: c.error <= 10.0**-d) for digits in DIGITS),
            _cheapest(found, lambda c: c.eta <= STABLE),
        ]
        for kind in dict.fromkeys([*KINDS, *sorted(kinds)])
        if kind in kinds and (found := candidates(lab, kinds[kind], costs))
    ]
    if not rows:
        return None
    measured = (
        f"Cost is a call’s time over that of {ABA} in float64 on the same scene, in the median "
        "over all timed scenes; only variants that were timed are named."
        if costs
        else "No times of these variants are in this run: the most accurate that qualifies is "
        "named, and no cost."
    )
    return Section(
        "Cheapest by kind of mechanism",
        [
            "Measured on the laboratory’s families; what to take for a robot of your own is said "
            "by recommend, which looks at that robot. Named is, of all variants and precisions "
            "that were tried on every family of the kind and whose largest relative error over all "
            f"values and seeds is within the digits asked for, the cheapest. {measured} Task: "
            f"{FIRST}. The last column asks instead that η be at most {STABLE} throughout: as "
            "accurate as the robot’s parameters allow, within two digits.",
        ],
        tables=[
            Table(
                "The cheapest variant that left so many digits on every mechanism of its kind. "
                "none: no variant did.",
                ["Kind of robot", *(f"{digits} digits" for digits in DIGITS), f"η ≤ {STABLE}"],
                rows,
                "f" + "l" * (len(DIGITS) + 1),
            )
        ],
    )


def relative_costs(data: Data) -> dict[tuple[str, str], float]:
    """By variant and precision, in units of ABA's time in float64."""
    times = {
        (time.scene, time.variant, time.precision): time.nanoseconds
        for time in data.times
        if time.task == "acceleration" and time.nanoseconds
    }
    ratios = defaultdict(list)
    for (scene, variant, precision), nanoseconds in times.items():
        if (scene, ABA, "float64") in times:
            ratios[variant, precision].append(nanoseconds / times[scene, ABA, "float64"])
    return {key: median(values) for key, values in ratios.items()}


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
            cost = costs.get((variant, precision))
            found.append(
                Candidate(
                    variant, precision, _worst(points, "worst"), _worst(points, "worst_eta"), cost
                )
            )
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
    return Markup("{}<br>{}{}").format(best.variant.replace("<", "<\u200b"), best.precision, cost)
