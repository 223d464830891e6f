"""Mechanisms drawn at random: units of seeds, counted (reports/read/campaign.py)."""

import argparse
import math
import resource
import subprocess
import tempfile
from pathlib import Path

from found import Found
from plan import Plan, last_line, sha1
from read.campaign import Campaign, Range
from read.campaign_files import checked_key, parse_name, read, written
from read.data import DataError
from read.values import MOST, Effort, reading

NAME, HELP = "wild", "mechanisms drawn at random, of one family or several"
PROGRAMS = ("stress",)  # the worker first
made_by = sha1
RESULT = "campaign-wild.json"
VARIANTS = (
    "Ladder<default>",
    "AxisFrames<SquareRoot>",
    "Ladder<last_bits>",
    "WideRefined<FactoredBias<ArrayGivens>>",
    "Sequential<Conventional>",
    "Batch<EigenLLT>",
)
FEWEST = 16  # units, so that a short campaign is divided too
PROBED = 2.0  # CPU seconds, beside which the start of a program is small


def whole(text: str) -> int:
    """1000000 or 1e6"""
    value = float(text)
    if not (value.is_integer() and 1 <= value <= MOST):
        raise ValueError
    return int(value)


def minutes(text: str) -> float:
    return _effort(text)


_effort = reading(Effort, strict=False)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--mechanisms", type=whole, required=True, help="of each family, such as 1e6")
    add("--first", type=whole, default=1, help="seed of the first mechanism")
    add("--family", action="append", metavar="FAMILY/VALUE", help="several times; default: wild/1")
    add("--variant", action="append", help="several times; default: six contenders")
    add("--precision", default="float32,float64")
    add("--task", default="dynamics,white")
    add("--worst", type=whole, default=20, help="cases kept whole, of each series")
    add("--rows", action="store_true", help="keep every answer, as Parquet in rows/")
    add("--minutes", type=minutes, default=30, help="CPU time of a unit")
    add("--count", type=whole, help="mechanisms of a unit, instead of its time")


def asked(options: argparse.Namespace) -> dict:
    """The order in which names are given leaves no trace."""
    cases = [f"{family}/{value:.17g}" for family, value in _cases(options)]
    own = {"mechanisms": options.mechanisms, "first": options.first, "rows": options.rows}
    return own | {"families": sorted(set(cases)), "options": _worker_options(options)}


def _worker_options(options: argparse.Namespace) -> list[str]:
    variants = [f"--variant={name}" for name in sorted(set(options.variant or VARIANTS))]
    lists = [
        f"--{what}={','.join(sorted(set(names.split(','))))}"
        for what, names in (("precision", options.precision), ("task", options.task))
    ]
    return [*variants, *lists, f"--worst={options.worst}"]


def _cases(options: argparse.Namespace) -> list[tuple[str, float]]:
    return [_case(text) for text in dict.fromkeys(options.family or ["wild/1"])]


def _case(text: str) -> tuple[str, float]:
    try:
        return parse_name(f"{text}/1+1")[:2]
    except ValueError:
        raise DataError(f"family {text}: not FAMILY/VALUE") from None


def made(options: argparse.Namespace, worker: Path) -> Plan:
    given = _worker_options(options)
    jobs, key = {}, None
    for family, value in _cases(options):
        some = Range(family, value, options.first, 1)
        key, seconds = _probed(worker, given, some, timed=not options.count)
        within = int(options.minutes * 60 / seconds)
        most = options.count or max(1, min(within, math.ceil(options.mechanisms / FEWEST)))
        for unit in divided(some._replace(count=options.mechanisms), most):
            jobs[unit.name.replace("/", "_")] = [f"--unit={unit.name}", *given]
    return Plan(made_by(worker), asked(options), jobs, "--out", options.rows, key)


def divided(everything: Range, most: int) -> list[Range]:
    """Into units of one size, at most `most` mechanisms each; the last may be smaller."""
    size = math.ceil(everything.count / math.ceil(everything.count / most))
    return [
        everything._replace(first=first, count=min(size, everything.end - first))
        for first in range(everything.first, everything.end, size)
    ]


def _probed(worker: Path, given: list[str], first: Range, timed: bool) -> tuple[dict, float]:
    """The key of the worker's units, and if `timed` the CPU seconds that a mechanism takes."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "probe.json"
        while True:
            began = resource.getrusage(resource.RUSAGE_CHILDREN)
            command = [worker, f"--unit={first.name}", *given, f"--out={out}"]
            done = subprocess.run(command, check=False, capture_output=True, text=True)
            if done.returncode:
                raise DataError(f"{first.name}: {last_line(done.stderr)}")
            ended = resource.getrusage(resource.RUSAGE_CHILDREN)
            took = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
            if not timed or took >= PROBED or first.count >= 1 << 20:
                return read(out).key, max(took, 1e-3) / first.count
            first = first._replace(count=4 * first.count)


class Counted(Found):
    """The units, added up."""

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder)
        self.campaign = Campaign(checked_key(plan.key))
        names = {job: options[0].removeprefix("--unit=") for job, options in plan.jobs.items()}
        self.units = {job: parse_name(name) for job, name in names.items()}

    def take(self, name: str, file: Path) -> None:
        part = read(file)
        if part.units != [self.units[name]]:
            raise ValueError(f"it is {part.units[0].name}")
        self.campaign.add(part)

    def result(self) -> str:
        return written(self.campaign)

    def total(self) -> str:
        return f"{self.campaign.mechanisms} mechanisms"


FOUND = Counted
