"""The fast path: one state and batches, forward dynamics against the plain variant."""

from charts.text import task_rank, task_text
from page.section import Column, Section, left, of, right
from read.data import Data, Time, scene_size
from sections.common import SERIES, Group, call_text, groups, ratio
from sections.method import timed_calls

PLAIN = "Sequential<Conventional>"
ONE_STATE = "acceleration"


def section(data: Data) -> Section | None:
    if not data.dynamics:
        return None
    times = {call.time[:4]: call.time for call in data.dynamics}

    def columns(task: str) -> list[Column]:
        def time(it: Group) -> Time | None:
            return times.get((it.scene, it.variant, it.precision, task))

        def speed_up(it: Group) -> float | None:
            plain, own = times.get((it.scene, PLAIN, it.precision, ONE_STATE)), time(it)
            return plain and own and ratio(plain.nanoseconds, own.nanoseconds)

        found = of(time, right(task_text(task), call_text))
        if task.startswith(ONE_STATE):
            found.append(right("Speed-up", speed_up, "{:.1f}".format))
        return found

    def plain_first(it: Group) -> tuple:
        return scene_size(it.scene), it.scene, it.variant != PLAIN, it.variant, it.precision

    series = groups(times.values(), "scene", "variant", "precision")
    page = Section("The fast path")
    page.say(*timed_calls(data.dynamics_contexts))
    page.table(
        f"""Median times, on one core but where an @ says all. Speed-up: how many times faster than
        one state of {PLAIN} in the same precision. Refused: the result was wrong or singular.""",
        [
            left("Scene:N", "scene"),
            SERIES,
            map(columns, sorted({key[3] for key in times}, key=task_rank)),
        ],
        sorted(series, key=plain_first),
    )
    return page
