"""What `recommend` and `limits` recorded: what to take for a robot, and how far that holds."""

from typing import Annotated, NamedTuple

from read.values import Count, Number, Positive, SceneName, Size, at, record

ADVISED = ("acceleration", "acceleration_batch", "inverse", "inverse_batch")


@record
class Contender(NamedTuple):
    """One variant over the robot's states; None where there is no number."""

    variant: str
    precision: str
    nanoseconds: Size | None
    median: Size | None
    worst: Size | None
    predicted: Size | None
    failures: Count
    warnings: Count


@record
class Pick(NamedTuple):
    """What the advisor takes for a tolerance."""

    tolerance: Positive
    variant: str
    precision: str
    predicted: Size | None
    worst: Size | None
    nanoseconds: Size | None
    enough: bool  # whether it is predicted to be within the tolerance
    reason: str


@record
class Task(NamedTuple):
    contenders: list[Contender]
    choices: list[Pick]


@record
class Advice(NamedTuple):
    robot: SceneName
    file: str  # its name; empty for a member of a family
    load_options: str  # how it is read, as C++ has it; empty: as it stands
    states: Count
    sentence: str
    tasks: dict[str, Task]

    @property
    def contenders(self) -> dict[str, list[Contender]]:
        return {name: task.contenders for name, task in self.tasks.items()}

    @property
    def picks(self) -> dict[str, list[Pick]]:
        return {name: task.choices for name, task in self.tasks.items()}


@record
class Curve(NamedTuple):
    """The worst error at each value of a stress, None where every state was refused."""

    variant: str
    precision: str
    worst: list[Size | None]
    silent: list[Count]  # errors that came without a warning


@record
class Load(NamedTuple):
    """One way to make a robot harder, and what becomes of the answers by task."""

    name: str
    title: str
    unit: str
    values: list[Number]
    curves: Annotated[dict[str, list[Curve]], at("tasks")]

    def checked(self) -> "Load":
        for curve in (curve for curves in self.curves.values() for curve in curves):
            if not len(curve.worst) == len(curve.silent) == len(self.values):
                raise ValueError(f"{curve.variant} has not {len(self.values)} values")
        return self


@record
class Limits(NamedTuple):
    robot: SceneName
    seconds: Size
    evaluations: Count
    sentence: str
    loads: Annotated[list[Load], at("stresses")]

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
