"""What `recommend` and `limits` recorded: what to take for a robot, and how far that holds."""

import math
from typing import NamedTuple

ADVISED = ("acceleration", "inverse")


class Contender(NamedTuple):
    """One variant over the robot's states; None where there is no number."""

    variant: str
    precision: str
    nanoseconds: float | None
    median: float | None
    worst: float | None
    predicted: float | None
    failures: int
    warnings: int


class Pick(NamedTuple):
    """What the advisor takes for a tolerance."""

    tolerance: float
    variant: str
    precision: str
    predicted: float | None
    worst: float | None
    nanoseconds: float | None
    enough: bool  # whether it is predicted to be within the tolerance
    reason: str


class Advice(NamedTuple):
    robot: str
    file: str  # its name; empty for a member of a family
    load_options: str  # how it is read, as C++ has it; empty: as it stands
    states: int
    sentence: str
    contenders: dict[str, list[Contender]]  # by task
    picks: dict[str, list[Pick]]


class Curve(NamedTuple):
    """The worst error at each value of a stress, None where every state was refused."""

    variant: str
    precision: str
    worst: list[float | None]
    silent: list[int]  # errors that came without a warning


class Load(NamedTuple):
    """One way to make a robot harder, and what becomes of the answers by task."""

    name: str
    title: str
    unit: str
    values: list[float]
    curves: dict[str, list[Curve]]


class Limits(NamedTuple):
    robot: str
    seconds: float
    evaluations: int
    sentence: str
    loads: list[Load]

    def worst(self, task: str, variant: str, precision: str) -> tuple[float | None, int]:
        """Over all values of all loads: the largest error, and how many values were refused."""
        found = [
            worst
            for load in self.loads
            for curve in load.curves.get(task, [])
            if (curve.variant, curve.precision) == (variant, precision)
            for worst in curve.worst
        ]
        errors = [worst for worst in found if worst is not None]
        return max(errors, default=None), len(found) - len(errors)


def advice(document: dict) -> Advice:
    return Advice(
        document["robot"],
        _text(document["file"]),
        _text(document["load_options"]),
        int(document["states"]),
        _text(document["sentence"]),
        {
            task: [_record(Contender, entry) for entry in part["contenders"]]
            for task, part in document["tasks"].items()
        },
        {
            task: [_record(Pick, entry) for entry in part["choices"]]
            for task, part in document["tasks"].items()
        },
    )


def limits(document: dict) -> Limits:
    return Limits(
        document["robot"],
        _number("seconds", document["seconds"]),
        int(document["evaluations"]),
        _text(document["sentence"]),
        [_load(entry) for entry in document["stresses"]],
    )


def _load(entry: dict) -> Load:
    values = [_number("value", value) for value in entry["values"]]
    curves = {
        task: [_curve(row, len(values)) for row in rows] for task, rows in entry["tasks"].items()
    }
    return Load(*(_text(entry[name]) for name in ("name", "title", "unit")), values, curves)


def _curve(row: dict, count: int) -> Curve:
    worst = [_optional("worst", value) for value in row["worst"]]
    if len(worst) != count or len(row["silent"]) != count:
        raise ValueError(f"{row['variant']} has not {count} values")
    silent = [int(number) for number in row["silent"]]
    return Curve(_text(row["variant"]), _text(row["precision"]), worst, silent)


def _record(kind, entry: dict):
    """Texts, truths, counts and numbers by the types of the record's fields."""
    values = []
    for name, of in kind.__annotations__.items():
        value = entry[name]
        if of in (str, bool, int):
            if not isinstance(value, of):
                raise ValueError(f"{name} is {value!r}")
            values.append(value)
        else:
            values.append(_optional(name, value) if of == float | None else _number(name, value))
    return kind(*values)


def _text(value) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is no text")
    return value


def _number(name: str, value) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise ValueError(f"{name} is {value!r}")
    return float(value)


def _optional(name: str, value) -> float | None:
    return None if value is None else _number(name, value)
