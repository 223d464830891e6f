"""The accuracy laboratory: how many digits each variant leaves on each family."""

import math
from collections import defaultdict

import numpy as np
from markupsafe import Markup, escape

from charts.text import TASKS, share_text, task_text
from page.section import Choice, Section, Table
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import U, Variant

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
    tasks = sorted(
        lab.tasks,
        key=lambda task: (task not in TASKS, list(TASKS).index(task) if task in TASKS else task),
    )
    if lab.tasks & set(NEAREST):
        tasks = [FIRST, *tasks]
    groups = grouped(lab.variants, lab.known)
    tables = [
        table
        for task in tasks
        for group, variants in groups.items()
        if (table := _digits(data, task, group, variants, (tasks[0], next(iter(groups)))))
    ]
    singular = _impossible(lab)
    task = Choice(
        TASK, "Task", [(name, task_text(name)) for name in tasks], tasks[0] if tasks else ""
    )
    group = Choice(GROUP, "Variants", [(name, name) for name in groups], next(iter(groups), ""))
    return Section(
        "The accuracy laboratory",
        [
            "Families of mechanisms made to be difficult, each swept over one parameter (below). "
            "The truth is multi-precision for the parameters rounded to the working precision. The "
            "task named “dynamics, else random” is the full dynamics with gravity and velocities, "
            "or random torques at rest for a family without these, or white innovations.",
            "Digits left: −log₁₀ of the median relative error over the seeds, at the swept value "
            "where that is worst; above in float64, below in float32. A failure counts as an "
            "infinite error. “Wrong”: an error above 1 % without a warning; “warned”: with one; "
            "“refused”: called singular. * : the median is right, but a seed failed or is wrong.",
        ],
        choices=[choice for choice in (task, group) if choice.options],
        tables=[*tables, *_swept(data), *singular, *_health(data)],
    )


def grouped(variants: list[str], known: dict[str, Variant]) -> dict[str, list[str]]:
    """Variants by kind; where there are many, those to choose from first."""
    if len(variants) <= MANY:
        return {"All": variants} if variants else {}
    groups = defaultdict(list)
    for variant in variants:
        what = known.get(variant)
        if what and what.contender:
            groups[CHOSEN].append(variant)
        groups[_group(what)].append(variant)
    return {name: groups[name] for name in ORDER if name in groups}


def _group(variant: Variant | None) -> str:
    if variant and variant.in_world_frame:
        return WORLD
    return GROUPS.get(variant.kind, OTHERS) if variant else OTHERS


def _digits(data: Data, task: str, group: str, variants: list[str], first) -> Table | None:
    lab = data.laboratory
    rows, present = [], set()
    for family in lab.families:
        own = own_task(lab, family, task)
        series = {
            variant: {precision: lab.series(family, own, precision, variant) for precision in U}
            for variant in variants
        }
        if not any(points for pair in series.values() for points in pair.values()):
            continue
        present |= {variant for variant, pair in series.items() if any(pair.values())}
        rows.append((escape(family.replace("_", " ")), series))
    if not rows:
        return None
    columns = [variant for variant in variants if variant in present]
    precisions = sorted(U, reverse=True)
    return Table(
        f"{task_text(task)}, {group}: digits left at the worst value of each family, above in "
        f"{precisions[0]}, below in {precisions[1]}",
        ["Family", *(variant.replace("<", "<\u200b") for variant in columns)],
        [
            [name, *(_pair([series[v][p] for p in precisions]) for v in columns)]
            for name, series in rows
        ],
        "l" * (len(columns) + 1),
        shown={TASK: task, GROUP: group},
        first=(task, group) == first,
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
    """A cell's numbers, one a precision; nothing where there are none."""
    if not any(series):
        return Markup("")
    return Markup("").join(map(_cell, series, USUAL))


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


def _swept(data: Data) -> list[Table]:
    rows = [
        [escape(family.name.replace("_", " ")), escape(family.parameter)]
        for family in data.stress_families
        if family.parameter
    ]
    if not rows:
        return []
    return [Table("What each family is swept over", ["Family", "Swept over"], rows, "ll")]


def _health(data: Data) -> list[Table]:
    """What is left of a covariance that ought to be symmetric, positive and zero along its axis."""
    stress = data.stress
    factors = stress.rows(stress.ok & ~np.isnan(stress["P_min"])).where(task="factors")
    rows = []
    for variant in factors.present("variant"):
        for precision in factors.present("precision"):
            own = factors.where(variant=variant, precision=precision)
            if not len(own):
                continue
            lost = own["P_min"] < -own.u
            rows.append(
                [
                    variant,
                    precision,
                    str(len(own)),
                    share_text(float(lost.mean())),
                    f"{min(own['P_min'].min(), 0.0):.1e}",
                    f"{np.nanmax(own['P_constraint']):.1e}",
                    f"{own['P_asymmetry'].max():.1e}",
                ]
            )
    if not rows:
        return []
    return [
        Table(
            "Health of P⁺, the worst joint of every mechanism: share of mechanisms with a "
            "negative eigenvalue beyond u; then the worst of all mechanisms: least over largest "
            "eigenvalue, |H P⁺| / |P⁺| where there is no joint noise, asymmetry",
            ["Variant", "Precision", "Mechanisms", "Lost", "λ min / λ max", "|H P⁺|", "Asymmetry"],
            rows,
            "llrrrrr",
            folded=True,
        )
    ]


def _impossible(lab: Laboratory) -> list[Table]:
    """What becomes of mechanisms that have no answer."""
    if not lab.impossible:
        return []
    counts = defaultdict(lambda: [0] * 5)
    for point in lab.impossible:
        if point.task == "factors":
            continue
        answered = point.seeds - point.failures
        parts = (point.seeds, point.singular, point.indefinite + point.not_finite, answered)
        total = counts[point.variant, point.precision]
        for place, count in enumerate(parts):
            total[place] += count
    rows = []
    for (variant, precision), (trials, refused, otherwise, answered, _) in sorted(counts.items()):
        shares = (share_text(count / trials) for count in (refused, otherwise, answered))
        rows.append([variant, precision, str(trials), *shares])
    families = sorted({point.family for point in lab.impossible})
    return [
        Table(
            "Exactly singular mechanisms, which have no answer: what each variant does with them "
            f"({', '.join(name.replace('_', ' ') for name in families)})",
            [
                "Variant",
                "Precision",
                "Trials",
                "Refused as singular",
                "Failed otherwise",
                "Answered",
            ],
            rows,
            "llrrrr",
            folded=True,
        )
    ]
