"""Reads what a run recorded, and refuses what is no such record."""

import csv
import lzma
import math
import tarfile
import tempfile
from collections import defaultdict
from dataclasses import fields
from pathlib import Path

from read import (
    advice,
    benchmarks,
    campaign_files,
    contacts,
    engines,
    ladder,
    motions,
    paper,
    replicate_files,
    robots,
    scans,
    search,
    stress_files,
)
from read.campaign import MergeError
from read.checks import (
    checked_scene,
    name_of,
    opened,
    read_json,
    refuse_repeats,
    refuse_unlisted,
    refusing,
)
from read.data import (
    Bandwidth,
    Data,
    DataError,
    Error,
    Question,
    Sample,
)
from read.fits import identification
from read.stress import Family, Integration, U, Variant
from read.values import MOST, count, count_in, number_in, optional, text

COLUMNS = ["scene", "n", "variant", "precision", "task", "state", "measure", "value", "outcome"]
SAMPLE_COLUMNS = "scene,n,quantity,method,samples,replica,error,seconds,threads".split(",")
INTEGRATION_COLUMNS = list(Integration._fields)
BOOLEANS = {"1": True, "0": False, "true": True, "false": False}
LARGEST_OF_SAMPLES = 1e100  # errors, whose squares are taken
BESIDE_RECORDS = ("harness", "bandwidths", "stress_families", "stress_variants", "unread")
HOWS = ("whole", "pruned", "alone")  # ways to answer a question


def _rows(path: Path, columns: list[str], record) -> list:
    """What `record` makes of each row of a CSV file."""
    with opened(path) as file:
        reader = csv.DictReader(file)
        if reader.fieldnames != columns:
            raise DataError(f"{path}: header is not {','.join(columns)}")
        records = []
        for row in reader:
            try:
                if None in row or None in row.values():
                    raise ValueError(f"not {len(columns)} values")
                records.append(record({name: name_of(cell) for name, cell in row.items()}))
            except ValueError as error:
                raise DataError(f"{path}:{reader.line_num}: {error}") from None
        return records


def _csv_reader(name: str, columns: list[str], record):
    """A reader of CSV files into the list `name` of Data."""

    def read(path: Path, data: Data) -> None:
        getattr(data, name).extend(_rows(path, columns, record))

    return read


def _engine_reader(name: str, columns: list[str], record):
    """Of files of other versions, or half written, the page says so, and has the rest."""
    read = _csv_reader(name, columns, record)

    def read_or_say(path: Path, data: Data) -> None:
        try:
            read(path, data)
        except DataError as error:
            data.engine_faults.append(str(error).removeprefix(f"{path.parent}/"))

    return read_or_say


def _benchmark_reader(name: str, records):
    """A reader of Google Benchmark's files into the lists `name` and `name`_contexts of Data."""

    def read(path: Path, data: Data) -> None:
        own, context = _benchmarks(path, records)
        getattr(data, name).extend(own)
        getattr(data, f"{name}_contexts").append(context)

    return read


def _error(row: dict) -> Error:
    return Error(
        checked_scene(row["scene"]),
        row["variant"],
        row["precision"],
        row["task"],
        count_in(row, "state"),
        row["measure"],
        float(row["value"]),
        row["outcome"],
    )


def _sample(row: dict) -> Sample:
    sample = Sample(
        checked_scene(row["scene"]),
        row["quantity"],
        row["method"],
        int(row["samples"]),
        count_in(row, "replica"),
        float(row["error"]),
        float(row["seconds"]),
        count_in(row, "threads"),
    )
    if not (0 <= sample.samples <= MOST and 0 <= sample.error <= LARGEST_OF_SAMPLES):
        raise ValueError(f"error {row['error']} of {row['samples']} samples")
    if not (math.isfinite(sample.seconds) and sample.seconds > 0):
        raise ValueError(f"took {row['seconds']} s")
    return sample


def read_stress(path: Path, data: Data) -> None:
    stress_files.read_rows(path, data.stress)


def read_families(path: Path, data: Data) -> None:
    document = read_json(path)
    with refusing(path, "a list of families"):
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
        number_in(row, "value"),
        count_in(row, "n"),
        count_in(row, "seed"),
        row["precision"],
        row["variant"],
        count_in(row, "calls"),
        BOOLEANS[row["finished"]],
        float(row["energy_drift"] or "nan"),
    )


def _contact(row: dict):
    checked_scene(row["scene"])
    return contacts.error(row)


def _motion(row: dict):
    checked_scene(row["robot"])
    return motions.motion(row)


def read_times(path: Path, data: Data) -> None:
    times, context = _benchmarks(path, benchmarks.times)
    data.times += [time for time in times if time.scene != benchmarks.NO_SCENE]
    data.harness += [time for time in times if time.scene == benchmarks.NO_SCENE]
    data.contexts.append(context)


def read_scan_times(path: Path, data: Data) -> None:
    measured, context = _benchmarks(path, benchmarks.scans)
    data.bandwidths += [it for it in measured if isinstance(it, Bandwidth)]
    data.scan_calls += [it for it in measured if not isinstance(it, Bandwidth)]
    data.scan_contexts.append(context)


def read_questions(path: Path, data: Data) -> None:
    calls, context = _benchmarks(path, benchmarks.calls)
    for call in calls:
        if call.time.variant not in HOWS:
            raise DataError(f"{path}: '{call.time.variant}' is none of {', '.join(HOWS)}")
    by_want = defaultdict(list)
    for call in calls:
        by_want[call.time.scene, call.time.task].append(call)
    with refusing(path, "a record of a question"):
        title, asked = text(context.pop("title", "")), text(context.pop("question"))
        rules = [rule for rule in text(context.pop("rules")).split(",") if rule]
        dofs, left = int(context.pop("dofs")), int(context.pop("dofs_left"))
    data.questions += [
        Question(title, scene, want, asked, rules, dofs, left, own)
        for (scene, want), own in by_want.items()
    ]
    data.questions_contexts.append(context)


def _benchmarks(path: Path, records) -> tuple[list, dict]:
    """What `records` makes of the rows of each benchmark, and the context."""
    document = read_json(path)
    runs = defaultdict(list)
    with refusing(path, "Google Benchmark's JSON"):
        for row in document["benchmarks"]:
            runs[row.get("run_name", row["name"])].append(row)
        context = document.get("context", {})
        if not isinstance(context, dict):
            raise ValueError(f"context is {context!r}")
        return records(runs), context


def read_mujoco(path: Path, data: Data) -> None:
    document = read_json(path)
    with refusing(path, "an agreement record"):
        for robot in document["robots"]:
            _check_agreement(robot)
            version = text(document["mujoco"])
            data.mujoco.append(robot | {"mujoco": version, "pass": bool(robot["pass"])})


def _check_agreement(robot: dict) -> None:
    checked_scene(robot["scene"])
    if not all(isinstance(note, str) for note in robot["notes"]):
        raise ValueError("a note is no text")
    count("states", robot["states"])
    measured, variants = [], robot["variants"]  # an error that is missing is null
    for entry in (robot["mass"], *(variant["acceleration"] for variant in variants)):
        optional("bound", entry["bound"], 0)
        measured.append(entry)
    for variant in robot["mass_variants"]:
        text(variant["variant"])
        measured.append(variant["mass"])
    for variant in variants:
        text(variant["variant"]), text(variant["precision"])
        count("failures", variant["failures"])
        measured.append(variant["inverse"])
    for entry in measured:
        optional("max", entry["max"], 0), optional("median", entry["median"], 0)


def _robot_reader(name: str, what: str, record):
    """A reader of documents, each of one robot, into the list `name` of Data."""

    def read(path: Path, data: Data) -> None:
        document = read_json(path)
        with refusing(path, what):
            checked_scene(document["robot"])
            getattr(data, name).append(record(document))

    return read


def _campaign_reader(name: str, record):
    """A reader of what `record` makes of a file; several are one, if they are parts of one."""

    def read(path: Path, data: Data) -> None:
        part, whole = record(path), getattr(data, name)
        if whole is None:
            setattr(data, name, part)
            return
        try:
            whole.add(part)
        except MergeError as error:
            raise DataError(f"{path}: no part of the campaign beside it: {error}") from None

    return read


READERS = {
    "errors": _csv_reader("errors", COLUMNS, _error),
    "errors-engines": _engine_reader("engine_answers", engines.ERRORS, engines.answer),
    "times": read_times,
    "times-engines": _engine_reader("engine_times", engines.TIMES, engines.time),
    "mujoco": read_mujoco,
    "paper": paper.read_paper,
    "simulation": _csv_reader("samples", SAMPLE_COLUMNS, _sample),
    "estimation": _benchmark_reader("estimation", benchmarks.times_of_scenes),
    "dynamics": _benchmark_reader("dynamics", benchmarks.calls),
    "batch": _benchmark_reader("dynamics", benchmarks.calls),
    "generated": _benchmark_reader("generated", benchmarks.calls),
    "peers": _benchmark_reader("peers", benchmarks.calls),
    "jacobians": _benchmark_reader("jacobians", benchmarks.jacobians),
    "scan": read_scan_times,
    "scans": _csv_reader("scan_errors", scans.ERRORS, scans.error),
    "spans": _csv_reader("scan_flops", scans.FLOPS, scans.flops),
    "contacts": _csv_reader("contact_errors", contacts.COLUMNS, _contact),
    "standing": _benchmark_reader("contact_times", benchmarks.times_of_scenes),
    "pruning": read_questions,
    "identify": _robot_reader("fits", "a record of a fit", identification),
    "recommend": _robot_reader("advice", "what recommend writes", advice.advice),
    "limits": _robot_reader("limits", "what limits writes", advice.limits),
    "stress": read_stress,
    "families": read_families,
    "adversary": _csv_reader("finds", search.COLUMNS, search.find),
    "campaign": _campaign_reader("campaign", campaign_files.read),
    "claims": _campaign_reader("replicates", replicate_files.read),
    "robots": _csv_reader("robot_limits", robots.COLUMNS, robots.kept),
    "motions": _csv_reader("motions", motions.COLUMNS, _motion),
    "integration": _csv_reader("integrations", INTEGRATION_COLUMNS, _integration),
}


def _kind(path: Path) -> str:
    first, *rest = path.name.split("-", 2)
    return f"{first}-engines" if rest[:1] == ["engines"] and len(rest) == 2 else first


def data_files(directory: Path | None, files: list[Path] | None = None) -> list[Path]:
    """`files`, each once, or else every data file of `directory`."""
    if files:
        return list(dict.fromkeys(files))
    if not directory.is_dir():
        raise DataError(f"{directory}: no such folder")
    return sorted(
        path
        for path in directory.iterdir()
        if path.suffix in (".csv", ".json") and _kind(path) in READERS
    )


def load_baseline(path: Path) -> Data:
    """Of a folder, or of an archive beside a page, as far as it is readable by now."""
    if path.is_dir():
        return load(path, unreadable=True)
    with tempfile.TemporaryDirectory() as folder:
        try:
            with tarfile.open(path) as archive:
                for member in archive:
                    if member.isfile() and _kind(name := Path(Path(member.name).name)) in READERS:
                        Path(folder, name).write_bytes(archive.extractfile(member).read())
        except (OSError, tarfile.TarError, EOFError, lzma.LZMAError) as error:
            reason = getattr(error, "strerror", None) or error
            raise DataError(f"{path}: no folder or archive of data: {reason}") from None
        return load(Path(folder), unreadable=True)


def load(
    directory: Path | None, files: list[Path] | None = None, unreadable: bool = False
) -> Data:
    """The records in `files`, or else in every data file of `directory`; where files may be
    unreadable, as those of other versions are, `data.unread` names them."""
    data = Data()
    for path in data_files(directory, files):
        if _kind(path) not in READERS:
            raise DataError(f"{path}: name does not start with {'-, '.join(READERS)}-")
        try:
            READERS[_kind(path)](path, data)
        except DataError:
            if not unreadable:
                raise
            data.unread.append(path.name)
        except (OSError, UnicodeDecodeError, csv.Error) as error:
            raise DataError(f"{path}: {getattr(error, 'strerror', None) or error}") from None
    if not _has_records(data):
        raise DataError(f"{directory or 'the files given'}: no data")
    refuse_repeats(data)
    refuse_unlisted(data)
    ladder.set_apart(data)
    return data


def _has_records(data: Data) -> bool:
    return any(
        getattr(data, field.name)
        for field in fields(data)
        if not field.name.endswith("contexts") and field.name not in BESIDE_RECORDS
    )
