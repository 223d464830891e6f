"""Masses, centres and moments of SO-101's links from torques of a motion, by gradient descent through `kalmarm.jax`.

    python python/examples/identify_masses.py            # needs kalmarm[robots,jax]

Torques are linear in the ten inertial parameters pi of every link, tau = Y(q, qd, qdd) pi + r qdd (r: armatures), and Y
has a lower rank than it has columns: a motion shows combinations of pi (base parameters), and no link's mass by itself.
So a fit is judged by the torques of another motion, not by its masses.

A link is its pseudo-inertia J = [Sigma, m c; m c', m], which is a body's where J > 0 (Wensing, Kim & Slotine 2018).
Here J is that of the file, J0 = U0 U0', distorted: J = U0 (1 + X)(1 + X)' U0', X (4, 4) upper triangular. Its ten
numbers have no unit, all of them make bodies, and what the motion does not show stays near the file's, X = 0.
"""

from pathlib import Path
from typing import NamedTuple

import jax
import jax.numpy as jnp
import kalmarm
import kalmarm.jax
import numpy as np

jax.config.update("jax_enable_x64", True)
FILE = Path(__file__).parents[2] / "robots/models/so101/so101.xml"
BODIES = ["shoulder", "upper_arm", "lower_arm", "wrist", "gripper", "moving_jaw_so101_v1"]
SAMPLES, NOISE = 500, 0.005  # standard deviation of a torque [N m]
STEPS, RATE = 1000, 0.02  # of Adam


class Experiment(NamedTuple):
    truth: np.ndarray  # pi (b, 10)
    motion: tuple[np.ndarray, ...]  # q, qd, qdd (SAMPLES, n)
    torques: np.ndarray  # measured, (SAMPLES, n)


def motion(robot, seed, seconds=10.0):
    """Four sines in every joint, the slowest of one period: q, qd and qdd, (SAMPLES, n) each."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0, seconds, SAMPLES)[:, None, None]
    w = 2 * np.pi / seconds * np.arange(1, 5)[:, None]
    size, phase = rng.uniform(0.1, 0.4, (4, robot.nv)), rng.uniform(0, 2 * np.pi, (4, robot.nv))
    s, c = size * np.sin(w * t + phase), size * np.cos(w * t + phase)
    return tuple(part.sum(axis=1) for part in (s, w * c, -(w**2) * s))


def torques(robot, pi, moved):
    varied, kept = robot.with_parameters(BODIES)
    return varied.inverse_dynamics(*moved, loads=np.ravel(pi - kept))


def experiment(robot):
    """An arm whose links are all distorted, by a third."""
    rng = np.random.default_rng(0)
    truth = np.asarray(distorted(robot.parameters(BODIES), 0.3 * rng.standard_normal((len(BODIES), 10))))
    moved = motion(robot, 1)
    return Experiment(truth, moved, torques(robot, truth, moved) + NOISE * rng.standard_normal(moved[0].shape))


def distorted(pi, X):
    """pi (b, 10) = (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of bodies, distorted by X (b, 10)."""
    m, x, y, z, xx, yy, zz, xy, xz, yz = pi.T
    half = (xx + yy + zz) / 2
    J0 = np.array([[half - xx, -xy, -xz, x], [-xy, half - yy, -yz, y], [-xz, -yz, half - zz, z], [x, y, z, m]])
    U0 = np.linalg.cholesky(np.moveaxis(J0, -1, 0)[:, ::-1, ::-1])[:, ::-1, ::-1]  # upper triangular
    U = U0 @ (jnp.eye(4) + jnp.zeros_like(U0).at[:, *np.triu_indices(4)].set(X))
    (xx, xy, xz, x), (_, yy, yz, y), (_, _, zz, z), (*_, m) = jnp.einsum("bik,bjk->ijb", U, U)
    return jnp.stack([m, x, y, z, yy + zz, xx + zz, xx + yy, -xy, -xz, -yz], axis=-1)


def fit(robot, moved, measured):
    """pi (b, 10) by least squares of the torques, from the file's."""
    varied, kept = robot.with_parameters(BODIES)
    own = robot.parameters(BODIES) - kept  # distorted, while the rest stays: the sum is a body

    def loss(X):
        tau = kalmarm.jax.inverse_dynamics(varied, *moved, loads=distorted(own, X).ravel())
        return jnp.mean((tau - measured) ** 2)

    def adam(i, state):
        X, mean, square = state
        g = jax.grad(loss)(X)
        mean, square = 0.9 * mean + 0.1 * g, 0.99 * square + 0.01 * g**2
        ahead = mean / (1 - 0.9 ** (i + 1)) / jnp.sqrt(square / (1 - 0.99 ** (i + 1)) + 1e-24)
        return X - RATE * (1 - i / STEPS) * ahead, mean, square

    zero = jnp.zeros((len(BODIES), 10))
    X, *_ = jax.jit(jax.lax.fori_loop, static_argnums=2)(0, STEPS, adam, (zero, zero, zero))
    return kept + np.asarray(distorted(own, X))


def main():
    robot = kalmarm.load(FILE)
    data = experiment(robot)
    found = fit(robot, data.motion, data.torques)
    other = motion(robot, 2)
    truth = torques(robot, data.truth, other)
    for name, pi in ("file", robot.parameters(BODIES)), ("fit", found):
        error = np.sqrt(np.mean((torques(robot, pi, other) - truth) ** 2))
        print(f"torques of another motion by the {name}: wrong by {1000 * error:.1f} mN m")
    return robot, data, found


if __name__ == "__main__":
    main()
