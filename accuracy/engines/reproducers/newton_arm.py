"""Newton 1.8.0: accelerations of the arm in arm/, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import newton
import numpy as np
import warp as wp

record = json.load(open("arm/truth.json"))
builder = newton.ModelBuilder()
builder.add_mjcf("arm/robot.xml")
model = builder.finalize(device="cpu")
model.set_gravity(tuple(record["gravity"]))
s, n = model.state(), record["nv"]
M, g, c = wp.zeros((1, n, n), dtype=float), wp.zeros(n, dtype=float), wp.zeros(n, dtype=float)


def error(state):
    s.joint_q.assign(np.float32(state["qpos"]))
    s.joint_qd.assign(np.float32(state["qvel"]))
    newton.eval_fk(model, s.joint_q, s.joint_qd, s)
    newton.eval_inverse_dynamics_passive(model, s, mass_matrix=M, gravity_force=g, coriolis_force=c)
    a = np.linalg.solve(M.numpy()[0], np.float32(state["tau"]) - g.numpy() - c.numpy())
    exact = np.array(state["truth"]["acceleration"])
    return np.linalg.norm(a - exact) / np.linalg.norm(exact)


print(f"{np.nanmax([error(state) for state in record['states']]):.1e}")
