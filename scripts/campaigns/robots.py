"""Many robots, each under every stress (accuracy/limits): digits that are left, and refusals."""

import argparse
import csv
import io
from pathlib import Path

from found import Found
from names import fault_of_name
from plan import Plan, last_line, sha1
from read.advice import Limits
from read.checks import read_json, refusing
from read.data import DataError
from read.robots import COLUMNS
from read.values import Effort, Number, reading

NAME, HELP = "robots", "robots' files, each loaded and changed until digits are lost"
PROGRAMS = ("limits",)  # the worker first
made_by = sha1
RESULT = "robots-campaign.csv"


def effort(text: str) -> float:
    return _effort(text)


_effort = reading(Effort, strict=False)
_limits, _kept = reading(Limits), reading(Number | None)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("files", nargs="+", type=Path, metavar="FILE", help="MJCF or URDF")
    add("--effort", type=effort, default=1, help="states searched, times the usual number")
    add(
        "--read",
        action="append",
        default=[],
        metavar="OPTION",
        help="how the files are read, such as --read=--floating; several times",
    )


def asked(options: argparse.Namespace) -> dict:
    """With what the files were, but not what they include."""
    files: dict[str, Path] = {}
    for file in options.files:
        if fault := fault_of_name(file):
            raise DataError(fault)
        if file.stem in files:
            raise DataError(f"{file}: another file is called {file.stem} too")
        files[file.stem] = file.resolve()
    own = {name: [str(file), sha1(file)] for name, file in sorted(files.items())}
    return {"files": own, "effort": options.effort, "read": options.read}


def made(options: argparse.Namespace, worker: Path) -> Plan:
    own = asked(options)
    more = [f"--effort={options.effort}", *options.read]
    jobs = {name: [file, *more] for name, (file, _) in own["files"].items()}
    return Plan(made_by(worker), own, jobs, "--json")


class Judged(Found):
    """What became of each robot. One that the worker refuses in words is judged as well."""

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder)
        self.rows: dict[str, list[dict]] = {}

    def take(self, name: str, file: Path) -> None:
        document = read_json(file)
        with refusing(file, "what limits writes"):
            _limits(document)
            self.rows[name] = [self._row(name, document, stress) for stress in document["stresses"]]

    def _row(self, name: str, document: dict, stress: dict) -> dict:
        promise = document.get("promise") or {}
        curves = [curve for curves in stress["tasks"].values() for curve in curves]
        return {
            "name": name,
            "robot": document["robot"],
            "variant": promise.get("variant"),
            "precision": promise.get("precision"),
            "digits": promise.get("digits"),
            "stress": stress["title"],
            "unit": stress["unit"],
            "kept": _kept(stress["kept"]),
            "last": stress["values"][-1],
            "silent": sum(sum(curve["silent"]) for curve in curves),
        }

    def settle(self) -> None:
        for name in list(self.left):
            if "error: " in (said := last_line(self.said(name))):
                self.rows[name] = [{"name": name, "refused": said.split("error: ", 1)[1]}]
                del self.left[name]

    def result(self) -> str:
        text = io.StringIO()
        table = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(row for _, rows in sorted(self.rows.items()) for row in rows)
        return text.getvalue()

    def total(self) -> str:
        refused = sum("refused" in rows[0] for rows in self.rows.values())
        return f"{len(self.rows)} robots, {refused} of them refused,"


FOUND = Judged
