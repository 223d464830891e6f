"""NAME, in float64, by its own Python package.

Every call is as the engine's manual recommends it. What is converted between conventions is so
outside of `run`, which alone is timed.
"""

import numpy as np

from protocol import Base, Call, Coordinates, Engine, Mechanism, State, Unsupported, joint_order

# import NAME


class Adapter(Engine):
    name = "NAME"  # on the page
    package = "numpy"  # on PyPI, whose version is recorded: NAME
    precisions = ("float64",)  # also ("float32",), which answers of that type alone pass
    armature = True  # False: the mechanism is asked about without
    gpu = False  # True: without one it is not asked
    calls = {  # by task: what of the engine is called; a task that is not here is not asked
        "mass": "to be written",
        "inverse": "to be written",
        "acceleration": "to be written",
        "inverse_dynamics": "to be written",
        # "derivatives": of the acceleration by q, v and tau, side by side; of hinges and slides
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        """Reads mechanism.mjcf or mechanism.urdf; what the engine cannot hold is Unsupported."""
        if mechanism.floats:
            raise Unsupported("free bases: to be written")
        # self.model = NAME.load(mechanism.urdf, gravity=mechanism.gravity)
        # Where the engine's first DoF of a joint is, and how it tells the velocity of a free base.
        order = joint_order(mechanism, lambda joint: joint.dof)
        self.coordinates = Coordinates(mechanism, order, Base(linear="world", angular="body"))
        self.q_of = [joint.q for joint in sorted(mechanism.joints, key=lambda it: order[it.dof])]

    def call(self, task: str, state: State) -> Call:
        """What is timed, and how its answer is read."""
        its, q = self.coordinates, state.q[self.q_of]
        v, tau, a = its.velocity(state), its.torque(state), its.acceleration(state)

        def mass():
            raise Unsupported("to be written")  # NAME.mass_matrix(self.model, q)

        def inverse():
            raise Unsupported("to be written")  # np.linalg.inv(mass()), where it has nothing else

        def acceleration():
            raise Unsupported("to be written")  # NAME.forward_dynamics(self.model, q, v, tau)

        def inverse_dynamics():
            raise Unsupported("to be written")  # NAME.inverse_dynamics(self.model, q, v, a)

        return Call(locals()[task], lambda x: its.read(task, state, np.array(x)))

    # def batch(self, states: list[State]) -> Call:
    #     """Accelerations of all states in one call, a row each. `with_copies`, the third of Call:
    #     from NumPy's arrays to NumPy's, where the engine's own arrays are elsewhere."""
