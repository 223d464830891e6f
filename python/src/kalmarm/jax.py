"""Operators of JAX on the CPU: a robot's calls of rows under jit, vmap, grad and jvp.

    import kalmarm.jax                                       # needs kalmarm[jax]

    a = kalmarm.jax.forward_dynamics(robot, q, qd, tau)
    g = jax.grad(lambda tau: jnp.sum(kalmarm.jax.forward_dynamics(robot, q, qd, tau) ** 2))(tau)

q (..., nq), qd and tau (..., nv) have one dtype, float32 or float64 (JAX's option jax_enable_x64). Leading dimensions are
rows of states and are broadcast; vmap adds one, without a loop. A state alone is one row. XLA's buffers are read and
written where they are; rows are spread over `threads` cores, 0 for all.

A row without an answer is NaN, and so are its derivatives; nothing is raised or warned of. With status=True a call
returns (result, Outcomes).

Derivatives are the library's `..._jvp` and `..._vjp`, O(n) a row: of first order, forward and reverse. They are by the
axes of qd, and here by the entries of q. A quaternion p turns the same way at any length, so that with its turning at
the angular velocity omega in the body's axes

    omega = 2 / |p|^2 G' p',   G = [-x -y -z;  w -z y;  z w -x;  -y x w] of p = (w, x, y, z)        (1)
    df/dp = 2 / |p|^2 G df/domega,   p' df/dp = 0 since G'p = 0                                      (2)

df/dp is the gradient of f that is extended as constant along p: after a step along it p is normalised, or left as it is.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

try:
    import jax
except ImportError as _error:
    raise ImportError("kalmarm.jax needs JAX: pip install 'kalmarm[jax]'") from _error
import jax.numpy as jnp
from jax.extend.core import Primitive
from jax.interpreters import ad, batching, mlir

from . import _core, _operators
from .loads import ten_numbers
from .kinematics import Kinematics
from .results import Outcomes
from .robot import Robot
from .step import ImplicitStep

__all__ = ["Outcomes", "forward_dynamics", "inverse_dynamics", "mass_matrix", "payload", "poses", "solve", "step_acceleration"]


def _register() -> None:
    if not hasattr(_core, "_jax_targets"):
        raise ImportError("kalmarm.jax: kalmarm was built without the headers of jaxlib")
    for name, handler in _core._jax_targets().items():
        jax.ffi.register_ffi_target(f"kalmarm.{name}", handler, platform="cpu")


_register()


def forward_dynamics(
    robot: Robot,
    q: Any,
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
    gravity (..., 3), in the base's axes [m/s^2]: in the place of the model's. Gradients by both are in reverse mode alone.
    """
    return _apply("forward_dynamics", robot, (q, qd, tau), _operators.given_beside(loads, gravity), status, threads)


def inverse_dynamics(
    robot: Robot,
    q: Any,
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
    robot: Robot, q: Any, tau: Any, *, loads: Any = None, status: bool = False, threads: int = 1
) -> Any:
    """x = M(q)^-1 tau, (..., n) of q (..., nq), tau (..., n): `Robot.solve`."""
    return _apply("solve", robot, (q, tau), _operators.given_beside(loads), status, threads)


def mass_matrix(
    robot: Robot, q: Any, *, loads: Any = None, status: bool = False, threads: int = 1
) -> Any:
    """M(q), (..., n, n) of q (..., nq): `Robot.mass_matrix`. It has no derivatives: NotImplementedError names the calls
    whose derivatives are those of M v and of M^-1 b."""
    return _apply("mass_matrix", robot, (q,), _operators.given_beside(loads), status, threads)


def step_acceleration(
    step: ImplicitStep,
    q: Any,
    qd: Any,
    tau: Any,
    *,
    damping: Any = None,
    stiffness: Any = None,
    reference: Any = None,
    armature: Any = None,
    loads: Any = None,
    gravity: Any = None,
    status: bool = False,
    threads: int = 1,
) -> Any:
    """a = (qd+ - qd) / h of a step, (..., nv) of q (..., nq), qd and tau (..., nv): `ImplicitStep.acceleration`.

    damping, stiffness, reference: (..., nv), of every row its own, in place of the step's, and armature in place of the
    robot's; there are derivatives by them too. ValueError where the step has rows, or its robot's file has actuators or
    compensates gravity. A gain that is negative or not finite is an error of the whole call, which names row and DoF.
    """
    values = (q, qd, tau, *_operators.gains(step, damping, stiffness, reference, armature))
    return _apply("step_acceleration", step, values, _operators.given_beside(loads, gravity), status, threads)


def poses(kinematics: Kinematics, q: Any, *, threads: int = 1) -> tuple[jax.Array, jax.Array]:
    """Where frames are: positions (..., F, 3) and rotations (..., F, 3, 3) in the base's axes, of q (..., nq), as
    `Kinematics.compute` has them, kinematics: `robot.kinematics(frames)`. Derivatives are products with Jacobians,
    O(n) a frame: of a rotation dR = omega x R."""
    ((_, q, width),) = _operators.arguments("poses", kinematics, (q,), {}, threads)
    (q,) = _arrays(q)
    _operators.leading("poses", [("q", q, width)])
    return _poses(kinematics, threads, q)


@functools.partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _poses(kinematics: Kinematics, threads: int, q: jax.Array) -> tuple[jax.Array, jax.Array]:
    p, R = _placed("poses", kinematics, threads, q)
    return p, R


@_poses.defjvp
def _(kinematics: Kinematics, threads: int, primals: Any, tangents: Any) -> Any:
    p, R, J = _placed("poses_and_jacobians", kinematics, threads, *primals)
    twist = jnp.einsum("...fkn,...n->...fk", J, _velocity(kinematics, *primals, *tangents))
    return (p, R), (twist[..., 3:], jnp.cross(twist[..., :3, None], R, axis=-2))


def _placed(name: str, kinematics: Kinematics, threads: int, q: jax.Array) -> list[jax.Array]:
    """Positions, rotations and, where they are asked for, Jacobians (..., F, 6, nv)."""
    found = _value.bind(q, name=name, robot=kinematics, threads=threads, beside="")
    count, rows = len(kinematics.frames), q.shape[:-1]
    p, R, *J = (x.reshape(*rows, count, *rest) for x, rest in zip(found, ((3,), (3, 3), (6, -1))))
    return [p, R.swapaxes(-1, -2), *J]


def payload(mass: Any, center: Any = (0.0, 0.0, 0.0), inertia: Any = 0.0) -> Any:
    """Ten numbers of bodies for `loads`, (..., 10) of mass (...), center (..., 3) and inertia (..., 3), (..., 3, 3) or 0:
    `kalmarm.payload`, with derivatives."""
    m, c, given = _arrays(mass, center, inertia)
    return jnp.stack(jnp.broadcast_arrays(*ten_numbers(m, c, given, jnp.eye(3, dtype=c.dtype))), -1)


def _arrays(*given: Any) -> list[jax.Array]:
    """Lists and numbers take the dtype of arrays."""
    dtype = next((jnp.asarray(x).dtype for x in given if hasattr(x, "dtype")), float)
    return [jnp.asarray(x, None if hasattr(x, "dtype") else dtype) for x in given]


def _apply(
    name: str, robot: _operators.Asked, values: tuple[Any, ...], beside: dict[str, Any], status: bool, threads: int
) -> Any:
    arguments = _operators.arguments(name, robot, values, beside, threads)
    names, values, widths = zip(*arguments)
    given = list(zip(names, _arrays(*values), widths))
    rows = _operators.leading(name, given)
    arrays = [jnp.broadcast_to(x, (*rows, width)) for _, x, width in given]
    letters = "".join(_operators.BESIDE[one] for one in beside)
    result, error, state = _value.bind(*arrays, name=name, robot=robot, threads=threads, beside=letters)
    return (result, Outcomes(state, error)) if status else result


@functools.cache
def _number(robot: _operators.Asked) -> int:
    """By which programs name a robot, which stays from now on: a program may outlive all else that holds it."""
    return _core._jax_number(robot)


def _results(
    name: str, robot: _operators.Asked, of: jax.Array, by: str = ""
) -> list[jax.ShapeDtypeStruct]:
    """What a call returns of its first argument's rows."""
    shapes = _operators.shapes(name, robot, of.shape[:-1], by)
    is_value = name in _operators.VALUES
    dtypes = [of.dtype] * (len(shapes) - is_value) + [jnp.dtype("int32")] * is_value
    return [jax.ShapeDtypeStruct(*one) for one in zip(shapes, dtypes)]


def _call_xla(
    *arrays: jax.Array, name: str, robot: _operators.Asked, threads: int, beside: str, by: str = ""
) -> list[jax.Array]:
    if by and name.endswith("_jvp"):
        moved = " and ".join(one for one, letter in _operators.BESIDE.items() if letter in by)
        raise NotImplementedError(
            f"kalmarm.jax.{name}: {moved}: derivatives by these are in reverse mode alone"
        )
    call = jax.ffi.ffi_call(f"kalmarm.{name}", _results(name, robot, arrays[0], by))
    numbers = {"robot": np.int64(_number(robot)), "threads": np.int64(threads)}
    return list(call(*arrays, **numbers, beside=beside, by=by))


def _refuse(_: Any, *__: Any, name: str, **___: Any) -> Any:
    raise NotImplementedError(
        f"kalmarm.jax.{name} runs on the CPU alone: put its arguments there, "
        "jax.device_put(q, jax.devices('cpu')[0])"
    )


def _primitive(kind: str) -> Primitive:
    """A call whose arguments have the same rows."""
    primitive = Primitive(f"kalmarm_{kind}")
    primitive.multiple_results = True

    @functools.cache
    def compiled(**params: Any) -> Any:
        return jax.jit(functools.partial(primitive.bind, **params))

    @primitive.def_impl
    def _(*arrays: Any, **params: Any) -> Any:
        return compiled(**params)(*arrays)

    @primitive.def_abstract_eval
    def _(*arrays: Any, name: str, robot: _operators.Asked, by: str = "", **_params: Any) -> Any:
        results = _results(name, robot, arrays[0], by)
        return [jax.core.ShapedArray(x.shape, x.dtype) for x in results]

    def batched(arrays: Any, axes: Any, **params: Any) -> Any:
        (size,) = {x.shape[axis] for x, axis in zip(arrays, axes) if axis is not None}
        arrays = [
            jnp.broadcast_to(x, (size, *x.shape)) if axis is None else jnp.moveaxis(x, axis, 0)
            for x, axis in zip(arrays, axes)
        ]
        out = primitive.bind(*arrays, **params)
        return out, [0] * len(out)

    batching.primitive_batchers[primitive] = batched
    mlir.register_lowering(primitive, _refuse)
    mlir.register_lowering(primitive, mlir.lower_fun(_call_xla), platform="cpu")
    return primitive


# Primitives, since no public function has both directions and vmap: custom_vjp has no forward mode, and linear_call of
# jax.custom_derivatives, which a custom_jvp could use, has no rule for vmap (JAX 0.10). The arguments of derivatives are those
# of the call, then directions or weights, in which they are linear. beside: letters of what is given beside, by: of what of that is
# among the directions and results.
_value = _primitive("value")
_tangent = _primitive("tangent")
_gradient = _primitive("gradient")


def _value_jvp(
    primals: Any, tangents: Any, *, name: str, robot: _operators.Asked, threads: int, beside: str
) -> Any:
    _operators.check_differentiable(name, robot)
    params = {"robot": robot, "threads": threads, "beside": beside}
    out = _value.bind(*primals, name=name, **params)
    count = len(primals) - len(beside)
    moved = [x for x in tangents[count:] if type(x) is not ad.Zero]
    by = "".join(letter for letter, x in zip(beside, tangents[count:]) if type(x) is not ad.Zero)
    dq, *rest = map(ad.instantiate_zeros, [*tangents[:count], *moved])
    (result,) = _tangent.bind(
        *primals,
        _velocity(robot, primals[0], dq),
        *rest,
        name=f"{name}_jvp",
        by=by,
        **params,
    )
    return out, [result, *(ad.Zero(jax.typeof(x).to_tangent_aval()) for x in out[1:])]


def _velocity(robot: _operators.Asked, q: jax.Array, dq: jax.Array) -> jax.Array:
    """Along the axes of qd, (..., nv), of dq (..., nq): (1)."""
    parts, at = [], 0
    for i in robot.model.quaternions:
        parts.append(dq[..., at:i])
        p, d = q[..., i : i + 4], dq[..., i : i + 4]
        v, scale = p[..., 1:], 2 / jnp.sum(p * p, axis=-1, keepdims=True)
        parts.append(scale * (p[..., :1] * d[..., 1:] - d[..., :1] * v - jnp.cross(v, d[..., 1:])))
        at = i + 4
    return jnp.concatenate([*parts, dq[..., at:]], axis=-1)


def _linear_jvp(primitive: Primitive, count: Callable[[str, str], int]) -> Any:
    """count: of linear arguments, by the name and `by`."""

    def jvp(primals: Any, tangents: Any, *, name: str, by: str, **params: Any) -> Any:
        given = len(primals) - count(name, by)
        if not all(type(x) is ad.Zero for x in tangents[:given]):
            raise NotImplementedError(
                f"kalmarm.jax: derivatives of {name} are asked for, of second order: there are none"
            )
        bind = functools.partial(primitive.bind, *primals[:given], name=name, by=by, **params)
        return bind(*primals[given:]), bind(*map(ad.instantiate_zeros, tangents[given:]))

    return jvp


def _tangent_transpose(cotangents: Any, *arrays: Any, name: str, by: str, **params: Any) -> Any:
    given = len(arrays) - _directions(name, by)
    (w,) = map(ad.instantiate_zeros, cotangents)
    name = name.replace("_jvp", "_vjp")
    out = _gradient.bind(*arrays[:given], w, name=name, by=by, **params)
    wanted = map(ad.is_undefined_primal, arrays[given:])
    return [None] * given + [x if is_wanted else None for x, is_wanted in zip(out, wanted)]


def _gradient_transpose(cotangents: Any, *arrays: Any, name: str, **params: Any) -> Any:
    directions = map(ad.instantiate_zeros, cotangents)
    name = name.replace("_vjp", "_jvp")
    return [None] * (len(arrays) - 1) + _tangent.bind(*arrays[:-1], *directions, name=name, **params)


def _directions(name: str, by: str) -> int:
    return len(_operators.CALLS[name].names) + len(by)


ad.primitive_jvps[_value] = _value_jvp
ad.primitive_jvps[_tangent] = _linear_jvp(_tangent, _directions)
ad.primitive_jvps[_gradient] = _linear_jvp(_gradient, lambda *_: 1)
ad.primitive_transposes[_tangent] = _tangent_transpose
ad.primitive_transposes[_gradient] = _gradient_transpose
