"""Reads what a campaign of claims writes, refuses what is no such record; writes merges."""

import json
import math
import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, with_config
from typing_extensions import TypedDict

from read.checks import read_document, refusing
from read.replicates import MOST, VERDICTS, Numbers, Part, Repeated, Replicates
from read.values import Count, Number, Sha1, exact, reading

FORMAT, VERSION = "kalmarm claims", 1


@with_config(extra="forbid")
class Key(TypedDict):
    stress: Sha1
    integrate: Sha1
    effort: str
    variants: list[str]
    compiler: str
    flags: str
    isa: str
    blas: str
    sources: Sha1


checked_key = reading(Key)


class Measured(NamedTuple):
    value: Annotated[Number | Literal["inf", "-inf", "nan"], AfterValidator(float)]
    replicate: Count


@exact
class Check(NamedTuple):
    what: str
    low: Number | None
    high: Number | None
    holds: Count
    fails: Count
    absent: Count
    measured: list[Measured]

    def numbers(self, replicates: set[int]) -> Numbers:
        low, high = self.low, self.high
        check = Numbers(
            self.what,
            -math.inf if low is None else low,
            math.inf if high is None else high,
            {replicate: value for value, replicate in self.measured},
        )
        if len(check.values) != len(self.measured) or check.values.keys() - replicates:
            raise ValueError(f"{self.what}: measured in a replicate that is not there, or twice")
        counted = _written_check(check, len(replicates))
        for name in ("holds", "fails", "absent"):
            if getattr(self, name) != counted[name]:
                said = f"{name} is {getattr(self, name)}, {counted[name]} by its numbers"
                raise ValueError(f"{self.what}: {said}")
        return check


@exact
class Claim(NamedTuple):
    id: str
    checks: list[Check]
    confirmed: Count
    refuted: Count
    open: Count

    def repeated(self, replicates: set[int]) -> Repeated:
        verdicts = Counter({verdict: getattr(self, verdict) for verdict in VERDICTS})
        if verdicts.total() != len(replicates):
            raise ValueError(f"{self.id}: {verdicts.total()} verdicts of {len(replicates)}")
        return Repeated(self.id, [check.numbers(replicates) for check in self.checks], verdicts)


def part_of(name: str) -> Part:
    """FIRST+COUNT"""
    match = re.fullmatch(r"([1-9][0-9]{0,8})\+([1-9][0-9]{0,4})", name)
    if not match or int(match[2]) > MOST:
        raise ValueError(f"replicates {name!r} are not FIRST+COUNT")
    return Part(int(match[1]), int(match[2]))


@exact
class Document(NamedTuple):
    format: Literal[FORMAT]
    version: Literal[VERSION]
    key: Key
    replicates: list[Annotated[str, AfterValidator(part_of)]]
    claims: list[Claim]

    def checked(self) -> Replicates:
        numbers: set[int] = set()
        for part in self.replicates:
            own = set(range(part.first, part.end))
            if both := own & numbers:
                raise ValueError(f"replicate {min(both)} stands twice")
            numbers |= own
            if len(numbers) > MOST:
                raise ValueError(f"more than {MOST} replicates")
        if not numbers:
            raise ValueError("it has no replicate")
        for id, times in Counter(claim.id for claim in self.claims).items():
            if times > 1:
                raise ValueError(f"{id} stands twice")
        return Replicates(self.key, numbers, [claim.repeated(numbers) for claim in self.claims])


_document = reading(Document)


def read(path: Path) -> Replicates:
    return from_document(path, read_document(path))


def from_document(path: Path, document: dict) -> Replicates:
    with refusing(path, "a campaign of claims"):
        return _document(document)


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
