"""MJX 3.17.0: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco import mjx

record = json.load(open("arm/truth.json"))
model = mujoco.MjModel.from_xml_path("arm/robot.xml")
m, start = mjx.put_model(model), mjx.make_data(model)
forward = jax.jit(mjx.forward)


def error(state):
    q, v, tau = (jnp.array(state[key]) for key in ("qpos", "qvel", "tau"))
    a = np.array(forward(m, start.replace(qpos=q, qvel=v, qfrc_applied=tau)).qacc_smooth)
    exact = np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
