"""What readers check: scenes, documents, and that nothing is recorded twice."""

import json
import re
import stat
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

from read.data import Data, DataError
from read.motions import Case

DEEPEST = 32  # our own files have six levels
MOST_DIGITS = 20


def name_of(cell: str) -> str:
    """A name in a field of CSV, without the apostrophe for spreadsheets (accuracy/programs/common/csv.hpp)."""
    return cell[1:] if re.match(r"'[=+\-@']", cell) else cell


def checked_scene(text: str) -> str:
    if not re.fullmatch(r".+:[0-9]{1,9}", text):
        raise ValueError(f"scene '{text}' is not NAME:NV")
    return text


@contextmanager
def refusing(path: Path, what: str):
    """Turns what goes wrong with a document's contents into one line: the file is not `what`."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        reason = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise DataError(f"{path}: not {what}: {reason}") from None


def opened(path: Path):
    """The text of a regular file: a pipe or a device may never end."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise DataError(f"{path}: no regular file")
    return path.open(newline="", encoding="utf-8")


def read_json(path: Path):
    try:
        with opened(path) as file:
            text = file.read()
        document = json.loads(text, parse_int=_integer)
        _refuse_depth(document)
        if "\\u" in text:  # half a letter, which no file can hold
            json.dumps(document, ensure_ascii=False).encode()
        return document
    except (ValueError, RecursionError) as error:
        raise DataError(f"{path}: not JSON: {error}") from None


def read_document(path: Path):
    """The same, and DataError too where there is nothing to read."""
    try:
        return read_json(path)
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: {getattr(error, 'strerror', None) or error}") from None


def _integer(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError(f"an integer of {len(text)} digits")
    return int(text)


def _refuse_depth(document) -> None:
    level = [document] if isinstance(document, (dict, list)) else []
    for _ in range(DEEPEST):
        inside = [it.values() if isinstance(it, dict) else it for it in level]
        level = [it for values in inside for it in values if isinstance(it, (dict, list))]
    if level:
        raise ValueError(f"arrays and objects are nested more than {DEEPEST} deep")


def expect(document: dict, known: set[str], also: set[str] = frozenset()) -> None:
    """What is not known here would be lost in a merge."""
    if unknown := sorted(document.keys() - known - also):
        raise ValueError(f"{unknown[0]!r} is not known")
    if missing := sorted(known - document.keys()):
        raise ValueError(f"{missing[0]!r} is missing")


def listed(document: dict, name: str) -> list:
    if not isinstance(document[name], list):
        raise ValueError(f"{name} is {document[name]!r}")
    return document[name]


# A file's kind is its name up to the first dash, or `errors-engines`, `times-engines`.


def refuse_repeats(data: Data) -> None:
    """A measurement that stands twice would count twice in every median."""
    keys = {
        "error": (row[:6] for row in data.errors),
        "time": (row[:4] for row in data.times),
        "time of the recursions": (row[:4] for row in data.estimation),
        "time of the fast path": (call.time[:4] for call in data.dynamics),
        "time against peers": (call.time[:4] for call in data.peers),
        "time of a Jacobian": (jacobian.time[:4] for jacobian in data.jacobians),
        "time of a scan": (call.time[:4] for call in data.scan_calls),
        "error of a scan": (row[:9] for row in data.scan_errors),
        "flops of a scan": (row[:8] for row in data.scan_flops),
        "error of contacts": (row[:6] for row in data.contact_errors),
        "time of contacts": (row[:4] for row in data.contact_times),
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
        "stress of a robot": ((it.name, it.stress) for it in data.robot_limits),
        "motion": (
            row if isinstance(row, Case) else (*row.case, *row[1:6]) for row in data.motions
        ),
        "integration": (row[:6] for row in data.integrations),
        "answer of an engine": (row[:6] for row in data.engine_answers),
        "time of an engine": (row[:5] for row in data.engine_times),
    }
    for what, recorded in keys.items():
        for key, count in Counter(recorded).items():
            if count > 1:
                raise DataError(f"{what} of {'/'.join(map(str, key))} is recorded {count} times")
    if repeated := data.stress.repeated():
        raise DataError(f"result of {repeated} is recorded 2 times")


def refuse_unlisted(data: Data) -> None:
    """What a family is decides how its records count: which have no right answer, which are drawn
    at random. To guess would be to count them wrongly, and to list them takes a second."""
    listed = {family.name for family in data.stress_families}
    if unlisted := set(data.stress.present("family")) - listed:
        raise DataError(
            f"stress-*.csv: family '{min(unlisted)}' stands in no families-*.json beside it; "
            "build/bin/stress --list --json FILE writes one"
        )
