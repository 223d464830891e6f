"""What a campaign's folder is about: made once, and the same whoever works at it later."""

import hashlib
import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

from pydantic import with_config

from page.output import write
from read.checks import read_json, refusing
from read.data import DataError
from read.values import reading

FORMAT = {"format": "kalmarm plan", "version": 1}


@with_config(extra="forbid")
@dataclass(frozen=True)
class Plan:
    program: str  # SHA-1 of what measures, which is the worker's file
    asked: dict  # what a later start must ask for again
    jobs: dict[str, list[str]]  # the worker's options, by the name of the file that it writes
    out: str  # the option that names this file
    rows: bool = False  # whether all rows are kept too
    key: dict | None = None  # of every file, by the worker's own account
    script: str = ""  # beside this file, which runs the worker and writes what it finds
    needs: dict[str, list[str]] = field(default_factory=dict)  # jobs that are done before another

    def write(self, path: Path) -> None:
        write(path, json.dumps(FORMAT | asdict(self), indent=1) + "\n")

    @staticmethod
    def read(path: Path) -> "Plan":
        document = read_json(path)
        with refusing(path, "a plan"):
            if FORMAT.items() - {name: document.pop(name) for name in FORMAT}.items():
                raise ValueError("another format")
            plan = _plan(document)
            if not plan.jobs:
                raise ValueError("no job is there")
            if set(sum(plan.needs.values(), [])) - plan.jobs.keys():
                raise ValueError("a job needs one that is not there")
            return plan


_plan = reading(Plan, strict=False)


def sha1(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha1").hexdigest()
    except OSError as error:
        raise DataError(f"{file}: {error.strerror}") from None


def last_line(output: str) -> str:
    """Of what a program printed: its error line, or else its last one."""
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if "error: " in line]
    return (errors or lines or ["nothing was printed"])[-1]
