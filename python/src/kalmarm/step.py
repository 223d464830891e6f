"""Implicit steps of a robot with springs, dampers and position controllers, however stiff."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._names import number, numbers
from .robot import CoupledRow, Robot


class Stepped(NamedTuple):
    """The state after a step and its acceleration: (..., nq), (..., nv), (..., nv)."""

    q: NDArray[Any]
    qd: NDArray[Any]
    a: NDArray[Any]


class ImplicitStep(_core.ImplicitStep):
    """Moves a robot by h, with springs and dampers taken at the end of the step.

        step = kalmarm.ImplicitStep(robot, 0.002, damping=200, stiffness=1e5, reference=target)
        q, qd, a = step(q, qd, tau)             # one state, or 4096 of (4096, nq), ...
        a = step.acceleration(q, qd, tau, stiffness=kp)  # each with gains (4096, nv) of its own

    With K and B the diagonal matrices of stiffness and damping,

        (M + h B + h^2 K) a = tau - B qd - K (q - reference + h qd) - bias,  a = (qd+ - qd) / h

    and q+ is q moved along qd+ for h: MuJoCo's integrator "discrete". scheme="springs_at_start"
    takes springs where the step begins, as MuJoCo's "implicitfast": stable for any damping, not for
    any stiffness. A position controller with gains kp and kv is a spring and a damper, its target
    their reference.

    Calls take arrays, dtypes, leading dimensions, `out`, `status` and `threads` as `Robot`'s.
    """

    def __init__(
        self,
        robot: Robot,
        h: float,
        *,
        damping: Any = None,
        stiffness: Any = None,
        reference: Any = None,
        rows: Sequence[CoupledRow] | None = None,
        scheme: str = "springs_at_end",
    ) -> None:
        """h: [s], not negative.
        damping, stiffness, reference: (nv,) [N m s/rad or N s/m; N m/rad or N/m; rad or m], or one
            number for every hinge and slide; those of `robot.terms`, its file's, unless given.
        rows: terms that couple joints; each adds J' (armature + h damping + h^2 stiffness) J to
            the matrix. Those of `robot.terms`, the tendons of its file, unless given.
        scheme: "springs_at_end" or "springs_at_start".

        The tolerance is the robot's. ValueError where h, a damper or a spring is negative, a number is
        not finite, a ball or free joint has a spring or is coupled, and where the robot's question
        leaves joints out.
        """
        if robot.n != robot.nv or robot.at_rest:
            raise ValueError("ImplicitStep: the robot's question leaves joints out or is at rest")
        terms = robot.terms
        given = {
            "damping": terms.damping if damping is None else damping,
            "stiffness": terms.stiffness if stiffness is None else stiffness,
            "reference": terms.reference if reference is None else reference,
        }
        super().__init__(
            robot.model,
            number("h", h),
            *(_of_every_dof(robot, name, value) for name, value in given.items()),
            [
                (_row(robot, row.jacobian), *map(float, row[1:5]), bool(row.imposed))
                for row in (terms.rows if rows is None else rows)
            ],
            scheme,
            robot.tolerance,
        )
        self._robot = robot
        self._options = {**given, "rows": rows, "scheme": scheme}

    def __call__(
        self,
        q: Any,
        qd: Any,
        tau: Any,
        *,
        damping: Any = None,
        stiffness: Any = None,
        reference: Any = None,
        threads: int = 1,
    ) -> Stepped:
        """The state after h. Of many states, those that failed are NaN; of one, DynamicsError.

        damping, stiffness, reference: (..., nv), of every state its own, as `acceleration` has it.
        """
        gains = {"damping": damping, "stiffness": stiffness, "reference": reference}
        a = self.acceleration(q, qd, tau, **gains, threads=threads)
        return Stepped(*self.advance(q, qd, a), a)

    @property
    def robot(self) -> Robot:
        """The robot whose mass matrix is M + h B + h^2 K, without rows: for mass_matrix,
        inverse_mass_matrix, factor, solve, diagonal and log_det of it."""
        return self._robot.with_model(self._stiff_model)

    def __repr__(self) -> str:
        return f"<kalmarm.ImplicitStep of {self._robot.name}, h = {self.h:g} s, {self.scheme}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """By its definition, as a robot."""
        return partial(type(self), **self._options), (self._robot, self.h)


def _row(robot: Robot, jacobian: ArrayLike) -> list[float]:
    given = numbers("ImplicitStep: a row's jacobian", jacobian)
    if given.shape != (robot.nv,):
        raise ValueError(
            f"ImplicitStep: a row's jacobian has shape {given.shape}, ({robot.nv},) is needed"
        )
    return [float(x) for x in given]


def _of_every_dof(robot: Robot, name: str, value: Any) -> list[float]:
    given = numbers(f"ImplicitStep: {name}", value)
    if given.ndim == 0:
        return [float(given) if single else 0.0 for single in robot.model.single]
    if given.shape != (robot.nv,):
        raise ValueError(
            f"ImplicitStep: {name} has shape {given.shape}, () or ({robot.nv},) is needed"
        )
    return [float(x) for x in given]
