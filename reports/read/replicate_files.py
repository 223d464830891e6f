"""Reads what a campaign of claims writes, refuses what is no such record; writes merges."""

import json
import math
import re
from pathlib import Path

from read.checks import expect, listed, read_document, refusing
from read.replicates import MOST, VERDICTS, Numbers, Part, Repeated, Replicates
from read.values import count, number, text

FORMAT, VERSION = "kalmarm claims", 1
KEY = {"stress", "integrate", "effort", "variants", "compiler", "flags", "isa", "blas", "sources"}
HASHES = {"stress", "integrate", "sources"}  # SHA-1
CHECK = {"what", "low", "high", "holds", "fails", "absent", "measured"}
UNUSUAL = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def read(path: Path) -> Replicates:
    return record(path, read_document(path))


def record(path: Path, document: dict) -> Replicates:
    with refusing(path, "a campaign of claims"):
        return _replicates(document)


def written(replicates: Replicates) -> str:
    """As JSON; of equal records the same text."""
    document = {
        "format": FORMAT,
        "version": VERSION,
        "key": replicates.key,
        "replicates": [part.name for part in replicates.parts],
        "claims": [_written_claim(claim, replicates.count) for claim in replicates.claims],
    }
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False) + "\n"


def _written_claim(claim: Repeated, replicates: int) -> dict:
    checks = [_written_check(check, replicates) for check in claim.checks]
    verdicts = {verdict: claim.verdicts[verdict] for verdict in VERDICTS}
    return {"id": claim.id, "checks": checks} | verdicts


def _written_check(check: Numbers, replicates: int) -> dict:
    bounds = {name: None if math.isinf(bound) else bound for name, bound in _bounds(check)}
    return {
        "what": check.what,
        **bounds,
        "holds": check.held,
        "fails": len(check.values) - check.held,
        "absent": replicates - len(check.values),
        "measured": [[_written_number(value), number] for value, number in check.in_order],
    }


def _bounds(check: Numbers) -> tuple:
    return ("low", check.low), ("high", check.high)


def _written_number(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)


def _replicates(document: dict) -> Replicates:
    if document.get("format") != FORMAT or document.get("version") != VERSION:
        raise ValueError(f"format is {document.get('format')!r} {document.get('version')!r}")
    expect(document, {"format", "version", "key", "replicates", "claims"})
    result = Replicates(checked_key(document["key"]))
    for name in listed(document, "replicates"):
        part = part_of(name)
        numbers = set(range(part.first, part.end))
        if numbers & result.numbers:
            raise ValueError(f"replicate {min(numbers & result.numbers)} stands twice")
        result.numbers |= numbers
        if result.count > MOST:
            raise ValueError(f"more than {MOST} replicates")
    if not result.numbers:
        raise ValueError("it has no replicate")
    for entry in listed(document, "claims"):
        claim = _claim(entry, result.numbers)
        if claim.id in {other.id for other in result.claims}:
            raise ValueError(f"{claim.id} stands twice")
        result.claims.append(claim)
    return result


def checked_key(key: dict) -> dict:
    expect(key, KEY)
    for name in KEY - {"variants"}:
        text(key[name])
    if not all(map(text, listed(key, "variants"))):
        raise ValueError(f"variants is {key['variants']!r}")
    for name in HASHES:
        if not re.fullmatch("[0-9a-f]{40}", key[name]):
            raise ValueError(f"{name} is {key[name]!r}")
    return key


def part_of(name: str) -> Part:
    """FIRST+COUNT"""
    match = re.fullmatch(r"([1-9][0-9]{0,8})\+([1-9][0-9]{0,4})", text(name))
    if not match or int(match[2]) > MOST:
        raise ValueError(f"replicates {name!r} are not FIRST+COUNT")
    return Part(int(match[1]), int(match[2]))


def _claim(entry: dict, numbers: set[int]) -> Repeated:
    expect(entry, {"id", "checks", *VERDICTS})
    claim = Repeated(text(entry["id"]), [])
    claim.verdicts.update({verdict: count(verdict, entry[verdict]) for verdict in VERDICTS})
    if claim.verdicts.total() != len(numbers):
        raise ValueError(f"{claim.id}: {claim.verdicts.total()} verdicts of {len(numbers)}")
    for check in listed(entry, "checks"):
        claim.checks.append(_check(claim.id, check, numbers))
    return claim


def _check(claim: str, entry: dict, numbers: set[int]) -> Numbers:
    expect(entry, CHECK)
    low, high = (
        unbounded if entry[name] is None else number(name, entry[name])
        for name, unbounded in (("low", -math.inf), ("high", math.inf))
    )
    check = Numbers(text(entry["what"]), low, high)
    measured = listed(entry, "measured")
    for value, replicate in measured:
        check.values[count("replicate", replicate)] = _number(value)
    where = f"{claim}, {check.what}"
    if len(check.values) != len(measured) or check.values.keys() - numbers:
        raise ValueError(f"{where}: measured in a replicate that is not there, or twice")
    counted = _written_check(check, len(numbers))
    for name in ("holds", "fails", "absent"):
        if count(name, entry[name]) != counted[name]:
            raise ValueError(f"{where}: {name} is {entry[name]}, {counted[name]} by its numbers")
    return check


def _number(value) -> float:
    return UNUSUAL[value] if value in UNUSUAL else number("measured", value)
