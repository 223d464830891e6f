"""The records of engines: errors-engines-*.csv and times-engines-*.csv (docs/data-formats.md)."""

import csv
import os
from pathlib import Path

ERRORS = "scene,n,variant,precision,task,batch,state,measure,value,outcome".split(",")
TIMES = (
    "scene,n,engine,variant,version,precision,task,batch,nanoseconds,with_copies,variation,"
    "repetitions,first_call,cpu,outcome"
).split(",")


def number(value: float | None) -> str:
    return "nan" if value is None else f"{value:.17g}"


def write(path: Path, columns: list[str], rows: list[list]) -> None:
    """The whole file, or none."""
    part = path.with_name(path.name + ".part")
    with part.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(columns)
        lines.writerows(rows)
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)
