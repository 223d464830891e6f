"""MuJoCo Warp on the processor, float32, which is all that it has."""

import os

import mujoco
import numpy as np

from protocol import Call, Engine, Mechanism, State, Unsupported

os.environ.setdefault(
    "WARP_CACHE_PATH", os.path.join(os.path.dirname(__file__), "../../../build/engines/warp-cache")
)

import warp as wp  # noqa: E402

import mujoco_warp as mjw  # noqa: E402


class Adapter(Engine):
    name = "MuJoCo Warp"
    package = "mujoco-warp"
    precisions = ("float32",)
    calls = {
        "mass": "fwd_position, mul_m of the unit vectors",
        "inverse": "fwd_position, solve_m on the unit vectors",
        "acceleration": "forward, qacc_smooth",
        "inverse_dynamics": "inverse, qfrc_inverse",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        wp.config.quiet = True
        wp.set_device("cpu")
        try:
            self.host = mujoco.MjModel.from_xml_path(str(mechanism.mjcf))
        except ValueError as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        self.model = mjw.put_model(self.host)
        self.one = mjw.make_data(self.host)
        self.worlds = mjw.make_data(self.host, nworld=mechanism.nv)  # a unit vector each
        self.unit = wp.array(np.eye(mechanism.nv, dtype=np.float32))
        self.out = wp.zeros((mechanism.nv, mechanism.nv), dtype=wp.float32)

    def call(self, task: str, state: State) -> Call:
        m, d, worlds = self.model, self.one, self.worlds
        q, v, tau, a = (wp.array(x.astype(np.float32)[None]) for x in state[:4])
        many = wp.array(np.tile(state.q.astype(np.float32), (self.host.nv, 1)))

        def acceleration():
            wp.copy(d.qpos, q)
            wp.copy(d.qvel, v)
            wp.copy(d.qfrc_applied, tau)
            mjw.forward(m, d)
            return d.qacc_smooth.numpy()[0]

        def inverse_dynamics():
            wp.copy(d.qpos, q)
            wp.copy(d.qvel, v)
            wp.copy(d.qacc, a)
            mjw.inverse(m, d)
            return d.qfrc_inverse.numpy()[0]

        def mass():
            wp.copy(worlds.qpos, many)
            mjw.fwd_position(m, worlds)
            mjw.mul_m(m, worlds, self.out, self.unit)
            return self.out.numpy()

        def inverse():
            wp.copy(worlds.qpos, many)
            mjw.fwd_position(m, worlds)
            mjw.solve_m(m, worlds, self.out, self.unit)
            return self.out.numpy()

        return Call(locals()[task], lambda x: np.array(x, dtype=np.float64))

    def batch(self, states: list[State]):
        data = mjw.make_data(self.host, nworld=len(states))
        rows = [np.stack(x).astype(np.float32) for x in zip(*(s[:3] for s in states), strict=True)]
        places = (data.qpos, data.qvel, data.qfrc_applied)

        def run(given):
            for place, x in zip(places, given, strict=True):
                wp.copy(place, x)
            mjw.forward(self.model, data)
            wp.synchronize()
            return data.qacc_smooth

        resident = list(map(wp.array, rows))
        return Call(
            lambda: run(resident),
            lambda x: x.numpy().astype(np.float64),
            lambda: run(map(wp.array, rows)).numpy(),
        )
