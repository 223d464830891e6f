"""The records of `identify`, fits of inertial parameters, and what is checked of them."""

from typing import NamedTuple

from read.values import count, number, optional, text


class Iteration(NamedTuple):
    seconds: float
    error: float | None  # of the base parameters; None where the truth is not known


class BaseParameter(NamedTuple):
    """A combination of parameters that the data see, with its 95 % interval."""

    name: str
    unit: float  # the size against which errors are measured
    fitted: float
    low: float
    high: float
    true: float | None

    @property
    def holds_truth(self) -> bool:
        return self.true is not None and self.low <= self.true <= self.high


class Prediction(NamedTuple):
    """Torques of one joint over samples that were held out."""

    joint: str
    time: list[float]
    measured: list[float]
    fitted: list[float]
    start: list[float]


class Identification(NamedTuple):
    """One fit; what follows `iterations` is empty or None where the solver failed."""

    scene: str
    residual: str
    jacobian: str
    noise: float | None  # of simulated torques, over their size; None: the data were measured
    samples: int
    held_out: int
    usable: bool
    seconds: float
    parameters: int
    warnings: list[str]
    iterations: list[Iteration]
    rank: int | None
    condition: float | None
    unseen: list[str]
    lost: list[str]
    error: float | None  # largest, of the base parameters; None where the truth is not known
    error_of_start: float | None
    nrmse: float | None  # of held-out torques
    nrmse_of_start: float | None
    smallest_eigenvalue: float | None  # of all pseudo-inertias
    base_parameters: list[BaseParameter]
    predictions: list[Prediction]

    @property
    def title(self) -> str:
        noise = f", {100 * self.noise:g} % noise" if self.noise else ""
        return f"{self.scene}, {self.residual}{noise}"


def identification(record: dict) -> Identification:
    """Of a document of `identify`. Raises ValueError, KeyError or TypeError on what is none."""
    base = [_base_parameter(entry) for entry in record.get("base_parameters", [])]
    nrmse = record.get("torque_nrmse", {})
    bodies = record.get("pseudo_inertia", [])
    eigenvalues = [number("smallest_eigenvalue", body["smallest_eigenvalue"]) for body in bodies]
    return Identification(
        text(record["robot"]),
        text(record["residual"]),
        text(record["jacobian"]),
        optional("noise", record.get("noise")),
        count("samples", record["samples"]),
        count("held_out", record["held_out"]),
        bool(record["usable"]),
        number("seconds", record["seconds"]),
        len(record["columns"]),
        [text(warning) for warning in record["warnings"]],
        [
            Iteration(
                number("seconds", entry["seconds"]),
                optional("base_error", entry.get("base_error")),
            )
            for entry in record["iterations"]
        ],
        count("rank", record["rank"]) if "rank" in record else None,
        optional("condition", record.get("condition")),
        [text(name) for name in record.get("unseen", [])],
        [text(name) for name in record.get("lost", [])],
        optional("base_error", record.get("base_error")),
        optional("base_error_of_start", record.get("base_error_of_start")),
        optional("fitted", nrmse.get("fitted")),
        optional("start", nrmse.get("start")),
        min(eigenvalues, default=None),
        base,
        _predictions(record.get("prediction", {"time": [], "joints": []})),
    )


def _base_parameter(entry: dict) -> BaseParameter:
    numbers = [number(name, entry[name]) for name in ("unit", "fitted", "low", "high")]
    parameter = BaseParameter(text(entry["name"]), *numbers, optional("true", entry.get("true")))
    if not (parameter.unit > 0 and parameter.low <= parameter.fitted <= parameter.high):
        raise ValueError(f"{parameter.name} is {parameter.fitted}, {numbers[2:]}")
    return parameter


def _predictions(record: dict) -> list[Prediction]:
    time = [number("time", value) for value in record["time"]]
    out = []
    for joint in record["joints"]:
        torques = [
            [number(name, x) for x in joint[name]] for name in ("measured", "fitted", "start")
        ]
        if any(len(torque) != len(time) for torque in torques):
            raise ValueError(f"torques of {joint['name']} are not {len(time)}")
        out.append(Prediction(text(joint["name"]), time, *torques))
    return out
