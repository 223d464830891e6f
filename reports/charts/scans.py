"""The charts of the filter as a scan: error against time and span, time against processors."""

import math

import altair as alt

from charts.common import DASHES, VIEW, Style, dots, filtered, frame, looks, mark_last
from charts.layers import log, names
from charts.palette import SHAPES
from charts.rows import fields, numbers, titled
from charts.text import error_text, thousands_text, time_text
from charts.variants import coloured, curves, lines
from summary.scans import Machine, Scanned, is_scan, predicted

SIZE = "size"  # the parameter that says which N is drawn
BOUND = "bound"  # and whether memory bounds the time
BOUNDS = {"memory": "arithmetic and memory", "arithmetic": "arithmetic alone"}
PROCESSORS = [*(2**i for i in range(14)), 10_000]

TOOLTIPS = titled("scene variant links threads time_text error_text")
SPAN_TOOLTIPS = titled(
    "scene variant links span_text error_text", span_text="flops one after another"
)
PROCESSOR_TOOLTIPS = titled(
    "scene variant links kind on time_text", kind="time is", on="processors", time_text="time"
)


def error_against_time(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant and number of threads; its points are N."""
    rows = [
        _row(it, it.links, task) | {"threads": threads} | numbers(time_text, time=time)
        for it in scanned
        for threads, time in sorted(it.times.items())
        for task in it.timed_errors
    ]
    threads = sorted({row["threads"] for row in rows})
    mark_last([row for row in rows if row["threads"] == threads[0]], "error", "time", (VIEW,))
    x = log(alt.X, "time", "median time of a call", 14)
    return _errors(rows, style, choices, x, "threads", threads, TOOLTIPS)


def error_against_span(scanned: list[Scanned], style: Style, choices: dict[str, str]):
    """A line a variant, and another for blocks that are not those that are timed; its points are
    N."""
    rows = [
        _row(it, links, task)
        | {"other": int(links != it.links)}
        | numbers(thousands_text, span=it.flops[links].span)
        for it in scanned
        for links in sorted(it.flops.keys() & it.errors.keys())
        for task in it.errors[links]
    ]
    mark_last([row for row in rows if not row["other"]], "error", "span", (VIEW,))
    x = log(alt.X, "span", "flops one after another, on any number of processors", 14)
    return _errors(rows, style, choices, x, "other", [0, 1], SPAN_TOOLTIPS)


def _row(it: Scanned, links: int, task: str) -> dict:
    row = fields(it, "scene", "n", "variant") | {VIEW: task, "links": links or "no blocks"}
    return row | numbers(error_text, error=it.errors[links][task])


def _errors(rows: list[dict], style: Style, choices: dict, x, line: str, names, tooltips: dict):
    """The field `line` sets the lines of a variant apart."""
    y = log(alt.Y, "error", "median error", _decades(rows))
    shape = looks(alt.Shape, line, names, SHAPES.values())
    path = {"strokeDash": looks(alt.StrokeDash, line, names, DASHES), "order": "n:Q"}
    look = {"marks": style.dots(55), "shape": shape, "path": path}
    return lines(rows, style, choices, tooltips, x, y, **look)


def _decades(rows: list[dict]) -> alt.Scale:
    """Whole ones, in which errors that hardly differ look so; without room for errors of 0."""
    exponents = [math.log10(row["error"]) for row in rows if row["error"]] or [0]
    low, high = math.floor(min(exponents)), math.ceil(max(exponents))
    domain = [10.0**low, 10.0 ** max(high, low + 1)]
    return alt.Scale(type="log", nice=False, domain=domain)


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
    y = log(alt.Y, "time", "time of a call", 14)
    drawn = filtered(choices).transform_filter("datum.time > 0")
    drawn = drawn.encode(y=y, **coloured(style, PROCESSOR_TOOLTIPS))
    placed = drawn.encode(x=log(alt.X, "at", "processors", 12, "format(datum.value, 'd')"))
    predictions = placed.transform_filter("datum.kind === 'predicted'").encode(detail="links:N")
    levels = drawn.transform_filter("datum.kind === 'on one processor'")
    measured = placed.transform_filter("datum.kind === 'measured'")
    path = {"strokeDash": looks(alt.StrokeDash, "other", [0, 1], DASHES)}
    return alt.layer(
        levels.mark_rule(strokeWidth=1.25, opacity=0.8),
        *curves(predictions, style, dots(16) | {"opacity": 0.8}, path=path)[:2],
        measured.mark_point(**style.dots(80, 0.75)),
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
        }
        | numbers(time_text, time=time)
        for links, processors, time, kind in predictions + measured
        if time
    ]


def _level(it: Scanned) -> list[dict]:
    if 1 not in it.times:
        return []
    row = {"links": "no blocks", "other": 0, "kind": "on one processor", "on": "1"}
    return [row | {"at": PROCESSORS[-1]} | numbers(time_text, time=it.times[1])]
