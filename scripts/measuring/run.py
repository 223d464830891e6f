"""Measures scenes and draws the page. `scripts/report` calls it once everything is built.

Measurements go to OUT/data, what the programs print to OUT/log, the page to OUT/index.html, with
its data packed in OUT/data.tar.xz; OUT is reports/out unless told. What was measured before with the
same program, options, model and processor is not measured again. Exit code: 1 if a measurement
failed, 2 on bad input.
"""

import argparse
import fcntl
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from children import end_with_parent
from clock import clock
from measuring.effort import FULL, QUICK
from measuring.plan import KINDS, default_scenes, plan
from measuring.scene import BadInput, Scene, bad_input
from measuring.unit import Unit

PARALLEL = min(2, len(os.sched_getaffinity(0)))  # programs at a time, except timings


class Progress:
    """The unit of how many, and the time since the first began.

    On a terminal that is one line, with what is running; else a line for each finished unit.
    """

    def __init__(self, count: int):
        self.count, self.done = count, 0
        self.began = time.monotonic()
        self.terminal = sys.stdout.isatty()

    def line(self, number: int, title: str) -> str:
        return f"unit {number} of {self.count}, {clock(time.monotonic() - self.began)}: {title}"

    def show(self, running: list[Unit]) -> None:
        if self.terminal:
            line = self.line(self.done + 1, ", ".join(unit.title for unit in running))
            self.write(line[: shutil.get_terminal_size().columns - 1])

    def finished(self, unit: Unit, fault: str | None) -> None:
        self.done += 1
        if fault:
            self.clear()
            print(f"report: {unit.title} failed: {fault}", file=sys.stderr, flush=True)
        elif not self.terminal:
            print(self.line(self.done, unit.title), flush=True)

    def write(self, text: str) -> None:
        print(f"\r\x1b[K{text}", end="", flush=True)

    def clear(self) -> None:
        if self.terminal:
            self.write("")


def measure(units: list[Unit]) -> list[Unit]:
    """Runs the units in order, a timing alone and others in parallel. Returns those that failed."""
    queue, running, failed = list(units), [], []
    progress = Progress(len(units))
    shown = 0.0
    try:
        while queue or running:
            while queue and (
                not running or not (queue[0].alone or running[0].alone) and len(running) < PARALLEL
            ):
                running.append(queue.pop(0))
                running[-1].start()
            if time.monotonic() - shown > 0.5:
                progress.show(running)
                shown = time.monotonic()
            time.sleep(0.02)
            for unit in [unit for unit in running if unit.process.poll() is not None]:
                running.remove(unit)
                fault = unit.finish()
                progress.finished(unit, fault)
                failed += [unit] if fault else []
    finally:
        for end in (signal.SIGINT, signal.SIGTERM):  # a second one would leave what the first ends
            signal.signal(end, signal.SIG_IGN)
        for unit in running:
            unit.stop()
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        progress.clear()
    return failed


def draw(root: Path, out: Path, files: list[Path], baseline: Path | None) -> bool:
    """Makes the page of these data files; returns whether it is there."""
    command = [sys.executable, root / "reports" / "make_report.py"]
    command += ["--data", out / "data", "--out", out / "index.html"]
    command += ["--baseline", baseline] if baseline else []
    command += ["--archive", out / "data.tar.xz", "--files", *files]
    # A group of its own: an interruption from the terminal is ours alone to tell.
    done = subprocess.run(
        command, check=False, process_group=0, preexec_fn=end_with_parent(os.getpid())
    )
    return done.returncode == 0


def clear_partial(folder: Path) -> None:
    """A journal stays: the program that wrote it goes on there, if it still can."""
    for path in folder.iterdir() if folder.exists() else []:
        if not path.is_dir():
            path.unlink()


def refuse_repeats(units: list[Unit]) -> None:
    """Two scenes of the same name would have one data file."""
    files = [unit.data for unit in units]
    for unit in units:
        if files.count(unit.data) > 1:
            label = unit.scene.label
            raise bad_input(f"two scenes are called {label}: rename a file or drop one")


def of_engines(folder: Path, scenes: list[Scene] | None) -> list[Path]:
    """What scripts/engines has recorded, of these scenes or of all."""
    if scenes is None:
        return [*folder.glob("*-engines-*.csv")]
    names = [scene.label.replace(":", "-") for scene in scenes]  # of a robot its size follows
    ends = [f"*-{name}{size}.csv" for name in names for size in ("", "-[0-9]*")]
    return [path for end in ends for path in folder.glob(f"*-engines-{end}")]


def there(planned: list[tuple[str, Scene]], programs: Path) -> list[tuple[str, Scene]]:
    """What can be measured by an executable that holds some of the programs, and prints which."""
    told = subprocess.run([programs], capture_output=True, check=True, text=True)
    names = told.stdout.split()
    if lacking := dict.fromkeys(
        KINDS[kind].program for kind, _ in planned if KINDS[kind].program not in names
    ):
        print(f"left out, by programs that are not here: {', '.join(lacking)}", flush=True)
    return [(kind, scene) for kind, scene in planned if KINDS[kind].program in names]


def run(options: argparse.Namespace) -> int:
    """Measures what is missing and draws what is there; returns the exit code."""
    began = time.monotonic()
    root = options.root.resolve()
    out = (options.out or root / "reports" / "out").resolve()
    effort = FULL if options.full else QUICK
    names = dict.fromkeys(options.scenes or default_scenes(root, effort))
    read = tuple(options.read)
    scenes = [Scene.parse(name, root, read) for name in names]
    if read and not any(scene.read for scene in scenes):
        raise bad_input(f"{read[0]} is about a robot's file, and none is given")
    programs = Path(os.path.abspath(options.bin))
    held_by_one = os.path.isfile(programs) and os.access(programs, os.X_OK)
    if not options.programs and not os.path.isdir(programs) and not held_by_one:
        raise bad_input(f"{options.bin}: no folder of programs, run scripts/build")
    planned = plan(root, scenes, not options.scenes, effort)
    if held_by_one:
        planned = there(planned, programs)
    units = [Unit(kind, scene, effort, programs, out) for kind, scene in planned]
    refuse_repeats(units)
    if options.programs:
        print(*dict.fromkeys(unit.what.program for unit in units), sep="\n")
        return 0
    for program in dict.fromkeys(unit.program for unit in units):
        if not os.access(program, os.X_OK):
            raise bad_input(f"{program}: no such program, run scripts/build")
    out.mkdir(parents=True, exist_ok=True)
    with (out / "lock").open("a+") as lock:  # whose link may lead to a file that is not ours
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise bad_input("another report is being made in this folder") from None
        clear_partial(out / "partial")
        for folder in ("data", "log", "partial"):
            (out / folder).mkdir(exist_ok=True)
        missing = [unit for unit in units if not unit.has_data]
        print(f"{len(units)} measurements, {len(units) - len(missing)} there already", flush=True)
        failed = measure(missing)
        files = [unit.data for unit in units if unit.has_data]
        campaigns = [*(out / "campaigns").glob("*/campaign-*.json")]  # by scripts/campaign
        campaigns += (out / "campaigns").glob("*/adversary-*.csv")
        campaigns += (out / "campaigns").glob("*/claims-*.json")
        campaigns += (out / "campaigns").glob("*/robots-*.csv")
        campaigns += of_engines(out / "engines", scenes if options.scenes else None)
        drawn = bool(files) and draw(root, out, files + sorted(campaigns), options.baseline)

    if failed:
        print(f"report: {len(failed)} of {len(units)} measurements failed", file=sys.stderr)
    if drawn:
        page = os.path.relpath(out / "index.html")
        count = f"{len(names)} scene{'' if len(names) == 1 else 's'}"
        print(f"{page}: {count} in {clock(time.monotonic() - began)}")
    return 0 if drawn and not failed else 1


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    effort = parser.add_mutually_exclusive_group()
    effort.add_argument("--quick", action="store_true", help="the default")
    effort.add_argument("--full", action="store_true")
    parser.add_argument(
        "--bin", type=Path, required=True, help="folder of the programs, or one file that holds them"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where everything is written")
    parser.add_argument(
        "--programs", action="store_true", help="print which programs are needed, and stop"
    )
    parser.add_argument("--baseline", type=Path, help="data of another page, to compare with")
    parser.add_argument(
        "--read", action="append", default=[], help="option by which programs read given files"
    )
    parser.add_argument("--root", type=Path, default=Path(__file__).parents[2])
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run(parser.parse_args())
    except BadInput as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("report: interrupted; what is measured is kept, run again to go on", file=sys.stderr)
        return 130
    except (OSError, RuntimeError) as error:  # pathlib says RuntimeError of a loop of links
        print(f"report: error: {error}", file=sys.stderr)
        return 2
