"""What `recommend` and `limits` recorded: what to take for a robot, and how far that holds."""

from typing import NamedTuple

from read.values import count, number, optional, text

ADVISED = ("acceleration", "acceleration_batch", "inverse", "inverse_batch")


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
        text(document["file"]),
        text(document["load_options"]),
        count("states", document["states"]),
        text(document["sentence"]),
        {
            task: [_record(Contender, entry) for entry in part["contenders"]]
            for task, part in document["tasks"].items()
        },
        {
            task: [_pick(entry) for entry in part["choices"]]
            for task, part in document["tasks"].items()
        },
    )


def limits(document: dict) -> Limits:
    return Limits(
        document["robot"],
        number("seconds", document["seconds"], 0),
        count("evaluations", document["evaluations"]),
        text(document["sentence"]),
        [_load(entry) for entry in document["stresses"]],
    )


def _load(entry: dict) -> Load:
    values = [number("value", value) for value in entry["values"]]
    curves = {
        task: [_curve(row, len(values)) for row in rows] for task, rows in entry["tasks"].items()
    }
    return Load(*(text(entry[name]) for name in ("name", "title", "unit")), values, curves)


def _curve(row: dict, length: int) -> Curve:
    worst = [optional("worst", value, 0) for value in row["worst"]]
    if len(worst) != length or len(row["silent"]) != length:
        raise ValueError(f"{row['variant']} has not {length} values")
    silent = [count("silent", errors) for errors in row["silent"]]
    return Curve(text(row["variant"]), text(row["precision"]), worst, silent)


def _pick(entry: dict) -> Pick:
    pick = _record(Pick, entry)
    if not pick.tolerance > 0:
        raise ValueError(f"tolerance is {pick.tolerance}")
    return pick


def _record(kind, entry: dict):
    """Texts, truths, counts and numbers by the types of the record's fields."""
    values = []
    for name, of in kind.__annotations__.items():
        value = entry[name]
        if of in (str, bool):
            if not isinstance(value, of):
                raise ValueError(f"{name} is {value!r}")
            values.append(value)
        elif of is int:
            values.append(count(name, value))
        else:
            values.append((optional if of == float | None else number)(name, value, 0))
    return kind(*values)
