"""Reads what `stress --unit` and merges write, refuses what is no such record; writes merges."""

import json
import re
from collections import Counter
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field, with_config
from typing_extensions import TypedDict

from read.campaign import (
    OCTAVE,
    SUMMABLE,
    Campaign,
    Cell,
    Counts,
    Errors,
    Range,
    Worst,
    cut,
    joined,
)
from read.checks import read_document, refusing
from read.stress_files import STATUSES
from read.values import Count, Of, Sha1, exact, reading, record

UNIT, CAMPAIGN = "kalmarm unit", "kalmarm campaign"
VERSION = 2


def _counter(counts: dict) -> Counter:
    """Zeros are left out: whether one was written leaves no trace."""
    return Counter({name: value for name, value in counts.items() if value})


Counted = Annotated[dict[Of, Count], AfterValidator(_counter)]
Bin = Annotated[  # of all positive numbers
    str,
    Field(pattern="^(0|-?[1-9][0-9]{0,4})$"),
    AfterValidator(int),
    Field(ge=OCTAVE * -1074, lt=OCTAVE * 1024),
]


@with_config(extra="forbid")
class Options(TypedDict):
    variants: list[str]
    precisions: list[str]
    tasks: list[str]
    worst: Count


@with_config(extra="forbid")
class Key(TypedDict):
    program: Sha1
    campaign: Options
    compiler: str
    flags: str
    isa: str
    blas: str


@exact
class Sizes(NamedTuple):
    zero: Count
    nan: Count
    inf: Count
    bins: Counted[Bin]

    def checked(self) -> Errors:
        return Errors(*self)


@exact
class BySilence(NamedTuple):
    silent: Sizes
    warned: Sizes


@record
class Outcomes(NamedTuple):
    """Of a group, beside what its answers have in common."""

    status: Counted[Literal[STATUSES]]
    recomputed: Count
    errors: BySilence
    beyond_claim: Count = None

    def checked(self) -> Counts:
        counts = Counts(self.status, self.recomputed, *self.errors, self.beyond_claim)
        answers, errors = counts.status["ok"], counts.silent.total + counts.warned.total
        if errors != answers or (counts.beyond_claim or 0) > answers:
            raise ValueError(f"{errors} errors of {answers} answers")
        if not counts.recomputed <= counts.status.total() > 0:
            raise ValueError(f"{counts.recomputed} recomputed of {counts.status.total()}")
        return counts


_cell, _outcomes, _range = reading(Cell), reading(Outcomes), reading(Range, strict=False)
checked_key = reading(Key)


def _group(group: dict) -> tuple[Cell, Counts, tuple[str, ...]]:
    """With what it is summed over."""
    if unknown := group.keys() - {*Cell._fields, *Outcomes._fields}:
        raise ValueError(f"{min(unknown)!r} is not known")
    summed = tuple(name for name in SUMMABLE if name not in group)
    return _cell(group), _outcomes(group), summed


def parse_name(name: str) -> Range:
    """FAMILY/VALUE/FIRST+COUNT"""
    pattern = r"(?P<family>[^/]*)/(?P<value>[^/]*)/(?P<first>[0-9]{1,15})\+(?P<count>[0-9]{1,15})"
    match = re.fullmatch(pattern, name)
    if not match:
        raise ValueError(f"unit {name!r} is not FAMILY/VALUE/FIRST+COUNT")
    return _range(match.groupdict())


@exact
class Document(NamedTuple):
    """A unit, or units merged."""

    format: Literal[UNIT, CAMPAIGN]
    version: Literal[VERSION]
    key: Key
    mechanisms: Count
    no_truth: Counted[str]
    groups: list[Annotated[dict, AfterValidator(_group)]]
    worst: list[Worst]
    unit: Range = None
    units: list[Annotated[str, AfterValidator(parse_name)]] = None
    summed_over: list[Literal[SUMMABLE]] = None

    def checked(self) -> Campaign:
        needed = {"unit"} if self.format == UNIT else {"units", "summed_over"}
        if needed != {name for name in self._fields[-3:] if getattr(self, name) is not None}:
            raise ValueError(f"{' and '.join(sorted(needed))} is missing, or not alone")
        units = [self.unit] if self.unit else joined([], self.units)
        summed = tuple(self.summed_over or ())
        campaign = Campaign(self.key, units, self.no_truth, {}, self.worst, summed)
        if self.worst != cut(self.worst, self.key["campaign"]["worst"]):
            raise ValueError("worst is not in order, or too long")
        if self.mechanisms != campaign.mechanisms:
            raise ValueError(f"mechanisms is {campaign.mechanisms} by its units")
        for cell, counts, own in self.groups:
            where = "/".join(map(str, cell))
            if own != summed:
                raise ValueError(f"{where} is summed over {list(own)}, not {list(summed)}")
            if cell in campaign.groups:
                raise ValueError(f"a group stands twice: {where}")
            campaign.groups[cell] = counts
        _check_totals(campaign)
        return campaign


_document = reading(Document)


def read(path: Path) -> Campaign:
    """A unit, or units merged; DataError if it is neither."""
    return from_document(path, read_document(path))


def from_document(path: Path, document: dict) -> Campaign:
    with refusing(path, "a unit or a campaign"):
        return _document(document)


def written(campaign: Campaign) -> str:
    """As JSON; of equal records the same text."""
    groups = sorted(campaign.groups.items(), key=lambda group: group[0].rank)
    document = {
        "format": CAMPAIGN,
        "version": VERSION,
        "key": campaign.key,
        "units": [unit.name for unit in campaign.units],
        "mechanisms": campaign.mechanisms,
        "no_truth": campaign.no_truth,
        "summed_over": campaign.summed,
        "groups": [_written_group(cell, counts, campaign.summed) for cell, counts in groups],
        "worst": [case._asdict() | {"error": case.error.hex()} for case in campaign.worst],
    }
    return json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False) + "\n"


def _written_group(cell: Cell, counts: Counts, summed: tuple[str, ...]) -> dict:
    group = {name: value for name, value in cell._asdict().items() if name not in summed}
    group["status"] = counts.status
    group["recomputed"] = counts.recomputed
    group["errors"] = {
        name: {"zero": errors.zero, "nan": errors.nan, "inf": errors.inf, "bins": errors.bins}
        for name, errors in (("silent", counts.silent), ("warned", counts.warned))
    }
    if counts.beyond_claim is not None:
        group["beyond_claim"] = counts.beyond_claim
    return group


def _check_totals(campaign: Campaign) -> None:
    """No mechanism counts twice in a series, and none that is not there."""
    mechanisms, answers = Counter(), Counter()
    for unit in campaign.units:
        mechanisms[unit[:2]] += unit.count
    for cell, counts in campaign.groups.items():
        answers[cell[:6]] += counts.status.total()
    for series, total in answers.items():
        if total > mechanisms[series[:2]]:
            raise ValueError(
                f"{total} outcomes of {mechanisms[series[:2]]} {'/'.join(map(str, series))}"
            )
    for case in campaign.worst:
        if not any(
            unit[:2] == case[:2] and unit.first <= case.seed < unit.end for unit in campaign.units
        ):
            raise ValueError(f"worst of seed {case.seed}, which no unit has")
