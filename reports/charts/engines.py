"""The chart of cells: error, median and worst, against the time of a state, in so many a call."""

import altair as alt

from charts.common import NAMED, Style, dots, error_scale, filtered, frame, view
from charts.ladder import NO_LABEL, rank, tolerance_name
from charts.layers import log
from charts.rows import fields, numbers, titled
from charts.text import error_text, thousands_text, time_text
from charts.variants import bands, coloured, front, series
from summary.engines import LADDER, SILENT, Cell, best
from summary.groups import by_key

COMPILED = 0.05  # s; a first call that takes longer has compiled something
BATCH = "batch"  # a parameter of the chart
COLUMNS = titled(  # of the table of cells
    "variant precision tolerance status reason error_text worst_text states time_text copies_text "
    "first_text version machine command",
    variant="engine",
    time_text="time of a state",
    copies_text="with copies",
    first_text="first call, with compilation",
)
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
    row = {
        "view": view(cell.task, "relative"),
        BATCH: str(cell.batch),
        "tolerance": tolerance_name(cell.tolerance) if cell.variant == LADDER else "–",
        "share_text": "",
        "states": f"{cell.states - cell.failures} of {cell.states}",
        "copies_text": time_text(cell.with_copies),
        "first_text": f"{cell.first_call:.2g} s" if (cell.first_call or 0) > COMPILED else "–",
    }
    row |= fields(cell, "scene", "variant", "precision", "status")
    row |= {
        name: text or "–"
        for name, text in fields(cell, "reason", "version", "machine", "command").items()
    }
    row |= numbers(time_text, time=cell.time)
    row |= numbers(error_text, error=cell.median, worst=cell.worst)
    row["share"] = cell.failures / cell.states
    if cell.time is None:
        row |= dict.fromkeys(("error", "worst", "share"))
    if cell.variant == LADDER:
        row["label"] = NO_LABEL
        if (place := rank(cell.tolerance, cell.precision)) is not None:
            row["rank"] = place
    return row


def _label(ladder: list[dict]) -> None:
    """Tolerances that the same rung answers have the same error: one label, at the slowest."""
    place = ("scene", "view", BATCH, "precision", "error")
    same = by_key(ladder, lambda row: (*map(row.get, place), "rank" in row))
    for those in same.values():
        those.sort(key=lambda row: row.get("rank", 0))
        names = [row["tolerance"] for row in those]
        span = names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
        max(those, key=lambda row: row["time"])["label"] = f"{span}, {those[0]['precision']}"


def _set_aside(cells: list[Cell], rows: list[dict]) -> None:
    """Of all code for one robot the fastest alone is shown at first."""
    generated = [
        (cell, row)
        for cell, row in zip(cells, rows, strict=True)
        if cell.ours and cell.variant != LADDER
    ]
    groups = by_key(generated, lambda it: (it[0].scene, it[0].task, it[0].batch, it[0].precision))
    for own in groups.values():
        fastest = best([cell for cell, _ in own])
        for cell, row in own:
            if cell is not fastest:
                row["more"] = 1


def error_against_time(rows: list[dict], style: Style, choices: dict[str, str]):
    """A mark at the median, a line up to the worst; hollow where something is to be said of it."""
    timed = [row for row in rows if row["time"] is not None]
    x = log(alt.X, "time", "median time of a state", 14)
    title, scale = "error: median, and worst of the states", error_scale(timed)
    y = log(alt.Y, "error", title, scale)
    chart = filtered(choices).transform_filter("isValid(datum.time)")
    drawn = chart.transform_filter("datum.error > 0").encode(x=x, y=y)
    ladder = drawn.transform_filter("isValid(datum.rank)").mark_line(strokeWidth=1.5, opacity=0.8)
    spread = drawn.mark_rule(strokeWidth=1.5, opacity=0.6, aria=False)
    marks = drawn.mark_point(style=NAMED, **dots(80), strokeWidth=1.5)
    fill = alt.condition(f"datum.status == '{SILENT}'", alt.value(0), alt.value(1))
    encoding = series(style, TOOLTIPS)
    return alt.layer(
        *front(chart, x, y),
        ladder.encode(color=style.colour, order="rank:Q", strokeDash=style.dash),
        spread.encode(y2="worst:Q", **coloured(style, TOOLTIPS)),
        *bands(chart, timed, x, encoding),
        marks.encode(fillOpacity=fill, stroke=style.colour, **encoding),
        **frame(rows),
    )


def batch_text(count: int) -> str:
    return thousands_text(count, 6)
