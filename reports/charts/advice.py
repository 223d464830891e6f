"""The charts of advice: median and worst error against time, and error under growing loads."""

import altair as alt

from charts.common import (
    NAMED,
    NUMBER,
    PLAIN,
    SCENE,
    TOLERANCE,
    VIEW,
    Style,
    error_scale,
    filtered,
    frame,
    mark_last,
    short,
)
from charts.groups import mark_first
from charts.layers import INK, log, log_scale
from charts.rows import fields, numbers, titled
from charts.text import error_text, time_text, tolerance_text
from charts.variants import coloured, failures, lines, series
from read.advice import Advice, Contender, Limits

WHOLLY_WRONG = 10  # where the scale ends: a larger error says no more

ADVICE_TOOLTIPS = titled(
    "scene variant precision time_text error_text worst_text stressed_text predicted_text failures",
    scene="robot",
    worst_text="largest error over states",
    stressed_text="largest error over stresses",
    failures="failed states",
)
LOAD_TOOLTIPS = titled(
    "scene variant precision value_text error_text silent",
    scene="robot",
    error_text="worst error",
    silent="without a warning",
)


def contender_rows(
    robot: str, task: str, contenders: list[Contender], advice: Advice | None, limits: Limits | None
) -> list[dict]:
    """A row a contender; those that are picked for some tolerance are among the first shown."""
    picks = advice.picks.get(task, []) if advice else []
    rows = []
    for it in contenders:
        if not it.nanoseconds or it.median is None:
            continue
        stressed, refused = limits.worst(task, it.variant, it.precision) if limits else (None, 0)
        row = {"scene": robot, VIEW: task} | fields(it, "variant", "precision", "failures")
        row["chosen"] = [
            tolerance_text(pick.tolerance)
            for pick in picks
            if (pick.variant, pick.precision) == (it.variant, it.precision)
        ]
        row |= numbers(time_text, time=it.nanoseconds)
        row |= numbers(error_text, error=it.median, worst=it.worst, stressed=stressed)
        row |= {name: _within(row[name]) for name in ("worst", "stressed")}
        row["stressed_text"] += f", {refused} refused" if refused else ""
        rows.append(row | {"predicted_text": error_text(it.predicted)})
    return mark_first(rows, before=[(pick.variant, pick.precision) for pick in picks])


def _within(error: float | None) -> float | None:
    return None if error is None else min(error, WHOLLY_WRONG)


def median_and_worst(rows: list[dict], style: Style, choices: dict[str, str], tolerances):
    """A mark at the median, a line up to a bar at the worst of the states, dashed to a diamond at
    the worst of the stresses; a ring about what is picked for the chosen tolerance."""
    x = log(alt.X, "time", "median time of a call", 24)
    title = "error: median, worst of states, worst of stresses"
    error, worst, stressed = (
        log(alt.Y, name, title, 10) for name in ("error", "worst", "stressed")
    )
    own = {name: first for name, first in choices.items() if name != TOLERANCE}
    chart = filtered(own).transform_filter("datum.error > 0").encode(x=x, y=error)
    drawn = chart.encode(**coloured(style, ADVICE_TOOLTIPS))
    states = drawn.transform_filter("datum.worst > 0")
    stresses = drawn.transform_filter("datum.stressed > datum.worst").encode(y=worst)
    beside = {"aria": False, "opacity": 1}  # the dot says the same
    bar = {"shape": "stroke", "size": 140, "strokeWidth": 2} | beside
    diamond = {"shape": "diamond", "size": 50, "strokeWidth": 1.5} | beside
    layers = [
        states.mark_rule(strokeWidth=2, aria=False).encode(y2="worst:Q"),
        stresses.mark_rule(strokeWidth=1, strokeDash=[2, 3], aria=False).encode(y2="stressed:Q"),
        states.mark_point(**bar).encode(y=worst),
        stresses.mark_point(**diamond).encode(y=stressed),
    ]
    if tolerances:
        ring = chart.transform_filter(f"indexof(datum.chosen, {TOLERANCE}) >= 0")
        ring = ring.mark_point(shape="circle", size=320, strokeWidth=1.5, **beside)
        layers[0] = layers[0].add_params(alt.param(name=TOLERANCE, value=choices[TOLERANCE]))
        layers += [ring.encode(color=alt.ColorValue("currentColor")), *_asked(tolerances)]
    marks = chart.mark_point(style=NAMED, **style.dots(80, 0.75))
    return alt.layer(*layers, marks.encode(**series(style, ADVICE_TOOLTIPS)), **frame(rows))


def _asked(tolerances: list[float]) -> list:
    rows = [{"asked": tolerance_text(it), "at": it} for it in tolerances]
    line = alt.Chart(alt.InlineData(values=rows)).transform_filter(f"datum.asked === {TOLERANCE}")
    line = line.encode(y=alt.Y("at:Q", scale=log_scale(10)))
    name = line.transform_calculate(name="'asked: ' + datum.asked")
    return [
        line.mark_rule(**INK, strokeDash=[6, 4], opacity=0.6),
        name.mark_text(align="right", dy=-6).encode(x=alt.XValue("width"), text="name:N"),
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
            "error": short(_within(worst)),
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
    label = PLAIN if max(map(abs, values)) < 1e4 else NUMBER
    bare = {"labels": False, "ticks": False} if len(values) == 1 else {}  # as it is
    axis = alt.Axis(title=unit, labelAngle=0, labelOverlap="greedy", labelExpr=label, **bare)
    x = alt.X("value:O", sort=values, axis=axis)
    y = log(alt.Y, "error", "worst error", error_scale(rows))
    beyond = []
    if any(row["share"] for row in rows):
        chart = filtered(choices).encode(x=x)
        beyond = failures(chart, "refused", coloured(style, LOAD_TOOLTIPS), 90)
    return lines(rows, style, choices, LOAD_TOOLTIPS, x, y, *beyond)
