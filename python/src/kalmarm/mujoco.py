"""Robots from MuJoCo's compiled models: the public arrays of a Python `MjModel`, and no more."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _actuators, _tendons
from ._names import counted
from .builder import Builder
from .robot import Robot, Terms

# Of MuJoCo's enumerations, which its C interface fixes.
_FREE, _BALL, _SLIDE, _HINGE = range(4)
_GRAVITY_DISABLED = 1 << 7
_SPRING_DISABLED, _DAMPER_DISABLED = 1 << 5, 1 << 6
_JOINT_TRANSMISSION, _TENDON_TRANSMISSION = 0, 3
_EQUALITIES = {
    0: "connect constraint",
    1: "weld constraint",
    2: "coupling of joints",
    3: "coupling of tendons",
}
_FARTHEST = 1e3  # limits beyond count as none


def from_mujoco(
    model: Any,
    *,
    name: str | None = None,
    ctrl: Any = None,
    takes_steps: bool = False,
    **options: Any,
) -> Robot:
    """The robot of a `mujoco.MjModel`: bodies, joints, inertias, armature (of joints, and of
    actuators on a single hinge or slide) and gravity.

    q is qpos, qd is qvel. What else moves the robot is ignored, and named in one UserWarning:
    constraints, actuators, tendons, damping, friction, springs. Contacts and limits are not named.

    ctrl: controls (nu,) of the actuators in `Robot.terms`; zero unless given.
    takes_steps: whoever asks takes an `ImplicitStep` with `Robot.terms`: no warning names what
        these have. Fixed tendons may have armature then, which is in `terms.rows` and not in the
        robot's M; else that is refused.
    Options are those of `Robot`.
    """
    controls = np.zeros(model.nu) if ctrl is None else np.asarray(ctrl, float)
    if controls.shape != (model.nu,):
        raise ValueError(f"ctrl has shape {controls.shape}, ({model.nu},) is needed")
    notes = ignored(model, controls if takes_steps else None)
    name = name or _name(model, 0) or "robot"
    robot = lower(model, name, notes, options, controls, takes_steps=takes_steps)
    for note in robot.notes:
        warnings.warn(f"{robot.name}: {note}", UserWarning, stacklevel=2)
    return robot


def _name(model: Any, address: int) -> str:
    return model.names[address : model.names.index(b"\0", address)].decode()


def lower(
    model: Any,
    name: str,
    notes: list[str],
    options: dict[str, Any],
    controls: np.ndarray,
    q0: Any = None,
    takes_steps: bool = False,
) -> Robot:
    """controls: (nu,) of the actuators in the robot's terms. takes_steps: with tendons' armature."""
    _tendons.refuse_armature(model, name, takes_steps)
    builder = _bodies(model, name, takes_steps=takes_steps)
    return builder.build(
        q0=model.qpos0 if q0 is None else q0,
        notes=notes,
        terms=_terms(model, name, controls),
        **options,
    )


def _bodies(
    model: Any, name: str, weights: bool = False, takes_steps: bool = False
) -> Builder:
    """weights: with the weights alone that are compensated, as points."""
    if model.nv == 0:
        raise ValueError(f"{name}: no joint, so no degree of freedom")
    falls = not model.opt.disableflags & _GRAVITY_DISABLED
    builder = Builder(name, gravity=model.opt.gravity if falls else (0, 0, 0))
    armature, shares = np.zeros(model.nv), np.maximum(model.body_gravcomp, 0)
    if not weights:
        armature = model.dof_armature + _reflected_armature(model, name, takes_steps)
        shares = np.ones(model.nbody)

    names = [_name(model, address) for address in model.name_bodyadr]
    standing = [-1] * model.nbody  # the builder's body with each body's frame
    moves = [False] * model.nbody
    for body in range(1, model.nbody):
        parent = int(model.body_parentid[body])
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        moves[body] = count > 0 or moves[parent]
        at, position, rotation = standing[parent], model.body_pos[body], model.body_quat[body]
        for joint in range(first, first + count):
            at, position, rotation = _add_joint(
                builder, model, joint, at, position, rotation, armature, names[body]
            )
        standing[body] = builder.add_body(
            names[body], parent=at, position=position, rotation=rotation
        )
        if moves[body]:  # the inertial frame: its axes are the principal ones
            builder.add_body(
                parent=standing[body],
                position=model.body_ipos[body],
                rotation=model.body_iquat[body],
                mass=shares[body] * model.body_mass[body],
                inertia=np.zeros(3) if weights else model.body_inertia[body],
            )
    for site in range(model.nsite):
        if called := _name(model, int(model.name_siteadr[site])):
            builder.add_frame(
                called,
                standing[int(model.site_bodyid[site])],
                position=model.site_pos[site],
                rotation=model.site_quat[site],
            )
    return builder


def _terms(model: Any, name: str, controls: np.ndarray) -> Terms:
    off = int(model.opt.disableflags)
    damping, stiffness, reference = (np.zeros(model.nv) for _ in range(3))
    if not off & _DAMPER_DISABLED:
        damping += model.dof_damping + _actuators.reflected_damping(model)
    single = np.flatnonzero(np.isin(model.jnt_type, (_HINGE, _SLIDE)))
    if not off & _SPRING_DISABLED:
        dofs = model.jnt_dofadr[single]
        stiffness[dofs] = model.jnt_stiffness[single]
        reference[dofs] = model.qpos_spring[model.jnt_qposadr[single]]
    passive = off & _SPRING_DISABLED and off & _DAMPER_DISABLED
    compensates = np.any(model.body_gravcomp > 0) and not passive
    compensated = _bodies(model, name, weights=True) if compensates else None
    actuators = _actuators.affine(model, controls)
    rows = _tendons.rows(model, actuators)
    damping, stiffness, reference, torque = _actuators.driven(
        damping, stiffness, reference, actuators
    )
    for one in actuators:
        if one.row >= 0 and one.stiffness == 0:
            torque += np.asarray(rows[one.row].jacobian) * (one.gain * one.control + one.constant)
    return Terms(
        damping,
        stiffness,
        reference,
        torque,
        actuators,
        compensated and compensated.build(wants=("inverse_dynamics",)),
        rows,
    )


def _add_joint(
    builder: Builder,
    model: Any,
    joint: int,
    parent: int,
    position: Any,
    rotation: Any,
    armature: np.ndarray,
    body: str,
) -> tuple[int, Any, Any]:
    """Adds a joint to what stands at `position` and `rotation` on `parent`; returns where that
    stands now."""
    kind, dof = int(model.jnt_type[joint]), int(model.jnt_dofadr[joint])
    name = _name(model, int(model.name_jntadr[joint])) or f"{body or 'body'}_joint"
    identity = (1.0, 0.0, 0.0, 0.0)
    if kind == _FREE:  # its q is the body's pose in the world
        at = builder.add_body(
            joint="free", joint_name=name, armature=armature[dof : dof + 6]
        )
        return at, (0, 0, 0), identity
    if kind == _BALL:
        anchor = model.jnt_pos[joint]
        at = builder.add_body(
            parent=parent,
            joint="ball",
            joint_name=name,
            position=position + _turned(rotation, anchor),
            rotation=rotation,
            armature=armature[dof : dof + 3],
        )
        return at, -anchor, identity
    anchor = model.jnt_pos[joint] if kind == _HINGE else np.zeros(3)
    low, high = model.jnt_range[joint]
    limited = model.jnt_limited[joint] and max(-low, high) <= _FARTHEST
    at = builder.add_body(
        parent=parent,
        joint="hinge" if kind == _HINGE else "slide",
        joint_name=name,
        axis=model.jnt_axis[joint],
        position=position + _turned(rotation, anchor),
        rotation=rotation,
        reference=model.qpos0[model.jnt_qposadr[joint]],
        armature=armature[dof],
        limits=(float(low), float(high)) if limited else None,
    )
    return at, -anchor, identity


def _turned(quaternion: Any, vector: Any) -> np.ndarray:
    """vector in the axes that the quaternion (w, x, y, z) turns."""
    w, u = quaternion[0], np.asarray(quaternion[1:])
    turned: np.ndarray = vector + 2 * np.cross(u, np.cross(u, vector) + w * vector) / (
        w * w + u @ u
    )
    return turned


def _reflected_armature(model: Any, name: str, takes_steps: bool) -> np.ndarray:
    """Armature of the actuators that drive a joint, as its own inertia feels it."""
    out = np.zeros(model.nv)
    for i in np.flatnonzero(model.actuator_armature):
        of_tendon = model.actuator_trntype[i] == _TENDON_TRANSMISSION
        if takes_steps and of_tendon and not _tendons.reason(model, model.actuator_trnid[i, 0]):
            continue
        if model.actuator_trntype[i] != _JOINT_TRANSMISSION:
            raise ValueError(f"{name}: armature of an actuator that drives no joint: not supported")
        joint = int(model.actuator_trnid[i, 0])
        if model.jnt_type[joint] not in (_HINGE, _SLIDE):
            raise ValueError(
                f"{name}: armature of an actuator on a joint of several axes: not supported"
            )
        gear = model.actuator_gear[i, 0]
        out[model.jnt_dofadr[joint]] += model.actuator_armature[i] * gear * gear
    return out


def ignored(model: Any, controls: np.ndarray | None = None) -> list[str]:
    """What moves the robot beyond M and the bias, in one line; none where there is nothing.
    controls: of whoever takes steps with the robot's terms, which are not ignored then."""
    steps = controls is not None
    actuators = (
        _actuators.left_out(model, controls)
        if steps
        else [("actuator", len(model.actuator_trntype))]
    )
    things = [*actuators, *_tendons.left_out(model, steps)]
    parts = [counted(count, kind) for kind, count in _things(model, things)]
    sprung = np.any(np.atleast_2d(model.jnt_stiffness.T) != 0, axis=0)
    single = np.isin(model.jnt_type, (_HINGE, _SLIDE))
    of_joints = (
        ("damping", (model.dof_damping != 0) & (not steps), model.dof_jntid),
        ("friction", model.dof_frictionloss != 0, model.dof_jntid),
        ("springs", sprung & ~single if steps else sprung, None),
        ("limits of actuators' forces", (model.jnt_actfrclimited != 0) & steps, None),
    )
    for kind, acts, joints in of_joints:
        where = np.flatnonzero(acts)
        count = len(set(where if joints is None else joints[where]))
        if count:
            parts.append(f"{kind} of {counted(count, 'joint')}")
    if steps and (limited := _actuators.limited(model, controls)):
        parts.append(f"force limits of {counted(limited, 'actuator')}")
    shares = model.body_gravcomp
    if compensated := int(np.count_nonzero(shares < 0 if steps else shares != 0)):
        negative = "negative " if steps else ""
        parts.append(f"{negative}gravity compensation of {counted(compensated, 'body')}")
    if model.opt.density != 0 or model.opt.viscosity != 0:
        parts.append("drag of a medium")
    return ["ignored: " + ", ".join(parts)] if parts else []


def _things(model: Any, things: list[tuple[str, int]]) -> Iterator[tuple[str, int]]:
    active = np.asarray(model.eq_active0, bool)
    for kind, count in Counter(model.eq_type[active].tolist()).items():
        yield _EQUALITIES.get(kind, "equality of another kind"), count
    for kind, count in (*things, ("flex", model.nflex)):
        if count:
            yield kind, int(count)
