"""The records of `contacts`: answers of (M + JᵀDJ)⁻¹b of robots that stand."""

from typing import NamedTuple

from read.stress import U
from read.values import count_in, number_in

COLUMNS = "scene,n,rows,stiffness,precision,variant,state,status,warns,error,kS".split(",")


class ContactError(NamedTuple):
    """Of one answer; None where there is none."""

    scene: str
    rows: int  # of J
    stiffness: float  # kg
    precision: str
    variant: str
    state: int
    status: str
    warns: bool
    error: float | None
    kS: float | None  # of the problem; None where it has no answer


def error(row: dict) -> ContactError:
    if row["precision"] not in U or not row["variant"] or row["warns"] not in ("0", "1"):
        raise ValueError(
            f"'{row['variant']}' in '{row['precision']}' that warns '{row['warns']}' times"
        )
    count_in(row, "n")
    stiffness = number_in(row, "stiffness", 0)
    if stiffness == 0:
        raise ValueError("stiffness is 0")
    return ContactError(
        row["scene"],
        count_in(row, "rows"),
        stiffness,
        row["precision"],
        row["variant"],
        count_in(row, "state"),
        row["status"],
        row["warns"] == "1",
        number_in(row, "error", 0) if row["error"] else None,
        number_in(row, "kS", 0) if row["kS"] else None,
    )
