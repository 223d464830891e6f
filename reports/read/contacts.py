"""The records of `contacts`: answers of (M + JᵀDJ)⁻¹b of robots that stand."""

from typing import NamedTuple

from read.values import Count, Maybe, Name, Positive, Precision, SceneName, Size, record

COLUMNS = "scene,n,rows,stiffness,precision,variant,state,status,warns,error,kS".split(",")


@record
class ContactError(NamedTuple):
    """Of one answer; None where there is none."""

    scene: SceneName
    rows: Count  # of J
    stiffness: Positive  # kg
    precision: Precision
    variant: Name
    state: Count
    status: str
    warns: bool
    error: Maybe[Size]
    kS: Maybe[Size]  # of the problem; None where it has no answer
