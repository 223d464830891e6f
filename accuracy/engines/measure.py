"""Asks engines about mechanisms and writes what came out: `scripts/engines`.

A unit is one variant of an engine, a precision and a mechanism. Each is asked in a process of
the engine's own environment (worker.py): a call that takes longer than the limit, or that takes
the process with it, is a record that says so, and the tasks after it are asked in a new process.
A unit that was measured before with the same adapter, lock and mechanism is not measured again.
"""

import argparse
import ast
import csv
import hashlib
import json
import os
import re
import signal
import sys
import time
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))

import defects
import environments
import mechanisms
import records
from clock import clock
from environments import LOCKS, ROOT, Missing
from mechanisms import BadName, Written
from processes import Ended, Worker

HERE = Path(__file__).resolve().parent
OUT = ROOT / "reports" / "out" / "engines"
TASKS = {  # and their measures
    "mass": "scaled",
    "inverse": "scaled",
    "acceleration": "relative",
    "inverse_dynamics": "relative",
    "derivatives": "relative",
}
PUBLISHED = HERE / "published"
LIMIT = 120.0  # s a call, the first with compilation
SECONDS = 0.1  # of a timing
BATCHES = (16, 256, 1024, 4096, 65536)
BATCHED = "acceleration"  # the task whose batches are timed
TIMED = ("nanoseconds", "with_copies", "variation", "first_call")
ROUNDING = "Rounded parameters"  # the error of who rounds nothing else


class Facts(NamedTuple):
    """What an adapter's file says of itself, read without its engine."""

    name: str
    variants: list[str]
    precisions: list[str]
    gpu: bool


def facts(engine: str) -> Facts:
    tree = ast.parse((HERE / "adapters" / f"{engine}.py").read_text())
    found = {"variants": {}, "precisions": ("float64",), "gpu": False}
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name == "Adapter":
            for line in node.body:
                if isinstance(line, ast.Assign) and line.targets[0].id in ("name", *found):
                    found[line.targets[0].id] = ast.literal_eval(line.value)
    return Facts(
        found["name"],
        list(found["variants"]) or [found["name"]],
        list(found["precisions"]),
        found["gpu"],
    )


def sources(engine: str) -> bytes:
    """All that decides what an engine is asked, and how."""
    adapter = (HERE / "adapters" / f"{engine}.py").read_text()
    shared = [
        name for name in ("by_jax", "sdf") if re.search(rf"^(from|import) {name}\b", adapter, re.M)
    ]
    names = ["protocol", "worker", *shared]
    return b"".join([adapter.encode(), *((HERE / f"{name}.py").read_bytes() for name in names)])


class Unit(NamedTuple):
    engine: str
    variant: str
    precision: str
    mechanism: Written

    @property
    def file_name(self) -> str:
        return mechanisms.slug(
            f"{self.engine}-{self.variant}-{self.precision}-{self.mechanism.scene}"
        )

    def path(self, kind: str) -> Path:
        return OUT / f"{kind}-engines-{self.file_name}.csv"

    @property
    def key(self) -> str:
        digest = hashlib.sha256(sources(self.engine))
        digest.update(f"{environments.wanted(self.engine)} {self.mechanism.key}".encode())
        return digest.hexdigest()

    @property
    def is_done(self) -> bool:
        there = self.path("errors").is_file() and self.path("times").is_file()
        key = self.path("errors").with_suffix(".key")
        return there and key.is_file() and key.read_text() == self.key


class Answers:
    """What is known of a unit: by task and state an error or an outcome, by task a time."""

    def __init__(self, states: int):
        self.states = states
        self.version = ""
        self.errors: dict[tuple[str, int], dict] = {}
        self.times: dict[str, dict] = {}

    def take(self, said: dict) -> None:
        if "version" in said:
            self.version = said["version"]
        elif "state" in said:
            self.errors[said["task"], said["state"]] = said
        elif "nanoseconds" in said:
            self.times[said["task"]] = said

    def fill(self, tasks: list[str], outcome: str) -> None:
        """Of what has no answer yet."""
        for task in tasks:
            for state in range(min(self.states, batch_of(task) or self.states)):
                self.errors.setdefault((task, state), {"outcome": outcome})

    @property
    def tasks(self) -> list[str]:
        return list(dict.fromkeys(task for task, _ in self.errors))

    def of(self, task: str) -> list[dict]:
        return [said for (own, _), said in sorted(self.errors.items()) if own == task]


def batch_of(task: str) -> int:
    """The states of a call of batch:64; 0 of other tasks."""
    return int(task.removeprefix("batch:")) if task.startswith("batch:") else 0


def asked(batches, seconds: float) -> list[str]:
    """The tasks of a unit; what has no times is asked state by state alone."""
    return [*TASKS, *(f"batch:{count}" for count in batches if seconds)]


def count_states(mechanism: Written) -> int:
    return len(json.loads((mechanism.folder / "truth.json").read_text())["states"])


def ask(unit: Unit, python: Path, limit: float, seconds: float, batches=()) -> Answers:
    folder = unit.mechanism.folder
    answers = Answers(count_states(unit.mechanism))
    left = asked(batches, seconds)
    while left:
        command = [python, HERE / "worker.py", unit.engine, unit.variant, unit.precision, folder]
        command += ["--tasks", ",".join(left), "--seconds", str(seconds)]
        begun = "load"
        try:
            with Worker(command, limit) as worker:
                for said in worker.lines():
                    begun = said.get("begin", begun)
                    answers.take(said)
                    if "refused" in said:
                        answers.fill(left, said["refused"])
            answers.fill(left, "crashed: no answer")
            left = []
        except Ended as how:
            if begun == "load":
                answers.fill(left, str(how))
                break
            answers.fill([begun], str(how))
            left = left[left.index(begun) + 1 :]
    return answers


class NotAsked(Missing):
    """Why an engine is not asked on this machine."""


def has_gpu() -> bool:
    return Path("/dev/nvidiactl").exists()


def prepared(engine: str, its: Facts) -> Path:
    """The interpreter of its environment. Raises Missing."""
    if its.gpu and not has_gpu():
        raise NotAsked("it needs a GPU")
    return environments.prepare(engine)


def processor() -> str:
    found = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text())
    return found[1] if found else "unknown"


def write(unit: Unit, answers: Answers, final: bool = True) -> None:
    """Not final: it will be measured again."""
    OUT.mkdir(parents=True, exist_ok=True)
    scene = unit.mechanism.scene
    begin = [scene, scene.rsplit(":", 1)[1]]
    errors, times = [], []
    for task in answers.tasks:
        batch, named = batch_of(task) or 1, BATCHED if batch_of(task) else task
        series, why = [unit.precision, named, batch], "not timed"
        for state, said in enumerate(answers.of(task)):
            measured = [TASKS[named], records.number(said.get("error")), said.get("outcome", "ok")]
            errors.append([*begin, unit.variant, *series, state, *measured])
            why = why if "error" in said else said["outcome"]
        time_of = answers.times.get(task, {})
        numbers = [records.number(time_of.get(key)) for key in TIMED]
        numbers[3:3] = [time_of.get("repetitions", 0)]
        row = [*begin, unit.engine, unit.variant, answers.version, *series, *numbers, processor()]
        times.append([*row, "ok" if time_of else why])
    key = unit.path("errors").with_suffix(".key")
    key.unlink(missing_ok=True)
    records.write(unit.path("errors"), records.ERRORS, errors)
    records.write(unit.path("times"), records.TIMES, times)
    if final:
        key.write_text(unit.key)


def write_rounding(mechanism: Written) -> None:
    """What rounding the parameters to float32 costs, as an engine that makes no other error."""
    OUT.mkdir(parents=True, exist_ok=True)
    truth = json.loads((mechanism.folder / "truth.json").read_text())
    n = truth["nv"]
    rows = [
        [
            mechanism.scene,
            n,
            ROUNDING,
            "float32",
            task,
            1,
            i,
            measure,
            records.number(state["rounding"][task]),
            "ok",
        ]
        for task, measure in TASKS.items()
        for i, state in enumerate(truth["states"])
        if task in state["rounding"]
    ]
    name = mechanisms.slug(f"rounding-{mechanism.scene}")
    records.write(OUT / f"errors-engines-{name}.csv", records.ERRORS, rows)


def copy_published(mechanism: Written) -> None:
    """What others have published of a robot of this name, as records that say so."""
    for file in PUBLISHED.glob("*-engines-*.csv"):
        with file.open() as lines:
            columns, *rows = csv.reader(lines)
        if own := [row for row in rows if row[0] == mechanism.scene]:
            name = f"{file.stem}-{mechanisms.slug(mechanism.scene)}.csv"
            records.write(OUT / name, columns, own)


def worst(answers: Answers, task: str) -> str:
    said = answers.of(task)
    errors = [one["error"] for one in said if "error" in one]
    if len(errors) < len(said):
        outcome = next(one["outcome"] for one in said if "error" not in one)
        return outcome.split(":")[0]
    return f"{max(errors):.1e}"


def new(name: str) -> None:
    """An adapter to be written, which runs as it is, and the names of what it needs."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise BadName(f"'{name}' is no name of lower-case letters, digits and _")
    files = {"adapter.py": HERE / "adapters" / f"{name}.py", "lock.in": LOCKS / f"{name}.in"}
    for file in files.values():
        if file.exists():
            raise BadName(f"{os.path.relpath(file)} is there already")
    for template, file in files.items():
        text = (HERE / "template" / template).read_text()
        file.write_text(text.replace("NAME", name))
        print(os.path.relpath(file))


def adapters() -> list[str]:
    return sorted(path.stem for path in (HERE / "adapters").glob("*.py"))


def chosen(options: argparse.Namespace) -> tuple[list[str], list[str]]:
    """Engines and mechanisms that are named, or else the usual ones."""
    engines = [name for name in options.names if name in adapters()]
    scenes = [name for name in options.names if name not in adapters()]
    if options.all:
        return adapters(), [*mechanisms.USUAL, *mechanisms.found()]
    return engines or adapters(), scenes or mechanisms.USUAL


def searched(options: argparse.Namespace, engines: list[str]) -> int:
    try:
        import search
    except ImportError as missing:
        raise BadName(f"--search needs {missing.name}: scripts/setup") from None
    return search.run(engines, options.evaluations, options.seed, options.limit, options.out)


def run(options: argparse.Namespace) -> int:
    if options.names[:1] == ["new"]:
        if len(options.names) != 2:
            raise BadName("new is followed by one name")
        new(options.names[1])
        return 0
    engines, scenes = chosen(options)
    if options.lock:
        for engine in defects.environments_of() if options.defects else engines:
            environments.lock(engine)
        return 0
    if options.defects:
        return defects.run(options.limit)
    if not mechanisms.PROGRAM.exists():
        raise BadName(
            "build/bin/export_mechanism is not there: scripts/build export_mechanism kalmarm"
        )
    if options.search:
        return searched(options, engines)
    written = [mechanisms.write(name) for name in scenes]
    for mechanism in written:
        write_rounding(mechanism)
        copy_published(mechanism)
    absent, began = 0, time.monotonic()
    for engine in engines:
        its = facts(engine)
        units = [
            Unit(engine, variant, precision, mechanism)
            for mechanism in written
            for variant in its.variants
            for precision in its.precisions
        ]
        try:
            todo = [unit for unit in units if not unit.is_done]
            python = prepared(engine, its) if todo else None
        except Missing as why:
            absent += not isinstance(why, NotAsked)
            print(f"engines: {engine}: {why}", file=sys.stderr)
            word = "not asked" if isinstance(why, NotAsked) else "missing"
            for unit in units:
                answers = Answers(count_states(unit.mechanism))
                answers.fill(asked(options.batch, options.seconds), f"{word}: {why}")
                write(unit, answers, final=False)
            continue
        for unit in todo:
            # Batches compile anew.
            seconds = 0 if unit.mechanism.is_found else options.seconds
            answers = ask(unit, python, options.limit, seconds, options.batch)
            write(unit, answers)
            numbers = ", ".join(f"{task} {worst(answers, task)}" for task in TASKS)
            print(f"{unit.variant} {unit.precision} {unit.mechanism.scene}: {numbers}", flush=True)
    count = f"{len(engines)} engines, {len(written)} mechanisms"
    print(f"{os.path.relpath(OUT)}: {count} in {clock(time.monotonic() - began)}")
    return 1 if absent else 0


def positive(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is no positive number")
    return int(text)


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="engines",
        description="The errors and times of other engines on the same mechanisms, against proven "
        f"truth: records for the page in {os.path.relpath(OUT, ROOT)}. ENGINE is one of "
        f"{', '.join(adapters())}; "
        "MECHANISM a SCENE of any program, SCENE+STRESS=VALUE with a stress of `limits`, or "
        "found/NAME of accuracy/adversary/found, or finds/NAME of accuracy/engines/finds. Each "
        "engine is installed into an environment of its own, build/engines/ENGINE. `new NAME` writes an "
        "adapter to be filled in (docs/submit-an-engine.md).",
    )
    parser.add_argument("names", nargs="*", metavar="ENGINE|MECHANISM")
    parser.add_argument(
        "--all", action="store_true", help="all engines; all mechanisms, those found by search too"
    )
    parser.add_argument(
        "--limit", type=float, default=LIMIT, help="seconds a call may take (%(default)g)"
    )
    parser.add_argument(
        "--seconds", type=float, default=SECONDS, help="of a timing; 0: none (%(default)g)"
    )
    parser.add_argument(
        "--batch",
        type=positive,
        nargs="*",
        default=BATCHES,
        metavar="COUNT",
        help="states that an engine that can is timed with at once ("
        + ", ".join(map(str, BATCHES))
        + ")",
    )
    parser.add_argument(
        "--lock",
        action="store_true",
        help="write the locks of these engines, or of --defects, anew, and stop",
    )
    parser.add_argument(
        "--defects",
        action="store_true",
        help="check older versions in which known defects live, and today's",
    )
    parser.add_argument(
        "--search",
        action="store_true",
        help="search arms of ordinary proportions for the worst silent error of each engine, in "
        "float32 where it has that",
    )
    parser.add_argument(
        "--evaluations",
        type=positive,
        default=300,
        help="arms of a search, in whole generations of 30 (%(default)d)",
    )
    parser.add_argument("--seed", type=int, default=1, help="of a search (%(default)d)")
    parser.add_argument(
        "--out",
        type=Path,
        default=mechanisms.FOLDER / "search",
        help="folder for the worst arms of a search (build/engines/search)",
    )
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return run(parser.parse_args())
    except (BadName, Missing) as error:
        print(f"engines: error: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("engines: interrupted; what is measured is kept, run again to go on", file=sys.stderr)
        return 130
