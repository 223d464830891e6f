"""A robot and what is asked of it."""

from __future__ import annotations

import enum
import importlib.util
import itertools
import os
import shutil
import sys
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from . import _core
from .kinematics import Kinematics
from .loads import payload
from .results import OperationalSpace
from ._names import dofs_of, number, numbers, one_of, several, unknown

if TYPE_CHECKING:
    from ._core import Frame, Model, Recommendation
    from .constrained import Constraint


class Status(enum.IntEnum):
    """The field `status` of an outcome."""

    OK = 0
    SINGULAR = 1  # D of a joint cannot be told from zero in the working precision
    INDEFINITE = 2  # D of a joint is negative or not a number
    NOT_FINITE = 3  # the result overflowed, or the state held a NaN


class Rung(enum.IntEnum):
    """Which precision answered: the field "rung" of an outcome."""

    FLOAT_LANES = 0
    FLOAT64 = 1
    REFINED = 2
    TWO_DOUBLES = 3


class State(NamedTuple):
    """Position, velocity and torques: (..., nq), (..., nv), (..., nv)."""

    q: NDArray[Any]
    qd: NDArray[Any]
    tau: NDArray[Any]


class CoupledRow(NamedTuple):
    """A length J q of hinges and slides, and what acts along it: a tendon, an actuator on several
    joints, an equality of joints. The units are those of a length in metres."""

    jacobian: ArrayLike  # J: (nv,), zero at balls and free joints
    armature: float = 0.0  # [kg]
    damping: float = 0.0  # [N s/m]
    stiffness: float = 0.0  # [N/m]
    reference: float = 0.0  # [m], of the spring or of what is imposed
    imposed: bool = False  # J q = reference at the end of the step, whatever force that takes


class Actuator(NamedTuple):
    """Of the file, on a hinge, a slide or a fixed tendon of the length q: it moves its DoF, or along
    its tendon's J, by gain u + constant - stiffness q - damping qd at the control u. One at a force
    limit is the force of that limit alone."""

    name: str
    dof: int  # -1 on a tendon
    control: float  # u, within the file's limits of it
    gain: float  # [N m or N] of a unit of u
    constant: float  # [N m or N]
    stiffness: float  # of a gain by length or velocity at this u
    damping: float
    row: int = -1  # of `Terms.rows`, on a tendon
    stiffness_by_control: float = 0.0  # how stiffness and damping change with u
    damping_by_control: float = 0.0
    control_range: tuple[float, float] = (-np.inf, np.inf)
    force_range: tuple[float, float] = (-np.inf, np.inf)  # [N m or N], on a DoF


@dataclass(frozen=True, eq=False)
class Terms:
    """What a robot's file says of implicit steps, each (nv,): linear dampers, springs of hinges and
    slides with their references, and actuators at their controls.

    torque: of actuators without stiffness.
    rows: fixed tendons, with their actuators.
    compensated: the robot of the weights that the file compensates (gravcomp), whose `gravity(q)`
        is added to tau; None where there is none.
    force_range: (nv, 2), of what the actuators of a DoF exert together; None: without limits.
    """

    damping: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    reference: NDArray[np.float64]
    torque: NDArray[np.float64]
    actuators: tuple[Actuator, ...] = ()
    compensated: Robot | None = None
    rows: tuple[CoupledRow, ...] = ()
    force_range: NDArray[np.float64] | None = None


# Calls that generated code answers, and what each is of a question; bias and gravity are inverse dynamics.
_COMPILED = {
    "forward_dynamics": "acceleration",
    "inverse_dynamics": "inverse_dynamics",
    "mass_matrix": "mass",
    "inverse_mass_matrix": "inverse",
    "diagonal": "diagonal",
    "solve": "solve",
    "forward_dynamics_derivatives": "derivatives",
}
_DTYPES = ("float64", "float32")


class Code(NamedTuple):
    """What `Robot.compile` was asked for."""

    tasks: tuple[str, ...]
    rows: bool
    dtypes: tuple[str, ...]
    compiler: tuple[str, ...]
    cache: str
    timeout: float


_numbers = itertools.count()
_by_number: WeakValueDictionary[int, Robot] = WeakValueDictionary()


def numbered(number: int) -> Robot:
    """The robot of this process that has the number, by which operators of PyTorch name it."""
    if number not in _by_number:
        raise ValueError(f"robot {number} of an operator is no more, or is another process's")
    return _by_number[number]


@dataclass(frozen=True)
class Description:
    """A robot as it is before anything is asked of it."""

    name: str
    model: Model
    q0: NDArray[np.float64]  # (nq,): where it starts
    q_range: NDArray[np.float64]  # (nq, 2): of random states
    frames: Mapping[str, Frame] = field(default_factory=dict)  # by the names of sites and bodies
    notes: tuple[str, ...] = ()  # what was ignored, each a line
    terms: Terms | None = None  # of implicit steps; None: none
    constraints: tuple[Constraint, ...] = ()


class Robot(_core.Robot):
    """The dynamics of a robot, by a filter that factors the inverse of its mass matrix.

    Made by `load`, `from_mujoco`, `from_pinocchio` or a `Builder`. Every call takes one state, q of
    shape (nq,), or states in leading dimensions, (..., nq), and returns as many results:

        a = robot.forward_dynamics(q, qd, tau)              # (nv,)
        a = robot.forward_dynamics(q, qd, tau, threads=2)   # (4096, nv) of q (4096, nq), ...

    - Leading dimensions are broadcast as NumPy does it: one q (nq,) and many tau (4096, nv), or the
      other way round. All but the first argument may be one number, for every DoF.
    - dtype: float32 or float64, one for all arrays of a call; the result has it too. Lists are
      taken for float64 where no array says otherwise. Anything that lends its memory is an array:
      NumPy, the buffer protocol, DLPack (PyTorch tensors on the CPU).
    - out: an array that the result is written to, contiguous and apart from the inputs.
    - threads: cores for many states, 0 for all; bits of the result do not depend on it.
    - Failure: of one state DynamicsError is raised; of many the rows that failed are NaN. Where
      answers are not to be relied upon, one RuntimeWarning says why, and of many states which rows.
      With status=True nothing is raised or warned of, and (result, outcomes) is returned: records
      of `outcome_dtype`, whose status is a `Status`.
    - Robots are pickled and copied, to other processes too, by their definition.
    - Any number of Python threads may call one robot at once: each call takes memory of its own.
      Python's global lock is released for many states, and for robots of 64 DoF or more.

    q and qd are in the order of `dofs`, and as MuJoCo has them: hinges in rad, slides in m, ball
    joints a quaternion (w, x, y, z) and the angular velocity in the body's axes; a free joint is a
    position and a quaternion, 7 entries of q, and the linear velocity in the world's axes, then the
    angular one in the body's: 6 of qd.
    """

    def __init__(
        self,
        description: Description,
        *,
        tolerance: float | None = None,
        wants: Iterable[str] = (),
        asked: Iterable[str | int] = (),
        frames: Iterable[str | Frame] = (),
        acted_on: Iterable[str | Frame] = (),
        contacts: Iterable[str | Frame] = (),
        loaded: Iterable[str | Frame] = (),
        locked: Iterable[str | int] = (),
        q: Any = None,
        at_rest: bool = False,
        rules: Iterable[str] | None = None,
        code: Code | None = None,
    ) -> None:
        """What is asked of the robot that the description describes.

        tolerance: relative error that an answer without a warning may have, from `last_bits` to 1; None:
            1e-2 in float32 and 1e-8 in float64. A wider precision answers where it has to; below 1e-12
            every answer is refined, for 3 to 4 times the time.
        wants: "acceleration", "inverse", "diagonal", "log_det", "mass", "operational",
            "operational_diagonal", "solve", "inverse_dynamics", "derivatives"; all unless told.
        asked: the joints that results are about; all that are free unless told.
        frames: of `operational` and its diagonal, by the name of a site or body.
        acted_on: frames on which forces act from outside, in the order of a call's `forces`.
        contacts: frames where contacts resist, a row of a call's `contacts` each: of three directions at a point a
            frame is named three times. Forward dynamics takes none: a = solve(q, tau - bias(q, qd), contacts=...).
        loaded: frames on which bodies may hang, in the order of a call's `loads` (`payload`).
        locked: joints that stand still, at the positions that q (nq,) has for them, or q0.
        at_rest: qd is zero, and is not looked at.
        rules: by which work may be left out, of docs/questions.md; all unless told.
        code: of `compile`, which is how to have it.
        """
        options: dict[str, Any] = {
            "tolerance": None if tolerance is None else number("tolerance", tolerance),
            "wants": several("wants", wants),
            "asked": several("asked", asked),
            "frames": several("frames", frames),
            "acted_on": several("acted_on", acted_on),
            "contacts": several("contacts", contacts),
            "loaded": several("loaded", loaded),
            "locked": several("locked", locked),
            "q": None if q is None else tuple(numbers("q", q).ravel().tolist()),
            "at_rest": bool(at_rest),
            "rules": None if rules is None else several("rules", rules),
            "code": code,
        }
        names = description.model.dofs
        locked_dofs = dofs_of(names, options["locked"])
        super().__init__(
            description.model,
            options["tolerance"],
            options["wants"],
            dofs_of(names, options["asked"]),
            [_frame(description, frame) for frame in options["frames"]],
            [_frame(description, frame) for frame in options["acted_on"]],
            [_frame(description, frame) for frame in options["contacts"]],
            [_frame(description, frame) for frame in options["loaded"]],
            locked_dofs,
            options["q"] or (description.q0 if locked_dofs else ()),
            options["at_rest"],
            options["rules"],
            *_code_arguments(code),
        )
        self._description = description
        self._options = options
        # What operators of PyTorch see of a robot while they are traced: Python's own objects.
        loads = 10 * len(options["loaded"])
        self._widths = {"q": self.nq, "v": self.nv, "n": self.n, "l": loads, "g": 3}
        self._number = next(_numbers)
        _by_number[self._number] = self

    def replace(self, **options: Any) -> Robot:
        """The same robot with other options of `Robot`: tolerance, asked, locked, at_rest, ..."""
        unknown_options = options.keys() - self._options.keys()
        if unknown_options:
            raise TypeError(f"replace: no option is called '{unknown_options.pop()}'")
        return Robot(self._description, **(self._options | options))

    def compile(
        self,
        tasks: Iterable[str] = ("forward_dynamics", "inverse_dynamics", "mass_matrix"),
        *,
        rows: bool = True,
        dtypes: Iterable[str] = _DTYPES,
        compiler: str | Iterable[str] | None = None,
        cache: str | os.PathLike[str] | None = None,
        timeout: float = 120.0,
    ) -> Robot:
        """The same robot, which answers by C code that is generated for it and compiled now: same calls, results and
        outcomes. What cannot be compiled is answered as before, with one RuntimeWarning; `compiled` has all of it.

        tasks: "forward_dynamics", "inverse_dynamics" (and bias and gravity), "mass_matrix", "inverse_mass_matrix",
            "diagonal", "solve" and "forward_dynamics_derivatives" (of states in rows). Where the loops are faster in one state, they answer it.
        rows: for many states a call too. dtypes: "float64", "float32", of which one state is answered in float64
            as it always is, without generated code.
        compiler: a C compiler (gcc 12 or later, clang), or a list of it and its first arguments; unless told $CC, else
            cc, clang or gcc, else the package ziglang.
        cache: a folder of this user alone (mode 0700) where code stays for the next time; unless told code in
            $KALMARM_CACHE or in kalmarm in $XDG_CACHE_HOME or ~/.cache.
        timeout: seconds that the compiler may take for a file.
        """
        command = [compiler] if isinstance(compiler, str) else compiler or ()
        code = Code(
            tuple(one_of("tasks", task, tuple(_COMPILED)) for task in several("tasks", tasks)),
            bool(rows),
            tuple(one_of("dtypes", np.dtype(one).name, _DTYPES) for one in several("dtypes", dtypes)),
            tuple(os.fspath(word) for word in command),
            "" if cache is None else os.fspath(cache),
            number("timeout", timeout),
        )
        robot = self.replace(code=code)
        left = [line for line in robot.compiled if "loops answer: " in line]
        if left:
            more = f" (and {len(left) - 1} more: see compiled)" if len(left) > 1 else ""
            warnings.warn(f"compile: {left[0]}{more}", RuntimeWarning, stacklevel=2)
        return robot

    @property
    def name(self) -> str:
        return self._description.name

    @property
    def dofs(self) -> list[str]:
        """Names of the degrees of freedom, in the order of qd; of a joint "ball" that has several
        "ball:x", ...; of a free joint "base:x" to "base:z", which slide, and "base:r:x" to
        "base:r:z"."""
        return self._description.model.dofs

    @property
    def q0(self) -> NDArray[np.float64]:
        """Where the robot starts, (nq,)."""
        return self._description.q0.copy()

    @property
    def frames(self) -> Mapping[str, Frame]:
        """Frames by the names of the robot's sites and bodies."""
        return self._description.frames

    @property
    def notes(self) -> tuple[str, ...]:
        """What of the robot's file is no part of these dynamics, each a line."""
        return self._description.notes

    @property
    def terms(self) -> Terms:
        """What the robot's file says of springs, dampers and actuators: for `ImplicitStep`."""
        if self._description.terms is not None:
            return self._description.terms
        return Terms(*(np.zeros(self.nv) for _ in range(4)))

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """Of the robot's file, where `load` took them: for `ConstrainedDynamics`."""
        return self._description.constraints

    @property
    def model(self) -> Model:
        """The robot as numbers."""
        return self._description.model

    @property
    def at_rest(self) -> bool:
        """Whether qd is taken for zero."""
        at_rest: bool = self._options["at_rest"]
        return at_rest

    def kinematics(
        self,
        frames: Iterable[str | Frame] | None = None,
        *,
        bodies: Iterable[str | Frame] = (),
    ) -> Kinematics:
        """Where frames and all bodies are and how they move: of the frames by name, or those of the
        robot's question. bodies: the links that these frames are on are those by whose parameters the
        regressor is; all unless told."""
        if frames is None:
            frames = self._options["frames"]
        chosen = several("frames", frames)
        names = [one if isinstance(one, str) else f"frame {i}" for i, one in enumerate(chosen)]
        links = [_frame(self._description, one).link for one in several("bodies", bodies)]
        return Kinematics(
            self.model, names, [_frame(self._description, one) for one in chosen], links
        )

    @overload
    def operational_space(
        self,
        q: ArrayLike,
        J: ArrayLike,
        *,
        alike: int = 3,
        damping: float = 0.0,
        clamp: float = ...,
        status: Literal[False] = False,
        threads: int = 1,
    ) -> OperationalSpace: ...

    @overload
    def operational_space(
        self,
        q: ArrayLike,
        J: ArrayLike,
        *,
        alike: int = 3,
        damping: float = 0.0,
        clamp: float = ...,
        status: Literal[True],
        threads: int = 1,
    ) -> tuple[OperationalSpace, NDArray[Any]]: ...

    def operational_space(
        self,
        q: ArrayLike,
        J: ArrayLike,
        *,
        alike: int = 3,
        damping: float = 0.0,
        clamp: float = float("inf"),
        status: bool = False,
        threads: int = 1,
    ) -> Any:
        """(J M^-1 J')^-1 of any rows of a Jacobian, the dynamically consistent inverse, and the projector of what
        they leave free.

        q (..., nq), J (..., k, n), such as rows of `kinematics(...).compute(["jacobians"], q)`; n: the DoF that
        are asked about. alike: how many rows that follow each other have their unit in common, at most k.
        damping and clamp: as of `operational_inertia`. Outcomes: as there. M^-1 is formed: the question has to
        want "inverse".
        """
        J = np.asarray(J)
        if J.ndim < 2 or J.shape[-1] != self.n:
            raise ValueError(
                f"operational_space: J has the shape {J.shape}, needed (..., k, {self.n})"
            )
        k = J.shape[-2]
        flat = J.reshape(*J.shape[:-2], k * self.n)
        *results, outcomes = self._operational_space(
            q, flat, k, min(alike, k), damping, clamp, status, threads
        )
        space = OperationalSpace(*results)
        return (space, outcomes) if status else space

    def operational_vjp(
        self,
        q: ArrayLike,
        W: ArrayLike,
        *,
        inertias: bool = False,
        armature: bool = False,
        status: bool = False,
        threads: int = 1,
        loads: ArrayLike | None = None,
    ) -> Any:
        """Derivatives of tr(W'X), X = J M^-1 J' of the k rows of `frames` as `operational` has it, by q, loads and what M
        depends on, in O(n k): no matrix is formed.

        q (..., nq), W (..., k, k) -> `Gradients`, of which dqd and dtau are None. inertias, armature: those by these are
        worked out too. loads: as of `forward_dynamics`; those by them are returned. Outcomes: the worst of M^-1 J' and
        M^-1 J'W.
        """
        weights = np.asarray(W)
        k = 6 * len(self._options["frames"])
        if weights.shape[-2:] != (k, k):
            raise ValueError(f"operational_vjp: W has the shape {weights.shape}, needed (..., {k}, {k})")
        weights = weights.reshape(*weights.shape[:-2], k * k)
        return self._operational_vjp(q, weights, inertias, armature, status, threads, loads)

    def with_model(self, model: Model) -> Robot:
        """The same question of another robot with the same joints: ValueError where a DoF or an
        entry of q is another."""
        ours, theirs = (list(zip(one.dofs, one.coordinates)) for one in (self.model, model))
        if ours != theirs:
            raise ValueError(
                f"with_model: the model is not of {self.name}, whose DoF are {_listed(ours)}: "
                f"it has {_listed(theirs)}"
            )
        return Robot(replace(self._description, model=model), **self._options)

    def parameters(self, bodies: Iterable[str | Frame]) -> NDArray[np.float64]:
        """The ten numbers (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of the links that these bodies are on, about their
        origins in their axes, (b, 10), as the regressor and `with_parameters` have them. A link has all bodies that
        are fixed to it."""
        out = [_parameters(self.model, link) for link in self._links("parameters", bodies)]
        return np.array(out).reshape(-1, 10)

    def with_parameters(
        self, bodies: Iterable[str | Frame], *, kept: float = 0.1
    ) -> tuple[Robot, NDArray[np.float64]]:
        """The same robot, of which the links that these bodies are on have inertial parameters that come with every
        call, a robot of its own in every row; and what it keeps of them, (b, 10), the share `kept` of its own.

            varied, rest = robot.with_parameters(["link7", "link6"])
            pi = robot.parameters(["link7", "link6"]) * scale[:, None, None]  # (rows, 2, 10)
            a = varied.forward_dynamics(q, qd, tau, loads=(pi - rest).reshape(-1, 20))

        They are the first 10 b numbers of `loads`, (..., 10 b), before those of `loaded`. A row is refused by itself
        where what it has beyond `rest` is no body. Gradients by them are `Gradients.loads`. Of a robot that keeps
        nothing of heavy links few rows are answered in lanes: kept=0 takes up to 40 times as long. Gravity of rows is
        `gravity` of a call; springs, dampers and armatures of rows are those of `ImplicitStep`, with h = 0 too.
        """
        if not 0 <= kept < 1:
            raise ValueError(f"with_parameters: kept is {kept}, from 0 to below 1 is needed")
        links = self._links("with_parameters", bodies)
        links_of_model, *rest = self.model.__getstate__()
        lighter = [
            (*link[:8], kept * link[8], *link[9:11], tuple(kept * one for one in link[11]))
            if k in links
            else link
            for k, link in enumerate(links_of_model)
        ]
        model = _core.Model.__new__(_core.Model)
        model.__setstate__((lighter, *rest))
        loaded = (*(_core.Frame(link) for link in links), *self._options["loaded"])
        varied = Robot(
            replace(self._description, model=model), **(self._options | {"loaded": loaded})
        )
        return varied, np.array([_parameters(model, link) for link in links]).reshape(-1, 10)

    def _links(self, call: str, bodies: Iterable[str | Frame]) -> list[int]:
        links: list[int] = []
        for body in several("bodies", bodies):
            link = _frame(self._description, body).link
            if link < 0 or link in links:
                why = "does not move" if link < 0 else "is on the link of another one"
                raise ValueError(f"{call}: body {body!r} {why}")
            links.append(link)
        return links

    def dof(self, joint: str) -> int:
        """The first DoF of a joint."""
        return dofs_of(self.dofs, [joint])[0]

    def neutral(self, *, dtype: DTypeLike = np.float64) -> NDArray[Any]:
        """q = 0, (nq,), with quaternions (1, 0, 0, 0). The home of the robot's file is `q0`."""
        q = np.zeros(self.nq, dtype)
        q[self.model.quaternions] = 1
        return q

    def random_configuration(
        self,
        lower: ArrayLike,
        upper: ArrayLike,
        rng: np.random.Generator | int | None = None,
        count: int | None = None,
    ) -> NDArray[Any]:
        """q of one state, (nq,), or of `count`, (count, nq), in the dtype of the bounds.

        Hinges [rad], slides and free positions [m] are uniform from lower to upper, (nq,) each;
        quaternions are uniform over all rotations, and their bounds are not read. ValueError with
        the DoF where a bound is not finite or lower is above upper. rng: a generator, or its seed.
        """
        seed = np.random.default_rng(rng).integers(2**64, dtype=np.uint64)
        return self._random_configuration(lower, upper, int(seed), count)

    def random_state(
        self,
        rng: np.random.Generator | int | None = None,
        count: int | None = None,
        *,
        dtype: DTypeLike = np.float64,
    ) -> State:
        """q, qd and tau, of one state or of `count`.

        Positions are uniform within their ranges (a joint's limits; else hinges within +-pi, slides
        within +-0.5 m and free positions within +-1 m), orientations uniform, qd and tau standard
        normal.
        """
        rng = np.random.default_rng(rng)
        leading = () if count is None else (count,)
        low, high = self._description.q_range.T
        q = rng.uniform(low, high, (*leading, self.nq))
        for i in self._description.model.quaternions:
            quaternion = rng.standard_normal((*leading, 4))
            q[..., i : i + 4] = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
        qd, tau = (rng.standard_normal((*leading, self.nv)) for _ in range(2))
        return State(q.astype(dtype), qd.astype(dtype), tau.astype(dtype))

    def recommend(
        self,
        tolerance: float = 1e-6,
        q: Any = None,
        qd: Any = None,
        tau: Any = None,
        *,
        count: int = 100,
        rng: np.random.Generator | int | None = 0,
    ) -> Recommendation:
        """Which tolerance is enough, and which dtype for many states a call, measured in the states
        q, qd, tau (..., in float64), or in `count` random ones.

        tolerance: on |da| / |a|, and on M^-1 scaled by its diagonal. The robot's question counts,
        and where it wants everything, acceleration and inverse.
        """
        if (q is None) != (qd is None) or (q is None) != (tau is None):
            raise ValueError("recommend: q, qd and tau are given together or not at all")
        states = self.random_state(rng, count) if q is None else (q, qd, tau)
        return self._recommend(tolerance, *states)

    def __repr__(self) -> str:
        some = "" if self.n == self.nv else f", {self.n} asked about"
        within = "" if self.tolerance is None else f" within {self.tolerance:.3g}"
        return (
            f"<kalmarm.Robot {self.name}: {self.nv} DoF{some}, {self.nq} in q{within}, "
            f"float32 or float64 as its arrays, {_core.instruction_set()}>"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        """By its definition: copies, and robots of other processes, take memory of their own."""
        return partial(type(self), **self._options), (self._description,)


def _parameters(model: Model, link: int) -> NDArray[np.floating]:
    mass, center, (w, *v), moments = model.__getstate__()[0][link][8:]
    n = w * w + np.dot(v, v)
    cross = np.cross(np.eye(3), v)  # cross @ x = v x x
    R = np.eye(3) + 2 / n * (np.outer(v, v) - np.dot(v, v) * np.eye(3) + w * cross)
    return payload(mass, center, R @ np.diag(moments) @ R.T)


def _code_arguments(code: Code | None) -> tuple[Any, ...]:
    if code is None or not code.tasks:
        return ()
    tasks = [_COMPILED[task] for task in code.tasks]
    return code.dtypes, tasks, code.rows, code.compiler or _zig(), code.cache, code.timeout


def _zig() -> list[str]:
    """The package ziglang as a C compiler, where the library would find none."""
    if os.environ.get("CC") or any(map(shutil.which, ("cc", "clang", "gcc"))):
        return []
    is_there = importlib.util.find_spec("ziglang") is not None
    return [sys.executable, "-m", "ziglang", "cc"] if is_there else []


def _frame(description: Description, frame: str | Frame) -> Frame:
    if isinstance(frame, _core.Frame):
        return frame
    if not isinstance(frame, str):
        raise TypeError(f"frames holds {frame!r}: a name or a kalmarm.Frame is needed")
    if frame not in description.frames:
        raise unknown("frame", frame, description.frames)
    return description.frames[frame]


def _listed(dofs: list[tuple[str, str]]) -> str:
    some = ", ".join(f"{name} ({coordinate})" for name, coordinate in dofs[:3])
    return some + (f", ... ({len(dofs)})" if len(dofs) > 3 else "")
