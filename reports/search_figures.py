"""The chart of what a search has found: the worst so far against what was spent."""

import altair as alt

from charts import NUMBER, Style, error_scale, filtered, frame, log_axis, mark_last, names, short
from figures import series

METHOD_DASH = alt.Scale(domain=["search", "random"], range=[[1, 0], [2, 4]])
TOOLTIPS = {
    "variant": "variant",
    "precision": "precision",
    "scene": "by",
    "evaluations": "mechanisms judged",
    "error_text": "worst silent error",
}


def worst_so_far(rows: list[dict], style: Style, choices: dict[str, str]):
    """A staircase each variant and method; a row has evaluations, error and their texts."""
    rows = [row | {"error": short(row["error"])} for row in rows]
    mark_last([row for row in rows if row["scene"] == "search"], "error", "evaluations")
    x = alt.X(
        "evaluations:Q",
        axis=log_axis("x", "mechanisms judged", NUMBER),
        scale=alt.Scale(type="log", nice=False, padding=12),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "worst so far", NUMBER), scale=error_scale(rows))
    drawn = filtered(choices).encode(x=x, y=y, **series(style, TOOLTIPS))
    dash = alt.StrokeDash("scene:N", scale=METHOD_DASH, legend=None)
    lines = drawn.mark_line(strokeWidth=1.5, opacity=0.8, interpolate="step-after")
    lines = lines.encode(strokeDash=dash)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=20, opacity=1)
    return alt.layer(lines, marks, names(drawn), **frame(rows))
