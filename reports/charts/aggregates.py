"""The charts over many robots and over two runs: performance profiles, ratios with their noise."""

import altair as alt

from charts.common import (
    NUMBER,
    TIME,
    TOLERANCE,
    VIEW,
    Style,
    filtered,
    frame,
    log_axis,
    names,
)
from charts.groups import first_series, mark_first
from charts.variants import series

PROFILE_TOOLTIPS = {
    "scene": "of",
    "variant": "variant",
    "precision": "precision",
    "slower": "times slower",
    "share_text": "answered within",
}
RATIO_TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "precision": "precision",
    "before_text": "before",
    "after_text": "now",
    "ratio_text": "now over before",
    "noise_text": "noise",
    "verdict": "verdict",
}


def performance_profile(rows: list[dict], style: Style, choices: dict[str, str]):
    """Share answered against times slower, a step line a series, named halfway up."""
    for view, tolerance in {(row[VIEW], row[TOLERANCE]) for row in rows}:
        own = [row for row in rows if (row[VIEW], row[TOLERANCE]) == (view, tolerance)]
        kept = first_series((row["variant"], row["precision"]) for row in own)
        for row in own:
            if (row["variant"], row["precision"]) not in kept:
                row["more"] = 1
    x = alt.X(
        "slower:Q",
        axis=log_axis("x", "times slower than the fastest", "format(datum.value, '~r')"),
        scale=alt.Scale(type="log", nice=False, padding=6),
    )
    y = alt.Y(
        "share:Q",
        axis=alt.Axis(title="share of the robots", format="%"),
        scale=alt.Scale(domain=[0, 1.02], nice=False),
    )
    drawn = filtered(choices).encode(x=x, y=y, **series(style, PROFILE_TOOLTIPS))
    dash = alt.StrokeDash("precision:N", scale=style.dash, legend=None)
    lines = drawn.mark_line(strokeWidth=1.5, interpolate="step-after", opacity=0.8).encode(
        strokeDash=dash
    )
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=35, opacity=1)
    return alt.layer(lines, marks, names(drawn), **frame(rows))


def ratios(rows: list[dict], style: Style, choices: dict[str, str]):
    """Time now over time before, with three standard errors either way; 1 is no change."""
    mark_first(rows, VIEW)
    for row in rows:
        if row["verdict"] not in ("same", "machines differ"):
            row["last"] = 1  # to be named
    x = alt.X(
        "before:Q",
        axis=log_axis("x", "time before", TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    axis = log_axis("y", "time now over time before", NUMBER)
    axis.labelExpr = axis.labelExpr.replace(NUMBER, "format(datum.value, '~r')")
    scale = alt.Scale(type="log", nice=False, padding=12)
    y = alt.Y("ratio:Q", axis=axis, scale=scale)
    drawn = filtered(choices)
    encoding = series(style, RATIO_TOOLTIPS)
    one = alt.Chart(alt.InlineData(values=[{"one": 1}])).encode(y=alt.Y("one:Q", scale=scale))
    noise = drawn.mark_rule(strokeWidth=1, aria=False, opacity=0.7).encode(
        x=x, y=alt.Y("low:Q", axis=axis, scale=scale), y2=alt.Y2("high:Q"), color=encoding["color"]
    )
    placed = drawn.encode(x=x, y=y, **encoding)
    return alt.layer(
        one.mark_rule(color="currentColor", strokeDash=[6, 4], opacity=0.6),
        noise,
        placed.mark_point(filled=True, size=45, opacity=1),
        names(placed),
        **frame(rows),
    )
