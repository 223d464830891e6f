"""What a report measured, the committed example unless another is named: medians of times and errors, by variant."""

import csv
import io
import json
import re
import statistics
import tarfile
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
ARCHIVE = ROOT / "reports/example/data.tar.xz"
OTHER_TOLERANCES = re.compile(r"Ladder<\d|Rung")  # exhibits, which the report draws by themselves
KINDS = ("errors-", "times-", "batch-", "contacts-", "standing-")


@cache
def files(archive: Path) -> dict[str, str]:
    with tarfile.open(archive) as members:
        return {
            Path(member.name).name: members.extractfile(member).read().decode()
            for member in members
            if member.isfile() and Path(member.name).name.startswith(KINDS)
        }


def tables(page: str, root: Path = ROOT) -> list[list[list[str]]]:
    """Cells of every table of a Markdown page, its head and the line below it among the rows."""
    blocks = re.findall(r"(?:^\|.*\n)+", (root / page).read_text(encoding="utf-8"), re.MULTILINE)
    return [
        [re.split(r" *(?<!\\)\| *", line[1:-1].strip()) for line in block.splitlines()]
        for block in blocks
    ]


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


def errors(
    scene: str, precision: str, archive: Path = ARCHIVE, take=statistics.median
) -> dict[tuple[str, str], float | None]:
    """Median relative error by task and variant, or what else is taken; None where it is that of a state without an answer."""
    rows: dict[tuple[str, str], list[float]] = {}
    for row in csv.DictReader(io.StringIO(files(archive)[f"errors-{scene}.csv"])):
        if row["precision"] == precision and row["measure"] == "relative":
            answered = row["outcome"] == "ok"
            rows.setdefault((row["task"], row["variant"]), []).append(
                float(row["value"]) if answered else float("inf")
            )
    taken = {key: take(values) for key, values in rows.items()}
    return {key: value if value < float("inf") else None for key, value in taken.items()}


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
