"""The chart of cells: error, median and worst, against the time of a state, in so many a call."""

import altair as alt

from charts.common import (
    NAMED,
    NUMBER,
    TIME,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    short,
    view,
)
from charts.ladder import NO_LABEL, rank, tolerance_name
from charts.text import error_text, thousands_text, time_text
from charts.variants import bands, front, series
from summary.engines import LADDER, SILENT, Cell, best

COMPILED = 0.05  # s; a first call that takes longer has compiled something
BATCH = "batch"  # a parameter of the chart
COLUMNS = {  # of the table of cells
    "variant": "engine",
    "precision": "precision",
    "tolerance": "tolerance",
    "status": "status",
    "reason": "reason",
    "error_text": "median error",
    "worst_text": "largest error",
    "states": "states",
    "time_text": "time of a state",
    "copies_text": "with copies",
    "first_text": "first call, with compilation",
    "version": "version",
    "machine": "machine",
    "command": "command",
}
TOOLTIPS = {
    name: title
    for name, title in COLUMNS.items()
    if name not in ("first_text", "version", "machine", "command")
}


def cell_rows(cells: list[Cell]) -> list[dict]:
    """Rows for Vega; of what is not timed, or did not answer, the table alone has one."""
    rows = [_row(cell) for cell in cells]
    _label([row for row in rows if row["variant"] == LADDER and row.get("error")])
    _set_aside(cells, rows)
    return rows


def _row(cell: Cell) -> dict:
    drawn = cell.time is not None
    row = {
        "scene": cell.scene,
        "view": view(cell.task, "relative"),
        BATCH: str(cell.batch),
        "variant": cell.variant,
        "precision": cell.precision,
        "status": cell.status,
        "reason": cell.reason or "–",
        "tolerance": tolerance_name(cell.tolerance) if cell.variant == LADDER else "–",
        "time": short(cell.time),
        "error": short(cell.median) if drawn else None,
        "worst": short(cell.worst) if drawn else None,
        "share": cell.failures / cell.states if drawn else None,
        "share_text": "",
        "error_text": error_text(cell.median),
        "worst_text": error_text(cell.worst),
        "states": f"{cell.states - cell.failures} of {cell.states}",
        "time_text": time_text(cell.time),
        "copies_text": time_text(cell.with_copies),
        "first_text": f"{cell.first_call:.2g} s" if (cell.first_call or 0) > COMPILED else "–",
        "version": cell.version or "–",
        "machine": cell.machine or "–",
        "command": cell.command or "–",
    }
    if cell.variant == LADDER:
        row["label"] = NO_LABEL
        if (place := rank(cell.tolerance, cell.precision)) is not None:
            row["rank"] = place
    return row


def _label(ladder: list[dict]) -> None:
    """Tolerances that the same rung answers have the same error: one label, at the slowest."""
    same = {}
    for row in ladder:
        place = (row["scene"], row["view"], row[BATCH])
        same.setdefault((*place, row["precision"], row["error"], "rank" in row), []).append(row)
    for those in same.values():
        those.sort(key=lambda row: row.get("rank", 0))
        names = [row["tolerance"] for row in those]
        span = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
        max(those, key=lambda row: row["time"])["label"] = f"{span}, {those[0]['precision']}"


def _set_aside(cells: list[Cell], rows: list[dict]) -> None:
    """Of all code for one robot the fastest alone is shown at first."""
    groups = {}
    for cell, row in zip(cells, rows, strict=True):
        if cell.ours and cell.variant != LADDER:
            place = (cell.scene, cell.task, cell.batch, cell.precision)
            groups.setdefault(place, []).append((cell, row))
    for own in groups.values():
        fastest = best([cell for cell, _ in own])
        for cell, row in own:
            if cell is not fastest:
                row["more"] = 1


def error_against_time(rows: list[dict], style: Style, choices: dict[str, str]):
    """A mark at the median, a line up to the worst; hollow where something is to be said of it."""
    timed = [row for row in rows if row["time"] is not None]
    x = alt.X(
        "time:Q",
        axis=log_axis("x", "median time of a state", TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    axis = log_axis("y", "error: median, and worst of the states", NUMBER)
    scale = error_scale(timed)
    y, worst = (alt.Y(f"{name}:Q", axis=axis, scale=scale) for name in ("error", "worst"))
    chart = filtered(choices).transform_filter("isValid(datum.time)")
    drawn = chart.transform_filter("datum.error > 0")
    encoding = series(style, TOOLTIPS)
    fill = alt.condition(f"datum.status == '{SILENT}'", alt.value(0), alt.value(1))
    plain = {name: channel for name, channel in encoding.items() if name != "shape"}
    return alt.layer(
        *front(chart, x, y),
        drawn.transform_filter("isValid(datum.rank)")
        .mark_line(strokeWidth=1.5, opacity=0.8)
        .encode(
            x=x,
            y=y,
            color=encoding["color"],
            order="rank:Q",
            strokeDash=alt.StrokeDash("precision:N", scale=style.dash, legend=None),
        ),
        drawn.mark_rule(strokeWidth=1.5, opacity=0.6, aria=False).encode(
            x=x, y=y, y2=alt.Y2("worst:Q"), **plain
        ),
        *bands(chart, timed, x, encoding),
        drawn.mark_point(filled=True, size=80, opacity=1, style=NAMED, strokeWidth=1.5).encode(
            x=x, y=y, fillOpacity=fill, stroke=encoding["color"], **encoding
        ),
        **frame(rows),
    )


def batch_text(count: int) -> str:
    return thousands_text(count, 6)

