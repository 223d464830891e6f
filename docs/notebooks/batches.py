# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Batches and randomisation
# Thousands of states in one call, and as many controllers: each state has gains and a load of its own. Robots with other inertias are other
# robots: each is one object, which answers its own batch.

# %%
import time

import kalmarm
import matplotlib.pyplot as plt
import numpy as np

path = "robots/models/iiwa14/iiwa14.xml"
robot = kalmarm.load(path, acted_on=["link7"])
count = 2048
rng = np.random.default_rng(0)

# %% [markdown]
# ## Time of a state against the size of a batch
# Rows are answered in the lanes of the processor's registers, in float32 twice as many as in float64.

# %%
sizes = [1, 4, 16, 64, 256, 1024, 4096]
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for dtype in (np.float64, np.float32):
    times = []
    for size in sizes:
        states = robot.random_state(0, size, dtype=dtype)
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            robot.forward_dynamics(*states)
            seconds.append(time.perf_counter() - start)
        times.append(min(seconds) / size * 1e6)
    axes.loglog(sizes, times, "o-", label=dtype.__name__)
axes.set(xlabel="states a call", ylabel="time of a state [µs]")
axes.legend()
plt.show()

# %% [markdown]
# ## Loads of their own
# Every state has a load of its own at the hand, as its weight: a force from outside in the axes of the base, that no joint's controller knows of.

# %%
weight = rng.uniform(0, 5, count)  # [kg]
forces = np.zeros((count, 6))
forces[:, 5] = -9.81 * weight
q = np.tile([0, 0.6, 0, -1.4, 0, 1.0, 0], (count, 1))
hold = robot.gravity(q)
a = robot.forward_dynamics(q, 0, hold, forces=forces)
loaded = robot.bias(q, 0, forces=forces)
assert np.allclose(robot.forward_dynamics(q, 0, loaded, forces=forces), 0, atol=1e-9)
assert np.allclose(a, a[:1] + (weight - weight[0])[:, None] * (a[1] - a[0]) / (weight[1] - weight[0]))  # linear in the load

# %% [markdown]
# ## Gains of their own
# A step of 2 ms by springs and dampers of every state's own: position controllers of 10³ to 10⁵ N m/rad at once.

# %%
step = kalmarm.ImplicitStep(robot, 0.002, damping=0, stiffness=0, reference=0)
stiffness = 10 ** rng.uniform(3, 5, (count, 1)) * np.ones(robot.nv)
damping = 2 * np.sqrt(stiffness)
target = q + 0.2
state, velocity = q.copy(), np.zeros_like(q)
for _ in range(500):
    state, velocity, _ = step(
        state, velocity, 0, stiffness=stiffness, damping=damping, reference=target, forces=forces, threads=0
    )
sag = np.abs(state - target).max(axis=1)

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.loglog(stiffness[:, 0], sag, ".", markersize=2)
axes.set(xlabel="stiffness [N m/rad]", ylabel="distance from the target [rad]")
plt.show()
assert sag[stiffness[:, 0] > 5e4].max() < 0.01

# %% [markdown]
# ## Inertias of their own
# Twenty arms whose rotors differ. What depends on the model is made once a robot; states are cheap.

# %%
spread = []
states = robot.random_state(1, 200)
for scale in np.linspace(0, 0.5, 20):
    one = kalmarm.load(path, armature={joint: scale for joint in robot.dofs})
    spread.append(np.linalg.cond(one.mass_matrix(states.q)).max())
assert spread[0] > spread[-1]
print(f"largest condition number of M: {spread[0]:.0f} without rotors, {spread[-1]:.0f} with 0.5 kg m^2")
