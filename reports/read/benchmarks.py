"""What Google Benchmark's rows say: times, calls, Jacobians."""

import math
import statistics

from read.checks import checked_scene
from read.data import Bandwidth, Call, Jacobian, ScanCall, Time
from read.values import count, number, text

NO_SCENE = "none"
PEAK = "peak/"  # begins the names of what measures the machine
BANDWIDTH = "bandwidth/"  # and its memory
MOST_THREADS = 10**6
NANOSECONDS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def times(runs: dict[str, list[dict]]) -> list[Time]:
    return [_time(name, rows) for name, rows in runs.items()]


def times_of_scenes(runs: dict[str, list[dict]]) -> list[Time]:
    return [time for time in times(runs) if time.scene != NO_SCENE]


def calls(runs: dict[str, list[dict]]) -> list[Call]:
    peaks = {
        name.split("/")[3]: _counter(rows, "FLOP/s")
        for name, rows in runs.items()
        if name.startswith(PEAK)
    }
    calls = []
    for name, rows in runs.items():
        if name.startswith(PEAK):
            continue
        time = _time(name, rows)
        flops = rate = None
        if not time.refused:
            flops, rate = _counter(rows, "flops"), _counter(rows, "FLOP/s")
            time = time._replace(nanoseconds=time.nanoseconds / _states(name, rows))
        calls.append(Call(time, flops, rate, peaks.get(time.precision)))
    return calls


def jacobians(runs: dict[str, list[dict]]) -> list[Jacobian]:
    return [Jacobian(_time(name, rows), _counter(rows, "error")) for name, rows in runs.items()]


def scans(runs: dict[str, list[dict]]) -> list[ScanCall | Bandwidth]:
    """Variants end in their threads, as in Scan<Conventional>@2."""
    found = []
    for name, rows in runs.items():
        time = _time(name, rows)
        _, at, threads = time.variant.partition("@")
        count = int(threads) if at else 1
        if not 1 <= count <= MOST_THREADS:
            raise ValueError(f"'{name}' ran on {threads} threads")
        if name.startswith(BANDWIDTH):
            rate = _counter(rows, "bytes_per_second")
            if rate is None:
                raise ValueError(f"'{name}' has no bytes_per_second")
            found.append(Bandwidth(count, rate))
        else:
            found.append(ScanCall(time, count, _counter(rows, "bytes")))
    return found


def _time(name: str, rows: list[dict]) -> Time:
    parts = name.split("/")  # a benchmark's own settings may follow the four parts
    if len(parts) < 4:
        raise ValueError(f"name '{name}' is not task/variant/scene/precision")
    task, variant, scene, precision = parts[:4]
    refused = text(next((row["error_message"] for row in rows if row.get("error_occurred")), ""))
    single = [row for row in rows if row.get("run_type") != "aggregate"]
    aggregates = {row["aggregate_name"]: row for row in rows if row.get("run_type") == "aggregate"}
    median = variation = None
    if not refused:
        if "median" in aggregates:
            median = _nanoseconds(aggregates["median"])
        else:
            median = statistics.median(_nanoseconds(row) for row in single)
        if "cv" in aggregates:
            variation = number("cv", aggregates["cv"]["real_time"], 0)
    repetitions = max((count("repetitions", row.get("repetitions", 1)) for row in rows), default=1)
    if scene != NO_SCENE:
        checked_scene(scene)
    return Time(scene, variant, precision, task, median, variation, repetitions, refused)


def _states(name: str, rows: list[dict]) -> int:
    """How many a call takes: its counter `s/state` is in CPU time, unless the name says else."""
    per_state = _counter(rows, "s/state")
    if not per_state:
        return 1
    clock = _counter(rows, "real_time" if "/real_time" in name else "cpu_time")
    return max(1, round(clock * NANOSECONDS[rows[0].get("time_unit", "ns")] / (1e9 * per_state)))


def _counter(rows: list[dict], name: str) -> float | None:
    """The median of a counter; None where there is none."""
    medians = [row for row in rows if row.get("aggregate_name") == "median"]
    single = [row for row in rows if row.get("run_type") != "aggregate"]
    values = [float(row[name]) for row in medians or single if name in row]
    if not all(math.isfinite(value) and value > 0 for value in values):
        raise ValueError(f"{name} of '{rows[0]['name']}' is {values}")
    return statistics.median(values) if values else None


def _nanoseconds(row: dict) -> float:
    unit = row.get("time_unit", "ns")
    if unit not in NANOSECONDS:
        raise ValueError(f"'{row['name']}' is in '{unit}'")
    time = float(row["real_time"]) * NANOSECONDS[unit]
    if not (math.isfinite(time) and time > 0):
        raise ValueError(f"'{row['name']}' took {row['real_time']}")
    return time
