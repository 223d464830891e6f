"""Robot dynamics by the filters of estimation theory: arrays in, arrays out, float32 or float64.

robot = kalmarm.load("g1.xml")              # or from_mujoco, from_pinocchio, Builder
q, qd, tau = robot.random_state(0, 4096)
a = robot.forward_dynamics(q, qd, tau)      # (4096, nv)
"""

from . import _signatures
from ._core import (
    DynamicsError,
    Factors,
    Frame,
    Model,
    Plan,
    Recommendation,
    __version__,
    instruction_set,
    last_bits,
    outcome_dtype,
)
from .builder import Builder
from .checking import AnswerCheck, Checked, Verdict, check
from .constrained import (
    ConstrainedAcceleration,
    ConstrainedDynamics,
    ConstrainedSolution,
    Constraint,
    Constraints,
    Impulse,
)
from .files import LoadError, from_mujoco, load
from .kinematics import Kinematics
from .loads import payload
from .pinocchio import PinocchioStates, from_pinocchio
from .results import Derivatives, Gradients, OperationalSpace, Outcome, StepGradients
from .robot import Actuator, CoupledRow, Robot, Rung, State, Status, Terms
from .step import ImplicitStep, Stepped

_signatures.install()

__all__ = [
    "Actuator",
    "AnswerCheck",
    "Builder",
    "Checked",
    "ConstrainedAcceleration",
    "ConstrainedDynamics",
    "ConstrainedSolution",
    "Constraint",
    "Constraints",
    "CoupledRow",
    "Derivatives",
    "DynamicsError",
    "Factors",
    "Frame",
    "Gradients",
    "ImplicitStep",
    "Impulse",
    "Kinematics",
    "LoadError",
    "Model",
    "OperationalSpace",
    "Outcome",
    "PinocchioStates",
    "Plan",
    "Recommendation",
    "Robot",
    "Rung",
    "State",
    "Status",
    "StepGradients",
    "Stepped",
    "Terms",
    "Verdict",
    "__version__",
    "check",
    "from_mujoco",
    "from_pinocchio",
    "instruction_set",
    "last_bits",
    "load",
    "outcome_dtype",
    "payload",
]
