"""Bodies whose dynamics are known in closed form, as export_mechanism would write them."""

import json
from pathlib import Path

import numpy as np

from protocol import rotation

GRAVITY = np.array([0.5, -1.0, -9.0])
DOWN = np.array([0, 0, -9.0])  # for engines that know no other direction


def _record(joints, left_out, states, gravity=GRAVITY) -> dict:
    return {
        "robot": "body:1",
        "nv": sum({"free": 6}.get(joint["type"], 1) for joint in joints),
        "nq": sum({"free": 7}.get(joint["type"], 1) for joint in joints),
        "gravity": gravity.tolist(),
        "joints": joints,
        "urdf": {"left_out": left_out},
        "states": states,
    }


def _answers(M, bias, tau, a, bias_by_q=None) -> dict:
    """`bias_by_q` gives derivatives of a body with a constant M and a bias without velocity."""
    out = {
        "mass": M.tolist(),
        "inverse": np.linalg.inv(M).tolist(),
        "acceleration": np.linalg.solve(M, tau - bias).tolist(),
        "inverse_dynamics": (M @ a + bias).tolist(),
    }
    if bias_by_q is not None:
        by_q = -np.linalg.solve(M, bias_by_q)
        out["derivatives"] = np.hstack([by_q, np.zeros_like(by_q)]).tolist()
    return out


def _state(q, v, tau, a, truth, without) -> dict:
    given = {"qpos": q, "qvel": v, "tau": tau, "qacc": a}
    return {key: x.tolist() for key, x in given.items()} | {
        "truth": truth,
        "without_armature": without,
    }


def _write(folder: Path, mjcf: str, urdf: str, record: dict) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.xml").write_text(mjcf)
    (folder / "robot.urdf").write_text(urdf)
    (folder / "truth.json").write_text(json.dumps(record))
    return folder


def pendulum(folder: Path, gravity=GRAVITY) -> Path:
    """A hinge about x with armature r and a body of mass m, at y = l of it, of moment J about x:

    M = J + m l^2 + r,   bias = -m l (g_z cos q - g_y sin q)
    """
    m, length, J, r = 2.0, 0.5, 0.3, 0.7
    states = []
    for q, v, tau, a in ((0.3, 1.0, -2.0, 0.4), (-2.0, 0.0, 1.0, 3.0)):
        bias = np.array([-m * length * (gravity[2] * np.cos(q) - gravity[1] * np.sin(q))])
        slope = m * length * np.array([[gravity[2] * np.sin(q) + gravity[1] * np.cos(q)]])
        arrays = [np.array([x]) for x in (q, v, tau, a)]
        truths = [
            _answers(np.array([[J + m * length**2 + armature]]), bias, *arrays[2:], slope)
            for armature in (r, 0)
        ]
        states.append(_state(*arrays, *truths))
    # The joint's frame has its z axis along the world's x, its x along y, its y along z.
    direction = " ".join(map(str, gravity))
    mjcf = f"""<mujoco><option gravity="{direction}"/><worldbody>
      <body quat="1 1 1 1"><joint name="hinge" type="hinge" axis="0 0 1" armature="{r}"/>
      <inertial pos="{length} 0 0" mass="{m}" diaginertia="0.2 0.25 {J}"/></body>
      </worldbody></mujoco>"""
    half = np.pi / 2
    urdf = f"""<robot name="r"><link name="world"/><link name="hinge_link"><inertial>
      <origin xyz="{length} 0 0" rpy="0 0 0"/><mass value="{m}"/>
      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.25" iyz="0" izz="{J}"/></inertial></link>
      <joint name="hinge" type="revolute"><origin xyz="0 0 0" rpy="{half!r} 0 {half!r}"/>
      <parent link="world"/><child link="hinge_link"/><axis xyz="0 0 1"/>
      <limit lower="-1000" upper="1000" effort="1000" velocity="1000"/></joint></robot>"""
    joints = [{"name": "hinge", "type": "hinge", "dof": 0, "q": 0, "armature": r}]
    return _write(
        folder, mjcf, urdf, _record(joints, ["armature of joint 'hinge'"], states, gravity)
    )


def free_body(folder: Path) -> Path:
    """A free body of mass m with its com at c and moments I about it; R turns it, v is the velocity
    of its origin in the world, w its angular velocity in its own axes:

    M = [m 1  -m R c~; m c~ R'  I - m c~ c~]
    bias = [m R w x (w x c) - m g;  w x (I - m c~ c~) w - m c x R' g]
    """
    m, c, moments = 3.0, np.array([0.2, -0.3, 0.1]), np.array([0.4, 0.5, 0.6])
    C = np.array([[0, -c[2], c[1]], [c[2], 0, -c[0]], [-c[1], c[0], 0]])
    about_origin = np.diag(moments) - m * C @ C
    draw, states = np.random.default_rng(3), []
    for _ in range(3):
        q = draw.standard_normal(7)
        q[3:] /= np.linalg.norm(q[3:])
        v, tau, a = draw.standard_normal((3, 6))
        R, w = rotation(q[3:]), v[3:]
        M = np.block([[m * np.eye(3), -m * R @ C], [m * C @ R.T, about_origin]])
        force = m * R @ np.cross(w, np.cross(w, c)) - m * GRAVITY
        moment = np.cross(w, about_origin @ w) - m * np.cross(c, R.T @ GRAVITY)
        answers = _answers(M, np.concatenate([force, moment]), tau, a)
        states.append(_state(q, v, tau, a, answers, answers))
    gravity, at = " ".join(map(str, GRAVITY)), " ".join(map(str, c))
    mjcf = f"""<mujoco><option gravity="{gravity}"/><worldbody><body>
      <freejoint name="base"/><inertial pos="{at}" mass="{m}" diaginertia="0.4 0.5 0.6"/></body>
      </worldbody></mujoco>"""
    urdf = f"""<robot name="r"><link name="base_link"><inertial><origin xyz="{at}" rpy="0 0 0"/>
      <mass value="{m}"/><inertia ixx="0.4" ixy="0" ixz="0" iyy="0.5" iyz="0" izz="0.6"/></inertial>
      </link></robot>"""
    joints = [{"name": "base", "type": "free", "dof": 0, "q": 0, "armature": 0}]
    return _write(folder, mjcf, urdf, _record(joints, [], states))
