"""Reads what a run recorded, and refuses what is no such record."""

import csv
import json
import math
import re
import statistics
from collections import Counter, defaultdict
from contextlib import contextmanager
from pathlib import Path

import advice
import stress_readers
from data import (
    Call,
    Data,
    DataError,
    Equation,
    Error,
    Jacobian,
    Paper,
    Precision,
    Question,
    Residual,
    Sample,
    Time,
)
from fits import identification
from stress import U, Family, Integration, Variant

COLUMNS = ["scene", "n", "variant", "precision", "task", "state", "measure", "value", "outcome"]
SAMPLE_COLUMNS = "scene,n,quantity,method,samples,replica,error,seconds,threads".split(",")
INTEGRATION_COLUMNS = list(Integration._fields)
BOOLEANS = {"1": True, "0": False, "true": True, "false": False}
VERDICTS = ("holds", "misprint", "fails")
NO_SCENE = "none"
HOWS = ("whole", "pruned", "alone")  # ways to answer a question
PEAK = "peak/"  # begins the names of what measures the machine
NANOSECONDS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}


def _scene(text: str) -> str:
    if not re.fullmatch(r".+:\d+", text):
        raise ValueError(f"scene '{text}' is not NAME:NV")
    return text


def _rows(path: Path, columns: list[str], record) -> list:
    """What `record` makes of each row of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != columns:
            raise DataError(f"{path}: header is not {','.join(columns)}")
        records = []
        for row in reader:
            try:
                if None in row or None in row.values():
                    raise ValueError(f"not {len(columns)} values")
                records.append(record(row))
            except ValueError as error:
                raise DataError(f"{path}:{reader.line_num}: {error}") from None
        return records


def _csv_reader(name: str, columns: list[str], record):
    """A reader of CSV files into the list `name` of Data."""

    def read(path: Path, data: Data) -> None:
        getattr(data, name).extend(_rows(path, columns, record))

    return read


def _benchmark_reader(name: str, records):
    """A reader of Google Benchmark's files into the lists `name` and `name`_contexts of Data."""

    def read(path: Path, data: Data) -> None:
        own, context = _benchmarks(path, records)
        getattr(data, name).extend(own)
        getattr(data, f"{name}_contexts").append(context)

    return read


@contextmanager
def _refusing(path: Path, what: str):
    """Turns what goes wrong with a document's contents into one line: the file is not `what`."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise DataError(f"{path}: not {what}: {reason}") from None


def _error(row: dict) -> Error:
    return Error(
        _scene(row["scene"]),
        row["variant"],
        row["precision"],
        row["task"],
        int(row["state"]),
        row["measure"],
        float(row["value"]),
        row["outcome"],
    )


def _sample(row: dict) -> Sample:
    sample = Sample(
        _scene(row["scene"]),
        row["quantity"],
        row["method"],
        int(row["samples"]),
        int(row["replica"]),
        float(row["error"]),
        float(row["seconds"]),
        int(row["threads"]),
    )
    if not (sample.samples >= 0 and math.isfinite(sample.error) and sample.error >= 0):
        raise ValueError(f"error {row['error']} of {row['samples']} samples")
    if not (math.isfinite(sample.seconds) and sample.seconds > 0):
        raise ValueError(f"took {row['seconds']} s")
    return sample


def read_stress(path: Path, data: Data) -> None:
    stress_readers.read_rows(path, data.stress)


def read_families(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "a list of families"):
        data.stress_families += [_of_type(Family, entry) for entry in document["families"]]
        data.stress_variants += [_of_type(Variant, entry) for entry in document["variants"]]


def _of_type(record: type, entry: dict):
    """A record of texts and truths; a text that says nothing may be null."""
    values = []
    for name, wanted in record.__annotations__.items():
        value = entry[name]
        value = "" if value is None and wanted is str else value
        if not isinstance(value, wanted):
            raise ValueError(f"{name} of {entry['name']} is {value!r}")
        values.append(value)
    return record(*values)


def _integration(row: dict) -> Integration:
    if row["precision"] not in U:
        raise ValueError(f"precision '{row['precision']}' is none of {', '.join(U)}")
    if row["finished"] not in BOOLEANS:
        raise ValueError(f"finished is '{row['finished']}', none of {', '.join(BOOLEANS)}")
    return Integration(
        row["family"],
        float(row["value"]),
        int(row["n"]),
        int(row["seed"]),
        row["precision"],
        row["variant"],
        int(row["calls"]),
        BOOLEANS[row["finished"]],
        float(row["energy_drift"] or "nan"),
    )


def read_times(path: Path, data: Data) -> None:
    times, context = _benchmarks(path, _times)
    data.times += [time for time in times if time.scene != NO_SCENE]
    data.harness += [time for time in times if time.scene == NO_SCENE]
    data.contexts.append(context)


def read_questions(path: Path, data: Data) -> None:
    calls, context = _benchmarks(path, _calls)
    for call in calls:
        if call.time.variant not in HOWS:
            raise DataError(f"{path}: '{call.time.variant}' is none of {', '.join(HOWS)}")
    by_want = defaultdict(list)
    for call in calls:
        by_want[call.time.scene, call.time.task].append(call)
    with _refusing(path, "a record of a question"):
        title, asked = context.pop("title", ""), context.pop("question")
        rules = [rule for rule in context.pop("rules").split(",") if rule]
        dofs, left = int(context.pop("dofs")), int(context.pop("dofs_left"))
    data.questions += [
        Question(title, scene, want, asked, rules, dofs, left, own)
        for (scene, want), own in by_want.items()
    ]
    data.questions_contexts.append(context)


def _benchmarks(path: Path, records) -> tuple[list, dict]:
    """What `records` makes of the rows of each benchmark, and the context."""
    document = _read_json(path)
    runs = defaultdict(list)
    with _refusing(path, "Google Benchmark's JSON"):
        for row in document["benchmarks"]:
            runs[row.get("run_name", row["name"])].append(row)
        return records(runs), document.get("context", {})


def _times(runs: dict[str, list[dict]]) -> list[Time]:
    return [_time(name, rows) for name, rows in runs.items()]


def _times_of_scenes(runs: dict[str, list[dict]]) -> list[Time]:
    return [time for time in _times(runs) if time.scene != NO_SCENE]


def _calls(runs: dict[str, list[dict]]) -> list[Call]:
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


def _jacobians(runs: dict[str, list[dict]]) -> list[Jacobian]:
    return [Jacobian(_time(name, rows), _counter(rows, "error")) for name, rows in runs.items()]


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


def read_mujoco(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "an agreement record"):
        for robot in document["robots"]:
            _scene(robot["scene"])
            if not all(isinstance(note, str) for note in robot["notes"]):
                raise ValueError("a note is no text")
            for entry in (robot["mass"], *(v["acceleration"] for v in robot["variants"])):
                entry["max"], entry["median"], entry["bound"]
            for variant in robot["mass_variants"]:
                variant["variant"], variant["mass"]["max"], variant["mass"]["median"]
            for variant in robot["variants"]:
                variant["variant"], variant["precision"], variant["failures"], variant["inverse"]
            data.mujoco.append(robot | {"mujoco": document["mujoco"], "pass": bool(robot["pass"])})


def read_fit(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "a record of a fit"):
        fit = identification(document)
        _scene(fit.scene)
        data.fits.append(fit)


def read_advice(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "what recommend writes"):
        _scene(document["robot"])
        data.advice.append(advice.advice(document))


def read_limits(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "what limits writes"):
        _scene(document["robot"])
        data.limits.append(advice.limits(document))


def read_paper(path: Path, data: Data) -> None:
    document = _read_json(path)
    with _refusing(path, "a record of the paper"):
        precisions = [
            Precision(entry["precision"], int(entry["digits"]), float(entry["condition"]))
            for entry in document["precisions"]
        ]
        names = [precision.name for precision in precisions]
        equations = [_equation(row, names) for row in document["rows"]]
        for id, count in Counter(equation.id for equation in equations).items():
            if count > 1:
                raise ValueError(f"{id} is recorded {count} times")
        if not (precisions and equations):
            raise ValueError("no equation in any precision")
        scene = _scene(document["scene"])
        beyond = _scene(document.get("beyond_scene", scene))
        data.papers.append(Paper(scene, beyond, bool(document["pass"]), precisions, equations))


def _equation(row: dict, precisions: list[str]) -> Equation:
    texts = [row[name] for name in Equation._fields[:-1]]
    if not all(isinstance(text, str) for text in texts):
        raise ValueError(f"{texts} are not all text")
    residuals = {name: _residual(row["id"], row["residuals"][name]) for name in precisions}
    equation = Equation(*texts, residuals)
    if not equation.corrected and any(r.verdict == "misprint" for r in residuals.values()):
        raise ValueError(f"{equation.id} is a misprint without a corrected form")
    return equation


def _residual(id: str, entry: dict) -> Residual:
    residual = Residual(*(entry[name] for name in Residual._fields))
    if residual.verdict not in VERDICTS:
        raise ValueError(f"verdict '{residual.verdict}' of {id}")
    for value in (residual.printed, residual.corrected):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise ValueError(f"residual {value} of {id}")
    if not (math.isfinite(residual.tolerance) and residual.tolerance > 0):
        raise ValueError(f"tolerance {residual.tolerance} of {id}")
    return residual


def _read_json(path: Path):
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise DataError(f"{path}: not JSON: {error}") from None


# A file's kind is its name up to the first dash.
READERS = {
    "errors": _csv_reader("errors", COLUMNS, _error),
    "times": read_times,
    "mujoco": read_mujoco,
    "paper": read_paper,
    "simulation": _csv_reader("samples", SAMPLE_COLUMNS, _sample),
    "estimation": _benchmark_reader("estimation", _times_of_scenes),
    "dynamics": _benchmark_reader("dynamics", _calls),
    "batch": _benchmark_reader("dynamics", _calls),
    "peers": _benchmark_reader("peers", _calls),
    "jacobians": _benchmark_reader("jacobians", _jacobians),
    "pruning": read_questions,
    "identify": read_fit,
    "recommend": read_advice,
    "limits": read_limits,
    "stress": read_stress,
    "families": read_families,
    "integration": _csv_reader("integrations", INTEGRATION_COLUMNS, _integration),
}


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
    if not any(_records(data)):
        raise DataError(f"{directory or 'the files given'}: no data")
    _refuse_repeats(data)
    _refuse_unlisted(data)
    return data


def _records(data: Data) -> tuple:
    return (
        data.errors,
        data.times,
        data.mujoco,
        data.papers,
        data.samples,
        data.estimation,
        data.dynamics,
        data.peers,
        data.jacobians,
        data.questions,
        data.fits,
        data.advice,
        data.limits,
        data.stress,
        data.integrations,
    )


def _refuse_repeats(data: Data) -> None:
    """A measurement that stands twice would count twice in every median."""
    keys = {
        "error": (row[:6] for row in data.errors),
        "time": (row[:4] for row in data.times),
        "time of the recursions": (row[:4] for row in data.estimation),
        "time of the fast path": (call.time[:4] for call in data.dynamics),
        "time against peers": (call.time[:4] for call in data.peers),
        "time of a Jacobian": (jacobian.time[:4] for jacobian in data.jacobians),
        "time of an answer": (
            (question.asked, *call.time[:4])
            for question in data.questions
            for call in question.calls
        ),
        "advice": ((it.robot,) for it in data.advice),
        "limits": ((it.robot,) for it in data.limits),
        "fit": (fit[:4] for fit in data.fits),
        "agreement": ((robot["scene"],) for robot in data.mujoco),
        "check of the paper": ((paper.scene,) for paper in data.papers),
        "sample": (row[:5] for row in data.samples),
        "family": ((family.name,) for family in data.stress_families),
        "variant": ((variant.name,) for variant in data.stress_variants),
        "integration": (row[:6] for row in data.integrations),
    }
    for what, recorded in keys.items():
        for key, count in Counter(recorded).items():
            if count > 1:
                raise DataError(f"{what} of {'/'.join(map(str, key))} is recorded {count} times")
    if repeated := data.stress.repeated():
        raise DataError(f"result of {repeated} is recorded 2 times")


def _refuse_unlisted(data: Data) -> None:
    """What a family is decides how its records count: which have no right answer, which are drawn
    at random. To guess would be to count them wrongly, and to list them takes a second."""
    listed = {family.name for family in data.stress_families}
    if unlisted := set(data.stress.present("family")) - listed:
        raise DataError(
            f"stress-*.csv: family '{min(unlisted)}' stands in no families-*.json beside it; "
            "build/bin/stress --list --json FILE writes one"
        )
