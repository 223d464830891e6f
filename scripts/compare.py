"""Compares times before a change (A) and after it (B), as Google Benchmark wrote them.

Per benchmark: medians of A and B, their ratio B/A, the two-sided p of Mann and Whitney's rank
test, and a verdict: a change is one of more than 2 % with p < 0.01, which takes 5 repetitions or
more of each. Exit code: 0; with --fail-on-slower 1 where something got slower or fails now; 2 on
bad input.
"""

import argparse
import json
import math
import statistics
import sys
from pathlib import Path
from typing import NamedTuple

from scipy.stats import mannwhitneyu

sys.path.append(str(Path(__file__).parent.parent / "reports"))
from charts.text import time_text  # noqa: E402
from read.benchmarks import NANOSECONDS  # noqa: E402

SIGNIFICANT = 0.01
RELEVANT = 0.02
SAME = {  # keys of the context that must not differ, and what they are of
    "cpu": "processor",
    "num_cpus": "processor",
    "compiler": "build",
    "flags": "build",
    "library_build_type": "build",
}
FASTER, SLOWER, FAILS = "faster", "SLOWER", "FAILS"
NO_CHANGE, TOO_FEW = "no change", "too few repetitions"


class BadInput(Exception):
    """Ends the program with the message as its only line."""


class Side:
    """The timings of one side: of one file, or of all files of a folder together."""

    def __init__(self, path: Path):
        self.times: dict[str, list[float]] = {}  # ns, one a repetition
        self.allocations: dict[str, float] = {}  # of a call, the most of all repetitions
        self.failed: set[str] = set()
        self.contexts: list[dict] = []
        files = sorted(path.glob("*.json")) if path.is_dir() else [path]
        for file in files:
            self._read(file)
        if not (self.times or self.failed):
            what = "no single repetitions, perhaps aggregates only" if files else "no JSON file"
            raise BadInput(f"{path}: {what}")

    def _read(self, file: Path) -> None:
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
            self.contexts.append(dict(document.get("context", {})))
            for row in document["benchmarks"]:
                if row.get("run_type", "iteration") == "iteration":
                    self._add(row)
        except OSError as error:
            raise BadInput(f"{file}: {error.strerror}") from None
        except KeyError as error:
            raise BadInput(f"{file}: not Google Benchmark's JSON: no {error}") from None
        except (TypeError, ValueError, AttributeError) as error:
            raise BadInput(f"{file}: not Google Benchmark's JSON: {error}") from None

    def _add(self, row: dict) -> None:
        name = row.get("run_name", row["name"])
        if row.get("error_occurred"):
            self.failed.add(name)
            return
        time = float(row["real_time"]) * NANOSECONDS[row.get("time_unit", "ns")]
        if not (math.isfinite(time) and time > 0):
            raise ValueError(f"'{name}' took {row['real_time']}")
        self.times.setdefault(name, []).append(time)
        if "allocations" in row:
            count = float(row["allocations"])
            self.allocations[name] = max(count, self.allocations.get(name, count))

    @property
    def names(self) -> set[str]:
        return self.failed | self.times.keys()


class Comparison(NamedTuple):
    name: str
    before: float  # ns, median
    after: float
    p: float
    verdict: str

    @property
    def ratio(self) -> float:
        return self.after / self.before


def compare(name: str, before: list[float], after: list[float]) -> Comparison:
    medians = statistics.median(before), statistics.median(after)
    p = float(mannwhitneyu(before, after, alternative="two-sided").pvalue)
    ratio = medians[1] / medians[0]
    # The least p of so many repetitions is that of two samples that do not overlap.
    if 2 / math.comb(len(before) + len(after), len(before)) >= SIGNIFICANT:
        verdict = TOO_FEW
    elif p >= SIGNIFICANT or abs(ratio - 1) <= RELEVANT:
        verdict = NO_CHANGE
    else:
        verdict = SLOWER if ratio > 1 else FASTER
    return Comparison(name, *medians, p, verdict)


def warnings(a: Side, b: Side) -> list[str]:
    result = []
    for key, what in SAME.items():
        values = {str(context.get(key, "unknown")) for context in a.contexts + b.contexts}
        if len(values) > 1:
            result.append(f"another {what}: {key} is {' | '.join(sorted(values))}")
    for side, other, letter in ((a, b, "A"), (b, a, "B")):
        if alone := sorted(side.names - other.names):
            result.append(f"in {letter} alone, not compared: {', '.join(alone)}")
    if broken := sorted(a.failed & b.names):
        result.append(f"failed in A, not compared: {', '.join(broken)}")
    return result


def table(comparisons: list[Comparison], a: Side, b: Side) -> list[str]:
    width = max(len(it.name) for it in comparisons)
    lines = [f"{'benchmark':{width}}  {'A':>8}  {'B':>8}  {'B/A':>6}  {'p':>7}  verdict"]
    for it in comparisons:
        line = f"{it.name:{width}}  {time_text(it.before):>8}  {time_text(it.after):>8}"
        line += f"  {it.ratio:6.3f}  {it.p:7.2g}  {it.verdict}"
        counts = [side.allocations.get(it.name) for side in (a, b)]
        if None not in counts and counts[0] != counts[1]:
            line += f", allocations {counts[0]:g} -> {counts[1]:g}"
        lines.append(line)
    return lines


def run(options: argparse.Namespace) -> int:
    a, b = Side(options.A), Side(options.B)
    if not a.names & b.names:
        raise BadInput(f"{options.A} and {options.B} have no benchmark in common")
    for warning in warnings(a, b):
        print(f"bench_compare: warning: {warning}", file=sys.stderr)
    timed = (a.times.keys() - a.failed) & (b.times.keys() - b.failed)
    comparisons = [compare(name, a.times[name], b.times[name]) for name in timed]
    comparisons.sort(key=lambda it: (it.ratio, it.name))
    broken = sorted((a.times.keys() - a.failed) & b.failed)
    if comparisons:
        print("\n".join(table(comparisons, a, b)))
    for name in broken:
        print(f"{name}  {FAILS} in B")
    verdicts = [it.verdict for it in comparisons] + [FAILS] * len(broken)
    kinds = (FASTER, SLOWER, FAILS, NO_CHANGE, TOO_FEW)
    counts = [f"{verdicts.count(kind)} {kind}" for kind in kinds if kind in verdicts]
    print(", ".join(counts) or "nothing compared")
    worse = SLOWER in verdicts or FAILS in verdicts
    return 1 if options.fail_on_slower and worse else 0


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        "bench_compare",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--fail-on-slower", action="store_true", help="exit 1 if so")
    of = "a file with repetitions, or a folder of such files, taken together"
    parser.add_argument("A", type=Path, help=f"before: {of}")
    parser.add_argument("B", type=Path, help="after: the same")
    try:
        return run(parser.parse_args(arguments))
    except BadInput as error:
        print(f"bench_compare: error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
