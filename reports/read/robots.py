"""What `scripts/campaign robots` found of each robot, a stress a row."""

from typing import Annotated, NamedTuple

from pydantic import AfterValidator

from read.values import Count, Maybe, Name, Number, SceneName, record

COLUMNS = "name,robot,variant,precision,digits,stress,unit,kept,last,silent,refused".split(",")


@record
class Kept(NamedTuple):
    """How far a stress may go; a robot that was refused has a name and a reason alone."""

    name: Name
    stress: str
    robot: Maybe[SceneName]
    variant: str
    precision: str
    digits: Maybe[Count]  # that the variant keeps; None: nothing keeps three
    unit: str
    kept: Maybe[Number]  # the last value that keeps them
    last: Maybe[Number]  # that was tried
    silent: Maybe[Count]  # errors without a warning, of all variants
    refused: Annotated[str, AfterValidator(lambda words: " ".join(words.split()))]

    def checked(self) -> "Kept":
        if not self.refused and (self.robot is None or self.silent is None):
            raise ValueError(f"{self.name} is neither judged nor refused")
        return self

    @property
    def promise(self) -> str:
        if self.digits is None:
            return ""
        return f"{self.variant}, {self.precision}: {self.digits} digits"

    @property
    def whole(self) -> bool:
        return self.kept is not None and self.kept == self.last
