"""Agreement with MuJoCo, which stays as its files have it."""

from typing_extensions import TypedDict

from read.values import Count, SceneName, Size


class Errors(TypedDict):
    """Over the states; None where there is no number."""

    max: Size | None
    median: Size | None


class Bounded(Errors):
    bound: Size | None  # of the largest


class OfMass(TypedDict):
    variant: str
    mass: Errors


class Compared(TypedDict):
    variant: str
    precision: str
    failures: Count
    acceleration: Bounded
    inverse: Errors


Robot = TypedDict(
    "Robot",
    {
        "scene": SceneName,
        "states": Count,
        "notes": list[str],
        "mass": Bounded,
        "mass_variants": list[OfMass],
        "variants": list[Compared],
        "pass": bool,
    },
)


class Agreement(TypedDict):
    mujoco: str  # its version
    robots: list[Robot]
