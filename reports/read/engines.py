"""What `scripts/engines` recorded of other engines: errors and times, a row each."""

import math
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, BeforeValidator

from read.values import Count, SceneName, Size, at, record

ERRORS = "scene,n,variant,precision,task,batch,state,measure,value,outcome".split(",")
TIMES = (
    "scene,n,engine,variant,version,precision,task,batch,nanoseconds,with_copies,variation,"
    "repetitions,first_call,cpu,outcome"
).split(",")
OK, WARNED, DIFFERS = ANSWERED = ("ok", "warned", "model differs")
NOT_ASKED = ("unsupported", "not asked", "missing")
FAILED = ("not finite", "failed", "crashed", "timed out")
REFUSED = "refused"
OUTCOMES = (*ANSWERED, REFUSED, *NOT_ASKED, *FAILED)

Known = Annotated[Size | None, BeforeValidator(lambda it: None if math.isnan(float(it)) else it)]
Outcome = Annotated[Literal[OUTCOMES], BeforeValidator(lambda cell: cell.partition(":")[0])]
Reason = Annotated[str, AfterValidator(lambda cell: " ".join(cell.partition(":")[2].split()))]
Refusal = Annotated[str, AfterValidator(lambda outcome: "" if outcome == OK else outcome)]


@record
class EngineAnswer(NamedTuple):
    """One answer of an engine, or why there is none."""

    scene: SceneName
    variant: str
    precision: str
    task: str
    batch: Count  # states of a call
    state: Count
    measure: str
    value: Known
    outcome: Outcome
    reason: Annotated[Reason, at("outcome")]

    def checked(self) -> "EngineAnswer":
        if (self.value is None) == (self.outcome in ANSWERED):
            value = "no value" if self.value is None else f"value {self.value}"
            raise ValueError(f"{value} of an answer that is {self.outcome}")
        return self


@record
class EngineTime(NamedTuple):
    """A call of an engine, by the state; None where it was not timed: `refused` says why."""

    scene: SceneName
    variant: str
    precision: str
    task: str
    batch: Count  # states of a call
    engine: str  # that scripts/engines knows; empty: published by others
    version: str
    nanoseconds: Known
    with_copies: Known  # the same from NumPy's arrays to NumPy's, ns
    variation: Known  # what was published may leave it out, and the first call
    first_call: Known  # s
    cpu: str
    refused: Annotated[Refusal, at("outcome")]

    def checked(self) -> "EngineTime":
        if self.refused:
            unknown = ("nanoseconds", "with_copies", "variation", "first_call")
            return self._replace(**dict.fromkeys(unknown))
        if self.nanoseconds is None or self.with_copies is None:
            raise ValueError(f"a call that took {self.nanoseconds} or {self.with_copies} ns")
        return self
