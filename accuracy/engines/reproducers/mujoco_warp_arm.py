"""MuJoCo Warp 4.0.0: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import mujoco
import mujoco_warp as mjw
import numpy as np

record = json.load(open("arm/truth.json"))
m = mujoco.MjModel.from_xml_path("arm/robot.xml")
d = mujoco.MjData(m)


def error(state):
    d.qpos[:], d.qvel[:], d.qfrc_applied[:] = state["qpos"], state["qvel"], state["tau"]
    model, data = mjw.put_model(m), mjw.put_data(m, d)
    mjw.forward(model, data)
    a, exact = data.qacc_smooth.numpy()[0], np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
