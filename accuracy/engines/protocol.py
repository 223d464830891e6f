"""What an adapter of an engine answers, and how conventions are mapped. NumPy alone is imported
here: an adapter runs in the environment of its engine.

A question is one of TASKS in one state, in the conventions of MuJoCo: DoF in the order of
`joints`, quaternions w first, of a free joint the velocity of its origin in the world's axes and
the angular velocity in the body's. An engine with other conventions has velocities

    w = T v                                                                                    (1)

where T (nv x nv) turns the six of a free base and puts DoF into the engine's order. Power is the
same in both, so that with a = v', torques tau, M and its inverse X

    w' = T a + T' v,   tau_e = T^-T tau,   M = T^T M_e T,   X = T^-1 X_e T^-T                 (2)

where T' v is zero but for a base whose linear velocity p' is told in its own axes:

    T' v = -omega x R^T p'                                                                     (3)

Derivatives of a are asked of mechanisms of hinges and slides alone, whose q are T q too:

    da/dq = T^-1 da_e/dq_e T,   da/dv = T^-1 da_e/dw T,   da/dtau = X                          (4)

three blocks side by side.

What is mapped is mapped in float64, outside of the timed call.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

TASKS = ("mass", "inverse", "acceleration", "inverse_dynamics", "derivatives")


class Unsupported(Exception):
    """The engine cannot hold this mechanism, or has no such call; says why."""


class Refused(Exception):
    """The engine itself said that it has no answer."""


@dataclass(frozen=True)
class Joint:
    name: str
    type: str  # hinge, slide, ball or free
    dof: int  # its first
    q: int  # its first entry of q
    armature: float

    @property
    def dofs(self) -> int:
        return {"free": 6, "ball": 3}.get(self.type, 1)


class State(NamedTuple):
    q: np.ndarray  # nq; quaternions have length 1 but for rounding to float32
    v: np.ndarray  # nv
    tau: np.ndarray  # nv
    a: np.ndarray  # nv, of inverse dynamics
    truth: dict[str, np.ndarray]  # by task; no derivatives of mechanisms that have none


class Mechanism:
    """What export_mechanism wrote."""

    def __init__(self, folder: Path):
        self.folder = Path(folder)
        self.record = json.loads((self.folder / "truth.json").read_text())
        self.nv: int = self.record["nv"]
        self.nq: int = self.record["nq"]
        self.gravity = np.array(self.record["gravity"])
        self.joints = [Joint(**joint) for joint in self.record["joints"]]
        self.has_armature = any(joint.armature > 0 for joint in self.joints)

    @property
    def mjcf(self) -> Path:
        return self.folder / "robot.xml"

    @property
    def urdf(self) -> Path:
        if why := self.record["urdf"].get("not"):
            raise Unsupported(f"URDF has no {why}")
        return self.folder / "robot.urdf"

    @property
    def floats(self) -> bool:
        return self.joints[0].type == "free"

    def states(self, armature: bool) -> list[State]:
        """With the truth of an engine that knows armature, or of one that does not."""
        key = "truth" if armature or not self.has_armature else "without_armature"
        fields = ("qpos", "qvel", "tau", "qacc")
        return [
            State(*(np.array(entry[field]) for field in fields), _truth(entry[key]))
            for entry in self.record["states"]
        ]


def _truth(given: dict) -> dict[str, np.ndarray]:
    truth = {task: np.array(given[task]) for task in TASKS if task in given}
    if "derivatives" in truth:
        truth["derivatives"] = np.hstack([truth["derivatives"], truth["inverse"]])
    return truth


@dataclass(frozen=True)
class Base:
    """How an engine tells the velocity of a free base."""

    linear: str = "world"  # axes: world or body
    angular: str = "body"
    linear_first: bool = True


def rotation(quaternion: np.ndarray) -> np.ndarray:
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Coordinates:
    """(1) to (4): `order` has of every DoF of ours its place among the engine's."""

    def __init__(self, mechanism: Mechanism, order: list[int], base: Base | None = None):
        self.mechanism, self.base = mechanism, base or Base()
        self.P = np.zeros((mechanism.nv, mechanism.nv))
        self.P[order, np.arange(mechanism.nv)] = 1

    def T(self, state: State) -> np.ndarray:
        turned = np.eye(self.mechanism.nv)
        if self.mechanism.floats:
            R = rotation(state.q[3:7])
            linear = R.T if self.base.linear == "body" else np.eye(3)
            angular = R if self.base.angular == "world" else np.eye(3)
            turned[:3, :3], turned[3:6, 3:6] = linear, angular
            if not self.base.linear_first:
                turned[:6] = np.roll(turned[:6], 3, axis=0)
        return self.P @ turned

    def drift(self, state: State) -> np.ndarray:
        """T' v."""
        out = np.zeros(self.mechanism.nv)
        if self.mechanism.floats and self.base.linear == "body":
            at = 0 if self.base.linear_first else 3
            out[at : at + 3] = -np.cross(state.v[3:6], rotation(state.q[3:7]).T @ state.v[:3])
        return self.P @ out

    def velocity(self, state: State) -> np.ndarray:
        return self.T(state) @ state.v

    def torque(self, state: State) -> np.ndarray:
        return np.linalg.solve(self.T(state).T, state.tau)

    def acceleration(self, state: State) -> np.ndarray:
        return self.T(state) @ state.a + self.drift(state)

    def read(self, task: str, state: State, x: np.ndarray) -> np.ndarray:
        """The engine's answer in our conventions."""
        x, T = np.asarray(x, dtype=np.float64), self.T(state)
        if task == "mass":
            return T.T @ x @ T
        if task == "inverse":
            return np.linalg.solve(T, np.linalg.solve(T, x.T).T)
        if task == "acceleration":
            return np.linalg.solve(T, x - self.drift(state))
        if task == "derivatives":
            by_q, by_v, by_tau = np.hsplit(x, 3)
            blocks = [np.linalg.solve(T, block) @ T for block in (by_q, by_v)]
            return np.hstack([*blocks, self.read("inverse", state, by_tau)])
        return T.T @ x


class Call(NamedTuple):
    """`run` is what is timed, from arrays of the engine to an answer of the engine, which `read`
    then turns into an array in our conventions, of many states a row each."""

    run: Callable[[], object]
    read: Callable[[object], np.ndarray]
    with_copies: Callable[[], object] | None = None  # from NumPy's arrays to NumPy's; None: as `run`


class Engine:
    """An adapter: one engine with one mechanism in one precision."""

    name = ""  # on the page
    package = ""  # on PyPI, whose version is recorded
    variants: dict[
        str, dict
    ] = {}  # name on the page: options of the constructor; empty: `name` alone
    precisions: tuple[str, ...] = ("float64",)
    armature = True  # or else the mechanism is asked about without
    gpu = False  # whether it needs one
    warning: type[Warning] | None = None  # by which the engine says that an answer may be wrong
    eager = False  # do without compilation where that is for every mechanism anew
    calls: dict[str, str] = {}  # by task: what of the engine is called, as its manual recommends

    def __init__(self, mechanism: Mechanism, precision: str):
        """Raises Unsupported."""
        raise NotImplementedError

    def call(self, task: str, state: State) -> Call:
        """Raises Unsupported where the engine has no such call."""
        raise NotImplementedError

    def batch(self, states: list[State]) -> Call:
        """One call for the accelerations of all states, by the engine's own way of many at once."""
        raise Unsupported("it has no call of many states")

    def saved(self) -> float:
        """Seconds of compilation, until now, that a cache of earlier runs has saved."""
        return 0.0


def joint_order(mechanism: Mechanism, first_dof: Callable[[Joint], int]) -> list[int]:
    """`order` of Coordinates: `first_dof` gives a joint's first DoF among the engine's."""
    order = [0] * mechanism.nv
    for joint in mechanism.joints:
        for i in range(joint.dofs):
            order[joint.dof + i] = first_dof(joint) + i
    return order


def error(task: str, computed: np.ndarray, truth: np.ndarray) -> float:
    """Of a vector |dx| / |x|, of a matrix max |dA_ij| / sqrt(A_ii A_jj): `relative` and `scaled` of
    accuracy/measures. Of derivatives the largest |dA| / |A|, by Frobenius norms, of the three
    blocks; of a block that is zero |dA| over the norm of all."""
    if computed.shape != truth.shape:
        raise ValueError(f"{task} has shape {computed.shape}, not {truth.shape}")
    difference = np.abs(computed - truth)
    if task in ("mass", "inverse"):
        size = np.sqrt(np.diag(truth))
        return float(np.max(difference / np.outer(size, size)))
    parts = 3 if task == "derivatives" else 1
    sizes = [np.linalg.norm(block) for block in np.hsplit(truth, parts)]
    whole = np.linalg.norm(truth)
    errors = [np.linalg.norm(block) for block in np.hsplit(difference, parts)]
    # No error is none of nothing too.
    return float(np.max([e and e / (size or whole) for e, size in zip(errors, sizes, strict=True)]))


def fault_of_precision(precision: str, raw: object, answer: np.ndarray, truth: np.ndarray) -> str:
    """What an answer is that is not of the precision asked for, or nothing. An answer that float32
    holds, of a truth that it does not hold, was never in float64."""
    dtype = str(getattr(raw, "dtype", precision))
    if dtype.startswith("float") and dtype != precision:
        return f"its answers are {dtype}, not {precision}"
    held = [bool(np.all(x == x.astype(np.float32))) for x in (answer, truth)]
    if precision == "float64" and held == [True, False]:
        return "float32 holds its answers, which were to be float64"
    return ""
