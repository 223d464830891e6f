"""Each variant over all robots: how often right, how often fastest, how much slower."""

import math

from charts import aggregates as aggregate_charts
from charts.common import TOLERANCE, VIEW, Style
from charts.text import share_text, task_text, three_digits, tolerance_text
from page.section import Choice, Figure, Section, Table
from read.advice import ADVISED
from read.data import Data
from summary.aggregates import geometric_mean, profile, share_answered, slowdowns
from summary.points import Point, points

FEWEST = 3  # robots that are worth a mean
TOLERANCES = (1e-3, 1e-5, 1e-9, 1e-12)
FIRST = 1e-5


def section(data: Data) -> Section | None:
    tables, rows = [], []
    names, measured, robots = data.robots, points(data), set()
    for task in ADVISED:
        for tolerance in TOLERANCES:
            times = _times(names, measured, task, tolerance)
            if len(times) < FEWEST:
                continue
            robots |= times.keys()
            ratios = slowdowns(times)
            rows += _rows(task, tolerance, ratios, len(times))
            tables.append(_table(task, tolerance, times, ratios))
    if not rows:
        return None
    tasks = list(dict.fromkeys(row[VIEW] for row in rows))
    tolerances = [tolerance_text(tolerance) for tolerance in TOLERANCES]
    choices = [
        Choice(VIEW, "Task", [(task, task_text(task)) for task in tasks], tasks[0]),
        Choice(TOLERANCE, "Error asked for", [(it, it) for it in tolerances], tolerance_text(FIRST)),
    ]
    first = {choice.signal: choice.first for choice in choices}
    for table in tables:
        table.first = table.shown == first
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    return Section(
        "Over all robots",
        [
            f"{len(robots)} robots. A variant answers a robot if it failed on no state and its "
            "largest error over the states is within the error asked for. Times slower: its time "
            "over that of the fastest variant that answers the same robot.",
            "The performance profile gives, for each factor, the share of robots that a variant "
            "answers within that factor of the fastest: at 1 the share on which it is the fastest, "
            "at the right end the share that it answers.",
        ],
        choices=choices,
        variants=style.variants,
        precisions=style.precisions,
        figures=[
            Figure(
                "performance profile",
                aggregate_charts.performance_profile(rows, style, first),
                aggregate_charts.PROFILE_TOOLTIPS,
            )
        ],
        tables=tables,
    )


def _times(names: list[str], measured: list[Point], task: str, tolerance: float) -> dict[str, dict]:
    """By robot and series; None where it was timed but does not answer."""
    robots = {robot: {} for robot in names}
    for point in measured:
        if point.scene in robots and (point.task, point.measure) == (task, "relative"):
            if point.time is None or not point.states:
                continue
            right = not point.failures and point.worst <= tolerance
            robots[point.scene][point.variant, point.precision] = point.time if right else None
    return {robot: found for robot, found in robots.items() if found}


def _rows(task: str, tolerance: float, ratios: dict, robots: int) -> list[dict]:
    """The corners of each profile, and its end at the right edge."""
    finite = [ratio for own in ratios.values() for ratio in own if math.isfinite(ratio)]
    if not finite:
        return []
    rows = []
    for (variant, precision), own in ratios.items():
        corners = profile(own)
        if not corners:
            continue
        for i, (tau, share) in enumerate([*corners, (max(finite), corners[-1][1])]):
            rows.append(
                {
                    "scene": f"{robots} robots",
                    VIEW: task,
                    TOLERANCE: tolerance_text(tolerance),
                    "variant": variant,
                    "precision": precision,
                    "slower": float(f"{tau:.4g}"),
                    "share": share,
                    "share_text": share_text(share),
                    **({"last": 1} if i == len(corners) // 2 else {}),
                }
            )
    return rows


def _table(task: str, tolerance: float, times: dict, ratios: dict) -> Table:
    rows = []
    for solver, own in ratios.items():
        mean = geometric_mean(own)
        if mean is None:
            continue
        finite = [ratio for ratio in own if math.isfinite(ratio)]
        rows.append(
            [
                *solver,
                share_text(share_answered(times, solver)),
                share_text(sum(ratio == 1 for ratio in own) / len(times)),
                three_digits(mean),
                three_digits(max(finite)),
            ]
        )
    rows.sort(key=lambda row: float(row[4]))
    return Table(
        f"{task_text(task)}, errors up to {tolerance_text(tolerance)}: share of the robots that are "
        "answered, share on which it is the fastest, and times slower than the fastest: geometric "
        "mean and largest, over the robots that it answers",
        ["Variant", "Precision", "Answered", "Fastest", "Times slower", "Largest"],
        rows,
        "llrrrr",
        shown={VIEW: task, TOLERANCE: tolerance_text(tolerance)},
    )
