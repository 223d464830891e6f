"""What calls return beside plain arrays."""

from __future__ import annotations

from typing import Any, NamedTuple, TypedDict

from numpy.typing import NDArray


class Derivatives(NamedTuple):
    """Derivatives of an acceleration, and the acceleration itself, of the n DoF that are asked about.

    dq: by q, (..., n, n). Column j is for a change of q along DoF j's velocity, so that joints with
        quaternions have as many columns as DoF.
    dqd: by qd, (..., n, n).
    dtau: by tau, (..., n, n): the inverse of M, of a step that of M + h B + h^2 K.
    a: the acceleration, (..., n).
    """

    dq: NDArray[Any]
    dqd: NDArray[Any]
    dtau: NDArray[Any]
    a: NDArray[Any]


class Gradients(NamedTuple):
    """Derivatives of w'a, of w'tau or of w'x by all that the call was given: vector-Jacobian products with weights w.

    dq: by q along the velocities of the joints, (..., nv), as the columns of `Derivatives`.
    dqd: by qd, (..., nv); None of solve.
    dtau: by tau, (..., nv): M^-1 w; None of inverse dynamics.
    inertias: by (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of the link of every DoF, about its origin in its axes,
        (..., nv, 10), as the regressor of `Kinematics` has them; None unless asked for.
    dqdd: by qdd, (..., nv): M w; of inverse dynamics alone.
    armature: (..., nv); None unless asked for.
    forces: by the forces that were given, (..., 6 f), in the axes of their frames; None without any.
    loads: by the loads that were given, (..., 10 l); None without any.
    gravity: by the gravity that was given, (..., 3), in the base's axes; None without any.
    """

    dq: NDArray[Any]
    dqd: NDArray[Any] | None
    dtau: NDArray[Any] | None
    inertias: NDArray[Any] | None
    dqdd: NDArray[Any] | None
    armature: NDArray[Any] | None
    forces: NDArray[Any] | None
    loads: NDArray[Any] | None
    gravity: NDArray[Any] | None


class StepGradients(NamedTuple):
    """Derivatives of w'a of an implicit step by all that it was given, and a: vector-Jacobian products with weights w.

    dq, dqd, dtau: by q along the velocities of the joints, by qd and by tau, (..., nv) each.
    damping, stiffness, reference: by the gains and targets that the step has, or the state, (..., nv) each; those by
        springs and targets are zero at balls and free joints.
    armature: (..., nv).
    inertias, forces, loads, gravity: as of `Gradients`.
    a: (..., nv), (qd+ - qd) / h.
    """

    dq: NDArray[Any]
    dqd: NDArray[Any]
    dtau: NDArray[Any]
    damping: NDArray[Any]
    stiffness: NDArray[Any]
    reference: NDArray[Any]
    inertias: NDArray[Any] | None
    armature: NDArray[Any]
    forces: NDArray[Any] | None
    loads: NDArray[Any] | None
    gravity: NDArray[Any] | None
    a: NDArray[Any]


class OperationalSpace(NamedTuple):
    """What k rows of a Jacobian J make of a robot, of the n DoF that are asked about.

    inertia: (..., k, k), (J M^-1 J')^-1, what forces along the rows meet.
    inverse: (..., n, k), the dynamically consistent inverse M^-1 J' inertia; J times it is 1.
    projector: (..., n, n), N = 1 - inverse J: torques N' tau do not accelerate the rows, velocities N qd do not
        move along them.
    """

    inertia: NDArray[Any]
    inverse: NDArray[Any]
    projector: NDArray[Any]


class Outcomes(NamedTuple):
    """What happened to states of an operator of JAX or PyTorch.

    status: a `Status` each, int32 (...).
    error: estimated relative error of the answer, (...); NaN if there is none. In which norm: docs/errors.md.
    """

    status: Any
    error: Any


class Outcome(TypedDict):
    """What happened to a state: the fields of `outcome_dtype`, by which records are asked.

        a, outcomes = robot.forward_dynamics(q, qd, tau, status=True)
        outcomes["error"][outcomes["status"] == kalmarm.Status.OK]

    status: a `Status`: OK, or why there is no answer.
    rung: a `Rung`: which precision answered.
    near_singular: OK, but D of `joint` may be wrong by 1 per cent or more.
    widened: refined by factors of a wider precision, since its own did not help.
    joint: the DoF at which the factorisation stopped, or nearly did; -1 where it did not.
    steps: of refinement that were accepted.
    D: the innovation covariance at `joint`: the inertia that it meets [kg m^2 or kg].
    scale: what D was compared with, in the same unit: its size, or the error that it may have.
    error: estimated relative error of the answer; NaN if there is none. In which norm: docs/errors.md.
    """

    status: int
    rung: int
    near_singular: bool
    widened: bool
    joint: int
    steps: int
    D: float
    scale: float
    error: float
