"""Made-up records of the programs bench_dynamics, bench_batch and bench_peers."""

import random

SCENES = ["panda:7", "chain:31", "g1:35", "chain:100", "chain:500"]
DYNAMICS = ["panda:7", "chain:7", "chain:31", "chain:127"]
GENERATED = ["iiwa14:7"]
UPDATES = {"Conventional": 1, "UD": 1.3, "ArrayGivens": 1.7, "ArrayMGS": 1.9}  # times as long
PEAK = {"float64": 58.7e9, "float32": 117.4e9}  # FLOP/s
COPIES = {2**15: 100e9, 2**21: 50e9, 2**27: 12e9, 2**29: 11e9}  # bytes: bytes/s
BATCH = 1024
BATCH_IS_FASTER = 6
TASKS = {  # time in ns and its order of a peer at 7 degrees of freedom
    "acceleration": (1100, 1),
    "mass": (390, 1.6),
    "inverse": (1000, 1.9),
    "derivatives": (3000, 2),
}
OURS = {  # how many times faster than that
    "Ladder<default>": 2.75,
    "Ladder<default>@clang": 2.8,
    "AxisFrames<SquareRoot>": 1.4,
    "Sequential<Conventional>": 0.6,
}
PEERS = {
    "Pinocchio<LOCAL>@clang": 1,
    "Pinocchio<WORLD>@gcc": 0.55,
    "MuJoCo": 0.6,
    "DART": 0.16,
    "Simbody": 0.1,
    "KDL": 0.3,
}
WITHOUT = [  # variant and tasks that it does not have
    ("AxisFrames<SquareRoot>", ["mass", "inverse", "derivatives"]),
    ("Sequential<Conventional>", ["derivatives"]),
    ("MuJoCo", ["derivatives"]),
    ("DART", ["derivatives"]),
    ("Simbody", ["derivatives", "inverse"]),
    ("KDL", ["acceleration", "derivatives", "inverse"]),
]
SERIAL = "KDL"  # knows no branches
BRANCHED = "g1:35"
WRONG = "mass/DART/chain:31/float64"
FLOPS = 430  # of a joint, in acceleration
BYTES = {"float64": 8, "float32": 4}  # of a number


def _aggregates(name: str, time: float, unit: str, dice: random.Random, **counters) -> list[dict]:
    common = {"run_name": name, "run_type": "aggregate", "repetitions": 9, "time_unit": unit}
    return [
        common
        | {"name": f"{name}_{aggregate}", "aggregate_name": aggregate}
        | {"real_time": value, "cpu_time": value}
        | {key: scale * counter for key, counter in counters.items()}
        for aggregate, value, scale in (
            ("mean", 1.02 * time, 1.01),
            ("median", time, 1),
            ("cv", dice.uniform(0.004, 0.06), 0),
        )
    ]


def _seconds(task: str, n: int, dice: random.Random) -> float:
    first, order = TASKS[task]
    return 1e-9 * first * (n / 7) ** order * dice.uniform(0.97, 1.03)


def _call(task, variant, scene, precision, seconds, dice) -> list[dict]:
    name = f"{task}/{variant}/{scene}/{precision}"
    counters = {}
    if variant.startswith(("Ladder<", "AxisFrames<")):
        flops = FLOPS * int(scene.split(":")[1])
        counters = {"flops": flops, "FLOP/s": flops / seconds}
        counters["bytes"] = _numbers(task, scene) * BYTES[precision]
    return _aggregates(name, 1e9 * seconds, "ns", dice, **counters)


def _numbers(task: str, scene: str) -> int:
    """Of a state, that are given to a call or are its result."""
    n = int(scene.split(":")[1])
    return {"acceleration": 4 * n, "derivatives": 3 * n + 3 * n**2}.get(task, n + n**2)


def _batch(variant, scene, precision, seconds, dice) -> list[dict]:
    """`seconds` is the time of one state alone in float64; peers know no batches."""
    counters = {"s/state": seconds}
    if variant.startswith(("Ladder<", "AxisFrames<")):
        per_state = seconds / (5.4 if precision == "float64" else 10.5)
        flops = FLOPS * int(scene.split(":")[1])
        counters = {"flops": flops, "FLOP/s": flops / per_state, "s/state": per_state}
        counters["bytes"] = _numbers("acceleration", scene) * BYTES[precision]
    name = f"acceleration_batch/{variant}/{scene}/{precision}"
    return _aggregates(name, 1e6 * BATCH * counters["s/state"], "us", dice, **counters)


def peers(scene: str) -> list[dict]:
    """Google Benchmark's rows."""
    dice = random.Random(f"peers {scene}")
    n = int(scene.split(":")[1])
    rows = []
    for precision, rate in PEAK.items():
        name = f"peak/fma/native/{precision}"
        rows += _aggregates(name, 100.0, "ns", dice, **{"FLOP/s": rate * dice.uniform(0.99, 1)})
    for size, rate in COPIES.items():
        name = f"bandwidth/copy@1/bytes:{size}/float64/process_time/real_time"
        rows += _aggregates(name, size / rate * 1e6, "us", dice, bytes_per_second=rate)
    for task in TASKS:
        for variant, speed in (OURS | PEERS).items():
            if (variant, scene) == (SERIAL, BRANCHED) or task in dict(WITHOUT).get(variant, []):
                continue
            seconds = _seconds(task, n, dice) / speed
            name = f"{task}/{variant}/{scene}/float64"
            if name == WRONG:
                rows.append(
                    {"name": name, "run_name": name, "run_type": "iteration"}
                    | {"error_occurred": True, "error_message": "wrong: error 0.2 > 1e-9"}
                )
                continue
            rows += _call(task, variant, scene, "float64", seconds, dice)
            if variant == "Ladder<default>":
                rows += _call(task, variant, scene, "float32", seconds / 1.3, dice)
            if task == "acceleration":
                ours = variant.startswith(("Ladder<", "AxisFrames<"))
                for precision in PEAK if ours else ["float64"]:
                    rows += _batch(variant, scene, precision, seconds, dice)
    return rows


def dynamics(scene: str) -> list[dict]:
    """Google Benchmark's rows."""
    dice = random.Random(f"dynamics {scene}")
    rows = []
    for variant in ("Ladder<default>", "AxisFrames<SquareRoot>", "Sequential<Conventional>"):
        for precision in PEAK:
            seconds = _seconds("acceleration", int(scene.split(":")[1]), dice) / OURS[variant]
            rows += _call("acceleration", variant, scene, precision, seconds, dice)
    return rows


def batch(scene: str) -> list[dict]:
    """Google Benchmark's rows."""
    dice = random.Random(f"batch {scene}")
    rows = []
    for variant in ("Ladder<default>", "AxisFrames<SquareRoot>"):
        for precision in PEAK:
            seconds = _seconds("acceleration", int(scene.split(":")[1]), dice) / OURS[variant]
            rows += _batch(variant, scene, precision, seconds, dice)
            rows += _batch(f"{variant}@all cores", scene, precision, seconds / 1.9, dice)
            if variant == "Ladder<default>":
                rows += _batch("Ladder<1e-3>", scene, precision, seconds, dice)
    return rows


def generated(scene: str) -> list[dict]:
    """Google Benchmark's rows."""
    dice = random.Random(f"generated {scene}")
    rows = []
    for update, ratio in UPDATES.items():
        for precision in PEAK:
            seconds = 4e-7 * ratio * dice.uniform(0.97, 1.03)
            name = f"acceleration/Generated<Sequential<{update}>>/{scene}/{precision}"
            counters = {"flops": 3000 * ratio, "FLOP/s": 3000 * ratio / seconds}
            rows += _aggregates(name, 1e9 * seconds, "ns", dice, **counters)
            name, per_state = name.replace("/", "_batch/", 1), seconds / BATCH_IS_FASTER
            counters |= {"FLOP/s": 3000 * ratio / per_state, "s/state": per_state}
            rows += _aggregates(name, 1e9 * BATCH * per_state, "ns", dice, **counters)
    return rows
