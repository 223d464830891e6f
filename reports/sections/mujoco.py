"""Agreement with MuJoCo: each robot against its bounds, with every variant's numbers to unfold."""

from data import Data, scene_name
from section import Section, Table, Verdict
from text import error_text


def section(data: Data) -> Section | None:
    if not data.mujoco:
        return None
    robots = sorted(data.mujoco, key=lambda robot: data.scenes.index(robot["scene"]))
    versions = ", ".join(sorted({robot["mujoco"] for robot in robots}))
    overview = Table(
        "Largest and median relative error over the states, and the bound on the largest. "
        "A robot passes if its mass matrix and all its variants do.",
        [
            "Robot",
            "States",
            "M: largest",
            "M: median",
            "M: bound",
            "Acceleration: largest",
            "Bound",
            "Worst variant",
            "",
        ],
        [_overview(robot) for robot in robots],
        "lrrrrrrll",
    )
    return Section(
        "Agreement with MuJoCo",
        [
            f"MuJoCo {versions} computes the same mass matrix and acceleration, with its contacts, "
            "limits, damping, actuators and constraints switched off. The bounds hold in float64; "
            "float32 is listed without one."
        ],
        tables=[overview, *map(_variants, robots)],
    )


def _within(entry: dict) -> bool:
    """No bound is always met; a missing largest error meets no bound."""
    return entry["bound"] is None or (entry["max"] is not None and entry["max"] <= entry["bound"])


def _passes(robot: dict) -> bool:
    """The record's own verdict, and what its numbers say."""
    entries = [robot["mass"], *(variant["acceleration"] for variant in robot["variants"])]
    return robot["pass"] and all(map(_within, entries))


def _overview(robot: dict) -> list:
    mass = robot["mass"]
    bounded = [
        variant for variant in robot["variants"] if variant["acceleration"]["bound"] is not None
    ]
    worst = max(bounded, key=lambda v: v["acceleration"]["max"] or float("inf"), default=None)
    entry = worst["acceleration"] if worst else {"max": None, "bound": None}
    return [
        scene_name(robot["scene"]),
        str(robot["states"]),
        *(error_text(mass[name]) for name in ("max", "median", "bound")),
        error_text(entry["max"]),
        error_text(entry["bound"]),
        worst["variant"] if worst else "–",
        Verdict(_passes(robot)),
    ]


def _variants(robot: dict) -> Table:
    rows = []
    for variant in robot["variants"]:
        acceleration, inverse = variant["acceleration"], variant["inverse"]
        rows.append(
            [
                variant["variant"],
                variant["precision"],
                *(error_text(acceleration[name]) for name in ("max", "median", "bound")),
                *(error_text(inverse[name]) for name in ("max", "median")),
                str(variant["failures"]),
                "" if acceleration["bound"] is None else Verdict(_within(acceleration)),
            ]
        )
    return Table(
        f"{scene_name(robot['scene'])}: every variant",
        [
            "Variant",
            "Precision",
            "Acceleration: largest",
            "Median",
            "Bound",
            "M⁻¹: largest",
            "Median",
            "Failures",
            "",
        ],
        rows,
        "llrrrrrrl",
        folded=True,
    )
