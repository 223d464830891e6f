"""Robots whose frames or joints are held together: loops, contacts that stay, welds, gears."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._names import dofs_of, number, one_of, unknown

if TYPE_CHECKING:
    from ._core import Frame
    from .robot import Robot

KINDS = ("point", "pose", "coupling")
WORLD = "world"


class Constraints(NamedTuple):
    """Constraints in a state, m rows of all together.

    error: (..., m), e.
    rate: (..., m), its rate J qd; None without qd.
    jacobian: (..., m, nv), J.
    """

    error: NDArray[Any]
    rate: NDArray[Any] | None
    jacobian: NDArray[Any]


class ConstrainedAcceleration(NamedTuple):
    """What constraints make of a robot's motion.

    a: (..., nv), the acceleration.
    forces: (..., m), of the rows: J' forces are the torques that stand for the constraints.
    """

    a: NDArray[Any]
    forces: NDArray[Any]


class Impulse(NamedTuple):
    """What an impact leaves.

    qd: (..., nv), the velocity after it.
    impulses: (..., m), of the rows [N s].
    """

    qd: NDArray[Any]
    impulses: NDArray[Any]


class ConstrainedSolution(NamedTuple):
    """The solution of a linear system with constraints.

    x: (..., nv).
    forces: (..., m), of the rows.
    """

    x: NDArray[Any]
    forces: NDArray[Any]


@dataclass(frozen=True)
class Constraint:
    """What holds two frames or some joints of a robot together.

    kind: "point", 3 rows: the origins of two frames coincide, e = p1 - p2 in the base's axes [m]; "pose", 6 rows:
        their axes too, before that 2 s v of the quaternion (w, v) from the axes of the second to those of the first
        [rad], s: `turning`; "coupling", 1 row: J1 q = P(J2 q - reference) of hinges and slides.
    first, second: frames, by name, "world" among them; or a `Frame`; or a name with where it is held in that frame:
        {"frame": "rod", "translation": [0.3, 0, 0], "rotation": [1, 0, 0, 0]}.
    turning: s, by which rows of turning are multiplied.
    joints, other: J1 and J2: numbers by the names of joints, {"left": 1, "right": -1}, or an array (nv,).
    reference, polynomial: of P(x) = c0 + c1 x + ... + c4 x^4.
    stiffness, damping: k [1/s^2] and b [1/s] of J a = -dJ/dt qd - b e' - k e, Baumgarte's omega^2 and 2 zeta omega.
    velocity_terms: whether dJ/dt qd is taken.
    compliance: R of J a + R forces = ..., of rows of turning and of others; 0: exact.
    impedance: least, most, width, midpoint and power of MuJoCo's solimp, d: R is compliance (1 - d) / d then, and k
        acts d times.
    """

    name: str
    kind: str = "point"
    first: Any = WORLD
    second: Any = WORLD
    turning: float = 1.0
    joints: Any = ()
    other: Any = ()
    reference: float = 0.0
    polynomial: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0, 0.0)
    stiffness: float = 0.0
    damping: float = 0.0
    velocity_terms: bool = True
    compliance: tuple[float, float] = (0.0, 0.0)
    impedance: tuple[float, ...] | None = None


class ConstrainedDynamics(_core.ConstrainedDynamics):
    """A robot with constraints, which accelerates as they allow and feels their forces:

        robot = kalmarm.load("cassie.xml", takes_constraints=True)
        closed = kalmarm.ConstrainedDynamics(robot, proximal=1e-8)   # with the constraints of its file
        a, forces = closed.forward_dynamics(q, qd, tau)              # one state, or 4096 of (4096, nq), ...
        feet = [kalmarm.Constraint("left", "pose", "left_foot", "world"), ...]
        closed = kalmarm.ConstrainedDynamics(robot, [*robot.constraints, *feet], proximal=1e-8)

    M a + bias = tau + J' forces and J a + R forces = -dJ/dt qd - b e' - k e, of the constraints' e, e' = J qd; what acts from
    outside (`forces=`, of a robot with acted_on=["hand"]) is added to tau as its torques.

    constraints: those of the robot's file unless given; at least one.
    proximal: mu > 0 lets rows repeat each other, as those of a planar loop do, by the proximal method: a is unique still,
        forces are shared. 1e-8 is a good one. With 0 such rows are refused.
    iterations: of that, at most.

    Calls take arrays, dtypes, leading dimensions, `status` and `threads` as `Robot`'s. Outcomes: `joint` is nv + i where
    constraint i is at fault: it repeats or contradicts others, or nothing moves it. `error` estimates the relative error of a in the
    norm of the largest a(j) / sqrt(M^-1(j,j)). Of the robot's question the tolerance and the frames that are
    acted on count.
    """

    def __init__(
        self,
        robot: Robot,
        constraints: Iterable[Constraint] | None = None,
        *,
        proximal: float = 0.0,
        iterations: int = 20,
    ) -> None:
        chosen = tuple(robot.constraints if constraints is None else constraints)
        super().__init__(
            robot,
            [_plain(robot, one) for one in chosen],
            number("proximal", proximal),
            iterations,
        )
        self._made_of = (robot, chosen, proximal, iterations)

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """In the order of their rows."""
        return self._made_of[1]

    def evaluate(self, q: ArrayLike, qd: ArrayLike | None = None) -> Constraints:
        """e, J qd and J at q (..., nq): how far the constraints are open."""
        return Constraints(*self._evaluate(q, qd))

    def forward_dynamics(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        *,
        status: bool = False,
        threads: int = 1,
        forces: Any = None,
        axes: str = "aligned",
    ) -> Any:
        """q (..., nq), qd and tau (..., nv) -> `ConstrainedAcceleration`.

        forces (..., 6 f): from outside on the frames of the robot's `acted_on`, as of `Robot.forward_dynamics`."""
        answer = self._forward_dynamics(q, qd, tau, status, threads, forces, axes)
        return _named(ConstrainedAcceleration, status, answer)

    def impulse(
        self, q: ArrayLike, qd: ArrayLike, *, status: bool = False, threads: int = 1
    ) -> Any:
        """The velocity that the constraints allow next to qd, qd - M^-1 J' A^-1 J qd: q (..., nq), qd (..., nv) ->
        `Impulse`."""
        return _named(Impulse, status, self._impulse(q, qd, status, threads))

    def solve(self, q: ArrayLike, b: ArrayLike, *, status: bool = False, threads: int = 1) -> Any:
        """(M + J' R^-1 J)^-1 b, or with R = 0 the x of least energy with J x = 0: q (..., nq), b (..., nv) ->
        `ConstrainedSolution`."""
        return _named(ConstrainedSolution, status, self._solve(q, b, status, threads))

    def __repr__(self) -> str:
        return (
            f"<kalmarm.ConstrainedDynamics of {self._made_of[0].name}: {self.rows} rows of "
            f"{', '.join(one.name for one in self.constraints)}>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        robot, constraints, proximal, iterations = self._made_of
        made = partial(type(self), proximal=proximal, iterations=iterations)
        return made, (robot, constraints)


def from_numbers(given: tuple[Any, ...]) -> Constraint:
    """As the compiled loader has it."""
    name, kind, *rest = given
    return Constraint(name, KINDS[kind], *rest)


def _named(result: Any, status: bool, answer: Any) -> Any:
    return (result(*answer[0]), answer[1]) if status else result(*answer)


def _plain(robot: Robot, one: Constraint) -> tuple[Any, ...]:
    if not isinstance(one, Constraint):
        raise TypeError(f"constraints holds {one!r}: a kalmarm.Constraint is needed")
    what = f"constraint '{one.name}'"
    return (
        one.name,
        KINDS.index(one_of(f"{what}: kind", one.kind, KINDS)),
        _place(robot, what, one.first),
        _place(robot, what, one.second),
        number(f"{what}: turning", one.turning),
        _lengths(robot, one.joints),
        _lengths(robot, one.other),
        number(f"{what}: reference", one.reference),
        tuple(np.resize([*one.polynomial, 0, 0, 0, 0, 0], 5)),
        number(f"{what}: stiffness", one.stiffness),
        number(f"{what}: damping", one.damping),
        bool(one.velocity_terms),
        tuple(one.compliance),
        None if one.impedance is None else tuple(one.impedance),
    )


def _place(robot: Robot, what: str, given: Any) -> Frame:
    if isinstance(given, _core.Frame):
        return given
    offset = given if isinstance(given, Mapping) else {"frame": given}
    name = offset.get("frame")
    if name not in robot.frames and name != WORLD:
        raise unknown(f"{what}: frame", str(name), robot.frames)
    frame = robot.frames[name] if name in robot.frames else _core.Frame(-1)
    turn = np.array(frame.rotation) / np.linalg.norm(frame.rotation)
    moved = _product(_product(turn, [0, *offset.get("translation", (0, 0, 0))]), turn * [1, -1, -1, -1])
    rotation = _product(turn, offset.get("rotation", (1, 0, 0, 0)))
    return _core.Frame(frame.link, rotation.tolist(), (np.array(frame.translation) + moved[1:]).tolist())


def _product(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Of quaternions (w, x, y, z)."""
    (p, *v), (q, *w) = np.asarray(a, float), np.asarray(b, float)
    return np.array([p * q - np.dot(v, w), *(p * np.array(w) + q * np.array(v) + np.cross(v, w))])


def _lengths(robot: Robot, given: Any) -> list[float]:
    if not isinstance(given, Mapping):
        return [float(x) for x in given]
    out = np.zeros(robot.nv)
    for joint, coefficient in given.items():
        out[dofs_of(robot.dofs, [joint])] = coefficient
    return out.tolist()
