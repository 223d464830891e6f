"""Drake's MultibodyPlant, float64, by its own Python package."""

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from protocol import Base, Call, Coordinates, Engine, Mechanism, State, joint_order


class Adapter(Engine):
    name = "Drake"
    package = "drake"
    armature = False  # a rotor's inertia is one of an actuator, which a URDF without them has not
    calls = {
        "mass": "CalcMassMatrix",
        "inverse": "CalcMassMatrix, numpy.linalg.inv",
        "acceleration": "EvalTimeDerivatives, with torques as applied generalized forces",
        "inverse_dynamics": "CalcInverseDynamics, of forces CalcForceElementsContribution",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        plant = MultibodyPlant(0.0)
        Parser(plant).AddModels(str(mechanism.urdf))
        plant.mutable_gravity_field().set_gravity_vector(mechanism.gravity)
        plant.Finalize()
        self.plant, self.context = plant, plant.CreateDefaultContext()
        self.base = plant.GetBodyByName(f"{mechanism.joints[0].name}_link")
        by_name = {joint.name(): joint for joint in map(plant.get_joint, plant.GetJointIndices())}

        def of(joint):
            return by_name[joint.name]

        self.q_of = [(of(j).position_start(), j.q) for j in mechanism.joints if j.type != "free"]
        self.floats = mechanism.floats
        order = joint_order(
            mechanism, lambda joint: 0 if joint.type == "free" else of(joint).velocity_start()
        )
        # In Drake a free body's velocity is the angular one, then the linear one, in the world.
        base = Base(linear="world", angular="world", linear_first=False)
        self.coordinates = Coordinates(mechanism, order, base)
        self.input = plant.get_applied_generalized_force_input_port()

    def call(self, task: str, state: State) -> Call:
        plant, context, its = self.plant, self.context, self.coordinates
        q, v = np.empty(plant.num_positions()), its.velocity(state)
        for to, at in self.q_of:
            q[to] = state.q[at]
        if self.floats:  # the quaternion, of unit length, and then the position
            q[:7] = [*state.q[3:7] / np.linalg.norm(state.q[3:7]), *state.q[:3]]
        tau, a = its.torque(state), its.acceleration(state)

        def mass():
            plant.SetPositions(context, q)
            return plant.CalcMassMatrix(context)

        def inverse():
            return np.linalg.inv(mass())

        def acceleration():
            plant.SetPositions(context, q)
            plant.SetVelocities(context, v)
            self.input.FixValue(context, tau)
            return plant.EvalTimeDerivatives(context).get_generalized_velocity().CopyToVector()

        def inverse_dynamics():
            plant.SetPositions(context, q)
            plant.SetVelocities(context, v)
            forces = MultibodyForces(plant)
            plant.CalcForceElementsContribution(context, forces)
            return plant.CalcInverseDynamics(context, a, forces)

        return Call(locals()[task], lambda x: its.read(task, state, np.array(x)))
