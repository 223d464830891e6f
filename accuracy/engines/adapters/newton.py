"""Newton on the processor, float32, which is all that it has. Its accelerations are inside of its
solvers: what it gives are M and the torques."""

import os
from pathlib import Path

import numpy as np

from protocol import Call, Coordinates, Engine, Mechanism, State, Unsupported, joint_order

CACHE = Path(__file__).resolve().parents[3] / "build" / "engines" / "warp-cache"
os.environ.setdefault("WARP_CACHE_PATH", str(CACHE))

import warp as wp  # noqa: E402

import newton  # noqa: E402


class Adapter(Engine):
    name = "Newton"
    package = "newton"
    precisions = ("float32",)
    calls = {
        "mass": "eval_fk, eval_inverse_dynamics_passive",
        "inverse": "the same, numpy.linalg.inv",
        "acceleration": "eval_inverse_dynamics_passive, numpy.linalg.solve",
        "inverse_dynamics": "eval_inverse_dynamics_passive, eval_inverse_dynamics_force",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        if mechanism.floats:
            raise Unsupported("the velocity of a free joint is that of its centre of mass")
        wp.config.quiet = True
        wp.set_device("cpu")
        builder = newton.ModelBuilder()
        builder.add_mjcf(str(mechanism.mjcf), armature_scale=1.0)
        self.model = builder.finalize(device="cpu")
        self.model.set_gravity(tuple(mechanism.gravity))
        self.state = self.model.state()
        labels = [label.split("/")[-1] for label in self.model.joint_label]
        start = self.model.joint_qd_start.numpy()
        order = joint_order(mechanism, lambda joint: int(start[labels.index(joint.name)]))
        self.coordinates = Coordinates(mechanism, order)
        nv = mechanism.nv
        self.M = wp.zeros((1, nv, nv), dtype=wp.float32)
        self.forces = {
            name: wp.zeros(nv, dtype=wp.float32) for name in ("gravity_force", "coriolis_force")
        }
        self.tau = wp.zeros(nv, dtype=wp.float32)

    def call(self, task: str, state: State) -> Call:
        its, model, s = self.coordinates, self.model, self.state
        q, v, tau, a = (wp.array((its.P @ x).astype(np.float32)) for x in state[:4])

        def place():
            wp.copy(s.joint_q, q)
            wp.copy(s.joint_qd, v)
            newton.eval_fk(model, s.joint_q, s.joint_qd, s)

        def mass():
            place()
            newton.eval_inverse_dynamics_passive(model, s, mass_matrix=self.M)
            return self.M.numpy()[0]

        def inverse():
            return np.linalg.inv(mass())

        def terms():
            place()
            newton.eval_inverse_dynamics_passive(model, s, mass_matrix=self.M, **self.forces)

        def acceleration():
            terms()
            bias = sum(force.numpy() for force in self.forces.values())
            return np.linalg.solve(self.M.numpy()[0], tau.numpy() - bias)

        def inverse_dynamics():
            terms()
            known = {"mass_matrix": self.M, "joint_qdd": a, **self.forces}
            newton.eval_inverse_dynamics_force(model, s, **known, joint_f=self.tau)
            return self.tau.numpy()

        return Call(locals()[task], lambda x: its.read(task, state, np.array(x)))
