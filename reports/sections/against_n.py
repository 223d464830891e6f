"""Error, time and condition number against N, with fitted exponents."""

from collections import defaultdict

from charts import variants as variant_charts
from charts.common import VIEW, Style
from charts.text import error_text, fit_text, task_text
from page.section import Figure, Section, Table
from read.data import Data, Error, families, scene_name, scene_size
from sections.views import view_choice
from summary.points import FIT_FROM, TIME_ALONE, Point, fit_exponent, points, summarise

CONDITION = {"kappa": "κ(M)", "kappa_scaled": "scaled κ"}


def section(data: Data) -> Section | None:
    known = points(data, calls=True)
    names = families(point.scene for point in known)
    drawn = [point for point in known if point.name in names]
    if not drawn:
        return None
    views = view_choice(drawn)
    style = Style((p.variant for p in drawn), (p.precision for p in drawn))
    result = Section(
        "Against N",
        [
            "Families of mechanisms that grow. All axes are logarithmic. κ(M) is the condition "
            "number of the mass matrix; scaled κ is that of the matrix scaled to a diagonal of "
            "ones.",
            "An exponent is the slope of a least-squares line through log of the median against "
            f"log N, over N ≥ {FIT_FROM}; ± is its standard error. It is given where at least "
            "three sizes were measured.",
            *_sources(data),
        ],
        choices=[views],
        variants=style.variants,
        precisions=style.precisions,
    )
    first = {VIEW: views.first}
    condition = {}
    for name in names:
        family = [point for point in drawn if point.name == name]
        for what, field in (("error", "median"), ("time", "time")):
            if any(getattr(point, field) is not None for point in family):
                chart = variant_charts.against_size(family, style, first, what)
                result.figures.append(Figure(f"{name}: {what}", chart, variant_charts.TOOLTIPS))
        model = [
            row
            for row in data.errors
            if row.task == "model" and row.measure in CONDITION and scene_name(row.scene) == name
        ]
        if model_numbers := _condition_numbers(model):
            condition[name] = model_numbers
            chart = variant_charts.condition(model_numbers)
            result.figures.append(
                Figure(f"{name}: condition of M", chart, variant_charts.CONDITION_TOOLTIPS)
            )
    for task in dict.fromkeys(value.split("/")[0] for value, _ in views.options):
        result.tables.append(
            _exponents(task, [point for point in drawn if point.task == task], names)
        )
    if condition:
        result.tables.append(_condition_exponents(condition))
    return result


def _sources(data: Data) -> list[str]:
    if not (data.dynamics or data.peers):
        return []
    return [
        "The fast path and peers are timed by programs of their own, in other minutes than the "
        "rest: small ratios between the two mean little. What bench_inverse times as well is "
        "shown as timed there."
    ]


def _condition_numbers(rows: list[Error]) -> list[dict]:
    series = defaultdict(list)
    for row in rows:
        series[row.measure, row.scene].append(row)
    numbers = []
    for (measure, scene), group in series.items():
        summary = summarise(group)
        if summary.median is not None:
            numbers.append(
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
            )
    return sorted(numbers, key=lambda row: (row["number"], row["n"]))


def _exponents(task: str, drawn: list[Point], names: list[str]) -> Table:
    series = defaultdict(list)
    for point in drawn:
        if point.measure in ("relative", TIME_ALONE):
            series[point.variant, point.precision, point.name].append(point)
    columns = [
        (name, what, field)
        for name in names
        for what, field in (("time", "time"), ("error", "median"))
        if any(point.name == name and getattr(point, field) is not None for point in drawn)
    ]
    rows = []
    for variant, precision in sorted({key[:2] for key in series}):
        row = [variant, precision]
        for name, _, field in columns:
            group = series[variant, precision, name]
            pairs = ((point.n, getattr(point, field)) for point in group)
            row.append(fit_text(fit_exponent(pairs, FIT_FROM)))
        rows.append(row)
    what = {what for _, what, _ in columns}
    of_errors = " and of the median relative error" if "error" in what else ""
    return Table(
        f"{task_text(task)}: exponents of the median time{of_errors}",
        ["Variant", "Precision"] + [f"{name}: {what}" for name, what, _ in columns],
        rows,
        "ll" + "r" * len(columns),
        folded=task != "acceleration",
    )


def _condition_exponents(numbers: dict[str, list[dict]]) -> Table:
    labels = sorted({row["number"] for rows in numbers.values() for row in rows})
    rows = []
    for name, family in numbers.items():
        fits = (
            fit_exponent(
                ((row["n"], row["value"]) for row in family if row["number"] == label), FIT_FROM
            )
            for label in labels
        )
        rows.append([name, *map(fit_text, fits)])
    return Table(
        "Exponents of the median condition number",
        ["Family", *labels],
        rows,
        "l" + "r" * len(labels),
    )
