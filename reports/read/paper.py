"""The checks of the paper's equations."""

from collections import Counter
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from read.values import Count, Number, Positive, SceneName, Size, at, record


@record
class Residual(NamedTuple):
    """How far both forms of an equation are from true, in one precision; None: not a number."""

    printed: Size | None
    corrected: Size | None
    tolerance: Positive
    verdict: Literal["holds", "misprint", "fails"]

    @property
    def holds(self) -> bool:
        """The record's own verdict, and what its numbers say."""
        within = self.corrected is not None and self.corrected <= self.tolerance
        return self.verdict != "fails" and within


@record
class Equation(NamedTuple):
    """An equation of the paper; `corrected` and `note` are empty where it is true as printed."""

    id: str
    section: str
    result: str
    statement: str
    corrected: str
    note: str
    residuals: dict[str, Residual]  # by precision

    def checked(self) -> "Equation":
        if not self.corrected and any(r.verdict == "misprint" for r in self.residuals.values()):
            raise ValueError(f"{self.id} is a misprint without a corrected form")
        return self

    @property
    def holds(self) -> bool:
        return all(residual.holds for residual in self.residuals.values())


@record
class Precision(NamedTuple):
    name: Annotated[str, at("precision")]
    digits: Count
    condition: Number


@record
class Paper(NamedTuple):
    """The paper's equations, each checked on one scene."""

    scene: SceneName
    # where what the paper does not say is checked; by default the scene
    beyond_scene: Annotated[SceneName | None, at("beyond_scene", default=None)]
    passed: Annotated[bool, at("pass")]
    precisions: Annotated[list[Precision], Field(min_length=1)]
    equations: Annotated[list[Equation], at("rows"), Field(min_length=1)]

    def checked(self) -> "Paper":
        names = {precision.name for precision in self.precisions}
        for id, times in Counter(equation.id for equation in self.equations).items():
            if times > 1:
                raise ValueError(f"{id} is recorded {times} times")
        for equation in self.equations:
            if equation.residuals.keys() != names:
                raise ValueError(f"{equation.id} is not checked in {', '.join(sorted(names))}")
        return self._replace(beyond_scene=self.beyond_scene or self.scene)
