"""Made-up records of scripts/engines."""

import random
from itertools import product

ERRORS = "scene,n,variant,precision,task,batch,state,measure,value,outcome".split(",")
TIMES = (
    "scene,n,engine,variant,version,precision,task,batch,nanoseconds,with_copies,variation,"
    "repetitions,first_call,cpu,outcome"
).split(",")
BATCHED = "acceleration"
TASKS = {"acceleration": "relative", "mass": "scaled"}
ENGINES = {  # error on an arm, on one that carries a load, and time in ns
    ("Kalmarm certified", "float32"): (4e-8, 4e-8, 2100),
    ("Kalmarm conventional", "float64"): (4e-16, 1e-13, 1200),
    ("MuJoCo", "float64"): (4e-14, 2e-12, 6000),
    ("Pinocchio", "float64"): (6e-16, 1e-12, 4000),
    ("MJX", "float32"): (1e-5, 2e-2, 900_000),
    ("adam", "float32"): (2e-6, 1.5e-2, 400_000),
    ("Drake", "float64"): (7e-16, 3e-12, 30_000),
    ("DART", "float64"): (9e-16, 7e-13, 15_000),
    ("Newton", "float32"): (4e-5, 3e-3, 500_000),
    ("Rounded parameters", "float32"): (3e-8, 3e-8, None),
}
SCENES = ("arm:7", "arm+payload=1e4:7")
STATES = 4


def errors() -> list[list]:
    dice, rows = random.Random("engines"), []
    for (variant, precision), sizes in ENGINES.items():
        for scene, size in zip(SCENES, sizes, strict=False):
            for task, measure in TASKS.items():
                for batch, state in product((1, 4096) if task == BATCHED else (1,), range(STATES)):
                    value, outcome = size * dice.uniform(0.3, 1), "ok"
                    if variant == "adam" and task == "mass":
                        value, outcome = float("nan"), "timed out: 120 s"
                    row = [scene, 7, variant, precision, task, batch, state, measure]
                    rows.append([*row, f"{value:.17g}", outcome])
    return rows


def times() -> list[list]:
    rows = []
    for (variant, precision), (*_, time) in ENGINES.items():
        for scene in SCENES if time else ():
            for task in TASKS:
                row = [scene, 7, variant.lower(), variant, "1.0", precision, task, 1]
                if (variant, task) == ("adam", "mass"):
                    rows.append([*row, *["nan"] * 3, 0, "nan", "EPYC", "timed out: 120 s"])
                    continue
                rows.append([*row, time, 2 * time, 0.01, 7, 3.5, "EPYC", "ok"])
            rows.append([scene, 7, variant.lower(), variant, "1.0", precision, BATCHED, 4096])
            rows[-1] += [time / 20, time / 10, 0.02, 7, 4.5, "EPYC", "ok"]
    return rows
