"""MuJoCo Warp #1333, mended by #1334: with a sparse Jacobian and a free body before an actuated
hinge the implicit step loses the actuator's damping. One step, against MuJoCo's own.
"""

import json
from importlib.metadata import version

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

wp.config.quiet = True
wp.set_device("cpu")
MODEL = """<mujoco><option integrator="implicitfast" timestep="0.01" jacobian="sparse">
  <flag contact="disable" constraint="disable"/></option><worldbody>
  <body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>
  <body pos="1 0 0"><joint name="hinge" axis="0 1 0"/>
    <inertial pos="0.2 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body>
  </worldbody><actuator><velocity joint="hinge" kv="50"/></actuator></mujoco>"""
VELOCITY = np.array([0, 0, 0, 0, 0, 0, 1.0])

model = mujoco.MjModel.from_xml_string(MODEL)
data = mujoco.MjData(model)
data.qvel[:] = VELOCITY
warp_model, warp_data = mjw.put_model(model), mjw.put_data(model, data)
mujoco.mj_step(model, data)
mjw.step(warp_model, warp_data)
change = data.qvel - VELOCITY
error = np.linalg.norm(warp_data.qvel.numpy()[0] - data.qvel) / np.linalg.norm(change)
print(json.dumps({"version": version("mujoco-warp"), "error": float(error)}))
