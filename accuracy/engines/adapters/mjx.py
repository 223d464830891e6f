"""MuJoCo MJX, its JAX implementation, on the processor: float32 is JAX's default."""

import mujoco

from by_jax import Compiled, JaxEngine, jax, set_precision
from protocol import Mechanism, State, Unsupported

from mujoco import mjx  # noqa: E402


def placed(model, q):
    m, start = model
    return mjx.fwd_position(m, start.replace(qpos=q))


def mass(model, q):
    return mjx.full_m(model[0], placed(model, q))


def inverse(model, q):
    d = placed(model, q)
    unit = jax.numpy.eye(model[0].nv)
    return jax.vmap(lambda x: mjx._src.smooth.solve_m(model[0], d, x))(unit)


def acceleration(model, q, v, tau):
    m, start = model
    return mjx.forward(m, start.replace(qpos=q, qvel=v, qfrc_applied=tau)).qacc_smooth


def inverse_dynamics(model, q, v, a):
    m, start = model
    return mjx.inverse(m, start.replace(qpos=q, qvel=v, qacc=a)).qfrc_inverse


COMPILED = Compiled(
    {
        "mass": mass,
        "inverse": inverse,
        "acceleration": acceleration,
        "inverse_dynamics": inverse_dynamics,
    }
)


class Adapter(JaxEngine):
    name = "MJX"
    package = "mujoco-mjx"
    precisions = ("float32", "float64")
    compiled = COMPILED
    calls = {
        "mass": "fwd_position, full_m",
        "inverse": "fwd_position, solve_m on the unit vectors",
        "acceleration": "forward, qacc_smooth",
        "inverse_dynamics": "inverse, qfrc_inverse",
        "derivatives": "jax.jacfwd of forward",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        try:
            model = mujoco.MjModel.from_xml_path(str(mechanism.mjcf))
        except ValueError as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        self.model = mjx.put_model(model, impl="jax"), mjx.make_data(model, impl="jax")

    def arguments(self, task: str, state: State) -> tuple:
        if task in ("acceleration", "derivatives"):
            return state.q, state.v, state.tau
        return (state.q, state.v, state.a) if task == "inverse_dynamics" else (state.q,)
