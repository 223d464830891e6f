"""Which records the first figure alone shows: of the ladder at other tolerances than those that
are contenders, of one of its rungs alone, errors of rows, and code for one robot."""

import re

from read.data import Call, Data

DEFAULT, LAST_BITS = "Ladder<default>", "Ladder<last_bits>"  # contenders
DEFAULT_TOLERANCE = {"float32": 1e-2, "float64": 1e-8}
LEAST_TOLERANCE = 2.0**-50  # last_bits
GENERATED = "Generated<"
_STEP = re.compile(r"Ladder<(?P<tolerance>[^>@]+)>")


def is_ladder(variant: str) -> bool:
    return variant.startswith(("Ladder<", "Rung<"))


def tolerance(variant: str, precision: str) -> float | None:
    """None: it is a rung alone, or none of the ladder."""
    if variant == DEFAULT:
        return DEFAULT_TOLERANCE[precision]
    if variant == LAST_BITS:
        return LEAST_TOLERANCE
    step = _STEP.fullmatch(variant)
    try:
        return float(step["tolerance"]) if step else None
    except ValueError:
        return None


def set_apart(data: Data) -> None:
    """What other sections would take for contenders goes to lists of its own."""

    def apart(record) -> bool:
        named = is_ladder(record.variant) and "@" not in record.variant
        of_ladder = named and record.variant not in (DEFAULT, LAST_BITS)
        return of_ladder or record.variant.startswith(GENERATED)

    data.ladder_errors = [it for it in data.errors if apart(it) or it.task.endswith("_batch")]
    data.errors = [it for it in data.errors if not (apart(it) or it.task.endswith("_batch"))]
    data.ladder_calls = [Call(it, None, None, None) for it in data.times if apart(it)]
    data.ladder_calls += [it for it in data.dynamics if apart(it.time)] + data.generated
    data.times = [it for it in data.times if not apart(it)]
    data.dynamics = [it for it in data.dynamics if not apart(it.time)]
