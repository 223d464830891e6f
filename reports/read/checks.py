"""What readers check: scenes, documents, and that nothing is recorded twice."""

import json
import stat
from collections import Counter
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path

from pydantic import ValidationError

from read.data import Data, DataError

DEEPEST = 32  # our own files have six levels
MOST_DIGITS = 20


def name_of(cell: str) -> str:
    """A field of CSV without the apostrophe for spreadsheets (accuracy/programs/common/csv.hpp)."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in tuple("=+-@'") else cell


WORDS = {
    "missing": "'{place}' is missing",
    "extra_forbidden": "'{place}' is not known",
    "less_than_equal": "{place} is {value!r}, no number up to {le:g}",
    "greater_than_equal": "{place} is {value!r}, no number from {ge:g} on",
}


def reason(error: Exception) -> str:
    """In one line: the first field that is wrong, its value, and what is wrong with it."""
    if not isinstance(error, ValidationError):
        return f"{error} is missing" if isinstance(error, KeyError) else str(error)
    first = error.errors(include_url=False)[0]
    place, more = ".".join(map(str, first["loc"])), first.get("ctx", {})
    if "error" in more:  # of a rule of ours, which says the value itself
        return ": ".join(filter(None, (place, reason(more["error"]))))
    words = WORDS.get(first["type"], "{place} is {value!r}: {message}")
    told = {"place": place, "value": first["input"], "message": first["msg"]}
    return words.format(**more | told).strip()


@contextmanager
def refusing(path: Path, what: str):
    """Turns what goes wrong with a document's contents into one line: the file is not `what`."""
    try:
        yield
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise DataError(f"{path}: not {what}: {reason(error)}") from None


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


def refuse_repeats(data: Data) -> None:
    """A measurement that stands twice would count twice in every median."""
    answers = [(it.asked, *call.time[:4]) for it in data.questions for call in it.calls]
    recorded = [("time of an answer", answers)]
    for it in fields(data):
        if it.metadata:
            recorded.append((it.metadata["what"], map(it.metadata["key"], getattr(data, it.name))))
    for what, keys in recorded:
        for key, count in Counter(keys).items():
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
