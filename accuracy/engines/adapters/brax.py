"""Brax's generalized pipeline, in JAX's two precisions."""

import numpy as np

from by_jax import Compiled, jax, set_precision
from protocol import Call, Engine, Mechanism, State, Unsupported

# Brax looks at the first geom, whatever it is.
GEOM = '<worldbody>\n    <geom size="0.1" mass="0" contype="0" conaffinity="0"/>'


class Adapter(Engine):
    name = "Brax"
    package = "brax"
    precisions = ("float32", "float64")
    calls = {
        "mass": "generalized.pipeline.init, mass_mx",
        "inverse": "generalized.pipeline.init, mass_mx_inv",
        "acceleration": "pipeline.init, mass_mx_inv times dynamics.forward",
        "inverse_dynamics": "pipeline.init, mass_mx times accelerations, dynamics.inverse",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        set_precision(precision)
        from brax.generalized import dynamics, pipeline
        from brax.io import mjcf

        if mechanism.floats:
            raise Unsupported("the velocity of a free joint is told in no manual")
        try:
            text = mechanism.mjcf.read_text().replace("<worldbody>", GEOM)
            system = mjcf.loads(text)
        except (RuntimeError, NotImplementedError) as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        zero = jax.numpy.zeros(mechanism.nv)

        def acceleration(q, v, tau):
            state = pipeline.init(system, q, v)
            return state.mass_mx_inv @ dynamics.forward(system, state, tau)

        def inverse_dynamics(q, v, a):
            state = pipeline.init(system, q, v)
            return state.mass_mx @ a + dynamics.inverse(system, state)

        self.compiled = Compiled(
            {
                "mass": lambda q: pipeline.init(system, q, zero).mass_mx,
                "inverse": lambda q: pipeline.init(system, q, zero).mass_mx_inv,
                "acceleration": acceleration,
                "inverse_dynamics": inverse_dynamics,
            }
        )

    def arguments(self, task: str, state: State) -> tuple:
        rest = {"acceleration": (state.v, state.tau), "inverse_dynamics": (state.v, state.a)}
        return state.q, *rest.get(task, ())

    def call(self, task: str, state: State) -> Call:
        run = self.compiled.run(task, *self.arguments(task, state))
        return Call(run, lambda x: np.array(x, dtype=np.float64))

    def batch(self, states: list[State]):
        each = [self.arguments("acceleration", state) for state in states]
        return self.compiled.batch("acceleration", [np.stack(x) for x in zip(*each, strict=True)])
