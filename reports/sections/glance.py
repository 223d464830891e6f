"""Per robot: the fastest and the most accurate variant, and the worst error against MuJoCo."""

from markupsafe import Markup

from charts.text import error_text, time_text
from page.section import Section, Table
from read.data import Data, scene_name, scene_size
from summary.points import Point, points

SHORT = {"acceleration": "a", "inverse": "M⁻¹"}


def section(data: Data) -> Section | None:
    robots = data.robots
    if not robots:
        return None
    all_points = points(data)
    rows = []
    for robot in robots:
        row = [scene_name(robot), str(scene_size(robot))]
        for task in SHORT:
            candidates = [
                point
                for point in all_points
                if (point.scene, point.task, point.precision, point.measure)
                == (robot, task, "float64", "relative")
                and point.failures == 0
            ]
            row += [_fastest(candidates), _most_accurate(candidates)]
        rows.append(row + _against_mujoco(data, robot))
    columns = ["Scene", "DoF"]
    for task in SHORT:
        columns += [f"{SHORT[task]}: fastest", f"{SHORT[task]}: most accurate"]
    columns += ["M: against MuJoCo", "a: against MuJoCo"]
    notes = {
        f"{scene_name(record['scene'])}: {note}"
        for record in data.mujoco
        if record["scene"] in robots
        for note in record["notes"]
    }
    return Section(
        "At a glance",
        statements=sorted(notes),
        tables=[
            Table(
                "a is the acceleration M⁻¹(τ − bias). All in float64. Fastest: the smallest "
                "median time. Most accurate: the smallest median relative error. Both among the "
                "variants that failed on no state. Against MuJoCo: the largest relative error "
                "over all states, and for a over all variants.",
                columns,
                rows,
                "lr" + "l" * (len(columns) - 4) + "rr",
            )
        ],
    )


def _fastest(candidates: list[Point]) -> str:
    timed = [point for point in candidates if point.time is not None]
    if not timed:
        return "–"
    best = min(timed, key=lambda point: point.time)
    return _two_lines(best.variant, time_text(best.time))


def _most_accurate(candidates: list[Point]) -> str:
    measured = [point for point in candidates if point.median is not None]
    if not measured:
        return "–"
    best = min(measured, key=lambda point: point.median)
    return _two_lines(best.variant, error_text(best.median))


def _two_lines(variant: str, number: str) -> Markup:
    return Markup("{}<br>{}").format(variant, number)


def _against_mujoco(data: Data, scene: str) -> list[str]:
    robot = next((robot for robot in data.mujoco if robot["scene"] == scene), None)
    if not robot:
        return ["–", "–"]
    accelerations = [
        variant["acceleration"]["max"]
        for variant in robot["variants"]
        if variant["precision"] == "float64"
    ]
    worst = max((value for value in accelerations if value is not None), default=None)
    return [error_text(robot["mass"]["max"]), error_text(worst)]
