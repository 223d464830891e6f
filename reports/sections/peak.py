"""Floating-point operations a second of our calls, as a share of what one core does in a loop of
fused multiply-adds on registers alone, measured in the same run ({peaks}). What cannot be fused
stays below it, and so does a call that has too little to do alike to fill the vector units: one
state, mostly. Sines and cosines take time but are not counted; what long chains do in tiles is
counted by formula.
"""

from charts import roofline as roofline_charts
from charts import variants as variant_charts
from charts.common import VIEW
from charts.roofline import ROBOT
from charts.text import (
    bytes_text,
    rate_text,
    share_text,
    task_rank,
    task_text,
    thousands_text,
    three_digits,
    time_text,
)
from page.section import Choice, Section, first_of, left, right
from read.data import Call, Data, scene_name, scene_size
from sections.common import from_to, style_of
from summary.groups import by_key
from summary.roofline import MEMORY, Placed, placed

NO_ROOFLINE = """
A roofline is not drawn, since bytes of a call or the bandwidth of memory are not recorded: N takes
its place, and with N grows the memory that a call goes through.
"""
ROOFLINE = """
The roofline sets the same rates against operations a byte: a call has to read what it is given and
to write its result, once, and does not do that faster than a copy of arrays as large. Its roof is
the lower one of the peak and of this bandwidth times its operations a byte; memory bounds a call on
the left of where both meet, arithmetic one on the right. Bandwidth is that of a copy on one thread,
read and written bytes together, by the size of the arrays: small ones lie in a cache. What a call
keeps for itself, and the model, are not counted.
"""


def section(data: Data) -> Section | None:
    rows = [_row(call) for call in data.peers if call.rate and call.peak]
    if not rows:
        return None
    on_roofline = sorted(placed(data), key=_rank)
    page = Section(
        "How near the machine’s peak",
        [__doc__.format(peaks=_peaks(data.peers)), ROOFLINE if on_roofline else NO_ROOFLINE],
        style_of(rows),
    )
    if on_roofline:
        page.say(_bounds(on_roofline))
        robots = Choice(ROBOT, "Scene", dict.fromkeys(it.call.time.scene for it in on_roofline))
        page.figure(
            "roofline",
            roofline_charts.roofline(on_roofline, page.style, first_of([robots])),
            roofline_charts.TOOLTIPS,
            [robots],
            """Of each task and precision our fastest call. ∂a are the derivatives of a with respect
            to q, q̇ and τ; × 1024: so many states in one call. A dotted line leads from a call to
            its own roof; the slanted lines are the smallest and the largest arrays that were
            copied.""",
        )
    views = Choice(VIEW, "Task", sorted({row["view"] for row in rows}, key=task_rank), task_text)
    chart = variant_charts.share_of_peak(rows, page.style, first_of([views]))
    page.figure("share of the peak", chart, variant_charts.PEAK_TOOLTIPS, [views])
    page.table(
        """Share of the roof: our fastest call of each task. Operations and bytes are those of a
        state, arrays those of the call.""",
        [
            left("Scene:N", "call.time.scene"),
            left("Call", roofline_charts.label),
            left("Precision", "call.time.precision"),
            right("Share", "share", share_text),
            left("Bound by", "bound"),
            right("Rate [GFLOP/s]", "call.rate", _billions),
            right("Roof [GFLOP/s]", "roof", _billions),
            right("Operations a byte", "intensity", three_digits),
            right("Operations", "call.flops", thousands_text),
            right("Bytes", "call.bytes", thousands_text),
            right("Arrays", "arrays", bytes_text),
            right("Bandwidth [GB/s]", "copy.rate", _billions),
            left("Variant", "call.time.variant"),
        ],
        on_roofline,
        folded=True,
    )
    return page


def _rank(it: Placed):
    time = it.call.time
    return scene_size(time.scene), time.scene, task_rank(time.task), time.precision


def _bounds(on_roofline: list[Placed]) -> str:
    by_memory = [it for it in on_roofline if it.bound == MEMORY]
    total = len(on_roofline)
    if not by_memory:
        return f"Arithmetic is the lower roof of all {total} calls of the roofline."
    calls = [f"{roofline_charts.label(it)} of {it.call.time.scene}" for it in by_memory]
    return (
        f"Memory is the lower roof of {len(by_memory)} of {total} calls of the roofline: "
        f"{', '.join(dict.fromkeys(calls))}."
    )


def _billions(rate: float) -> str:
    return three_digits(rate / 1e9)


def _peaks(calls: list[Call]) -> str:
    """The least and the greatest of the files that this run consists of."""
    texts = []
    for precision, own in sorted(by_key(calls, lambda call: call.time.precision).items()):
        if peaks := [call.peak for call in own if call.peak]:
            texts.append(f"{from_to(peaks, rate_text)} in {precision}")
    return ", ".join(texts)


def _row(call: Call) -> dict:
    time = call.time
    return {
        "scene": time.scene,
        "name": scene_name(time.scene),
        "n": scene_size(time.scene),
        "variant": time.variant,
        "precision": time.precision,
        "view": time.task,
        "share": call.rate / call.peak,
        "share_text": share_text(call.rate / call.peak),
        "rate": rate_text(call.rate),
        "peak": rate_text(call.peak),
        "flops": f"{call.flops:.0f}" if call.flops else "–",
        "time_text": time_text(time.nanoseconds),
    }
