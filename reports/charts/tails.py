"""Charts of how often a silent error occurs, with exact limits: beyond a bound, and by kS."""

import altair as alt

from charts.common import Style, dots, filtered, mark_last
from charts.layers import log
from charts.rows import titled
from charts.variants import lines

TOOLTIPS = titled(
    "scene variant precision x_text count trials limits_text",
    scene="family",
    count="silent",
    trials="of mechanisms",
    limits_text="95 % limits of the probability",
)


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
    seen = [row for row in rows if row["probability"]]
    mark_last(seen, "probability", "x", ("scene", "task", "measure"))
    probability, low = (log(alt.Y, name, y_title, 8) for name in ("probability", "low"))
    x = log(alt.X, "x", x_title, 12)
    seen = filtered(choices).transform_filter("datum.probability > 0").encode(x=x)
    band = seen.mark_area(opacity=0.15).encode(
        y=low, y2="high:Q", color=style.colour, detail="precision:N"
    )
    look = {"marks": dots(16), "opacity": 0.9}
    return lines(rows, style, choices, TOOLTIPS, x, probability, band, **look)
