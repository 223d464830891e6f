"""How near our calls come to what the machine's arithmetic and memory allow."""

from collections import defaultdict

from charts import roofline as roofline_charts
from charts import variants as variant_charts
from charts.common import VIEW, Style
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
from page.section import Choice, Figure, Section, Table
from read.data import Call, Data, scene_name, scene_size
from summary.roofline import MEMORY, Placed, placed


def section(data: Data) -> Section | None:
    rows = [_row(call) for call in data.peers if call.rate and call.peak]
    if not rows:
        return None
    on_roofline = sorted(placed(data), key=_rank)
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    tasks = sorted({row["view"] for row in rows}, key=task_rank)
    views = Choice(VIEW, "Task", [(task, task_text(task)) for task in tasks], tasks[0])
    share_of_peak = Figure(
        "share of the peak",
        variant_charts.share_of_peak(rows, style, {VIEW: views.first}),
        variant_charts.PEAK_TOOLTIPS,
        choices=[views],
    )
    return Section(
        "How near the machine’s peak",
        [
            "Floating-point operations a second of our calls, as a share of what one core does in "
            "a loop of fused multiply-adds on registers alone, measured in the same run "
            f"({_peaks(data.peers)}). What cannot be fused stays below it, and so does a call "
            "that has too little to do alike to fill the vector units: one state, mostly. Sines "
            "and cosines take time but are not counted; what long chains do in tiles is counted by "
            "formula.",
            _of_memory(on_roofline),
        ],
        statements=_statements(on_roofline),
        variants=style.variants,
        precisions=style.precisions,
        figures=[*([_roofline(on_roofline, style)] if on_roofline else []), share_of_peak],
        tables=[_table(on_roofline)] if on_roofline else [],
    )


def _rank(it: Placed):
    time = it.call.time
    return scene_size(time.scene), time.scene, task_rank(time.task), time.precision


def _of_memory(on_roofline: list[Placed]) -> str:
    if not on_roofline:
        return (
            "A roofline is not drawn, since bytes of a call or the bandwidth of memory are not "
            "recorded: N takes its place, and with N grows the memory that a call goes through."
        )
    return (
        "The roofline sets the same rates against operations a byte: a call has to read what it "
        "is given and to write its result, once, and does not do that faster than a copy of "
        "arrays as large. Its roof is the lower one of the peak and of this bandwidth times its "
        "operations a byte; memory bounds a call on the left of where both meet, arithmetic one "
        "on the right. Bandwidth is that of a copy on one thread, read and written bytes "
        "together, by the size of the arrays: small ones lie in a cache. What a call keeps for "
        "itself, and the model, are not counted."
    )


def _statements(on_roofline: list[Placed]) -> list[str]:
    if not on_roofline:
        return []
    by_memory = [it for it in on_roofline if it.bound == MEMORY]
    total = len(on_roofline)
    if not by_memory:
        return [f"Arithmetic is the lower roof of all {total} calls of the roofline."]
    calls = [f"{roofline_charts.label(it)} of {it.call.time.scene}" for it in by_memory]
    return [
        f"Memory is the lower roof of {len(by_memory)} of {total} calls of the roofline: "
        f"{', '.join(dict.fromkeys(calls))}."
    ]


def _roofline(on_roofline: list[Placed], style: Style) -> Figure:
    scenes = list(dict.fromkeys(it.call.time.scene for it in on_roofline))
    robots = Choice(ROBOT, "Scene", [(scene, scene) for scene in scenes], scenes[0])
    return Figure(
        "roofline",
        roofline_charts.roofline(on_roofline, style, {ROBOT: robots.first}),
        roofline_charts.TOOLTIPS,
        choices=[robots],
        notes=[
            "Of each task and precision our fastest call. ∂a are the derivatives of a with respect "
            "to q, q̇ and τ; × 1024: so many states in one call. A dotted line leads from a "
            "call to its own roof; the slanted lines are the smallest and the largest arrays that "
            "were copied."
        ],
    )


def _table(on_roofline: list[Placed]) -> Table:
    columns = (
        "Scene:N,Call,Precision,Share,Bound by,Rate [GFLOP/s],Roof [GFLOP/s],"
        "Operations a byte,Operations,Bytes,Arrays,Bandwidth [GB/s],Variant"
    ).split(",")
    rows = [
        [
            it.call.time.scene,
            roofline_charts.label(it),
            it.call.time.precision,
            share_text(it.share),
            it.bound,
            three_digits(it.call.rate / 1e9),
            three_digits(it.roof / 1e9),
            three_digits(it.intensity),
            thousands_text(it.call.flops),
            thousands_text(it.call.bytes),
            bytes_text(it.arrays),
            three_digits(it.copy.rate / 1e9),
            it.call.time.variant,
        ]
        for it in on_roofline
    ]
    return Table(
        "Share of the roof: our fastest call of each task. Operations and bytes are those of a "
        "state, arrays those of the call.",
        columns,
        rows,
        "lllrl" + "r" * 7 + "l",
        folded=True,
    )


def _peaks(calls: list[Call]) -> str:
    """The least and the greatest of the files that this run consists of."""
    peaks = defaultdict(list)
    for call in calls:
        if call.peak:
            peaks[call.time.precision].append(call.peak)
    texts = []
    for precision, rates in sorted(peaks.items()):
        ends = dict.fromkeys(map(rate_text, (min(rates), max(rates))))
        texts.append(f"{' to '.join(ends)} in {precision}")
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
