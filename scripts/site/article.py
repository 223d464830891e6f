#!/usr/bin/env python3
"""The article as a PDF: docs/article/article.typ by Typst, with every number of it read from the example report's data or, where
those do not have it, from a table of docs/. A record that is missing is an error that names it.

Usage: scripts/site/article.py OUT.pdf
"""

import csv
import io
import json
import re
import sys
import tempfile
from pathlib import Path

import typst

sys.path.append(str(Path(__file__).parent))
import measured  # noqa: E402
from measured import ROOT  # noqa: E402

SOURCES = ROOT / "docs/article"

# Of M + JᵀDJ, the variants that are drawn.
CONTACTS = {
    "Batch<EigenLLT>": "Cholesky of H",
    "Sequential<Conventional>": "conventional",
    "Sequential<Joseph>": "Joseph",
    "Sequential<Potter>": "Potter",
    "Sequential<RowsBeside>": "rows beside P",
    "Sequential<UD>": "UD",
}
SQUARE_ROOTS = {
    "Sequential<Joseph>": "Joseph's form",
    "Sequential<UD>": "UD",
    "Sequential<ArrayHouseholder>": "array, reflections",
    "Sequential<ArrayGivens>": "array, rotations",
    "Sequential<ArrayMGS>": "array, Gram-Schmidt",
    "Batch<SparseLTDL>": "L'DL of M",
    "Batch<EigenLLT>": "dense Cholesky of M",
}
FACTORED = ("UD", "array, reflections", "array, rotations", "array, Gram-Schmidt")
# A line of the ladder's table: what it is called there, kind of times, precision, task, variant.
LADDER = (
    ("ladder, default, rows", "batch", "float32", "acceleration_batch", "Ladder<default>"),
    ("ladder, default, rows", "batch", "float64", "acceleration_batch", "Ladder<default>"),
    ("ladder, last bits, rows", "batch", "float64", "acceleration_batch", "Ladder<last_bits>"),
    ("ladder, default", "times", "float64", "acceleration", "Ladder<default>"),
    ("ladder, last bits", "times", "float64", "acceleration", "Ladder<last_bits>"),
    ("conventional filter", "times", "float64", "acceleration", "Sequential<Conventional>"),
    ("dense Cholesky of M", "times", "float64", "acceleration", "Batch<EigenLLT>"),
    ("MuJoCo", "times", "float64", "acceleration", "MuJoCo"),
)


class MissingRecord(Exception):
    pass


def short(value: float | None) -> str:
    return "refused" if value is None else re.sub(r"e[+]?(-?)0?", r"e\1", f"{value:.0e}")


class Pages:
    """The pages of docs/: tables by words of their heads, and sentences."""

    def __init__(self, root: Path):
        self.root = root

    def rows(self, page: str, *heads: str) -> tuple[list[str], list[list[str]]]:
        for head, _, *rows in measured.tables(page, self.root):
            if all(any(one.startswith(word) for one in head) for word in heads):
                return head, [
                    [cell.replace("`", "").replace("\\|", "|") for cell in row] for row in rows
                ]
        raise MissingRecord(f"{page} has no table with {', '.join(heads)}")

    def said(self, page: str, words: str) -> tuple[str, ...]:
        """The numbers of a sentence, `words` with groups."""
        text = " ".join((self.root / page).read_text(encoding="utf-8").split())
        found = list(re.finditer(words, text))
        if len(found) != 1:
            raise MissingRecord(f"{page} says {words!r} {len(found)} times")
        return found[0].groups()


def engines(pages: Pages) -> dict:
    page = "docs/engines.md"
    head, rows = pages.rows(page, "engine", "precision", "arm of 7")
    numbers = {
        precision: [row for row in rows if row[1] == precision]
        for precision in ("float32", "float64")
    }
    (heaviest, *_), loaded = pages.rows(page, "a of the arm with")
    _, arms = pages.rows(page, "engine, float32", "arms", "worst")
    worst = [float(cell) for row in numbers["float64"] for cell in row[2:] if cell[0].isdigit()]
    rounded = next((row for row in numbers["float32"] if row[0] == "Rounded parameters"), None)
    if rounded is None:
        raise MissingRecord(f"{page} has no row of rounded parameters")
    others = [float(row[1]) for row in loaded if not row[0].startswith("Kalmarm")]
    ours = [float(row[1]) for row in loaded if row[0].startswith("Kalmarm")]
    if not others or not ours:
        raise MissingRecord(f"{page} has no errors of the arm with the largest load")
    return {
        "head": head[2:],
        "rows": [[row[0], *row[2:]] for row in numbers["float32"]],
        "worst64": short(max(worst)),
        "rounded": rounded[3],
        "loaded": [[re.split(r",", row[0])[0], short(float(row[1]))] for row in loaded],
        "states": pages.said(page, r"Largest error of a in (\d+) states")[0],
        "load": pages.said(page, r"carries (\S+) times the mass of its last link")[0],
        "heaviest": re.search(r"with (\S+) times", heaviest)[1],
        "drawn": pages.said(
            page,
            r"(\d) to (\d) hinges, .*?, masses from (.*?) to (.*?), lengths from (.*?) to (.*?) \(",
        ),
        "loaded_count": len(others),
        "loaded_least": f"{100 * min(others):.0f}",
        "loaded_most": f"{100 * max(others):.0f}",
        "loaded_ours": short(max(ours)),
        "arms": [row[:4] for row in arms],
    }


def contacts(archive: Path, pages: Pages) -> dict:
    rows = list(csv.DictReader(io.StringIO(measured.files(archive)["contacts-g1.csv"])))
    stiffness = sorted({float(row["stiffness"]) for row in rows})

    def answers(variant: str, precision: str, d: float) -> list[dict[str, str]]:
        key = (variant, precision)
        asked = [
            row
            for row in rows
            if (row["variant"], row["precision"]) == key and float(row["stiffness"]) == d
        ]
        if not asked:
            raise MissingRecord(f"contacts-g1.csv has no {variant} in {precision} at {d:g}")
        return asked

    def worst(variant: str, precision: str, d: float) -> float | None:
        answered = [row for row in answers(variant, precision, d) if row["status"] == "ok"]
        return max((float(row["error"]) for row in answered), default=None)

    def lost(variant: str, precision: str) -> str:
        """The least stiffness with a silent error above 1 %."""
        for d in stiffness:
            for row in answers(variant, precision, d):
                if (row["status"], row["warns"]) == ("ok", "0") and float(row["error"]) > 1e-2:
                    return short(d)
        raise MissingRecord(f"contacts-g1.csv has no silent error of {variant} in {precision}")

    cholesky = answers("Batch<EigenLLT>", "float32", 1e6)
    answered = [
        float(row["error"]) for row in cholesky if row["status"] == "ok" and row["warns"] == "0"
    ]
    head, gpu = pages.rows("docs/contacts.md", "d [kg]", "10²", "10³")
    nan: dict[str, dict[str, str | None]] = {}
    for of, *cells in gpu:
        robot, engine = of.split(", ")
        if engine != "filter":
            nan.setdefault(engine, {})[robot] = next(
                (d for d, cell in zip(head[1:], cells) if "NaN" in cell), None
            )
    if not nan or any(None in one.values() for one in nan.values()):
        raise MissingRecord("docs/contacts.md does not say from which d on engines give NaN")
    filters = [cell.split(", ")[1] for row in gpu if row[0].endswith("filter") for cell in row[1:]]
    return {
        "stiffness": stiffness,
        "lines": {
            name: [worst(variant, "float32", d) for d in stiffness]
            for variant, name in CONTACTS.items()
        },
        "states": len({row["state"] for row in rows}),
        "rows": rows[0]["rows"],
        "digits": pages.said("docs/contacts.md", r"against an array filter in (\d+) digits")[0],
        "digits_of_engines": pages.said("docs/contacts.md", r"states, against (\d+) digits")[0],
        "points": int(rows[0]["rows"]) // 3,
        "stiffest": short(stiffness[-1]),
        "asked_at": short(1e6),
        "wrong": sum(error > 1e-2 for error in answered),
        "refused": sum(row["status"] != "ok" for row in cholesky),
        "lost": lost("Batch<EigenLLT>", "float32"),
        "kept": short(
            max(
                worst(variant, "float32", 1e8)
                for variant in ("Sequential<UD>", "Sequential<ArrayMGS>", "Sequential<ArrayGivens>")
            )
        ),
        "kept_at": short(1e8),
        "double": {
            name: short(worst(variant, "float64", stiffness[-1]))
            for variant, name in CONTACTS.items()
        },
        "nan": [[engine, *by_robot.values()] for engine, by_robot in nan.items()],
        "nan_of": list(next(iter(nan.values()))),
        "filter": max(filters, key=float),
    }


def square_roots(pages: Pages) -> dict:
    head, rows = pages.rows("docs/generated.md", "time of a state [ns], a")
    by_name = {row[0]: row[1:] for row in rows}
    robots = [cell.split(":")[0] for cell in head[1:] if ": operations" in cell]
    plain = by_name["Sequential<Conventional>"]
    lines, factored = [], []
    for variant, name in SQUARE_ROOTS.items():
        if variant not in by_name:
            raise MissingRecord(f"docs/generated.md has no {variant}")
        ratios = [float(x) / float(y) for x, y in zip(by_name[variant], plain)]
        columns = [ratios[i::4] for i in range(4)]  # operations, one state, rows, rows of float32
        lines.append([name, *(f"{min(column):.2g} – {max(column):.2g}" for column in columns)])
        if name in FACTORED:
            factored += [ratio for column in columns[1:] for ratio in column]
    return {
        "robots": robots,
        "rows": lines,
        "timed": pages.said(
            "docs/generated.md",
            r"medians of (\d+) interleaved [^.]*? rows of (\d+) states, (.*?), gcc (\d+), (.*?), while",
        ),
        "least": f"{min(factored):.2g}",
        "most": f"{max(factored):.2g}",
    }


def ladder(archive: Path, pages: Pages) -> dict:
    lines = []
    for name, kind, precision, task, variant in LADDER:
        times = measured.times(kind, "g1", precision, archive)
        median = measured.errors("g1", precision, archive)
        worst = measured.errors("g1", precision, archive, max)
        lines.append(
            [
                name,
                precision,
                f"{times[task, variant]:.3g}",
                short(median[task, variant]),
                short(worst[task, variant]),
            ]
        )
    straight = {
        precision: {
            variant: short(
                measured.errors("straight-127", precision, archive)["acceleration", variant]
            )
            for variant in ("Batch<EigenLLT>", "Sequential<Conventional>", "Ladder<default>")
        }
        for precision in ("float32", "float64")
    }
    _, found = pages.rows("docs/errors.md", "answer without a warning", "promised")
    times = measured.times("times", "g1", "float64", archive)
    task = "acceleration"
    return {
        "rows": lines,
        "straight": straight,
        "found": [[row[0], *row[2:]] for row in found],
        "promised": found[0][1].split("; "),
        "searched": pages.said(
            "docs/errors.md",
            r"chains and trees of (\d+) to (\d+) degrees of freedom with masses over (\w+) decades",
        ),
        "evaluations": pages.said(
            "docs/errors.md", r"(\S+) evaluations each in float32, (\S+) in float64"
        ),
        "constant": pages.said("docs/errors.md", r"a proof needs about (\d+) where (\d+) is used"),
        "over_mujoco": f"{times[task, 'MuJoCo'] / times[task, 'Ladder<default>']:.2g}",
        "last_bits": f"{times[task, 'Ladder<last_bits>'] / times[task, 'Ladder<default>']:.2g}",
    }


def machine(archive: Path) -> dict:
    widths = [
        float(row["value"])
        for name, text in measured.files(archive).items()
        if name.startswith("errors-")
        for row in csv.DictReader(io.StringIO(text))
        if row["measure"] == "truth_width"
    ]
    times = json.loads(measured.files(archive)["times-g1.json"])
    told = times["context"]
    return {
        "cpu": told["cpu"],
        "cores": told["num_cpus"],
        "compiler": told["compiler"],
        "system": told["operating_system"],
        "date": told["date"][:10],
        "revision": told["git_revision"],
        "mujoco": told["mujoco"],
        "repetitions": times["benchmarks"][0]["repetitions"],
        "width": short(max(widths)),
        "scenes": sum(re.match("errors-(?!engines-)", name) is not None for name in measured.files(archive)),
    }


def numbers(archive: Path = measured.ARCHIVE, root: Path = ROOT) -> dict:
    """What the article's text and tables show."""
    pages = Pages(root)
    try:
        return {
            "engines": engines(pages),
            "contacts": contacts(archive, pages),
            "roots": square_roots(pages),
            "ladder": ladder(archive, pages),
            "machine": machine(archive),
        }
    except KeyError as error:
        raise MissingRecord(f"no record of {error.args[0]}") from None


def pdf(told: dict) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        for source in SOURCES.iterdir():
            if source.suffix in (".typ", ".yml"):
                (Path(folder) / source.name).write_bytes(source.read_bytes())
        (Path(folder) / "numbers.json").write_text(json.dumps(told))
        return typst.compile(str(Path(folder) / "article.typ"))


def main() -> int:
    if len(sys.argv) != 2 or sys.argv[1] in ("-h", "--help"):
        print(__doc__)
        return 0 if len(sys.argv) == 2 else 2
    try:
        made = pdf(numbers())
    except MissingRecord as error:
        print(f"article: error: {error}", file=sys.stderr)
        return 2
    Path(sys.argv[1]).write_bytes(made)
    return 0


if __name__ == "__main__":
    sys.exit(main())
