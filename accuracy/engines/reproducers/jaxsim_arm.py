"""JaxSim 0.9.0: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm

Run with JAX_ENABLE_X64=0 PYTHONPATH=accuracy/engines: JaxSim reads a URDF by Gazebo's `gz sdf`, and
sdf.py writes the SDF that it reads without.
"""

import json

import jax.numpy as jnp
import jaxsim.api as js
import numpy as np
import sdf

record = json.load(open("arm/truth.json"))
text = sdf.from_urdf(open("arm/robot.urdf").read())
gravity = -record["gravity"][2]
model = js.model.JaxSimModel.build_from_model_description(text, is_urdf=False, gravity=gravity)


def error(state):
    q, v, tau = (jnp.array(state[key]) for key in ("qpos", "qvel", "tau"))
    data = js.data.JaxSimModelData.build(model, joint_positions=q, joint_velocities=v)
    a = np.array(js.model.forward_dynamics_aba(model, data, joint_forces=tau)[1])
    exact = np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
