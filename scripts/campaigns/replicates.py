"""The claims decided again and again, by data of other seeds each time (decide.py)."""

import argparse
import hashlib
import math
from pathlib import Path

import decide
from found import Found
from plan import Plan, sha1
from read.campaign import refuse_another
from read.data import DataError
from read.replicate_files import checked_key, part_of, read, written
from read.replicates import MOST, Part, Replicates
from wild import FEWEST, divided, whole

NAME, HELP = "claims", "the claims of the page, decided by many runs of other seeds"
PROGRAMS = ("stress", "integrate")  # the worker first
RESULT = "claims-campaign.json"
COUNT = {"quick": 20, "full": 1}  # replicates of a unit, which takes half an hour


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--replicates", type=whole, required=True, help=f"at most {MOST}")
    add("--first", type=whole, default=1, help="number of the first one")
    add("--full", action="store_true", help="each as scripts/report --full, not as --quick")
    add("--count", type=whole, help="replicates of a unit")


def asked(options: argparse.Namespace) -> dict:
    own = {"replicates": options.replicates, "first": options.first, "effort": _effort(options)}
    if options.replicates > MOST:
        raise DataError(f"{options.replicates} replicates: at most {MOST}")
    last = options.first + options.replicates - 1
    if decide.seeds(last, own["effort"]).stop > decide.LARGEST_SEED:
        raise DataError(f"replicate {last}: its seeds are above {decide.LARGEST_SEED}")
    return own


def _effort(options: argparse.Namespace) -> str:
    return "full" if options.full else "quick"


def made_by(worker: Path) -> str:
    files = [sha1(worker.with_name(name)) for name in PROGRAMS]
    return hashlib.sha1(" ".join([*files, decide.sources()]).encode()).hexdigest()


def made(options: argparse.Namespace, worker: Path) -> Plan:
    own = asked(options)
    most = options.count or min(COUNT[own["effort"]], math.ceil(options.replicates / FEWEST))
    jobs = {
        f"replicates-{unit.name}": [f"--unit={unit.name}", f"--effort={own['effort']}"]
        for unit in divided(Part(options.first, options.replicates), most)
    }
    key = decide.key(worker, own["effort"])
    return Plan(made_by(worker), own, jobs, "--out", key=key, script="decide.py")


class Decided(Found):
    """The units, added up."""

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder)
        self.key = checked_key(plan.key)
        self.units = {
            job: part_of(options[0].removeprefix("--unit=")) for job, options in plan.jobs.items()
        }
        self.replicates: Replicates | None = None

    def take(self, name: str, file: Path) -> None:
        part = read(file)
        refuse_another(self.key, part.key)
        if part.parts != [self.units[name]]:
            raise ValueError(f"it is {part.parts[0].name}")
        self.replicates = self.replicates or part.emptied()
        self.replicates.add(part)

    def result(self) -> str:
        return written(self.replicates)

    def total(self) -> str:
        return f"{self.replicates.count} replicates"


FOUND = Decided
