"""MuJoCo Warp 4.0.0: an arm that carries 10^6 times its last link's mass, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import mujoco
import mujoco_warp as mjw
import numpy as np

state = json.load(open("arm/truth.json"))["states"][6]
m = mujoco.MjModel.from_xml_path("arm/robot.xml")
d = mujoco.MjData(m)
d.qpos[:], d.qvel[:], d.qfrc_applied[:] = state["qpos"], state["qvel"], state["tau"]
model, data = mjw.put_model(m), mjw.put_data(m, d)
mjw.forward(model, data)
a, exact = data.qacc_smooth.numpy()[0], np.array(state["truth"]["acceleration"])
print(f"{np.linalg.norm(a - exact) / np.linalg.norm(exact):.1e}")
