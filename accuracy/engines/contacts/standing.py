"""g1 on eight points and go2 on four, as MuJoCo Warp has them: H x = b, H = M + J'DJ, in float32
by the filter and by MuJoCo Warp's own assembly and Cholesky of H, against the truth (feet.py).
Prints lines of JSON: robot, d, and of each way |dx| / |x| of all states, null where there is no
answer. Run in the environment of mujoco_warp.
"""

import json
import sys
from pathlib import Path

import filter_in_warp
import mujoco
import mujoco_warp as mjw
import numpy as np
import warp as wp
from feet import (
    FEET,
    STATES,
    STIFFNESS,
    draw,
    errors,
    exact,
    jacobians,
    mass_matrices,
    solutions,
    solve_exactly,
    standing,
    weights,
)
from mujoco_warp._src import solver

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "defects"))

import mujoco_warp_1415  # noqa: E402

QUADRATIC = int(mujoco.mjtConstraintState.mjCNSTRSTATE_QUADRATIC)
wp.config.quiet = True


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

    fields = ("worldid", "geom", "efc_address", "pos", "frame")
    contacts = [getattr(d.contact, field).numpy()[: d.nacon.numpy()[0]] for field in fields]
    contacts[2] = contacts[2][:, 0]
    J = exact(jacobians(model, data, zip(*contacts, strict=True), rows))
    M = exact(mass_matrices(model, data))
    d.efc.state.fill_(QUADRATIC)
    x = wp.zeros((states, model.nv), dtype=float)
    for normal in stiffness:
        D = weights(normal, rows)
        weight = np.zeros(d.efc.D.shape, dtype=np.float32)
        weight[:, :rows] = D
        d.efc.D = wp.array(weight)
        truth = solutions(M, J, D, b)
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
