"""Robots built by hand, or by what reads other libraries' models."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from . import _core
from ._names import numbers, unknown
from .robot import Description, Robot, Terms

_SUFFIXES = {
    "hinge": ("",),
    "slide": ("",),
    "ball": (":x", ":y", ":z"),
    "free": (":x", ":y", ":z", ":r:x", ":r:y", ":r:z"),
}
_REACH = {"hinge": math.pi, "slide": 0.5}  # [rad, m] of random states without limits


class Builder:
    """A robot built by hand: bodies, each on a joint on its parent.

    builder = kalmarm.Builder("pendulum")
    builder.add_body("rod", joint="hinge", axis=(0, 1, 0), mass=1, center_of_mass=(0, 0, -0.5),
                     inertia=(1/12, 1/12, 0))
    robot = builder.build()
    """

    def __init__(self, name: str = "robot", *, gravity: Sequence[float] = (0, 0, -9.81)) -> None:
        """gravity [m/s^2]"""
        self.name = name
        self._core = _core.ModelBuilder()
        self._core.set_gravity([float(x) for x in gravity])
        self._bodies: dict[str, int] = {}
        self._dofs: list[str] = []
        self._armature: list[float] = []
        self._q0: list[float] = []
        self._range: list[tuple[float, float]] = []
        self._frames: dict[str, _core.Frame] = {}

    def add_body(
        self,
        name: str = "",
        *,
        parent: str | int = -1,
        joint: str = "fixed",
        joint_name: str | None = None,
        axis: Sequence[float] = (0, 0, 1),
        position: Sequence[float] = (0, 0, 0),
        rotation: Sequence[float] = (1, 0, 0, 0),
        reference: float = 0.0,
        armature: float | Sequence[float] = 0.0,
        limits: tuple[float, float] | None = None,
        mass: float = 0.0,
        center_of_mass: Sequence[float] = (0, 0, 0),
        inertia: Any = (0, 0, 0),
        solid: bool = True,
    ) -> int:
        """Adds a body and the joint on its inboard side; returns the body's number.

        The body's frame has its origin on the joint; at q = reference it stands at `position` [m]
        and `rotation` (w, x, y, z) in its parent's frame.

        parent: the name or number of a body, -1 for the fixed base.
        joint: "fixed", "hinge", "slide", "ball" or "free"; its DoF have the name of the body unless
            joint_name is given.
        axis: of a hinge or slide, in the body's frame.
        reference: q at which a hinge or slide stands at its placement [rad or m].
        armature: reflected rotor inertia, of each DoF [kg m^2 or kg].
        limits: of a hinge or slide, for random states.
        mass [kg], center_of_mass in the body's frame [m].
        inertia: about the center of mass [kg m^2]: (xx, yy, zz), (xx, yy, zz, xy, xz, yz) or 3 x 3.
        solid: principal moments A <= B < C - A, which no solid body has, are refused; else they are
            taken as given.
        """
        if isinstance(parent, str):
            if parent not in self._bodies:
                raise unknown("body", parent, self._bodies)
            parent = self._bodies[parent]
        suffixes = _SUFFIXES.get(joint, ())
        each = np.broadcast_to(numbers("armature", armature), (len(suffixes),)).tolist()
        body = self._core.add_body(
            name=name,
            parent=int(parent),
            joint=joint,
            axis=[float(x) for x in axis],
            position=[float(x) for x in position],
            rotation=[float(x) for x in rotation],
            reference=float(reference),
            armature=each[0] if each else 0.0,
            mass=float(mass),
            center_of_mass=[float(x) for x in center_of_mass],
            inertia=_six(inertia),
            solid=bool(solid),
        )
        called = name if joint_name is None else joint_name
        self._dofs += [called + suffix for suffix in suffixes]
        self._armature += each
        if joint in _REACH:
            self._q0.append(float(reference))
            self._range.append(limits or (-_REACH[joint], _REACH[joint]))
        elif suffixes:
            if joint == "free":
                self._q0 += [0.0] * 3
            self._q0 += [1.0, 0.0, 0.0, 0.0]
            self._range += [(-1.0, 1.0)] * (7 if joint == "free" else 4)
        if name:
            self._bodies.setdefault(name, body)
            self._frames.setdefault(name, self._core.frame(body))
        return body

    def add_frame(
        self,
        name: str,
        parent: str | int,
        *,
        position: Sequence[float] = (0, 0, 0),
        rotation: Sequence[float] = (1, 0, 0, 0),
    ) -> None:
        """A frame on a body, with its origin [m] and axes (w, x, y, z) there, for `operational`."""
        self.add_body(name, parent=parent, position=position, rotation=rotation)

    def __repr__(self) -> str:
        return f"<kalmarm.Builder of {self.name}: {len(self._dofs)} DoF>"

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError("a Builder is neither pickled nor copied: its build() makes a robot, which is")

    def build(
        self,
        *,
        q0: Any = None,
        notes: Sequence[str] = (),
        terms: Terms | None = None,
        **options: Any,
    ) -> Robot:
        """The robot; options are those of `Robot`. q0: where it starts, (nq,). terms: its springs
        and dampers."""
        start = numbers("q0", self._q0 if q0 is None else q0).copy()
        if start.shape != (len(self._q0),):
            raise ValueError(f"build: q0 has shape {start.shape}, ({len(self._q0)},) is needed")
        return Robot(
            Description(
                name=self.name,
                model=self._core.build(dofs=self._dofs, armature=self._armature),
                q0=start,
                q_range=np.array(self._range, float).reshape(-1, 2),
                frames=self._frames.copy(),
                notes=tuple(notes),
                terms=terms,
            ),
            **options,
        )


def _six(inertia: Any) -> list[float]:
    given = numbers("inertia", inertia)
    if given.shape == (3,):
        return [*given.tolist(), 0.0, 0.0, 0.0]
    if given.shape == (6,):
        return given.tolist()
    if given.shape == (3, 3):
        if not np.allclose(given, given.T, rtol=1e-9, atol=1e-300):
            raise ValueError("inertia: the matrix is not symmetric")
        return [*np.diag(given).tolist(), given[0, 1], given[0, 2], given[1, 2]]
    raise ValueError(f"inertia has shape {given.shape}, (3,), (6,) or (3, 3) is needed")
