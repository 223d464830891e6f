"""Families of mechanisms that grow. All axes are logarithmic. κ(M) is the condition number of the
mass matrix; scaled κ is that of the matrix scaled to a diagonal of ones.

An exponent is the slope of a least-squares line through log of the median against log N, over N ≥
{first}; ± is its standard error. It is given where at least three sizes were measured.
"""

from operator import attrgetter

from charts import variants as variant_charts
from charts.text import error_text, fit_text, task_rank, task_text
from page.section import Column, Section, left, right
from read.data import Data, families, scene_name, scene_size
from sections.common import SERIES, Group, choose_view, groups, style_of
from summary.groups import by_key
from summary.points import FIT_FROM, TIME_ALONE, Fit, Point, fit_exponent, points, summarise

CONDITION = {"kappa": "κ(M)", "kappa_scaled": "scaled κ"}
MEASURED = {"error": "median", "time": "time"}  # fields of a point
SOURCES = """
The fast path and peers are timed by programs of their own, in other minutes than the rest: small
ratios between the two mean little. What bench_inverse times as well is shown as timed there.
"""


def section(data: Data) -> Section | None:
    known = points(data, calls=True)
    names = families(point.scene for point in known)
    drawn = [point for point in known if point.name in names]
    if not drawn:
        return None
    page = Section(
        "Against N",
        [__doc__.format(first=FIT_FROM), SOURCES if data.dynamics or data.peers else ""],
        style_of(drawn),
    )
    choose_view(page, drawn)
    numbers = (it for it in _condition_numbers(data) if scene_name(it["scene"]) in names)
    conditions = by_key(numbers, lambda row: scene_name(row["scene"]))
    for name in names:
        family = [point for point in drawn if point.name == name]
        for what, field in MEASURED.items():
            if any(getattr(point, field) is not None for point in family):
                chart = variant_charts.against_size(family, page.style, page.first, what)
                page.figure(f"{name}: {what}", chart, variant_charts.TOOLTIPS)
        if name in conditions:
            chart = variant_charts.condition(conditions[name])
            page.figure(f"{name}: condition of M", chart, variant_charts.CONDITION_TOOLTIPS)
    for task in sorted({point.task for point in drawn}, key=task_rank):
        _exponents(page, task, [it for it in drawn if it.task == task], names)

    def column(label: str) -> Column:
        def exponent(name: str) -> Fit | None:
            rows = [row for row in conditions[name] if row["number"] == label]
            return fit_exponent(((row["n"], row["value"]) for row in rows), FIT_FROM)

        return right(label, exponent, fit_text)

    labels = sorted({row["number"] for rows in conditions.values() for row in rows})
    page.table(
        "Exponents of the median condition number",
        [left("Family", str), *map(column, labels)],
        conditions,
    )
    return page


def _condition_numbers(data: Data) -> list[dict]:
    rows = [row for row in data.errors if row.task == "model" and row.measure in CONDITION]
    series = by_key(rows, lambda row: (row.measure, row.scene))
    summaries = {key: summarise(group) for key, group in series.items()}
    numbers = [
        {
            "scene": scene,
            "n": scene_size(scene),
            "number": CONDITION[measure],
            "value": summary.median,
            "median": error_text(summary.median),
            "largest": error_text(summary.worst),
            "states": summary.states,
            "failed": summary.failures,
        }
        for (measure, scene), summary in summaries.items()
        if summary.median is not None
    ]
    return sorted(numbers, key=lambda row: (row["number"], row["n"]))


def _exponents(page: Section, task: str, drawn: list[Point], names: list[str]) -> None:
    def column(name: str, what: str) -> Column:
        field = MEASURED[what]

        def exponent(series: Group) -> Fit | None:
            points = [point for point in series.own if point.name == name]
            return fit_exponent(((it.n, getattr(it, field)) for it in points), FIT_FROM)

        return right(f"{name}: {what}", exponent, fit_text)

    measured = [
        (name, what)
        for name in names
        for what in ("time", "error")
        if any(it.name == name and getattr(it, MEASURED[what]) is not None for it in drawn)
    ]
    own = [point for point in drawn if point.measure in ("relative", TIME_ALONE)]
    series = ("variant", "precision")
    of_errors = any(what == "error" for _, what in measured)
    page.table(
        f"""{task_text(task)}: exponents of the median
        time{" and of the median relative error" if of_errors else ""}""",
        [
            SERIES,
            [column(*it) for it in measured],
        ],
        groups(sorted(own, key=attrgetter(*series)), *series),
        folded=task != "acceleration",
    )
