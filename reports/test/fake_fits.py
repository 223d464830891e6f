"""Made-up records of `identify`, and of bench_derivatives' Jacobians."""

import math

JOINTS = ["shoulder", "elbow"]
TIMES = [0.1 * i for i in range(30)]


def fit(residual: str, noise: float | None = 0.0, **changes) -> dict:
    """Converges tenfold an iteration, to 1e-8 without noise; its intervals are 0.1 to each side."""
    error = noise or 1e-8
    steps = math.ceil(-math.log10(error)) + 1
    base = [
        {"name": name, "unit": 2.0, "fitted": fitted, "low": fitted - 0.1, "high": fitted + 0.1}
        | {"true": true}
        for name, fitted, true in (("m(arm)", 1.0, 1.05), ("Izz(arm)", 3.0, 2.0))
    ]
    torque = [math.sin(time) for time in TIMES]
    joints = [
        {"name": joint, "measured": torque, "fitted": torque, "start": [1.3 * x for x in torque]}
        for joint in JOINTS
    ]
    record = {
        "robot": "arm:2",
        "residual": residual,
        "jacobian": "analytic",
        "samples": 200,
        "held_out": 50,
        "usable": True,
        "seconds": 0.25,
        "columns": [f"p{i}" for i in range(20)],
        "warnings": [],
        "iterations": [
            {"round": 0, "cost": 1.0, "gradient": 1.0, "seconds": 0.1 * i, "base_error": 10.0**-i}
            for i in range(steps)
        ],
        "rank": 2,
        "condition": 12.0,
        "unseen": [f"p{i}" for i in range(9)],
        "lost": [],
        "base_error": error,
        "base_error_of_start": 0.5,
        "torque_nrmse": {"start": 0.3, "fitted": error, "joints": [error, error]},
        "pseudo_inertia": [
            {"body": body, "smallest_eigenvalue": least}
            for body, least in (("a", 0.5), ("b", 0.02))
        ],
        "base_parameters": base,
        "prediction": {"time": TIMES, "joints": joints},
    }
    return record | ({} if noise is None else {"noise": noise}) | changes


def jacobians(scene: str, nanoseconds: dict[str, float], task: str) -> list[dict]:
    """Google Benchmark's rows of one task, by variant."""
    errors = {"Factored": 2e-16, "AutoDiff": 3e-16, "NumericDiff": 4e-7}
    rows = []
    for variant, time in nanoseconds.items():
        name = f"{task}/{variant}/{scene}/float64"
        row = {"name": name, "run_name": name, "run_type": "iteration", "time_unit": "ns"}
        rows.append(row | {"real_time": time, "cpu_time": time, "error": errors[variant]})
    return rows
