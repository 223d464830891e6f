"""Actuators of a compiled MuJoCo model as springs, dampers and torques of implicit steps.

On a hinge or slide with gear G, at a control u, with a gain of g0 + g1 l + g2 l' and a bias of
b0 + b1 l + b2 l' by the length l = G q, the joint feels

    G (g0 u + b0) - k q - b q',  k = -G^2 (g1 u + b1),  b = -G^2 (g2 u + b2)
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from . import _tendons
from .robot import Actuator

# Of MuJoCo's enumerations, which its C interface fixes.
_JOINT, _JOINT_IN_PARENT, _TENDON = 0, 1, 3
_TARGETS = {2: "a slider-crank", 4: "a site", 5: "a body"}
_SINGLE = (2, 3)  # slides and hinges
_CLAMP_DISABLED, _ACTUATION_DISABLED = 1 << 8, 1 << 11
_FIXED, _AFFINE = 0, 1  # gains; of biases: none, affine


def _is_off(model: Any, i: int) -> bool:
    group = int(model.actuator_group[i])
    in_groups = 0 <= group < 31 and int(model.opt.disableactuator) >> group & 1
    return bool(model.opt.disableflags & _ACTUATION_DISABLED or in_groups)


def reason(model: Any, i: int) -> str:
    """What the actuator is that has no terms, "actuator of a tendon"; empty where it has."""
    if _is_off(model, i):
        return "actuator of a group that is switched off"
    transmission = int(model.actuator_trntype[i])
    if transmission == _TENDON:
        if why := _tendons.reason(model, int(model.actuator_trnid[i, 0])):
            return f"actuator of a {why}"
    elif transmission not in (_JOINT, _JOINT_IN_PARENT):
        return f"actuator of {_TARGETS.get(transmission, 'another kind')}"
    elif model.jnt_type[model.actuator_trnid[i, 0]] not in _SINGLE:
        return "actuator of a joint of several axes"
    if model.actuator_plugin[i] >= 0:
        return "actuator of a plugin"
    if model.actuator_dyntype[i] != 0:
        return "actuator with activation dynamics"
    if model.actuator_delay[i] != 0 or model.actuator_history[i, 0] != 0:
        return "actuator with a delay"
    if np.any(model.actuator_dampingpoly[i] != 0):
        return "actuator with nonlinear damping"
    affine = model.actuator_gaintype[i] <= _AFFINE and model.actuator_biastype[i] <= _AFFINE
    return "" if affine else "actuator with a force that is not affine"


def control_of(model: Any, i: int) -> int:
    """Where in ctrl the control of an actuator with terms is."""
    return int(model.actuator_ctrladr[i]) if hasattr(model, "actuator_ctrladr") else i


def _actuator(model: Any, i: int, controls: np.ndarray) -> Actuator:
    target, on_tendon = int(model.actuator_trnid[i, 0]), model.actuator_trntype[i] == _TENDON
    at = control_of(model, i)
    u, gear = float(controls[at]), float(model.actuator_gear[i, 0])
    if model.actuator_ctrllimited[at] and not model.opt.disableflags & _CLAMP_DISABLED:
        u = float(np.clip(u, *model.actuator_ctrlrange[at]))
    gain = np.array(model.actuator_gainprm[i, :3])
    bias = np.array(model.actuator_biasprm[i, :3])
    if model.actuator_gaintype[i] == _FIXED:
        gain[1:] = 0
    if model.actuator_biastype[i] != _AFFINE:
        bias[:] = 0
    stiffness, damping = (0 - gear * gear * (gain * u + bias)[1:]).tolist()
    address = int(model.name_actuatoradr[i])
    out = Actuator(
        name=model.names[address : model.names.index(b"\0", address)].decode(),
        dof=-1 if on_tendon else int(model.jnt_dofadr[target]),
        control=u,
        gain=gear * float(gain[0]),
        constant=gear * float(bias[0]),
        stiffness=stiffness,
        damping=damping,
        row=_tendons.numbered(model)[target] if on_tendon else -1,
    )
    if not all(math.isfinite(x) for x in out[2:]):
        raise ValueError(f"actuator '{out.name}': a number is not finite")
    return out


def _pushes_away(actuator: Actuator) -> bool:
    return actuator.stiffness < 0 or actuator.damping < 0


def _with_terms(model: Any, controls: np.ndarray) -> list[tuple[int, Actuator]]:
    count = len(model.actuator_trntype)
    return [(i, _actuator(model, i, controls)) for i in range(count) if not reason(model, i)]


def affine(model: Any, controls: np.ndarray) -> tuple[Actuator, ...]:
    """Those that have terms."""
    return tuple(one for _, one in _with_terms(model, controls) if not _pushes_away(one))


def left_out(model: Any, controls: np.ndarray) -> list[tuple[str, int]]:
    """Kinds of those that have none, and how many there are of each."""
    on = [i for i in range(len(model.actuator_trntype)) if not _is_off(model, i)]
    kinds = Counter(why for i in on if (why := reason(model, i)))
    away = sum(_pushes_away(one) for _, one in _with_terms(model, controls))
    return [*kinds.items(), ("actuator with negative stiffness or damping", away)]


def limited(model: Any, controls: np.ndarray) -> int:
    """How many of those that have terms have force limits, which terms have not."""

    def is_limited(i: int) -> bool:
        tendon = model.actuator_trnid[i, 0] if model.actuator_trntype[i] == _TENDON else -1
        on_all = tendon >= 0 and model.tendon_actfrclimited[tendon]
        return bool(model.actuator_forcelimited[i] or on_all)

    return sum(is_limited(i) for i, _ in _with_terms(model, controls))


def reflected_damping(model: Any) -> np.ndarray:
    """What actuators add to the damping of their joints (nv,)."""
    out = np.zeros(model.nv)
    for i in np.flatnonzero(model.actuator_damping):
        if model.actuator_trntype[i] != _JOINT:
            continue
        joint = model.actuator_trnid[i, 0]
        if model.jnt_type[joint] in _SINGLE:
            gear = model.actuator_gear[i, 0]
            out[model.jnt_dofadr[joint]] += gear * gear * model.actuator_damping[i]
    return out


def driven(
    damping: np.ndarray,
    stiffness: np.ndarray,
    reference: np.ndarray,
    actuators: Iterable[Actuator],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Damping, stiffness and reference of the joints and their actuators, and the torque of those
    without stiffness. What acts on tendons is that of rows."""
    pull, torque = stiffness * reference, np.zeros_like(damping)
    damping, added = damping.copy(), np.zeros_like(damping)
    for one in actuators:
        if one.row >= 0:
            continue
        damping[one.dof] += one.damping
        added[one.dof] += one.stiffness
        (pull if one.stiffness > 0 else torque)[one.dof] += one.gain * one.control + one.constant
    total = stiffness + added
    held = added > 0
    return damping, total, np.where(held, pull / np.where(held, total, 1), reference), torque
