"""Made-up units of a campaign: an answer depends on its mechanism alone, as a real worker's does."""

import json
import math
import random
from collections import Counter
from pathlib import Path

TASKS = ("dynamics", "white")
VARIANTS = ("Ladder<last_bits>", "Ladder<default>")
PRECISIONS = ("float32", "float64")
U = {"float32": 2.0**-24, "float64": 2.0**-53}
WORST = 5
ORDER = ("family", "value", "seed", "task", "variant", "precision")


def key(program: str = "0" * 40) -> dict:
    campaign = {"variants": list(VARIANTS), "precisions": list(PRECISIONS), "tasks": list(TASKS)}
    made = {"compiler": "none", "flags": "", "isa": "none", "blas": "none"}
    return {"program": program, "campaign": campaign | {"worst": WORST}, **made}


def unit(family: str, value: float, first: int, count: int, program: str = "0" * 40) -> dict:
    groups, worst, no_truth = {}, [], {}
    for seed in range(first, first + count):
        dice = random.Random(f"{family}/{value}/{seed}")
        if dice.random() < 0.02:
            no_truth["digits"] = no_truth.get("digits", 0) + 1
            continue
        mechanism = {"kS": dice.choice([None, 0, 3, 7]), "mass_ratio": dice.randrange(4)}
        for task in TASKS:
            for variant in VARIANTS:
                for precision in PRECISIONS:
                    where = {"family": family, "value": value, "task": task}
                    where |= {"variant": variant, "precision": precision}
                    answer(where, mechanism, seed, dice, groups, worst)
    worst.sort(key=lambda case: (-float.fromhex(case["error"]), *map(case.get, ORDER)))
    seen = Counter()
    kept = []
    for case in worst:
        series = case["task"], case["variant"], case["precision"]
        seen[series] += 1
        kept += [case] if seen[series] <= WORST else []
    return {
        "format": "kalmarm unit",
        "version": 2,
        "key": key(program),
        "unit": {"family": family, "value": value, "first": first, "count": count},
        "mechanisms": count,
        "no_truth": no_truth,
        "groups": list(groups.values()),
        "worst": kept,
    }


def answer(where: dict, mechanism: dict, seed: int, dice, groups: dict, worst: list) -> None:
    """Errors are a few roundoffs, a hundredth of them anything at all."""
    status = dice.choices(["ok", "singular"], [0.95, 0.05])[0]
    warned = "warned" if dice.random() < 0.1 else "silent"
    error = U[where["precision"]] * math.exp(dice.gauss(0, 2))
    error *= 10 ** dice.randrange(20) if dice.random() < 0.01 else 1
    error = 0.0 if dice.random() < 0.01 else error
    # Of the measures one is enough; the other is told apart by its name alone.
    for measure in ("energy", "relative"):
        cell = where | mechanism | {"measure": measure}
        group = groups.setdefault(tuple(cell.values()), cell | empty(where["variant"]))
        group["status"][status] = group["status"].get(status, 0) + 1
        if status != "ok":
            continue
        errors = group["errors"][warned]
        if error:
            place = str(math.floor(32 * math.log2(error)))
            errors["bins"][place] = errors["bins"].get(place, 0) + 1
        else:
            errors["zero"] += 1
    if status == "ok" and warned == "silent":
        worst.append(where | mechanism | {"seed": seed, "error": error.hex()})


def empty(variant: str) -> dict:
    errors = {name: {"zero": 0, "nan": 0, "inf": 0, "bins": {}} for name in ("silent", "warned")}
    claimed = {"beyond_claim": 0} if "Certified" in variant else {}
    return {"status": {}, "recomputed": 0, "errors": errors, **claimed}


def write(path: Path, document: dict) -> Path:
    path.write_text(json.dumps(document))
    return path
