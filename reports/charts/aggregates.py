"""The charts over many robots and over two runs: performance profiles, ratios with their noise."""

import altair as alt

from charts.common import PLAIN, TIME, TOLERANCE, VIEW, Style, dots, filtered, frame
from charts.groups import mark_first
from charts.layers import INK, log, log_scale, names, one
from charts.rows import titled
from charts.variants import lines, series

PROFILE_TOOLTIPS = titled(
    "scene variant precision slower share_text",
    scene="of",
    slower="times slower",
    share_text="answered within",
)
RATIO_TOOLTIPS = titled(
    "scene variant precision before_text after_text ratio_text noise_text verdict",
    after_text="now",
    ratio_text="now over before",
)


def performance_profile(rows: list[dict], style: Style, choices: dict[str, str]):
    """Share answered against times slower, a step line a series, named halfway up."""
    mark_first(rows, VIEW, TOLERANCE)
    axis = alt.Axis(title="share of the robots", format="%")
    x = log(alt.X, "slower", "times slower than the fastest", 6, PLAIN)
    y = alt.Y("share:Q", axis=axis, scale=alt.Scale(domain=[0, 1.02], nice=False))
    look = {"marks": dots(35), "strokeWidth": 1.5, "interpolate": "step-after", "opacity": 0.8}
    return lines(rows, style, choices, PROFILE_TOOLTIPS, x, y, **look)


def ratios(rows: list[dict], style: Style, choices: dict[str, str]):
    """Time now over time before, with three standard errors either way; 1 is no change."""
    mark_first(rows, VIEW)
    for row in rows:
        if row["verdict"] not in ("same", "machines differ"):
            row["last"] = 1  # to be named
    ratio, low = (
        log(alt.Y, name, "time now over time before", 12, PLAIN) for name in ("ratio", "low")
    )
    drawn = filtered(choices).encode(x=log(alt.X, "before", "time before", 14, TIME))
    noise = drawn.mark_rule(strokeWidth=1, aria=False, opacity=0.7)
    placed = drawn.encode(y=ratio, **series(style, RATIO_TOOLTIPS))
    same = one(one=1).encode(y=alt.Y("one:Q", scale=log_scale(12)))
    return alt.layer(
        same.mark_rule(**INK, strokeDash=[6, 4], opacity=0.6),
        noise.encode(y=low, y2="high:Q", color=style.colour),
        placed.mark_point(**dots(45)),
        names(placed),
        **frame(rows),
    )
