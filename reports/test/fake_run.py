#!/usr/bin/env python3
"""Writes made-up but plausible data of a run, the same each time: `fake_run.py DIR`."""

import csv
import json
import math
import random
import sys
from pathlib import Path

import fake_advice
import fake_campaign
import fake_engines
import fake_estimation
import fake_peers
import fake_questions
import fake_scans

VARIANTS = {  # time in ns at 7 degrees of freedom, orders of growth of time and error
    "Batch<EigenLLT>": (620, 2.6, 2.0),
    "Batch<EigenLDLT>": (840, 2.7, 2.1),
    "Batch<OpenBLAS>": (1150, 2.3, 2.0),
    "Batch<SparseLTDL>": (510, 2.2, 2.0),
    "Sequential<Conventional>": (450, 1.02, 0.9),
    "Sequential<ArrayMGS>": (1700, 1.05, 0.4),
    "Sequential<UD>": (1250, 1.03, 0.5),
    "ClosedForm<Conventional>": (980, 2.0, 0.9),
    "Ladder<default>": (170, 1.02, 0.9),
    "MuJoCo": (540, 2.4, 2.0),
}
STEPS = {"Ladder<1e-3>": 1.0, "Ladder<1e-12>": 3.1}  # times as long as Ladder<default>, on robots
GIVING_MASS = ("CRBA", "Ladder<default>", "MuJoCo")
ROBOTS = {
    "two_link": 2,
    "puma560": 6,
    "ur10e": 6,
    "so101": 6,
    "panda": 7,
    "iiwa14": 7,
    "allegro": 16,
    "go2": 18,
    "g1": 35,
}
ADVISED = ["panda:7", "g1:35", "two_link:2"]
FAMILIES = ["straight", "chain", "tree"]
SIZES = [1, 3, 7, 15, 31, 63, 127, 255]
STATES = 20
EPSILON = {"float32": 6e-8, "float64": 1.1e-16}
UNTIMED = "so101:6"
UNCOMPARED = "ur10e:6"
REFUSED = ("acceleration", "Batch<OpenBLAS>", "allegro:16", "float32")
MEASURES = {
    "acceleration": ("relative", "energy"),
    "inverse": ("relative", "scaled"),
    "mass": ("relative", "scaled"),
}


def scenes() -> list[str]:
    return [f"{name}:{n}" for name, n in ROBOTS.items()] + [
        f"{name}:{n}" for name in FAMILIES for n in SIZES
    ]


def series(scene: str):
    """Task, variant and precision of all that a scene is measured with."""
    for task in MEASURES:
        steps = STEPS if scene.split(":")[0] in ROBOTS and task != "mass" else ()
        for variant in GIVING_MASS if task == "mass" else (*VARIANTS, *steps):
            for precision in EPSILON:
                if (variant, precision) != ("MuJoCo", "float32"):
                    yield task, variant, precision


def _of_batches(scene: str) -> list[list]:
    """The errors of rows, which scaling --ladder measures."""
    dice = random.Random(f"rows {scene}")
    return [
        [scene, scene.split(":")[1], variant, precision, "acceleration_batch", state, "relative"]
        + [f"{3 * EPSILON[precision] * dice.lognormvariate(0, 0.6):.17g}", "ok"]
        for variant in ("Ladder<default>", *STEPS)
        for precision in EPSILON
        for state in range(STATES)
    ]


def _outcome(scene: str, variant: str, precision: str, state: int) -> str:
    n = int(scene.split(":")[1])
    if precision == "float32" and variant.startswith("Batch<Eigen") and n >= 63:
        return "indefinite" if state < STATES * math.log(n / 31) / 2 else "ok"
    if scene == "g1:35" and variant == "ClosedForm<Conventional>" and precision == "float32":
        return "singular" if state < 3 else "ok"
    return "ok"


def _errors(scene: str, dice: random.Random) -> list[list]:
    n = int(scene.split(":")[1])
    rows = []
    for task, variant, precision in series(scene):
        growth = VARIANTS.get(variant, (0, 0, 0.3))[2]
        size = EPSILON[precision] * (1 + n**growth * dice.uniform(0.2, 1))
        for measure in MEASURES[task]:
            for state in range(STATES):
                outcome = _outcome(scene, variant, precision, state)
                value = size * dice.lognormvariate(0, 0.6) * (0.3 if measure != "relative" else 1)
                if n == 1 and task == "mass":
                    value = 0.0
                if outcome != "ok":
                    value = math.nan
                rows.append(
                    [scene, n, variant, precision, task, state, measure, f"{value:.17g}", outcome]
                )
    for state in range(STATES):
        for measure, order in (("kappa", 3.4), ("kappa_scaled", 2.1)):
            value = 1 if n == 1 else 2 * n**order * dice.lognormvariate(0, 0.3)
            rows.append([scene, n, "", "float64", "model", state, measure, f"{value:.17g}", "ok"])
    return rows + (_of_batches(scene) if scene.split(":")[0] in ROBOTS else [])


def _times(scene: str, dice: random.Random) -> dict:
    n = int(scene.split(":")[1])
    rows = []
    for task, variant, precision in series(scene):
        name = f"{task}/{variant}/{scene}/{precision}"
        common = {"name": name, "run_name": name, "repetitions": 5, "threads": 1, "time_unit": "ns"}
        if (task, variant, scene, precision) == REFUSED:
            rows.append(
                common
                | {
                    "run_type": "iteration",
                    "error_occurred": True,
                    "error_message": "error 3e-2 > 1e-3",
                }
            )
            continue
        first, order, _ = VARIANTS.get(variant, (180, 1.6, 0))
        if variant in STEPS:
            first, order, _ = VARIANTS["Ladder<default>"]
            first *= STEPS[variant]
        if task == "inverse":
            first, order = first * 1.6, max(order, 2)
        time = (
            (60 + first * (n / 7) ** order)
            * dice.uniform(0.9, 1.1)
            * (0.8 if precision == "float32" else 1)
        )
        for aggregate, value in (
            ("mean", 1.02 * time),
            ("median", time),
            ("cv", dice.uniform(0.004, 0.08)),
        ):
            rows.append(
                common
                | {
                    "name": f"{name}_{aggregate}",
                    "run_type": "aggregate",
                    "aggregate_name": aggregate,
                }
                | {"real_time": value, "cpu_time": value}
            )
    empty = {
        "name": "harness/empty/none/none",
        "run_type": "iteration",
        "real_time": 0.9,
        "time_unit": "ns",
    }
    rows.append(empty | {"run_name": empty["name"], "repetitions": 1})
    return {"context": CONTEXT | {"load_avg": [round(dice.uniform(0.2, 1), 2)]}, "benchmarks": rows}


CONTEXT = {
    "date": "2026-11-20T21:14:05+00:00",
    "host_name": "fake",
    "num_cpus": 2,
    "mhz_per_cpu": 2450,
    "cpu_scaling_enabled": False,
    "caches": [{"type": "Data", "level": 1, "size": 32768, "num_sharing": 1}],
    "library_build_type": "debug",
    "git_revision": "0123456789abcdef0123456789abcdef01234567",
    "compiler": "g++ 12.2.0",
    "flags": "-O3 -march=native -ffp-contract=fast",
    "cpu": "AMD EPYC 7B13 <made up>",
    "eigen": "3.4.0",
    "openblas": "0.3.21",
    "mujoco": "4.0.0",
    "mode": "quick",
    "timed_call": "kinematics, bias and solve; each call takes the next state of a pool of 61",
}

PEERS_CONTEXT = {
    "timed_call": "from q, qd and tau to the result, in the library's own arrays",
    "peers": "Pinocchio 3.7.0, MuJoCo 4.0.0, DART 6.12.1, Simbody 3.7, KDL 1.5.1",
}


def _mujoco(scene: str, dice: random.Random) -> dict:
    variants = []
    for variant in sorted(VARIANTS.keys() - {"MuJoCo"}):
        for precision, epsilon in EPSILON.items():
            error = 30 * epsilon * dice.lognormvariate(0, 0.7)
            acceleration = {
                "max": error,
                "median": error / 9,
                "bound": 1e-9 if precision == "float64" else None,
            }
            inverse = {"max": error / 2, "median": error / 20}
            variants.append(
                {
                    "variant": variant,
                    "precision": precision,
                    "acceleration": acceleration,
                    "inverse": inverse,
                    "failures": 0,
                }
            )
    mass = {"max": 6e-16 * dice.uniform(1, 3), "median": 3e-16, "bound": 1e-13}
    if scene == "allegro:16":
        mass["max"] = 3e-13
    robot = {
        "scene": scene,
        "states": 100,
        "notes": ["ignored: 7 actuators"] if scene.startswith("panda") else [],
        "mass": mass,
        "mass_variants": [
            {"variant": "CRBA", "mass": {"max": mass["max"], "median": mass["median"]}},
            {"variant": "Ladder<default>", "mass": {"max": 4.5e-16, "median": 1.5e-16}},
        ],
        "variants": variants,
        "pass": mass["max"] <= mass["bound"],
    }
    return {"mujoco": "4.0.0", "robots": [robot]}


def write(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for scene in scenes():
        dice = random.Random(scene)
        name = scene.replace(":", "-")
        with (folder / f"errors-{name}.csv").open("w", newline="") as file:
            lines = csv.writer(file, lineterminator="\n")
            lines.writerow("scene,n,variant,precision,task,state,measure,value,outcome".split(","))
            lines.writerows(_errors(scene, dice))
        if scene != UNTIMED:
            (folder / f"times-{name}.json").write_text(json.dumps(_times(scene, dice)))
        if scene.split(":")[0] in ROBOTS and scene != UNCOMPARED:
            (folder / f"mujoco-{name}.json").write_text(json.dumps(_mujoco(scene, dice)))
    for scene in fake_estimation.PAPERS:
        file = folder / f"paper-{scene.replace(':', '-')}.json"
        file.write_text(json.dumps(fake_estimation.paper(scene)))
    for kind, columns, rows in (
        ("errors", fake_engines.ERRORS, fake_engines.errors()),
        ("times", fake_engines.TIMES, fake_engines.times()),
    ):
        with (folder / f"{kind}-engines-all.csv").open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([columns, *rows])
    for kind, rows in (("scans", fake_scans.errors()), ("spans", fake_scans.flops())):
        with (folder / f"{kind}-straight.csv").open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows(rows)
    scan = {"context": CONTEXT | {"timed_call": "one state, kinematics included"}}
    scan |= {"benchmarks": fake_scans.times()}
    (folder / "scan-straight.json").write_text(json.dumps(scan))
    campaign = fake_campaign.unit("wild", 1.0, 1, 3000)
    (folder / "campaign-wild.json").write_text(json.dumps(campaign))
    with (folder / "simulation-panda-7.csv").open("w", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow("scene,n,quantity,method,samples,replica,error,seconds,threads".split(","))
        lines.writerows(fake_estimation.simulation("panda:7"))
    estimation = {
        "context": CONTEXT | {"timed_call": "from the random model to the result named"},
        "benchmarks": fake_estimation.estimation(),
    }
    (folder / "estimation-chain.json").write_text(json.dumps(estimation))
    for kind, measured, rows, context in (
        ("dynamics", fake_peers.DYNAMICS, fake_peers.dynamics, {"timed_call": "one state"}),
        ("batch", fake_peers.DYNAMICS, fake_peers.batch, {"timed_call": "1024 states"}),
        ("generated", fake_peers.GENERATED, fake_peers.generated, {"timed_call": "compiled"}),
        ("peers", fake_peers.SCENES, fake_peers.peers, PEERS_CONTEXT),
    ):
        for scene in measured:
            record = {"context": CONTEXT | context, "benchmarks": rows(scene)}
            name = scene.replace(":", "-")
            (folder / f"{kind}-{name}.json").write_text(json.dumps(record))
    for scene in ADVISED:
        name = scene.replace(":", "-")
        (folder / f"recommend-{name}.json").write_text(json.dumps(fake_advice.recommend(scene)))
        (folder / f"limits-{name}.json").write_text(json.dumps(fake_advice.limits(scene)))
    for title in fake_questions.QUESTIONS:
        record = fake_questions.record(title)
        record["context"] = CONTEXT | record["context"]
        (folder / f"pruning-{title.replace(' ', '-')}.json").write_text(json.dumps(record))


if __name__ == "__main__":
    write(Path(sys.argv[1]))
