# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Error against run time
# A tolerance chooses how much work an answer gets. Here it is turned down on a long chain with a heavy tip, where rounding matters, and the time of
# a call is drawn against its true error.

# %%
import time

import kalmarm
import matplotlib.pyplot as plt
import numpy as np

builder = kalmarm.Builder("chain")
links = 30
for i in range(links):
    builder.add_body(
        f"link{i}",
        parent=i - 1,
        joint="hinge",
        axis=(0, 1, 0) if i % 2 else (1, 0, 0),
        position=(0, 0, -0.1) if i else (0, 0, 0),
        mass=1 if i < links - 1 else 1e3,
        center_of_mass=(0, 0, -0.05),
        inertia=(1e-3, 1e-3, 1e-3),
    )
chain = builder.build()
q, qd, tau = chain.random_state(0, 256)

# %% [markdown]
# ## The truth
# Answers to the last bits say how wrong they are; that is the error of what the others are compared with.

# %%
exact = chain.replace(tolerance=kalmarm.last_bits)
truth, outcomes = exact.forward_dynamics(q, qd, tau, status=True)
print(f"the truth is wrong by at most {outcomes['error'].max():.0e}")
assert outcomes["error"].max() < 1e-12

# %% [markdown]
# ## Error and time by tolerance and precision
# Times are of all states in one call on one core, a state's share, the best of five. Errors below 1e-17 are drawn there.

# %%
figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
asked = {np.float32: (1, 1e-2, 1e-4), np.float64: (1, 1e-4, 1e-8, 1e-12, kalmarm.last_bits)}
for dtype, tolerances in asked.items():
    points = []
    for tolerance in tolerances:
        robot = chain.replace(tolerance=tolerance)
        states = [x.astype(dtype) for x in (q, qd, tau)]
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            a, outcomes = robot.forward_dynamics(*states, status=True)
            seconds.append(time.perf_counter() - start)
        same = [x.astype(np.float64) for x in states]  # float32 rounds the states too
        reference = exact.forward_dynamics(*same)
        error = np.linalg.norm(a - reference, axis=1) / np.linalg.norm(reference, axis=1)
        answered = outcomes["status"] == kalmarm.Status.OK
        warned = outcomes["near_singular"] | (outcomes["error"] > 0.01)
        assert np.all(error[answered & ~warned] < tolerance + np.finfo(dtype).eps)
        rungs = sorted({kalmarm.Rung(rung).name for rung in outcomes["rung"]})
        points.append((max(np.median(error[answered]), 1e-17), min(seconds) / len(q) * 1e6))
        print(f"{dtype.__name__}, {tolerance:.0e}: {answered.sum()} answers, median error {points[-1][0]:.0e}, {rungs}")
    axes.loglog(*zip(*points), "o-", label=dtype.__name__)
axes.set(xlabel="median relative error of a", ylabel="time of a state [µs]")
axes.legend()
plt.show()

# %% [markdown]
# [The example report](../../reports/example/index.html) draws the same for every variant and for other libraries, against multi-precision truth.
