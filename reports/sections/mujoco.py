"""MuJoCo {versions} computes the same mass matrix and acceleration, with its contacts, limits,
damping, actuators and constraints switched off. The bounds hold in float64; float32 is listed
without one.
"""

from charts.text import error_text
from page.section import Column, Section, Verdict, left, of, right
from read.data import Data, scene_name, scene_size


def section(data: Data) -> Section | None:
    if not data.mujoco:
        return None
    families = data.families

    def order(record: dict) -> tuple:
        name = scene_name(record["scene"])
        family = name if name in families else ""
        return bool(family), family, scene_size(record["scene"]), name

    def title(record: dict, *_) -> str:
        name = scene_name(record["scene"])
        return f"{name}, N = {scene_size(record['scene'])}" if name in families else name

    robots = sorted(data.mujoco, key=order)
    versions = ", ".join(sorted({robot["mujoco"] for robot in robots}))
    scene = left("Scene", title)
    page = Section("Agreement with MuJoCo", __doc__.format(versions=versions))
    page.table(
        """Largest and median relative error over the states, and the bound on the largest. The
        bound on the acceleration is 1e-9, or u times the condition number of M times its size where
        that is more. A scene passes if its mass matrix and all its variants do.""",
        [
            scene,
            right("States", lambda robot: robot["states"]),
            of(lambda robot: robot["mass"], *_errors("M: largest", "M: median", "M: bound")),
            of(_worst, _error("Acceleration: largest", "max"), _error("Bound", "bound")),
            of(_worst, left("Worst variant", lambda _, variant: variant)),
            left("Verdict", lambda robot: Verdict(_passes(robot))),
        ],
        robots,
    )
    page.table(
        "The mass matrix by every variant that gives it, in float64",
        [
            scene,
            left("Variant", lambda _, it: it["variant"]),
            of(lambda _, it: it["mass"], *_errors("M: largest", "Median")),
        ],
        [(robot, it) for robot in robots for it in robot["mass_variants"]],
        folded=True,
    )
    titles = ("Acceleration: largest", "Median", "Bound")
    page.table(
        "Every variant of every scene",
        [
            scene,
            left("Variant", lambda _, it: it["variant"]),
            left("Precision", lambda _, it: it["precision"]),
            of(lambda _, it: it["acceleration"], *_errors(*titles)),
            of(lambda _, it: it["inverse"], *_errors("M⁻¹: largest", "Median")),
            right("Failures", lambda _, it: it["failures"]),
            left("Verdict", lambda _, it: _verdict(it["acceleration"])),
        ],
        [(robot, it) for robot in robots for it in robot["variants"]],
        folded=True,
    )
    return page


def _error(title: str, name: str) -> Column:
    return right(title, lambda entry, *_: entry[name], error_text)


def _errors(*titles: str) -> list[Column]:
    """The largest, the median and the bound."""
    return list(map(_error, titles, ("max", "median", "bound")))


def _within(entry: dict) -> bool:
    """No bound is always met; a missing largest error meets no bound."""
    return entry["bound"] is None or (entry["max"] is not None and entry["max"] <= entry["bound"])


def _verdict(entry: dict) -> Verdict | str:
    return "" if entry["bound"] is None else Verdict(_within(entry))


def _passes(robot: dict) -> bool:
    """The record's own verdict, and what its numbers say."""
    entries = [robot["mass"], *(variant["acceleration"] for variant in robot["variants"])]
    return robot["pass"] and all(map(_within, entries))


def _worst(robot: dict) -> tuple[dict, str] | None:
    """The acceleration of the variant with the largest error, of those that have a bound."""
    entries = [(variant["acceleration"], variant["variant"]) for variant in robot["variants"]]
    bounded = [it for it in entries if it[0]["bound"] is not None]
    return max(bounded, key=lambda it: it[0]["max"] or float("inf"), default=None)
