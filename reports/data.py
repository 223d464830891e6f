"""Reads what a run recorded: errors, times, agreement with MuJoCo."""

import csv
import json
import math
import re
import statistics
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

COLUMNS = ["scene", "n", "variant", "precision", "task", "state", "measure", "value", "outcome"]
NO_SCENE = "none"
NANOSECONDS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


class DataError(Exception):
    """Bad input; the message is one line that names the file and the value."""


class Error(NamedTuple):
    """One measured error. `outcome` is `ok`, or says why there is no value."""

    scene: str
    variant: str
    precision: str
    task: str
    state: int
    measure: str
    value: float
    outcome: str


class Time(NamedTuple):
    """One timed call, median. `nanoseconds` is None where it was not timed: `refused` says why."""

    scene: str
    variant: str
    precision: str
    task: str
    nanoseconds: float | None
    variation: float | None  # standard deviation / mean over the repetitions
    repetitions: int
    refused: str


@dataclass
class Data:
    """All records of a run, and the benchmark contexts, one a file."""

    errors: list[Error] = field(default_factory=list)
    times: list[Time] = field(default_factory=list)
    harness: list[Time] = field(
        default_factory=list
    )  # timings of no scene: what timing itself takes
    mujoco: list[dict] = field(default_factory=list)
    contexts: list[dict] = field(default_factory=list)

    @property
    def scenes(self) -> list[str]:
        """All scenes, in order of their size."""
        records = {row.scene for row in self.errors} | {time.scene for time in self.times}
        records |= {robot["scene"] for robot in self.mujoco}
        return sorted(records, key=lambda scene: (scene_size(scene), scene))

    @property
    def families(self) -> list[str]:
        """Names that occur with more than one number of degrees of freedom."""
        sizes = Counter(map(scene_name, self.scenes))
        return sorted(name for name, count in sizes.items() if count > 1)

    @property
    def robots(self) -> list[str]:
        """The scenes that belong to no family."""
        families = self.families
        return [scene for scene in self.scenes if scene_name(scene) not in families]


def scene_name(scene: str) -> str:
    return scene.rsplit(":", 1)[0]


def scene_size(scene: str) -> int:
    return int(scene.rsplit(":", 1)[1])


def _scene(text: str) -> str:
    if not re.fullmatch(r".+:\d+", text):
        raise ValueError(f"scene '{text}' is not NAME:NV")
    return text


def read_errors(path: Path, data: Data) -> None:
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != COLUMNS:
            raise DataError(f"{path}: header is not {','.join(COLUMNS)}")
        for row in reader:
            try:
                if None in row or None in row.values():
                    raise ValueError(f"not {len(COLUMNS)} values")
                data.errors.append(
                    Error(
                        _scene(row["scene"]),
                        row["variant"],
                        row["precision"],
                        row["task"],
                        int(row["state"]),
                        row["measure"],
                        float(row["value"]),
                        row["outcome"],
                    )
                )
            except ValueError as error:
                raise DataError(f"{path}:{reader.line_num}: {error}") from None


def read_times(path: Path, data: Data) -> None:
    document = _read_json(path)
    runs = defaultdict(list)
    try:
        for row in document["benchmarks"]:
            runs[row.get("run_name", row["name"])].append(row)
        for name, rows in runs.items():
            time = _time(name, rows)
            (data.harness if time.scene == NO_SCENE else data.times).append(time)
        data.contexts.append(document.get("context", {}))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"{path}: not Google Benchmark's JSON: {_reason(error)}") from None


def _time(name: str, rows: list[dict]) -> Time:
    parts = name.split("/")  # a benchmark's own settings may follow the four parts
    if len(parts) < 4:
        raise ValueError(f"name '{name}' is not task/variant/scene/precision")
    task, variant, scene, precision = parts[:4]
    refused = next((row["error_message"] for row in rows if row.get("error_occurred")), "")
    single = [row for row in rows if row.get("run_type") != "aggregate"]
    aggregates = {row["aggregate_name"]: row for row in rows if row.get("run_type") == "aggregate"}
    median = variation = None
    if not refused:
        if "median" in aggregates:
            median = _nanoseconds(aggregates["median"])
        else:
            median = statistics.median(_nanoseconds(row) for row in single)
        if "cv" in aggregates:
            variation = float(aggregates["cv"]["real_time"])
    repetitions = max((int(row.get("repetitions", 1)) for row in rows), default=1)
    if scene != NO_SCENE:
        _scene(scene)
    return Time(scene, variant, precision, task, median, variation, repetitions, refused)


def _nanoseconds(row: dict) -> float:
    unit = row.get("time_unit", "ns")
    if unit not in NANOSECONDS:
        raise ValueError(f"'{row['name']}' is in '{unit}'")
    time = float(row["real_time"]) * NANOSECONDS[unit]
    if not (math.isfinite(time) and time > 0):
        raise ValueError(f"'{row['name']}' took {row['real_time']}")
    return time


def read_mujoco(path: Path, data: Data) -> None:
    document = _read_json(path)
    try:
        for robot in document["robots"]:
            _scene(robot["scene"])
            for entry in (robot["mass"], *(v["acceleration"] for v in robot["variants"])):
                entry["max"], entry["median"], entry["bound"]
            for variant in robot["variants"]:
                variant["variant"], variant["precision"], variant["failures"], variant["inverse"]
            data.mujoco.append(robot | {"mujoco": document["mujoco"], "pass": bool(robot["pass"])})
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise DataError(f"{path}: not an agreement record: {_reason(error)}") from None


def _read_json(path: Path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise DataError(f"{path}: not JSON: {error}") from None


def _reason(error: Exception) -> str:
    return f"{error} is missing" if isinstance(error, KeyError) else str(error)


# A file's kind is its name up to the first dash.
READERS = {"errors": read_errors, "times": read_times, "mujoco": read_mujoco}


def _kind(path: Path) -> str:
    return path.name.split("-", 1)[0]


def load(directory: Path | None, files: list[Path] | None = None) -> Data:
    """The records in `files`, or else in every data file of `directory`."""
    if not files:
        if not directory.is_dir():
            raise DataError(f"{directory}: no such folder")
        files = sorted(
            path
            for path in directory.iterdir()
            if path.suffix in (".csv", ".json") and _kind(path) in READERS
        )
    data = Data()
    for path in dict.fromkeys(files):
        if _kind(path) not in READERS:
            raise DataError(f"{path}: name does not start with {'-, '.join(READERS)}-")
        try:
            READERS[_kind(path)](path, data)
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise DataError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if not (data.errors or data.times or data.mujoco):
        raise DataError(f"{directory or 'the files given'}: no data")
    _refuse_repeats(data)
    return data


def _refuse_repeats(data: Data) -> None:
    """A measurement that stands twice would count twice in every median."""
    for key, count in Counter(row[:6] for row in data.errors).items():
        if count > 1:
            raise DataError(f"error of {'/'.join(map(str, key))} is recorded {count} times")
    for key, count in Counter(row[:4] for row in data.times).items():
        if count > 1:
            raise DataError(f"time of {'/'.join(key)} is recorded {count} times")
    for scene, count in Counter(robot["scene"] for robot in data.mujoco).items():
        if count > 1:
            raise DataError(f"agreement of {scene} is recorded {count} times")
