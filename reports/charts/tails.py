"""Charts of how often a silent error occurs, with exact limits: beyond a bound, and by kS."""

import altair as alt

from charts.common import NUMBER, Style, filtered, frame, log_axis, mark_last, names
from charts.variants import series

TOOLTIPS = {
    "scene": "family",
    "variant": "variant",
    "precision": "precision",
    "x_text": "x",
    "count": "silent",
    "trials": "of mechanisms",
    "limits_text": "95 % limits of the probability",
}


def tails(rows: list[dict], style: Style, choices: dict[str, str]):
    """Of errors of at least x."""
    return _probabilities(rows, style, choices, "error x", "P(silent error ≥ x)")


def by_condition(rows: list[dict], style: Style, choices: dict[str, str]):
    """Of silent failures in the decade of kS from x on."""
    return _probabilities(rows, style, choices, "kS, by decade", "P(silent failure)")


def _probabilities(
    rows: list[dict], style: Style, choices: dict[str, str], x_title: str, y_title: str
):
    """A row has x, probability, low, high and tooltip texts; low is 0 where nothing was seen."""
    mark_last(
        [row for row in rows if row["probability"]],
        "probability",
        "x",
        ("scene", "task", "measure"),
    )
    x = alt.X(
        "x:Q",
        axis=log_axis("x", x_title, NUMBER),
        scale=alt.Scale(type="log", nice=False, padding=12),
    )
    scale = alt.Scale(type="log", nice=False, padding=8)
    y = alt.Y("probability:Q", axis=log_axis("y", y_title, NUMBER), scale=scale)
    seen = filtered(choices).transform_filter("datum.probability > 0")
    band = seen.mark_area(opacity=0.15).encode(x=x, y=alt.Y("low:Q", scale=scale), y2=alt.Y2("high:Q"))
    band = band.encode(
        color=alt.Color("variant:N", scale=style.colour, legend=None), detail=alt.Detail("precision:N")
    )
    drawn = seen.encode(x=x, y=y, **series(style, TOOLTIPS))
    dash = alt.StrokeDash("precision:N", scale=style.dash, legend=None)
    lines = drawn.mark_line(strokeWidth=1.25, opacity=0.9).encode(strokeDash=dash)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=16, opacity=1)
    return alt.layer(band, lines, marks, names(drawn), **frame(rows))
