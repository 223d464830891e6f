"""DART, float64, by its own Python package."""

import dartpy as dart
import numpy as np

from protocol import Base, Call, Coordinates, Engine, Mechanism, State, joint_order, rotation


class Adapter(Engine):
    name = "DART"
    package = "dartpy"
    armature = False
    calls = {
        "mass": "Skeleton.getMassMatrix",
        "inverse": "Skeleton.getInvMassMatrix",
        "acceleration": "Skeleton.computeForwardDynamics",
        "inverse_dynamics": "Skeleton.computeInverseDynamics",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        options = dart.utils.DartLoader.Options()
        kinds = dart.utils.DartLoader.RootJointType
        options.mDefaultRootJointType = kinds.FLOATING if mechanism.floats else kinds.FIXED
        loader = dart.utils.DartLoader()
        loader.setOptions(options)
        self.robot = loader.parseSkeleton(str(mechanism.urdf))
        self.robot.setGravity(mechanism.gravity)

        def first(joint):
            its = (
                self.robot.getRootJoint()
                if joint.type == "free"
                else self.robot.getJoint(joint.name)
            )
            return its.getIndexInSkeleton(0)

        order = joint_order(mechanism, first)
        # A free joint's velocity is told in the world's axes, the angular part first.
        base = Base(linear="world", angular="world", linear_first=False)
        self.coordinates = Coordinates(mechanism, order, base)
        self.q_of = [(first(joint), joint.q) for joint in mechanism.joints if joint.type != "free"]
        self.floats = mechanism.floats

    def position(self, state: State) -> np.ndarray:
        q = np.empty(self.robot.getNumDofs())
        for to, at in self.q_of:
            q[to] = state.q[at]
        if self.floats:
            pose = dart.math.Isometry3()
            pose.set_rotation(rotation(state.q[3:7]))
            pose.set_translation(state.q[:3])
            q[:6] = dart.dynamics.FreeJoint.convertToPositions(pose)
        return q

    def call(self, task: str, state: State) -> Call:
        robot, its = self.robot, self.coordinates
        q, v = self.position(state), its.velocity(state)
        tau, a = its.torque(state), its.acceleration(state)

        def mass():
            robot.setPositions(q)
            return robot.getMassMatrix()

        def inverse():
            robot.setPositions(q)
            return robot.getInvMassMatrix()

        def acceleration():
            robot.setPositions(q)
            robot.setVelocities(v)
            robot.setForces(tau)
            robot.computeForwardDynamics()
            return robot.getAccelerations()

        def inverse_dynamics():
            robot.setPositions(q)
            robot.setVelocities(v)
            robot.setAccelerations(a)
            robot.computeInverseDynamics()
            return robot.getForces()

        return Call(locals()[task], lambda x: its.read(task, state, np.array(x)))
