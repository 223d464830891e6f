"""Robots from MJCF and URDF files, through the Python package `mujoco`."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any

from . import mujoco as lowering
from .robot import Robot


class LoadError(ValueError):
    """A file that is no robot; one line, with the file and the reason."""


def load(
    path: str | os.PathLike[str],
    *,
    floating: bool | str = False,
    key: str | None = None,
    **options: Any,
) -> Robot:
    """The robot of an MJCF or URDF file, read by MuJoCo (`pip install mujoco`).

    q is MuJoCo's qpos, qd its qvel. Meshes need not be there unless an inertia comes from them.
    What else moves the robot is ignored, and named in one UserWarning, as by `from_mujoco`.

    floating: gives the root link that a URDF welds to the world a free joint, "floating_base":
        True, or the name of the link where several are welded.
    key: the keyframe whose position is q0.
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
        spec = mujoco.MjSpec.from_file(os.fspath(path))
        if floating:
            _free_root(spec, "" if floating is True else floating)
        _strip_files(mujoco, spec)
        model = spec.compile()
        q0 = None if key is None else _keyframe(mujoco, model, key)
    except ValueError as error:
        raise _load_error(path, error) from None
    notes = lowering.ignored(model)
    try:
        robot = lowering.lower(model, Path(path).stem, notes, options, q0)
    except ValueError as error:
        raise _load_error(path, error) from None
    for note in robot.notes:
        warnings.warn(f"{path}: {note}", UserWarning, stacklevel=2)
    return robot


def _load_error(path: str | os.PathLike[str], error: ValueError) -> LoadError:
    reason = " ".join(str(error).split())
    return LoadError(reason if reason.startswith(f"{path}: ") else f"{path}: {reason}")


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


def _keyframe(mujoco: Any, model: Any, name: str) -> Any:
    known = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, i) for i in range(model.nkey)]
    if name not in known:
        named = ", ".join(one for one in known if one)
        raise ValueError(
            f"no keyframe is called '{name}' "
            + (f"(known: {named})" if named else "(there is none with a name)")
        )
    return model.key_qpos[known.index(name)]


def _strip_files(mujoco: Any, spec: Any) -> None:
    """Takes out what only drawing and contacts need files for, so that a robot whose meshes are
    missing still loads; where an inertia has to come from a mesh, the mesh stays."""
    geoms_weigh = spec.compiler.inertiafromgeom
    kinds = mujoco.mjtInertiaFromGeom
    needed = set()
    for kind in (spec.sensors, spec.pairs, spec.excludes, spec.skins, spec.tuples):
        for one in kind:
            spec.delete(one)
    from_files = {mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_SDF, mujoco.mjtGeom.mjGEOM_HFIELD}
    for geom in spec.geoms:
        body = geom.parent
        weighs = geoms_weigh == kinds.mjINERTIAFROMGEOM_TRUE or (
            geoms_weigh == kinds.mjINERTIAFROMGEOM_AUTO and not body.explicitinertial
        )
        # A geom of another type may be one that is fitted to a mesh.
        is_from_file = geom.type in from_files or bool(geom.meshname)
        if is_from_file and not (weighs and _moves(body)):
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


def _moves(body: Any) -> bool:
    while body is not None:
        if body.joints:
            return True
        body = body.parent
    return False
