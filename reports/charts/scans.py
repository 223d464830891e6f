"""The charts of the filter as a scan: error against time and span, time against processors."""

import altair as alt

from charts.common import (
    NUMBER,
    TIME,
    VIEW,
    Style,
    error_scale,
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
    "threads": "threads",
    "links": "links of a block",
    "span_text": "flops one after another",
    "time_text": "median time",
    "error_text": "median error",
}
PROCESSOR_TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "links": "links of a block",
    "kind": "time is",
    "processors": "processors",
    "time_text": "time",
}


def error_against_time(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant and number of threads; its points are N."""
    rows = [
        _row(it, task, time=short(time), threads=threads, time_text=time_text(time))
        for it in scanned
        for threads, time in sorted(it.times.items())
        for task in it.errors
    ]
    return _errors(rows, style, choices, "time", "median time of a call", TIME)


def error_against_span(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant; its points are N."""
    rows = [
        _row(it, task, span=short(it.timed.span), threads="any number")
        for it in scanned
        if it.timed
        for task in it.errors
    ]
    title = "flops one after another, on any number of processors"
    return _errors(rows, style, choices, "span", title, NUMBER)


def _row(it: Scanned, task: str, **more) -> dict:
    return {
        "scene": it.scene,
        "n": it.n,
        VIEW: task,
        "variant": it.variant,
        "links": it.links or "no blocks",
        "error": short(it.errors[task]),
        "error_text": error_text(it.errors[task]),
        "time_text": time_text(it.times.get(1)),
        "span_text": thousands_text(it.timed.span) if it.timed else "–",
    } | more


def _errors(rows: list[dict], style: Style, choices: dict[str, str], what: str, title, label):
    least = min(row["threads"] for row in rows)
    mark_last([row for row in rows if row["threads"] == least], "error", what, (VIEW,))
    threads = sorted({row["threads"] for row in rows})
    x = alt.X(
        f"{what}:Q",
        axis=log_axis("x", title, label),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "median error", NUMBER), scale=error_scale(rows))
    drawn = filtered(choices).transform_filter("datum.error > 0")
    drawn = drawn.encode(x=x, y=y, **_colour(style, TOOLTIPS))
    dash = alt.StrokeDash("threads:N", scale=_of(threads, DASHES), legend=None)
    shape = alt.Shape("threads:N", scale=_of(threads, list(SHAPES.values())), legend=None)
    lines = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash, order="n:Q")
    look = {"filled": True, "size": 55, "opacity": 1, "stroke": style.page, "strokeWidth": 0.5}
    marks = drawn.mark_point(**look).encode(shape=shape)
    return alt.layer(lines, marks, names(drawn), **frame(rows))


def _of(threads: list, looks) -> alt.Scale:
    return alt.Scale(domain=threads, range=[looks[i % len(looks)] for i in range(len(threads))])


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
        for it in scanned
        for row in (_scan(it, machine, bound == "memory") if is_scan(it.variant) else _level(it))
    ]
    ends = [row for row in rows if row["kind"] == "predicted" and not row["other"]]
    mark_last(ends, "time", "processors", (SIZE, BOUND))
    x = alt.X(
        "processors:Q",
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
    curves = drawn.transform_filter("datum.kind === 'predicted'").encode(x=x, detail="links:N")
    dash = alt.StrokeDash(
        "other:N", scale=alt.Scale(domain=[0, 1], range=list(DASHES[:2])), legend=None
    )
    levels = drawn.transform_filter("datum.kind === 'on one processor'")
    level_names = levels.encode(x=alt.value("width"), text="variant:N")
    measured = drawn.transform_filter("datum.kind === 'measured'").encode(x=x)
    return alt.layer(
        levels.mark_rule(strokeWidth=1.25, opacity=0.8),
        level_names.mark_text(align="right", dx=-4, dy=-6),
        curves.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash),
        curves.mark_point(filled=True, size=16, opacity=0.8),
        measured.mark_point(filled=True, size=80, opacity=1, stroke=style.page, strokeWidth=0.75),
        names(curves),
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
            "processors": processors,
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
    row = {"links": "no blocks", "kind": "on one processor", "processors": 1}
    return [row | {"time": short(time), "time_text": time_text(time)}]
