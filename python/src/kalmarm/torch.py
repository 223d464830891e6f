"""Operators of PyTorch on the CPU: a robot's calls under autograd, torch.func.vmap and torch.compile.

    import kalmarm.torch                                     # needs kalmarm[torch]

    a = kalmarm.torch.forward_dynamics(robot, q, qd, tau)
    a.square().sum().backward()                              # q.grad, qd.grad, tau.grad

q (..., nq), qd and tau (..., nv) have one dtype, float32 or float64. Leading dimensions are states and are broadcast;
vmap adds one, without a loop. Tensors are read where they are, unless they have gaps; states are spread over `threads`
cores, 0 for all. In PyTorch they are operators kalmarm::value and kalmarm::gradient, which take a robot by its number.

A state without an answer is NaN, and so are its gradients; nothing is raised or warned of. With status=True a call
returns (result, Outcomes).

Gradients are the library's `..._vjp`, O(n) a state, in reverse mode and of first order. Those by a quaternion of q are (2) of
`kalmarm.jax`: orthogonal to it.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

try:
    import torch
except ImportError as _error:
    raise ImportError("kalmarm.torch needs PyTorch: pip install 'kalmarm[torch]'") from _error
from torch import Tensor

from . import _operators
from .loads import ten_numbers
from .results import Outcomes
from .robot import Robot, numbered

__all__ = ["Outcomes", "forward_dynamics", "inverse_dynamics", "mass_matrix", "payload", "solve"]


def forward_dynamics(
    robot: Robot,
    q: Tensor,
    qd: Any,
    tau: Any,
    *,
    loads: Any = None,
    gravity: Any = None,
    status: bool = False,
    threads: int = 1,
) -> Any:
    """a = M(q)^-1 (tau - bias(q, qd)), (..., n) of q (..., nq), qd and tau (..., nv): `Robot.forward_dynamics`.

    loads (..., 10 l), here and below: bodies on frames of the robot's `loaded`, as `kalmarm.payload` makes them;
    gravity (..., 3), in the base's axes [m/s^2]: in the place of the model's.
    """
    return _apply("forward_dynamics", robot, (q, qd, tau), _operators.given_beside(loads, gravity), status, threads)


def inverse_dynamics(
    robot: Robot,
    q: Tensor,
    qd: Any,
    qdd: Any,
    *,
    loads: Any = None,
    gravity: Any = None,
    status: bool = False,
    threads: int = 1,
) -> Any:
    """tau = M(q) qdd + bias(q, qd), (..., n) of q (..., nq), qd and qdd (..., nv): `Robot.inverse_dynamics`."""
    return _apply("inverse_dynamics", robot, (q, qd, qdd), _operators.given_beside(loads, gravity), status, threads)


def solve(
    robot: Robot, q: Tensor, tau: Any, *, loads: Any = None, status: bool = False, threads: int = 1
) -> Any:
    """x = M(q)^-1 tau, (..., n) of q (..., nq), tau (..., n): `Robot.solve`."""
    return _apply("solve", robot, (q, tau), _operators.given_beside(loads), status, threads)


def mass_matrix(
    robot: Robot, q: Tensor, *, loads: Any = None, status: bool = False, threads: int = 1
) -> Any:
    """M(q), (..., n, n) of q (..., nq): `Robot.mass_matrix`. It has no gradients: NotImplementedError names the calls
    whose gradients are those of M v and of M^-1 b."""
    return _apply("mass_matrix", robot, (q,), _operators.given_beside(loads), status, threads)


def payload(mass: Any, center: Any = (0.0, 0.0, 0.0), inertia: Any = 0.0) -> Tensor:
    """Ten numbers of bodies for `loads`, (..., 10) of mass (...), center (..., 3) and inertia (..., 3), (..., 3, 3) or 0:
    `kalmarm.payload`, with gradients."""
    m, c, given = _tensors(mass, center, inertia)
    return torch.stack(torch.broadcast_tensors(*ten_numbers(m, c, given, torch.eye(3, dtype=c.dtype))), -1)


def _tensors(*given: Any) -> list[Tensor]:
    """Lists and numbers take the dtype of tensors."""
    dtype = next((x.dtype for x in given if isinstance(x, Tensor)), torch.float64)
    return [torch.as_tensor(x, dtype=None if hasattr(x, "dtype") else dtype) for x in given]


def _apply(
    name: str, robot: Robot, values: tuple[Any, ...], beside: dict[str, Any], status: bool, threads: int
) -> Any:
    arguments = _operators.arguments(name, robot, values, beside, threads)
    names, values, widths = zip(*arguments)
    given = list(zip(names, _tensors(*values), widths))
    for argument, x, _ in given:
        if x.device.type != "cpu":
            raise ValueError(f"{name}: {argument} is on {x.device}, the CPU is needed: {argument}.cpu()")
    rows = _operators.leading(name, given)
    tensors = [x.expand(*rows, width) for _, x, width in given]
    own = tensors[: len(values)] + [None] * (3 - len(values))
    given_beside = dict(zip(beside, tensors[len(values) :]))
    rest = [given_beside.get(one) for one in _operators.BESIDE]
    result, error, state = _Differentiable.apply(name, robot._number, threads, *own, *rest)
    return (result, Outcomes(state, error)) if status else result


# Operators take tensors one by one: of lists of tensors torch.func.grad knows no derivatives. x and y: what a call is given
# after q, None where it takes less.


@torch.library.custom_op("kalmarm::value", mutates_args=(), device_types="cpu")
def _value(
    name: str,
    robot: int,
    threads: int,
    q: Tensor,
    x: Tensor | None,
    y: Tensor | None,
    loads: Tensor | None,
    gravity: Tensor | None,
) -> tuple[Tensor, Tensor, Tensor]:
    given = [_array(part) for part in (q, x, y) if part is not None]
    call = getattr(numbered(robot), name)
    result, outcomes = call(*given, **_beside(loads, gravity), status=True, threads=threads)
    error = torch.tensor(outcomes["error"], dtype=q.dtype)
    return torch.as_tensor(result), error, torch.tensor(outcomes["status"], dtype=torch.int32)


@_value.register_fake
def _(name: str, robot: int, threads: int, q: Tensor, *_: Any) -> tuple[Tensor, Tensor, Tensor]:
    result, error, status = _operators.shapes(name, numbered(robot), tuple(q.shape[:-1]))
    return q.new_empty(result), q.new_empty(error), q.new_empty(status, dtype=torch.int32)


@torch.library.custom_op("kalmarm::gradient", mutates_args=(), device_types="cpu")
def _gradient(
    name: str,
    robot: int,
    threads: int,
    q: Tensor,
    x: Tensor | None,
    y: Tensor | None,
    loads: Tensor | None,
    gravity: Tensor | None,
    w: Tensor,
) -> list[Tensor]:
    """By each that is given."""
    known = numbered(robot)
    _operators.check_differentiable(name, known)
    given = [_array(part) for part in (q, x, y, w) if part is not None]
    call = getattr(known, f"{name}_vjp")
    found, _ = call(*given, **_beside(loads, gravity), status=True, threads=threads)
    by_q = _by_q(known, given[0], found.dq)
    by = (by_q, found.dqd, found.dqdd, found.dtau, found.loads, found.gravity)
    return [torch.as_tensor(part) for part in by if part is not None]


@_gradient.register_fake
def _(
    name: str,
    robot: int,
    threads: int,
    q: Tensor,
    x: Tensor | None,
    y: Tensor | None,
    loads: Tensor | None,
    gravity: Tensor | None,
    w: Tensor,
) -> list[Tensor]:
    given = (part for part in (q, x, y, loads, gravity) if part is not None)
    return [torch.empty_like(part, memory_format=torch.contiguous_format) for part in given]


def _beside(loads: Tensor | None, gravity: Tensor | None) -> dict[str, Any]:
    """What is given of these, since some calls take no gravity."""
    return {one: _array(x) for one, x in _operators.given_beside(loads, gravity).items()}


def _array(x: Tensor | None) -> Any:
    return None if x is None else x.detach().numpy()


class _Differentiable(torch.autograd.Function):
    """_value with derivatives. Not by torch.library.register_autograd, of which torch.func.grad is refused (PyTorch #168393,
    #170834)."""

    generate_vmap_rule = True

    @staticmethod
    def forward(*inputs: Any) -> Any:
        return _value(*inputs)

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.name, ctx.robot, ctx.threads, *tensors = inputs
        ctx.save_for_backward(*tensors)
        ctx.mark_non_differentiable(*output[1:])

    @staticmethod
    def backward(ctx: Any, w: Tensor, *_: Any) -> Any:
        tensors = ctx.saved_tensors
        by = iter(_OnceDifferentiable.apply(ctx.name, ctx.robot, ctx.threads, *tensors, w))
        return None, None, None, *(None if x is None else next(by) for x in tensors)


class _OnceDifferentiable(torch.autograd.Function):
    """_gradient, which has no derivatives."""

    generate_vmap_rule = True

    @staticmethod
    def forward(*inputs: Any) -> Any:
        return tuple(_gradient(*inputs))

    @staticmethod
    def setup_context(ctx: Any, inputs: Any, output: Any) -> None:
        ctx.name = inputs[0]

    @staticmethod
    def backward(ctx: Any, *_: Any) -> Any:
        raise NotImplementedError(f"{ctx.name}: there are no derivatives of second order")


def _by_q(robot: Robot, q: NDArray[Any], dq: NDArray[Any]) -> NDArray[Any]:
    """By the entries of q, (..., nq), of dq along the axes of qd, (..., nv): (2)."""
    out, at = np.empty_like(q), 0
    start = 0
    for i in (*robot.model.quaternions, robot.nq):
        out[..., start:i] = dq[..., at : at + i - start]
        at += i - start
        if i == robot.nq:
            return out
        p, omega, by = q[..., i : i + 4], dq[..., at : at + 3], out[..., i : i + 4]
        v = p[..., 1:]
        by[..., 0] = -np.sum(v * omega, axis=-1)
        by[..., 1:] = p[..., :1] * omega + np.cross(v, omega)
        by *= 2 / np.sum(p * p, axis=-1, keepdims=True)
        at, start = at + 3, i + 4
    return out


def _batched(operator: Any, info: Any, axes: Any, *arguments: Any) -> Any:
    """Rows in front."""
    rows = [
        x
        if not isinstance(x, Tensor)
        else x.expand(info.batch_size, *x.shape)
        if axis is None
        else x.movedim(axis, 0)
        for x, axis in zip(arguments, axes)
    ]
    out = operator(*rows)
    return out, type(out)([0] * len(out))


for _operator in (_value, _gradient):
    torch.library.register_vmap(_operator, functools.partial(_batched, _operator))
