"""Reads what `stress --unit` and merges write, refuses what is no such record; writes merges."""

import json
import re
from collections import Counter
from pathlib import Path

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
from read.checks import expect, listed, read_document, refusing
from read.stress import U
from read.stress_files import STATUSES
from read.values import count, number, optional, text

UNIT, CAMPAIGN = "kalmarm unit", "kalmarm campaign"
VERSION = 2
MEASURES = ("relative", "energy")
BINS = range(OCTAVE * -1074, OCTAVE * 1024)  # of all positive numbers
KEY = {"program", "campaign", "compiler", "flags", "isa", "blas"}
OPTIONS = {"variants", "precisions", "tasks", "worst"}
GROUP = {*Cell._fields, "status", "recomputed", "errors"}


def read(path: Path) -> Campaign:
    """A unit, or units merged; DataError if it is neither."""
    return record(path, read_document(path))


def record(path: Path, document: dict) -> Campaign:
    with refusing(path, "a unit or a campaign"):
        return _campaign(document)


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


def _campaign(document: dict) -> Campaign:
    if document.get("format") not in (UNIT, CAMPAIGN) or document.get("version") != VERSION:
        raise ValueError(f"format is {document.get('format')!r} {document.get('version')!r}")
    expected = {"format", "version", "key", "mechanisms", "no_truth", "groups", "worst"}
    if document["format"] == UNIT:
        expect(document, expected | {"unit"})
        units, summed = [_unit(document["unit"])], ()
    else:
        expect(document, expected | {"units", "summed_over"})
        units, summed = (
            joined([], [parse_name(name) for name in listed(document, "units")]),
            _summed(document),
        )
    key = checked_key(document["key"])
    worst = [_worst(case) for case in listed(document, "worst")]
    if worst != cut(worst, key["campaign"]["worst"]):
        raise ValueError("worst is not in order, or too long")
    campaign = Campaign(key, units, _counter(document["no_truth"]), {}, worst, summed)
    if count("mechanisms", document["mechanisms"]) != campaign.mechanisms:
        raise ValueError(f"mechanisms is {campaign.mechanisms} by its units")
    for group in listed(document, "groups"):
        cell, counts = _group(group, summed)
        if cell in campaign.groups:
            raise ValueError(f"a group stands twice: {'/'.join(map(str, cell))}")
        campaign.groups[cell] = counts
    _check_totals(campaign)
    return campaign


def checked_key(key: dict) -> dict:
    expect(key, KEY)
    for name in KEY - {"campaign"}:
        text(key[name])
    expect(key["campaign"], OPTIONS)
    count("worst", key["campaign"]["worst"])
    for name in OPTIONS - {"worst"}:
        if not all(map(text, listed(key["campaign"], name))):
            raise ValueError(f"{name} is {key['campaign'][name]!r}")
    if not re.fullmatch("[0-9a-f]{40}", key["program"]):
        raise ValueError(f"program is {key['program']!r}")
    return key


def _unit(unit: dict) -> Range:
    expect(unit, set(Range._fields))
    return _range(unit["family"], unit["value"], unit["first"], unit["count"])


def _range(family, value, first, count_) -> Range:
    if not re.fullmatch(r"\w+", text(family), re.ASCII):
        raise ValueError(f"family is {family!r}")
    unit = Range(family, number("value", value), count("first", first), count("count", count_))
    if not unit.count:
        raise ValueError(f"{unit.name} has no mechanism")
    return unit


def parse_name(name: str) -> Range:
    """FAMILY/VALUE/FIRST+COUNT"""
    match = re.fullmatch(r"([^/]*)/([^/]*)/([0-9]{1,15})\+([0-9]{1,15})", text(name))
    if not match:
        raise ValueError(f"unit {name!r} is not FAMILY/VALUE/FIRST+COUNT")
    family, value, first, count_ = match.groups()
    return _range(family, float(value), int(first), int(count_))


def _summed(document: dict) -> tuple[str, ...]:
    summed = tuple(listed(document, "summed_over"))
    if list(summed) != sorted(set(summed) & set(SUMMABLE)):
        raise ValueError(f"summed_over is {document['summed_over']!r}")
    return summed


def _counter(counts: dict) -> Counter[str]:
    """Zeros are left out: whether one was written leaves no trace."""
    checked = {text(name): count(name, value) for name, value in counts.items()}
    return Counter({name: value for name, value in checked.items() if value})


def _group(group: dict, summed: tuple[str, ...]) -> tuple[Cell, Counts]:
    expect(group, GROUP - set(summed), {"beyond_claim"})
    precision, measure = group["precision"], group["measure"]
    if precision not in U or measure not in MEASURES:
        raise ValueError(f"{measure!r} in {precision!r}")
    cell = Cell(
        text(group["family"]),
        number("value", group["value"]),
        text(group["task"]),
        text(group["variant"]),
        precision,
        measure,
        *(_power(name, group.get(name)) for name in SUMMABLE),
    )
    expect(group["errors"], {"silent", "warned"})
    counts = Counts(
        _counter(group["status"]),
        count("recomputed", group["recomputed"]),
        _errors(group["errors"]["silent"]),
        _errors(group["errors"]["warned"]),
        count("beyond_claim", group["beyond_claim"]) if "beyond_claim" in group else None,
    )
    if unknown := set(counts.status) - set(STATUSES):
        raise ValueError(f"status '{min(unknown)}' is none of {', '.join(STATUSES)}")
    if not counts.status:
        raise ValueError(f"no outcome of {'/'.join(map(str, cell))}")
    answers, errors = counts.status["ok"], counts.silent.total + counts.warned.total
    if errors != answers or (counts.beyond_claim or 0) > answers:
        raise ValueError(f"{errors} errors of {answers} answers")
    if counts.recomputed > counts.status.total():
        raise ValueError(f"{counts.recomputed} recomputed of {counts.status.total()}")
    return cell, counts


def _power(name: str, value) -> int | None:
    """Of ten."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int) or abs(value) > 700:
        raise ValueError(f"{name} is {value!r}")
    return value


def _errors(errors: dict) -> Errors:
    expect(errors, {"zero", "nan", "inf", "bins"})
    bins = Counter()
    for name, value in errors["bins"].items():
        if (
            not re.fullmatch("-?[0-9]{1,5}", name)
            or int(name) not in BINS
            or str(int(name)) != name
        ):
            raise ValueError(f"no bin is {name!r}")
        if count(name, value):
            bins[int(name)] = value
    return Errors(*(count(name, errors[name]) for name in ("zero", "nan", "inf")), bins)


def _worst(case: dict) -> Worst:
    expect(case, set(Worst._fields))
    error = float.fromhex(text(case["error"]))
    if not error >= 0 or case["precision"] not in U:
        raise ValueError(f"error is {case['error']} in {case['precision']!r}")
    return Worst(
        text(case["family"]),
        number("value", case["value"]),
        count("seed", case["seed"]),
        text(case["task"]),
        text(case["variant"]),
        case["precision"],
        error,
        optional("kS", case["kS"], 0),
        optional("mass_ratio", case["mass_ratio"]),
    )


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
