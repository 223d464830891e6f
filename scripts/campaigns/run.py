"""Measures a campaign: more mechanisms than one sitting has time for, by one machine or a cluster.

Each campaign has a folder. The same command goes on where an earlier one ended, in whatever way;
what was finished is kept. Exit code: 2 on bad input or where a unit failed.
"""

import argparse
import fcntl
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path[1:1] = [str(ROOT / "scripts"), str(ROOT / "reports")]
import merge  # noqa: E402
from campaign import Campaign, MergeError, Range  # noqa: E402
from campaign_files import parse_name, read, written  # noqa: E402
from data import DataError  # noqa: E402
from engine import Engine, profile_folder  # noqa: E402
from output import write  # noqa: E402
from plan import FEWEST, Plan, divided, file_name, last_line, probed, sha1  # noqa: E402
from progress import clock  # noqa: E402
from values import MOST, number  # noqa: E402

VARIANTS = (
    "Fast<Conventional>",
    "Fast<SquareRoot>",
    "Fast<Certified>",
    "WideRefined<FactoredBias<ArrayGivens>>",
    "Sequential<Conventional>",
    "Batch<EigenLLT>",
)
LOOKED = 0.3  # s between looks at what is finished


def worker_options(options: argparse.Namespace) -> list[str]:
    """The order in which names are given leaves no trace."""
    variants = [f"--variant={name}" for name in sorted(set(options.variant or VARIANTS))]
    lists = [
        f"--{what}={','.join(sorted(set(names.split(','))))}"
        for what, names in (("precision", options.precision), ("task", options.task))
    ]
    return [*variants, *lists, f"--worst={options.worst}"]


def made(options: argparse.Namespace, worker: Path) -> Plan:
    given = worker_options(options)
    units, key = [], {}
    for family, value in map(case, options.family):
        some = Range(family, value, options.first, 1)
        key, seconds = probed(worker, given, some, timed=not options.count)
        within = int(options.minutes * 60 / seconds)
        most = options.count or max(1, min(within, math.ceil(options.mechanisms / FEWEST)))
        units += divided(family, value, options.first, options.mechanisms, most)
    return Plan(sha1(worker), key, given, units, options.rows)


def case(text: str) -> tuple[str, float]:
    try:
        return parse_name(f"{text}/1+1")[:2]
    except ValueError:
        raise DataError(f"family {text}: not FAMILY/VALUE") from None


def planned(options: argparse.Namespace, worker: Path) -> Plan:
    """The folder's own plan, if it is what is asked for now; else a new one."""
    path = options.out / "plan.json"
    if not path.exists():
        plan = made(options, worker)
        plan.write(path)
        return plan
    plan = Plan.read(path)
    asked = [case(text) for text in options.family]
    totals = {(unit.family, unit.value): [] for unit in plan.units}
    for unit in plan.units:
        totals[unit.family, unit.value].append(unit)
    ranges = {key: (own[0].first, sum(unit.count for unit in own)) for key, own in totals.items()}
    wanted = dict.fromkeys(asked, (options.first, options.mechanisms))
    if (plan.options, plan.rows, ranges) != (worker_options(options), options.rows, wanted):
        raise DataError(f"{path}: of other options than these; give --out another folder")
    if plan.program != sha1(worker):
        raise DataError(f"{path}: of another program than {worker}; give --out another folder")
    return plan


class Sum:
    """The units that are finished, added up as they come."""

    def __init__(self, plan: Plan, folder: Path):
        self.left = {file_name(unit): unit for unit in plan.units}
        self.plan, self.folder = plan, folder
        self.campaign = Campaign(plan.key)

    def look(self) -> int:
        """Takes what is new; returns how many units that were."""
        names = sorted(entry.name for entry in os.scandir(self.folder) if entry.name in self.left)
        for name in names:
            self._take(name)
        return len(names)

    def _take(self, name: str) -> None:
        file, unit = self.folder / name, self.left[name]
        try:
            part = read(file)
            if part.units != [unit]:
                raise DataError(f"{file}: it is {part.units[0].name}")
            self.campaign.add(part)
        except (DataError, MergeError) as error:
            refused = file.with_suffix(".refused")
            file.replace(refused)
            why = str(error).removeprefix(f"{file}: ")
            raise DataError(f"{refused}: set aside: {why}; start again to measure it anew") from None
        del self.left[name]


@contextmanager
def alone(folder: Path):
    """Two runs in one folder would take each other's jobs for orphans."""
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(f"{folder}: another run is at work there") from None
        yield


def measure(options: argparse.Namespace) -> int:
    began = time.monotonic()
    engine = Engine(options.engine, options.profile, options.out, worker := program(options))
    options.out.mkdir(parents=True, exist_ok=True)
    with alone(options.out):
        plan = planned(options, worker)
        units = options.out / "units"
        units.mkdir(exist_ok=True)
        found = Sum(plan, units)
        print(f"{len(plan.units)} units of at most {max(u.count for u in plan.units)} mechanisms")
        try:
            engine.start()
            follow(engine, found, len(plan.units))
        finally:
            for end in (signal.SIGINT, signal.SIGTERM):  # a second one would leave jobs behind
                signal.signal(end, signal.SIG_IGN)
            engine.stop()
        if found.left:
            raise DataError(failure(engine, options.out, found))
        result = options.out / f"campaign-{options.campaign}.json"
        write(result, written(found.campaign))
        total = found.campaign.mechanisms
        print(f"{os.path.relpath(result)}: {total} mechanisms in {clock(time.monotonic() - began)}")
    return 0


def follow(engine: Engine, found: Sum, units: int) -> None:
    """Until the engine ends; says how far it is where that changes."""
    first, began = None, time.monotonic()
    running = True
    while running:
        time.sleep(LOOKED)
        running = engine.running()
        if not found.look():
            continue
        done = units - len(found.left)
        now = time.monotonic()
        if first is None:  # what was there already says nothing of the speed
            first, began = done, now
        line = f"[{100 * done // units:3} %] {done} of {units} units"
        if done > first:
            line += f", about {clock((now - began) / (done - first) * len(found.left))} left"
        print(line, flush=True)
    engine.wait()


def failure(engine: Engine, folder: Path, found: Sum) -> str:
    """Why units are missing, in a line: what a worker said, or else the engine."""
    there = len(found.plan.units) - len(found.left)
    end = f"{there} of {len(found.plan.units)} units are there, start again to go on"
    status = os.statvfs(folder)
    if status.f_bavail == 0:
        return f"{folder}: no space left on device; {end}"
    for name in found.left:
        log = folder / "log" / Path(name).with_suffix(".log")
        if log.is_file() and (said := log.read_text(errors="replace")).strip():
            return f"{found.left[name].name}: {last_line(said)} ({os.path.relpath(log)}); {end}"
    said = [line for line in engine.said if "rror" in line and not line.endswith(":")]
    return f"Snakemake: {(said or engine.said or ['it said nothing'])[-1]}; {end}"


def program(options: argparse.Namespace) -> Path:
    """The worker; built where no folder of programs is given."""
    folder = os.environ.get("KALMARM_BIN")
    if not folder:
        build = [ROOT / "scripts" / "build", "stress"]
        if subprocess.run(build, check=False, stdout=subprocess.DEVNULL).returncode:
            raise DataError("scripts/build stress failed")
        folder = ROOT / "build" / "bin"
    worker = Path(folder).resolve() / "stress"
    if not os.access(worker, os.X_OK):
        raise DataError(f"{worker}: no such program")
    return worker


class Parser(argparse.ArgumentParser):
    def error(self, message: str):
        raise DataError(message)


def whole(text: str) -> int:
    """1000000 or 1e6"""
    value = float(text)
    if not (value.is_integer() and 1 <= value <= MOST):
        raise ValueError
    return int(value)


def minutes(text: str) -> float:
    return number("minutes", float(text), 1e-3)


def parser() -> argparse.ArgumentParser:
    top = Parser(
        "scripts/campaign", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    kinds = top.add_subparsers(dest="campaign", required=True, metavar="CAMPAIGN", parser_class=Parser)
    wild = kinds.add_parser("wild", help="mechanisms drawn at random, of one family or several")
    wild.add_argument("--mechanisms", type=whole, required=True, help="of each family, such as 1e6")
    wild.add_argument("--first", type=whole, default=1, help="seed of the first mechanism")
    wild.add_argument(
        "--family", action="append", metavar="FAMILY/VALUE", help="several times; default: wild/1"
    )
    wild.add_argument("--variant", action="append", help="several times; default: six contenders")
    wild.add_argument("--precision", default="float32,float64")
    wild.add_argument("--task", default="dynamics,white")
    wild.add_argument("--worst", type=whole, default=20, help="cases kept whole, of each series")
    wild.add_argument("--rows", action="store_true", help="keep every answer, as Parquet in rows/")
    wild.add_argument("--profile", default="local", help="local, slurm, or a folder of your own")
    wild.add_argument("--out", type=Path, metavar="FOLDER", help="default: in reports/out/campaigns")
    wild.add_argument("--minutes", type=minutes, default=30, help="CPU time of a unit")
    wild.add_argument("--count", type=whole, help="mechanisms of a unit, instead of its time")
    default = ROOT / "build" / "venv-cluster" / "bin" / "snakemake"
    wild.add_argument("--engine", type=Path, default=default, metavar="SNAKEMAKE")
    both = kinds.add_parser("merge", help="merged files of several campaigns into one")
    both.add_argument("--out", type=Path, required=True, metavar="FILE")
    both.add_argument(
        "--sum-over", action="append", default=[], choices=("kS", "mass_ratio"), help="fewer groups"
    )
    both.add_argument("files", nargs="+", type=Path, metavar="FILE")
    return top


def run() -> int:
    options = parser().parse_args()
    if options.campaign == "merge":
        merge.run(options.files, options.out, options.sum_over)
        return 0
    options.family = options.family or ["wild/1"]
    out = options.out or ROOT / "reports" / "out" / "campaigns" / options.campaign
    options.out = out.resolve()
    profile_folder(options.profile)  # before anything is built
    return measure(options)


def main() -> int:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run()
    except DataError as error:
        print(f"campaign: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("campaign: interrupted; what is finished is kept, run again to go on", file=sys.stderr)
        return 130
    except (OSError, RuntimeError) as error:  # pathlib says RuntimeError of a loop of links
        print(f"campaign: error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
