"""g1 on eight points and go2 on four: models, random states and the truth of H x = b,
H = M + J'DJ, for engines in float32.

Truth: M and J by MuJoCo in float64 for parameters, positions and contacts as float32 holds them;
H and x from these in 50 digits.
"""

from decimal import Decimal, getcontext
from pathlib import Path

import mujoco
import numpy as np

ROBOTS = Path(__file__).resolve().parents[3] / "robots" / "models"
SOLE = [(x, y, -0.03) for x in (0.12, -0.05) for y in (0.03, -0.03)]
FEET = {
    "g1": {f"{side}_ankle_roll_link": SOLE for side in ("left", "right")},
    "go2": {f"{leg}_calf": [(0.0, 0.0, -0.213)] for leg in ("FL", "FR", "RL", "RR")},
}
CROUCH = {"go2": 4 * [0.0, 0.9, -1.8]}  # about which positions are drawn; zeros where not here
STIFFNESS = [10.0**e for e in range(2, 9)]  # along the normal [kg]
TANGENT = 0.3  # of that
STATES = 12
RADIUS, DEPTH = 0.01, 1e-3  # of the spheres that touch, and of their touching [m]
PARAMETERS = (
    "body_pos body_quat body_ipos body_iquat body_mass body_inertia dof_armature jnt_axis jnt_pos"
)
getcontext().prec = 50
exact = np.vectorize(Decimal, otypes=[object])


def standing(robot: str) -> mujoco.MjModel:
    """A plane that can be moved under every foot, which touches that foot alone."""
    spec = mujoco.MjSpec.from_file(str(ROBOTS / robot / f"{robot}.xml"))
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
    for i, (foot, points) in enumerate(FEET[robot].items()):
        for point in points:
            touching = {"contype": 1 << i, "conaffinity": 0, "mass": 0}
            spec.body(foot).add_geom(pos=point, size=[RADIUS, 0, 0], **touching)
        plane = spec.worldbody.add_body(mocap=True)
        kind = mujoco.mjtGeom.mjGEOM_PLANE
        plane.add_geom(type=kind, size=[1, 1, 1], contype=0, conaffinity=1 << i)
    model = spec.compile()
    for name in PARAMETERS.split():
        value = getattr(model, name)
        value[:] = value.astype(np.float32)
    return model


def draw(model: mujoco.MjModel, robot: str, draws: np.random.Generator) -> mujoco.MjData:
    """A random position, the planes at its feet; what float32 holds of it."""
    data = mujoco.MjData(model)
    data.qpos[:3] = draws.uniform(-1, 1, 3)
    data.qpos[3:7] = draws.normal(size=4)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qpos[7:] = CROUCH.get(robot, 0) + draws.uniform(-0.4, 0.4, model.nq - 7)
    data.qpos[:] = data.qpos.astype(np.float32)
    mujoco.mj_kinematics(model, data)
    for i, (foot, points) in enumerate(FEET[robot].items()):
        body = data.body(foot)
        below = np.array(points[0]) - [0, 0, RADIUS - DEPTH]
        data.mocap_pos[i] = body.xpos + body.xmat.reshape(3, 3) @ below
        data.mocap_quat[i] = body.xquat
    mujoco.mj_fwdPosition(model, data)
    return data


def solve_exactly(H: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of numbers that are Decimal."""
    A, n = np.column_stack([H, b]), len(b)
    for k in range(n):
        A[k + 1 :] -= np.outer(A[k + 1 :, k] / A[k, k], A[k])
    x = np.zeros(n, dtype=object)
    for k in reversed(range(n)):
        x[k] = (A[k, n] - A[k, k + 1 : n] @ x[k + 1 :]) / A[k, k]
    return x


def jacobians(model: mujoco.MjModel, data: list[mujoco.MjData], contacts, rows: int) -> np.ndarray:
    """Rows of all states' contacts as the engine numbers them.

    contacts: of each its state, geoms, first row, position and frame.
    """
    J, point = np.zeros((len(data), rows, model.nv)), np.zeros((3, model.nv))
    for world, geoms, address, pos, frame in contacts:
        body = max(model.geom_bodyid[geoms], key=model.body_treeid.item)
        mujoco.mj_jac(model, data[world], point, None, pos.astype(float), body)
        J[world, address : address + 3] = frame.astype(float) @ point
    return J


def mass_matrices(model: mujoco.MjModel, data: list[mujoco.MjData]) -> np.ndarray:
    M = np.zeros((len(data), model.nv, model.nv))
    for full, one in zip(M, data, strict=True):
        mujoco.mj_fullM(model, one, full)
    return M


def weights(normal: float, rows: int) -> np.ndarray:
    return np.tile([normal, TANGENT * normal, TANGENT * normal], rows // 3).astype(np.float32)


def solutions(M: np.ndarray, J: np.ndarray, D: np.ndarray, b: np.ndarray) -> list[np.ndarray]:
    """H^-1 b of all states; M and J are Decimal."""
    return [
        solve_exactly(m + j.T @ (exact(D)[:, None] * j), exact(one)).astype(float)
        for m, j, one in zip(M, J, b, strict=True)
    ]


def errors(answers: np.ndarray, truth: list[np.ndarray]) -> list[float | None]:
    sizes = [float(np.linalg.norm(x)) for x in truth]
    away = [float(np.linalg.norm(x)) for x in answers - np.array(truth)]
    return [a / x if np.isfinite(a) else None for a, x in zip(away, sizes, strict=True)]
