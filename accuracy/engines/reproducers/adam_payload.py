"""adam 0.5.0: an arm that carries 10^6 times its last link's mass, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import jax.numpy as jnp
import numpy as np
from adam.jax import KinDynComputations

record = json.load(open("arm/truth.json"))
state, gravity = record["states"][5], jnp.array([*record["gravity"], 0, 0, 0])
robot = KinDynComputations("arm/robot.urdf", record["dofs"], gravity=gravity)
q, v, tau = (jnp.array(state[key]) for key in ("qpos", "qvel", "tau"))
M = robot.mass_matrix(jnp.eye(4), q)[6:, 6:]  # the base stands still
bias = robot.bias_force(jnp.eye(4), q, jnp.zeros(6), v)[6:]
a, exact = np.array(jnp.linalg.solve(M, tau - bias)), np.array(state["truth"]["acceleration"])
print(f"{np.linalg.norm(a - exact) / np.linalg.norm(exact):.1e}")
