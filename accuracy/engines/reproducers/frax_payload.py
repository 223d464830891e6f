"""frax 0.1.0: its own KUKA iiwa with 10^6 times the mass of the last link, float32 against float64."""

import jax
import numpy as np
from frax import load_iiwa

draw = np.random.default_rng(3)
q, v = draw.uniform(-3, 3, 7), draw.standard_normal(7)
answers = {}
for x64 in (False, True):
    jax.config.update("jax_enable_x64", x64)
    robot = load_iiwa()
    robot.link_masses[-1] *= 1e6
    robot.link_local_inertias[-1] *= 1e6
    state = [jax.numpy.asarray(np.float32(x), dtype=float) for x in (q, v, 0 * v)]
    answers[x64] = np.array(robot.forward_dynamics(*state, None))
print(f"{np.linalg.norm(answers[False] - answers[True]) / np.linalg.norm(answers[True]):.1e}")
