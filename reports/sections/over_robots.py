"""{robots} robots. A variant answers a robot if it failed on no state and its largest error over
the states is within the error asked for. Times slower: its time over that of the fastest variant
that answers the same robot.

The performance profile gives, for each factor, the share of robots that a variant answers within
that factor of the fastest: at 1 the share on which it is the fastest, at the right end the share
that it answers.
"""

import math

from charts import aggregates as aggregate_charts
from charts.common import TOLERANCE, VIEW
from charts.text import share_text, task_text, three_digits, tolerance_text
from page.section import Section, left, right
from read.advice import ADVISED
from read.data import Data
from sections.common import Group, style_of
from summary.aggregates import geometric_mean, profile, share_answered, slowdowns
from summary.points import Point, points

FEWEST = 3  # robots that are worth a mean
TOLERANCES = (1e-3, 1e-5, 1e-9, 1e-12)
FIRST = 1e-5


def section(data: Data) -> Section | None:
    measured = points(data)
    contests = [
        Group(task=task, tolerance=tolerance_text(tolerance), times=times, ratios=slowdowns(times))
        for task in ADVISED
        for tolerance in TOLERANCES
        if len(times := _times(data.robots, measured, task, tolerance)) >= FEWEST
    ]
    rows = [row for contest in contests for row in _rows(contest)]
    if not rows:
        return None
    robots = {robot for contest in contests for robot in contest.times}
    page = Section("Over all robots", __doc__.format(robots=len(robots)), style_of(rows))
    page.choose(VIEW, "Task", dict.fromkeys(row[VIEW] for row in rows), task_text)
    tolerances = map(tolerance_text, TOLERANCES)
    page.choose(TOLERANCE, "Error asked for", tolerances, first=tolerance_text(FIRST))
    chart = aggregate_charts.performance_profile(rows, page.style, page.first)
    page.figure("performance profile", chart, aggregate_charts.PROFILE_TOOLTIPS)
    for contest in contests:
        _table(page, contest)
    return page


def _times(names: list[str], measured: list[Point], task: str, tolerance: float) -> dict[str, dict]:
    """By robot and series; None where it was timed but does not answer."""
    robots = {robot: {} for robot in names}
    for point in measured:
        if point.scene in robots and (point.task, point.measure) == (task, "relative"):
            if point.time is None or not point.states:
                continue
            answers = not point.failures and point.worst <= tolerance
            robots[point.scene][point.variant, point.precision] = point.time if answers else None
    return {robot: found for robot, found in robots.items() if found}


def _finite(ratios: list[float]) -> list[float]:
    return [ratio for ratio in ratios if math.isfinite(ratio)]


def _rows(contest: Group) -> list[dict]:
    """The corners of each profile, and its end at the right edge."""
    end = max((ratio for own in contest.ratios.values() for ratio in _finite(own)), default=None)
    rows = []
    for (variant, precision), own in contest.ratios.items():
        corners = profile(own)
        for i, (tau, share) in enumerate([*corners, *((end, it[1]) for it in corners[-1:])]):
            rows.append(
                {
                    "scene": f"{len(contest.times)} robots",
                    VIEW: contest.task,
                    TOLERANCE: contest.tolerance,
                    "variant": variant,
                    "precision": precision,
                    "slower": float(f"{tau:.4g}"),
                    "share": share,
                    "share_text": share_text(share),
                    **({"last": 1} if i == len(corners) // 2 else {}),
                }
            )
    return rows


def _table(page: Section, contest: Group) -> None:
    def fastest(_, own: list[float]) -> float:
        return sum(ratio == 1 for ratio in own) / len(contest.times)

    page.table(
        f"""{task_text(contest.task)}, errors up to {contest.tolerance}: share of the robots that
        are answered, share on which it is the fastest, and times slower than the fastest:
        geometric mean and largest, over the robots that it answers""",
        [
            left("Variant", lambda series, _: series[0]),
            left("Precision", lambda series, _: series[1]),
            right("Answered", lambda series, _: share_answered(contest.times, series), share_text),
            right("Fastest", fastest, share_text),
            right("Times slower", lambda _, own: geometric_mean(own), three_digits),
            right("Largest", lambda _, own: max(_finite(own)), three_digits),
        ],
        sorted(
            (it for it in contest.ratios.items() if _finite(it[1])),
            key=lambda it: geometric_mean(it[1]),
        ),
        shown={VIEW: contest.task, TOLERANCE: contest.tolerance},
    )
