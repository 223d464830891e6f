"""What to take: the advisor's answer for each robot, or, without one, what was measured."""

import math
from urllib.parse import urlencode

from markupsafe import Markup

import advice_figures
from advice import ADVISED, Advice, Contender, Limits, Pick
from advice_figures import TOLERANCE
from charts import SCENE, VIEW, Style
from data import Data, scene_name, scene_size
from fragment import fragment
from section import Answer, Choice, Figure, Section, Table, slug
from summary import Point, points
from text import error_text, task_text, time_text, tolerance_text

TITLE = "What to take"
FIRST_TOLERANCE = 1e-5
TABLED = (1e-5, 1e-9)  # tolerances of the table of robots
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
        for row in advice_figures.contender_rows(
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
        answer.first = all(
            first[name] in values for name, values in answer.shown.items()
        )
    return Section(
        TITLE if len(robots) > 1 else f"{TITLE} for {scene_name(next(iter(robots)))}",
        choices=[choice for choice in choices if len(choice.options) > 1],
        answers=answers,
        figures=[_figure(rows, first, tolerances)] if rows else [],
        tables=_tables(robots, advised, tasks) if len(robots) > 1 else _picked(advised),
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
        advice_figures.median_and_worst(rows, style, first, tolerances),
        advice_figures.ADVICE_TOOLTIPS,
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
        note[:1].upper() + note[1:] + "."
        for record in data.mujoco
        if record["scene"] == robot
        for note in record["notes"]
    }
    said = [limits.sentence] if limits else []
    if not advice:
        return [
            Answer([NO_ADVICE, *said, *sorted(notes)], shown={SCENE: [robot]}),
            *_measured(robot, contenders),
        ]
    return [
        Answer([advice.sentence, *said, *sorted(notes)], shown={SCENE: [robot]}),
        *(
            _picked_answer(advice, task, pick)
            for task, picks in advice.picks.items()
            for pick in picks
        ),
    ]


def _picked_answer(advice: Advice, task: str, pick: Pick) -> Answer:
    digits = [f"{_digits(pick.predicted)} predicted", f"{_digits(pick.worst)} at worst"]
    return Answer(
        [pick.reason],
        [
            ("Variant", f"{pick.variant}, {pick.precision}"),
            (f"Digits, of {advice.states} states", ", ".join(digits)),
            ("Time of a call", time_text(pick.nanoseconds)),
            *([] if pick.enough else [("Enough", "no")]),
        ],
        fragment(scene_name(advice.robot), task, pick.variant, pick.precision),
        {SCENE: [advice.robot], VIEW: [task], TOLERANCE: [tolerance_text(pick.tolerance)]},
    )


def _measured(robot: str, contenders: dict[str, list[Contender]]) -> list[Answer]:
    """The fastest of each precision among those that failed on no state; no advice."""
    answers = []
    for task, found in contenders.items():
        best = _fastest(found)
        if not best:
            continue
        numbers = [
            (
                f"Fastest in {precision}",
                f"{it.variant}: {time_text(it.nanoseconds)}, {_digits(it.worst)} digits at worst",
            )
            for precision, it in best.items()
        ]
        code = fragment(scene_name(robot), task, next(iter(best.values())).variant, next(iter(best)))
        answers.append(Answer([], numbers, code, {SCENE: [robot], VIEW: [task]}))
    return answers


def _fastest(contenders: list[Contender]) -> dict[str, Contender]:
    """By precision, the widest first."""
    sound = [it for it in contenders if not it.failures]
    return {
        precision: min(
            (it for it in sound if it.precision == precision), key=lambda it: it.nanoseconds
        )
        for precision in sorted({it.precision for it in sound}, reverse=True)
    }


def _digits(error: float | None) -> str:
    if error is None:
        return "none"
    return "all" if error == 0 else f"{max(-math.log10(error), 0):.1f}"


def _link(robot: str, section: str = slug(TITLE)) -> Markup:
    address = f"#{section}?{urlencode({SCENE: robot})}"
    return Markup('<a href="{}">{}</a>').format(address, scene_name(robot))


def _tables(robots: dict, advised: dict[str, Advice], tasks: list[str]) -> list[Table]:
    """A row a robot: what is advised at two tolerances, or the fastest that was measured."""
    make = _advised_table if advised else _measured_table
    return [table for task in tasks if (table := make(robots, advised, task, task == tasks[0]))]


def _advised_table(robots: dict, advised: dict, task: str, first: bool) -> Table:
    rows = []
    for robot in robots:
        known = advised[robot].picks.get(task, []) if robot in advised else []
        picks = {pick.tolerance: pick for pick in known}
        row = [_link(robot), str(scene_size(robot))]
        for tolerance in TABLED:
            pick = picks.get(tolerance)
            if not pick:
                row += ["–"] * 5
                continue
            row += [pick.variant, pick.precision if pick.enough else f"{pick.precision}, not enough"]
            row += [error_text(pick.predicted), error_text(pick.worst), time_text(pick.nanoseconds)]
        rows.append(row)
    names = [
        f"{name} for {tolerance_text(tolerance)}" if not i else name
        for tolerance in TABLED
        for i, name in enumerate(("Variant", "Precision", "Predicted", "Worst", "Time"))
    ]
    return Table(
        f"{task_text(task)}: what is advised for errors of "
        f"{' and '.join(map(tolerance_text, TABLED))}; the error predicted, the largest over the states, and the median time. A robot's name shows "
        "its answer.",
        ["Robot", "DoF", *names],
        rows,
        "lr" + "llrrr" * len(TABLED),
        shown={VIEW: task},
        first=first,
    )


def _measured_table(robots: dict, _, task: str, first: bool) -> Table:
    best = {robot: _fastest(found.get(task, [])) for robot, found in robots.items()}
    precisions = sorted({name for found in best.values() for name in found}, reverse=True)
    rows = []
    for robot, found in best.items():
        row = [_link(robot), str(scene_size(robot))]
        for precision in precisions:
            it = found.get(precision)
            row += (
                [it.variant, error_text(it.worst), time_text(it.nanoseconds)] if it else ["–"] * 3
            )
        rows.append(row)
    return Table(
        f"{task_text(task)}: the fastest that was measured, with the largest error over the "
        "states; this run has no advice. A robot's name shows its answer.",
        ["Robot", "DoF"]
        + [name for precision in precisions for name in (f"{precision}: fastest", "Worst", "Time")],
        rows,
        "lr" + "lrr" * len(precisions),
        shown={VIEW: task},
        first=first,
    )


def _picked(advised: dict[str, Advice]) -> list[Table]:
    """Of one robot: what is advised for every tolerance."""
    return [
        Table(
            f"{task_text(task)}: what is advised for every error",
            ["Error asked for", "Variant", "Precision", "Predicted", "Worst", "Time", "Enough"],
            [
                [
                    tolerance_text(pick.tolerance),
                    pick.variant,
                    pick.precision,
                    error_text(pick.predicted),
                    error_text(pick.worst),
                    time_text(pick.nanoseconds),
                    "yes" if pick.enough else "no",
                ]
                for pick in picks
            ],
            "lllrrrl",
            folded=True,
        )
        for advice in advised.values()
        for task, picks in advice.picks.items()
    ]
