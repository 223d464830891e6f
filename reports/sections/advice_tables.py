"""The tables of advice: robots by what is advised, one robot by the error asked for."""

from urllib.parse import urlencode

from markupsafe import Markup

from charts.common import SCENE, VIEW
from charts.text import error_text, task_text, time_text, tolerance_text
from page.section import Column, Section, left, of, right, slug
from read.advice import Advice, Contender
from read.data import scene_name, scene_size
from sections.common import SERIES

TITLE = "What to take"  # of the section
TABLED = (1e-5, 1e-9)  # tolerances of the table of robots
ERRORS = [right("Predicted", "predicted", error_text), right("Worst", "worst", error_text)]
TIME = right("Time", "nanoseconds", time_text)


def _link(robot: str) -> Markup:
    address = f"#{slug(TITLE)}?{urlencode({SCENE: robot})}"
    return Markup('<a href="{}">{}</a>').format(address, scene_name(robot))


ROBOT = [left("Robot", _link), right("DoF", scene_size)]


def advised_of_robots(page: Section, robots: dict, advised: dict, task: str) -> None:
    """A row a robot: what is advised at two tolerances."""
    picks = {
        (robot, pick.tolerance): pick
        for robot, advice in advised.items()
        for pick in advice.picks.get(task, [])
    }

    def columns(tolerance: float) -> list[Column]:
        return of(
            lambda robot: picks.get((robot, tolerance)),
            left(f"Variant for {tolerance_text(tolerance)}", "variant"),
            left("Precision", lambda it: it.precision + ("" if it.enough else ", not enough")),
            *ERRORS,
            TIME,
        )

    page.table(
        f"""{task_text(task)}: what is advised for errors of
        {" and ".join(map(tolerance_text, TABLED))}; the error predicted, the largest over the
        states, and the median time. A robot's name shows its answer.""",
        [*ROBOT, *map(columns, TABLED)],
        robots,
        shown={VIEW: task},
    )


def measured_of_robots(page: Section, robots: dict, task: str) -> None:
    """A row a robot: the fastest that was measured."""
    best = {robot: fastest(found.get(task, [])) for robot, found in robots.items()}
    precisions = sorted({name for found in best.values() for name in found}, reverse=True)

    def columns(precision: str) -> list[Column]:
        return of(
            lambda robot: best[robot].get(precision),
            left(f"{precision}: fastest", "variant"),
            ERRORS[1],
            TIME,
        )

    page.table(
        f"""{task_text(task)}: the fastest that was measured, with the largest error over the
        states; this run has no advice. A robot's name shows its answer.""",
        [*ROBOT, *map(columns, precisions)],
        robots,
        shown={VIEW: task},
    )


def of_tolerances(page: Section, advised: dict[str, Advice]) -> None:
    """Of one robot: what is advised for every tolerance."""
    for advice in advised.values():
        for task, picks in advice.picks.items():
            page.table(
                f"{task_text(task)}: what is advised for every error",
                [
                    left("Error asked for", "tolerance", tolerance_text),
                    SERIES,
                    *ERRORS,
                    TIME,
                    left("Enough", lambda pick: "yes" if pick.enough else "no"),
                ],
                picks,
                folded=True,
            )


def fastest(contenders: list[Contender]) -> dict[str, Contender]:
    """By precision, the widest first."""
    found = {}
    for it in sorted((it for it in contenders if not it.failures), key=lambda it: it.nanoseconds):
        found.setdefault(it.precision, it)
    return dict(sorted(found.items(), reverse=True))
