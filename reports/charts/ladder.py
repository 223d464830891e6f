"""The chart of the ladder: error against run time at each tolerance, other variants behind it."""

import math

import altair as alt

from charts.common import (
    NAMED,
    NUMBER,
    TIME,
    VIEW,
    Style,
    css_colour,
    error_scale,
    filtered,
    frame,
    log_axis,
    view,
)
from charts.groups import first_series, group
from charts.text import error_text
from charts.variants import TOOLTIPS, bands, point_rows
from read.ladder import DEFAULT, LAST_BITS, is_ladder, tolerance
from summary.points import Point

LADDER_TOOLTIPS = {"tolerance": "tolerance"} | TOOLTIPS
NO_LABEL = " "  # an empty one would be replaced by the series' name
OURS, OTHERS = "ladder", "others"


def tolerance_name(variant: str) -> str:
    """As the page writes it; of a rung, its name."""
    return {DEFAULT: "default", LAST_BITS: "last bits", "Rung<two_doubles>": "two doubles"}.get(
        variant, variant.partition("<")[2].rstrip(">")
    )


def by_tolerance(point: Point) -> float:
    """Sorts the largest tolerance first, rungs last."""
    within = tolerance(point.variant, point.precision)
    return -within if within else 0


def rows(found: list[Point], task: str) -> list[dict]:
    """Of one scene and task: the ladder by its tolerances, then the others in the background,
    which answer rows one after another."""
    ladder = sorted((it for it in found if is_ladder(it.variant)), key=by_tolerance)
    others = [it for it in found if not is_ladder(it.variant)]
    out = []
    for point, row in zip(ladder, point_rows(ladder), strict=True):
        row |= {"group": OURS, "label": NO_LABEL, "tolerance": tolerance_name(point.variant)}
        if within := tolerance(point.variant, point.precision):
            row["rank"] = -math.log10(within)
        if point.variant in (DEFAULT, LAST_BITS):
            row["tolerance"] += f" ({error_text(within)})"
        out.append(row)
    _label(out)
    series = [(it.variant, it.precision) for it in others]
    named = first_series(series, most=len({group(variant) for variant, _ in series}))
    for row in point_rows(others):
        known = (row["variant"], row["precision"]) in named
        out.append(
            row | {"group": OTHERS, "tolerance": "–"} | ({} if known else {"label": NO_LABEL})
        )
    return [row | {VIEW: view(task, "relative")} for row in out]


def _label(ladder: list[dict]) -> None:
    """Tolerances that the same rung answers have the same error: one label, at the slowest."""
    same = {}
    for row in ladder:
        same.setdefault((row["precision"], row["error"], "rank" in row), []).append(row)
    for (precision, *_), those in same.items():
        names = [tolerance_name(row["variant"]) for row in those]
        span = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
        slowest = max(those, key=lambda row: row["time"])
        slowest["label"] = f"{span}, {precision}"


def error_against_time(drawn: list[dict], style: Style, choices: dict[str, str]):
    """A line through the tolerances of each precision; one mark a variant and precision."""
    x = alt.X(
        "time:Q",
        axis=log_axis("x", "median time of a state", TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "median error", NUMBER), scale=error_scale(drawn))
    colours = alt.Scale(domain=[OURS, OTHERS], range=[css_colour(DEFAULT), "currentColor"])
    encoding = {
        "color": alt.Color("group:N", scale=colours, legend=None),
        "opacity": alt.Opacity(
            "group:N", scale=alt.Scale(domain=[OURS, OTHERS], range=[1, 0.4]), legend=None
        ),
        "shape": alt.Shape("precision:N", scale=style.shape, legend=None),
        "tooltip": [
            alt.Tooltip(f"{name}:N", title=title) for name, title in LADDER_TOOLTIPS.items()
        ],
    }
    chart = filtered(choices)
    shown = chart.transform_filter("datum.error > 0")
    steps = shown.transform_filter("isValid(datum.rank)").mark_line(strokeWidth=1.5, opacity=0.8)
    marks = shown.mark_point(filled=True, size=80, style=NAMED, stroke=style.page, strokeWidth=0.75)
    return alt.layer(
        steps.encode(
            x=x,
            y=y,
            color=encoding["color"],
            order="rank:Q",
            strokeDash=alt.StrokeDash("precision:N", scale=style.dash, legend=None),
        ),
        *bands(chart, drawn, x, encoding),
        marks.encode(x=x, y=y, **encoding),
        **frame(drawn),
    )
