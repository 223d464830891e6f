"""The compiled part of kalmarm."""

from collections.abc import Sequence
from typing import Any, Literal, overload

from kalmarm.results import Derivatives, Gradients
import numpy
import numpy.dtypes
import numpy.typing
from numpy.typing import ArrayLike, NDArray


__version__: str

class DynamicsError(ArithmeticError):
    """
    A state for which there is no answer that could be used; `outcome` is its record.
    """

    outcome: Any

mujoco_version: str

last_bits: float = 8.881784197001252e-16

def instruction_set() -> str:
    """
    What the kernels in use were compiled for: x86-64-v3 or -v4, the best that the processor has unless the environment variable KALMARM_INSTRUCTION_SET names a lower one; 'native' where they were compiled for this machine alone.
    """

outcome_dtype: numpy.dtypes.VoidDType = ...

class Frame:
    """
    A frame on a link: its axes, a quaternion (w, x, y, z), and its origin [m] in the link's frame; link -1 is the fixed base.
    """

    def __init__(self, link: int, rotation: Sequence[float] = [1.0, 0.0, 0.0, 0.0], translation: Sequence[float] = [0.0, 0.0, 0.0]) -> None: ...

    @property
    def link(self) -> int: ...

    @property
    def rotation(self) -> list[float]: ...

    @property
    def translation(self) -> list[float]: ...

    def __getstate__(self) -> tuple[int, list[float], list[float]]: ...

    def __setstate__(self, arg: tuple[int, Sequence[float], Sequence[float]], /) -> None: ...

    def __repr__(self) -> str: ...

class Model:
    """A robot as numbers: what a Robot is made from."""

    def __getstate__(self) -> tuple[list[tuple[int, int, bool, int, float, list[float], list[float], float, float, list[float], list[float], list[float]]], list[str], int, list[float]]: ...

    def __setstate__(self, arg: tuple[Sequence[tuple[int, int, bool, int, float, Sequence[float], Sequence[float], float, float, Sequence[float], Sequence[float], Sequence[float]]], Sequence[str], int, Sequence[float]], /) -> None: ...

    def __repr__(self) -> str: ...

    @property
    def nq(self) -> int: ...

    @property
    def nv(self) -> int: ...

    @property
    def dofs(self) -> list[str]:
        """Names of the DoF, in the order of qd."""

    @property
    def gravity(self) -> list[float]:
        """[m/s^2]"""

    @property
    def coordinates(self) -> list[str]:
        """
        What q holds of every DoF: 'angle' [rad], 'distance' [m], of a ball joint 'quaternion', of a free one 'position' and 'quaternion', and 'follower' of the DoF after these.
        """

    @property
    def q_index(self) -> list[int]:
        """The first entry of q that every DoF reads."""

    @property
    def quaternions(self) -> list[int]:
        """Where in q a quaternion (w, x, y, z) begins."""

    @property
    def single(self) -> list[bool]:
        """Of every DoF, whether it is a hinge or a slide."""

class ModelBuilder:
    def __init__(self) -> None: ...

    def add_body(self, name: str, parent: int, joint: str, axis: Sequence[float], position: Sequence[float], rotation: Sequence[float], reference: float, armature: float, mass: float, center_of_mass: Sequence[float], inertia: Sequence[float], solid: bool) -> int: ...

    def set_gravity(self, gravity: Sequence[float]) -> None: ...

    @property
    def nq(self) -> int: ...

    @property
    def nv(self) -> int: ...

    def first_dof(self, body: int) -> int: ...

    def first_q(self, body: int) -> int: ...

    def frame(self, body: int) -> Frame: ...

    def build(self, dofs: Sequence[str] | None = None, armature: Sequence[float] | None = None) -> Model:
        """dofs, armature: by DoF, in the place of what the bodies say."""

class Recommendation:
    """Which tolerance and which precision are enough."""

    @property
    def tolerance(self) -> float:
        """Of `Robot`."""

    @property
    def precision(self) -> str:
        """'float32' or 'float64': the dtype to give."""

    @property
    def worst(self) -> float:
        """
        Largest error in these states; infinite where one has no answer or a warning.
        """

    @property
    def predicted(self) -> float:
        """Error to expect in states like these."""

    @property
    def nanoseconds(self) -> float:
        """A call on this machine, for all that is wanted."""

    @property
    def enough(self) -> bool:
        """Predicted within the tolerance; else the most accurate is given."""

    @property
    def reason(self) -> str: ...

    def __repr__(self) -> str: ...

class Plan:
    """What the robot's question needs, and what is left out."""

    @property
    def asked(self) -> list[int]:
        """DoF of the results, in their order."""

    @property
    def singular(self) -> list[int]:
        """DoF that are asked about and move no inertia: M has no inverse."""

    @property
    def parts(self) -> list[tuple[str, list[int]]]:
        """(kernel, DoF) of the parts that are solved apart."""

    @property
    def rules(self) -> dict[str, list[int]]:
        """Rules that left something out, and the DoF that each is about."""

    def __repr__(self) -> str: ...

class Factors:
    """
    Factors of M in one state, for any number of solves; one thread at a time solves, others wait.
    """

    def solve(self, tau: numpy.typing.ArrayLike, out: Any = None) -> numpy.ndarray:
        """
        x = M^-1 tau, of one vector (n,) or of one a row, (..., n). One that is not finite is raised, of several its row is NaN.
        """

    def __repr__(self) -> str: ...

    def __reduce__(self) -> object: ...

class Robot:
    def __init__(self, model: Model, tolerance: float | None, wants: Sequence[str], asked: Sequence[int], frames: Sequence[Frame], acted_on: Sequence[Frame], contacts: Sequence[Frame], loaded: Sequence[Frame], locked: Sequence[int], q: Sequence[float], at_rest: bool, rules: Sequence[str] | None = None, dtypes: Sequence[str] = [], tasks: Sequence[str] = [], rows: bool = True, compiler: Sequence[str] = [], folder: str = '', limit: float = 120.0) -> None: ...

    @property
    def nq(self) -> int:
        """Entries of q."""

    @property
    def nv(self) -> int:
        """Degrees of freedom."""

    @property
    def n(self) -> int:
        """DoF that results are about: nv, or as many as are asked."""

    @property
    def tolerance(self) -> float | None:
        """That was asked for; None: the default one of an answer's dtype."""

    @property
    def rules(self) -> set[str]:
        """By which work may be left out."""

    @property
    def compiled(self) -> tuple[str, ...]:
        """
        Of every dtype and task of `compile`, a line: which compiler took how long and where its code is, or why the library's loops answer. Empty for a robot that was not compiled.
        """

    def plan(self) -> Plan:
        """What is left out, and by which rule."""

    @overload
    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        a = M(q)^-1 (tau + J' forces - bias(q, qd)), gravity and armature included.

        q (..., nq), qd and tau (..., nv) -> a (..., n). Hinges: rad, rad/s, Nm, rad/s^2; slides: m, m/s,
        N, m/s^2. forces (..., 6 f): of every frame of `acted_on` the moment about the origin of `axes` and the
        force [Nm, N], with the axes of `Kinematics`. loads (..., 10 l), here and below: bodies that hang on the frames of
        `loaded`, of each m, m c (3), Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the frame's origin in its axes [kg, kg m, kg m^2], which
        `kalmarm.load_of` makes of a mass, a centre and moments: they change M, bias and all that is made of them. gravity (..., 3): in the base's axes [m/s^2], in the place of the
        model's.
        """
    @overload
    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        tau = M(q) qdd + bias(q, qd) - J' forces, gravity and armature included.

        q (..., nq), qd and qdd (..., nv) -> tau (..., n) [Nm or N]. forces, loads and gravity: as of `forward_dynamics`.
        """
    @overload
    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def bias(self, q: ArrayLike, qd: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        Velocity terms and gravity, less J' forces: the torques of qdd = 0.

        q (..., nq), qd (..., nv) -> (..., n) [Nm or N]. forces, loads and gravity: as of `forward_dynamics`.
        """
    @overload
    def bias(self, q: ArrayLike, qd: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def gravity(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        The torques that hold the robot against gravity.

        q (..., nq) -> (..., n) [Nm or N].
        """
    @overload
    def gravity(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def mass_matrix(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        M, armature included, both triangles.

        q (..., nq) -> (..., n, n) [kg m^2, kg m or kg].
        """
    @overload
    def mass_matrix(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def inverse_mass_matrix(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        M^-1, both triangles; M is not formed.

        q (..., nq) -> (..., n, n). contacts: as of `solve`, H^-1.
        """
    @overload
    def inverse_mass_matrix(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def diagonal(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        The diagonal of M^-1.

        q (..., nq) -> (..., n). contacts: as of `solve`, of H^-1.
        """
    @overload
    def diagonal(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def log_det(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        log det M of the joints that are free.

        q (..., nq) -> (...). contacts: as of `solve`, log det H.
        """
    @overload
    def log_det(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def operational(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        J M^-1 J' of the frames that are asked about: what forces there accelerate them by.

        q (..., nq) -> (..., 6 f, 6 f) of f frames, six rows each: angular, then linear, in its axes. contacts: as of
        `solve`, J H^-1 J'.
        """
    @overload
    def operational(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def operational_diagonal(self, q: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        The diagonal of J M^-1 J', without the rest of it.

        q (..., nq) -> (..., 6 f), rows and contacts as of `operational`.
        """
    @overload
    def operational_diagonal(self, q: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def operational_inertia(self, q: ArrayLike, out: Any = None, *, damping: float = 0.0, clamp: float = ..., status: Literal[False] = False, threads: int = 1) -> NDArray[Any]:
        """
        (J M^-1 J')^-1 of the frames that are asked about: the inertia that forces there meet.

        q (..., nq) -> (..., 6 f, 6 f), rows as of `operational`. Of J M^-1 J', with turning and moving of each frame scaled to
        a mean of 1 on the diagonal, `clamp` is the largest condition number that is let pass, smaller eigenvalues are raised, and
        `damping` is added to all: forces stay bounded where the robot cannot move its frames. Outcomes: D and scale are the
        least and the largest eigenvalue, error is that of the inertia, and joint nv + i where no joint moves row i.
        """
    @overload
    def operational_inertia(self, q: ArrayLike, out: Any = None, *, damping: float = 0.0, clamp: float = ..., status: Literal[True], threads: int = 1) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def solve(self, q: ArrayLike, tau: ArrayLike, out: Any = None, *, status: Literal[False] = False, threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        x = M(q)^-1 tau, without bias, or with contacts x = H^-1 tau.

        q (..., nq), tau (..., n) -> (..., n). For many tau in one state: factor(q).solve(tau). contacts (..., 6 c): of every
        frame of the robot's `contacts` a row w = sqrt(d) (p x f; f) in `axes`, f the direction in which it resists at p and d
        its stiffness [kg], so that H = M + sum of (w'J)'(w'J), what contact simulators factor.
        """
    @overload
    def solve(self, q: ArrayLike, tau: ArrayLike, out: Any = None, *, status: Literal[True], threads: int = 1, contacts: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def forward_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, out: Derivatives | None = None, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> Derivatives:
        """
        Derivatives of forward dynamics, analytically, and a itself.

        q (..., nq), qd and tau (..., nv) -> Derivatives(dq, dqd, dtau, a): three (..., n, n) and (..., n).
        Column j of dq is for a change of q along DoF j's velocity, so that joints with quaternions have as
        many columns as DoF. out: what an earlier call of the same shape returned. forces turn with their frames:
        axes "local" is needed.
        """
    @overload
    def forward_dynamics_derivatives(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, out: Derivatives | None = None, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, axes: str = "aligned", loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[Derivatives, NDArray[Any]]: ...

    @overload
    def forward_dynamics_vjp(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> Gradients:
        """
        Derivatives of w'a, a = M^-1 (tau - bias), by all that a depends on, in O(n): no matrix is formed.

        q (..., nq), qd, tau and w (..., nv) -> `Gradients`. About 2.5 times the time of a. inertias, armature: those by
        these are worked out too. forces, loads and gravity: as of `forward_dynamics`, forces in the axes of their frames, with
        which they turn; those by them are returned. Outcomes: of a and M^-1 w, the worse of both. Not of a robot that
        leaves joints out (asked, locked) or is at rest.
        """
    @overload
    def forward_dynamics_vjp(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[Gradients, NDArray[Any]]: ...

    @overload
    def forward_dynamics_jvp(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dq: ArrayLike, dqd: ArrayLike, dtau: ArrayLike, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        How a changes along dq, dqd and dtau (..., nv), dq along the velocities of the joints: da (..., nv), in O(n).

        q (..., nq), qd and tau (..., nv). Forces, which turn with their frames, loads and gravity stay as they are.
        """
    @overload
    def forward_dynamics_jvp(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike, dq: ArrayLike, dqd: ArrayLike, dtau: ArrayLike, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def inverse_dynamics_vjp(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> Gradients:
        """
        Derivatives of w'tau, tau = M qdd + bias, by all that tau depends on, in O(n).

        q (..., nq), qd, qdd and w (..., nv) -> `Gradients`, of which dqdd is M w. Else as `forward_dynamics_vjp`.
        """
    @overload
    def inverse_dynamics_vjp(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[Gradients, NDArray[Any]]: ...

    @overload
    def inverse_dynamics_jvp(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, dq: ArrayLike, dqd: ArrayLike, dqdd: ArrayLike, *, status: Literal[False] = False, threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> NDArray[Any]:
        """
        How tau changes along dq, dqd and dqdd (..., nv): dtau (..., nv), in O(n).

        q (..., nq), qd and qdd (..., nv). Forces, loads and gravity as of `forward_dynamics_jvp`.
        """
    @overload
    def inverse_dynamics_jvp(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, dq: ArrayLike, dqd: ArrayLike, dqdd: ArrayLike, *, status: Literal[True], threads: int = 1, forces: ArrayLike | None = None, loads: ArrayLike | None = None, gravity: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    @overload
    def solve_vjp(self, q: ArrayLike, tau: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[False] = False, threads: int = 1, loads: ArrayLike | None = None) -> Gradients:
        """
        Derivatives of w'x, x = M^-1 tau, by q, tau and what M depends on, in O(n).

        q (..., nq), tau and w (..., nv) -> `Gradients`, of which dtau is M^-1 w. Else as `forward_dynamics_vjp`.
        """
    @overload
    def solve_vjp(self, q: ArrayLike, tau: ArrayLike, w: ArrayLike, *, inertias: bool = False, armature: bool = False, status: Literal[True], threads: int = 1, loads: ArrayLike | None = None) -> tuple[Gradients, NDArray[Any]]: ...

    @overload
    def solve_jvp(self, q: ArrayLike, tau: ArrayLike, dq: ArrayLike, dtau: ArrayLike, *, status: Literal[False] = False, threads: int = 1, loads: ArrayLike | None = None) -> NDArray[Any]:
        """
        How x = M^-1 tau changes along dq and dtau (..., nv): dx (..., nv), in O(n).

        q (..., nq), tau (..., nv). Loads as of `forward_dynamics_jvp`.
        """
    @overload
    def solve_jvp(self, q: ArrayLike, tau: ArrayLike, dq: ArrayLike, dtau: ArrayLike, *, status: Literal[True], threads: int = 1, loads: ArrayLike | None = None) -> tuple[NDArray[Any], NDArray[Any]]: ...

    def factor(self, q: numpy.typing.ArrayLike, *, contacts: Any = None, axes: str = 'aligned', loads: Any = None) -> Factors:
        """
        Factors of M in one state q (nq,), for any number of solves, or of H: contacts (6 c,) as of `solve`.
        """

    def integrate(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike, out: Any = None) -> numpy.typing.NDArray[Any]:
        """
        q moved by the displacement v: q + v, and quaternions turned.

        q (..., nq), v (..., nv) [rad or m] in the axes of qd, such as dt * qd -> (..., nq). Quaternions are
        turned to q exp(v / 2), of unit length. What is not finite passes into its own joint's entries.
        """

    def difference(self, q0: numpy.typing.ArrayLike, q1: numpy.typing.ArrayLike, out: Any = None) -> numpy.typing.NDArray[Any]:
        """
        The displacement v for which integrate(q0, v) is q1.

        q0 and q1 (..., nq) -> (..., nv) [rad or m]. Quaternions: the shorter turn, at most pi; q and -q are
        the same rotation.
        """

    def integrate_jacobians(self, q: numpy.typing.ArrayLike, v: numpy.typing.ArrayLike) -> tuple[numpy.typing.NDArray[Any], numpy.typing.NDArray[Any]]:
        """
        Derivatives of integrate(q, v) by q and by v: (dq, dv).

        q (..., nq), v (..., nv) -> two (..., nv, nv), in displacements on both sides: column j is for a
        change of q along DoF j's velocity. Identities but for the blocks of quaternions.
        """

    def difference_jacobians(self, q0: numpy.typing.ArrayLike, q1: numpy.typing.ArrayLike) -> tuple[numpy.typing.NDArray[Any], numpy.typing.NDArray[Any]]:
        """
        Derivatives of difference(q0, q1) by q0 and by q1: (d0, d1).

        q0 and q1 (..., nq) -> two (..., nv, nv), as those of integrate_jacobians.
        """

class Kinematics:
    def __init__(self, model: Model, frames: Sequence[Frame], bodies: Sequence[int]) -> None: ...

    @property
    def mass(self) -> float:
        """Of all bodies [kg]."""

class AnswerCheck:
    def __init__(self, model: Model, tolerance: float, resolution: float) -> None: ...

class ImplicitStep:
    def __init__(self, robot: Robot, h: float, damping: Sequence[float], stiffness: Sequence[float], reference: Sequence[float], rows: Sequence[tuple[Sequence[float], float, float, float, float, bool]], scheme: str) -> None: ...

    @property
    def h(self) -> float:
        """[s]"""

    @property
    def scheme(self) -> str: ...

    def acceleration(self, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, tau: numpy.typing.ArrayLike, out: Any = None, *, damping: Any = None, stiffness: Any = None, reference: Any = None, armature: Any = None, status: bool = False, threads: int = 1, forces: Any = None, axes: str = 'aligned', loads: Any = None, gravity: Any = None, contacts: Any = None) -> Any:
        """
        a = (qd+ - qd) / h of the step.

        q (..., nq), qd and tau (..., nv) -> a (..., nv).

        damping, stiffness, reference: (..., nv), of every state its own, in place of the step's, and armature in
        place of the robot's. References cost nothing; the others 1.2 times the time of a step, but below a tolerance of 1e-12 every
        state then is a robot that is made anew. ValueError with the row and the DoF where one is
        negative or not finite, where a ball or free joint has a spring, and where dampers, springs or
        armatures stand beside rows of the step.

        forces (..., 6 f), loads and gravity: as of Robot.forward_dynamics, where the step begins. contacts (..., 6 c): rows of
        (M + h B + h^2 K + J'DJ) a = tau - bias, as of Robot.solve.
        """

    def derivatives(self, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, tau: numpy.typing.ArrayLike, out: Any = None, *, status: bool = False, forces: Any = None, axes: str = 'aligned', loads: Any = None, gravity: Any = None) -> Any:
        """
        Derivatives of the step's acceleration by q, qd and tau, analytically, and a itself.

        q (..., nq), qd and tau (..., nv) -> Derivatives(dq, dqd, dtau, a), as those of
        Robot.forward_dynamics_derivatives; dtau is the inverse of M + h B + h^2 K. forces turn with their
        frames: axes "local" is needed.
        """

    def advance(self, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, a: numpy.typing.ArrayLike, out: tuple[numpy.typing.NDArray[Any], numpy.typing.NDArray[Any]] | None = None) -> tuple[numpy.typing.NDArray[Any], numpy.typing.NDArray[Any]]:
        """
        (q, qd) after h with the accelerations a: qd + h a, and q moved along it, quaternions turned. out: such a pair of arrays.
        """

class ConstrainedDynamics:
    def __init__(self, robot: Robot, constraints: Sequence[tuple[str, int, Frame, Frame, float, Sequence[float], Sequence[float], float, Sequence[float], float, float, bool, Sequence[float], Sequence[float] | None]], proximal: float, iterations: int) -> None: ...

    @property
    def rows(self) -> int:
        """m, of all constraints together."""
