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
from campaign_files import parse_name
from checks import read_json, refusing
from data import DataError
from output import write
from values import text

FORMAT = "kalmarm plan"
FEWEST = 16  # units, so that a short campaign is divided too
PROBED = 2.0  # CPU seconds, beside which the start of a program is small


@dataclass(frozen=True)
class Plan:
    program: str  # SHA-1 of the worker
    options: list[str]  # that it is given beside the unit
    units: list[Range]

    def document(self) -> dict:
        names = [unit.name for unit in self.units]
        own = {"program": self.program, "options": self.options, "units": names}
        return {"format": FORMAT, "version": 1, **own}

    def write(self, path: Path) -> None:
        write(path, json.dumps(self.document(), indent=1) + "\n")

    @staticmethod
    def read(path: Path) -> "Plan":
        document = read_json(path)
        with refusing(path, "a plan"):
            if (document["format"], document["version"]) != (FORMAT, 1):
                raise ValueError(f"format is {document['format']!r} {document['version']!r}")
            units = [parse_name(name) for name in document["units"]]
            return Plan(text(document["program"]), [*map(text, document["options"])], units)


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


def seconds_each(worker: Path, options: list[str], family: str, value: float) -> float:
    """CPU seconds that a mechanism takes, measured on ever more of them."""
    count = 16
    with tempfile.TemporaryDirectory() as folder:
        while True:
            probe = Range(family, value, 1, count)
            began = resource.getrusage(resource.RUSAGE_CHILDREN)
            out = Path(folder) / "probe.json"
            command = [worker, f"--unit={probe.name}", *options, f"--out={out}"]
            done = subprocess.run(command, check=False, capture_output=True, text=True)
            if done.returncode:
                raise DataError(f"{probe.name}: {last_line(done.stderr)}")
            ended = resource.getrusage(resource.RUSAGE_CHILDREN)
            took = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
            if took >= PROBED or count >= 1 << 20:
                return max(took, 1e-3) / count
            count *= 4


def last_line(output: str) -> str:
    """Of what a program printed: its error line, or else its last one."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error: " in line]
    return (errors or lines or ["nothing was printed"])[-1]
