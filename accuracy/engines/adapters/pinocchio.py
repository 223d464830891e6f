"""Pinocchio, float64, by its own Python package."""

import numpy as np
import pinocchio as pin

from protocol import Base, Call, Coordinates, Engine, Mechanism, State, joint_order


class Adapter(Engine):
    name = "Pinocchio"
    package = "pin"
    calls = {
        "mass": "crba, upper triangle mirrored",
        "inverse": "computeMinverse, upper triangle mirrored",
        "acceleration": "aba",
        "inverse_dynamics": "rnea",
        "derivatives": "computeABADerivatives",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        path = str(mechanism.urdf)
        if mechanism.floats:
            self.model = pin.buildModelFromUrdf(path, pin.JointModelFreeFlyer())
        else:
            self.model = pin.buildModelFromUrdf(path)
        self.model.gravity.linear = mechanism.gravity
        joints = self.model.joints

        def of(joint):
            return joints[1 if joint.type == "free" else self.model.getJointId(joint.name)]

        for joint in mechanism.joints:
            at = of(joint).idx_v
            self.model.armature[at : at + joint.dofs] = joint.armature
        self.q_order = [(joint, of(joint).idx_q) for joint in mechanism.joints]
        base = Base(linear="body", angular="body")
        order = joint_order(mechanism, lambda joint: of(joint).idx_v)
        self.coordinates = Coordinates(mechanism, order, base)
        self.data = self.model.createData()

    def position(self, state: State) -> np.ndarray:
        """Quaternions have w last and must have length 1."""
        q = np.empty(self.model.nq)
        for joint, at in self.q_order:
            if joint.type == "free":
                w, x, y, z = state.q[3:7] / np.linalg.norm(state.q[3:7])
                q[at : at + 7] = [*state.q[:3], x, y, z, w]
            else:
                q[at] = state.q[joint.q]
        return q

    def call(self, task: str, state: State) -> Call:
        model, data, its = self.model, self.data, self.coordinates
        q, v = self.position(state), its.velocity(state)
        tau, a = its.torque(state), its.acceleration(state)

        def mirrored(A):
            return np.triu(A) + np.triu(A, 1).T

        def derivatives():
            by_q, by_v, by_tau = pin.computeABADerivatives(model, data, q, v, tau)
            return np.hstack([by_q, by_v, mirrored(by_tau)])

        run = {
            "mass": lambda: mirrored(pin.crba(model, data, q)),
            "inverse": lambda: mirrored(pin.computeMinverse(model, data, q)),
            "acceleration": lambda: pin.aba(model, data, q, v, tau),
            "inverse_dynamics": lambda: pin.rnea(model, data, q, v, a),
            "derivatives": derivatives,
        }[task]
        return Call(run, lambda x: its.read(task, state, np.array(x)))
