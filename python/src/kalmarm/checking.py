"""How wrong anybody's answer is, and a verdict: of accelerations, torques, solves, M and its inverse."""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core

if TYPE_CHECKING:
    from .robot import Robot


class Verdict(enum.IntEnum):
    """Of an answer, about the tolerance of its check."""

    RIGHT = 0
    WRONG = 1
    UNKNOWN = 2  # there is no answer, or its error is not known: the outcome says which


class Checked(NamedTuple):
    """Of every answer, in the leading dimensions of the states; of one state numbers.

    verdict: a `Verdict`.
    error: relative, in the energy norm |x|_M^2 = x' M x: |a - a*|_M / |a*|_M of accelerations and solves. Of torques in
        Euclid's norm, of M and M^-1 of the worst entry, |X - X*|_ij / sqrt(X*_ii X*_jj).
    euclid: in Euclid's norm, of joint accelerations as they are.
    uncertainty: by which `error` may be off.
    outcome: records of `outcome_dtype`: which precision told the error, and why there is none.
    """

    verdict: NDArray[np.int8]
    error: NDArray[np.float64]
    euclid: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    outcome: NDArray[Any]


class AnswerCheck(_core.AnswerCheck):
    """What checks answers of one robot, whoever has worked them out: memory that calls of `check` share.

    tolerance: of verdicts. Right: both errors are at most that, where an acceleration below 0.01 of gravity counts as
        that; wrong: one of them is more.
    resolution: errors below it need not be told apart: many states then take 1.3 to 1.7 times as long as their
        accelerations in float64. 0: all are told, of answers near roundoff in 4 to 5 times.
    """

    def __init__(self, robot: Robot, tolerance: float = 1e-8, resolution: float = 0.0) -> None:
        if robot._options["locked"]:
            raise ValueError("check: the robot has joints that are locked; check one without")
        super().__init__(robot.model, float(tolerance), float(resolution))
        self._made = (robot, tolerance, resolution)

    def check(
        self,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        a: ArrayLike | None = None,
        *,
        qdd: ArrayLike | None = None,
        x: ArrayLike | None = None,
        mass: ArrayLike | None = None,
        inverse: ArrayLike | None = None,
        threads: int = 1,
    ) -> Checked:
        """Of the one answer that is given: see `kalmarm.check`."""
        answers = {"a": a, "x": x, "mass": mass, "inverse": inverse}
        what, given, answer = _asked({"qd": qd, "tau": tau}, qdd, answers)
        numbers, outcomes = self._answer(what, np.asarray(q, np.float64), *given, answer, threads)
        error, euclid, uncertainty, verdict = np.moveaxis(numbers, -1, 0)
        return Checked(verdict.astype(np.int8), error, euclid, uncertainty, outcomes)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._made


# Of what each answer is: Want's name, and what else a call has.
_NEEDS = {
    "a": ("acceleration", ("qd", "tau")),
    "torques": ("inverse_dynamics", ("qd", "tau")),
    "x": ("solve", ("tau",)),
    "mass": ("mass", ()),
    "inverse": ("inverse", ()),
}


def _asked(
    inputs: dict[str, ArrayLike | None], qdd: ArrayLike | None, answers: dict[str, ArrayLike | None]
) -> tuple[str, list[NDArray[np.float64] | None], NDArray[np.float64]]:
    """What the answer is, qd and tau where it needs them, and the answer by rows of numbers."""
    given = {name: value for name, value in answers.items() if value is not None}
    if qdd is not None:  # then tau is the answer
        given["torques"] = inputs["tau"]
        inputs = {"qd": inputs["qd"], "tau": qdd if inputs["tau"] is not None else None}
    if len(given) != 1:
        names = ", ".join(given) or "none"
        raise TypeError(f"check: one answer is needed, a, tau with qdd, x, mass or inverse; given: {names}")
    ((name, answer),) = given.items()
    what, needed = _NEEDS[name]
    for one, value in inputs.items():
        if (value is None) == (one in needed):
            raise TypeError(f"check: {name} {'needs' if one in needed else 'is checked without'} {one}")
    numbers = np.asarray(answer, np.float64)
    if name in ("mass", "inverse"):
        if numbers.ndim < 2 or numbers.shape[-1] != numbers.shape[-2]:
            raise ValueError(f"check: {name} has shape {numbers.shape}; (..., nv, nv) is needed")
        numbers = numbers.reshape(*numbers.shape[:-2], -1)
    return what, [None if x is None else np.asarray(x, np.float64) for x in inputs.values()], numbers


def check(
    robot: Robot,
    q: ArrayLike,
    qd: ArrayLike | None = None,
    tau: ArrayLike | None = None,
    a: ArrayLike | None = None,
    *,
    qdd: ArrayLike | None = None,
    x: ArrayLike | None = None,
    mass: ArrayLike | None = None,
    inverse: ArrayLike | None = None,
    tolerance: float | None = None,
    resolution: float = 0.0,
    threads: int = 1,
) -> Checked:
    """How wrong an answer is that any engine has worked out, one or one a row, and a verdict.

        check(robot, q, qd, tau, a)              # of forward dynamics
        check(robot, q, qd, tau=tau, qdd=qdd)    # of inverse dynamics: tau is the answer
        check(robot, q, tau=tau, x=x)            # of M^-1 tau
        check(robot, q, mass=M), check(robot, q, inverse=X)

    The error is that of the exact answer for the numbers as they are given, by the residual in twice the precision:
    |a - a*|_M^2 = r' M^-1 r, r = tau - ID(q, qd, a). Verdicts are about `tolerance`, None: 1e-2 of an answer in
    float32, else 1e-8; see `AnswerCheck`, which takes its memory once for many calls.
    """
    if tolerance is None:
        given = next((one for one in (a, x, mass, inverse) if one is not None), tau)
        tolerance = 1e-2 if np.asarray(given).dtype == np.float32 else 1e-8
    one = AnswerCheck(robot, tolerance, resolution)
    return one.check(q, qd, tau, a, qdd=qdd, x=x, mass=mass, inverse=inverse, threads=threads)
