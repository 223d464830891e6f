"""An engine of tests: right but for what the variant says, and in the last state alone."""

import os
import time

import numpy as np

from protocol import TASKS, Call, Engine, Mechanism, Refused, State, Unsupported


class Adapter(Engine):
    name = "Unruly"
    package = "numpy"
    variants = {
        how: {"how": how}
        for how in "good nan crash hang raise refuse warn cannot dies prints wrong rows lies".split()
    }
    precisions = ("float32", "float64")
    warning = RuntimeWarning
    calls = dict.fromkeys(TASKS, "itself")

    def __init__(self, mechanism: Mechanism, precision: str, how: str):
        self.how = how
        self.last = mechanism.states(True)[-1]
        if how == "cannot":
            raise Unsupported("no such joint, here")
        if how == "dies":
            os.abort()

    def call(self, task: str, state: State) -> Call:
        def run():
            if task != "acceleration" or (state.q != self.last.q).any():
                return state.truth[task]
            if self.how == "nan":
                return np.nan * state.truth[task]
            if self.how == "crash":
                os.abort()
            if self.how == "hang":
                time.sleep(60)
            if self.how == "raise":
                raise ZeroDivisionError("by zero\nand more")
            if self.how == "refuse":
                raise Refused("singular")
            if self.how == "warn":
                np.float32(3e38) * np.float32(10)
            if self.how == "wrong":
                return 1.01 * state.truth[task]
            if self.how == "prints":
                print("{not a record")
            if self.how == "lies":
                return np.float32(state.truth[task]).astype(np.float64)
            return state.truth[task]

        return Call(run, lambda x: x)

    def batch(self, states: list[State]) -> Call:
        wrong = 1.01 if self.how == "rows" else 1.0
        rows = np.array([wrong * state.truth["acceleration"] for state in states])
        return Call(lambda: rows, lambda x: x)
