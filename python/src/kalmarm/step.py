"""Implicit steps of a robot with springs, dampers and position controllers, however stiff."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._motors import Motors
from ._names import as_array, number, numbers
from .results import Derivatives
from .robot import CoupledRow, Robot

if TYPE_CHECKING:
    from ._core import Model


class Stepped(NamedTuple):
    """The state after a step and its acceleration: (..., nq), (..., nv), (..., nv)."""

    q: NDArray[Any]
    qd: NDArray[Any]
    a: NDArray[Any]


class ImplicitStep(_core.ImplicitStep):
    """Moves a robot by h, with springs and dampers taken at the end of the step.

        step = kalmarm.ImplicitStep(robot, 0.002)       # with what the robot's file has
        q, qd, a = step(q, qd, tau, ctrl=u)             # one state, or 4096 of (4096, nq), ...
        step = kalmarm.ImplicitStep(robot, 0.002, damping=200, stiffness=1e5, reference=target)
        a = step.acceleration(q, qd, tau, stiffness=kp)  # each with gains (4096, nv) of its own
        q, qd, a = step(q, qd, tau, forces=push)         # of a robot with acted_on=["hand"]

    With K and B the diagonal matrices of stiffness and damping, and f what actuators without
    stiffness exert, the compensation of gravity, and J' forces of what acts from outside,

        (M + h B + h^2 K) a = tau + f - B qd - K (q - reference + h qd) - bias,  a = (qd+ - qd) / h

    and q+ is q moved along qd+ for h: MuJoCo's integrator "discrete". scheme="springs_at_start"
    takes springs where the step begins, as MuJoCo's "implicitfast": stable for any damping, not for
    any stiffness. A position controller with gains kp and kv is a spring and a damper, its target
    their reference.

    `robot.terms` has what the file says: springs, dampers, tendons, actuators at their controls,
    and compensation of gravity. tau is added to these. An actuator whose force reaches its limit as
    the step begins is the force of that limit, without stiffness and damping, which beside tendons is
    a step that is made anew; limits on tendons are not looked at. For ball and free joints, damping alone.

    Calls take arrays, dtypes, leading dimensions, numbers, `out`, `status` and `threads` as
    `Robot`'s.
    """

    def __init__(
        self,
        robot: Robot,
        h: float,
        *,
        ctrl: Any = None,
        damping: Any = None,
        stiffness: Any = None,
        reference: Any = None,
        rows: Sequence[CoupledRow] | None = None,
        scheme: str = "springs_at_end",
    ) -> None:
        """h: [s], not negative.
        ctrl: controls of `robot.terms.actuators`, (nu,), within the file's limits; those that the
            robot was loaded with unless given.
        damping, stiffness, reference: (nv,) [N m s/rad or N s/m; N m/rad or N/m; rad or m], or one
            number for every hinge and slide; those of `robot.terms`, its file's, unless given. Force
            limits are then those of actuators without stiffness and damping.
        rows: terms that couple joints; each adds J' (armature + h damping + h^2 stiffness) J to
            the matrix. Those of `robot.terms`, the tendons of its file, unless given.
        scheme: "springs_at_end" or "springs_at_start".

        The tolerance and the frames that are acted on are the robot's. ValueError where h, a damper
        or a spring is negative, a number is not finite, a ball or free joint has a spring or is
        coupled, and where the robot's question leaves joints out.
        """
        if robot.n != robot.nv or robot.at_rest:
            raise ValueError("ImplicitStep: the robot's question leaves joints out or is at rest")
        terms = robot.terms
        given = {"damping": damping, "stiffness": stiffness, "reference": reference}
        self._own = {
            name: _of_every_dof(robot, name, getattr(terms, name) if value is None else value)
            for name, value in given.items()
        }
        self._rows = [
            (_row(robot, row.jacobian), *map(float, row[1:5]), bool(row.imposed))
            for row in (terms.rows if rows is None else rows)
        ]
        super().__init__(robot, number("h", h), *self._own.values(), self._rows, scheme)
        self._robot = robot
        self._options = {"ctrl": ctrl, **given, "rows": rows, "scheme": scheme}
        has_own_gains = any(value is not None for value in given.values())
        self._motors = Motors(robot, ctrl, has_own_gains=has_own_gains)
        self._springless = Motors(robot, ctrl, has_own_gains=True)  # beside gains of states
        self._adds = bool(terms.actuators) or bool(np.any(terms.torque))
        self._widths = robot._widths  # of operators

    def __call__(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike = 0.0,
        out: Stepped | None = None,
        *,
        ctrl: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        armature: ArrayLike | None = None,
        status: bool = False,
        threads: int = 1,
        forces: ArrayLike | None = None,
        axes: str = "aligned",
        loads: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
        contacts: ArrayLike | None = None,
    ) -> Any:
        """The state after h. Of many states, those that failed are NaN; of one, DynamicsError.

        q (..., nq), qd and tau (..., nv) -> Stepped(q, qd, a): (..., nq), (..., nv), (..., nv).

        ctrl: (..., nu), of every state its own, in place of the step's.
        damping, stiffness, reference, armature: (..., nv), of every state its own, as `acceleration` has it.
        forces: (..., 6 f), loads: (..., 10 l), gravity: (..., 3), and contacts: (..., 6 c), as
            `acceleration` has them.
        out: what an earlier call of the same shape returned, apart from the inputs.
        """
        if out is not None and (not isinstance(out, tuple) or len(out) != 3):
            raise TypeError("ImplicitStep: out is not what an earlier call returned")
        found = self.acceleration(
            q,
            qd,
            tau,
            out and out[2],
            ctrl=ctrl,
            damping=damping,
            stiffness=stiffness,
            reference=reference,
            armature=armature,
            status=status,
            threads=threads,
            forces=forces,
            loads=loads,
            gravity=gravity,
            contacts=contacts,
            axes=axes,
        )
        a, outcomes = found if status else (found, None)
        stepped = Stepped(*self.advance(q, qd, a, out and out[:2]), a)
        return (stepped, outcomes) if status else stepped

    def acceleration(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike = 0.0,
        out: Any = None,
        *,
        ctrl: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        armature: ArrayLike | None = None,
        status: bool = False,
        threads: int = 1,
        forces: ArrayLike | None = None,
        axes: str = "aligned",
        loads: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
        contacts: ArrayLike | None = None,
    ) -> Any:
        """a = (qd+ - qd) / h of the step.

        q (..., nq), qd and tau (..., nv) -> a (..., nv) [rad/s^2 or m/s^2].

        ctrl: (..., nu), controls of `robot.terms.actuators`, in place of the step's.
        damping, stiffness, reference: (..., nv), of every state its own, in place of the step's, and
            armature in place of the robot's, or one number for every hinge and slide. With h = 0 this is
            forward dynamics with armatures of states. References cost nothing; the others 1.2
            times the time of a step, but below a tolerance of 1e-12 every state then is a robot
            that is made anew. ValueError with the row and the DoF where one is negative or not
            finite, where a ball or free joint has a spring, and where dampers, springs or armatures
            stand beside rows of the step.
        forces: (..., 6 f), of each of the f frames of the robot's `acted_on` the moment about the
            origin of `axes` and the force [N m, N], as they are where the step begins, with the
            axes of `Kinematics`. ValueError where they are of another size or the robot has no
            `acted_on`.
        loads: (..., 10 l), bodies on the l frames of the robot's `loaded`, as those of
            `Robot.forward_dynamics`.
        gravity: (..., 3), in the base's axes [m/s^2], in the place of the model's, also of what the
            file compensates.
        contacts: (..., 6 c), a row w = sqrt(d) (p x f; f) of each of the c frames of the robot's
            `contacts`, as of `Robot.solve`: springs k and dampers b at bodies, d = h b + h^2 k,
            whose known forces are among `forces`. (M + h B + h^2 K + J'DJ) a = tau - bias.
            ValueError beside dampers or springs of every state.
        """
        names = ("damping", "stiffness", "reference", "armature")
        given = zip(names, self._gains(damping, stiffness, reference, armature))
        gains = {name: x for name, x in given if x is not None}
        tau, held = self._driven(
            q, qd, tau, ctrl, threads, self._springless if gains else self._motors, gravity
        )
        arguments = {"q": q, "qd": qd, "tau": tau, "forces": forces, "loads": loads}
        arguments |= {"gravity": gravity, "contacts": contacts}
        options: dict[str, Any] = {"status": status, "threads": threads, "axes": axes}
        if held and not gains and self._rows:
            arrays = {
                name: as_array(x, tau.dtype) for name, x in arguments.items() if x is not None
            }
            return self._beside_rows(arrays, held, out, options)
        return super().acceleration(**arguments, out=out, **(gains or held), **options)

    def derivatives(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike = 0.0,
        out: Derivatives | None = None,
        *,
        ctrl: ArrayLike | None = None,
        status: bool = False,
        forces: ArrayLike | None = None,
        axes: str = "aligned",
        loads: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
    ) -> Any:
        """Derivatives of the step's acceleration by q, qd and tau, analytically, and a itself.

        q (..., nq), qd and tau (..., nv) -> Derivatives(dq, dqd, dtau, a), as those of
        Robot.forward_dynamics_derivatives; dtau is the inverse of M + h B + h^2 K. out: what an
        earlier call of the same shape returned. ValueError where an actuator with stiffness or
        damping is at a force limit.

        forces: (..., 6 f), as `acceleration` has it, that turn with their frames: ValueError in
            other axes than "local". loads: (..., 10 l), and gravity: (..., 3), likewise.
        """
        tau = self._driven_freely("derivatives", q, qd, tau, ctrl, self._motors, gravity)
        found = super().derivatives(
            q, qd, tau, out, status=status, forces=forces, axes=axes, loads=loads, gravity=gravity
        )
        weights = self._robot.terms.compensated
        if weights is not None:
            d = found[0] if status else found
            d.dq[...] += d.dtau @ _gravity_by_q(weights, q, gravity).astype(d.dq.dtype)
        return found

    def acceleration_vjp(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        w: ArrayLike,
        *,
        ctrl: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        armature: ArrayLike | None = None,
        inertias: bool = False,
        status: bool = False,
        threads: int = 1,
        forces: ArrayLike | None = None,
        loads: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
    ) -> Any:
        """Derivatives of w'a, a = (qd+ - qd) / h of the step, by all that a depends on, in O(n): no matrix is formed.

        q (..., nq), qd, tau and w (..., nv) -> `StepGradients`. About 3.4 times the time of a step. damping, stiffness
        and reference, armature: as of `acceleration`. inertias: those by these are worked out too. forces, loads and
        gravity: as of `Robot.forward_dynamics_vjp`. Outcomes: of a and of the step's solve of w, the worse of both.
        ValueError where the step has rows, where the robot's file compensates gravity, and where an actuator with stiffness or
        damping is at a force limit.
        """
        gains = self._gains(damping, stiffness, reference, armature)
        tau = self._driven_alone("acceleration_vjp", q, qd, tau, ctrl, gains)
        return self._vector_jacobian(
            q, qd, tau, w, *gains, inertias, status, threads, forces, loads, gravity
        )

    def acceleration_jvp(
        self,
        q: ArrayLike,
        qd: ArrayLike,
        tau: ArrayLike,
        dq: ArrayLike,
        dqd: ArrayLike,
        dtau: ArrayLike,
        *,
        ctrl: ArrayLike | None = None,
        damping: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        reference: ArrayLike | None = None,
        armature: ArrayLike | None = None,
        ddamping: ArrayLike | None = None,
        dstiffness: ArrayLike | None = None,
        dreference: ArrayLike | None = None,
        darmature: ArrayLike | None = None,
        status: bool = False,
        threads: int = 1,
        forces: ArrayLike | None = None,
        loads: ArrayLike | None = None,
        gravity: ArrayLike | None = None,
    ) -> Any:
        """How a of the step changes, (..., nv), along dq, dqd and dtau (..., nv), dq along the velocities of the joints,
        and along ddamping, dstiffness, dreference and darmature where they are given. About 3.6 times the time
        of a step; other arguments, outcomes and errors as of `acceleration_vjp`."""
        gains = self._gains(damping, stiffness, reference, armature)
        tau = self._driven_alone("acceleration_jvp", q, qd, tau, ctrl, gains)
        along = (ddamping, dstiffness, dreference, darmature)
        return self._jacobian_vector(
            q, qd, tau, dq, dqd, dtau, *gains, *along, status, threads, forces, loads, gravity
        )

    def _beside_rows(
        self, arguments: dict[str, Any], held: dict[str, Any], out: Any, options: dict[str, Any]
    ) -> Any:
        """Each state with gains of its own is a step that is made anew. arguments: arrays."""

        def step(gains: dict[str, Any]) -> _core.ImplicitStep:
            own = (gains[name].tolist() for name in self._own)
            return _core.ImplicitStep(self._robot, self.h, *own, self._rows, self.scheme)

        if arguments["tau"].ndim == 1:  # one state, of many forces too
            return step(held).acceleration(**arguments, out=out, **options)
        a, outcomes = super().acceleration(
            **arguments, out=out, reference=held["reference"], **(options | {"status": True})
        )
        leading = a.shape[:-1]
        arguments, held = (
            {name: np.broadcast_to(x, (*leading, *x.shape[-1:])) for name, x in some.items()}
            for some in (arguments, held)
        )
        changed = np.zeros(leading, bool)
        for name in ("damping", "stiffness"):
            changed |= np.any(held[name] != np.asarray(self._own[name], a.dtype), axis=-1)
        for i in map(tuple, np.argwhere(changed)):
            gains, state = ({name: x[i] for name, x in some.items()} for some in (held, arguments))
            a[i], outcomes[i] = step(gains).acceleration(
                **state, status=True, axes=options["axes"]
            )
        return (a, outcomes) if options["status"] else a

    def _driven(
        self, q: Any, qd: Any, tau: Any, ctrl: Any, threads: int, motors: Motors, gravity: Any
    ) -> tuple[Any, dict[str, Any]]:
        """tau with what the file adds, and gains in the place of the step's own."""
        weights = self._robot.terms.compensated
        if not self._adds and weights is None and ctrl is None:
            return tau, {}
        like = as_array(q)
        dtype = like.dtype if like.dtype.kind == "f" else np.dtype(float)
        driven = motors.driven(like, as_array(qd), ctrl)
        added = driven.torque.astype(dtype)
        if weights is not None:  # with status: the step says what is wrong with q
            added = added + weights.gravity(q, status=True, threads=threads, gravity=gravity)[0]
        gains = {name: x.astype(dtype) for name, x in driven.gains().items()}
        return as_array(tau, dtype) + added, gains

    def _driven_freely(
        self, call: str, q: Any, qd: Any, tau: Any, ctrl: Any, motors: Motors, gravity: Any = None
    ) -> Any:
        """tau with what the file adds, where no actuator with gains is at a limit."""
        tau, held = self._driven(q, qd, tau, ctrl, 1, motors, gravity)
        if held:
            raise ValueError(
                f"{call}: an actuator with stiffness or damping is at its force limit, or at a "
                "control that changes them"
            )
        return tau

    def _driven_alone(
        self, call: str, q: Any, qd: Any, tau: Any, ctrl: Any, gains: list[Any]
    ) -> Any:
        """The same, where nothing that the file adds depends on q."""
        if self._robot.terms.compensated is not None:
            raise ValueError(f"{call}: the robot's file compensates gravity, which depends on q")
        has_gains = any(x is not None for x in gains)
        motors = self._springless if has_gains else self._motors
        return self._driven_freely(call, q, qd, tau, ctrl, motors)

    def _check_has_gains_alone(self, call: str) -> None:
        """Whether gains and targets say all that the step does beside the robot."""
        if self._rows or self._adds or self._robot.terms.compensated is not None:
            raise ValueError(
                f"{call}: of a step with rows, or whose robot's file has actuators or compensates gravity: load it "
                "without takes_steps, and give gains and targets"
            )

    def _gains(self, damping: Any, stiffness: Any, reference: Any, armature: Any) -> list[Any]:
        given = {"damping": damping, "stiffness": stiffness, "reference": reference, "armature": armature}
        return [None if x is None else self._gain(name, x) for name, x in given.items()]

    def _gain(self, name: str, value: Any) -> Any:
        """One number is of every hinge and slide."""
        return value if np.ndim(value) else _of_every_dof(self._robot, name, value)

    @property
    def model(self) -> Model:
        """The robot's model, without what the step adds."""
        return self._robot.model

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


def _gravity_by_q(weights: Robot, q: ArrayLike, gravity: ArrayLike | None) -> NDArray[np.float64]:
    """Derivatives of the torque that bears the weights, (..., nv, nv).

    With that torque g(q) and dampers of one the robot of the weights stands still, so that by q its
    acceleration M^-1 (g - g(q)) changes by -M^-1 dg/dq: no M here is singular, as that of weights is.
    """
    q = np.asarray(q, float)
    still = ImplicitStep(weights, 1.0, damping=np.ones(weights.nv))
    held, _ = weights.gravity(q, status=True, gravity=gravity)
    d, _ = still.derivatives(q, np.zeros_like(held), held, status=True, gravity=gravity)
    return np.linalg.solve(d.dtau, -d.dq)
