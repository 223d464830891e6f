"""What a URDF leaves to its reader: where meshes are, and what links without <inertial> weigh."""

from __future__ import annotations

import os
import xml.etree.ElementTree as xml
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ._inertia import moves
from ._names import counted

_PACKAGE, _FILE = "package://", "file://"
_READ = {".stl", ".obj", ".msh"}  # by MuJoCo
_TRANSMISSIONS = {
    "transmission": "transmission",
    "rotor_inertia": "rotor inertia",
    "gear_ratio": "gear ratio",
    "mechanicalReduction": "gear ratio",
}


def tree_of(path: Path) -> xml.Element | None:
    """The file's <robot>; None where it is no URDF, or no XML, which MuJoCo says."""
    try:
        root = xml.parse(path).getroot()
    except xml.ParseError:
        return None
    return root if root.tag == "robot" else None


def refuse_several_roots(tree: xml.Element) -> None:
    children = {child.get("link") for child in tree.iter("child")}
    roots = [link.get("name", "") for link in tree.iterfind("link")]
    roots = [name for name in roots if name not in children]
    if len(roots) > 1:
        named = ", ".join(f"'{name}'" for name in roots)
        raise ValueError(f"several links have no parent, a URDF is one tree: {named}")


def ignored_transmissions(tree: xml.Element) -> list[str]:
    counts: dict[str, int] = {}
    for element in tree.iter():
        name = element.tag.rpartition("}")[2]  # {https://drake.mit.edu}rotor_inertia
        if kind := _TRANSMISSIONS.get(name):
            counts[kind] = counts.get(kind, 0) + 1
    parts = ", ".join(counted(count, kind) for kind, count in counts.items())
    return [f"ignored: {parts}; armature= gives joints what they add to M"] if parts else []


def find_packages(spec: Any, file: Path, package_path: Iterable[str | os.PathLike[str]]) -> None:
    """Gives meshes named package://PACKAGE/PATH, and file://, the path where they are."""
    given = [Path(folder) for folder in package_path]
    for folder in given:
        if not folder.is_dir():
            raise ValueError(f"package path '{folder}': no such folder")
    given += map(Path, _folders("ROS_PACKAGE_PATH"))
    given = [folder.absolute() for folder in given]
    parents = [*given, *(Path(prefix, "share") for prefix in _folders("AMENT_PREFIX_PATH"))]
    parents += file.absolute().parents[1:]
    for mesh in spec.meshes:
        if mesh.file.startswith(_FILE):
            mesh.file = mesh.file.removeprefix(_FILE)
        if not mesh.file.startswith(_PACKAGE):
            continue
        package, slash, path = mesh.file.removeprefix(_PACKAGE).partition("/")
        places = [folder / path for folder in given if folder.name == package]
        places += [folder / package / path for folder in parents]
        found = next((place for place in places if place.is_file()), None)
        if slash and found:
            mesh.file = str(found)


def weigh_links(mujoco: Any, spec: Any, file: Path, policy: str | None) -> list[str]:
    """Makes moving links without <inertial> massless where the policy, or a mesh that is not there,
    says so; a note of which got what."""
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO:
        return []  # the file's own policy
    folder = file.parent / spec.compiler.meshdir
    lists: dict[str, list[str]] = {
        "weighed by geometry at 1000 kg/m^3": [],
        "massless": [],
        "massless, as a mesh is not found or not STL, OBJ or MSH": [],
    }
    geometry, none, missing = lists.values()
    for body in spec.bodies:
        if body.explicitinertial or not moves(body) or not body.geoms:
            continue
        mesh = next(_missing_meshes(mujoco, spec, body, folder), None)
        if policy == "geometry" and mesh is not None:
            raise ValueError(
                f"link '{body.name}' has no <inertial>, and its mesh {mesh} is not found or not "
                "STL, OBJ or MSH (package_path=, urdf_inertia='none')"
            )
        if policy != "none" and mesh is None:
            geometry.append(f"'{body.name}'")
            continue
        body.explicitinertial, body.mass = True, 0
        body.ipos, body.inertia, body.fullinertia = np.zeros(3), np.zeros(3), np.full(6, np.nan)
        (none if mesh is None else missing).append(f"'{body.name}'")
    parts = [f"{what}: {', '.join(links)}" for what, links in lists.items() if links]
    return ["without <inertial>: " + "; ".join(parts)] if parts else []


def _folders(variable: str) -> list[str]:
    return [folder for folder in os.environ.get(variable, "").split(":") if folder]


def _missing_meshes(mujoco: Any, spec: Any, body: Any, folder: Path) -> Iterator[str]:
    """Of a link, those that MuJoCo could not read."""
    files = {mesh.name: mesh.file for mesh in spec.meshes}
    for geom in body.geoms:
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH and geom.meshname in files:
            file = files[geom.meshname]
            if Path(file).suffix.lower() not in _READ or not (folder / file).is_file():
                yield file
