"""The charts of the simulated random model: error against number of samples and against time."""

import altair as alt

from charts.common import BAND, HEIGHT, QUANTITY, Style, error_scale, filtered, frame, mark_last
from charts.layers import log, strip
from charts.rows import fields, numbers, titled
from charts.text import error_text, time_text
from charts.variants import coloured, curves
from summary.points import Band

ROUNDING = 1e-9  # an error below is no sampling error

TOOLTIPS = titled(
    "scene variant samples replicas error_text low_text high_text time_text threads",
    variant="method",
    low_text="10 % below",
    high_text="90 % below",
)


def _values(bands: list[Band]) -> list[dict]:
    return [
        fields(band, "scene", "samples", "replicas", "threads")
        | {QUANTITY: band.quantity, "variant": band.method}
        | numbers(error_text, error=band.median, low=band.low, high=band.high)
        | numbers(time_text, time=band.time)
        for band in bands
    ]


def against(bands: list[Band], style: Style, choices: dict[str, str], what: str):
    """Error against `what`, samples or time: a line and a band a method, a point a count.

    Against samples, what is exact to rounding stands in a strip below the scale, an algorithm
    without samples as a rule there; against time both are points on the scale.
    """
    values = mark_last(_values(bands), "samples", what)
    title, floor, below = {
        "samples": ("number of samples", ROUNDING, "exact"),
        "time": ("median time", 0, "0"),
    }[what]
    x = log(alt.X, what, title, 10)
    scale = error_scale(values, floor)
    error, low = (log(alt.Y, name, "relative error", scale) for name in ("error", "low"))
    chart = filtered(choices).encode(**coloured(style, TOOLTIPS))
    placed = chart.transform_filter(f"datum.{what} > 0").encode(x=x)
    on_scale = placed.transform_filter(f"datum.error > {floor}").encode(y=error)
    sampled = on_scale.transform_filter("datum.samples > 0 && datum.low > 0")
    look, shape = style.dots(55), style.variant_shape
    _, marks, names = curves(on_scale, style, look, shape)
    line, *_ = curves(sampled, style, path={}, strokeWidth=1.5, opacity=0.8)
    layers = [sampled.encode(y=low, y2="high:Q").mark_area(opacity=0.25), line, marks, names]
    if any(row["error"] <= floor for row in values):
        exact = chart.transform_filter(f"datum.error <= {floor}")
        exact = exact.encode(y=alt.YValue(HEIGHT - BAND / 2))
        points = exact.transform_filter(f"datum.{what} > 0").encode(x=x, shape=shape)
        rule = exact.transform_filter(f"datum.{what} === 0")
        name = rule.encode(x=alt.XValue("width"), text="variant:N")
        layers += [
            *strip(HEIGHT - BAND, below),
            rule.mark_rule(strokeWidth=1.5, strokeDash=[6, 3]),
            name.mark_text(align="right", dx=-4, dy=-6),
            points.mark_point(**look),
        ]
    return alt.layer(*layers, **frame(values))
