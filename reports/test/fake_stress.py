#!/usr/bin/env python3
"""Writes made-up records of the program stress, whose errors follow exact laws:
`fake_stress.py DIR`. As they stand they confirm every claim that needs no times."""

import csv
import functools
import io
import json
import math
import sys
from collections.abc import Iterable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from read.stress import COLUMNS, Integration, U  # noqa: E402

KS = 10.0
SCATTER = {1: 1.0, 2: 0.5, 3: 2.0}  # by seed: the median is the law itself
CHOLESKY = "Batch<EigenLLT>"
FILTERS = "Conventional Joseph Zeroed Potter ArrayHouseholder UD ArrayMGS ArrayGivens".split()
FRAMES = ["Conventional", "Joseph", "ArrayMGS"]
PLAIN = [CHOLESKY, *(f"Sequential<{update}>" for update in FILTERS)]
VARIANTS = [
    *PLAIN,
    *(f"Sequential<WorldOrigin<{update}>>" for update in FRAMES),
    "FactoredBias<ArrayMGS>",
    "FactoredBias<ArrayGivens>",
    "Scan<Conventional>",
    "Scan<SquareRoot>",
    *(f"Refined<{variant}>" for variant in (CHOLESKY, "Sequential<Conventional>")),
    "Refined<Sequential<ArrayMGS>>",
]
CONTENDERS = [
    CHOLESKY,
    "Sequential<Conventional>",
    "Sequential<ArrayMGS>",
    "FactoredBias<ArrayGivens>",
]
INVERTING = [CHOLESKY, "ClosedForm<Conventional>", "ClosedForm<ArrayMGS>"]
LENGTHS = [4, 8, 16, 32, 64, 128, 256, 512, 1024]
RATIOS = [10.0**k for k in range(21)]
FAMILIES = {  # kind, parameter, description, values
    "straight": ("long_chain", "N", "a straight chain", LENGTHS),
    "random_chain": ("long_chain", "N", "joints and links at random", LENGTHS),
    "heavy_tip": ("heavy_outboard", "mass ratio", "a heavy last link", RATIOS),
    "heavy_point": ("heavy_outboard", "mass ratio", "a heavy point mass", RATIOS),
    "heavy_base": ("heavy_inboard", "mass ratio", "a heavy first link", RATIOS),
    "taper": ("heavy_inboard", "ratio of lengths", "ever smaller links", [1.0, 1e2, 1e4]),
    "base_offset": ("uneven_lengths", "offset", "the base far away", [10.0**k for k in range(9)]),
    "axis_gap": (
        "near_parallel_axes",
        "gap",
        "nearly coaxial joints",
        [10.0**-k for k in range(1, 7)],
    ),
    "non_minimum_phase": (
        "inboard_com",
        "inertia",
        "inboard centres of mass",
        [10.0**-k for k in range(4, 17)],
    ),
    "non_minimum_phase_length": (
        "inboard_com",
        "N",
        "inboard point masses",
        [4, 8, 16, 32, 64, 96],
    ),
    "gimbal_lock": ("singular", "angle", "a gimbal near its lock", [0.0, 1e-6, 1e-3]),
    "panda_payload": ("robot", "payload, kg", "a Panda with a load", [0.1, 1.0, 10.0]),
    "wild": ("wild", "", "everything at random", [0.0]),
}
WILD_SEEDS = 40
WORLD = {"Conventional": 2, "Joseph": 4, "ArrayMGS": 1}
CALLS = {1: 134, 2: 164, 3: 296}
STALLS = {CHOLESKY: 1e10, "Sequential<Conventional>": 1e11, "Sequential<ArrayMGS>": 1e12}


def conditions(family: str, x: float) -> tuple[float, float]:
    """kappa of M, and of M scaled."""
    if family in ("straight", "random_chain"):
        return 3.8 * x**4, x**4
    if family in ("heavy_tip", "heavy_point"):
        return 50 * x, 5 * x
    if family == "heavy_base":
        return 9 * x, 90.0
    if family == "taper":
        return 20 * x**4, 3.0
    if family in ("axis_gap", "gimbal_lock"):
        return (40 / x**2, 20 / x**2) if x else (math.inf, math.inf)
    if family.startswith("non_minimum_phase_length"):
        return (7 / 3) ** (2 * x), (7 / 3) ** (2 * x)
    if family == "non_minimum_phase":
        return 1e4 / x, 1e4 / x
    return 1e3, 1e2


def law(family: str, x: float, precision: str, task: str, variant: str) -> float:
    """The relative error, of the median seed."""
    u = U[precision]
    flat = 5 * u
    if variant.startswith("Refined<"):
        before = law(family, x, precision, task, variant.removeprefix("Refined<")[:-1])
        return max(flat, before**2) if before < 0.1 else before
    kappa, scaled = conditions(family, x)
    if task == "consistent":
        return max(flat, 0.1 * u * kappa)
    if variant == CHOLESKY:
        return max(u, 0.1 * u * scaled)
    update = variant.split("<")[-1].rstrip(">")
    if "World" in variant:
        return max(flat, u * x ** WORLD[update]) if family == "base_offset" else flat
    covariance = update in ("Conventional", "Joseph")
    if family in ("heavy_tip", "heavy_point"):
        if task == "dynamics" and not variant.startswith("FactoredBias<"):
            covariance = True
        if covariance:
            return max(flat, 0.3 * u * x)
        if family == "heavy_point" and update in ("Potter", "ArrayHouseholder"):
            return max(flat, u * math.sqrt(x))
        return max(flat, 5 * u * u * x) if update in ("ArrayMGS", "UD") else flat
    if family in ("axis_gap", "gimbal_lock") and update != "Zeroed" and x:
        return flat / x
    if family == "non_minimum_phase" and covariance:
        return max(flat, 0.02 * u / x)
    return flat


def tasks(family: str) -> dict[str, list[str]]:
    """Task and its variants."""
    if family in ("straight", "random_chain"):
        return {"random": VARIANTS, "consistent": PLAIN}
    if family == "heavy_tip":
        return {"random": VARIANTS, "dynamics": VARIANTS, "inverse": INVERTING}
    if family == "wild":
        return {"white": VARIANTS}
    return {"random": VARIANTS}


def record(family, x, seed, precision, task, variant) -> dict:
    """A row of the file."""
    kappa, scaled = conditions(family, x)
    row = dict.fromkeys(COLUMNS, "") | {
        "family": family,
        "value": x,
        "n": int(x) if family in ("straight", "random_chain") else 12,
        "seed": seed,
        "precision": precision,
        "task": task,
        "kappa": kappa,
        "kappa_scaled": scaled,
        "kS": "" if task == "inverse" else KS,
        "variant": variant,
    }
    if family == "gimbal_lock" and x == 0:
        return row | {"status": "ok" if variant == CHOLESKY else "singular"}
    scatter = SCATTER.get(seed, 1 + seed % 7)
    relative = law(family, x, precision, task, variant) * scatter
    if relative > 1 and CHOLESKY in variant:
        return row | {"status": "indefinite"}
    relative = min(relative, 1.0)
    u = U[precision]
    row |= {
        "status": "ok",
        "relative": relative,
        "energy": relative,
        "componentwise": 3 * relative,
        "backward": 0.5 * u * (scaled if task == "inverse" else 1),
        "oettli_prager": 0.4 * u * (2 if CHOLESKY in variant else 1),
        "eta": "" if task == "inverse" else relative / (u * KS),
        "estimate": 1.5 * relative,
    }
    if variant.startswith("Refined<"):
        inner = variant.removeprefix("Refined<")[:-1]
        before = law(family, x, precision, task, inner) * scatter
        row |= {"unrefined": min(before, 1.0), "steps": int(before < 0.1), "widened": 0}
    return row


def records() -> list[dict]:
    return [
        record(family, x, seed, precision, task, variant)
        for family, (*_, values) in FAMILIES.items()
        for task, variants in tasks(family).items()
        for x in values
        for precision in U
        for variant in variants
        for seed in (range(1, WILD_SEEDS + 1) if family == "wild" else SCATTER)
    ]


def integrations() -> list[dict]:
    rows = []
    for variant in ("FactoredBias<ArrayMGS>", *STALLS):
        for rho in RATIOS[:15]:
            for seed, calls in CALLS.items():
                stalled = rho > 10 * STALLS.get(variant, math.inf)
                grown = calls * (1 + rho / STALLS.get(variant, math.inf))
                values = ("heavy_tip", rho, 8, seed, "float64", variant)
                calls_made = 6000 if stalled else round(grown)
                rows.append(
                    dict(zip(Integration._fields, (*values, calls_made, int(not stalled), 1e-12)))
                )
    return rows


def described() -> dict:
    return {
        "families": [
            {
                "name": name,
                "kind": kind,
                "parameter": parameter,
                "describes": text,
                "singular": kind == "singular",
            }
            for name, (kind, parameter, text, _) in FAMILIES.items()
        ],
        "variants": [variant(name) for name in dict.fromkeys([*VARIANTS, *INVERTING])],
    }


def variant(name: str) -> dict:
    """As the registry says it of the real ones."""
    kinds = {
        "Batch": "batch",
        "Sequential": "sequential",
        "FactoredBias": "factored_bias",
        "ClosedForm": "closed_form",
        "Refined": "refined",
        "Scan": "scan",
    }
    kind = kinds[name.split("<")[0]]
    return {
        "name": name,
        "equation": "(3.6)",
        "kind": kind,
        "contender": name in CONTENDERS,
        "in_world_frame": "World" in name,
        "dense": kind in ("batch", "closed_form"),
        "mixed_precision": False,
        "tolerance": None,
        "citation": "a paper",
    }


def line(row: dict) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(row.values())
    return text.getvalue()


@functools.cache  # seventy tests change a few rows each
def lines(rows) -> list[tuple[dict, str]]:
    return [(row, line(row)) for row in rows()]


def write_csv(path: Path, names: Iterable[str], rows: list[str]) -> None:
    path.write_text(line(dict(zip(names, names))) + "".join(rows))


def write(folder: Path, change=None) -> None:
    """`change` makes another row of a row, or None to leave it out."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, rows in (("stress", records), ("integration", integrations)):
        kept = []
        for row, text in lines(rows):
            if new := change(dict(row)) if change else row:
                kept.append(text if new == row else line(new))
        middle = len(kept) // 2
        for shard, part in enumerate((kept[:middle], kept[middle:])):
            if part:
                write_csv(folder / f"{name}-{shard}.csv", row, part)
    (folder / "families-stress.json").write_text(json.dumps(described()))


if __name__ == "__main__":
    write(Path(sys.argv[1]))
