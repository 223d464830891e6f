"""Inertias that MuJoCo's compiler refuses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

_THINNEST = 1e-4  # least of a balanced body's second moments over the largest
_ROUNDING = 1e-12  # of moments as written, over the largest


def moves(body: Any) -> bool:
    while body is not None:
        if body.joints:
            return True
        body = body.parent
    return False


def from_geoms(mujoco: Any, spec: Any, body: Any) -> bool:
    """Whether MuJoCo's compiler will take the body's inertia from its geoms."""
    policy, kinds = spec.compiler.inertiafromgeom, mujoco.mjtInertiaFromGeom
    if policy == kinds.mjINERTIAFROMGEOM_AUTO:
        return not body.explicitinertial
    return bool(policy == kinds.mjINERTIAFROMGEOM_TRUE)


def prepare(mujoco: Any, spec: Any) -> list[Any]:
    """Takes away inertias of what does not move, which files often give one that is none, and
    lends links without mass between joints one that MuJoCo's compiler takes. Returns these: in the
    compiled model `make_massless` them."""
    massless = []
    for body in _bodies(spec):
        if not moves(body):
            body.explicitinertial, body.mass, body.inertia = False, 0, np.zeros(3)
            body.ipos, body.fullinertia = np.full(3, np.nan), np.full(6, np.nan)  # not given
        elif _is_massless_link(mujoco, spec, body):
            body.explicitinertial, body.mass, body.ipos = True, 1, np.zeros(3)
            _set_moments(body, (1, 0, 0, 0), np.ones(3))
            massless.append(body)
        elif body.explicitinertial and not from_geoms(mujoco, spec, body) and body.mass > 0:
            _, moments = _principal(mujoco, body)
            if not spec.compiler.balanceinertia and not _is_solid(moments):
                raise ValueError(
                    f"body '{body.name}': no solid body has such moments of inertia "
                    f"({_words(moments)}): inertia='balanced' takes the nearest that has"
                )
    if massless:
        spec.compiler.fusestatic = False  # would add to them what is welded there
    return massless


def make_massless(bodies: list[Any], model: Any) -> None:
    for body in bodies:
        model.body_mass[body.id] = 0
        model.body_inertia[body.id] = 0


def balance(mujoco: Any, spec: Any) -> list[str]:
    """Raises second moments of moving bodies to those of a solid one; a note of what changed."""
    changed = []
    for body in _bodies(spec):
        if not body.explicitinertial or from_geoms(mujoco, spec, body) or not moves(body):
            continue
        axes, moments = _principal(mujoco, body)
        second = moments.sum() / 2 - moments
        largest = second.max()
        if not np.all(np.isfinite(moments)) or _is_solid(moments) or not largest > 0:
            continue
        raised = np.maximum(second, _THINNEST * largest)
        balanced = raised.sum() - raised
        _set_moments(body, axes, balanced)
        changed.append(f"'{body.name}' from {_words(moments)} to {_words(balanced)} kg m^2")
    return ["balanced moments of inertia: " + ", ".join(changed)] if changed else []


def _bodies(spec: Any) -> Iterator[Any]:
    return (body for body in spec.bodies if body.parent is not None and body.name != "world")


def _is_solid(moments: Any) -> bool:
    """Also true of what is no number, which MuJoCo refuses."""
    a, b, c = sorted(moments)
    return not min(a, a + b - c) < -_ROUNDING * c


def _is_full(body: Any) -> bool:
    return not np.isnan(body.fullinertia[0])


def _principal(mujoco: Any, body: Any) -> tuple[Any, Any]:
    """Axes (w, x, y, z) and principal moments."""
    if not _is_full(body):
        return np.array(body.iquat), np.array(body.inertia)
    xx, yy, zz, xy, xz, yz = body.fullinertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.all(np.isfinite(tensor)):
        return np.array(body.iquat), np.full(3, np.nan)
    moments, R = np.linalg.eigh(tensor)
    R[:, 2] *= np.sign(np.linalg.det(R))
    axes = np.empty(4)
    mujoco.mju_mat2Quat(axes, R.ravel())
    return axes, moments


def _set_moments(body: Any, axes: Any, moments: Any) -> None:
    """The axes of the inertial frame become the principal ones."""
    if _is_full(body):
        body.iquat = axes
        body.fullinertia = np.full(6, np.nan)  # not given
    body.inertia = moments


def _words(moments: Any) -> str:
    return ", ".join(f"{x:.3g}" for x in moments)


def _has_mass(mujoco: Any, spec: Any, body: Any) -> bool:
    return bool(body.geoms) if from_geoms(mujoco, spec, body) else bool(body.mass > 0)


def _is_massless_link(mujoco: Any, spec: Any, body: Any) -> bool:
    """Without mass between joints, as ROS's files have them; one with nothing beyond it is
    MuJoCo's to refuse, and so is what a file asks MuJoCo to change of masses."""
    if not body.joints or _has_mass(mujoco, spec, body):
        return False
    if spec.compiler.boundmass > 0 or spec.compiler.settotalmass > 0:
        return False

    def below(one: Any) -> Iterator[tuple[Any, bool]]:  # bodies, and whether a joint lies between
        for child in one.bodies:
            yield child, bool(child.joints)
            yield from ((body, bool(child.joints) or jointed) for body, jointed in below(child))

    weights = [jointed for one, jointed in below(body) if _has_mass(mujoco, spec, one)]
    return bool(weights) and all(weights)
