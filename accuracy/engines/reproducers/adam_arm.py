"""adam 0.5.0: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import jax.numpy as jnp
import numpy as np
from adam.jax import KinDynComputations

record = json.load(open("arm/truth.json"))
gravity = jnp.array([*record["gravity"], 0, 0, 0])
robot = KinDynComputations("arm/robot.urdf", record["dofs"], gravity=gravity)


def error(state):
    q, v, tau = (jnp.array(state[key]) for key in ("qpos", "qvel", "tau"))
    M = robot.mass_matrix(jnp.eye(4), q)[6:, 6:]  # the base stands still
    bias = robot.bias_force(jnp.eye(4), q, jnp.zeros(6), v)[6:]
    a = np.array(jnp.linalg.solve(M, tau - bias))
    exact = np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
