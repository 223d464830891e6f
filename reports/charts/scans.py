"""The charts of the filter as a scan: error against time and span, time against processors."""

import math
from itertools import cycle

import altair as alt

from charts.common import (
    NUMBER,
    TIME,
    VIEW,
    Style,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
    short,
)
from charts.palette import SHAPES
from charts.text import error_text, thousands_text, time_text
from summary.scans import Machine, Scanned, is_scan, predicted

SIZE = "size"  # the parameter that says which N is drawn
BOUND = "bound"  # and whether memory bounds the time
BOUNDS = {"memory": "arithmetic and memory", "arithmetic": "arithmetic alone"}
PROCESSORS = [*(2**i for i in range(14)), 10_000]
DASHES = ([1, 0], [5, 3], [1, 2], [8, 2, 1, 2])

TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "links": "links of a block",
    "threads": "threads",
    "time_text": "median time",
    "error_text": "median error",
}
SPAN_TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "links": "links of a block",
    "span_text": "flops one after another",
    "error_text": "median error",
}
PROCESSOR_TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "links": "links of a block",
    "kind": "time is",
    "on": "processors",
    "time_text": "time",
}


def error_against_time(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant and number of threads; its points are N."""
    rows = [
        _row(it, it.links, task)
        | {"time": short(time), "threads": threads, "time_text": time_text(time)}
        for it in scanned
        for threads, time in sorted(it.times.items())
        for task in it.timed_errors
    ]
    lines = sorted({row["threads"] for row in rows})
    mark_last([row for row in rows if row["threads"] == lines[0]], "error", "time", (VIEW,))
    x = ("time", "median time of a call", TIME)
    return _errors(rows, style, choices, x, "threads", lines, TOOLTIPS)


def error_against_span(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant, and another for blocks that are not those that are timed; its points are
    N."""
    rows = [
        _row(it, links, task)
        | {
            "other": int(links != it.links),
            "span": short(it.flops[links].span),
            "span_text": thousands_text(it.flops[links].span),
        }
        for it in scanned
        for links in sorted(it.flops.keys() & it.errors.keys())
        for task in it.errors[links]
    ]
    mark_last([row for row in rows if not row["other"]], "error", "span", (VIEW,))
    x = ("span", "flops one after another, on any number of processors", NUMBER)
    return _errors(rows, style, choices, x, "other", [0, 1], SPAN_TOOLTIPS)


def _row(it: Scanned, links: int, task: str) -> dict:
    return {
        "scene": it.scene,
        "n": it.n,
        VIEW: task,
        "variant": it.variant,
        "links": links or "no blocks",
        "error": short(it.errors[links][task]),
        "error_text": error_text(it.errors[links][task]),
    }


def _errors(
    rows: list[dict],
    style: Style,
    choices: dict[str, str],
    x: tuple[str, str, str],
    line: str,
    lines: list[int],
    tooltips: dict[str, str],
):
    """The field `line` sets the lines of a variant apart."""
    field, title, label = x
    x = alt.X(
        f"{field}:Q",
        axis=log_axis("x", title, label),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "median error", NUMBER), scale=_decades(rows))
    drawn = filtered(choices).transform_filter("datum.error > 0")
    drawn = drawn.encode(x=x, y=y, **_colour(style, tooltips))
    dash = alt.StrokeDash(f"{line}:N", scale=_looks(lines, DASHES), legend=None)
    shape = alt.Shape(f"{line}:N", scale=_looks(lines, SHAPES.values()), legend=None)
    path = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash, order=alt.Order("n:Q"))
    look = {"filled": True, "size": 55, "opacity": 1, "stroke": style.page, "strokeWidth": 0.5}
    marks = drawn.mark_point(**look).encode(shape=shape)
    return alt.layer(path, marks, names(drawn), **frame(rows))


def _decades(rows: list[dict]) -> alt.Scale:
    """Whole ones, in which errors that hardly differ look so; without room for errors of 0."""
    exponents = [math.log10(row["error"]) for row in rows if row["error"]] or [0]
    low, high = math.floor(min(exponents)), math.ceil(max(exponents))
    domain = [10.0**low, 10.0 ** max(high, low + 1)]
    return alt.Scale(type="log", nice=False, domain=domain)


def _looks(lines: list[int], looks) -> alt.Scale:
    """Of more lines than looks the last ones look like the first."""
    return alt.Scale(domain=lines, range=[look for look, _ in zip(cycle(looks), lines)])


def _colour(style: Style, tooltips: dict[str, str]) -> dict:
    return {
        "color": alt.Color("variant:N", scale=style.colour, legend=None),
        "tooltip": [alt.Tooltip(f"{name}:N", title=title) for name, title in tooltips.items()],
    }


def time_on_processors(
    scanned: list[Scanned], machine: Machine, style: Style, choices: dict[str, str]
):
    """Of scans a line each size of blocks, broken but for those that are timed, and large marks of
    what was measured; of what has no blocks the time on one processor as a level line."""
    rows = [
        {"scene": it.scene, SIZE: str(it.n), BOUND: bound, "variant": it.variant} | row
        for bound in BOUNDS
        for it in sorted(scanned, key=lambda it: -max(it.times.values()))  # their names in turn
        for row in (_scan(it, machine, bound == "memory") if is_scan(it.variant) else _level(it))
    ]
    ends = [row for row in rows if row["kind"] != "measured" and not row["other"]]
    mark_last(ends, "time", "at", (SIZE, BOUND))
    x = alt.X(
        "at:Q",
        axis=log_axis("x", "processors", "format(datum.value, 'd')"),
        scale=alt.Scale(type="log", nice=False, padding=12),
    )
    y = alt.Y(
        "time:Q",
        axis=log_axis("y", "time of a call", TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    drawn = filtered(choices).transform_filter("datum.time > 0")
    drawn = drawn.encode(y=y, **_colour(style, PROCESSOR_TOOLTIPS))
    placed = drawn.encode(x=x)
    curves = placed.transform_filter("datum.kind === 'predicted'").encode(detail=alt.Detail("links:N"))
    dash = alt.StrokeDash("other:N", scale=_looks([0, 1], DASHES), legend=None)
    levels = drawn.transform_filter("datum.kind === 'on one processor'")
    measured = placed.transform_filter("datum.kind === 'measured'")
    return alt.layer(
        levels.mark_rule(strokeWidth=1.25, opacity=0.8),
        curves.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash),
        curves.mark_point(filled=True, size=16, opacity=0.8),
        measured.mark_point(filled=True, size=80, opacity=1, stroke=style.page, strokeWidth=0.75),
        names(placed),
        **frame(rows),
    )


def _scan(it: Scanned, machine: Machine, memory: bool) -> list[dict]:
    predictions = [
        (links, processors, predicted(it, links, processors, machine, memory), "predicted")
        for links in sorted(it.flops)
        for processors in PROCESSORS
    ]
    measured = [(it.links, *timed, "measured") for timed in sorted(it.times.items())]
    return [
        {
            "links": links,
            "other": int(links != it.links),
            "kind": kind,
            "at": processors,
            "on": str(processors),
            "time": short(time),
            "time_text": time_text(time),
        }
        for links, processors, time, kind in predictions + measured
        if time
    ]


def _level(it: Scanned) -> list[dict]:
    if 1 not in it.times:
        return []
    time = it.times[1]
    row = {"links": "no blocks", "other": 0, "kind": "on one processor", "on": "1"}
    return [row | {"at": PROCESSORS[-1], "time": short(time), "time_text": time_text(time)}]
