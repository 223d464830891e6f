"""The charts of the claims: a median against what was swept, or against another number."""

import altair as alt

from charts import variants as variant_charts
from charts.common import (
    NUMBER,
    SCENE,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    short,
)
from charts.groups import mark_first
from charts.text import share_text, task_text
from claims.claim import Plot, number_text
from page.section import Choice, Section, first_of, several

TASK = "task"
TOOLTIPS = {
    "scene": "family",
    "task": "task",
    "variant": "variant",
    "precision": "precision",
    "x_text": "x",
    "error_text": "y",
    "seeds": "seeds",
    "failed": "failed",
}


def draw(page: Section, plot: Plot, title: str, notes: list | str, scenes: str = "Family") -> None:
    """With a choice of task, and of family where lines of several would lie on each other."""
    rows = [row for row in plot.rows if row["x"] > 0 and (row["error"] is not None or row["share"])]
    choices = several(
        Choice(signal, label, dict.fromkeys(row[signal] for row in rows), task_text)
        for signal, label in ((SCENE, scenes), (TASK, "Task"))[not plot.lines :]
    )
    titles = TOOLTIPS | {"x_text": plot.x, "error_text": plot.y}
    if rows:
        chart = _chart(plot, rows, page.style, first_of(choices), titles)
        page.figure(title, chart, titles, choices, notes)


def _chart(plot: Plot, rows: list[dict], style: Style, choices: dict[str, str], titles: dict):
    """Lines through medians with crosses for failures, or a cloud of marks."""
    values = [
        {name: value for name, value in row.items() if name != "share" or value}
        | {
            "x": short(row["x"]),
            "error": short(row["error"]),
            "x_text": number_text(row["x"]),
            "error_text": "–" if row["error"] is None else number_text(row["error"]),
            "failed": share_text(row["share"]),
        }
        for row in rows
    ]
    mark_first(values, "task")
    if plot.lines:
        mark_last(values, "error", "x", (SCENE, TASK))
    scale = alt.Scale(type="log", nice=False, padding=12)
    x = alt.X("x:Q", axis=log_axis("x", plot.x, NUMBER), scale=scale)
    y = alt.Y("error:Q", axis=log_axis("y", plot.y, NUMBER), scale=error_scale(values))
    chart = filtered(choices)
    encoding = variant_charts.series(style, titles)
    drawn = chart.transform_filter("datum.error > 0").encode(x=x, y=y, **encoding)
    lines = variant_charts.curves(drawn, style)
    layers = (
        [*variant_charts.bands(chart, values, x, encoding), *lines] if plot.lines else lines[1:2]
    )
    return alt.layer(*layers, **frame(values))
