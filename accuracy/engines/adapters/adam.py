"""adam, its JAX implementation: the mass matrix and the bias of a robot whose base floats. A robot
on a fixed base is its last nv rows and columns, with a base at rest that gravity does not move.
"""

import numpy as np

from by_jax import Compiled, JaxEngine, jax, set_precision
from protocol import Base, Coordinates, Mechanism, State, joint_order, rotation

from adam.jax import KinDynComputations  # noqa: E402


class Adapter(JaxEngine):
    name = "adam"
    package = "adam-robotics"
    precisions = ("float32", "float64")
    armature = False
    calls = {
        "mass": "mass_matrix",
        "inverse": "mass_matrix, jax.numpy.linalg.inv",
        "acceleration": "mass_matrix, bias_force, jax.numpy.linalg.solve",
        "inverse_dynamics": "mass_matrix times accelerations plus bias_force",
        "derivatives": "jax.jacfwd of the acceleration",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        jnp = jax.numpy
        names = [joint.name for joint in mechanism.joints if joint.type != "free"]
        gravity = jnp.array([*mechanism.gravity, 0, 0, 0])
        robot = KinDynComputations(str(mechanism.urdf), names, gravity=gravity)
        first = 6 if mechanism.floats else 0
        places = {
            joint.name: first + i
            for i, joint in enumerate(j for j in mechanism.joints if j.type != "free")
        }
        base = Base(linear="world", angular="world")
        order = joint_order(
            mechanism, lambda joint: 0 if joint.type == "free" else places[joint.name]
        )
        self.coordinates, self.floats = Coordinates(mechanism, order, base), mechanism.floats
        self.q_of = [joint.q for joint in mechanism.joints if joint.type != "free"]
        skip = 0 if mechanism.floats else 6

        def mass(H, q):
            return robot.mass_matrix(H, q)[skip:, skip:]

        def bias(H, q, v):
            return robot.bias_force(H, q, jnp.zeros(6) if skip else v[:6], v if skip else v[6:])[
                skip:
            ]

        def acceleration(_, H, q, v, tau):
            return jnp.linalg.solve(mass(H, q), tau - bias(H, q, v))

        self.compiled = Compiled(
            {
                "mass": lambda _, H, q: mass(H, q),
                "inverse": lambda _, H, q: jnp.linalg.inv(mass(H, q)),
                "acceleration": acceleration,
                "inverse_dynamics": lambda _, H, q, v, a: mass(H, q) @ a + bias(H, q, v),
            }
        )

    def arguments(self, task: str, state: State) -> tuple:
        its, H = self.coordinates, np.eye(4)
        if self.floats:
            H[:3, :3], H[:3, 3] = rotation(state.q[3:7]), state.q[:3]
        q, v = state.q[self.q_of], its.velocity(state)
        rest = {
            "acceleration": (v, its.torque(state)),
            "derivatives": (v, its.torque(state)),
            "inverse_dynamics": (v, its.acceleration(state)),
        }.get(task, ())
        return H, q, *rest
