"""Robots from Pinocchio's models, and states between its conventions and ours."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._names import one_of
from .builder import Builder
from .robot import Robot

_FREE, _BALL = "JointModelFreeFlyer", "JointModelSpherical"
_TURN = ("JointModelRUB", "JointModelRevoluteUnbounded")  # q is (cos, sin)
_X, _Y, _Z = np.eye(3)
# Joints of Pinocchio that are several of ours, one after another.
_SEVERAL = {
    "JointModelPlanar": (("slide", _X, ":x"), ("slide", _Y, ":y"), ("hinge", _Z, ":r:z")),
    "JointModelTranslation": (("slide", _X, ":x"), ("slide", _Y, ":y"), ("slide", _Z, ":z")),
    "JointModelSphericalZYX": (("hinge", _Z, ":r:z"), ("hinge", _Y, ":r:y"), ("hinge", _X, ":r:x")),
}
_THINNEST = 1e-4  # least of a balanced body's second moments over the largest, as `load` has it


def from_pinocchio(model: Any, *, inertia: str = "given", **options: Any) -> Robot:
    """The robot of a `pinocchio.Model`: hinges, slides, continuous, planar, spherical and
    translational joints and free flyers, inertias, armature and gravity.

    DoF have Pinocchio's order; `PinocchioStates` converts q, velocities, torques and accelerations.
    Here a continuous joint has an angle in q, where Pinocchio has its cosine and sine, a planar one
    is two slides and a hinge, quaternions are (w, x, y, z), and linear velocities of a free joint
    have the axes of the world, of a planar joint those where it stands at q = 0. Friction and
    damping are ignored, and named in one UserWarning.

    inertia: "given" or "balanced", of principal moments that no solid body has, as of `load`.
    Options are those of `Robot`. ValueError, with the joint, where one is of another kind: helical,
    universal, ellipsoidal or composite, or mimics another.
    """
    robot = _lower(model, one_of("inertia", inertia, ("given", "balanced")), options)
    for note in robot.notes:
        warnings.warn(f"{robot.name}: {note}", UserWarning, stacklevel=2)
    return robot


def _lower(model: Any, inertias: str, options: dict[str, Any]) -> Robot:
    if not hasattr(model, "jointPlacements"):
        raise TypeError(f"from_pinocchio: {type(model).__name__} is no pinocchio.Model")
    if model.nv == 0:
        raise ValueError(f"{model.name}: no joint, so no degree of freedom")
    builder = Builder(model.name or "robot", gravity=model.gravity.linear)
    data = model.createData()
    standing = [-1] * model.njoints
    not_solid = []
    for number in range(1, model.njoints):
        one, name = model.joints[number], model.names[number]
        placement, inertia = model.jointPlacements[number], model.inertias[number]
        tensor = inertia.inertia
        if not _is_solid(tensor):
            not_solid.append(name)
            tensor = _balanced(tensor) if inertias == "balanced" else tensor
        armature = model.armature[one.idx_v : one.idx_v + one.nv]
        parent = standing[model.parents[number]]
        parts = _parts(one, data.joints[number], model, name)
        where = {"position": placement.translation, "rotation": _wxyz(placement.rotation)}
        for k, (joint, axis, suffix) in enumerate(parts):
            last = k == len(parts) - 1
            body = {
                "mass": inertia.mass,
                "center_of_mass": inertia.lever,
                "inertia": tensor,
                "solid": False,
            }
            parent = builder.add_body(
                name if last else "",
                parent=parent,
                joint=joint,
                joint_name=name + suffix,
                axis=axis,
                armature=armature if last and k == 0 else armature[k],
                limits=_limits(one, model, k),
                **where,
                **(body if last else {}),
            )
            where = {}
        standing[number] = parent
    frames = {frame.name: frame for frame in reversed(model.frames)}
    for name, frame in frames.items():
        if name not in model.names:
            builder.add_frame(
                name,
                standing[frame.parentJoint],
                position=frame.placement.translation,
                rotation=_wxyz(frame.placement.rotation),
            )
    ignored = [
        f"{kind} of {np.count_nonzero(values)} DoF"
        for kind, values in (("damping", model.damping), ("friction", model.friction))
        if np.any(values)
    ]
    notes = ["ignored: " + ", ".join(ignored)] if ignored else []
    if not_solid:
        taken = "taken as given" if inertias == "given" else "balanced"
        bodies = ", ".join(f"'{name}'" for name in not_solid)
        notes.append(f"{taken}, although no solid body has such moments of inertia: {bodies}")
    return builder.build(notes=notes, **options)


Part = tuple[str, Any, str]  # joint, axis, what is added to the name of its DoF


def _parts(joint: Any, data: Any, model: Any, name: str) -> tuple[Part, ...]:
    """The joints of ours that one of Pinocchio's is."""
    kind = joint.shortname()
    if kind == _FREE:
        return (("free", _Z, ""),)
    if kind == _BALL:
        return (("ball", _Z, ""),)
    if kind in _SEVERAL:
        return _SEVERAL[kind]
    if kind.startswith("JointModelMimic"):
        raise ValueError(
            f"joint '{name}' is a {kind}, which has no DoF of its own: build the model without "
            "mimic, and couple the joint by a CoupledRow of ImplicitStep"
        )
    if joint.nv == 1:
        q = np.zeros(model.nq)
        q[joint.idx_q] = joint.nq - 1  # the cosine of a continuous joint
        joint.calc(data, q)
        motion = np.asarray(data.S).reshape(6)  # (linear, angular)
        linear, angular = motion[:3], motion[3:]
        if not np.any(angular):
            return (("slide", linear, ""),)
        if not np.any(linear):
            return (("hinge", angular, ""),)
    raise ValueError(f"joint '{name}' is a {kind}: not supported")


def _limits(joint: Any, model: Any, k: int) -> tuple[float, float] | None:
    """Of entry k of a joint's q, where that is of its DoF k."""
    if joint.nq != joint.nv and not (joint.shortname() == "JointModelPlanar" and k < 2):
        return None
    at = joint.idx_q + k
    low, high = (float(x[at]) for x in (model.lowerPositionLimit, model.upperPositionLimit))
    return (low, high) if max(-low, high) <= 1e3 else None


def _is_solid(tensor: NDArray[np.float64]) -> bool:
    """To as many digits as files have."""
    moments = np.linalg.eigvalsh(tensor)
    return bool(moments[0] + moments[1] >= moments[2] * (1 - 1e-6))


def _balanced(tensor: NDArray[np.float64]) -> NDArray[np.float64]:
    """The nearest solid body's, by its second moments."""
    moments, axes = np.linalg.eigh(tensor)
    second = moments.sum() / 2 - moments
    second = np.maximum(second, _THINNEST * second.max())
    balanced: NDArray[np.float64] = axes @ np.diag(second.sum() - second) @ axes.T
    return balanced


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


class _Moving(NamedTuple):
    """A joint with velocities in the axes of its body: m linear ones, then angular ones, of three
    the last k."""

    v: int
    m: int
    k: int
    turn: int  # where q has its quaternion (x, y, z, w), or cosine and sine

    @property
    def linear(self) -> slice:
        return slice(self.v, self.v + self.m)

    @property
    def angular(self) -> slice:
        return slice(self.v + self.m, self.v + self.m + self.k)

    def linear_of(self, x: NDArray[Any]) -> NDArray[Any]:
        out = np.zeros((*x.shape[:-1], 3), x.dtype)
        out[..., : self.m] = x[..., self.linear]
        return out

    def angular_of(self, x: NDArray[Any]) -> NDArray[Any]:
        out = np.zeros((*x.shape[:-1], 3), x.dtype)
        out[..., 3 - self.k :] = x[..., self.angular]
        return out


class PinocchioStates:
    """States of a `pinocchio.Model` and of the robot made from it, each in its conventions.

    q differs where joints have quaternions, (x, y, z, w) there and (w, x, y, z) here, or cosine and
    sine, an angle here. The linear velocity, acceleration and force of a free or planar joint are
    in the body's axes there, its velocity seen from the body; here in the world's axes, or those
    where the planar joint stands. With R the body's rotation, v and w the velocities there:

        qd = R v,   qdd = R (vd + w x v),   tau = R tau_pinocchio

    Arrays are (..., nq) or (..., nv).
    """

    def __init__(self, model: Any) -> None:
        self._moving: list[_Moving] = []
        self._quaternions: list[tuple[int, int]] = []  # theirs, ours
        self._turns: list[tuple[int, int]] = []
        copied: list[tuple[int, int]] = []
        ours = 0
        for joint in model.joints:
            kind, q, v = joint.shortname(), joint.idx_q, joint.idx_v
            if q < 0:
                continue  # the universe
            plain = joint.nq
            if kind == _FREE:
                plain = 3
                self._moving.append(_Moving(v, 3, 3, q + 3))
            elif kind == "JointModelPlanar":
                plain = 2
                self._moving.append(_Moving(v, 2, 1, q + 2))
            elif kind == _BALL or kind.startswith(_TURN):
                plain = 0
            copied += [(q + i, ours + i) for i in range(plain)]
            rest = joint.nq - plain  # 4 of a quaternion, 2 of cosine and sine
            if rest == 4:
                self._quaternions.append((q + plain, ours + plain))
            elif rest == 2:
                self._turns.append((q + plain, ours + plain))
            ours += plain + {0: 0, 2: 1, 4: 4}[rest]
        self._nq = ours
        self._copied = tuple(np.array(copied, int).reshape(-1, 2).T)

    def q(self, q: Any) -> NDArray[Any]:
        """Our q of Pinocchio's."""
        q = np.asarray(q)
        out = np.empty((*q.shape[:-1], self._nq), q.dtype)
        theirs, ours = self._copied
        out[..., ours] = q[..., theirs]
        for i, k in self._quaternions:
            out[..., k : k + 4] = np.roll(q[..., i : i + 4], 1, axis=-1)
        for i, k in self._turns:
            out[..., k] = np.arctan2(q[..., i + 1], q[..., i])
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
        for one in self._moving:
            out[..., one.linear] += self._seen(one, v)
        return self._turn(q, out)

    def a(self, q: Any, v: Any, qdd: Any) -> NDArray[Any]:
        """Pinocchio's accelerations of its q and v and our qdd."""
        v, out = np.asarray(v), self._turn(q, qdd, back=True)
        for one in self._moving:
            out[..., one.linear] -= self._seen(one, v)
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
        for one in self._moving:
            linear, angular = one.linear, one.angular
            x = np.zeros((*v.shape[:-1], 3), v.dtype)
            x[..., : one.m] = np.asarray(a)[..., linear] + self._seen(one, v)
            some = np.s_[..., : one.m, 3 - one.k :]  # of a cross product's matrix
            by_v[..., linear, linear] = _cross_matrix(one.angular_of(v))[..., : one.m, : one.m]
            by_v[..., linear, angular] = -_cross_matrix(one.linear_of(v))[some]
            v_turns[..., linear, angular] = _cross_matrix(one.linear_of(v))[some]
            tau_turns[..., linear, angular] = _cross_matrix(one.linear_of(tau))[some]
            x_turns[..., linear, angular] = -_cross_matrix(x)[some]
        a_v = a_v + by_v
        a_q = a_q + a_v @ v_turns + a_tau @ tau_turns + x_turns
        return turn @ a_q @ back, turn @ a_v @ back, turn @ a_tau @ back

    @staticmethod
    def _seen(one: _Moving, v: NDArray[Any]) -> NDArray[Any]:
        """w x v"""
        return np.cross(one.angular_of(v), one.linear_of(v))[..., : one.m]

    def _turn(self, q: Any, x: Any, back: bool = False) -> NDArray[Any]:
        """Linear parts of moving joints, from the body's axes to ours, or back."""
        q, out = np.asarray(q), np.array(x)
        for one in self._moving:
            part = one.linear_of(out)
            if one.k == 3:
                xyz, w = q[..., one.turn : one.turn + 3], q[..., one.turn + 3 : one.turn + 4]
                u = -xyz if back else xyz
                turned = part + 2 * np.cross(u, np.cross(u, part) + w * part)
            else:
                cos, sin = q[..., one.turn], q[..., one.turn + 1]
                s = -sin if back else sin
                turned = np.stack(
                    [cos * part[..., 0] - s * part[..., 1], s * part[..., 0] + cos * part[..., 1]],
                    axis=-1,
                )
            out[..., one.linear] = turned
        return out


def _cross_matrix(x: NDArray[Any]) -> NDArray[Any]:
    """[x], so that [x] y = x x y; (..., 3, 3)."""
    return np.swapaxes(np.cross(x[..., None, :], np.eye(3, dtype=x.dtype)), -1, -2)
