"""Searches for the worst mechanism that exchange what they find.

Of each variant and precision some islands search by seeds of their own. Those of a generation start
from the best of all islands of the generation before; one in four starts anew, so that not all end
at one mechanism. What an island finds depends on its options and those files alone.
"""

import argparse
import csv
import io
import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from found import Found
from plan import Plan, last_line, sha1
from read.checks import read_json, refusing
from read.data import DataError
from read.search import COLUMNS, ISLANDS, OBJECTIVES, TASKS
from read.stress import U
from read.values import Count, Number, Size, reading, record
from wild import whole

NAME, HELP = "adversary", "searches for the worst that exchange what they find"
PROGRAMS = ("adversary",)  # the worker first
made_by = sha1
RESULT = "adversary-islands.csv"
VARIANTS = ("Ladder<default>", "AxisFrames<SquareRoot>", "Ladder<last_bits>")
ANEW = 4  # one island in so many


@dataclass(frozen=True)
class Island:
    variant: str
    precision: str
    generation: int
    number: int
    seed: int

    @property
    def name(self) -> str:
        words = re.sub(r"[^A-Za-z0-9]+", "-", self.variant).strip("-")
        return f"{words}-{self.precision}-generation-{self.generation}-island-{self.number}"

    @property
    def anew(self) -> bool:
        return self.generation == 0 or self.number % ANEW == ANEW - 1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--variant", action="append", help="several times; default: the fast path's")
    add("--precision", default="float32,float64")
    add("--task", choices=TASKS, default="acceleration")
    add("--objective", choices=OBJECTIVES, default="error")
    add("--islands", type=whole, default=8)
    add("--generations", type=whole, default=5)
    add("--evaluations", type=whole, default=2000, help="of an island in a generation")
    add("--seed", type=whole, default=1)


def asked(options: argparse.Namespace) -> dict:
    variants, precisions = (sorted(set(names)) for names in _names(options))
    if unknown := set(precisions) - set(U):
        raise DataError(f"precision '{min(unknown)}' is none of {', '.join(U)}")
    numbers = ("task", "objective", "islands", "generations", "evaluations", "seed")
    own = {name: getattr(options, name) for name in numbers}
    return own | {"variants": variants, "precisions": precisions}


def _names(options: argparse.Namespace) -> tuple[list[str], list[str]]:
    return options.variant or list(VARIANTS), options.precision.split(",")


def islands(asked: dict) -> list[Island]:
    """Two islands of a search never have one seed."""
    return [
        Island(variant, precision, generation, i, asked["seed"] + generation * asked["islands"] + i)
        for variant in asked["variants"]
        for precision in asked["precisions"]
        for generation in range(asked["generations"])
        for i in range(asked["islands"])
    ]


def made(options: argparse.Namespace, worker: Path) -> Plan:
    own = asked(options)
    jobs, needs = {}, {}
    before: dict[tuple, list[str]] = {}
    for island in islands(own):
        of = island.variant, island.precision
        before.setdefault((*of, island.generation + 1), []).append(island.name)
        needed = [] if island.anew else before[*of, island.generation]
        jobs[island.name] = [
            *_options(island, own),
            *(f"--from=units/{name}.json" for name in needed),
        ]
        needs[island.name] = needed
    return Plan(
        made_by(worker), own, jobs, "--out", key=_key(worker, islands(own)[0], own), needs=needs
    )


def _options(island: Island, asked: dict) -> list[str]:
    return [
        f"--unit={island.seed}+{asked['evaluations']}",
        f"--variant={island.variant}",
        f"--precision={island.precision}",
        f"--task={asked['task']}",
        f"--objective={asked['objective']}",
        "--method=search",
    ]


def _key(worker: Path, island: Island, asked: dict) -> dict:
    """Of what the worker writes, from a search that is as short as it can be."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "probe.json"
        short = _options(island, asked | {"evaluations": 1})
        done = subprocess.run(
            [worker, *short, f"--out={out}"], check=False, capture_output=True, text=True
        )
        if done.returncode:
            raise DataError(f"{island.name}: {last_line(done.stderr)}")
        return _made(read_json(out)["key"])


def _made(key: dict) -> dict:
    """By what, whatever was searched for."""
    return {name: value for name, value in key.items() if name != "search"}


@record
class Worst(NamedTuple):
    """Of the mechanisms that an island has judged."""

    value: Number
    error: Size | None
    kS: Size | None  # noqa: N815
    nv: Count


_worst, _count = reading(Worst), reading(Count)


class Best(Found):
    """The largest error of each generation, and the mechanisms judged until then."""

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder)
        self.islands = {island.name: island for island in islands(plan.asked)}
        if self.islands.keys() != plan.jobs.keys():
            raise ValueError("its jobs are not those of what was asked")
        self.records: dict[str, dict] = {}

    def take(self, name: str, file: Path) -> None:
        document, island = read_json(file), self.islands[name]
        with refusing(file, "an island"):
            if (document["format"], document["version"]) != ("kalmarm island", 1):
                raise ValueError(f"format is {document['format']!r} {document['version']!r}")
            if _made(document["key"]) != self.plan.key:
                raise ValueError(f"another program or build: {document['key']}")
            search = document["key"]["search"]
            of = island.variant, island.precision
            if (search["variant"], search["precision"], document["unit"]["seed"]) != (
                *of,
                island.seed,
            ):
                raise ValueError(f"it is the search of {search}, {document['unit']}")
            self.records[name] = {
                "evaluations": _count(document["evaluations"]),
                "best": [self._checked(entry) for entry in document["best"]],
            }

    def _checked(self, entry: dict) -> dict:
        """The ratio to what was claimed, where that was searched for."""
        what = "excess" if self.plan.asked["objective"] == "claim" else "error"
        return _worst(entry | {"error": entry[what]})._asdict()

    def result(self) -> str:
        """As `adversary --csv` writes it, a row a generation."""
        text = io.StringIO()
        table = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
        table.writeheader()
        judged: dict[tuple, int] = {}
        best: dict[tuple, dict] = {}
        rows: dict[tuple, dict] = {}
        for name, island in self.islands.items():
            of = island.variant, island.precision
            record = self.records[name]
            judged[of] = judged.get(of, 0) + record["evaluations"]
            found = [entry for entry in record["best"] if entry["error"]]
            found += [best[of]] if of in best else []
            if found:
                best[of] = max(found, key=lambda entry: entry["value"])
            rows[*of, island.generation] = self._row(island, judged[of], best.get(of, {}))
        table.writerows(rows.values())
        return text.getvalue()

    def _row(self, island: Island, judged: int, best: dict) -> dict:
        asked = self.plan.asked
        row = {"variant": island.variant, "precision": island.precision, "task": asked["task"]}
        row |= {
            "objective": asked["objective"],
            "kernel": "spatial",
            "rows": 0,
            "seed": asked["seed"],
        }
        row |= {"method": ISLANDS, "evaluations": judged}
        return row | {name: best.get(name) for name in ("error", "kS", "nv")}

    def total(self) -> str:
        return f"{sum(record['evaluations'] for record in self.records.values())} mechanisms judged"


FOUND = Best
