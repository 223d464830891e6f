"""Brax's generalized pipeline, in JAX's two precisions."""

from by_jax import Compiled, JaxEngine, jax, set_precision
from protocol import Mechanism, State, Unsupported

# Brax looks at the first geom, whatever it is.
GEOM = '<worldbody>\n    <geom size="0.1" mass="0" contype="0" conaffinity="0"/>'


def compiled() -> Compiled:
    """Brax makes arrays when it is imported."""
    from brax.generalized import dynamics, pipeline

    def at_rest(system, q):
        return pipeline.init(system, q, jax.numpy.zeros_like(q))

    def acceleration(system, q, v, tau):
        state = pipeline.init(system, q, v)
        return state.mass_mx_inv @ dynamics.forward(system, state, tau)

    def inverse_dynamics(system, q, v, a):
        state = pipeline.init(system, q, v)
        return state.mass_mx @ a + dynamics.inverse(system, state)

    return Compiled(
        {
            "mass": lambda system, q: at_rest(system, q).mass_mx,
            "inverse": lambda system, q: at_rest(system, q).mass_mx_inv,
            "acceleration": acceleration,
            "inverse_dynamics": inverse_dynamics,
        }
    )


class Adapter(JaxEngine):
    name = "Brax"
    package = "brax"
    precisions = ("float32", "float64")
    calls = {
        "mass": "generalized.pipeline.init, mass_mx",
        "inverse": "generalized.pipeline.init, mass_mx_inv",
        "acceleration": "pipeline.init, mass_mx_inv times dynamics.forward",
        "inverse_dynamics": "pipeline.init, mass_mx times accelerations, dynamics.inverse",
        "derivatives": "jax.jacfwd of the acceleration",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        from brax.io import mjcf

        if mechanism.floats:
            raise Unsupported("the velocity of a free joint is told in no manual")
        try:
            text = mechanism.mjcf.read_text().replace("<worldbody>", GEOM)
            self.model = mjcf.loads(text)
        except (RuntimeError, NotImplementedError) as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        if "compiled" not in Adapter.__dict__:
            Adapter.compiled = compiled()

    def arguments(self, task: str, state: State) -> tuple:
        if task in ("acceleration", "derivatives"):
            return state.q, state.v, state.tau
        return (state.q, state.v, state.a) if task == "inverse_dynamics" else (state.q,)
