"""Fixed tendons of a compiled MuJoCo model as rows of implicit steps.

With armature w, damping b, stiffness k and spring length l0, a tendon of the length J q is the row

    M^ += J' (w + h b + h^2 k) J,  tau^ -= J' (b J qd + k (J q - l0 + h J qd))

What actuators on it have by their attributes armature and damping is the row's, times their gear
squared.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from .robot import Actuator, CoupledRow

# Of MuJoCo's enumerations, which its C interface fixes.
_TENDON = 3  # transmission
_OF_JOINT = 1  # wraps of a fixed tendon
_SPRING_DISABLED, _DAMPER_DISABLED = 1 << 5, 1 << 6


def reason(model: Any, tendon: int) -> str:
    """What the tendon is that is no row, "spatial tendon"; empty where it is one."""
    first = int(model.tendon_adr[tendon])
    wraps = model.wrap_type[first : first + int(model.tendon_num[tendon])]
    if np.any(wraps != _OF_JOINT):
        return "spatial tendon"
    for polynomial in ("tendon_stiffnesspoly", "tendon_dampingpoly"):
        if hasattr(model, polynomial) and np.any(getattr(model, polynomial)[tendon] != 0):
            return "tendon with nonlinear springs or damping"
    k, b = model.tendon_stiffness[tendon], model.tendon_damping[tendon]
    if k < 0 or b < 0:
        return "tendon with negative stiffness or damping"
    if k > 0 and hasattr(model, "tendon_springyield") and model.tendon_springyield[tendon] != 0:
        return "plastic tendon"
    low, high = model.tendon_lengthspring[tendon]
    return "tendon with a dead band" if k > 0 and low < high else ""


def _has_force(model: Any, tendon: int) -> bool:
    arrays = (
        "tendon_stiffness",
        "tendon_damping",
        "tendon_armature",
        "tendon_stiffnesspoly",
        "tendon_dampingpoly",
    )
    return any(np.any(getattr(model, name, np.zeros(model.ntendon))[tendon] != 0) for name in arrays)


def _is_driven(model: Any, tendon: int) -> bool:
    on_tendons = model.actuator_trntype == _TENDON
    return bool(np.any(on_tendons & (model.actuator_trnid[:, 0] == tendon)))


def numbered(model: Any) -> dict[int, int]:
    """The rows of tendons: of those that are linear and move something, one after another."""
    moving = (
        t
        for t in range(model.ntendon)
        if not reason(model, t) and (_has_force(model, t) or _is_driven(model, t))
    )
    return {tendon: row for row, tendon in enumerate(moving)}


def rows(model: Any, actuators: Iterable[Actuator]) -> tuple[CoupledRow, ...]:
    """With what the actuators add, and have by their own attributes."""
    off = int(model.opt.disableflags)
    damps, springs = not off & _DAMPER_DISABLED, not off & _SPRING_DISABLED
    out = []
    driving = tuple(actuators)
    for tendon, number in numbered(model).items():
        jacobian = np.zeros(model.nv)
        first = int(model.tendon_adr[tendon])
        for i in range(first, first + int(model.tendon_num[tendon])):
            jacobian[model.jnt_dofadr[model.wrap_objid[i]]] += model.wrap_prm[i]
        w = float(model.tendon_armature[tendon])
        b = float(model.tendon_damping[tendon]) if damps else 0.0
        own = float(model.tendon_stiffness[tendon]) if springs else 0.0
        reference = float(model.tendon_lengthspring[tendon, 0])
        for i in np.flatnonzero(model.actuator_trntype == _TENDON):
            if model.actuator_trnid[i, 0] == tendon:
                gear = float(model.actuator_gear[i, 0])
                w += gear * gear * float(model.actuator_armature[i])
                b += gear * gear * float(model.actuator_damping[i]) if damps else 0.0
        added = pull = 0.0
        for one in driving:
            if one.row == number:
                b += one.damping
                added += one.stiffness
                pull += one.gain * one.control + one.constant if one.stiffness > 0 else 0.0
        if added > 0:
            reference = ((own * reference if own > 0 else 0.0) + pull) / (own + added)
        out.append(CoupledRow(jacobian, w, b, own + added, reference))
    return tuple(out)


def refuse_armature(model: Any, name: str, takes_steps: bool) -> None:
    """Armature of tendons couples joints in M: steps alone have it, as that of rows."""
    for tendon in np.flatnonzero(model.tendon_armature != 0):
        why = reason(model, tendon)
        if not takes_steps or why:
            raise ValueError(
                f"{name}: armature of a tendon couples joints in M: "
                + (f"not supported of a {why}" if why else "supported in implicit steps alone")
            )


def left_out(model: Any, takes_steps: bool) -> list[tuple[str, int]]:
    """Kinds of tendons that are no rows or, where no steps are taken, of all."""
    known = numbered(model)
    kinds: Counter[str] = Counter()
    for tendon in range(model.ntendon):
        if not takes_steps or not (tendon in known or _has_force(model, tendon)):
            kinds["tendon"] += 1
        elif why := reason(model, tendon):
            kinds[why] += 1
        elif model.tendon_frictionloss[tendon] != 0:
            kinds["tendon with friction"] += 1
    return list(kinds.items())
