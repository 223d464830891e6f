"""The records of `trajectories`: simulated motions of stiff joints."""

from typing import NamedTuple

from read.values import count_in, number_in

STATUSES = ("ok", "unstable", "given_up")
NO_TRUTH = "no_truth"
PRECISIONS = ("float32", "float64")


class Case(NamedTuple):
    """A motion; either its damping ratio or its damping is None."""

    robot: str
    seed: int
    duration: float  # s
    stiffness: float  # N m/rad or N/m
    damping_ratio: float | None
    damping: float | None  # N m s/rad or N s/m

    @property
    def title(self) -> str:
        """But for the robot."""
        ratio, b = self.damping_ratio, self.damping
        damping = f"b = {b:g}" if ratio is None else f"ζ = {ratio:g}"
        mantissa, exponent = f"{self.stiffness:.5e}".split("e")
        stiffness = f"k = {float(mantissa):g}e{int(exponent)}"
        return f"{stiffness}, {damping}, {self.duration:g} s, seed {self.seed}"


class Simulation(NamedTuple):
    """One of a motion, by steps h or by a tolerance; errors and time are None unless it is ok."""

    case: Case
    integrator: str
    precision: str
    dynamics: str  # Kalmarm's, by default or to the last bits; or empty
    h: float | None  # s
    tolerance: float | None
    calls: int
    status: str
    error_q: float | None
    error_v: float | None
    seconds: float | None  # of the processor, for a simulated second
    truth: float  # bound of the truth's own error, of q and v

    @property
    def variant(self) -> str:
        return self.integrator + ("<last bits>" if self.dynamics == "last_bits" else "")

    @property
    def error(self) -> float | None:
        return None if self.error_q is None else max(self.error_q, self.error_v)


COLUMNS = (
    "robot,nv,seed,T,stiffness,damping_ratio,damping,integrator,precision,dynamics,h,tolerance,steps,"
    "calls,status,error_q,error_v,seconds_per_second,truth_q,truth_v"
).split(",")


def _maybe(row: dict, name: str, least: float = 0) -> float | None:
    return number_in(row, name, least) if row[name] else None


def _positive(row: dict, name: str) -> float | None:
    value = _maybe(row, name)
    if value == 0:
        raise ValueError(f"{name} is {row[name]}")
    return value


def motion(row: dict) -> Simulation | Case:
    """A simulation, or a motion that has no truth."""
    case = Case(
        row["robot"],
        count_in(row, "seed"),
        number_in(row, "T", 0),
        number_in(row, "stiffness", 0),
        _maybe(row, "damping_ratio"),
        _maybe(row, "damping"),
    )
    if (case.damping_ratio is None) == (case.damping is None):
        raise ValueError("neither damping_ratio nor damping, or both")
    if row["status"] == NO_TRUTH:
        return case
    simulation = Simulation(
        case,
        row["integrator"],
        row["precision"],
        row["dynamics"],
        _positive(row, "h"),
        _positive(row, "tolerance"),
        count_in(row, "calls"),
        row["status"],
        _maybe(row, "error_q"),
        _maybe(row, "error_v"),
        _positive(row, "seconds_per_second"),
        max(number_in(row, "truth_q", 0), number_in(row, "truth_v", 0)),
    )
    if not simulation.integrator or simulation.precision not in PRECISIONS:
        raise ValueError(f"no integrator '{simulation.integrator}' in {simulation.precision}")
    if simulation.status not in STATUSES:
        raise ValueError(f"status '{simulation.status}' is none of {', '.join(STATUSES)}")
    if (simulation.h is None) == (simulation.tolerance is None):
        raise ValueError("neither h nor tolerance, or both")
    measured = [simulation.error_q, simulation.error_v, simulation.seconds]
    if any((value is None) == (simulation.status == "ok") for value in measured):
        raise ValueError(f"errors and time of a simulation that is {simulation.status}")
    return simulation
