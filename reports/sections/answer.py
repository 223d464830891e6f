"""What to take: the advisor's answer for each robot, or, without one, what was measured."""

import math

from charts import advice as advice_charts
from charts.common import SCENE, TOLERANCE, VIEW, Style
from charts.ladder import tolerance_name
from charts.text import sentence, task_text, time_text, tolerance_text
from page.section import Answer, Choice, Figure, Section
from read.advice import ADVISED, Advice, Contender, Limits, Pick
from read.data import Data, scene_name
from read.ladder import is_ladder
from sections import advice_tables
from sections.advice_tables import TITLE
from sections.fragment import fragment
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
        if (tasks := _contenders(robot, advised.get(robot), measured))
    }
    if not robots:
        return None
    tasks = [task for task in ADVISED if any(task in found for found in robots.values())]
    tolerances = sorted({pick.tolerance for it in data.advice for pick in _picks(it)}, reverse=True)
    choices = _choices(list(robots), tasks, tolerances)
    rows = [
        row
        for robot, found in robots.items()
        for task in tasks
        for row in advice_charts.contender_rows(
            robot, task, found.get(task, []), advised.get(robot), limits.get(robot)
        )
    ]
    first = {choice.signal: choice.first for choice in choices}
    answers = [
        answer
        for robot in robots
        for answer in _answers(data, robot, robots[robot], advised.get(robot), limits.get(robot))
    ]
    for answer in answers:
        answer.first = all(first[name] in values for name, values in answer.shown.items())
    return Section(
        TITLE if len(robots) > 1 else f"{TITLE} for {scene_name(next(iter(robots)))}",
        choices=[choice for choice in choices if len(choice.options) > 1],
        answers=answers,
        figures=[_figure(rows, first, tolerances)] if rows else [],
        tables=advice_tables.of_robots(robots, advised, tasks)
        if len(robots) > 1
        else advice_tables.of_tolerances(advised),
        opened=True,
    )


def _choices(robots: list[str], tasks: list[str], tolerances: list[float]) -> list[Choice]:
    choices = [
        Choice(SCENE, "Robot", [(robot, scene_name(robot)) for robot in robots], robots[0]),
        Choice(VIEW, "Task", [(task, task_text(task)) for task in tasks], tasks[0]),
    ]
    if tolerances:
        names = list(map(tolerance_text, tolerances))
        first = min(tolerances, key=lambda it: abs(math.log(it / FIRST_TOLERANCE)))
        choices.append(
            Choice(TOLERANCE, "Error asked for", [(it, it) for it in names], tolerance_text(first))
        )
    return choices


def _figure(rows: list[dict], first: dict[str, str], tolerances: list[float]) -> Figure:
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    stressed = any(row["stressed"] for row in rows)
    notes = [
        "Dot: median error over the states; bar: the largest"
        + ("; diamond: the largest under stress" if stressed else "")
        + ("; ring: what is advised" if tolerances else "")
        + ". Down and to the left is better. Circle: float64, triangle: float32."
    ]
    if stressed:
        notes.append("The scale ends at an error of 10, where nothing is right.")
    return Figure(
        "Worst error beside the median",
        advice_charts.median_and_worst(rows, style, first, tolerances),
        advice_charts.ADVICE_TOOLTIPS,
        notes=notes,
    )


def _contenders(
    robot: str, advice: Advice | None, measured: list[Point]
) -> dict[str, list[Contender]]:
    """By task: the advisor's, or else what was timed and compared with the truth."""
    if advice:
        return advice.contenders
    found = {}
    for task in ADVISED:
        own = [
            Contender(
                *(point.variant, point.precision, point.time, point.median, point.worst),
                *(None, point.failures, 0),
            )
            for point in measured
            if (point.scene, point.task, point.measure) == (robot, task, "relative")
            and point.time is not None
            and point.median is not None
        ]
        if own:
            found[task] = own
    return found


def _picks(advice: Advice) -> list[Pick]:
    return [pick for picks in advice.picks.values() for pick in picks]


def _answers(
    data: Data,
    robot: str,
    contenders: dict[str, list[Contender]],
    advice: Advice | None,
    limits: Limits | None,
) -> list[Answer]:
    notes = {
        sentence(note)
        for record in data.mujoco
        if record["scene"] == robot
        for note in record["notes"]
    }
    said = [sentence(limits.sentence)] if limits else []
    if not advice:
        return [
            Answer([NO_ADVICE, *said, *sorted(notes)], leads=True, shown={SCENE: [robot]}),
            *_measured(robot, contenders),
        ]
    return [
        Answer(
            [sentence(advice.sentence), *said, *sorted(notes)], leads=True, shown={SCENE: [robot]}
        ),
        *(
            answer
            for task, picks in advice.picks.items()
            for answer in _picked(advice, task, picks)
        ),
    ]


def _picked(advice: Advice, task: str, picks: list[Pick]) -> list[Answer]:
    """A sentence a tolerance; numbers and code once for all that the same is picked for."""
    own = {SCENE: [advice.robot], VIEW: [task]}
    answers = [
        Answer([_said(pick)], shown=own | {TOLERANCE: [tolerance_text(pick.tolerance)]})
        for pick in picks
    ]
    for pick in dict.fromkeys(pick._replace(tolerance=0, enough=True, reason="") for pick in picks):
        tolerances = [tolerance_text(it.tolerance) for it in picks if it[1:6] == pick[1:6]]
        digits = f"{_digits(pick.predicted)} predicted, {_digits(pick.worst)} at worst"
        numbers = [
            _taken(pick),
            (f"Digits, of {advice.states} states", digits),
            ("Time of a state", time_text(pick.nanoseconds)),
        ]
        name = scene_name(advice.robot)
        file = advice.file or f"{name}.xml"
        code = fragment(name, file, advice.load_options, task, pick.variant, pick.precision)
        answers.append(Answer([], numbers, code, shown=own | {TOLERANCE: tolerances}))
    return answers


def _taken(pick: Pick) -> tuple[str, str]:
    """A tolerance and a precision of Dynamics; older runs were advised other variants too."""
    if is_ladder(pick.variant):
        return "Tolerance", f"{tolerance_name(pick.variant)}, {pick.precision}"
    return "Variant", f"{pick.variant}, {pick.precision}"


def _said(pick: Pick) -> str:
    warning = f"Nothing is predicted to be within {tolerance_text(pick.tolerance)}. "
    return ("" if pick.enough else warning) + sentence(pick.reason)


def _measured(robot: str, contenders: dict[str, list[Contender]]) -> list[Answer]:
    """The fastest of each precision among those that failed on no state; no advice."""
    answers = []
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
        answers.append(Answer([], numbers, code, shown={SCENE: [robot], VIEW: [task]}))
    return answers


def _digits(error: float | None) -> str:
    if error is None:
        return "none"
    return "all" if error == 0 else f"{max(-math.log10(error), 0):.1f}"
