"""g1 on eight points and go2 on four, as MJX has them: H x = b, H = M + J'DJ, by MJX's own
assembly and Cholesky of H in float32, which is JAX's default, against the truth (feet.py).
Prints lines of JSON: robot, d, and |dx| / |x| of all states, null where there is no answer. Run
in the environment of mjx.
"""

import json
import sys

import jax
import mujoco
import numpy as np
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
    standing,
    weights,
)
from mujoco import mjx
from mujoco.mjx._src import solver


def placed(m, start, qpos, mocap_pos, mocap_quat):
    return mjx.fwd_position(
        m, start.replace(qpos=qpos, mocap_pos=mocap_pos, mocap_quat=mocap_quat)
    )


def cholesky(m, d, D, b):
    """H^-1 b is the preconditioned gradient of MJX's Newton step at the gradient b, where all rows
    act and no cone slides."""
    cones = jax.numpy.zeros((len(D) // 3, 6, 6))
    d = d.replace(qfrc_smooth=0 * b).tree_replace({"_impl.efc_D": D})
    at = solver.Context.create(m, d, grad=False).replace(
        Ma=b, qfrc_constraint=0 * b, active=jax.numpy.ones_like(D), h=cones
    )
    return solver._update_gradient(m, d, at).Mgrad


def measure(robot: str, stiffness: list[float], states: int, seed: int):
    """Records, one a stiffness."""
    model, draws = standing(robot), np.random.default_rng(seed)
    data = [draw(model, robot, draws) for _ in range(states)]
    b = draws.normal(size=(states, model.nv)).astype(np.float32)
    rows = 3 * sum(map(len, FEET[robot].values()))
    m, start = mjx.put_model(model, impl="jax"), mjx.make_data(model, impl="jax")
    place, solve = jax.jit(placed), jax.jit(cholesky)
    of_states = [
        place(m, start, *(x.astype(np.float32) for x in (one.qpos, one.mocap_pos, one.mocap_quat)))
        for one in data
    ]
    touching = [d._impl.contact for d in of_states]
    assert all((of.dist < 0).all() and len(of.dist) == rows // 3 for of in touching)
    fields = ("geom", "efc_address", "pos", "frame")
    contacts = [
        (world, *(np.asarray(getattr(of, field))[i] for field in fields))
        for world, of in enumerate(touching)
        for i in range(rows // 3)
    ]
    J = exact(jacobians(model, data, contacts, rows))
    M = exact(mass_matrices(model, data))
    for normal in stiffness:
        D = weights(normal, rows)
        x = np.array([solve(m, d, D, one) for d, one in zip(of_states, b, strict=True)])
        yield {"robot": robot, "d": normal, "cholesky": errors(x, solutions(M, J, D, b))}


if __name__ == "__main__":
    print(f"MJX of MuJoCo {mujoco.__version__}", file=sys.stderr)
    for robot in sys.argv[1:] or FEET:
        for record in measure(robot, STIFFNESS, STATES, seed=1):
            print(json.dumps(record), flush=True)
