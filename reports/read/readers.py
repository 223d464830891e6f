"""Reads what a run recorded, and refuses what is no such record."""

import csv
import lzma
import tarfile
import tempfile
from dataclasses import fields
from pathlib import Path

from read import (
    benchmarks,
    campaign_files,
    contacts,
    engines,
    ladder,
    motions,
    replicate_files,
    robots,
    scans,
    search,
    stress_files,
)
from read.advice import Advice, Limits
from read.benchmarks import BANDWIDTH, NO_SCENE, Benchmarks
from read.campaign import MergeError
from read.checks import (
    name_of,
    opened,
    read_json,
    reason,
    refuse_repeats,
    refuse_unlisted,
    refusing,
)
from read.data import Data, DataError, Error, Sample
from read.fits import Identification
from read.mujoco import Agreement
from read.paper import Paper
from read.stress import Described, Integration
from read.values import reading

COLUMNS = ["scene", "n", "variant", "precision", "task", "state", "measure", "value", "outcome"]
SAMPLE_COLUMNS = "scene,n,quantity,method,samples,replica,error,seconds,threads".split(",")
INTEGRATION_COLUMNS = list(Integration._fields)
GOOGLE = "Google Benchmark's JSON"
BESIDE_RECORDS = ("harness", "bandwidths", "stress_families", "stress_variants", "unread")


def _table(name: str, columns: list[str], kind):
    """A reader of CSV files into the list `name` of Data: of a row a record of this kind, or what
    this function makes of it."""
    record = reading(kind, strict=False) if isinstance(kind, type) else kind

    def read(path: Path, data: Data) -> None:
        records = []
        with opened(path) as file:
            rows = csv.reader(file)
            if next(rows, None) != columns:
                raise DataError(f"{path}: header is not {','.join(columns)}")
            for row in filter(None, rows):
                try:
                    if len(row) != len(columns):
                        raise ValueError(f"not {len(columns)} values")
                    records.append(record(dict(zip(columns, map(name_of, row)))))
                except ValueError as error:
                    raise DataError(f"{path}:{rows.line_num}: {reason(error)}") from None
        getattr(data, name).extend(records)

    return read


def _engine_table(name: str, columns: list[str], kind):
    """Of files of other versions, or half written, the page says so, and has the rest."""
    read = _table(name, columns, kind)

    def read_or_say(path: Path, data: Data) -> None:
        try:
            read(path, data)
        except DataError as error:
            data.engine_faults.append(str(error).removeprefix(f"{path.parent}/"))

    return read_or_say


def _document(kind, what: str, lists):
    """A reader of JSON files, each a record of this kind; `lists` says what of it is added to which
    list of Data."""
    record = reading(kind)

    def read(path: Path, data: Data) -> None:
        document = read_json(path)
        with refusing(path, what):
            for name, records in lists(record(document)).items():
                getattr(data, name).extend(records)

    return read


def _robot(name: str, kind, what: str):
    """The same of documents that are a record each."""
    return _document(kind, what, lambda record: {name: [record]})


def _agreements(agreement: Agreement) -> dict[str, list]:
    version = {"mujoco": agreement["mujoco"]}
    return {"mujoco": [robot | version for robot in agreement["robots"]]}


def _benchmarks(name: str, records):
    """A reader of Google Benchmark's files into the lists `name` and `name`_contexts of Data."""

    def lists(measured: Benchmarks) -> dict[str, list]:
        return {name: records(measured.runs), f"{name}_contexts": [measured.context]}

    return _document(Benchmarks, GOOGLE, lists)


def _times(measured: Benchmarks) -> dict[str, list]:
    runs = measured.runs
    harness = [run.time for run in runs if run.scene == NO_SCENE]
    return {"times": benchmarks.times(runs), "harness": harness, "contexts": [measured.context]}


def _described(described: Described) -> dict[str, list]:
    return {"stress_families": described.families, "stress_variants": described.variants}


def _scans(measured: Benchmarks) -> dict[str, list]:
    copies = [run.bandwidth for run in measured.runs if run.name.startswith(BANDWIDTH)]
    calls = benchmarks.scans(measured.runs)
    return {"bandwidths": copies, "scan_calls": calls, "scan_contexts": [measured.context]}


def _part(name: str, record):
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


# A file's kind is its name up to the first dash, or `errors-engines`, `times-engines`.
READERS = {
    "errors": _table("errors", COLUMNS, Error),
    "errors-engines": _engine_table("engine_answers", engines.ERRORS, engines.EngineAnswer),
    "times": _document(Benchmarks, GOOGLE, _times),
    "times-engines": _engine_table("engine_times", engines.TIMES, engines.EngineTime),
    "mujoco": _document(Agreement, "an agreement record", _agreements),
    "paper": _robot("papers", Paper, "a record of the paper"),
    "simulation": _table("samples", SAMPLE_COLUMNS, Sample),
    "estimation": _benchmarks("estimation", benchmarks.times),
    "dynamics": _benchmarks("dynamics", benchmarks.calls),
    "batch": _benchmarks("dynamics", benchmarks.calls),
    "generated": _benchmarks("generated", benchmarks.calls),
    "peers": _benchmarks("peers", benchmarks.calls),
    "jacobians": _benchmarks("jacobians", benchmarks.jacobians),
    "scan": _document(Benchmarks, GOOGLE, _scans),
    "scans": _table("scan_errors", scans.ERRORS, scans.ScanError),
    "spans": _table("scan_flops", scans.FLOPS, scans.ScanFlops),
    "contacts": _table("contact_errors", contacts.COLUMNS, contacts.ContactError),
    "standing": _benchmarks("contact_times", benchmarks.times),
    "pruning": _document(Benchmarks, "a record of a question", benchmarks.questions),
    "identify": _robot("fits", Identification, "a record of a fit"),
    "recommend": _robot("advice", Advice, "what recommend writes"),
    "limits": _robot("limits", Limits, "what limits writes"),
    "stress": lambda path, data: stress_files.read_rows(path, data.stress),
    "families": _document(Described, "a list of families", _described),
    "adversary": _table("finds", search.COLUMNS, search.find),
    "campaign": _part("campaign", campaign_files.read),
    "claims": _part("replicates", replicate_files.read),
    "robots": _table("robot_limits", robots.COLUMNS, robots.Kept),
    "motions": _table("motions", motions.COLUMNS, motions.motion),
    "integration": _table("integrations", INTEGRATION_COLUMNS, Integration),
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


def load(directory: Path | None, files: list[Path] | None = None, unreadable: bool = False) -> Data:
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
