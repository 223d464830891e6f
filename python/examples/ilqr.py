"""A swing of panda's hand to a pose, by iLQR: the iterative linear-quadratic regulator, through `kalmarm.jax`.

    python python/examples/ilqr.py                       # needs kalmarm[robots,jax]

Of states x = (q, qd) and commands u, which ask for the torques limit tanh(u) and so never for more than the limits,

    minimise sum h/2 ((x - x0)' W (x - x0) + E u'u) + terminal(x_N),   x_{t+1} = step(x_t, u_t).

The hand's pose is three of its points r(q), so that the terminal cost is P/2 |r - r*|^2 + V/2 |qd|^2, whose
Hessian is taken for P J'J and V (Gauss-Newton): r and J are the library's kinematics. Each iteration

- linearises all steps at once, A = dx_{t+1}/dx_t and B = dx_{t+1}/du_t: forward mode under vmap, one call of rows;
- goes back through a Riccati recursion for u + alpha k + K (x_new - x);
- tries all step lengths alpha at once, again rows of one call, and keeps the best if it costs less than before.
"""

from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import kalmarm
import kalmarm.jax
import numpy as np

jax.config.update("jax_enable_x64", True)
ROBOT = kalmarm.load(Path(__file__).parents[2] / "robots/models/panda/panda.xml")
N = ROBOT.nv
H, STEPS = 0.01, 50  # [s]: a swing of half a second
LIMIT = np.array([87.0] * 4 + [12.0] * 3 + [70.0] * 2)  # [N m], of the fingers [N]: Franka's data sheet
HOME = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785, 0.02, 0.02])  # [rad], of the fingers [m]
REST = np.concatenate([HOME, np.zeros(N)])
W = np.repeat([0.1, 0.01], N)  # of positions and velocities on the way
EFFORT, POSE, VELOCITY = 0.1, 1e5, 1e2
ALPHAS = 0.5 ** np.arange(10)

hand = ROBOT.frames["hand"]
POINTS = ROBOT.kinematics(
    [kalmarm.Frame(hand.link, translation=np.add(hand.translation, p)) for p in 0.1 * np.eye(3, k=-1)]
)
GOAL = POINTS.compute(["positions"], HOME)["positions"] + [-0.1, 0.4, 0.2]  # the same orientation


def step(x, u):
    q, qd = x[:N], x[N:]
    qd = qd + H * kalmarm.jax.forward_dynamics(ROBOT, q, qd, LIMIT * jnp.tanh(u))
    return jnp.concatenate([q + H * qd, qd])


@jax.jit
def backward(x, u, v, V):
    """Gains k (STEPS, n) and K (STEPS, n, 2 n), of gradient and Hessian of the terminal cost."""

    def back(carry, at):
        (v, V), (x, u, A, B) = carry, at
        Qx, Qu = H * W * (x - REST) + A.T @ v, H * EFFORT * u + B.T @ v
        Qxx, Qux, Quu = jnp.diag(H * W) + A.T @ V @ A, B.T @ V @ A, H * EFFORT * jnp.eye(N) + B.T @ V @ B
        gains = -jnp.linalg.solve(Quu, jnp.column_stack([Qu, Qux]))
        k, K = gains[:, 0], gains[:, 1:]
        V = Qxx + Qux.T @ K
        return (Qx + Qux.T @ k, (V + V.T) / 2), (k, K)

    A, B = jax.vmap(jax.jacfwd(step, (0, 1)))(x, u)
    return jax.lax.scan(back, (v, V), (x, u, A, B), reverse=True)[1]


@jax.jit
@partial(jax.vmap, in_axes=(0, None, None, None, None))
def forward(alpha, x, u, k, K):
    """The swing (STEPS + 1, 2 n), its commands and what it costs before the end, for one step length a row."""

    def onward(now, at):
        x, u, k, K = at
        u = u + alpha * k + K @ (now - x)
        return step(now, u), (now, u, H / 2 * (jnp.sum(W * (now - REST) ** 2) + EFFORT * jnp.sum(u**2)))

    end, (now, u, cost) = jax.lax.scan(onward, x[0], (x[:-1], u, k, K))
    return jnp.vstack([now, end]), u, jnp.sum(cost)


def terminal(x):
    """Cost (...), gradient (..., 2 n) and Hessian (..., 2 n, 2 n) of last states x (..., 2 n)."""
    q, qd = x[..., :N], x[..., N:]
    now = POINTS.compute(["positions", "jacobians"], q)
    r = (now["positions"] - GOAL).reshape(*q.shape[:-1], -1)
    J = now["jacobians"][..., 3:, :].reshape(*r.shape, N)
    hessian = np.zeros((*q.shape[:-1], 2 * N, 2 * N))
    hessian[..., :N, :N] = POSE * np.swapaxes(J, -1, -2) @ J
    hessian[..., N:, N:] = VELOCITY * np.eye(N)
    gradient = np.concatenate([POSE * np.einsum("...i,...ij->...j", r, J), VELOCITY * qd], axis=-1)
    return (POSE * (r**2).sum(-1) + VELOCITY * (qd**2).sum(-1)) / 2, gradient, hessian


def optimise(iterations=100):
    """States (STEPS + 1, 2 n), commands (STEPS, n), costs; from holding HOME until an iteration gains less than a millionth."""
    x, u = np.tile(REST, (STEPS + 1, 1)), np.tile(np.arctanh(ROBOT.gravity(HOME) / LIMIT), (STEPS, 1))
    k, K, costs = np.zeros((STEPS, N)), np.zeros((STEPS, N, 2 * N)), [np.inf]
    for _ in range(iterations):
        tried, commands, way = forward(ALPHAS, x, u, k, K)
        cost = way + terminal(np.asarray(tried[:, -1]))[0]
        best = np.nanargmin(cost)
        if not cost[best] < (1 - 1e-6) * costs[-1]:
            break
        x, u = tried[best], commands[best]
        costs.append(float(cost[best]))
        k, K = backward(x[:-1], u, *terminal(np.asarray(x[-1]))[1:])
    return np.asarray(x), np.asarray(u), costs[1:]


def main():
    x, u, costs = optimise()
    miss = np.linalg.norm(POINTS.compute(["positions"], x[-1, :N])["positions"][0] - GOAL[0])
    print(f"{len(costs) - 1} iterations, cost from {costs[0]:.0f} to {costs[-1]:.3f}")
    print(f"hand {1000 * miss:.3f} mm from its goal, joints slower than {np.abs(x[-1, N:]).max():.0e} rad/s")
    print("torques, of the limits:", *np.abs(np.tanh(u)).max(axis=0).round(2))
    return x, u, costs


if __name__ == "__main__":
    main()
