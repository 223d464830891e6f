"""The chart of the roofline: flops a second against flops a byte, below what a machine allows."""

import altair as alt

from charts.common import NAMED, PLAIN, Style, filtered, frame, short
from charts.layers import INK, log
from charts.rows import fields, numbers, titled
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
from summary.groups import by_key
from summary.roofline import Placed

ROBOT = "robot"  # the parameter that says whose calls are drawn
MARGIN = 3  # times beyond the outermost mark
RATE = "format(datum.value / 1e9, '~r') + ' GFLOP/s'"
LETTERS = {
    "acceleration": "a",
    "inverse_dynamics": "τ",
    "mass": "M",
    "mass_triangle": "M (triangle)",
    "inverse": "M⁻¹",
    "inverse_triangle": "M⁻¹ (triangle)",
    "derivatives": "∂a",
}

TOOLTIPS = titled(
    "scene task variant precision rate_text roof_text share_text bound intensity_text flops bytes "
    "arrays copied copy time_text",
    share_text="share of the roof",
    bound="bound by",
    intensity_text="operations a byte",
    bytes="bytes of a state",
    arrays="arrays of a call",
    copied="arrays of the nearest copy",
    copy="its bandwidth",
    time_text="median time of a state",
)


def _row(it: Placed) -> dict:
    call, time = it.call, it.call.time
    return (
        fields(time, "scene", "variant", "precision")
        | {
            ROBOT: time.scene,
            "task": task_text(time.task),
            "label": label(it),
            "share_text": share_text(it.share),
            "bound": it.bound,
            "flops": thousands_text(call.flops),
            "bytes": thousands_text(call.bytes),
            "arrays": bytes_text(it.arrays),
            "copy": bandwidth_text(it.copy.rate),
            "copied": bytes_text(it.copy.bytes),
            "time_text": time_text(time.nanoseconds),
        }
        | numbers(rate_text, rate=call.rate, roof=it.roof)
        | numbers(three_digits, intensity=it.intensity)
    )


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
    scenes = by_key(placed, lambda it: it.call.time.scene)
    roofs = [roof for scene in scenes.values() for roof in _roofs(scene, *ends)]
    low = min([row["rate"] for row in rows] + [roof["y"] for roof in roofs])
    high = max([row["rate"] for row in rows] + [roof["y2"] for roof in roofs])
    across, up = (
        alt.Scale(domain=list(map(short, domain)), type="log", nice=False)
        for domain in (ends, (low / MARGIN, 2 * high))
    )

    def at(x: str, y: str) -> dict:
        return {
            "x": log(alt.X, x, "operations a byte that has to be moved", across, PLAIN),
            "y": log(alt.Y, y, "operations a second", up, RATE),
        }

    chart = filtered(choices)
    calls = chart.transform_filter("isValid(datum.rate)").encode(**at("intensity", "rate"))
    lines = chart.transform_filter("isValid(datum.y2)").encode(text="text:N")
    peaks = lines.transform_filter("datum.kind === 'peak'").encode(**at("x2", "y2"))
    copies = lines.transform_filter("datum.kind === 'bandwidth'").encode(**at("x", "y"))
    roof = chart.transform_filter("isValid(datum.y2)").mark_rule(opacity=0.6, **INK)
    reach = calls.mark_rule(opacity=0.35, strokeDash=[2, 3], **INK)
    return alt.layer(
        roof.encode(**at("x", "y"), x2="x2:Q", y2="y2:Q"),
        peaks.mark_text(align="right", dx=-4, dy=-6),
        copies.mark_text(align="left", dx=4, dy=14),
        reach.encode(y2="roof:Q"),
        calls.mark_point(style=NAMED, **style.dots(70, 0.75)).encode(**series(style, TOOLTIPS)),
        **frame(rows + roofs),
    )


def _roofs(of_scene: list[Placed], first: float, last: float) -> list[dict]:
    """Lines from (x, y) to (x2, y2), of one scene's machine."""
    robot = {ROBOT: of_scene[0].call.time.scene}
    peaks = {it.call.time.precision: it.call.peak for it in of_scene}
    copies = of_scene[0].call.bandwidths
    highest, fastest = max(peaks.values()), max(copy.rate for copy in copies)
    lines = []

    def line(text: str, x: float, y: float, x2: float, y2: float, **more: str) -> None:
        ends = {"x": x, "y": y, "x2": x2, "y2": y2}
        lines.append(
            robot | more | {name: short(end) for name, end in ends.items()} | {"text": text}
        )

    for copy in dict.fromkeys((copies[0], copies[-1])):
        text = f"copies of {bytes_text(copy.bytes)}: {bandwidth_text(copy.rate)}"
        ends = (first, copy.rate * first, highest / copy.rate, highest)
        line(text, *ends, kind="bandwidth")
    for precision, peak in peaks.items():
        text = f"{precision}: {rate_text(peak)}"
        line(text, peak / fastest, peak, last, peak, kind="peak", precision=precision)
    return lines
