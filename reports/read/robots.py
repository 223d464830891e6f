"""What `scripts/campaign robots` found of each robot, a stress a row."""

from read.checks import checked_scene
from read.data import Kept
from read.values import count_in, number_in

COLUMNS = "name,robot,variant,precision,digits,stress,unit,kept,last,silent,refused".split(",")


def kept(row: dict) -> Kept:
    if not row["name"]:
        raise ValueError("name is empty")
    if refused := " ".join(row["refused"].split()):
        return Kept(row["name"], "", "", "", "", None, False, 0, refused)
    promise = ""
    if row["digits"]:
        promise = f"{row['variant']}, {row['precision']}: {count_in(row, 'digits')} digits"
    value = number_in(row, "kept") if row["kept"] else None
    whole = value is not None and value == number_in(row, "last")
    robot, silent = checked_scene(row["robot"]), count_in(row, "silent")
    return Kept(row["name"], robot, promise, row["stress"], row["unit"], value, whole, silent)
