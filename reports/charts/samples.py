"""The charts of the simulated random model: error against number of samples and against time."""

import altair as alt

from charts.common import (
    BAND,
    HEIGHT,
    NUMBER,
    QUANTITY,
    TIME,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
    strip,
)
from charts.text import error_text, time_text
from summary.points import Band

ROUNDING = 1e-9  # an error below is no sampling error

TOOLTIPS = {
    "scene": "scene",
    "variant": "method",
    "samples": "samples",
    "replicas": "replicas",
    "error_text": "median error",
    "low_text": "10 % below",
    "high_text": "90 % below",
    "time_text": "median time",
    "threads": "threads",
}


def _values(bands: list[Band]) -> list[dict]:
    return [
        {
            "scene": band.scene,
            QUANTITY: band.quantity,
            "variant": band.method,
            "samples": band.samples,
            "replicas": band.replicas,
            "error": band.median,
            "low": band.low,
            "high": band.high,
            "time": band.time,
            "error_text": error_text(band.median),
            "low_text": error_text(band.low),
            "high_text": error_text(band.high),
            "time_text": time_text(band.time),
            "threads": band.threads,
        }
        for band in bands
    ]


def against(bands: list[Band], style: Style, choices: dict[str, str], what: str):
    """Error against `what`, samples or time: a line and a band a method, a point a count.

    Against samples, what is exact to rounding stands in a strip below the scale, an algorithm
    without samples as a rule there; against time both are points on the scale.
    """
    values = mark_last(_values(bands), "samples", what)
    title, label, floor, below = {
        "samples": ("number of samples", NUMBER, ROUNDING, "exact"),
        "time": ("median time", TIME, 0, "0"),
    }[what]
    scale = alt.Scale(type="log", nice=False, padding=10)
    x = alt.X(f"{what}:Q", axis=log_axis("x", title, label), scale=scale)
    error = {"axis": log_axis("y", "relative error", NUMBER), "scale": error_scale(values, floor)}
    y = alt.Y("error:Q", **error)
    tooltip = [alt.Tooltip(f"{name}:N", title=title) for name, title in TOOLTIPS.items()]
    shape = alt.Shape("variant:N", scale=style.variant_shape, legend=None)
    look = {"filled": True, "size": 55, "opacity": 1, "stroke": style.page, "strokeWidth": 0.5}

    chart = filtered(choices).encode(
        color=alt.Color("variant:N", scale=style.colour, legend=None), tooltip=tooltip
    )
    placed = chart.transform_filter(f"datum.{what} > 0").encode(x=x)
    on_scale = placed.transform_filter(f"datum.error > {floor}").encode(y=y)
    sampled = on_scale.transform_filter("datum.samples > 0 && datum.low > 0")
    layers = [
        sampled.encode(y=alt.Y("low:Q", **error), y2=alt.Y2("high:Q")).mark_area(opacity=0.25),
        sampled.mark_line(strokeWidth=1.5, opacity=0.8),
        on_scale.encode(shape=shape).mark_point(**look),
        names(on_scale),
    ]
    if any(row["error"] <= floor for row in values):
        middle = alt.YValue(HEIGHT - BAND / 2)
        exact = chart.transform_filter(f"datum.error <= {floor}").encode(y=middle)
        points = exact.transform_filter(f"datum.{what} > 0").encode(x=x, shape=shape)
        rule = exact.transform_filter(f"datum.{what} === 0")
        name = rule.encode(x=alt.XValue("width"), text=alt.Text("variant:N"))
        layers += [
            *strip(HEIGHT - BAND, below),
            rule.mark_rule(strokeWidth=1.5, strokeDash=[6, 3]),
            name.mark_text(align="right", dx=-4, dy=-6),
            points.mark_point(**look),
        ]
    return alt.layer(*layers, **frame(values))
