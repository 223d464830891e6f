"""The chart of the roofline: flops a second against flops a byte, below what a machine allows."""

import altair as alt

from charts.common import NAMED, Style, filtered, frame, log_axis, short
from charts.text import (
    bandwidth_text,
    bytes_text,
    rate_text,
    share_text,
    task_text,
    thousands_text,
    three_digits,
    time_text,
)
from charts.variants import series
from summary.roofline import Placed

ROBOT = "robot"  # the parameter that says whose calls are drawn
MARGIN = 3  # times beyond the outermost mark
RATE = "format(datum.value / 1e9, '~r') + ' GFLOP/s'"
INTENSITY = "format(datum.value, '~r')"
LETTERS = {
    "acceleration": "a",
    "inverse_dynamics": "τ",
    "mass": "M",
    "mass_triangle": "M (triangle)",
    "inverse": "M⁻¹",
    "inverse_triangle": "M⁻¹ (triangle)",
    "derivatives": "∂a",
}

TOOLTIPS = {
    "scene": "scene",
    "task": "task",
    "variant": "variant",
    "precision": "precision",
    "rate_text": "operations a second",
    "roof_text": "roof",
    "share_text": "share of the roof",
    "bound": "bound by",
    "intensity_text": "operations a byte",
    "flops": "operations of a state",
    "bytes": "bytes of a state",
    "arrays": "arrays of a call",
    "copied": "arrays of the nearest copy",
    "copy": "its bandwidth",
    "time_text": "median time of a state",
}


def _row(it: Placed) -> dict:
    call, time = it.call, it.call.time
    return {
        "scene": time.scene,
        ROBOT: time.scene,
        "task": task_text(time.task),
        "variant": time.variant,
        "precision": time.precision,
        "label": label(it),
        "intensity": short(it.intensity),
        "rate": short(call.rate),
        "roof": short(it.roof),
        "rate_text": rate_text(call.rate),
        "roof_text": rate_text(it.roof),
        "share_text": share_text(it.share),
        "bound": it.bound,
        "intensity_text": three_digits(it.intensity),
        "flops": thousands_text(call.flops),
        "bytes": thousands_text(call.bytes),
        "arrays": bytes_text(it.arrays),
        "copy": bandwidth_text(it.copy.rate),
        "copied": bytes_text(it.copy.bytes),
        "time_text": time_text(time.nanoseconds),
    }


def label(it: Placed) -> str:
    task = it.call.time.task.removesuffix("_batch")
    letter = LETTERS.get(task, task)
    text = letter if it.call.states == 1 else f"{letter} × {it.call.states}"
    return text.replace(" ", "\u00a0")  # in one line of a table


def roofline(placed: list[Placed], style: Style, choices: dict[str, str]):
    """A mark a call, with a line up to its own roof, below the peaks and the bandwidths of the
    smallest and the largest arrays that were copied."""
    ridges = [it.call.peak / copy.rate for it in placed for copy in it.call.bandwidths]
    intensities = [it.intensity for it in placed] + ridges
    ends = [min(intensities) / MARGIN, max(intensities) * MARGIN]
    rows = [_row(it) for it in placed]
    roofs = [roof for scene in _by_scene(placed).values() for roof in _roofs(scene, *ends)]
    low = min([row["rate"] for row in rows] + [roof["y"] for roof in roofs])
    high = max([row["rate"] for row in rows] + [roof["y2"] for roof in roofs])
    scale = {"type": "log", "nice": False}
    across = {
        "axis": log_axis("x", "operations a byte that has to be moved", INTENSITY),
        "scale": alt.Scale(domain=[short(end) for end in ends], **scale),
    }
    up = {
        "axis": log_axis("y", "operations a second", RATE),
        "scale": alt.Scale(domain=[short(low / MARGIN), short(2 * high)], **scale),
    }

    def at(x: str, y: str) -> dict:
        return {"x": alt.X(f"{x}:Q", **across), "y": alt.Y(f"{y}:Q", **up)}

    chart = filtered(choices)
    calls = chart.transform_filter("isValid(datum.rate)")
    lines = chart.transform_filter("isValid(datum.y2)")
    ink = {"color": "currentColor"}
    peaks = lines.transform_filter("datum.kind === 'peak'").encode(**at("x2", "y2"), text=alt.Text("text:N"))
    copies = lines.transform_filter("datum.kind === 'bandwidth'")
    copies = copies.encode(**at("x", "y"), text=alt.Text("text:N"))
    dots = {"filled": True, "size": 70, "opacity": 1, "stroke": style.page, "strokeWidth": 0.75}
    return alt.layer(
        lines.encode(**at("x", "y"), x2=alt.X2("x2:Q"), y2=alt.Y2("y2:Q")).mark_rule(opacity=0.6, **ink),
        peaks.mark_text(align="right", dx=-4, dy=-6),
        copies.mark_text(align="left", dx=4, dy=14),
        calls.encode(**at("intensity", "rate"), y2=alt.Y2("roof:Q")).mark_rule(
            opacity=0.35, strokeDash=[2, 3], **ink
        ),
        calls.encode(**at("intensity", "rate"), **series(style, TOOLTIPS)).mark_point(
            style=NAMED, **dots
        ),
        **frame(rows + roofs),
    )


def _by_scene(placed: list[Placed]) -> dict[str, list[Placed]]:
    scenes = {}
    for it in placed:
        scenes.setdefault(it.call.time.scene, []).append(it)
    return scenes


def _roofs(of_scene: list[Placed], first: float, last: float) -> list[dict]:
    """Lines from (x, y) to (x2, y2), of one scene's machine."""
    robot = of_scene[0].call.time.scene
    peaks = {it.call.time.precision: it.call.peak for it in of_scene}
    copies = of_scene[0].call.bandwidths
    highest, fastest = max(peaks.values()), max(copy.rate for copy in copies)
    lines = []
    for copy in dict.fromkeys((copies[0], copies[-1])):
        lines.append(
            {
                "kind": "bandwidth",
                "x": first,
                "y": copy.rate * first,
                "x2": highest / copy.rate,
                "y2": highest,
                "text": f"copies of {bytes_text(copy.bytes)}: {bandwidth_text(copy.rate)}",
            }
        )
    for precision, peak in peaks.items():
        lines.append(
            {
                "kind": "peak",
                "precision": precision,
                "x": peak / fastest,
                "y": peak,
                "x2": last,
                "y2": peak,
                "text": f"{precision}: {rate_text(peak)}",
            }
        )
    for line in lines:
        line |= {ROBOT: robot} | {name: short(line[name]) for name in ("x", "y", "x2", "y2")}
    return lines
