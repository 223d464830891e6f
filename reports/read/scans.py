"""The records of `scans`: errors of the filter as a scan, and its flops, by size of blocks."""

from typing import NamedTuple

from read.stress import U
from read.values import count_in, number_in

ORDERS = ("", "balanced", "tips_first", "base_first")  # none of a variant without blocks
TASKS = ("factor", "acceleration")  # whose flops are counted
ANY = 0  # processors: any number of them


class ScanError(NamedTuple):
    """Of one acceleration; None where there is none."""

    family: str
    value: float
    n: int
    seed: int
    precision: str
    task: str
    variant: str
    links: int  # of a block; 0 of a variant without blocks
    order: str  # in which blocks are combined
    status: str
    error: float | None


class ScanFlops(NamedTuple):
    """One after another on so many processors."""

    family: str
    value: float
    n: int
    seed: int
    task: str
    variant: str
    links: int
    processors: int
    flops: float


ERRORS = (
    "family,value,n,seed,precision,task,variant,links,order,depth,forgetting,status,error"
).split(",")
FLOPS = "family,value,n,seed,task,variant,links,depth,processors,flops".split(",")


def _begin(row: dict) -> tuple[str, float, int, int]:
    if not row["family"] or not row["variant"]:
        raise ValueError(f"no family '{row['family']}' by variant '{row['variant']}'")
    n = count_in(row, "n")
    if n == 0:
        raise ValueError("n is 0")
    count_in(row, "depth")
    return row["family"], number_in(row, "value"), n, count_in(row, "seed")


def error(row: dict) -> ScanError:
    if row["precision"] not in U or row["order"] not in ORDERS:
        raise ValueError(f"no scan in {row['precision']} and in order '{row['order']}'")
    number_in(row, "forgetting", 0)
    return ScanError(
        *_begin(row),
        row["precision"],
        row["task"],
        row["variant"],
        count_in(row, "links"),
        row["order"],
        row["status"],
        number_in(row, "error", 0) if row["error"] else None,
    )


def flops(row: dict) -> ScanFlops:
    if row["task"] not in TASKS:
        raise ValueError(f"task '{row['task']}' is none of {', '.join(TASKS)}")
    counted = number_in(row, "flops", 0)
    if counted == 0:
        raise ValueError(f"flops is {row['flops']}")
    return ScanFlops(
        *_begin(row),
        row["task"],
        row["variant"],
        count_in(row, "links"),
        count_in(row, "processors"),
        counted,
    )
