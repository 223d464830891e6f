"""What adapters of JAX engines share. JAX must be told its precision before it makes an array."""

import os
from pathlib import Path

# Of the processor alone: an accelerator that JAX found would have other roundings and times.
os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax  # noqa: E402
import numpy as np  # noqa: E402

from protocol import Call, Coordinates, Engine, State  # noqa: E402

CACHE = Path(__file__).resolve().parents[2] / "build" / "engines" / "jax-cache"

_saved = 0.0


def _listen(event: str, seconds: float, **_) -> None:
    global _saved
    if event == "/jax/compilation_cache/compile_time_saved_sec":
        _saved += seconds


jax.config.update("jax_compilation_cache_dir", str(CACHE))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)
jax.monitoring.register_event_duration_secs_listener(_listen)


def set_precision(precision: str) -> None:
    """Also for an engine that is imported after it and sets its own."""
    os.environ["JAX_ENABLE_X64"] = str(int(precision == "float64"))
    jax.config.update("jax_enable_x64", precision == "float64")


class Compiled:
    """Functions by task, each of a model and of a state's arguments, which are q, v and tau, in the
    last place, of `acceleration`. A model is an argument: what is compiled for one serves all of
    its structure, in this process and, by the cache, in later ones. An engine whose model is no
    argument has (), and compiles for every mechanism, unless `eager`."""

    def __init__(self, functions: dict):
        self.functions = {**functions, "derivatives": _derivatives(functions["acceleration"])}
        self.one = {task: jax.jit(function) for task, function in self.functions.items()}
        self.many = {}

    def run(self, task: str, model, arguments: tuple, eager: bool) -> tuple:
        """`task` of a state: from arrays of JAX, and from NumPy's to NumPy's."""
        compiled = not (eager and isinstance(model, tuple) and not model)
        function, x = (self.one if compiled else self.functions)[task], _arrays(arguments)
        return (
            lambda: jax.block_until_ready(function(model, *x)),
            lambda: np.asarray(function(model, *_arrays(arguments))),
        )

    def batch(self, task: str, model, states: list[tuple]) -> tuple:
        """`task` of many states at once: from arrays of JAX, and from NumPy's to NumPy's."""
        if task not in self.many:
            function = self.functions[task]
            each = jax.vmap(lambda m, x: function(m, *x), in_axes=(None, 0))
            self.many[task] = jax.jit(each)
        function = self.many[task]
        rows = [np.stack(each) for each in zip(*states, strict=True)]
        x = _arrays(rows)
        return (
            lambda: jax.block_until_ready(function(model, x)),
            lambda: np.asarray(function(model, _arrays(rows))),
        )


def _arrays(arguments) -> tuple:
    """In the precision that is set."""
    return tuple(jax.numpy.asarray(np.asarray(x)) for x in arguments)


def _derivatives(acceleration):
    def derivatives(model, *x):
        count = len(x)
        last = tuple(range(count - 2, count + 1))  # q, v, tau behind the model
        return jax.numpy.hstack(jax.jacfwd(acceleration, argnums=last)(model, *x))

    return derivatives


class JaxEngine(Engine):
    """An engine that is `compiled` functions of a `model`."""

    compiled: Compiled
    model: object = ()
    coordinates: Coordinates | None = None  # None: ours

    def arguments(self, task: str, state: State) -> tuple:
        raise NotImplementedError

    def call(self, task: str, state: State) -> Call:
        its, x = self.coordinates, self.arguments(task, state)
        run, with_copies = self.compiled.run(task, self.model, x, self.eager)
        if not its:
            return Call(run, lambda x: np.array(x, dtype=np.float64), with_copies)
        return Call(run, lambda x: its.read(task, state, np.array(x)), with_copies)

    def batch(self, states: list[State]) -> Call:
        each = [self.arguments("acceleration", state) for state in states]
        resident, with_copies = self.compiled.batch("acceleration", self.model, each)
        its = self.coordinates

        def read(x) -> np.ndarray:
            rows = np.array(x, dtype=np.float64)
            if its:
                pairs = zip(states, rows, strict=True)
                rows = np.stack([its.read("acceleration", state, row) for state, row in pairs])
            return rows

        return Call(resident, read, with_copies)

    def saved(self) -> float:
        return _saved
