"""The first figure: error against run time of the ladder at its tolerances, robot by robot."""

from charts import ladder as ladder_charts
from charts.common import SCENE, VIEW, Style, view
from charts.text import error_text, task_text, time_text
from page.section import Choice, Figure, Section, Table
from read.data import Data, scene_name
from read.ladder import DEFAULT, is_ladder
from summary.points import Point, points

FIRST = "panda"
TASKS = {  # and what others answer in their place
    "acceleration": "acceleration",
    "acceleration_batch": "acceleration",
    "inverse": "inverse",
    "inverse_batch": "inverse",
}
SHORT = {
    "acceleration": "a",
    "acceleration_batch": "a in batches",
    "inverse": "M⁻¹",
    "inverse_batch": "M⁻¹ in batches",
}
TITLE = "The ladder: error against run time"


def section(data: Data) -> Section | None:
    found = _found(data)
    robots = list(dict.fromkeys(robot for robot, _ in found))
    if not robots:
        return None
    tasks = [task for task in TASKS if any(task == of for _, of in found)]
    first = next((robot for robot in robots if scene_name(robot) == FIRST), robots[0])
    choices = [
        Choice(SCENE, "Robot", [(robot, scene_name(robot)) for robot in robots], first),
        Choice(
            VIEW,
            "Show",
            [(view(task, "relative"), task_text(task)) for task in tasks],
            view(tasks[0], "relative"),
        ),
    ]
    style = Style([DEFAULT], (point.precision for own in found.values() for point in own))
    drawn = [row for (_, task), own in found.items() for row in ladder_charts.rows(own, task)]
    shown = {choice.signal: choice.first for choice in choices}
    return Section(
        TITLE if len(robots) > 1 else f"{TITLE} for {scene_name(first)}",
        [
            "Each coloured mark is Dynamics at a tolerance: the first precision whose estimated "
            "error is within it answers. Tolerances that one precision answers alike share a "
            "label. Grey are the other variants. Down and to the left is better.",
        ],
        choices=[choice for choice in choices if len(choice.options) > 1],
        coloured=style.variants,
        figures=[
            Figure(
                "at each tolerance",
                ladder_charts.error_against_time(drawn, style, shown),
                ladder_charts.LADDER_TOOLTIPS,
                notes=[
                    "Circle: float64, triangle: float32. One state of Dynamics<float> is answered in "
                    "float64 and rounded; lanes of float32 are for batches. In batches the other "
                    "variants answer one state after another."
                ],
            )
        ],
        tables=[_table(robot, found, tasks, robot == first) for robot in robots],
        opened=True,
    )


def _found(data: Data) -> dict[tuple[str, str], list[Point]]:
    """By robot and task what has both an error and a time: the ladder at more than one tolerance,
    and the others."""
    robots = set(data.robots)
    calls = [call.time for call in data.dynamics]
    measured = Data(
        errors=[
            row
            for row in data.errors + data.ladder_errors
            if row.scene in robots and row.measure == "relative"
        ],
        times=calls + data.times + data.ladder_times,  # the last counts
    )
    whole = [it for it in points(measured) if it.time is not None and it.median is not None]
    found = {}
    for robot in data.robots:
        own = [it for it in whole if it.scene == robot]
        for task, others in TASKS.items():
            ladder = [it for it in own if it.task == task and is_ladder(it.variant)]
            if len({it.variant for it in ladder}) < 2:
                continue
            found[robot, task] = ladder + [
                it for it in own if it.task == others and not is_ladder(it.variant)
            ]
    return found


def _table(robot: str, found: dict, tasks: list[str], first: bool) -> Table:
    by_series = {
        (task, point.variant, point.precision): point
        for task in tasks
        for point in found.get((robot, task), [])
        if is_ladder(point.variant)
    }
    series = dict.fromkeys(
        (point.precision, point.variant)
        for point in sorted(
            by_series.values(), key=lambda it: (it.precision, ladder_charts.by_tolerance(it))
        )
    )
    rows = []
    for precision, variant in series:
        row = [precision, ladder_charts.tolerance_name(variant)]
        for task in tasks:
            point = by_series.get((task, variant, precision))
            row += [time_text(point.time), error_text(point.median)] if point else ["–", "–"]
        rows.append(row)
    return Table(
        f"{scene_name(robot)}: median time of a state and median relative error, by tolerance",
        ["Precision", "Tolerance"]
        + [f"{SHORT[task]}: {what}" for task in tasks for what in ("time", "error")],
        rows,
        "ll" + "rr" * len(tasks),
        shown={SCENE: robot},
        first=first,
    )
