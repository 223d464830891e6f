"""Accelerations of MJCF files whose equality constraints hold, of kalmarm.ConstrainedDynamics in Python
beside MuJoCo's mj_forward, for scripts/robot_files --constraints."""

import pathlib
import re
import sys
import warnings

import kalmarm
import mujoco
import numpy as np

sys.path.append(str(pathlib.Path(__file__).resolve().parent.parent / "python/tests"))
from conftest import without_other_forces  # noqa: E402

STATES = 4  # the first is the file's own, at rest
BOUND = 1e-9
LEAST = 1e-2  # an acceleration that is nothing
LEFT_OUT = re.compile(r"couplings? of tendons|flex")  # of constraints: what MuJoCo's own have besides


def compare(path):
    """The largest error of an acceleration by MuJoCo's largest, or why there is none."""
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError:
        return {"error": None, "why": "MuJoCo refuses it"}
    if not any(model.eq_active0):
        return {"error": None, "why": "no equality constraint is active"}
    with warnings.catch_warnings(record=True) as noted:
        warnings.simplefilter("always")
        try:
            robot = kalmarm.from_mujoco(model, takes_constraints=True)
        except kalmarm.LoadError as error:
            return {"error": None, "why": f"refused here: {re.sub(r'/[^ ]+', '…', str(error))}"}
    if any(LEFT_OUT.search(str(one.message)) for one in noted):
        return {"error": None, "why": "some of its constraints are of tendons or flexes"}
    flags = mujoco.mjtDisableBit
    without_other_forces(model)
    model.opt.disableflags &= ~int(flags.mjDSBL_CONSTRAINT)
    model.opt.disableflags |= int(flags.mjDSBL_LIMIT | flags.mjDSBL_FRICTIONLOSS)
    model.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON
    model.opt.tolerance, model.opt.iterations = 0, 200
    closed, data = kalmarm.ConstrainedDynamics(robot), mujoco.MjData(model)
    random, worst = np.random.default_rng(0), 0.0
    for state in range(STATES):
        mujoco.mj_resetData(model, data)
        moved, data.qvel, tau = (random.standard_normal((3, model.nv)).T * (state > 0)).T
        mujoco.mj_integratePos(model, data.qpos, 0.1 * moved, 1.0)
        data.qfrc_applied = tau
        mujoco.mj_forward(model, data)
        found, outcome = closed.forward_dynamics(data.qpos, data.qvel, tau, status=True)
        if outcome["status"] != 0:
            return {"error": None, "why": "its constraints repeat each other"}
        size = max(np.abs(data.qacc).max(), LEAST)
        worst = max(worst, float(np.abs(found.a - data.qacc).max() / size))
    return {"error": worst, "why": "", "dofs": model.nv, "constraints": len(robot.constraints)}
