"""Kalmarm by its own Python package, by default and to the last bits, in both precisions."""

import warnings

import kalmarm
import numpy as np

from protocol import Call, Engine, Mechanism, Refused, State, Unsupported

WANTS = ("mass", "inverse", "acceleration", "inverse_dynamics", "derivatives")


class Adapter(Engine):
    name = "Kalmarm"
    package = "kalmarm"
    variants = {
        "Kalmarm conventional": {"tolerance": None},
        "Kalmarm certified": {"tolerance": 8.881784197001252e-16},  # kalmarm.last_bits
    }
    precisions = ("float64", "float32")
    warning = RuntimeWarning
    calls = {
        "mass": "Robot.mass_matrix",
        "inverse": "Robot.inverse_mass_matrix",
        "acceleration": "Robot.forward_dynamics",
        "inverse_dynamics": "Robot.inverse_dynamics",
        "derivatives": "Robot.forward_dynamics_derivatives",
    }

    def __init__(self, mechanism: Mechanism, precision: str, tolerance: float | None):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what a file has beyond M and the bias
            try:
                self.robot = kalmarm.load(mechanism.mjcf, tolerance=tolerance, wants=WANTS)
            except kalmarm.LoadError as error:
                raise Unsupported(str(error).splitlines()[0]) from None
        self.dtype = np.dtype(precision)

    def call(self, task: str, state: State) -> Call:
        q, v, tau, a = (x.astype(self.dtype) for x in state[:4])
        function, arguments = {
            "mass": (self.robot.mass_matrix, (q,)),
            "inverse": (self.robot.inverse_mass_matrix, (q,)),
            "acceleration": (self.robot.forward_dynamics, (q, v, tau)),
            "inverse_dynamics": (self.robot.inverse_dynamics, (q, v, a)),
            "derivatives": (self.robot.forward_dynamics_derivatives, (q, v, tau)),
        }[task]

        def run():
            try:
                return function(*arguments)
            except kalmarm.DynamicsError as error:
                raise Refused(str(error)) from None

        if task == "derivatives":
            return Call(run, lambda x: np.hstack([x.dq, x.dqd, x.dtau]).astype(np.float64))
        return Call(run, lambda x: np.array(x, dtype=np.float64))

    def batch(self, states: list[State]):
        rows = [np.stack(x).astype(self.dtype) for x in zip(*(s[:3] for s in states), strict=True)]
        return Call(lambda: self.robot.forward_dynamics(*rows), lambda x: x)
