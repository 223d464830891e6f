"""What to take: the advisor's answer for each robot, or, without one, what was measured."""

import math

from charts import advice as advice_charts
from charts.common import SCENE, TOLERANCE, VIEW
from charts.ladder import tolerance_name
from charts.text import sentence, task_text, time_text, tolerance_text
from page.section import Section
from read.advice import ADVISED, Advice, Contender, Limits, Pick
from read.data import Data, scene_name
from read.ladder import is_ladder
from sections import advice_tables
from sections.advice_tables import TITLE
from sections.common import style_of
from sections.fragment import fragment
from summary.groups import by_key
from summary.points import Point, points

FIRST_TOLERANCE = 1e-5
NO_ADVICE = (
    "No advice was recorded for this robot; run recommend, or scripts/report anew. Below is what "
    "was measured."
)


def section(data: Data) -> Section | None:
    advised = {it.robot: it for it in data.advice}
    limits = {it.robot: it for it in data.limits}
    measured = points(data)
    robots = {
        robot: tasks
        for robot in data.robots
        if (tasks := advised[robot].contenders if robot in advised else _timed(robot, measured))
    }
    if not robots:
        return None
    tasks = [task for task in ADVISED if any(task in found for found in robots.values())]
    picks = [pick for it in data.advice for own in it.picks.values() for pick in own]
    tolerances = sorted({pick.tolerance for pick in picks}, reverse=True)
    names = {tolerance_text(tolerance): tolerance for tolerance in tolerances}
    near = min(names, key=lambda it: abs(math.log(names[it] / FIRST_TOLERANCE)), default="")
    several = len(robots) > 1
    page = Section(
        TITLE if several else f"{TITLE} for {scene_name(next(iter(robots)))}", opened=True
    )
    page.choose(SCENE, "Robot", robots, scene_name)
    page.choose(VIEW, "Task", tasks, task_text)
    page.choose(TOLERANCE, "Error asked for", names, first=near)
    for robot, found in robots.items():
        _said(page, data, robot, advised.get(robot), limits.get(robot))
        if robot in advised:
            _picked(page, advised[robot])
        else:
            _measured(page, robot, found)
    rows = [
        row
        for robot, found in robots.items()
        for task in tasks
        for row in advice_charts.contender_rows(
            robot, task, found.get(task, []), advised.get(robot), limits.get(robot)
        )
    ]
    if rows:
        _draw(page, rows, tolerances)
    if not several:
        advice_tables.of_tolerances(page, advised)
    for task in tasks if several else ():
        if advised:
            advice_tables.advised_of_robots(page, robots, advised, task)
        else:
            advice_tables.measured_of_robots(page, robots, task)
    return page


def _draw(page: Section, rows: list[dict], tolerances: list[float]) -> None:
    stressed = any(row["stressed"] for row in rows)
    diamond = "; diamond: the largest under stress" if stressed else ""
    ring = "; ring: what is advised" if tolerances else ""
    page.figure(
        "Worst error beside the median",
        advice_charts.median_and_worst(rows, style_of(rows), page.first, tolerances),
        advice_charts.ADVICE_TOOLTIPS,
        notes=f"""
        Dot: median error over the states; bar: the largest{diamond}{ring}. Down and to the left is
        better. Circle: float64, triangle: float32.

        {"The scale ends at an error of 10, where nothing is right." if stressed else ""}
        """,
    )


def _timed(robot: str, measured: list[Point]) -> dict[str, list[Contender]]:
    """By task: what was timed and compared with the truth."""
    found = [
        point
        for point in measured
        if (point.scene, point.measure) == (robot, "relative")
        and point.task in ADVISED
        and None not in (point.time, point.median)
    ]
    return {
        task: [
            Contender(it.variant, it.precision, it.time, it.median, it.worst, None, it.failures, 0)
            for it in own
        ]
        for task, own in by_key(found, lambda point: point.task).items()
    }


def _said(
    page: Section, data: Data, robot: str, advice: Advice | None, limits: Limits | None
) -> None:
    records = [record for record in data.mujoco if record["scene"] == robot]
    notes = {sentence(note) for record in records for note in record["notes"]}
    said = [sentence(advice.sentence) if advice else NO_ADVICE]
    said += [sentence(limits.sentence)] if limits else []
    page.answer([*said, *sorted(notes)], leads=True, shown={SCENE: [robot]})


def _picked(page: Section, advice: Advice) -> None:
    """A sentence a tolerance; numbers and code once for all that the same is picked for."""
    name = scene_name(advice.robot)
    for task, picks in advice.picks.items():
        own = {SCENE: [advice.robot], VIEW: [task]}
        for pick in picks:
            asked = tolerance_text(pick.tolerance)
            warning = "" if pick.enough else f"Nothing is predicted to be within {asked}. "
            page.answer([warning + sentence(pick.reason)], shown=own | {TOLERANCE: [asked]})
        for same in by_key(picks, lambda pick: pick[1:6]).values():
            pick = same[0]
            digits = f"{_digits(pick.predicted)} predicted, {_digits(pick.worst)} at worst"
            numbers = [
                _taken(pick),
                (f"Digits, of {advice.states} states", digits),
                ("Time of a state", time_text(pick.nanoseconds)),
            ]
            file = advice.file or f"{name}.xml"
            code = fragment(name, file, advice.load_options, task, pick.variant, pick.precision)
            asked = [tolerance_text(pick.tolerance) for pick in same]
            page.answer([], numbers, code, shown=own | {TOLERANCE: asked})


def _taken(pick: Pick) -> tuple[str, str]:
    """A tolerance and a precision of Dynamics; older runs were advised other variants too."""
    if is_ladder(pick.variant):
        return "Tolerance", f"{tolerance_name(pick.variant)}, {pick.precision}"
    return "Variant", f"{pick.variant}, {pick.precision}"


def _measured(page: Section, robot: str, contenders: dict[str, list[Contender]]) -> None:
    """The fastest of each precision among those that failed on no state; no advice."""
    for task, found in contenders.items():
        best = advice_tables.fastest(found)
        if not best:
            continue
        numbers = [
            (
                f"Fastest in {precision}",
                f"{it.variant}: {time_text(it.nanoseconds)}, {_digits(it.worst)} digits at worst",
            )
            for precision, it in best.items()
        ]
        name = scene_name(robot)
        precision, fastest = next(iter(best.items()))
        code = fragment(name, f"{name}.xml", "", task, fastest.variant, precision)
        page.answer([], numbers, code, shown={SCENE: [robot], VIEW: [task]})


def _digits(error: float | None) -> str:
    if error is None:
        return "none"
    return "all" if error == 0 else f"{max(-math.log10(error), 0):.1f}"
