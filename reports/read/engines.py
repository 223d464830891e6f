"""What `scripts/engines` recorded of other engines: errors and times, a row each."""

import math

from read.checks import checked_scene
from read.data import EngineAnswer, EngineTime
from read.values import count_in, number, text

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


def _outcome(row: dict) -> tuple[str, str]:
    """Its word and, behind a colon, the reason."""
    word, _, reason = row["outcome"].partition(":")
    return word, " ".join(reason.split())


def answer(row: dict) -> EngineAnswer:
    word, reason = _outcome(row)
    if word not in OUTCOMES:
        raise ValueError(f"outcome '{row['outcome']}' is none of {', '.join(OUTCOMES)}")
    value = number("value", float(row["value"]), 0) if word in ANSWERED else None
    if value is None and not math.isnan(float(row["value"])):
        raise ValueError(f"value {row['value']} of an answer that is {word}")
    return EngineAnswer(
        checked_scene(row["scene"]),
        text(row["variant"]),
        row["precision"],
        row["task"],
        count_in(row, "batch"),
        count_in(row, "state"),
        row["measure"],
        value,
        word,
        reason,
    )


def time(row: dict) -> EngineTime:
    known = row["outcome"] == OK

    def of(name: str) -> float | None:
        return number(name, float(row[name]), 0) if known else None

    def told(name: str) -> float | None:
        """What was published may leave out."""
        return None if math.isnan(float(row[name])) else of(name)

    return EngineTime(
        checked_scene(row["scene"]),
        text(row["variant"]),
        row["precision"],
        row["task"],
        count_in(row, "batch"),
        row["engine"],
        row["version"],
        of("nanoseconds"),
        of("with_copies"),
        told("variation"),
        told("first_call"),
        row["cpu"],
        "" if known else row["outcome"],
    )
