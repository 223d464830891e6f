"""The records of `trajectories`: simulated motions of stiff joints."""

from typing import Annotated, Literal, NamedTuple

from read.values import (
    Count,
    Maybe,
    Name,
    Positive,
    Precision,
    SceneName,
    Size,
    at,
    reading,
    record,
)

NO_TRUTH = "no_truth"
COLUMNS = (
    "robot,nv,seed,T,stiffness,damping_ratio,damping,integrator,precision,dynamics,h,tolerance,steps,"
    "calls,status,error_q,error_v,seconds_per_second,truth_q,truth_v"
).split(",")


@record
class Case(NamedTuple):
    """A motion; either its damping ratio or its damping is None."""

    robot: SceneName
    seed: Count
    duration: Annotated[Size, at("T")]  # s
    stiffness: Size  # N m/rad or N/m
    damping_ratio: Maybe[Size]
    damping: Maybe[Size]  # N m s/rad or N s/m

    def checked(self) -> "Case":
        if (self.damping_ratio is None) == (self.damping is None):
            raise ValueError("neither damping_ratio nor damping, or both")
        return self

    @property
    def title(self) -> str:
        """But for the robot."""
        ratio, b = self.damping_ratio, self.damping
        damping = f"b = {b:g}" if ratio is None else f"ζ = {ratio:g}"
        mantissa, exponent = f"{self.stiffness:.5e}".split("e")
        stiffness = f"k = {float(mantissa):g}e{int(exponent)}"
        return f"{stiffness}, {damping}, {self.duration:g} s, seed {self.seed}"


@record
class Simulation(NamedTuple):
    """One of a motion, by steps h or by a tolerance; errors and time are None unless it is ok."""

    case: Case
    integrator: Name
    precision: Precision
    dynamics: str  # Kalmarm's, by default or to the last bits; or empty
    h: Maybe[Positive]  # s
    tolerance: Maybe[Positive]
    calls: Count
    status: Literal["ok", "unstable", "given_up"]
    error_q: Maybe[Size]
    error_v: Maybe[Size]
    # of the processor, for a simulated second
    seconds: Annotated[Maybe[Positive], at("seconds_per_second")]
    truth_q: Size  # bounds of the truth's own errors
    truth_v: Size

    def checked(self) -> "Simulation":
        if (self.h is None) == (self.tolerance is None):
            raise ValueError("neither h nor tolerance, or both")
        measured = (self.error_q, self.error_v, self.seconds)
        if any((value is None) == (self.status == "ok") for value in measured):
            raise ValueError(f"errors and time of a simulation that is {self.status}")
        return self

    @property
    def variant(self) -> str:
        return self.integrator + ("<last bits>" if self.dynamics == "last_bits" else "")

    @property
    def error(self) -> float | None:
        return None if self.error_q is None else max(self.error_q, self.error_v)

    @property
    def truth(self) -> float:
        return max(self.truth_q, self.truth_v)


_case, _simulation = reading(Case, strict=False), reading(Simulation, strict=False)


def motion(row: dict) -> Simulation | Case:
    """A simulation, or a motion that has no truth."""
    return _case(row) if row["status"] == NO_TRUTH else _simulation(row | {"case": row})


def told_apart(motion: Simulation | Case) -> tuple:
    return motion if isinstance(motion, Case) else (*motion.case, *motion[1:6])
