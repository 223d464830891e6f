"""What the operators of JAX and PyTorch have in common: which calls there are, and what their arguments have to be."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .kinematics import Kinematics
from .robot import Robot
from .step import ImplicitStep

Asked = Robot | ImplicitStep | Kinematics


class Call(NamedTuple):
    want: str  # of a question
    names: tuple[str, ...]  # of its arguments
    given: str  # of each how many numbers a row has, q: nq, v: nv, n: DoF that are asked about
    results: str  # the same; m: n x n, p, o, j: positions, rotations and Jacobians of frames, e: error, s: status


CALLS = {
    "forward_dynamics": Call("acceleration", ("q", "qd", "tau"), "qvv", "nes"),
    "inverse_dynamics": Call("inverse_dynamics", ("q", "qd", "qdd"), "qvv", "nes"),
    "mass_matrix": Call("mass", ("q",), "q", "mes"),
    "solve": Call("solve", ("q", "tau"), "qn", "nes"),
    "poses": Call("", ("q",), "q", "po"),
    "poses_and_jacobians": Call("", ("q",), "q", "poj"),
    "step_acceleration": Call("", ("q", "qd", "tau", "damping", "stiffness", "reference", "armature"), "qvvvvvv", "ves"),
}
BESIDE = {"loads": "l", "gravity": "g"}  # what a call may be given beside, and how many numbers a row has
VALUES = tuple(name for name, call in CALLS.items() if call.results.endswith("s"))  # the status
DIFFERENTIABLE = ("forward_dynamics", "inverse_dynamics", "solve", "step_acceleration")
# da of q, ..., dq, ..., and dq, ... of q, ..., w; dq along the axes of qd
for _name in DIFFERENTIABLE:
    _call = CALLS[_name]
    CALLS[f"{_name}_jvp"] = _call._replace(results=_call.results[0])
    CALLS[f"{_name}_vjp"] = _call._replace(results=_call.given.replace("q", "v"))


def width(robot: Asked, letter: str) -> int:
    return robot._widths[letter]


def shapes(name: str, robot: Asked, rows: tuple[int, ...], by: str = "") -> list[tuple[int, ...]]:
    """Of what a call returns; by: letters of what it is derived by of what is given beside."""

    def of_row(letter: str) -> tuple[int, ...]:
        if letter in "es":
            return ()
        return 2 * (width(robot, "n"),) if letter == "m" else (width(robot, letter),)

    letters = CALLS[name].results + (by if name.endswith("_vjp") else "")
    return [rows + of_row(one) for one in letters]


def arguments(
    name: str, robot: Any, values: tuple[Any, ...], beside: dict[str, Any], threads: int
) -> list[tuple[str, Any, int]]:
    """Names, values and widths, of a robot, a step or kinematics that can be asked."""
    asked, needed = {"step_acceleration": ("step", ImplicitStep), "poses": ("kinematics", Kinematics)}.get(
        name, ("robot", Robot)
    )
    if not isinstance(robot, needed):
        raise TypeError(
            f"{name}: {asked} is a {type(robot).__name__}, a kalmarm.{needed.__name__} is needed"
        )
    if asked == "robot" and robot._options["wants"] and CALLS[name].want not in robot._options["wants"]:
        raise ValueError(f"{name}: the robot's question does not want it")
    if threads < 0:
        raise ValueError(f"{name}: {threads} threads")
    call = CALLS[name]
    out = [(one, x, width(robot, of)) for one, x, of in zip(call.names, values, call.given)]
    for one, x in beside.items():
        size = width(robot, BESIDE[one])
        out.append((one if size else f"{one} (of a robot without loaded)", x, size))
    return out


def given_beside(loads: Any, gravity: Any = None) -> dict[str, Any]:
    return {one: x for one, x in (("loads", loads), ("gravity", gravity)) if x is not None}


def leading(name: str, given: list[tuple[str, Any, int]]) -> tuple[int, ...]:
    """To what leading dimensions arrays of (name, array, width) are broadcast; one number stands for all of a row."""
    first, rows = str(given[0][1].dtype), tuple(given[0][1].shape[:-1])
    for argument, x, needed in given:
        dtype, shape = str(x.dtype), tuple(x.shape)
        if not dtype.endswith(("float32", "float64")):
            raise TypeError(f"{name}: {argument} is {dtype}, float32 or float64 is needed")
        if dtype != first:
            raise TypeError(
                f"{name}: {argument} is {dtype}, arrays before it are {first}: one dtype for all is needed"
            )
        if shape == (*rows, needed) or (shape == () and argument != "q"):
            continue
        try:
            if shape[-1:] != (needed,):
                raise ValueError
            rows = np.broadcast_shapes(rows, shape[:-1])
        except ValueError:
            wanted = f"(..., {needed})" if argument == "q" or not rows else (*rows, needed)
            raise ValueError(f"{name}: {argument} has shape {shape}, {wanted} is needed") from None
    return rows


def gains(step: Any, *given: Any) -> list[Any]:
    """damping, stiffness, reference and armature of a call: the step's own where it is None, which take any dtype."""
    if not isinstance(step, ImplicitStep):
        return list(given)  # which `arguments` refuses
    step._check_has_gains_alone("step_acceleration")
    return [
        own if x is None else x if hasattr(x, "dtype") else np.asarray(step._gain(name, x)).tolist()
        for (name, own), x in zip([*step._own.items(), ("armature", step._armature)], given)
    ]


def check_differentiable(name: str, robot: Asked) -> None:
    if name.startswith("poses"):  # those of first order are made of Jacobians
        raise NotImplementedError("poses: there are no derivatives of second order")
    if name not in DIFFERENTIABLE:
        raise NotImplementedError(
            f"{name} has no derivatives: take those of M v = inverse_dynamics(q, 0, v) - "
            "inverse_dynamics(q, 0, 0), or of M^-1 b = solve(q, b)"
        )
    if isinstance(robot, ImplicitStep):
        return
    if width(robot, "n") != width(robot, "v") or robot.at_rest:
        raise NotImplementedError(
            f"{name}: derivatives are of robots all of whose joints are asked about, and are not at rest"
        )
