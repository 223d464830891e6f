"""The tables of advice: robots by what is advised, one robot by the error asked for."""

from urllib.parse import urlencode

from markupsafe import Markup

from charts.common import SCENE, VIEW
from charts.text import error_text, task_text, time_text, tolerance_text
from page.section import Table, slug
from read.advice import Advice, Contender
from read.data import scene_name, scene_size

TITLE = "What to take"  # of the section
TABLED = (1e-5, 1e-9)  # tolerances of the table of robots


def _link(robot: str) -> Markup:
    address = f"#{slug(TITLE)}?{urlencode({SCENE: robot})}"
    return Markup('<a href="{}">{}</a>').format(address, scene_name(robot))


def of_robots(robots: dict, advised: dict[str, Advice], tasks: list[str]) -> list[Table]:
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
            enough = "" if pick.enough else ", not enough"
            row += [pick.variant, pick.precision + enough]
            row += [error_text(pick.predicted), error_text(pick.worst), time_text(pick.nanoseconds)]
        rows.append(row)
    names = [
        f"{name} for {tolerance_text(tolerance)}" if not i else name
        for tolerance in TABLED
        for i, name in enumerate(("Variant", "Precision", "Predicted", "Worst", "Time"))
    ]
    return Table(
        f"{task_text(task)}: what is advised for errors of "
        f"{' and '.join(map(tolerance_text, TABLED))}; the error predicted, the largest over the "
        "states, and the median time. A robot's name shows its answer.",
        ["Robot", "DoF", *names],
        rows,
        "lr" + "llrrr" * len(TABLED),
        shown={VIEW: task},
        first=first,
    )


def _measured_table(robots: dict, _, task: str, first: bool) -> Table:
    best = {robot: fastest(found.get(task, [])) for robot, found in robots.items()}
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


def of_tolerances(advised: dict[str, Advice]) -> list[Table]:
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


def fastest(contenders: list[Contender]) -> dict[str, Contender]:
    """By precision, the widest first."""
    sound = [it for it in contenders if not it.failures]
    return {
        precision: min(
            (it for it in sound if it.precision == precision), key=lambda it: it.nanoseconds
        )
        for precision in sorted({it.precision for it in sound}, reverse=True)
    }
