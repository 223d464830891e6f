"""Mass and centre of what panda holds, from noisy torques, by an optimiser of PyTorch through `kalmarm.torch`.

    python python/examples/payload_estimation.py         # needs kalmarm[robots,torch]

The arm moves by known q, qd, qdd, its seven joints measure torques with noise of standard deviation s, and the load is
a point. Least squares of the torques, with J the derivatives of all torques by theta = (mass, centre), have the
covariance

    C = s^2 (J'J)^-1,                                                           (1)

by which the program says how far off its answer may be.
"""

from pathlib import Path
from typing import NamedTuple

import kalmarm
import kalmarm.torch
import numpy as np
import torch

FILE = Path(__file__).parents[2] / "robots/models/panda/panda.xml"
SAMPLES, ARM = 500, 7  # joints that measure; the fingers do not
NOISE = 0.1  # standard deviation of a torque [N m]
MASS, CENTER = 0.7, (0.02, -0.03, 0.12)  # [kg], in the hand's axes [m]


class Estimate(NamedTuple):
    theta: torch.Tensor  # mass, centre (4,)
    covariance: torch.Tensor  # (4, 4)


def motion(robot, seconds=10.0):
    """Three sines in every joint of the arm about a posture, the slowest of one period: (SAMPLES, n) each."""
    rng = np.random.default_rng(1)
    t = np.linspace(0, seconds, SAMPLES)[:, None, None]
    w = 2 * np.pi / seconds * np.arange(1, 4)[:, None]
    size, phase = rng.uniform(0.1, 0.3, (3, robot.nv)), rng.uniform(0, 2 * np.pi, (3, robot.nv))
    size[:, ARM:] = 0
    s, c = size * np.sin(w * t + phase), size * np.cos(w * t + phase)
    q, qd, qdd = (part.sum(axis=1) for part in (s, w * c, -(w**2) * s))
    posture = np.array([0, -0.785, 0, -2.356, 0, 1.571, 0.785, 0.02, 0.02])
    return tuple(map(torch.as_tensor, (posture + q, qd, qdd)))


def torques(robot, moved, theta):
    load = kalmarm.torch.payload(theta[0], theta[1:])
    return kalmarm.torch.inverse_dynamics(robot, *moved, loads=load)[..., :ARM]


def measure(robot, moved, seed):
    noise = NOISE * torch.randn(SAMPLES, ARM, dtype=torch.float64, generator=torch.Generator().manual_seed(seed))
    return torques(robot, moved, torch.tensor([MASS, *CENTER], dtype=torch.float64)) + noise


def estimate(robot, moved, measured):
    """From 0.1 kg between the fingers, by L-BFGS on gradients in reverse mode; (1) by all rows' jacobians in one call."""
    theta = torch.tensor([0.1, 0, 0, 0.1], dtype=torch.float64, requires_grad=True)
    optimiser = torch.optim.LBFGS(
        [theta], max_iter=200, tolerance_grad=1e-8, tolerance_change=1e-14, line_search_fn="strong_wolfe"
    )

    def closure():
        optimiser.zero_grad()
        loss = ((torques(robot, moved, theta) - measured) / NOISE).square().sum() / 2
        loss.backward()
        return loss

    optimiser.step(closure)
    found = theta.detach()
    rows = torch.func.vmap(lambda *state: torch.func.jacrev(lambda x: torques(robot, state, x))(found))
    J = rows(*moved).reshape(-1, len(found))
    return Estimate(found, NOISE**2 * torch.linalg.inv(J.T @ J))


def main():
    robot = kalmarm.load(FILE, loaded=["hand"])
    moved = motion(robot)
    found = estimate(robot, moved, measure(robot, moved, seed=0))
    deviation = found.covariance.diagonal().sqrt()
    print(f"mass {1000 * found.theta[0]:.0f} +- {1000 * deviation[0]:.0f} g")
    for axis, x, far in zip("xyz", found.theta[1:], deviation[1:]):
        print(f"centre {axis} {1000 * x:.1f} +- {1000 * far:.1f} mm")
    return robot, moved, found


if __name__ == "__main__":
    main()
