"""MuJoCo Warp #1415: the Newton solver's H = M + J'DJ is indefinite in float32 where contacts are
stiff. A leg of four light hinges under a free base, standing on four points: |J'DJ| is 8e8,
the smallest eigenvalue of M 1e-4, of H 1e-2. `solve` on what MuJoCo has made of the state, so
that nothing but the solver is in float32, against MuJoCo's own.
"""

import json
from importlib.metadata import version

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

wp.config.quiet = True
wp.set_device("cpu")
LINK = '<inertial pos="0 0 -0.1" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>'
STIFF = 'solimp="0.9999 0.9999 0.001"'
MODEL = f"""<mujoco><option solver="Newton" cone="elliptic" impratio="1e5"/><worldbody>
  <geom type="plane" size="9 9 1" {STIFF}/>
  <body><freejoint/><inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/>
    <body><joint axis="0 1 0"/>{LINK}
      <body pos="0 0 -0.2"><joint axis="0 1 0"/>{LINK}
        <body pos="0 0 -0.2"><joint axis="0 1 0"/><joint axis="1 0 0"/>
          <inertial pos="0 0 -0.05" mass="0.05" diaginertia="1e-4 1e-4 1e-4"/>
          <geom size="0.02" pos="0.05 0.03 -0.135" {STIFF}/>
          <geom size="0.02" pos="-0.05 0.03 -0.135" {STIFF}/>
          <geom size="0.02" pos="0.05 -0.03 -0.135" {STIFF}/>
          <geom size="0.02" pos="-0.05 -0.03 -0.135" {STIFF}/></body></body></body></body>
  </worldbody></mujoco>"""


def standing() -> tuple[mujoco.MjModel, mujoco.MjData]:
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.qpos[7:] = [0.3, -0.6, 0.3, 0]
    data.qpos[2] = 0.4 * np.cos(0.3) + 0.152  # 3 mm into the ground
    mujoco.mj_forward(model, data)
    data.qacc_warmstart[:] = 0
    return model, data


if __name__ == "__main__":
    model, data = standing()
    warp_model, warp_data = mjw.put_model(model), mjw.put_data(model, data)
    mjw.solve(warp_model, warp_data)
    error = np.linalg.norm(warp_data.qacc.numpy()[0] - data.qacc) / np.linalg.norm(data.qacc)
    print(json.dumps({"version": version("mujoco-warp"), "error": float(error)}))
