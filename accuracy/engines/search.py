"""The worst silent error of an engine's forward dynamics among arms of ordinary proportions
(arms.py): `scripts/engines --search`.

SciPy's differential evolution maximises the error. All arms are asked about in the same four
random states, rounded to float32 as all mechanisms are, against truth of export_mechanism; an arm's
error is that of the worst state that was answered without a warning. What was asked stands in a
journal: a search that was interrupted, or is given more evaluations, goes on where it stopped.
"""

import csv
import hashlib
import json
import os
import statistics
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import arms
import environments
import mechanisms
import numpy as np
import records
from environments import FOLDER
from measure import HERE, facts, sources
from mechanisms import BadName
from processes import Ended, Worker
from scipy.optimize import differential_evolution
from scipy.stats import qmc

TASK = "acceleration"
POPULATION = 30
STATES = 4
UNANSWERED = 20.0  # in the place of -log10 of an error; above that of any
COLUMNS = (
    "engine,variant,version,precision,seed,evaluations,answered,error,median,hinges,condition,file"
).split(",")


class Judged(NamedTuple):
    error: float | None  # the worst in silence
    state: int = 0
    outcome: str = ""  # of the first state without an error

    @property
    def value(self) -> float:
        return -np.log10(max(self.error, 1e-19)) if self.error is not None else UNANSWERED


class Contender(NamedTuple):
    engine: str
    variant: str
    precision: str

    @property
    def key(self) -> str:
        """Of what makes an error what it is."""
        digest = hashlib.sha256(sources(self.engine) + (HERE / "arms.py").read_bytes())
        digest.update(f"{environments.wanted(self.engine)} {STATES}".encode())
        return digest.hexdigest()

    def name(self, seed: int) -> str:
        return mechanisms.slug(f"{self.variant}-{self.precision}-{seed}")


class Journal:
    """What is known of arms, a line each; begun anew where another adapter wrote it."""

    def __init__(self, path: Path, key: str):
        self.known: dict[tuple, Judged] = {}
        self.version = ""
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_text().splitlines() if path.is_file() else []
        # A line that an interruption cut short is the last one.
        whole = [json.loads(line) for line in lines if line.endswith("}")]
        if whole and whole[0].get("key") == key:
            self.version = whole[0]["version"]
            for line in whole[1:]:
                x = tuple(line.pop("x"))
                self.known[x] = Judged(**line)
        self.path, self.key, self.file = path, key, None

    def begin(self, version: str) -> None:
        part = self.path.with_suffix(".part")
        self.version = version
        head = json.dumps({"key": self.key, "version": version})
        lines = [json.dumps({"x": x, **judged._asdict()}) for x, judged in self.known.items()]
        part.write_text("\n".join([head, *lines]) + "\n")
        part.replace(self.path)
        self.file = self.path.open("a")

    def add(self, x: tuple, judged: Judged) -> None:
        self.known[x] = judged
        self.file.write(json.dumps({"x": x, **judged._asdict()}) + "\n")
        self.file.flush()


def export(x, seed: int, folder: Path) -> str:
    """The arm's files in `folder`; what is wrong with it, in a line."""
    folder.mkdir(parents=True, exist_ok=True)
    source = folder / "arm.xml"
    source.write_text(arms.mjcf(arms.decode(x)))
    drawn = ["--random", str(STATES), "--seed", str(seed)]
    environment = {**os.environ, "KALMARM_CACHE": ""}  # no arm is asked about twice
    return mechanisms.export([source, *drawn, "--out", folder], environment)


class Served:
    """The engine in a process that is asked about one arm after another, and begun anew after it
    died or hung."""

    def __init__(self, contender: Contender, python: Path, limit: float):
        its = [contender.engine, contender.variant, contender.precision]
        self.command = [
            python,
            HERE / "worker.py",
            *its,
            "-",
            "--tasks",
            TASK,
            "--seconds",
            "0",
            "--eager",
        ]
        self.limit, self.worker, self.version = limit, None, ""

    def __enter__(self) -> "Served":
        return self

    def __exit__(self, *_) -> None:
        if self.worker:
            self.worker.__exit__()
            self.worker = None

    def judge(self, folder: Path) -> Judged:
        if not self.worker:
            self.worker = Worker(self.command, self.limit, asked=True)
        said = []
        try:
            self.worker.ask(folder)
            said.extend(self.worker.lines())
            outcome = "" if said and "done" in said[-1] else "crashed: no answer"
        except Ended as how:
            outcome = str(how)
        if outcome:
            self.__exit__()
            return Judged(None, 0, outcome)
        self.version = next((one["version"] for one in said if "version" in one), self.version)
        return judged(said)


def judged(said: list[dict]) -> Judged:
    silent = [
        (one["error"], one["state"])
        for one in said
        if "error" in one and one.get("outcome") != "warned"
    ]
    outcome = next(
        (
            one.get("outcome") or one.get("refused", "")
            for one in said
            if "outcome" in one or "refused" in one
        ),
        "",
    )
    return Judged(*max(silent), outcome) if silent else Judged(None, 0, outcome)


def maximise(judge_all, evaluations: int, seed: int) -> None:
    """Differential evolution of `judge_all`, which gives -log10 of errors of a list of arms, in
    whole generations, at least one. The same arms for the same seed and errors; more evaluations
    go on where fewer ended."""
    first = qmc.LatinHypercube(arms.LENGTH, rng=seed).random(POPULATION)
    differential_evolution(
        lambda columns: np.array(judge_all(columns.T.tolist())),
        [(0.0, 1.0)] * arms.LENGTH,
        init=first,
        maxiter=max(0, evaluations // POPULATION - 1),
        tol=0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=seed,
    )


def search(
    contender: Contender, python: Path, evaluations: int, seed: int, limit: float
) -> Journal:
    journal = Journal(FOLDER / "search" / f"{contender.name(seed)}.jsonl", contender.key)
    with (
        tempfile.TemporaryDirectory() as work,
        Served(contender, python, limit) as served,
        ThreadPoolExecutor(2) as pool,
    ):

        def judge_all(population: list) -> list[float]:
            rows = [tuple(x) for x in population]
            todo = [x for x in dict.fromkeys(rows) if x not in journal.known]
            folders = [Path(work) / str(i) for i in range(len(todo))]
            written = pool.map(lambda x, folder: export(x, seed, folder), todo, folders)
            for x, folder, why in zip(todo, folders, written, strict=True):
                result = Judged(None, 0, f"no truth: {why}") if why else served.judge(folder)
                if not journal.file:
                    journal.begin(served.version or journal.version)
                journal.add(x, result)
            return [journal.known[x].value for x in rows]

        maximise(judge_all, evaluations, seed)
    return journal


def keep(contender: Contender, journal: Journal, seed: int, out: Path) -> dict:
    """The worst arm as NAME.xml and NAME.json in `out`, and its row."""
    x, worst = max(journal.known.items(), key=lambda one: one[1].error or 0.0)
    errors = [one.error for one in journal.known.values() if one.error is not None]
    if not errors:
        raise BadName(f"{contender.variant}: no arm was answered: {worst.outcome}")
    name = mechanisms.slug(f"{contender.variant}-{contender.precision}")
    with tempfile.TemporaryDirectory() as work:
        if why := export(x, seed, Path(work)):
            raise BadName(why)
        text = (Path(work) / "arm.xml").read_text()
        truth = json.loads((Path(work) / "truth.json").read_text())
    state = truth["states"][worst.state]
    M = np.array(state["truth"]["mass"])
    size = np.sqrt(np.diag(M))
    out.mkdir(parents=True, exist_ok=True)
    (out / f"{name}.xml").write_text(text)
    given = {key: state[key] for key in ("qpos", "qvel", "tau")}
    (out / f"{name}.json").write_text(json.dumps({"states": [given]}) + "\n")
    return {
        "engine": contender.engine,
        "variant": contender.variant,
        "version": journal.version,
        "precision": contender.precision,
        "seed": str(seed),
        "evaluations": str(len(journal.known)),
        "answered": str(len(errors)),
        "error": records.number(worst.error),
        "median": records.number(statistics.median(errors)),
        "hinges": str(truth["nv"]),
        "condition": f"{np.linalg.cond(M / np.outer(size, size)):.3g}",
        "file": name,
    }


def record(row: dict, out: Path) -> None:
    """In found.csv, in the place of an older one of the same file."""
    path = out / "found.csv"
    rows = []
    if path.is_file():
        with path.open(newline="") as file:
            rows = [old for old in csv.DictReader(file) if old["file"] != row["file"]]
    rows = sorted([*rows, row], key=lambda one: one["file"])
    records.write(path, COLUMNS, [[one[column] for column in COLUMNS] for one in rows])


def contenders(engine: str) -> list[Contender]:
    """In the lower of its precisions: errors of float64 are small on such arms."""
    its = facts(engine)
    precision = "float32" if "float32" in its.precisions else "float64"
    return [Contender(engine, variant, precision) for variant in its.variants]


def run(engines: list[str], evaluations: int, seed: int, limit: float, out: Path) -> int:
    absent = 0
    for engine in engines:
        try:
            python = environments.prepare(engine)
        except environments.Missing as why:
            absent += 1
            print(f"engines: {engine}: {why}", file=sys.stderr)
            continue
        for contender in contenders(engine):
            journal = search(contender, python, evaluations, seed, limit)
            row = keep(contender, journal, seed, out)
            record(row, out)
            print(
                f"{row['variant']} {row['version']} {row['precision']}: worst "
                f"{float(row['error']):.1e}, median {float(row['median']):.1e}, "
                f"{row['answered']} of {row['evaluations']} arms answered: {row['file']}.xml",
                flush=True,
            )
    return 1 if absent else 0
