"""H x = b of a tree with every kind of joint and of row, by accuracy/engines/contacts: a line of
JSON.

By cone the error of x in float32 against NumPy's solution in float64 with J and D of MuJoCo Warp
and M of MuJoCo, and which kinds of rows and dimensions of contacts H had. Then two which have no
answer: two bodies that move touch; nothing has inertia about a hinge.
"""

import json
import sys
from pathlib import Path

import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "contacts"))

import filter_in_warp  # noqa: E402

TREE = """<mujoco><option cone="{cone}" jacobian="dense"/>
<default><geom contype="1" conaffinity="{pairs}" mass="0"/></default><worldbody>
  <geom type="plane" size="9 9 1" contype="0" conaffinity="1" condim="1"/>
  <body pos="0 0 0.3" quat="1 0.1 -0.2 0.3"><freejoint/>
    <inertial pos="0.1 0 0" mass="2" diaginertia="0.03 0.04 0.05"/>
    <geom size="0.31" condim="6" friction="0.7 0.02 0.01"/>
    <body pos="0.5 0.1 0" quat="1 0 0.3 0">
      <joint type="slide" axis="1 1 0" armature="0.1" range="-1 -0.1" limited="true"/>
      <joint pos="0.1 0.2 0" axis="0 1 1" frictionloss="0.2"/><joint pos="0 0 0.1" axis="1 0 0"/>
      <inertial pos="0 0.1 0" quat="1 0.2 0 0" mass="0.5" diaginertia="0.01 0.02 0.02"/>
      <body pos="0 0 0.1"><inertial pos="0 0.3 0" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/>
        <body pos="0.2 0 -0.1"><joint type="ball" pos="0.05 0 0" armature="0.01"/>
          <inertial pos="0.1 0 0" mass="0.3" diaginertia="2e-3 1e-3 2e-3"/>
          <geom size="0.8" condim="4" friction="0.5 0.1 0.1"/></body></body></body>
    <body pos="-0.4 0 0"><joint axis="0 1 0"/>
      <inertial pos="-0.1 0 0" mass="0.4" diaginertia="1e-3 2e-3 2e-3"/>
      <geom size="0.7" condim="3" friction="0.8 0.1 0.1"/></body></body>
  <body pos="3 0 0.5"><joint axis="1 0 0" range="0.1 1" limited="true"/><joint axis="0 1 0"/>
    <inertial pos="0 0 -0.2" mass="0.7" diaginertia="2e-3 2e-3 1e-3"/>
    <geom pos="0 0 -0.2" size="0.4" condim="1"/></body>
</worldbody></mujoco>"""
wp.config.quiet = True


def model_of(cone: str, pairs: int = 0) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(TREE.format(cone=cone, pairs=pairs))


def ask(model: mujoco.MjModel):
    """b, x, the outcome, and H in float64, kinds and dimensions of the rows that H has."""
    b = np.random.default_rng(3).normal(size=(1, model.nv)).astype(np.float32)
    host = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, host)
    m, d = mjw.put_model(model), mjw.put_data(model, host)
    mjw.fwd_position(m, d)
    x = wp.zeros((1, model.nv), dtype=float)
    outcome = filter_in_warp.solve(m, d, d.efc.D, wp.array(b), x).numpy()[0]

    of, kinds, D = (a.numpy()[0, : d.nefc.numpy()[0]] for a in (d.efc.id, d.efc.type, d.efc.D))
    J = d.efc.J.numpy()[0, : len(D), : model.nv].astype(float)
    H = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, host, H)
    touching = of[kinds >= int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)]
    dims = d.contact.dim.numpy()[touching]
    rows = {"kinds": np.unique(kinds).tolist(), "dims": np.unique(dims).tolist()}
    H += J.T @ (D[:, None] * J)
    return b[0], x.numpy()[0], filter_in_warp.Outcome(outcome).name, H, rows


said = {}
for cone in ("pyramidal", "elliptic"):
    b, x, outcome, H, rows = ask(model_of(cone))
    true = np.linalg.solve(H, b.astype(float))
    error = float(np.linalg.norm(x - true) / np.linalg.norm(true))
    said[cone] = {"outcome": outcome, "error": error, **rows}
light = model_of("elliptic")
light.body_mass[-1], light.body_inertia[-1] = 0, 0
light.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
for case, model in (("pair", model_of("elliptic", pairs=1)), ("massless", light)):
    _, x, outcome, *_ = ask(model)
    said[case] = {"outcome": outcome, "nothing": bool(np.isnan(x).all())}
print(json.dumps(said))
