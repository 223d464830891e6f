"""Newton 1.8.0: an arm that carries 10^6 times its last link's mass, float32 against the truth.

build/bin/export_mechanism iiwa14 --stress payload --value 1e6 --out arm
"""

import json

import newton
import numpy as np
import warp as wp

record = json.load(open("arm/truth.json"))
state, exact = record["states"][5], np.array(record["states"][5]["truth"]["inverse"])
builder = newton.ModelBuilder()
builder.add_mjcf("arm/robot.xml")
model = builder.finalize(device="cpu")
s = model.state()
s.joint_q.assign(np.float32(state["qpos"]))
newton.eval_fk(model, s.joint_q, s.joint_qd, s)
M = wp.zeros((1, 7, 7), dtype=wp.float32)
newton.eval_inverse_dynamics_passive(model, s, mass_matrix=M)
X = np.linalg.inv(M.numpy()[0])
print(f"{np.max(np.abs(X - exact) / np.sqrt(np.outer(np.diag(exact), np.diag(exact)))):.1e}")
