"""PyBullet, float64: it has the mass matrix and inverse dynamics of a robot on a fixed base, and no
forward dynamics but by a step."""

import numpy as np
import pybullet

from protocol import Call, Coordinates, Engine, Mechanism, State, Unsupported, joint_order


class Adapter(Engine):
    name = "PyBullet"
    package = "pybullet"
    armature = False
    calls = {
        "mass": "calculateMassMatrix",
        "inverse": "calculateMassMatrix, numpy.linalg.inv",
        "acceleration": "calculateMassMatrix, calculateInverseDynamics at rest, numpy.linalg.solve",
        "inverse_dynamics": "calculateInverseDynamics",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        if mechanism.floats:
            raise Unsupported("calculateInverseDynamics of a free base: its conventions are untold")
        self.server = pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(*mechanism.gravity)
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE
        self.robot = pybullet.loadURDF(str(mechanism.urdf), useFixedBase=True, flags=flags)
        place = {
            pybullet.getJointInfo(self.robot, i)[1].decode(): i
            for i in range(pybullet.getNumJoints(self.robot))
        }
        order = joint_order(mechanism, lambda joint: place[joint.name])
        self.coordinates = Coordinates(mechanism, order)
        self.q_of = [mechanism.joints[order.index(i)].q for i in range(mechanism.nv)]
        self.zero = [0.0] * mechanism.nv

    def call(self, task: str, state: State) -> Call:
        its, robot = self.coordinates, self.robot
        q, v, tau, a = (list(x) for x in (state.q[self.q_of], *map(its.P.dot, state[1:4])))

        def mass():
            return np.array(pybullet.calculateMassMatrix(robot, q))

        def inverse():
            return np.linalg.inv(mass())

        def inverse_dynamics():
            return pybullet.calculateInverseDynamics(robot, q, v, a)

        def acceleration():
            bias = pybullet.calculateInverseDynamics(robot, q, v, self.zero)
            return np.linalg.solve(mass(), np.subtract(tau, bias))

        return Call(locals()[task], lambda x: its.read(task, state, np.array(x)))
