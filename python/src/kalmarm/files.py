"""Robots from MJCF and URDF files, through the Python package `mujoco`."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _actuators, _drawn, _inertia, _model_files, _urdf
from . import mujoco as lowering
from ._names import unknown
from .robot import Robot


class LoadError(ValueError):
    """A file that is no robot; one line, with the file and the reason."""


def load(
    path: str | os.PathLike[str],
    *,
    floating: bool | str = False,
    key: str | None = None,
    armature: Mapping[str, float] | None = None,
    inertia: str = "given",
    urdf_inertia: str | None = None,
    package_path: Iterable[str | os.PathLike[str]] = (),
    controls: Mapping[str, float] | None = None,
    takes_steps: bool = False,
    **options: Any,
) -> Robot:
    """The robot of an MJCF or URDF file, read by MuJoCo (`pip install mujoco`).

    q is MuJoCo's qpos, qd its qvel. Meshes need not be there unless an inertia comes from them.
    What else moves the robot is ignored, and named in one UserWarning, as by `from_mujoco`; so are
    inertias that are not as the file has them.

    floating: gives the root link that a URDF welds to the world a free joint, "floating_base":
        True, or the name of the link where several are welded.
    key: the keyframe whose position is q0, and whose controls are those of `Robot.terms`.
    armature: what rotors and gears add to M, by joint: rotor inertia times gear ratio squared
        [kg m^2, of a slide kg], for each of its DoF, in the place of what the file says.
    inertia: of principal moments that no solid body has, A <= B < C - A: "given" refuses them,
        "balanced" takes those of the nearest solid body, whose second moments are at least 1e-4 of
        the largest.
    urdf_inertia: of a URDF's link without <inertial>: "geometry", that of its collision geometry at
        1000 kg/m^3; "none", massless; None: the former where its meshes are found.
    package_path: folders that hold the ROS packages, or are one, of package:// meshes. Then
        ROS_PACKAGE_PATH, share of AMENT_PREFIX_PATH, and the folders above the file.
    controls: of actuators, by name, in the place of the keyframe's, or zero.
    takes_steps: whoever asks takes an `ImplicitStep` with `Robot.terms`: no warning names what
        these have. Fixed tendons may have armature then, which is in `terms.rows` and not in the
        robot's M; else that is refused.
    Options are those of `Robot`.
    """
    try:
        import mujoco
    except ImportError as error:
        raise ImportError(
            "kalmarm.load reads files through MuJoCo, which is not installed: pip install mujoco"
        ) from error
    if not os.path.isfile(path):
        raise FileNotFoundError(f"{path}: no such file")
    try:
        spec, notes = _read(mujoco, Path(path))
        notes += _read_as_told(
            mujoco, spec, Path(path), floating, armature, inertia, urdf_inertia, package_path
        )
        _strip_files(mujoco, spec)
        massless = _inertia.prepare(mujoco, spec)
        model = spec.compile()
        _inertia.make_massless(massless, model)
        q0, ctrl = (None, np.zeros(model.nu)) if key is None else _keyframe(mujoco, model, key)
        ctrl = _controls(mujoco, model, ctrl, controls or {})
        notes += lowering.ignored(model, ctrl if takes_steps else None)
        robot = lowering.lower(model, Path(path).stem, notes, options, ctrl, q0, takes_steps)
    except ValueError as error:
        raise _load_error(path, error) from None
    for note in robot.notes:
        warnings.warn(f"{path}: {note}", UserWarning, stacklevel=2)
    return robot


def _read(mujoco: Any, file: Path) -> tuple[Any, list[str]]:
    """MuJoCo's reader refuses a file also for what only draws: then that is left out."""
    files = _model_files.model_files(file)  # refuses what that reader cannot bear
    try:
        return mujoco.MjSpec.from_file(str(file)), []
    except ValueError as error:
        refused = " ".join(str(error).split())
    texts = _drawn.all_without_drawn_parts(files)
    include = {path: text.encode(errors="surrogateescape") for path, text in texts.items()}
    spec = mujoco.MjSpec.from_file(str(file), include=include)
    return spec, [f"read without what only draws or collides, which MuJoCo refuses: {refused}"]


def _load_error(path: str | os.PathLike[str], error: ValueError) -> LoadError:
    reason = " ".join(str(error).split())
    return LoadError(reason if reason.startswith(f"{path}: ") else f"{path}: {reason}")


def _read_as_told(
    mujoco: Any,
    spec: Any,
    file: Path,
    floating: bool | str,
    armature: Mapping[str, float] | None,
    inertia: str,
    urdf_inertia: str | None,
    package_path: Iterable[str | os.PathLike[str]],
) -> list[str]:
    """Changes the specification as the options of `load` say; what an engineer should know."""
    if inertia not in ("given", "balanced"):
        raise ValueError(f"inertia '{inertia}' is unknown: given, balanced")
    if urdf_inertia not in (None, "geometry", "none"):
        raise ValueError(f"urdf_inertia '{urdf_inertia}' is unknown: geometry, none")
    notes: list[str] = []
    tree = _urdf.tree_of(file)
    if tree is not None:
        _urdf.refuse_several_roots(tree)
    if floating:
        _free_root(spec, "" if floating is True else floating)
    _urdf.find_packages(spec, file, package_path)
    if tree is not None:
        notes += _urdf.weigh_links(mujoco, spec, file, urdf_inertia)
        notes += _urdf.ignored_transmissions(tree)
    if inertia == "balanced":
        notes += _inertia.balance(mujoco, spec)
    if armature:
        _set_armature(mujoco, spec, armature)
    return notes


def _set_armature(mujoco: Any, spec: Any, armature: Mapping[str, float]) -> None:
    joints = {joint.name: joint for joint in spec.joints}
    for name, value in armature.items():
        if name not in joints:
            raise unknown("armature: joint", name, joints)
        if not (value >= 0 and math.isfinite(value)):
            raise ValueError(f"armature of joint '{name}': {value} must not be negative")
        joints[name].armature = value
    for actuator in spec.actuators:
        drives = actuator.trntype == mujoco.mjtTrn.mjTRN_JOINT
        if drives and actuator.target in armature:
            actuator.armature = 0


def _free_root(spec: Any, link: str) -> None:
    """Gives a body that stands in the world, and is welded to it, a free joint."""
    roots = [body for body in spec.bodies if body.parent is not None and _is_world(body.parent)]
    welded = [body for body in roots if not body.joints]
    if link:
        welded = [body for body in welded if body.name == link]
        if not welded:
            raise ValueError(f"floating: no link '{link}' is welded to the world")
    elif len(welded) != 1:
        raise ValueError(
            f"floating: {len(welded)} links are welded to the world"
            + (", name one of " if welded else "")
            + ", ".join(f"'{body.name}'" for body in welded)
        )
    welded[0].add_freejoint(name="floating_base")


def _is_world(body: Any) -> bool:
    return body.parent is None or body.name == "world"


def _keyframe(mujoco: Any, model: Any, name: str) -> tuple[Any, Any]:
    known = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, i) for i in range(model.nkey)]
    if name not in known:
        named = ", ".join(one for one in known if one)
        raise ValueError(
            f"no keyframe is called '{name}' "
            + (f"(known: {named})" if named else "(there is none with a name)")
        )
    at = known.index(name)
    return model.key_qpos[at], model.key_ctrl[at].copy()


def _controls(mujoco: Any, model: Any, ctrl: Any, controls: Mapping[str, float]) -> Any:
    kind = mujoco.mjtObj.mjOBJ_ACTUATOR
    names = [mujoco.mj_id2name(model, kind, i) for i in range(len(model.actuator_trntype))]
    for name, value in controls.items():
        if name not in names:
            raise unknown("controls: actuator", name, [one for one in names if one])
        i = names.index(name)
        if why := _actuators.reason(model, i):
            raise ValueError(f"controls: '{name}' is an {why}, which is left out")
        ctrl[_actuators.control_of(model, i)] = value
    return ctrl


def _strip_files(mujoco: Any, spec: Any) -> None:
    """Takes out what only drawing and contacts need files for, so that a robot whose meshes are
    missing still loads; where an inertia has to come from a mesh, the mesh stays. Nor does the
    memory of a simulation matter, or a limit that no ball joint can have."""
    needed = set()
    spec.memory = -1
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_BALL:
            joint.limited, joint.range = 0, (0, 0)
    for kind in (spec.sensors, spec.pairs, spec.excludes, spec.skins, spec.tuples):
        for one in kind:
            spec.delete(one)
    kinds = mujoco.mjtGeom
    from_files = {kinds.mjGEOM_MESH, kinds.mjGEOM_SDF, kinds.mjGEOM_HFIELD}
    for geom in spec.geoms:
        body = geom.parent
        weighs = _inertia.from_geoms(mujoco, spec, body)
        # A geom of another type may be one that is fitted to a mesh.
        is_from_file = geom.type in from_files or bool(geom.meshname)
        if is_from_file and not (weighs and _inertia.moves(body)):
            spec.delete(geom)
            continue
        geom.material = ""
        needed.add(geom.meshname)
    for site in spec.sites:
        site.material = ""
    for mesh in spec.meshes:
        if mesh.name in needed:
            mesh.material = ""
        else:
            spec.delete(mesh)
    for kind in (spec.materials, spec.textures, spec.hfields):
        for one in kind:
            spec.delete(one)
