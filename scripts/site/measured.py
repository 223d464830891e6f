"""What a report measured, the committed example unless another is named: medians of times and errors, by variant."""

import csv
import io
import json
import re
import statistics
import tarfile
from functools import cache
from pathlib import Path

ARCHIVE = Path(__file__).parents[2] / "reports/example/data.tar.xz"
OTHER_TOLERANCES = re.compile(r"Ladder<\d|Rung")  # exhibits, which the report draws by themselves


@cache
def files(archive: Path) -> dict[str, str]:
    with tarfile.open(archive) as members:
        return {
            Path(member.name).name: members.extractfile(member).read().decode()
            for member in members
            if member.isfile() and Path(member.name).name.startswith(("errors-", "times-", "batch-"))
        }


def times(
    kind: str, scene: str, precision: str, archive: Path = ARCHIVE
) -> dict[tuple[str, str], float]:
    """Median time [µs] by task and variant; of a batch that of a state. kind: "times" or "batch"."""
    name = f"{kind}-{scene}.json"
    found = {}
    for one in json.loads(files(archive)[name])["benchmarks"]:
        task, variant, _, of, *_ = one["run_name"].split("/")
        if one.get("aggregate_name") == "median" and of == precision:
            seconds = one.get("s/state", 1e-9 * one["cpu_time"])
            found[task, variant] = 1e6 * seconds
    return found


def errors(scene: str, precision: str) -> dict[tuple[str, str], float | None]:
    """Median relative error by task and variant; None where half of the states or more have no answer."""
    rows: dict[tuple[str, str], list[float]] = {}
    for row in csv.DictReader(io.StringIO(files(ARCHIVE)[f"errors-{scene}.csv"])):
        if row["precision"] == precision and row["measure"] == "relative":
            answered = row["outcome"] == "ok"
            rows.setdefault((row["task"], row["variant"]), []).append(
                float(row["value"]) if answered else float("inf")
            )
    medians = {key: statistics.median(values) for key, values in rows.items()}
    return {key: value if value < float("inf") else None for key, value in medians.items()}


def has(robot: str) -> bool:
    return f"times-{robot}.json" in files(ARCHIVE)


def table(robot: str) -> str:
    """Of one robot: every contender, fastest first."""
    lines = [
        "| variant | a [µs] | M⁻¹ [µs] | median relative error of a | of M⁻¹ |",
        "|---|---|---|---|---|",
    ]
    took, wrong = times("times", robot, "float64"), errors(robot, "float64")
    variants = {
        variant: time
        for (task, variant), time in took.items()
        if task == "acceleration" and not OTHER_TOLERANCES.match(variant)
    }
    for variant, time in sorted(variants.items(), key=lambda one: one[1]):
        cells = [f"{time:.3g}"]
        inverse = took.get(("inverse", variant))
        cells.append("" if inverse is None else f"{inverse:.3g}")
        for task in ("acceleration", "inverse"):
            error = wrong.get((task, variant), "")
            cells.append("refused" if error is None else error and f"{error:.0e}")
        lines.append(f"| `{variant}` | {' | '.join(cells)} |")
    return "\n".join(lines)
