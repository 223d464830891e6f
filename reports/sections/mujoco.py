"""Agreement with MuJoCo: each scene against its bounds, with every variant's numbers to unfold."""

from charts.text import error_text
from page.section import Section, Table, Verdict
from read.data import Data, scene_name, scene_size


def section(data: Data) -> Section | None:
    if not data.mujoco:
        return None
    families = data.families

    def order(record: dict) -> tuple:
        scene = record["scene"]
        name = scene_name(scene)
        return (name in families, name if name in families else "", scene_size(scene), name)

    def title(record: dict) -> str:
        name = scene_name(record["scene"])
        return f"{name}, N = {scene_size(record['scene'])}" if name in families else name

    robots = sorted(data.mujoco, key=order)
    versions = ", ".join(sorted({robot["mujoco"] for robot in robots}))
    overview = Table(
        "Largest and median relative error over the states, and the bound on the largest. "
        "The bound on the acceleration is 1e-9, or u times the condition number of M times its size "
        "where that is more. A scene passes if its mass matrix and all its variants do.",
        [
            "Scene",
            "States",
            "M: largest",
            "M: median",
            "M: bound",
            "Acceleration: largest",
            "Bound",
            "Worst variant",
            "Verdict",
        ],
        [_overview(title(robot), robot) for robot in robots],
        "lrrrrrrll",
    )
    return Section(
        "Agreement with MuJoCo",
        [
            f"MuJoCo {versions} computes the same mass matrix and acceleration, with its contacts, "
            "limits, damping, actuators and constraints switched off. The bounds hold in float64; "
            "float32 is listed without one."
        ],
        tables=[
            overview,
            _masses([(title(robot), robot) for robot in robots]),
            _variants([(title(robot), robot) for robot in robots]),
        ],
    )


def _within(entry: dict) -> bool:
    """No bound is always met; a missing largest error meets no bound."""
    return entry["bound"] is None or (entry["max"] is not None and entry["max"] <= entry["bound"])


def _passes(robot: dict) -> bool:
    """The record's own verdict, and what its numbers say."""
    entries = [robot["mass"], *(variant["acceleration"] for variant in robot["variants"])]
    return robot["pass"] and all(map(_within, entries))


def _overview(title: str, robot: dict) -> list:
    mass = robot["mass"]
    bounded = [
        variant for variant in robot["variants"] if variant["acceleration"]["bound"] is not None
    ]
    worst = max(bounded, key=lambda v: v["acceleration"]["max"] or float("inf"), default=None)
    entry = worst["acceleration"] if worst else {"max": None, "bound": None}
    return [
        title,
        str(robot["states"]),
        *(error_text(mass[name]) for name in ("max", "median", "bound")),
        error_text(entry["max"]),
        error_text(entry["bound"]),
        worst["variant"] if worst else "–",
        Verdict(_passes(robot)),
    ]


def _masses(robots: list[tuple[str, dict]]) -> Table:
    rows = [
        [title, one["variant"], *(error_text(one["mass"][name]) for name in ("max", "median"))]
        for title, robot in robots
        for one in robot["mass_variants"]
    ]
    return Table(
        "The mass matrix by every variant that gives it, in float64",
        ["Scene", "Variant", "M: largest", "Median"],
        rows,
        "llrr",
        folded=True,
    )


def _variants(robots: list[tuple[str, dict]]) -> Table:
    rows = []
    for title, robot in robots:
        for variant in robot["variants"]:
            acceleration, inverse = variant["acceleration"], variant["inverse"]
            rows.append(
                [
                    title,
                    variant["variant"],
                    variant["precision"],
                    *(error_text(acceleration[name]) for name in ("max", "median", "bound")),
                    *(error_text(inverse[name]) for name in ("max", "median")),
                    str(variant["failures"]),
                    "" if acceleration["bound"] is None else Verdict(_within(acceleration)),
                ]
            )
    return Table(
        "Every variant of every scene",
        [
            "Scene",
            "Variant",
            "Precision",
            "Acceleration: largest",
            "Median",
            "Bound",
            "M⁻¹: largest",
            "Median",
            "Failures",
            "Verdict",
        ],
        rows,
        "lllrrrrrrl",
        folded=True,
    )
