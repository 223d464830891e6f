# ---
# jupyter:
#   kernelspec: {display_name: Python 3, language: python, name: python3}
# ---

# %% [markdown]
# # Control
# Three controllers of one arm on one motion, with a model that knows 60 % of the inertia of its rotors: gravity compensation with springs, computed torque, and the
# same with an observer of what the model lacks. [More controllers](../controllers.md).

# %%
import kalmarm
import matplotlib.pyplot as plt
import mujoco
import numpy as np

path = "robots/models/puma560/puma560.xml"
plant = kalmarm.load(path)
rotors = mujoco.MjModel.from_xml_path(path).dof_armature
model = kalmarm.load(path, armature=dict(zip(plant.dofs, 0.6 * rotors)))
n = plant.nv
dt, steps = 0.001, 3000
t = dt * np.arange(steps)

# %% [markdown]
# ## The motion
# Sines on every joint, from rest.

# %%
amplitude, w = 0.3, 2 * np.pi * 0.5
start = plant.q0
reference = start + amplitude * (1 - np.cos(w * t))[:, None] * np.ones(n)
velocity = amplitude * w * np.sin(w * t)[:, None] * np.ones(n)
acceleration = amplitude * w**2 * np.cos(w * t)[:, None] * np.ones(n)

# %% [markdown]
# ## The controllers
# kp and kd are gains on accelerations. The observer takes the joints' momentum p = M q̇, whose rate is τ + Ṁ q̇ − bias, plus what is unknown:
# with a gain of 50/s it follows that as a first-order filter does. Ṁ q̇ − bias is a difference of M along the motion.

# %%
kp, kd, gain = 400.0, 40.0, 50.0


def springs(q, qd, i):
    return model.gravity(q) + kp * (reference[i] - q) + kd * (velocity[i] - qd)


def computed_torque(q, qd, i):
    wanted = acceleration[i] + kp * (reference[i] - q) + kd * (velocity[i] - qd)
    return model.inverse_dynamics(q, qd, wanted)


class Observed:
    def __init__(self):
        self.unknown, self.sum = np.zeros(n), np.zeros(n)

    def __call__(self, q, qd, i):
        tau = computed_torque(q, qd, i) - self.unknown
        momentum = model.mass_matrix(q) @ qd
        ahead = model.mass_matrix(q + 1e-6 * qd) @ qd
        self.sum += dt * (tau + (ahead - momentum) / 1e-6 - model.bias(q, qd) + self.unknown)
        self.unknown = gain * (momentum - self.sum)
        return tau


# %% [markdown]
# ## The error of each
# Semi-implicit Euler: q̇ first, then q by the new q̇.

# %%
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
worst = {}
for name, controller in (("springs", springs), ("computed torque", computed_torque), ("observed", Observed())):
    q, qd = start.copy(), np.zeros(n)
    error = np.empty(steps)
    for i in range(steps):
        error[i] = np.linalg.norm(q - reference[i])
        qd = qd + dt * plant.forward_dynamics(q, qd, controller(q, qd, i))
        q = q + dt * qd
    worst[name] = error[steps // 2 :].max()
    axes.semilogy(t, np.maximum(error, 1e-8), label=name)
axes.set(xlabel="time [s]", ylabel="distance from the motion [rad]")
axes.legend()
plt.show()
print({name: f"{value:.1e}" for name, value in worst.items()})
assert worst["observed"] < worst["computed torque"] < worst["springs"]
