"""JaxSim, in JAX's two precisions; float64 is its own choice. It reads a URDF by Gazebo's `gz sdf`,
which PyPI does not have: it is given the same robot as SDF (sdf.py).
"""

import logging

import numpy as np
import sdf
from by_jax import Compiled, JaxEngine, jax, set_precision
from protocol import Base, Coordinates, Mechanism, State, Unsupported, joint_order


def compiled() -> Compiled:
    """JaxSim makes arrays when it is imported."""
    import jaxsim.api as js

    jnp = jax.numpy
    at_joints = slice(6, None)  # of a fixed base

    def data(model, base, q, v):
        """`base`: position and quaternion, or nothing where it is fixed."""
        given = {"joint_positions": q, "joint_velocities": v}
        if len(base):
            given["base_position"], given["base_quaternion"] = base[:3], base[3:]
            given["joint_velocities"] = v[6:]
            given["base_linear_velocity"], given["base_angular_velocity"] = v[:3], v[3:6]
        mixed = js.common.VelRepr.Mixed
        return js.data.JaxSimModelData.build(model, velocity_representation=mixed, **given)

    def whole(model, base, q):
        return data(model, base, q, jnp.zeros(len(q) + (6 if len(base) else 0)))

    def mass(model, base, q):
        M = js.model.free_floating_mass_matrix(model, whole(model, base, q))
        return M if len(base) else M[at_joints, at_joints]

    def inverse(model, base, q):
        if not len(base):
            return jnp.linalg.inv(mass(model, base, q))
        return js.model.free_floating_mass_matrix_inverse(model, whole(model, base, q))

    def acceleration(model, base, q, v, tau):
        its = data(model, base, q, v)
        if not len(base):
            return js.model.forward_dynamics_aba(model, its, joint_forces=tau)[1]
        forces = jnp.zeros((model.number_of_links(), 6)).at[0].set(tau[:6])
        a = js.model.forward_dynamics_aba(model, its, joint_forces=tau[6:], link_forces=forces)
        return jnp.concatenate(a)

    def inverse_dynamics(model, base, q, v, a):
        its = data(model, base, q, v)
        if not len(base):
            return js.model.inverse_dynamics(model, its, joint_accelerations=a)[1]
        known = {"joint_accelerations": a[6:], "base_acceleration": a[:6]}
        return jnp.concatenate(js.model.inverse_dynamics(model, its, **known))

    return Compiled(
        {
            "mass": mass,
            "inverse": inverse,
            "acceleration": acceleration,
            "inverse_dynamics": inverse_dynamics,
        }
    )


class Adapter(JaxEngine):
    name = "JaxSim"
    package = "jaxsim"
    precisions = ("float32", "float64")
    armature = False
    calls = {
        "mass": "api.model.free_floating_mass_matrix",
        "inverse": "free_floating_mass_matrix_inverse; of a fixed base jax.numpy.linalg.inv of M",
        "acceleration": "api.model.forward_dynamics_aba",
        "inverse_dynamics": "api.model.inverse_dynamics",
        "derivatives": "jax.jacfwd of forward_dynamics_aba",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        import jaxsim.api as js

        logging.disable()
        if mechanism.gravity[:2].any():
            raise Unsupported("gravity is along -z")
        try:
            text = sdf.from_urdf(mechanism.urdf.read_text())
        except sdf.Massless as link:
            raise Unsupported(f"link '{link}' has no mass") from None
        read = js.model.JaxSimModel.build_from_model_description
        self.model = read(text, is_urdf=False, gravity=-float(mechanism.gravity[2]))
        if "compiled" not in Adapter.__dict__:
            Adapter.compiled = compiled()
        names, first = self.model.joint_names(), 6 if mechanism.floats else 0
        order = joint_order(
            mechanism,
            lambda joint: 0 if joint.type == "free" else first + names.index(joint.name),
        )
        # In its "mixed" representation a base has the velocity of its origin, in the world's axes.
        base = Base(linear="world", angular="world")
        self.coordinates, self.floats = Coordinates(mechanism, order, base), mechanism.floats
        by_name = {joint.name: joint.q for joint in mechanism.joints}
        self.q_of = [by_name[name] for name in names]

    def arguments(self, task: str, state: State) -> tuple:
        its = self.coordinates
        q, v = state.q[self.q_of], its.velocity(state)
        rest = {
            "acceleration": (v, its.torque(state)),
            "derivatives": (v, its.torque(state)),
            "inverse_dynamics": (v, its.acceleration(state)),
        }.get(task, ())
        return self.base(state), q, *rest

    def base(self, state: State) -> np.ndarray:
        """Inverse dynamics takes the quaternion as it is, forward dynamics one of unit length."""
        if not self.floats:
            return state.q[:0]
        position, quaternion = state.q[:3], state.q[3:7]
        return np.concatenate([position, quaternion / np.linalg.norm(quaternion)])
