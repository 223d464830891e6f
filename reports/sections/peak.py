"""How near our calls come to the peak of the machine's arithmetic."""

from collections import defaultdict

from charts import variants as variant_charts
from charts.common import VIEW, Style
from charts.text import rate_text, share_text, task_rank, task_text, time_text
from page.section import Choice, Figure, Section
from read.data import Call, Data, scene_name, scene_size


def section(data: Data) -> Section | None:
    rows = [_row(call) for call in data.peers if call.rate and call.peak]
    if not rows:
        return None
    tasks = sorted({row["view"] for row in rows}, key=task_rank)
    views = Choice(VIEW, "Task", [(task, task_text(task)) for task in tasks], tasks[0])
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    return Section(
        "How near the machine’s peak",
        [
            "Floating-point operations a second of our calls, as a share of what one core does in "
            "a loop of fused multiply-adds on registers alone, measured in the same run "
            f"({_peaks(data.peers)}). What cannot be fused stays below it, and so does a call "
            "that has too little to do alike to fill the vector units: one state, mostly. Sines "
            "and cosines take time but are not counted.",
            "A roofline’s other axis, operations a byte, is not drawn, since bytes are not "
            "recorded: N takes its place, and with N grows the memory that a call goes through.",
        ],
        choices=[views],
        variants=style.variants,
        precisions=style.precisions,
        figures=[
            Figure(
                "share of the peak",
                variant_charts.share_of_peak(rows, style, {VIEW: views.first}),
                variant_charts.PEAK_TOOLTIPS,
            )
        ],
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
