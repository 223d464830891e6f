"""The records of `scans`: errors of the filter as a scan, and its flops, by size of blocks."""

from typing import Literal, NamedTuple

from read.values import Count, Maybe, Name, Number, Positive, Precision, Size, Whole, record

ANY = 0  # processors: any number of them
ERRORS = (
    "family,value,n,seed,precision,task,variant,links,order,depth,forgetting,status,error"
).split(",")
FLOPS = "family,value,n,seed,task,variant,links,depth,processors,flops".split(",")


@record
class ScanError(NamedTuple):
    """Of one acceleration; None where there is none."""

    family: Name
    value: Number
    n: Whole
    seed: Count
    precision: Precision
    task: str
    variant: Name
    links: Count  # of a block; 0 of a variant without blocks
    order: Literal["", "balanced", "tips_first", "base_first"]  # in which blocks are combined
    status: str
    error: Maybe[Size]


@record
class ScanFlops(NamedTuple):
    """One after another on so many processors."""

    family: Name
    value: Number
    n: Whole
    seed: Count
    task: Literal["factor", "acceleration"]
    variant: Name
    links: Count
    processors: Count
    flops: Positive
