import warnings
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import kalmarm

ROBOTS = Path(__file__).parents[2] / "robots" / "models"
NAMES = sorted(path.parent.name for path in ROBOTS.glob("*/*.xml") if path.parent.name == path.stem)


def file_of(name: str) -> Path:
    return ROBOTS / name / f"{name}.xml"


def load(name: str, **options) -> kalmarm.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(file_of(name), **options)


@pytest.fixture(params=NAMES)
def name(request) -> str:
    return request.param


@pytest.fixture(scope="session")
def iiwa() -> kalmarm.Robot:
    return load("iiwa14")


@pytest.fixture(scope="session")
def g1() -> kalmarm.Robot:
    return load("g1")


def relative(x, truth) -> float:
    """Largest |x - truth| over a row, by the row's own size."""
    axis = tuple(range(1, np.ndim(truth)))
    return float(np.max(np.linalg.norm(x - truth, axis=axis) / np.linalg.norm(truth, axis=axis)))


def without_other_forces(model):
    """MuJoCo's model without contacts, constraints, actuators, springs and dampers."""
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= int(
        flags.mjDSBL_CONTACT | flags.mjDSBL_CONSTRAINT | flags.mjDSBL_ACTUATION
    ) | int(flags.mjDSBL_SPRING | flags.mjDSBL_DAMPER)
    return model


def as_forces(data, applied):
    """(moment; force) at the bodies' origins, (bodies, 6), of MuJoCo's (force; torque) at their
    centres of mass."""
    force, torque = applied[:, :3], applied[:, 3:]
    return np.hstack([torque + np.cross(data.xipos[1:] - data.xpos[1:], force), force])


def as_fext(model, frames, forces):
    """Pinocchio's forces on joints, of (moment; force) in the axes of frames, (frames, 6)."""
    fext = [pin.Force.Zero() for _ in range(model.njoints)]
    for at, (moment, force) in zip(frames, forces.reshape(-1, 2, 3), strict=True):
        frame = model.frames[at]
        fext[frame.parentJoint] += frame.placement.act(pin.Force(force, moment))
    stacked = pin.StdVec_Force()
    stacked.extend(fext)
    return stacked


def of_joints(kinds):
    """A tree of them with odd placements."""
    model, parent = pin.Model(), 0
    pin.seed(3)
    for i, kind in enumerate(kinds):
        joint = model.addJoint(parent, kind, pin.SE3.Random(), f"j{i}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Random())
        model.addFrame(pin.Frame(f"body{i}", joint, 0, pin.SE3.Random(), pin.BODY))
        parent = joint if i % 3 else parent
    model.armature[:] = np.linspace(0.1, 0.5, model.nv)
    for joint in model.joints:  # of axes that turn with the body it would be other physics
        if joint.shortname() in ("JointModelPlanar", "JointModelFreeFlyer", "JointModelSpherical"):
            model.armature[joint.idx_v : joint.idx_v + joint.nv] = 0
    return model


AXIS = np.array([0.6, 0.0, 0.8])
# Python cannot make this one with an axis.
UNALIGNED = pin.buildModelFromXML(
    '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="continuous">'
    '<parent link="a"/><child link="b"/><axis xyz="0.6 0 0.8"/></joint></robot>'
).joints[1]
BY_JOINTS = {
    "every kind of joint": [
        pin.JointModelRUBZ(),
        pin.JointModelPlanar(),
        UNALIGNED,
        pin.JointModelTranslation(),
        pin.JointModelRUBX(),
        pin.JointModelSpherical(),
        pin.JointModelRY(),
        pin.JointModelPrismaticUnaligned(AXIS),
        pin.JointModelFreeFlyer(),
        pin.JointModelPlanar(),
        pin.JointModelRUBY(),
    ],
    "three angles": [
        pin.JointModelSphericalZYX(),
        pin.JointModelPX(),
        pin.JointModelSphericalZYX(),
    ],
}


@pytest.fixture(params=[*NAMES, *BY_JOINTS])
def peer(request):
    """Pinocchio's own reading of the file, or a model of ours there, the robot made from that, and
    its convention."""
    name = request.param
    if name in BY_JOINTS:
        model = of_joints(BY_JOINTS[name])
    else:
        model = pin.buildModelFromMJCF(str(file_of(name)))
    model.damping[:] = 0
    model.friction[:] = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of inertias at random
        return model, kalmarm.from_pinocchio(model), kalmarm.PinocchioStates(model)
