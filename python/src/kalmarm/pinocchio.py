"""Robots from Pinocchio's models, and states between its conventions and ours."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .builder import Builder
from .robot import Robot

_FREE, _BALL = "JointModelFreeFlyer", "JointModelSpherical"


class _Free(NamedTuple):
    q: int
    v: int


def from_pinocchio(model: Any, **options: Any) -> Robot:
    """The robot of a `pinocchio.Model`: hinges, slides, spherical joints and free flyers, inertias,
    armature and gravity.

    DoF have Pinocchio's order. Quaternions are (w, x, y, z) and the linear velocity of a free joint
    has the axes of the world: `PinocchioStates` converts. Friction and damping are ignored, and
    named in one UserWarning. Options are those of `Robot`.
    """
    robot = _lower(model, options)
    for note in robot.notes:
        warnings.warn(f"{robot.name}: {note}", UserWarning, stacklevel=2)
    return robot


def _lower(model: Any, options: dict[str, Any]) -> Robot:
    if not hasattr(model, "jointPlacements"):
        raise TypeError(f"from_pinocchio: {type(model).__name__} is no pinocchio.Model")
    if model.nv == 0:
        raise ValueError(f"{model.name}: no joint, so no degree of freedom")
    builder = Builder(model.name or "robot", gravity=model.gravity.linear)
    data = model.createData()
    standing = [-1] * model.njoints
    q0 = np.zeros(model.nq)
    for joint in range(1, model.njoints):
        one = model.joints[joint]
        kind, dofs = one.shortname(), slice(one.idx_v, one.idx_v + one.nv)
        placement, inertia = model.jointPlacements[joint], model.inertias[joint]
        named = {"name": model.names[joint], "armature": model.armature[dofs]}
        limits = None
        if kind == _FREE:
            joined, axis = "free", None
            q0[one.idx_q + 3] = 1
        elif kind == _BALL:
            joined, axis = "ball", None
            q0[one.idx_q] = 1
        elif one.nv == 1 and one.nq == 1 and not kind.startswith("JointModelMimic"):
            joined, axis = _axis(one, data.joints[joint], model, kind)
            low, high = (
                float(x[one.idx_q]) for x in (model.lowerPositionLimit, model.upperPositionLimit)
            )
            limits = (low, high) if max(-low, high) <= 1e3 else None
        else:
            raise ValueError(f"joint '{model.names[joint]}' is a {kind}: not supported")
        standing[joint] = builder.add_body(
            parent=standing[model.parents[joint]],
            joint=joined,
            axis=(0, 0, 1) if axis is None else axis,
            position=placement.translation,
            rotation=_wxyz(placement.rotation),
            limits=limits,
            mass=inertia.mass,
            center_of_mass=inertia.lever,
            inertia=inertia.inertia,
            **named,
        )
    frames = {frame.name: frame for frame in reversed(model.frames)}
    for name, frame in frames.items():
        if name not in model.names:
            builder.add_frame(
                name,
                standing[frame.parentJoint],
                position=frame.placement.translation,
                rotation=_wxyz(frame.placement.rotation),
            )
    notes = [
        f"{kind} of {np.count_nonzero(values)} DoF"
        for kind, values in (("damping", model.damping), ("friction", model.friction))
        if np.any(values)
    ]
    return builder.build(q0=q0, notes=["ignored: " + ", ".join(notes)] if notes else [], **options)


def _axis(joint: Any, data: Any, model: Any, kind: str) -> tuple[str, NDArray[np.float64]]:
    joint.calc(data, np.zeros(model.nq))
    motion = np.asarray(data.S).reshape(6)  # (linear, angular)
    linear, angular = motion[:3], motion[3:]
    if np.any(linear) == np.any(angular):
        raise ValueError(f"a joint is a {kind}: not supported")
    return ("slide", linear) if np.any(linear) else ("hinge", angular)


def _wxyz(R: NDArray[np.float64]) -> NDArray[np.float64]:
    """The quaternion (w, x, y, z) of a rotation matrix, by its largest entry."""
    K = np.array(
        [
            [R[0, 0] + R[1, 1] + R[2, 2], 0, 0, 0],
            [R[2, 1] - R[1, 2], R[0, 0] - R[1, 1] - R[2, 2], 0, 0],
            [R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0],
            [R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    K += np.tril(K, -1).T
    i = int(np.argmax(np.diag(K)))
    column = K[:, i].copy()
    column[i] += 1  # 4 q q[i]
    quaternion: NDArray[np.float64] = column / np.linalg.norm(column)
    return quaternion


class PinocchioStates:
    """States of a `pinocchio.Model` and of the robot made from it, each in its conventions.

    They differ where joints have quaternions, (x, y, z, w) there and (w, x, y, z) here, and in the
    linear velocity, acceleration and force of a free joint: in the body's axes there, its velocity
    seen from the body; in the world's axes here. With R the body's rotation, v and w the velocities
    there:

        qd = R v,   qdd = R (vd + w x v),   tau = R tau_pinocchio

    Arrays are (..., nq) or (..., nv).
    """

    def __init__(self, model: Any) -> None:
        joints = [(joint.shortname(), joint) for joint in model.joints]
        self._free = [_Free(j.idx_q, j.idx_v) for kind, j in joints if kind == _FREE]
        self._quaternions = [free.q + 3 for free in self._free]
        self._quaternions += [j.idx_q for kind, j in joints if kind == _BALL]

    def q(self, q: Any) -> NDArray[Any]:
        """Our q of Pinocchio's."""
        out = np.array(q)
        for i in self._quaternions:
            out[..., i : i + 4] = np.roll(out[..., i : i + 4], 1, axis=-1)
        return out

    def qd(self, q: Any, v: Any) -> NDArray[Any]:
        """Our qd of Pinocchio's q and v."""
        return self._turn(q, v)

    def tau(self, q: Any, tau: Any) -> NDArray[Any]:
        """Our torques of Pinocchio's."""
        return self._turn(q, tau)

    def qdd(self, q: Any, v: Any, a: Any) -> NDArray[Any]:
        """Our accelerations of Pinocchio's q, v and a."""
        v, out = np.asarray(v), np.array(a)
        for _, i in self._free:
            out[..., i : i + 3] += np.cross(v[..., i + 3 : i + 6], v[..., i : i + 3])
        return self._turn(q, out)

    def a(self, q: Any, v: Any, qdd: Any) -> NDArray[Any]:
        """Pinocchio's accelerations of its q and v and our qdd."""
        v, out = np.asarray(v), self._turn(q, qdd, back=True)
        for _, i in self._free:
            out[..., i : i + 3] -= np.cross(v[..., i + 3 : i + 6], v[..., i : i + 3])
        return out

    def derivatives(
        self, q: Any, v: Any, tau: Any, a: Any, a_q: Any, a_v: Any, a_tau: Any
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Our dq, dqd and dtau of Pinocchio's state, its a and its derivatives of a: ddq_dq,
        ddq_dv and both triangles of Minv, of `computeABADerivatives`, (..., nv, nv).

        Theirs by q keep v and tau in the body's axes, ours in the world's. Where the body turns by
        dphi, with x = vd + w x v the linear acceleration in its axes:

            dv = v x dphi,   dtau = tau x dphi,   d(R x) = R (dx - x x dphi)
        """
        v, tau = np.asarray(v), np.asarray(tau)
        n = v.shape[-1]
        eye = np.broadcast_to(np.eye(n, dtype=v.dtype), (*v.shape, n))
        back = self._turn(np.asarray(q)[..., None, :], eye)  # R' of the linear parts
        turn = np.swapaxes(back, -1, -2)
        by_v, v_turns, tau_turns, x_turns = (np.zeros((*v.shape, n), v.dtype) for _ in range(4))
        for _, i in self._free:
            linear, angular = slice(i, i + 3), slice(i + 3, i + 6)
            w = v[..., angular]
            x = np.asarray(a)[..., linear] + np.cross(w, v[..., linear])
            by_v[..., linear, linear] = _cross_matrix(w)
            by_v[..., linear, angular] = -_cross_matrix(v[..., linear])
            v_turns[..., linear, angular] = _cross_matrix(v[..., linear])
            tau_turns[..., linear, angular] = _cross_matrix(tau[..., linear])
            x_turns[..., linear, angular] = -_cross_matrix(x)
        a_v = a_v + by_v
        a_q = a_q + a_v @ v_turns + a_tau @ tau_turns + x_turns
        return turn @ a_q @ back, turn @ a_v @ back, turn @ a_tau @ back

    def _turn(self, q: Any, x: Any, back: bool = False) -> NDArray[Any]:
        """Linear parts of free joints, from the body's axes to the world's, or back."""
        q, out = np.asarray(q), np.array(x)
        for free in self._free:
            xyz, w = q[..., free.q + 3 : free.q + 6], q[..., free.q + 6 : free.q + 7]
            u = -xyz if back else xyz
            part = out[..., free.v : free.v + 3]
            out[..., free.v : free.v + 3] = part + 2 * np.cross(u, np.cross(u, part) + w * part)
        return out


def _cross_matrix(x: NDArray[Any]) -> NDArray[Any]:
    """[x], so that [x] y = x x y; (..., 3, 3)."""
    return np.swapaxes(np.cross(x[..., None, :], np.eye(3, dtype=x.dtype)), -1, -2)
