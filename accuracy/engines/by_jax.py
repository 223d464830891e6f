"""What adapters of JAX engines share. JAX must be told its precision before it makes an array."""

import os

# Of the processor alone: an accelerator that JAX found would have other roundings and times.
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax  # noqa: E402
import numpy as np  # noqa: E402


def set_precision(precision: str) -> None:
    jax.config.update("jax_enable_x64", precision == "float64")


class Compiled:
    """Functions by task, compiled once each; a call ends when its result is there."""

    def __init__(self, functions: dict):
        self.functions = {task: jax.jit(function) for task, function in functions.items()}

    def run(self, task: str, *arguments):
        function = self.functions[task]
        arguments = [
            jax.numpy.asarray(np.asarray(x)) for x in arguments
        ]  # in the precision that is set
        return lambda: jax.block_until_ready(function(*arguments))

    def batch(self, task: str, rows: list):
        """`task` of as many states as the arguments have rows."""
        function = jax.jit(jax.vmap(self.functions[task]))
        rows = [jax.numpy.asarray(np.asarray(x)) for x in rows]
        return lambda: jax.block_until_ready(function(*rows))
