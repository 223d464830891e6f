"""The charts of advice: median and worst error against time, and error under growing loads."""

import altair as alt

from charts.common import (
    BAND,
    NAMED,
    NUMBER,
    SCENE,
    TIME,
    TOLERANCE,
    VIEW,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
    short,
    strip,
)
from charts.groups import first_series, mark_first
from charts.text import error_text, time_text, tolerance_text
from charts.variants import series
from read.advice import Advice, Contender, Limits

WHOLLY_WRONG = 10  # where the scale ends: a larger error says no more

ADVICE_TOOLTIPS = {
    "scene": "robot",
    "variant": "variant",
    "precision": "precision",
    "time_text": "median time",
    "error_text": "median error",
    "worst_text": "largest error over states",
    "stressed_text": "largest error over stresses",
    "predicted_text": "predicted",
    "failures": "failed states",
}
LOAD_TOOLTIPS = {
    "scene": "robot",
    "variant": "variant",
    "precision": "precision",
    "value_text": "value",
    "error_text": "worst error",
    "silent": "without a warning",
}


def contender_rows(
    robot: str, task: str, contenders: list[Contender], advice: Advice | None, limits: Limits | None
) -> list[dict]:
    """A row a contender; those that are picked for some tolerance are among the first shown."""
    picks = advice.picks.get(task, []) if advice else []
    timed = [it for it in contenders if it.nanoseconds and it.median is not None]
    kept = first_series(
        [(it.variant, it.precision) for it in timed],
        before=[(pick.variant, pick.precision) for pick in picks],
    )
    rows = []
    for it in timed:
        stressed, refused = limits.worst(task, it.variant, it.precision) if limits else (None, 0)
        row = {
            "scene": robot,
            VIEW: task,
            "variant": it.variant,
            "precision": it.precision,
            "time": short(it.nanoseconds),
            "error": short(it.median),
            "worst": _within(it.worst),
            "stressed": _within(stressed),
            "chosen": [
                tolerance_text(pick.tolerance)
                for pick in picks
                if pick[1:3] == (it.variant, it.precision)
            ],
            "time_text": time_text(it.nanoseconds),
            "error_text": error_text(it.median),
            "worst_text": error_text(it.worst),
            "stressed_text": error_text(stressed) + (f", {refused} refused" if refused else ""),
            "predicted_text": error_text(it.predicted),
            "failures": it.failures,
        }
        if (it.variant, it.precision) not in kept:
            row["more"] = 1
        rows.append(row)
    return rows


def _within(error: float | None) -> float | None:
    return None if error is None else short(min(error, WHOLLY_WRONG))


def median_and_worst(rows: list[dict], style: Style, choices: dict[str, str], tolerances):
    """A mark at the median, a line up to a bar at the worst of the states, dashed to a diamond at
    the worst of the stresses; a ring about what is picked for the chosen tolerance."""
    x = alt.X(
        "time:Q",
        axis=log_axis("x", "median time of a call", TIME),
        scale=alt.Scale(type="log", nice=False, padding=24),
    )
    scale = alt.Scale(type="log", nice=False, padding=10)
    axis = log_axis("y", "error: median, worst of states, worst of stresses", NUMBER)
    error, worst, stressed = (
        alt.Y(f"{name}:Q", axis=axis, scale=scale) for name in ("error", "worst", "stressed")
    )
    own = {name: first for name, first in choices.items() if name != TOLERANCE}
    chart = filtered(own).transform_filter("datum.error > 0")
    encoding = series(style, ADVICE_TOOLTIPS)
    colour = {"color": encoding["color"], "tooltip": encoding["tooltip"]}
    states = chart.transform_filter("datum.worst > 0")
    stresses = chart.transform_filter("datum.stressed > datum.worst")
    beside = {"aria": False, "opacity": 1}  # the dot says the same
    layers = [
        states.mark_rule(strokeWidth=2, aria=False).encode(x=x, y=error, y2=alt.Y2("worst:Q"), **colour),
        stresses.mark_rule(strokeWidth=1, strokeDash=[2, 3], aria=False).encode(
            x=x, y=worst, y2=alt.Y2("stressed:Q"), **colour
        ),
        states.mark_point(shape="stroke", size=140, strokeWidth=2, **beside).encode(
            x=x, y=worst, **colour
        ),
        stresses.mark_point(shape="diamond", size=50, strokeWidth=1.5, **beside).encode(
            x=x, y=stressed, **colour
        ),
    ]
    if tolerances:
        ring = chart.transform_filter(f"indexof(datum.chosen, {TOLERANCE}) >= 0")
        layers[0] = layers[0].add_params(alt.param(name=TOLERANCE, value=choices[TOLERANCE]))
        layers += [
            ring.mark_point(shape="circle", size=320, strokeWidth=1.5, **beside).encode(
                x=x, y=error, color=alt.ColorValue("currentColor")
            ),
            *_asked(tolerances, scale),
        ]
    marks = chart.mark_point(
        filled=True, size=80, opacity=1, style=NAMED, stroke=style.page, strokeWidth=0.75
    )
    return alt.layer(*layers, marks.encode(x=x, y=error, **encoding), **frame(rows))


def _asked(tolerances: list[float], scale) -> list:
    rows = [{"asked": tolerance_text(it), "at": it} for it in tolerances]
    line = alt.Chart(alt.InlineData(values=rows)).transform_filter(f"datum.asked === {TOLERANCE}")
    line = line.encode(y=alt.Y("at:Q", scale=scale))
    name = line.transform_calculate(name="'asked: ' + datum.asked")
    return [
        line.mark_rule(color="currentColor", strokeDash=[6, 4], opacity=0.6),
        name.mark_text(align="right", dy=-6).encode(x=alt.XValue("width"), text=alt.Text("name:N")),
    ]


def load_rows(limits: Limits, load: int) -> list[dict]:
    """A row a value, variant, precision and task."""
    load = limits.loads[load]
    return [
        {
            "scene": limits.robot,
            VIEW: task,
            "variant": curve.variant,
            "precision": curve.precision,
            "value": value,
            "value_text": f"{value:g}",
            "error": _within(worst),
            "share": 0 if worst is not None else 1,
            "error_text": "refused" if worst is None else error_text(worst),
            "silent": silent,
        }
        for task, curves in load.curves.items()
        for curve in curves
        for value, worst, silent in zip(load.values, curve.worst, curve.silent, strict=True)
    ]


def against_load(rows: list[dict], style: Style, choices: dict[str, str], unit: str):
    """Worst error against the load, a line a series; a cross where all is refused."""
    mark_last(mark_first(rows, VIEW), "error", "value", (SCENE, VIEW))
    values = sorted({row["value"] for row in rows})
    x = alt.X(
        "value:O",
        sort=values,
        axis=alt.Axis(title=unit, labelAngle=0, labelOverlap="greedy", labelExpr=NUMBER),
    )
    if max(abs(value) for value in values) < 1e4:
        x.axis.labelExpr = "format(datum.value, '~r')"
    if len(values) == 1:  # as it is
        x.axis.labels = x.axis.ticks = False
    y = alt.Y("error:Q", axis=log_axis("y", "worst error", NUMBER), scale=error_scale(rows))
    chart = filtered(choices)
    encoding = series(style, LOAD_TOOLTIPS)
    drawn = chart.transform_filter("datum.error > 0").encode(x=x, y=y, **encoding)
    dash = alt.StrokeDash("precision:N", scale=style.dash, legend=None)
    lines = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=45, opacity=1, stroke=style.page, strokeWidth=0.5)
    layers = [lines, marks, names(drawn)]
    if any(row["share"] for row in rows):
        refused = chart.transform_filter("datum.share > 0").encode(
            x=x, y=alt.YValue(BAND / 2), color=encoding["color"], tooltip=encoding["tooltip"]
        )
        cross = refused.mark_point(shape="cross", angle=45, filled=True, size=90, opacity=1)
        layers = [*strip(0, "refused"), cross, *layers]
    return alt.layer(*layers, **frame(rows))
