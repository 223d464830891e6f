# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Your own robot
# What to look at when a robot's file is read for the first time: what was left out, whether M is that of MuJoCo, which tolerance and which
# precision are enough, how wrong answers are, and what the rotors do. Put the path of your MJCF or URDF file here.

# %%
import kalmarm
import matplotlib.pyplot as plt
import mujoco
import numpy as np

path = "robots/models/go2/go2.xml"
robot = kalmarm.load(path)
print(f"{robot.name}: {robot.nv} degrees of freedom, {robot.nq} entries of q")
print(*robot.notes, sep="\n")

# %% [markdown]
# ## The same M as MuJoCo's
# Positions and velocities have MuJoCo's order, so a state can be given to both.

# %%
model = mujoco.MjModel.from_xml_path(path)
data = mujoco.MjData(model)
q, qd, tau = robot.random_state(0, 200)
difference = []
for state in q:
    data.qpos = state
    mujoco.mj_forward(model, data)
    full = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    M = robot.mass_matrix(data.qpos)
    difference.append(np.abs(M - full).max() / np.abs(M).max())
print(f"largest difference {max(difference):.0e} of the largest entry")
assert max(difference) < 1e-12

# %% [markdown]
# ## Which tolerance and precision
# `recommend` measures both on random states of the robot.

# %%
for wanted in (1e-3, 1e-6, 1e-12):
    advice = robot.recommend(wanted, count=100)
    print(f"{wanted:.0e}: tolerance {advice.tolerance:.1e}, many states in {advice.precision}")

# %% [markdown]
# ## How wrong each answer is
# The estimate that comes with every answer, and the true error, against answers to the last bits.

# %%
a, outcomes = robot.forward_dynamics(q, qd, tau, status=True)
truth = robot.replace(tolerance=kalmarm.last_bits).forward_dynamics(q, qd, tau)
error = np.linalg.norm(a - truth, axis=1) / np.linalg.norm(truth, axis=1)
assert np.all(error < 1e-8)

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.loglog(outcomes["error"], error, ".")
axes.set(xlabel="estimated relative error of a", ylabel="true relative error of a")
plt.show()

# %% [markdown]
# ## What a rotor's inertia does
# Armature, the inertia of a rotor times its gear ratio squared, stands on the diagonal of M. Without it M is worse conditioned.

# %%
joints = [dof for dof in robot.dofs if ":" not in dof]
bare = kalmarm.load(path, armature={joint: 0.0 for joint in joints})
with_rotors, without = (np.median(np.linalg.cond(one.mass_matrix(q))) for one in (robot, bare))
print(f"median condition number of M: {with_rotors:.0f} with rotors, {without:.0f} without")
assert without >= with_rotors
