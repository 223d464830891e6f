"""The fast path: one state and batches, forward dynamics against the plain variant."""

from charts.text import task_rank, task_text, time_text
from page.section import Section, Table
from read.data import Data, scene_size
from sections.method import distinct

PLAIN = "Sequential<Conventional>"
ONE_STATE = "acceleration"


def section(data: Data) -> Section | None:
    if not data.dynamics:
        return None
    times = {call.time[:4]: call.time for call in data.dynamics}
    tasks = sorted({time.task for time in times.values()}, key=task_rank)
    rows = []
    for scene, variant, precision in sorted({key[:3] for key in times}, key=_plain_first):
        plain = times.get((scene, PLAIN, precision, ONE_STATE))
        row = [scene, variant, precision]
        for task in tasks:
            time = times.get((scene, variant, precision, task))
            row += ["refused" if time and time.refused else time_text(time and time.nanoseconds)]
            if not _is_acceleration(task):
                continue
            known = time and time.nanoseconds and plain and plain.nanoseconds
            row += [f"{plain.nanoseconds / time.nanoseconds:.1f}" if known else "–"]
        rows.append(row)
    return Section(
        "The fast path",
        statements=[f"A timed call: {it}" for it in distinct(data.dynamics_contexts, "timed_call")],
        tables=[
            Table(
                "Median times, on one core but where an @ says all. Speed-up: how many times "
                f"faster than one state of {PLAIN} in the same precision. Refused: the result "
                "was wrong or singular.",
                ["Scene:N", "Variant", "Precision"]
                + [
                    cell
                    for task in tasks
                    for cell in [task_text(task), *["Speed-up"] * _is_acceleration(task)]
                ],
                rows,
                "lll" + "".join("rr" if _is_acceleration(task) else "r" for task in tasks),
            )
        ],
    )


def _is_acceleration(task: str) -> bool:
    return task.startswith(ONE_STATE)


def _plain_first(key: tuple[str, str, str]) -> tuple:
    scene, variant, precision = key
    return scene_size(scene), scene, variant != PLAIN, variant, precision
