"""Truth for tests of any engine: mechanisms as files, states, and true accelerations and torques to 25 digits.

    from kalmarm.testing import assert_forward_dynamics, mechanisms

    @pytest.mark.parametrize("mechanism", mechanisms(), ids=str)
    def test_my_engine(mechanism):
        assert_forward_dynamics(my_engine, 1e-9, [mechanism])

`my_engine(mechanism)` reads `mechanism.mjcf`, or `mechanism.urdf` of `mechanisms(armature=False)`, and returns f(q, qd, tau) -> a of one
state. q and qd are MuJoCo's qpos and qvel: docs/from-other-engines.md has what others call them. This file needs NumPy alone: with the
folder `truth` it may be copied to where kalmarm is not installed; docs/check.md says what the data are.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FOLDER = Path(__file__).with_name("truth")

OneState = Callable[[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]], ArrayLike]


@dataclass(frozen=True)
class Mechanism:
    """A mechanism as files, and states with what is true of them, each a row.

    q, qd, tau, qdd: exact as float32, so that an engine of either precision is asked the same.
    a: accelerations of tau. torques: those of qdd. To 25 digits, as the sum of two arrays of double, `a[0] + a[1]`.
    why: what is hard about it.
    """

    name: str
    why: str
    dofs: tuple[str, ...]
    mjcf: Path
    urdf: Path | None  # where URDF has words for its joints; it has none for armature
    gravity: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    tau: NDArray[np.float64]
    qdd: NDArray[np.float64]
    a: NDArray[np.float64]  # (2, states, nv)
    torques: NDArray[np.float64]

    def __str__(self) -> str:
        return self.name


def mechanisms(*names: str, armature: bool = True) -> list[Mechanism]:
    """Those of these names, or all; with the truth of their joints' armature, which URDF and some engines have not,
    or without."""
    known = sorted(path.stem for path in FOLDER.glob("*.json"))
    for name in names:
        if name not in known:
            raise ValueError(f"mechanism '{name}' is unknown: {', '.join(known)}")
    return [_read(name, armature) for name in names or known]


def _read(name: str, armature: bool) -> Mechanism:
    data = json.loads((FOLDER / f"{name}.json").read_text())
    states = data["states"]
    truth = [state if armature else state["without_armature"] for state in states]
    urdf = FOLDER / f"{name}.urdf"
    return Mechanism(
        name=name,
        why=data["why"],
        dofs=tuple(data["dofs"]),
        mjcf=FOLDER / f"{name}.xml",
        urdf=urdf if urdf.exists() else None,
        gravity=np.array(data["gravity"]),
        **{key: np.array([state[key] for state in states]) for key in ("q", "qd", "tau", "qdd")},
        **{key: _two([one[key] for one in truth]) for key in ("a", "torques")},
    )


def _two(rows: list[list[str]]) -> NDArray[np.float64]:
    """25 digits as two numbers, of which the first is what is nearest."""
    high = np.array([[float(x) for x in row] for row in rows])
    low = [[float(Decimal(x) - Decimal(h)) for x, h in zip(row, of)] for row, of in zip(rows, high.tolist())]
    return np.array([high, low])


def errors(answers: ArrayLike, truth: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of each row |x - x*| / |x*| in Euclid's norm; infinite where a row is not finite. truth: (2, ...)."""
    x = np.asarray(answers, np.float64)
    if x.shape != truth[0].shape:
        raise ValueError(f"answers of shape {x.shape}, {truth[0].shape} is needed")
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.linalg.norm((x - truth[0]) - truth[1], axis=-1)
    return np.where(np.isfinite(apart), apart, np.inf) / np.linalg.norm(truth[0], axis=-1)


def _assert(what: str, engine: Any, rtol: float, chosen: Iterable[Mechanism] | None, given: str, truth: str) -> None:
    lines = []
    for mechanism in mechanisms() if chosen is None else chosen:
        answer = engine(mechanism)
        inputs = zip(mechanism.q, mechanism.qd, getattr(mechanism, given))
        wrong = errors([np.asarray(answer(*state), np.float64) for state in inputs], getattr(mechanism, truth))
        if not (wrong <= rtol).all():
            worst = int(np.argmax(wrong))
            lines.append(
                f"{mechanism.name}: {(wrong > rtol).sum()} of {len(wrong)} states, worst {wrong[worst]:.2e} "
                f"in state {worst} ({mechanism.why})"
            )
    if lines:
        raise AssertionError(f"{what} wrong by more than {rtol:g}:\n  " + "\n  ".join(lines))


def assert_forward_dynamics(
    engine: Callable[[Mechanism], OneState], rtol: float, chosen: Iterable[Mechanism] | None = None
) -> None:
    """Raises AssertionError, a line a mechanism, where an acceleration is wrong by more than rtol |a|: of all
    mechanisms unless some are chosen. engine(mechanism)(q, qd, tau) returns a (nv,)."""
    _assert("accelerations", engine, rtol, chosen, "tau", "a")


def assert_inverse_dynamics(
    engine: Callable[[Mechanism], OneState], rtol: float, chosen: Iterable[Mechanism] | None = None
) -> None:
    """The same of torques: engine(mechanism)(q, qd, qdd) returns tau (nv,)."""
    _assert("torques", engine, rtol, chosen, "qdd", "torques")
