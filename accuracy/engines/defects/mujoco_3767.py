"""MuJoCo #3767: the sparse Cholesky factor of the Newton solver's Hessian is wrong, because rows
with different descendants are taken for one block. Trees whose hinges are coupled, with a sparse
and with a dense Jacobian: the same equations, so that accelerations may differ by rounding alone.
"""

import json

import mujoco
import numpy as np


def bodies(draw, name: str, depth: int, names: list) -> str:
    names.append(name)
    count = draw.integers(0, 3) if depth < 3 else 0
    children = "".join(bodies(draw, f"{name}{i}", depth + 1, names) for i in range(count))
    x, axis = draw.integers(1, 9) / 10, f"{draw.integers(0, 2)} 1 0"
    return f"""<body pos="{x} 0 0.1"><joint name="{name}" axis="{axis}"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>{children}</body>"""


def acceleration(seed: int, jacobian: str) -> np.ndarray:
    draw, names = np.random.default_rng(seed), []
    trees = "".join(bodies(draw, f"t{i}_", 0, names) for i in range(6))
    pairs = [draw.choice(names, 2, replace=False) for _ in range(8)]
    rows = "".join(f'<joint joint1="{a}" joint2="{b}"/>' for a, b in pairs)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option jacobian="{jacobian}" solver="Newton"/>
        <worldbody>{trees}</worldbody><equality>{rows}</equality></mujoco>"""
    )
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = draw.standard_normal((2, model.nv))
    mujoco.mj_forward(model, data)
    return data.qacc.copy()


errors = []
for seed in range(40):
    sparse, dense = (acceleration(seed, jacobian) for jacobian in ("sparse", "dense"))
    errors.append(np.linalg.norm(sparse - dense) / np.linalg.norm(dense))
print(json.dumps({"version": mujoco.__version__, "error": max(errors)}))
