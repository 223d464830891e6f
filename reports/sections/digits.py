"""Families of mechanisms made to be difficult, each swept over one parameter (below). The truth is
multi-precision for the parameters rounded to the working precision. The task named “dynamics, else
random” is the full dynamics with gravity and velocities, or random torques at rest for a family
without these, or white innovations.

Digits left: −log₁₀ of the median relative error over the seeds, at the swept value where that is
worst; above in float64, below in float32; one word says both. A failure counts as an infinite
error. “Wrong”: an error above 1 % without a warning; “warned”: with one; “refused”: called
singular. * : the median is right, but a seed failed or is wrong.
"""

import math
from operator import attrgetter

import numpy as np
from markupsafe import Markup, escape

from charts.text import share_text, task_rank, task_text
from page.section import Column, Section, left, right
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import Stress, U, Variant
from sections.common import SERIES, Group, groups, spaced
from summary.groups import by_key

TASK, GROUP = "task", "group"
FIRST = "dynamics, else random"
NEAREST = ("dynamics", "random", "white")
MANY = 12  # with more variants a choice of some of them comes first
GROUPS = {  # of variants, by their kind
    "ladder": "Ladder",
    "sequential": "Filters",
    "factored_bias": "Filters",
    "closed_form": "Closed form",
    "scan": "Scans",
    "batch": "Batch",
    "stacked": "Batch",
    "refined": "Refined and mixed precision",
}
CHOSEN, WORLD, OTHERS = "Contenders", "Filters in other frames", "Others"
ORDER = list(dict.fromkeys([CHOSEN, *GROUPS.values(), WORLD, OTHERS]))
WORDS = {
    "singular": "refused",
    "indefinite": "not pos. def.",
    "not_finite": "not finite",
    "wrong": "wrong",
    "warned": "warned",
}
STEPS = (1, 3, 5, 8, 11, 14)  # digits at which the colour changes
# How many of these a number in float64 and in float32 mostly has: its look in tables.css.
USUAL = (6, 3)


def section(data: Data) -> Section | None:
    lab = data.laboratory
    if not lab.points and not lab.impossible:
        return None
    tasks = sorted(lab.tasks, key=task_rank)
    if lab.tasks & set(NEAREST):
        tasks = [FIRST, *tasks]
    kinds = grouped(lab.variants, lab.known)
    page = Section("The accuracy laboratory", __doc__)
    page.choose(TASK, "Task", tasks, task_text)
    page.choose(GROUP, "Variants", kinds)
    for task in tasks:
        for group, variants in kinds.items():
            _digits(page, lab, task, group, variants)
    page.table(
        "What each family is swept over",
        [
            left("Family", lambda family: escape(spaced(family.name))),
            left("Swept over", "parameter", escape),
        ],
        [family for family in data.stress_families if family.parameter],
    )
    _impossible(page, lab)
    _health(page, data.stress)
    return page


def grouped(variants: list[str], known: dict[str, Variant]) -> dict[str, list[str]]:
    """Variants by kind; where there are many, those to choose from first."""
    if len(variants) <= MANY:
        return {"All": variants} if variants else {}
    kinds = by_key(variants, lambda variant: _group(known.get(variant)))
    kinds[CHOSEN] = [it for it in variants if it in known and known[it].contender]
    return {name: kinds[name] for name in ORDER if kinds.get(name)}


def _group(variant: Variant | None) -> str:
    if variant and variant.in_world_frame:
        return WORLD
    return GROUPS.get(variant.kind, OTHERS) if variant else OTHERS


def breakable(variant: str) -> str:
    """Where a line may end."""
    return variant.replace("<", "<\u200b")


def _digits(page: Section, lab: Laboratory, task: str, group: str, variants: list[str]) -> None:
    precisions = sorted(U, reverse=True)
    series = {
        (family, variant): [
            lab.series(family, own_task(lab, family, task), precision, variant)
            for precision in precisions
        ]
        for family in lab.families
        for variant in variants
    }
    families, present = (
        dict.fromkeys(key[i] for key, it in series.items() if any(it)) for i in (0, 1)
    )
    page.table(
        f"""{task_text(task)}, {group}: digits left at the worst value of each family, above in
        {precisions[0]}, below in {precisions[1]}""",
        [
            left("Family", lambda family: escape(spaced(family))),
            [
                left(breakable(variant), lambda family, it=variant: _pair(series[family, it]))
                for variant in variants
                if variant in present
            ],
        ],
        families,
        shown={TASK: task, GROUP: group},
        style="digits",
    )


def own_task(lab: Laboratory, family: str, task: str) -> str:
    """Of a family without full dynamics the task that is nearest to them."""
    if task != FIRST:
        return task
    present = lab.tasks_of(family)
    return next((name for name in NEAREST if name in present), NEAREST[-1])


def worst_point(points: list[Point]) -> Point:
    return max(points, key=lambda point: point.error)


def digits(point: Point) -> float:
    """Never more than the precision has, so that an exact result is no infinity."""
    return -math.log10(max(point.error, point.u))


def _pair(series: list[list[Point]]) -> Markup:
    """A cell's numbers, one a precision, or a word for both; nothing where there are none."""
    if not any(series):
        return Markup("")
    return Markup("").join(dict.fromkeys(map(_cell, series, USUAL)))


def _cell(points: list[Point], usual: int) -> Markup:
    """In the shortest tags that HTML has, since half of a page's size is these cells: a paragraph
    needs no end, and its usual look no class."""
    if not points:
        return Markup("<p class=none>–")
    worst = worst_point(points)
    if worst.outcome != "ok":
        look = "w" if worst.outcome == "warned" else "d0"
        return Markup("<p class={}>{}").format(look, WORDS[worst.outcome])
    number = digits(worst)
    look = sum(number >= step for step in STEPS)
    some = "*" if any(point.failures or point.wrong for point in points) else ""
    look = "" if look == usual else f" class=d{max(look, 1)}"
    return Markup("<p{}>{:.1f}{}").format(Markup(look), number, some)


def series_of(rows: Stress) -> list[Group]:
    """By variant and precision."""
    return [
        Group(variant=variant, precision=precision, own=own)
        for variant in rows.present("variant")
        for precision in U
        if len(own := rows.where(variant=variant, precision=precision))
    ]


def _health(page: Section, stress: Stress) -> None:
    """What is left of a covariance that ought to be symmetric, positive and zero along its axis."""
    factors = stress.rows(stress.ok & ~np.isnan(stress["P_min"])).where(task="factors")
    digits = "{:.1e}".format
    page.table(
        """Health of P⁺, the worst joint of every mechanism: share of mechanisms with a negative
        eigenvalue beyond u; then the worst of all mechanisms: least over largest eigenvalue,
        |H P⁺| / |P⁺| where there is no joint noise, asymmetry""",
        [
            SERIES,
            right("Mechanisms", "own", len),
            right("Lost", lambda it: (it.own["P_min"] < -it.own.u).mean(), share_text),
            right("λ min / λ max", lambda it: min(it.own["P_min"].min(), 0.0), digits),
            right("|H P⁺|", lambda it: np.nanmax(it.own["P_constraint"]), digits),
            right("Asymmetry", lambda it: it.own["P_asymmetry"].max(), digits),
        ],
        series_of(factors),
        folded=True,
    )


def _impossible(page: Section, lab: Laboratory) -> None:
    """What becomes of mechanisms that have no answer."""

    def total(what):
        return lambda it: sum(map(what, it.own))

    def share(title: str, what) -> Column:
        return right(title, lambda it: total(what)(it) / total(seeds)(it), share_text)

    seeds = attrgetter("seeds")
    families = sorted({point.family for point in lab.impossible})
    points = [point for point in lab.impossible if point.task != "factors"]
    series = groups(points, "variant", "precision")
    page.table(
        f"""Exactly singular mechanisms, which have no answer: what each variant does with them
        ({", ".join(map(spaced, families))})""",
        [
            SERIES,
            right("Trials", total(seeds)),
            share("Refused as singular", attrgetter("singular")),
            share("Failed otherwise", lambda point: point.indefinite + point.not_finite),
            share("Answered", lambda point: point.seeds - point.failures),
        ],
        sorted(series, key=lambda it: (it.variant, it.precision)),
        folded=True,
    )
