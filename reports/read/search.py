"""What a search for the worst mechanisms has written."""

from typing import Annotated, Literal, NamedTuple, get_args

from pydantic import AfterValidator, BeforeValidator

from read.values import Count, Maybe, Positive, Precision, Size, reading, record

COLUMNS = (
    "variant,precision,task,objective,kernel,rows,seed,method,evaluations,error,kS,nv,file,bodies"
).split(",")
Task = Literal["acceleration", "inverse", "solve", "diagonal", "log_det", "derivatives"]
Objective = Literal["error", "claim"]
TASKS, OBJECTIVES = get_args(Task), get_args(Objective)
ISLANDS = "islands"  # many searches, which exchange what they find: scripts/campaign adversary


class FoundBody(NamedTuple):
    """A body of a mechanism that was found, with the joint that holds it."""

    parent: Count  # its number from 1; 0: the ground
    joint: Literal["hinge", "slide", "ball", "free"]
    mass: Size  # kg
    length: Size  # from the parent's joint, m
    armature: Size  # kg m^2 or kg


def _in_order(bodies: tuple[FoundBody, ...]) -> tuple[FoundBody, ...]:
    for before, body in enumerate(bodies):
        if body.parent > before:
            raise ValueError(f"body {before + 1} hangs on {body.parent}")
    return bodies


Bodies = Annotated[
    tuple[FoundBody, ...],
    BeforeValidator(lambda cell: [body.split() for body in cell.split(";")] if cell else ()),
    AfterValidator(_in_order),
]


@record
class Asked(NamedTuple):
    """What a search asks of a variant, in the words of `adversary`'s options."""

    task: Task = "acceleration"
    objective: Objective = "error"  # or claim: the error over what is claimed
    kernel: Literal["spatial", "spatial_at_rest", "translational"] = "spatial"
    rows: bool = False  # of states, answered together


@record
class Find(NamedTuple):
    """The worst silent error that so many mechanisms have shown, or its ratio to what was claimed;
    None: none of them had any."""

    variant: str
    precision: Precision
    asked: Asked
    seed: Count
    method: Literal["search", "random", ISLANDS]
    evaluations: Count
    error: Maybe[Positive]
    kS: Maybe[Size]  # noqa: N815, the structured condition number; of the last alone
    nv: Maybe[Count]  # of the last alone
    bodies: Bodies = ()  # of the last alone

    def checked(self) -> "Find":
        if self.error is None and self.bodies:
            raise ValueError("bodies of nothing that was found")
        return self


_find = reading(Find, strict=False)


def find(row: dict) -> Find:
    return _find(row | {"asked": row})
