"""Constrained accelerations of Cassie with its loops closed, of ConstrainedDynamics and of Pinocchio's
constraintDynamics from Python: microseconds a state, the least of several rounds.

Usage: constrained.py [ROUNDS]
"""

import sys
import time
import warnings
import xml.etree.ElementTree as ET
from pathlib import Path

import kalmarm
import numpy as np
import pinocchio as pin

PATH = Path(__file__).parents[2] / "robots/models/cassie/cassie.xml"
SINGLE, ROWS = 300, 1024


def least(call, states, rounds):
    times = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return 1e6 * min(times) / states


def of_pinocchio(steps):
    """A call of so many random states, with at most so many proximal steps."""
    model = pin.buildModelFromMJCF(str(PATH))
    contacts, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for connect in ET.parse(PATH).iter("connect"):
        one, other = (
            model.frames[model.getFrameId(connect.get(body), pin.BODY)]
            for body in ("body1", "body2")
        )
        anchor = np.array([float(x) for x in connect.get("anchor").split()])
        contacts.append(
            pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D, model,
                one.parentJoint, one.placement * pin.SE3(np.eye(3), anchor),
                other.parentJoint, other.placement, pin.ReferenceFrame.LOCAL,
            )  # fmt: skip
        )
        datas.append(contacts[-1].createData())
    data, settings = model.createData(), pin.ProximalSettings(1e-10, 1e-8, steps)
    pin.initConstraintDynamics(model, data, contacts, datas)
    pin.seed(1)
    ones = np.ones(model.nq)
    q = [pin.randomConfiguration(model, -ones, ones) for _ in range(SINGLE)]
    v, tau = np.random.default_rng(1).standard_normal((2, SINGLE, model.nv))

    def call():
        for state in zip(q, v, tau):
            pin.constraintDynamics(model, data, *state, contacts, datas, settings)

    return call


def main(rounds):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        robot = kalmarm.load(PATH, takes_constraints=True)
    exact = [kalmarm.Constraint(c.name, c.kind, c.first, c.second) for c in robot.constraints]
    closed = kalmarm.ConstrainedDynamics(robot, exact, proximal=1e-8)
    singles, rows = robot.random_state(0, SINGLE), robot.random_state(1, ROWS)
    narrow = [x.astype(np.float32) for x in rows]

    def one_by_one():
        for state in zip(*singles):
            closed.forward_dynamics(*state)

    for name, call, states in (
        ("ConstrainedDynamics, one state", one_by_one, SINGLE),
        (f"ConstrainedDynamics, rows of {ROWS}", lambda: closed.forward_dynamics(*rows), ROWS),
        ("the same in float32", lambda: closed.forward_dynamics(*narrow), ROWS),
        ("constraintDynamics, at most 20 proximal steps", of_pinocchio(20), SINGLE),
        ("constraintDynamics, one", of_pinocchio(1), SINGLE),
    ):
        print(f"{name}: {least(call, states, rounds):.1f}")


main(int(sys.argv[1]) if len(sys.argv) > 1 else 9)
