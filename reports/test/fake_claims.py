"""Made-up replicates of claims: what a replicate shows depends on its number alone."""

import json
import math
import random
from pathlib import Path

KEY = {
    "stress": "0" * 40,
    "integrate": "1" * 40,
    "sources": "2" * 40,
    "effort": "quick",
    "variants": ["Batch<EigenLLT>"],
    **dict.fromkeys(("compiler", "flags", "isa", "blas"), "none"),
}
CLAIMS = {  # bounds of each check
    "C1": [("exponent", None, 0.2), ("median η", None, 10.0)],
    "C2": [("correlation", 0.95, None), ("ratio", 0.01, 2.0)],
}


def value(what: str, replicate: int) -> float | None:
    """With ties, and with what is no usual number."""
    dice = random.Random(f"{what}/{replicate}")
    rare = dice.choice([None, math.inf, math.nan, 0.5, 0.0, -0.0])
    return rare if dice.random() < 0.3 else dice.gauss(0.5, 1)


def record(first: int, count: int, number=value, key: dict = KEY) -> dict:
    """`number` says what a check measures in a replicate."""
    replicates = range(first, first + count)
    return {
        "format": "kalmarm claims",
        "version": 1,
        "key": key,
        "replicates": [f"{first}+{count}"],
        "claims": [claim(name, checks, replicates, number) for name, checks in CLAIMS.items()],
    }


def claim(name: str, checks: list, replicates: range, number) -> dict:
    numbers = {what: {r: number(what, r) for r in replicates} for what, _, _ in checks}
    verdicts = dict.fromkeys(("confirmed", "refuted", "open"), 0)
    for r in replicates:
        held = [holds(numbers[what][r], low, high) for what, low, high in checks]
        verdicts["refuted" if False in held else "open" if None in held else "confirmed"] += 1
    return {
        "id": name,
        **verdicts,
        "checks": [check(numbers[what], what, low, high) for what, low, high in checks],
    }


def holds(x: float | None, low: float | None, high: float | None) -> bool | None:
    if x is None:
        return None
    return (low is None or x >= low) and (high is None or x <= high)


def check(numbers: dict, what: str, low: float | None, high: float | None) -> dict:
    held = [holds(x, low, high) for x in numbers.values()]
    there = [(x, r) for r, x in numbers.items() if x is not None]
    there.sort(key=lambda pair: (math.isnan(pair[0]), *pair))
    return {
        "what": what,
        "low": low,
        "high": high,
        "holds": held.count(True),
        "fails": held.count(False),
        "absent": held.count(None),
        "measured": [[x if math.isfinite(x) else str(x), r] for x, r in there],
    }


def write(path: Path, document: dict) -> Path:
    path.write_text(json.dumps(document))
    return path
