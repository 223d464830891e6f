"""What a search for the worst mechanisms has written."""

from read.data import Asked, Find, FoundBody
from read.stress import U
from read.values import count_in, number, number_in

COLUMNS = (
    "variant,precision,task,objective,kernel,rows,seed,method,evaluations,error,kS,nv,file,bodies"
).split(",")
TASKS = ("acceleration", "inverse", "solve", "diagonal", "log_det", "derivatives")
OBJECTIVES = ("error", "claim")
KERNELS = ("spatial", "spatial_at_rest", "translational")
ISLANDS = "islands"  # many searches, which exchange what they find: scripts/campaign adversary
METHODS = ("search", "random", ISLANDS)
JOINTS = ("hinge", "slide", "ball", "free")


def find(row: dict) -> Find:
    if row["precision"] not in U or row["method"] not in METHODS:
        raise ValueError(f"no search by {row['method']} in {row['precision']}")
    asked = Asked(row["task"], row["objective"], row["kernel"], row["rows"] == "1")
    known = asked.task in TASKS and asked.objective in OBJECTIVES and asked.kernel in KERNELS
    if not known or row["rows"] not in ("0", "1"):
        raise ValueError(f"nothing is asked as {' '.join(row[name] for name in COLUMNS[2:6])}")
    error = number_in(row, "error", 0) if row["error"] else None
    if error == 0:
        raise ValueError(f"error is {row['error']}")
    if error is None and row["bodies"]:
        raise ValueError("bodies of nothing that was found")
    return Find(
        row["variant"],
        row["precision"],
        asked,
        int(row["seed"]),
        row["method"],
        count_in(row, "evaluations"),
        error,
        number_in(row, "kS", 0) if row["kS"] else None,
        count_in(row, "nv") if row["nv"] else None,
        _bodies(row["bodies"]),
    )


def _bodies(text: str) -> tuple[FoundBody, ...]:
    bodies = []
    for words in map(str.split, text.split(";") if text else ()):
        if len(words) != len(FoundBody._fields):
            raise ValueError(f"no body is '{' '.join(words)}'")
        parent, joint, *numbers = words
        sizes = [number("a size", float(size), 0) for size in numbers]
        body = FoundBody(int(parent), joint, *sizes)
        if joint not in JOINTS or not 0 <= body.parent <= len(bodies):
            raise ValueError(f"no body is '{' '.join(words)}'")
        bodies.append(body)
    return tuple(bodies)
