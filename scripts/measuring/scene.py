"""What is measured: a robot, a scene of several, a user's file or a member of a family."""

import re
from dataclasses import dataclass, replace
from pathlib import Path

from names import fault_of_name

ROBOT_SIZE = 20  # taken for a robot, whose degrees of freedom only the programs know
MUJOCO_SIZE = 100  # largest member of a family that is compared with MuJoCo


class BadInput(Exception):
    """Ends the run with the message as its only line."""


def bad_input(what: str) -> BadInput:
    return BadInput(f"report: error: {what}")


@dataclass(frozen=True)
class Scene:
    """One scene, and what else the programs must be told of it."""

    argument: str  # what the programs are given; empty: what a program takes by itself
    label: str  # shown, and with - for : in file names
    size: int
    in_mujoco: bool
    model: Path | None  # None: a family, which the programs know
    options: tuple[str, ...] = ()  # further ones, which the label tells apart
    read: tuple[str, ...] = ()  # how a user's file is read

    @staticmethod
    def parse(text: str, root: Path, read: tuple[str, ...] = ()) -> "Scene":
        """Of a name or a file; `read` says how a user's own file is read."""
        path = Path(text).resolve()
        if shipped := Scene.shipped(text, root):
            return shipped
        if path.is_file():
            if fault := fault_of_name(path):
                raise bad_input(fault)
            return Scene(str(path), path.stem, ROBOT_SIZE, True, path, read=read)
        if family := Scene.family(text):
            return family
        raise bad_input(f"scene {text!r} is no file, shipped scene or family:N")

    @staticmethod
    def shipped(name: str, root: Path) -> "Scene | None":
        """A robot, or a scene made of several."""
        for folder in (name, "scenes"):
            model = root / "robots/models" / folder / f"{name}.xml"
            if model.is_file():
                return Scene(name, name, ROBOT_SIZE, True, model)
        return None

    @staticmethod
    def family(text: str) -> "Scene | None":
        if not (family := re.fullmatch(r"(\w+):(\d+)", text)):
            return None
        size = int(family[2])
        return Scene(text, text, size, size <= MUJOCO_SIZE, None)

    def fitted(self, residual: str, noise: float = 0) -> "Scene":
        """Its fit from simulated motion, by a start 50 % off."""
        label = f"{self.label} {residual}{' noisy' if noise else ''}"
        options = (f"--simulate={self.argument}", f"--residual={residual}", f"--noise={noise:g}")
        return replace(self, label=label, options=options)

    def asked(self, title: str, options: tuple[str, ...]) -> "Scene":
        """What a question about it is measured with."""
        return replace(self, label=title, options=options)
