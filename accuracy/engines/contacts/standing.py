"""g1 on eight points and go2 on four, as MuJoCo Warp has them: H x = b, H = M + J'DJ, in float32
by the filter and by MuJoCo Warp's own assembly and Cholesky of H, against the truth.

Truth: M and J by MuJoCo in float64 for parameters, positions and contacts as float32 holds them;
H and x from these in 50 digits. Prints lines of JSON: robot, d, and of each way |dx| / |x| of all
states, null where there is no answer. Run in the environment of mujoco_warp.
"""

import json
import sys
from decimal import Decimal, getcontext
from pathlib import Path

import filter_in_warp
import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp
from mujoco_warp._src import solver

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "defects"))

import mujoco_warp_1415  # noqa: E402

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
QUADRATIC = int(mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC)
PARAMETERS = (
    "body_pos body_quat body_ipos body_iquat body_mass body_inertia dof_armature jnt_axis jnt_pos"
)
getcontext().prec = 50
wp.config.quiet = True
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


def jacobians(model: mujoco.MjModel, data: list[mujoco.MjData], d, rows: int) -> np.ndarray:
    """Rows of all states' contacts as MuJoCo Warp numbers them."""
    J, point = np.zeros((len(data), rows, model.nv)), np.zeros((3, model.nv))
    fields = ("worldid", "geom", "efc_address", "pos", "frame")
    contacts = [getattr(d.contact, field).numpy()[: d.nacon.numpy()[0]] for field in fields]
    for world, geoms, address, pos, frame in zip(*contacts, strict=True):
        body = max(model.geom_bodyid[geoms], key=model.body_treeid.item)
        mujoco.mj_jac(model, data[world], point, None, pos.astype(float), body)
        J[world, address[:3]] = frame.astype(float) @ point
    return J


def cholesky(m, d, b: np.ndarray) -> np.ndarray:
    """-H^-1 b is the direction of MuJoCo Warp's Newton step at the gradient b."""
    context = solver._create_solver_context(m, d)
    context.done.zero_()
    context.alpha.zero_()
    d.efc.Ma = wp.array(b)
    d.qfrc_smooth.zero_()
    d.qfrc_constraint.zero_()
    solver._update_gradient(m, d, context)
    return -context.search.numpy()


def errors(answers: np.ndarray, truth: list[np.ndarray]) -> list[float | None]:
    sizes = [float(np.linalg.norm(x)) for x in truth]
    away = [float(np.linalg.norm(x)) for x in answers - np.array(truth)]
    return [a / x if np.isfinite(a) else None for a, x in zip(away, sizes, strict=True)]


def measure(robot: str, stiffness: list[float], states: int, seed: int):
    """Records, one a stiffness."""
    model, draws = standing(robot), np.random.default_rng(seed)
    data = [draw(model, robot, draws) for _ in range(states)]
    b = draws.normal(size=(states, model.nv)).astype(np.float32)
    rows = 3 * sum(map(len, FEET[robot].values()))
    m, d = mjw.put_model(model), mjw.make_data(model, nworld=states, njmax=rows, nconmax=rows)
    for field in ("qpos", "mocap_pos", "mocap_quat"):
        values = np.stack([getattr(one, field) for one in data]).astype(np.float32)
        to = getattr(d, field)
        wp.copy(to, wp.array(values, dtype=to.dtype))
    mjw.fwd_position(m, d)
    assert (d.nefc.numpy() == rows).all(), "a foot does not touch its plane"

    J = exact(jacobians(model, data, d, rows))
    M = np.zeros((states, model.nv, model.nv))
    for full, one in zip(M, data, strict=True):
        mujoco.mj_fullM(model, one, full)
    M = exact(M)
    d.efc.state.fill_(QUADRATIC)
    x = wp.zeros((states, model.nv), dtype=float)
    for normal in stiffness:
        D = np.tile([normal, TANGENT * normal, TANGENT * normal], rows // 3).astype(np.float32)
        weight = np.zeros(d.efc.D.shape, dtype=np.float32)
        weight[:, :rows] = D
        d.efc.D = wp.array(weight)
        truth = [
            solve_exactly(M[w] + J[w].T @ (exact(D)[:, None] * J[w]), exact(b[w])).astype(float)
            for w in range(states)
        ]
        filter_in_warp.solve(m, d, d.efc.D, wp.array(b), x)
        ways = {"filter": x.numpy(), "cholesky": cholesky(m, d, b)}
        yield {"robot": robot, "d": normal} | {way: errors(ways[way], truth) for way in ways}


def issue_1415():
    """A record of the state that MuJoCo Warp's solver makes NaN, with D of MuJoCo."""
    model, data = mujoco_warp_1415.standing()
    m, d = mjw.put_model(model), mjw.put_data(model, data)
    b = np.random.default_rng(1).normal(size=(1, model.nv)).astype(np.float32)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    J, D = exact(data.efc_J.reshape(data.nefc, model.nv)), exact(data.efc_D.astype(np.float32))
    truth = solve_exactly(exact(M) + J.T @ (D[:, None] * J), exact(b[0])).astype(float)
    d.efc.state.fill_(QUADRATIC)
    x = wp.zeros(b.shape, dtype=float)
    filter_in_warp.solve(m, d, d.efc.D, wp.array(b), x)
    ways = {"filter": errors(x.numpy(), [truth]), "cholesky": errors(cholesky(m, d, b), [truth])}
    yield {"robot": "#1415", "d": data.efc_D.max()} | ways


if __name__ == "__main__":
    for robot in sys.argv[1:] or [*FEET, "#1415"]:
        of = measure(robot, STIFFNESS, STATES, seed=1) if robot in FEET else issue_1415()
        for record in of:
            print(json.dumps(record), flush=True)
