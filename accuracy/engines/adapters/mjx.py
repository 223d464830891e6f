"""MuJoCo MJX, its JAX implementation, on the processor: float32 is JAX's default."""

import mujoco
import numpy as np

from by_jax import Compiled, jax, set_precision
from protocol import Call, Engine, Mechanism, State, Unsupported

from mujoco import mjx  # noqa: E402


class Adapter(Engine):
    name = "MJX"
    package = "mujoco-mjx"
    precisions = ("float32", "float64")
    calls = {
        "mass": "fwd_position, full_m",
        "inverse": "fwd_position, solve_m on the unit vectors",
        "acceleration": "forward, qacc_smooth",
        "inverse_dynamics": "inverse, qfrc_inverse",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        try:
            model = mujoco.MjModel.from_xml_path(str(mechanism.mjcf))
        except ValueError as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        m, start = mjx.put_model(model, impl="jax"), mjx.make_data(model, impl="jax")
        unit = jax.numpy.eye(mechanism.nv)

        def placed(q):
            return mjx.fwd_position(m, start.replace(qpos=q))

        def acceleration(q, v, tau):
            return mjx.forward(m, start.replace(qpos=q, qvel=v, qfrc_applied=tau)).qacc_smooth

        def inverse(q):
            d = placed(q)
            return jax.vmap(lambda x: mjx._src.smooth.solve_m(m, d, x))(unit)

        def inverse_dynamics(q, v, a):
            return mjx.inverse(m, start.replace(qpos=q, qvel=v, qacc=a)).qfrc_inverse

        self.compiled = Compiled(
            {
                "mass": lambda q: mjx.full_m(m, placed(q)),
                "inverse": inverse,
                "acceleration": acceleration,
                "inverse_dynamics": inverse_dynamics,
            }
        )

    def call(self, task: str, state: State) -> Call:
        arguments = {
            "acceleration": (state.q, state.v, state.tau),
            "inverse_dynamics": (state.q, state.v, state.a),
        }.get(task, (state.q,))
        return Call(self.compiled.run(task, *arguments), lambda x: np.array(x, dtype=np.float64))

    def batch(self, states: list[State]):
        return self.compiled.batch(
            "acceleration",
            [np.stack(x) for x in zip(*(state[:3] for state in states), strict=True)],
        )
