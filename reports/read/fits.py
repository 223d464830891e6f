"""The records of `identify`, fits of inertial parameters, and what is checked of them."""

from typing import Annotated, NamedTuple

from pydantic import AfterValidator

from read.values import Count, Number, Positive, SceneName, at, record


@record
class Iteration(NamedTuple):
    seconds: Number
    # of the base parameters; None where the truth is not known
    error: Annotated[Number | None, at("base_error")] = None


@record
class BaseParameter(NamedTuple):
    """A combination of parameters that the data see, with its 95 % interval."""

    name: str
    unit: Positive  # the size against which errors are measured
    fitted: Number
    low: Number
    high: Number
    true: Number | None = None

    @property
    def holds_truth(self) -> bool:
        return self.true is not None and self.low <= self.true <= self.high

    def checked(self) -> "BaseParameter":
        if not self.low <= self.fitted <= self.high:
            raise ValueError(f"{self.name} is {self.fitted}, not in {self.low} to {self.high}")
        return self


@record
class Prediction(NamedTuple):
    """Torques of one joint over samples that were held out."""

    joint: Annotated[str, at("name")]
    time: Annotated[list[Number], at("time", default=[])]  # of all joints
    measured: list[Number]
    fitted: list[Number]
    start: list[Number]


@record
class HeldOut(NamedTuple):
    """Becomes predictions, each with the time of all."""

    time: list[Number]
    joints: list[Prediction]

    def checked(self) -> list[Prediction]:
        for joint, _, *torques in self.joints:
            if any(len(torque) != len(self.time) for torque in torques):
                raise ValueError(f"torques of {joint} are not {len(self.time)}")
        return [joint._replace(time=self.time) for joint in self.joints]


@record
class Inertia(NamedTuple):
    smallest_eigenvalue: Number


def _smallest(bodies: list[Inertia]) -> float | None:
    return min((body.smallest_eigenvalue for body in bodies), default=None)


@record
class Identification(NamedTuple):
    """One fit; what follows `iterations` is empty or None where the solver failed."""

    scene: Annotated[SceneName, at("robot")]
    residual: str
    jacobian: str
    # of simulated torques, over their size; None: the data were measured
    noise: Annotated[Number | None, at("noise", default=None)]
    samples: Count
    held_out: Count
    usable: bool
    seconds: Number
    parameters: Annotated[list[str], at("columns"), AfterValidator(len)]  # how many
    warnings: list[str]
    iterations: list[Iteration]
    rank: Count | None = None
    condition: Number | None = None
    unseen: list[str] = []
    lost: list[str] = []
    # largest, of the base parameters; None where the truth is not known
    error: Annotated[Number | None, at("base_error")] = None
    error_of_start: Annotated[Number | None, at("base_error_of_start")] = None
    nrmse: Annotated[Number | None, at("torque_nrmse", "fitted")] = None  # of held-out torques
    nrmse_of_start: Annotated[Number | None, at("torque_nrmse", "start")] = None
    smallest_eigenvalue: Annotated[  # of all pseudo-inertias
        list[Inertia], at("pseudo_inertia"), AfterValidator(_smallest)
    ] = None
    base_parameters: list[BaseParameter] = []
    predictions: Annotated[HeldOut, at("prediction")] = []

    @property
    def title(self) -> str:
        noise = f", {100 * self.noise:g} % noise" if self.noise else ""
        return f"{self.scene}, {self.residual}{noise}"
