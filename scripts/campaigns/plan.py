"""What a campaign measures, unit by unit: made once, and the same whoever works at it later."""

import hashlib
import json
import math
import resource
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from campaign import Range
from campaign_files import checked_key, parse_name, read
from checks import read_json, refusing
from data import DataError
from output import write
from values import text

FORMAT = "kalmarm plan"
FEWEST = 16  # units, so that a short campaign is divided too
PROBED = 2.0  # CPU seconds, beside which the start of a program is small


@dataclass(frozen=True)
class Plan:
    program: str  # SHA-1 of the worker's file
    key: dict  # of every unit that it writes, by its own account
    options: list[str]  # that it is given beside the unit
    units: list[Range]
    rows: bool  # whether all rows are kept too

    def write(self, path: Path) -> None:
        document = {"format": FORMAT, "version": 1, "program": self.program, "key": self.key}
        document |= {"options": self.options, "rows": self.rows, "units": [unit.name for unit in self.units]}
        write(path, json.dumps(document, indent=1) + "\n")

    @staticmethod
    def read(path: Path) -> "Plan":
        document = read_json(path)
        with refusing(path, "a plan"):
            if (document["format"], document["version"]) != (FORMAT, 1):
                raise ValueError(f"format is {document['format']!r} {document['version']!r}")
            units = [parse_name(name) for name in document["units"]]
            if not units:
                raise ValueError("it has no unit")
            if not isinstance(document["rows"], bool):
                raise ValueError(f"rows is {document['rows']!r}")
            options = [*map(text, document["options"])]
            key = checked_key(document["key"])
            return Plan(text(document["program"]), key, options, units, document["rows"])


def file_name(unit: Range) -> str:
    """A name without folders."""
    return unit.name.replace("/", "_") + ".json"


def sha1(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha1").hexdigest()
    except OSError as error:
        raise DataError(f"{file}: {error.strerror}") from None


def divided(family: str, value: float, first: int, mechanisms: int, most: int) -> list[Range]:
    """Into units of one size, at most `most` mechanisms each; the last may be smaller."""
    units = math.ceil(mechanisms / most)
    size = math.ceil(mechanisms / units)
    starts = range(0, mechanisms, size)
    return [Range(family, value, first + at, min(size, mechanisms - at)) for at in starts]


def probed(worker: Path, options: list[str], first: Range, timed: bool) -> tuple[dict, float]:
    """The key of the worker's units, and if `timed` the CPU seconds that a mechanism takes."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "probe.json"
        while True:
            began = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [worker, f"--unit={first.name}", *options, f"--out={out}"]
            done = subprocess.run(command, check=False, capture_output=True, text=True)
            if done.returncode:
                raise DataError(f"{first.name}: {last_line(done.stderr)}")
            ended = resource.getrusage(resource.RUSAGE_CHILDREN)
            took = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
            if not timed or took >= PROBED or first.count >= 1 << 20:
                return read(out).key, max(took, 1e-3) / first.count
            first = first._replace(count=4 * first.count)


def last_line(output: str) -> str:
    """Of what a program printed: its error line, or else its last one."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error: " in line]
    return (errors or lines or ["nothing was printed"])[-1]
