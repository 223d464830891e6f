"""What Google Benchmark's rows say: times, calls, Jacobians."""

import math
import statistics

from read.checks import checked_scene
from read.data import Bandwidth, Call, Jacobian, ScanCall, Time, scene_size
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
        _parts(name)[3]: _counter(rows, "FLOP/s")
        for name, rows in runs.items()
        if name.startswith(PEAK)
    }
    copies = [_bandwidth(name, rows) for name, rows in runs.items() if name.startswith(BANDWIDTH)]
    bandwidths = tuple(sorted((it for it in copies if it.threads == 1), key=lambda it: it.bytes))
    calls = []
    for name, rows in runs.items():
        if name.startswith((PEAK, BANDWIDTH)):
            continue
        time = _time(name, rows)
        flops = rate = least = None
        states = 1
        if not time.refused:
            flops, rate = _counter(rows, "flops"), _counter(rows, "FLOP/s")
            least, states = _counter(rows, "bytes"), _states(name, rows)
            time = time._replace(nanoseconds=time.nanoseconds / states)
        peak = peaks.get(time.precision)
        calls.append(Call(time, flops, rate, peak, least, states, bandwidths))
    return calls


def jacobians(runs: dict[str, list[dict]]) -> list[Jacobian]:
    return [Jacobian(_time(name, rows), _counter(rows, "error")) for name, rows in runs.items()]


def scans(runs: dict[str, list[dict]]) -> list[ScanCall | Bandwidth]:
    return [
        _bandwidth(name, rows) if name.startswith(BANDWIDTH) else _scan(name, rows)
        for name, rows in runs.items()
    ]


def _scan(name: str, rows: list[dict]) -> ScanCall:
    time = _time(name, rows)
    return ScanCall(time, _threads(name, time), _counter(rows, "bytes"))


def _bandwidth(name: str, rows: list[dict]) -> Bandwidth:
    time, rate = _time(name, rows), _counter(rows, "bytes_per_second")
    if rate is None:
        raise ValueError(f"'{name}' has no bytes_per_second")
    return Bandwidth(_threads(name, time), rate, scene_size(time.scene))


def _threads(name: str, time: Time) -> int:
    """Variants end in them, as in Scan<Conventional>@2."""
    _, at, threads = time.variant.partition("@")
    count = int(threads) if at else 1
    if not 1 <= count <= MOST_THREADS:
        raise ValueError(f"'{name}' ran on {threads} threads")
    return count


def _time(name: str, rows: list[dict]) -> Time:
    task, variant, scene, precision = _parts(name)
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


def _parts(name: str) -> list[str]:
    """The four; a benchmark's own settings may follow."""
    parts = name.split("/")
    if len(parts) < 4:
        raise ValueError(f"name '{name}' is not task/variant/scene/precision")
    return parts[:4]


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
