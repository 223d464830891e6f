"""frax, in JAX's two precisions; its manual recommends float64 on a processor.

The gravity of its forward dynamics is 9.81 along -z and cannot be set: torques are corrected by
what is missing, outside of the timed call.

A root without inertia is no link to its reader. What stands on the ground may have any.
"""

import tempfile

from by_jax import Compiled, JaxEngine, jax, set_precision
from protocol import Coordinates, Mechanism, State, Unsupported, joint_order

GRAVITY = 9.81
ROOT = '<link name="world"/>'
WEIGHED = """<link name="world"><inertial><origin xyz="0 0 0" rpy="0 0 0"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>"""


class Adapter(JaxEngine):
    name = "frax"
    package = "frax"
    precisions = ("float32", "float64")
    armature = False
    calls = {
        "mass": "Robot.crba",
        "inverse": "Robot.crba, mass_matrix_inverse",
        "acceleration": "Robot.forward_dynamics",
        "inverse_dynamics": "Robot.rnea",
        "derivatives": "jax.jacfwd of Robot.forward_dynamics",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        from frax import Robot

        if mechanism.gravity[:2].any():
            raise Unsupported("gravity is along -z")
        floating = "quaternion" if mechanism.floats else None
        with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
            file.write(mechanism.urdf.read_text().replace(ROOT, WEIGHED))
            file.flush()
            robot = Robot(file.name, floating_base=floating)
        moving = [joint for joint in mechanism.joints if joint.type != "free"]
        names = [name for name in robot.joint_names if name in {joint.name for joint in moving}]
        first = 6 if mechanism.floats else 0
        order = joint_order(
            mechanism,
            lambda joint: 0 if joint.type == "free" else first + names.index(joint.name),
        )
        self.coordinates = Coordinates(mechanism, order)  # a base is told as MuJoCo has it
        by_name = {joint.name: joint.q for joint in moving}
        self.q_of = [*range(7 if first else 0), *(by_name[name] for name in names)]
        g = -mechanism.gravity[2]
        upwards = jax.numpy.array([0, 0, g, 0, 0, 0])
        self.missing = g / GRAVITY - 1
        self.weights = jax.jit(robot.gravity_vector)
        self.compiled = Compiled(
            {
                "mass": lambda _, q: robot.crba(q),
                "inverse": lambda _, q: robot.mass_matrix_inverse(robot.crba(q)),
                "acceleration": lambda _, q, v, tau: robot.forward_dynamics(q, v, tau, None),
                "inverse_dynamics": lambda _, q, v, a: robot.rnea(q, v, a, upwards, None),
            }
        )

    def arguments(self, task: str, state: State) -> tuple:
        its, q = self.coordinates, state.q[self.q_of]
        if task in ("acceleration", "derivatives"):
            return q, its.velocity(state), its.torque(state) - self.missing * self.weights(q)
        if task == "inverse_dynamics":
            return q, its.velocity(state), its.acceleration(state)
        return (q,)
