"""Brax 0.14.2: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import jax
import jax.numpy as jnp
import numpy as np
from brax.generalized import dynamics, pipeline
from brax.io import mjcf

record = json.load(open("arm/truth.json"))
geom = '<worldbody><geom size="0.1" mass="0" contype="0" conaffinity="0"/>'  # Brax needs one
system = mjcf.loads(open("arm/robot.xml").read().replace("<worldbody>", geom))
init = jax.jit(pipeline.init)


def error(state):
    q, v, tau = (jnp.array(state[key]) for key in ("qpos", "qvel", "tau"))
    s = init(system, q, v)
    a = np.array(s.mass_mx_inv @ dynamics.forward(system, s, tau))
    exact = np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
