"""MuJoCo Warp #1662: the implicit integrator subtracts the derivative of the bias by velocities,
where it must be added. Two hinges at a right angle that turn fast: one step, against MuJoCo's own.
"""

import json
from importlib.metadata import version

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

wp.config.quiet = True
wp.set_device("cpu")
MODEL = """<mujoco><option integrator="implicit" timestep="0.002" gravity="0 0 0">
  <flag contact="disable" constraint="disable"/></option><worldbody>
  <body><joint axis="1 0 0"/><inertial pos="0.1 0.2 0" mass="1" diaginertia="0.1 0.2 0.25"/>
    <body pos="0.3 0 0"><joint axis="0 1 0"/>
      <inertial pos="0.2 0 0.1" mass="1" diaginertia="0.05 0.1 0.12"/></body></body>
  </worldbody></mujoco>"""
VELOCITY = np.array([30.0, -20.0])

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
data.qvel[:] = VELOCITY
warp_model, warp_data = mjw.put_model(model), mjw.put_data(model, data)
mujoco.mj_step(model, data)
mjw.step(warp_model, warp_data)
change = data.qvel - VELOCITY
error = np.linalg.norm(warp_data.qvel.numpy()[0] - data.qvel) / np.linalg.norm(change)
print(json.dumps({"version": version("mujoco-warp"), "error": float(error)}))
