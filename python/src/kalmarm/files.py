"""Robots from MJCF and URDF files and from MuJoCo's models, by the C++ loader (robots/loader)."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from . import _core
from ._names import number, numbers, one_of, several
from ._urdf import pinocchios_order
from .constrained import from_numbers
from .robot import Actuator, CoupledRow, Description, Robot, Terms


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
    imposes_couplings: bool = False,
    takes_steps: bool = False,
    takes_constraints: bool = False,
    constraints: str | os.PathLike[str] | None = None,
    dof_order: str = "file",
    **options: Any,
) -> Robot:
    """The robot of an MJCF or URDF file, read through MuJoCo (`pip install mujoco`).

    q is MuJoCo's qpos, qd its qvel. Meshes need not be there unless an inertia comes from them.
    What else moves the robot is ignored, and named in UserWarnings, as by `from_mujoco`; so are
    inertias that are not as the file has them.

    floating: gives the root link that a URDF welds to the world a free joint, "floating_base":
        True, or the name of the link where several are welded.
    key: the keyframe whose position is q0, and whose controls are those of `Robot.terms`.
    armature: what rotors and gears add to M, by joint: rotor inertia times gear ratio squared
        [kg m^2, of a slide kg], for each of its DoF, in the place of what the file says.
    inertia: of principal moments that no solid body has, A <= B < C - A: "given" takes them as they
        are and refuses negative ones, "balanced" takes those of the nearest solid body, whose
        second moments are at least 1e-4 of the largest.
    urdf_inertia: of a URDF's link without <inertial>: "geometry", that of its collision geometry at
        1000 kg/m^3; "none", massless; None: the former where its meshes are found.
    package_path: folders that hold the ROS packages, or are one, of package:// meshes. Then
        ROS_PACKAGE_PATH, share of AMENT_PREFIX_PATH, and the folders above the file.
    controls: of actuators, by name, in the place of the keyframe's, or zero.
    imposes_couplings: whoever asks imposes the couplings of joints (a URDF's <mimic>): no warning
        names them. With takes_steps the linear ones are imposed rows of `Robot.terms`, after those
        of tendons; others are refused.
    takes_steps: whoever asks takes an `ImplicitStep` with `Robot.terms`: no warning names what
        these have. Fixed tendons may have armature then, which is in `terms.rows` and not in the
        robot's M; else that is refused.
    takes_constraints: whoever asks takes `Robot.constraints`: no warning names connect, weld and joint constraints of
        the file. One says which are open at q0, and how far.
    constraints: a JSON file of further ones, as a URDF's loops need: docs/data-formats.md says what it holds.
    dof_order: "file", depth first with children in the order of the file, as MuJoCo; or
        "pinocchio", with children of a URDF's link in the order of their joints' names. Where these
        differ a note says so.
    Options are those of `Robot`.
    """
    files = _compiled()
    one_of("dof_order", dof_order, ("file", "pinocchio"))
    file = re.sub(r"[\0-\x1f\x7f]", " ", os.fsdecode(path))  # in messages, which are one line
    if not os.path.exists(path):
        raise FileNotFoundError(f"{file}: no such file")
    asked = {
        "floating": "" if floating is True else floating or None,
        "key": key or "",
        "armature": _by_name("armature", armature),
        "inertia": one_of("inertia", inertia, ("given", "balanced")),
        "urdf_inertia": urdf_inertia and one_of("urdf_inertia", urdf_inertia, ("geometry", "none")),
        "package_path": [os.fsencode(folder) for folder in several("package_path", package_path)],
        "controls": _by_name("controls", controls),
        "imposes_couplings": bool(imposes_couplings),
        "takes_steps": bool(takes_steps),
        "takes_constraints": bool(takes_constraints),
        "constraints": os.fsencode(constraints or ""),
    }
    try:
        loaded = files.load(os.fsencode(path), **asked)
        if not loaded["model"].nv:
            raise ValueError("no joint, so no degree of freedom")
    except ValueError as error:
        reason = str(error)
        raise LoadError(reason if reason.startswith(file) else f"{file}: {reason}") from None
    dofs = loaded["model"].dofs
    order = pinocchios_order(path, dofs)
    if order != list(range(len(dofs))):
        if dof_order == "pinocchio":
            loaded = _reordered(loaded, order)
        else:
            note = "DoF are in the order of the file, and not in Pinocchio's: dof_order='pinocchio'"
            loaded["notes"] += (note,)
    robot = _robot(loaded, options)
    _warn(file, robot)
    return robot


def from_mujoco(
    model: Any,
    *,
    name: str | None = None,
    ctrl: Any = None,
    takes_steps: bool = False,
    takes_constraints: bool = False,
    constraints: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Robot:
    """The robot of a `mujoco.MjModel` as it is now: bodies, joints, inertias, armature (of joints,
    and of actuators on a single hinge or slide) and gravity.

    q is qpos, qd is qvel. What else moves the robot is ignored, and named in UserWarnings:
    constraints, actuators, tendons, damping, friction, springs. Contacts and limits are not named.

    ctrl: controls (nu,) of the actuators in `Robot.terms`; zero unless given.
    takes_steps, takes_constraints, constraints: as of `load`.
    Options are those of `Robot`.
    """
    files = _compiled()
    import mujoco

    if not isinstance(model, mujoco.MjModel):
        raise TypeError(f"from_mujoco: {type(model).__name__} is no mujoco.MjModel")
    controls = np.zeros(model.nu) if ctrl is None else numbers("ctrl", ctrl)
    if controls.shape != (model.nu,):
        raise ValueError(f"ctrl has shape {controls.shape}, ({model.nu},) is needed")
    loaded = files.from_model(
        model._address,
        name=name or model.names.split(b"\0", 1)[0].decode() or "robot",
        controls=controls.tolist(),
        takes_steps=takes_steps,
        takes_constraints=takes_constraints,
        constraints=os.fsencode(constraints or ""),
    )
    robot = _robot(loaded, options)
    _warn(robot.name, robot)
    return robot


def _compiled() -> Any:
    """The compiled loader. Structures of MuJoCo differ between its releases, and the loader finds
    the library that `import mujoco` has loaded by the release in its name: any other is refused."""
    built = _core.mujoco_version
    if not built:
        raise ImportError(
            "kalmarm was built without MuJoCo: build it again where that is installed"
        )
    try:
        import mujoco
    except ImportError as error:
        raise ImportError(
            "kalmarm.load reads files through MuJoCo, which is not installed: "
            f"pip install mujoco=={built}"
        ) from error
    if mujoco.__version__ != built:
        raise ImportError(
            f"kalmarm was built for MuJoCo {built}, and {mujoco.__version__} is installed: "
            f"pip install mujoco=={built}, or build kalmarm again"
        )
    from . import _files

    return _files


def _by_name(option: str, given: Mapping[str, float] | None) -> dict[str, float]:
    return {name: number(f"{option} of '{name}'", value) for name, value in (given or {}).items()}


def _reordered(loaded: dict[str, Any], order: list[int]) -> dict[str, Any]:
    """DoF k is what DoF order[k] was, in all that is by DoF or by entries of q."""
    place = {old: new for new, old in enumerate(order)} | {-1: -1}
    model, entries = loaded["model"]._reordered(order)
    weights = loaded["compensated"]
    by_dof = ("damping", "stiffness", "reference", "torque", "force_range")
    return {
        **loaded,
        **{name: [loaded[name][k] for k in order] for name in by_dof},
        **{name: [loaded[name][i] for i in entries] for name in ("q0", "q_range")},
        "model": model,
        "compensated": weights and weights._reordered(order)[0],
        "frames": {
            name: _core.Frame(place[one.link], one.rotation, one.translation)
            for name, one in loaded["frames"].items()
        },
        "actuators": [(one[0], place[one[1]], *one[2:]) for one in loaded["actuators"]],
        "rows": [([one[0][k] for k in order], *one[1:]) for one in loaded["rows"]],
        "constraints": [
            (
                *one[:2],
                *(_core.Frame(place[at.link], at.rotation, at.translation) for at in one[2:4]),
                one[4],
                *([J[k] for k in order] if J else [] for J in one[5:7]),
                *one[7:],
            )
            for one in loaded["constraints"]
        ],
    }


def _robot(loaded: dict[str, Any], options: dict[str, Any]) -> Robot:
    constraints = tuple(map(from_numbers, loaded["constraints"]))

    def robot(model: Any, terms: Terms | None, **options: Any) -> Robot:
        numbers = {name: np.array(loaded[name], float) for name in ("q0", "q_range")}
        rest = {name: loaded[name] for name in ("name", "frames", "notes")}
        description = Description(
            model=model, terms=terms, constraints=constraints, **numbers, **rest
        )
        return Robot(description, **options)

    weights = loaded["compensated"]
    terms = Terms(
        *(np.array(loaded[name]) for name in ("damping", "stiffness", "reference", "torque")),
        actuators=tuple(
            Actuator(*one[:-2], *(tuple(limits) for limits in one[-2:]))
            for one in loaded["actuators"]
        ),
        compensated=weights and robot(weights, None, wants=("inverse_dynamics",)),
        rows=tuple(CoupledRow(np.array(row[0]), *row[1:]) for row in loaded["rows"]),
        force_range=np.array(loaded["force_range"], float).reshape(-1, 2),
    )
    return robot(loaded["model"], terms, **options)


def _warn(what: str, robot: Robot) -> None:
    for note in robot.notes:
        warnings.warn(f"{what}: {note}", UserWarning, stacklevel=3)
