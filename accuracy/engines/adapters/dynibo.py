"""dynibo, float64, by its own Python package: robots on a fixed base.

Its gravity is 9.80665 along -z and cannot be set. The forces of another one along z are a
multiple of it: torques are corrected by what is missing, outside of the timed call.
"""

import dynibo
import numpy as np

from protocol import Call, Coordinates, Engine, Mechanism, State, Unsupported, joint_order

GRAVITY = 9.80665


class Adapter(Engine):
    name = "dynibo"
    package = "dynibo"
    armature = False
    calls = {
        "mass": "Robot.mass_matrix",
        "inverse": "Robot.mass_matrix, numpy.linalg.inv",
        "acceleration": "Robot.forward_dynamics",
        "inverse_dynamics": "Robot.inverse_dynamics",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        if mechanism.floats:
            raise Unsupported("the velocities of FloatingRobot are told in no manual")
        if mechanism.gravity[:2].any():
            raise Unsupported("gravity is along -z")
        try:
            self.robot = dynibo.Robot.from_urdf(str(mechanism.urdf))
        except dynibo.DyniboError as error:
            raise Unsupported(str(error)) from None
        links = [self.robot.link_id(f"{joint.name}_link") for joint in mechanism.joints]
        place = {
            joint.name: sorted(links).index(i)
            for joint, i in zip(mechanism.joints, links, strict=True)
        }
        self.coordinates = Coordinates(
            mechanism, joint_order(mechanism, lambda joint: place[joint.name])
        )
        self.missing = -mechanism.gravity[2] / GRAVITY - 1  # of its gravity

    def call(self, task: str, state: State) -> Call:
        robot, its, nv = self.robot, self.coordinates, len(state.v)
        q, v, tau, a = (its.P @ x for x in state[:4])
        correction = self.missing * np.array(robot.gravity(q))
        driven = tau - correction

        def mass():
            return np.array(robot.mass_matrix(q)).reshape(nv, nv)

        run = {
            "mass": mass,
            "inverse": lambda: np.linalg.inv(mass()),
            "acceleration": lambda: robot.forward_dynamics(q, v, driven),
            "inverse_dynamics": lambda: robot.inverse_dynamics(q, v, a),
        }[task]
        added = correction if task == "inverse_dynamics" else 0
        return Call(run, lambda x: its.read(task, state, np.array(x, dtype=np.float64) + added))
