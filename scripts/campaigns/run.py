"""Measures a campaign: more mechanisms than one sitting has time for, by one machine or a cluster.

Each campaign has a folder. The same command goes on where an earlier one ended, in whatever way;
what was finished is kept. Exit code: 2 on bad input or where a unit failed.
"""

import argparse
import fcntl
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[1:1] = [str(ROOT / "scripts"), str(ROOT / "reports")]
import islands  # noqa: E402
import merge  # noqa: E402
import replicates  # noqa: E402
import robots  # noqa: E402
import wild  # noqa: E402
from clock import clock  # noqa: E402
from engine import Engine, profile_folder  # noqa: E402
from found import Found  # noqa: E402
from page.output import write  # noqa: E402
from plan import Plan, last_line  # noqa: E402
from read.checks import refusing  # noqa: E402
from read.data import DataError  # noqa: E402

KINDS = {kind.NAME: kind for kind in (wild, islands, robots, replicates)}
LOOKED = 0.3  # s between looks at what is finished


def planned(kind, options: argparse.Namespace, worker: Path) -> Plan:
    """The folder's own plan, or a first one where it has none. DataError: other options made it."""
    path = options.out / "plan.json"
    if not path.exists():
        plan = kind.made(options, worker)
        plan.write(path)
        return plan
    plan = Plan.read(path)
    if plan.asked != kind.asked(options):
        raise DataError(f"{path}: of other options than these; give --out another folder")
    if plan.program != kind.made_by(worker):
        raise DataError(f"{path}: of another program than {worker}; give --out another folder")
    return plan


@contextmanager
def alone(folder: Path):
    """Two runs in one folder would take each other's jobs for orphans."""
    with (folder / "lock").open("a+") as lock:  # whose link may lead to a file that is not ours
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(f"{folder}: another run is at work there") from None
        yield


def measure(options: argparse.Namespace) -> int:
    began = time.monotonic()
    kind = KINDS[options.campaign]
    worker = programs(kind.PROGRAMS)[0]
    engine = Engine(options.engine, options.profile, options.out, worker)
    options.out.mkdir(parents=True, exist_ok=True)
    with alone(options.out):
        plan = planned(kind, options, worker)
        with refusing(options.out / "plan.json", "a plan"):
            found = kind.FOUND(plan, options.out)
        print(f"{len(plan.jobs)} units")
        try:
            engine.start()
            follow(engine, found)
        finally:
            for end in (signal.SIGINT, signal.SIGTERM):  # a second one would leave jobs behind
                signal.signal(end, signal.SIG_IGN)
            engine.stop()
        found.settle()
        if found.left:
            raise DataError(failure(engine, found))
        result = options.out / kind.RESULT
        write(result, found.result())
        took = clock(time.monotonic() - began)
        print(f"{os.path.relpath(result)}: {found.total()} in {took}")
    return 0


def follow(engine: Engine, found: Found) -> None:
    """Until the engine ends; says how far it is where that changes."""
    units, first, began = len(found.left), None, time.monotonic()
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


def failure(engine: Engine, found: Found) -> str:
    """Why units are missing, in a line: what a worker said, or else the engine."""
    units = len(found.plan.jobs)
    end = f"{units - len(found.left)} of {units} units are there, start again to go on"
    if os.statvfs(found.folder).f_bavail == 0:
        return f"{found.folder}: no space left on device; {end}"
    for name in found.left:
        if said := found.said(name):
            return f"{name}: {last_line(said)} ({os.path.relpath(found.log(name))}); {end}"
    said = [line for line in engine.said if "rror" in line and not line.endswith(":")]
    return f"Snakemake: {(said or engine.said or ['it said nothing'])[-1]}; {end}"


def programs(names: tuple[str, ...]) -> list[Path]:
    """Built where no folder of programs is given."""
    folder = os.environ.get("KALMARM_BIN")
    if not folder:
        build = [ROOT / "scripts" / "build", *names]
        if subprocess.run(build, check=False, stdout=subprocess.DEVNULL).returncode:
            raise DataError(f"scripts/build {' '.join(names)} failed")
        folder = ROOT / "build" / "bin"
    found = [Path(folder).resolve() / name for name in names]
    for file in found:
        if not os.access(file, os.X_OK):
            raise DataError(f"{file}: no such program")
    return found


class Parser(argparse.ArgumentParser):
    def error(self, message: str):
        raise DataError(message)


def parser() -> argparse.ArgumentParser:
    top = Parser(
        "scripts/campaign",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    kinds = top.add_subparsers(
        dest="campaign", required=True, metavar="CAMPAIGN", parser_class=Parser
    )
    snakemake = ROOT / "build" / "venv-cluster" / "bin" / "snakemake"
    for kind in KINDS.values():
        own = kinds.add_parser(kind.NAME, help=kind.HELP)
        kind.add_arguments(own)
        own.add_argument("--profile", default="local", help="local, slurm, or a folder of your own")
        own.add_argument(
            "--out", type=Path, metavar="FOLDER", help="default: in reports/out/campaigns"
        )
        own.add_argument("--engine", type=Path, default=snakemake, metavar="SNAKEMAKE")
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
    KINDS[options.campaign].asked(options)  # is refused before anything is built
    profile_folder(options.profile)
    out = options.out or ROOT / "reports" / "out" / "campaigns" / options.campaign
    options.out = out.resolve()
    return measure(options)


def main() -> int:
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run()
    except DataError as error:
        print(f"campaign: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(
            "campaign: interrupted; what is finished is kept, run again to go on", file=sys.stderr
        )
        return 130
    except (OSError, RuntimeError) as error:  # pathlib says RuntimeError of a loop of links
        print(f"campaign: error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
