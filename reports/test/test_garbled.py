"""Whatever a record's file holds, it is refused in one line or read to what can be drawn."""

import csv
import io
import json
import math
import random
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import fake_advice
import fake_campaign
import fake_claims
import fake_engines
import fake_fits
import fake_questions
import fake_stress
from read.campaign import Worst
from read.data import DataError, Error
from read.contacts import COLUMNS as CONTACT_COLUMNS
from read.motions import COLUMNS as MOTION_COLUMNS
from read.readers import COLUMNS, READERS, SAMPLE_COLUMNS, load
from read.replicates import Numbers
from read.robots import COLUMNS as ROBOT_COLUMNS
from read.scans import ERRORS as SCAN_ERRORS
from read.scans import FLOPS as SCAN_FLOPS
from read.search import COLUMNS as SEARCH_COLUMNS
from read.stress import Integration, Stress
from records import ROBOT, ROW, SAMPLE, fast, paper, peak, timed
from sections import SECTIONS
from test_contacts import CONTACTS
from test_motions import ADAPTIVE, NO_TRUTH, STEPS
from test_scans import CALL, COPY, COUNTED, ERROR as SCAN_ERROR

ERROR = {"max": 1e-15, "median": 1e-16, "bound": None}
COMPARED = {"variant": "Ladder<A>", "precision": "float64", "failures": 0}
COMPARED |= {"acceleration": ERROR, "inverse": {"max": 1e-15, "median": 1e-16}}
FOUND = """\
Ladder<A>,float32,acceleration,error,spatial,0,1,search,400,0.02,,,,
Ladder<A>,float32,acceleration,error,spatial,0,1,search,999,0.02,3.2,2,A,0 hinge 2 0 0;1 ball 1 3 0"""
COUNTERS = {"s/state": 1e-6, "FLOP/s": 1e9, "flops": 100.0}
CONTEXT = {"date": "2026-11-20T21:14:05+00:00", "num_cpus": 2, "cpu": "made up", "mode": "quick"}


def shortened(value):
    """Of every list the first two."""
    if isinstance(value, dict):
        return {key: shortened(inner) for key, inner in value.items()}
    return [shortened(inner) for inner in value[:2]] if isinstance(value, list) else value


def rows(*benchmarks):
    return {"context": CONTEXT, "benchmarks": list(benchmarks)}


DOCUMENTS = {
    "times": rows(
        timed(),
        timed(run_type="aggregate", aggregate_name="median", repetitions=3),
        timed(run_type="aggregate", aggregate_name="cv"),
        timed("mass/CRBA/panda:7/float64", error_occurred=True, error_message="too wrong"),
    ),
    "mujoco": {"mujoco": "4", "robots": [ROBOT | {"notes": ["one"], "variants": [COMPARED]}]},
    "paper": paper(),
    "estimation": rows(timed()),
    "dynamics": rows(fast(**COUNTERS), peak("float64", 1e9)),
    "batch": rows(fast(**{"s/state": 1e-6})),
    "generated": rows(fast(**COUNTERS)),
    "peers": rows(
        fast(**COUNTERS, bytes=100.0),
        peak("float64", 1e9),
        timed(COPY.replace("@2", "@1").replace("none:0", "bytes:32768"), bytes_per_second=1e9),
    ),
    "jacobians": rows(*fake_fits.jacobians("arm:2", {"Factored": 10.0}, "jacobian")),
    "standing": rows(timed("contacts/Batch<A>/arm:7/float64")),
    "pruning": fake_questions.record("planar arm"),
    "scan": rows(timed(CALL) | {"bytes": 1e5}, timed(COPY) | {"bytes_per_second": 1e9}),
    "identify": shortened(fake_fits.fit("torque")),
    "recommend": shortened(fake_advice.recommend("panda:7")),
    "limits": shortened(fake_advice.limits("panda:7")),
    "families": shortened(fake_stress.described()),
    "campaign": fake_campaign.unit("wild", 1.0, 1, 2),
    "claims": fake_claims.record(1, 2),
}
BESIDE = {"families": "paper"}  # nothing to draw is in the one alone


def table(columns, *lines):
    return [columns, *(next(csv.reader([line])) for line in lines)]


def table_of(records):
    return [list(records[0]), *([str(value) for value in record.values()] for record in records)]


TABLES = {
    "robots": table(
        ROBOT_COLUMNS,
        "arm,arm:7,Ladder<A>,float32,5,Payload on link,times its mass,100,1e8,0,",
        "bad,,,,,,,,,,no mass",
    ),
    "errors-engines": [
        fake_engines.ERRORS,
        *([str(value) for value in row] for row in fake_engines.errors()[:2]),
    ],
    "times-engines": [
        fake_engines.TIMES,
        *([str(value) for value in row] for row in fake_engines.times()[:2]),
    ],
    "errors": table(COLUMNS, ROW, "panda:7,7,,float64,model,0,kappa,12.5,ok"),
    "simulation": table(SAMPLE_COLUMNS, SAMPLE, "panda:7,7,M,Exact,0,0,1e-16,1e-5,1"),
    "adversary": table(SEARCH_COLUMNS, *FOUND.splitlines()),
    "contacts": table(CONTACT_COLUMNS, *CONTACTS[:2]),
    "motions": table(MOTION_COLUMNS, STEPS[0], STEPS[2], ADAPTIVE, NO_TRUTH),
    "scans": table(SCAN_ERRORS, SCAN_ERROR, SCAN_ERROR.replace("4,balanced", "0,")),
    "spans": table(SCAN_FLOPS, COUNTED, COUNTED.replace("factor", "acceleration")),
    "integration": table_of(fake_stress.integrations()[:2]),
    "stress": table_of(fake_stress.records()[:2]),
}
# Of a value of JSON, as it stands there.
INSTEAD = ["null", "true", "0", "-1", "0.5", "1e999", "NaN", "1e308", "1" + 400 * "0"]
INSTEAD += ['"x"', r'"\ud800"', "[[]]", "{}", 5000 * "[" + 5000 * "]"]
FIELDS = ["", "x", "nan", "inf", "-1", "0", "0.5", "1e308", "1" + 400 * "0", "1" + 5000 * "0"]
FIELDS += ["\0", "\n", '"', "\ud800", " ; ", 200_000 * "x"]


def test_every_kind_of_record_is_garbled_here():
    assert DOCUMENTS.keys() | TABLES.keys() == READERS.keys()


@pytest.fixture
def take(tmp_path):
    """Reads the bytes of a file of this kind, beside what it needs."""

    def take(kind: str, content: bytes):
        if kind in BESIDE:
            other = BESIDE[kind]
            (tmp_path / f"{other}-b.json").write_text(json.dumps(DOCUMENTS[other]))
        if kind == "stress":
            (tmp_path / "families-b.json").write_text(json.dumps(fake_stress.described()))
        file = tmp_path / f"{kind}-a.{'json' if kind in DOCUMENTS else 'csv'}"
        file.unlink(missing_ok=True)  # ext4 waits for the disk where a file is written over
        file.write_bytes(content)
        return load(tmp_path)

    return take


def refused(take, kind: str, content: bytes, drawn: bool = True) -> bool:
    """Whether it is, in one line; else it is read, and its sections can be made (slowly)."""
    try:
        data = take(kind, content)
    except DataError as error:
        assert str(error) and "\n" not in str(error) and len(str(error)) < 1100
        return True
    expect_finite(data)
    if drawn:
        for make in SECTIONS:
            make(data)
    return False


def expect_finite(value):
    """But for errors, which may be no numbers, and what the page repeats as it stands."""
    if isinstance(value, (Error, Integration, Numbers, Worst)):
        return
    if isinstance(value, Stress):
        for name in ("value", "n", "seed"):
            assert np.isfinite(value[name]).all()
    elif isinstance(value, float):
        assert math.isfinite(value)
    elif is_dataclass(value):
        for field in fields(value):
            if not field.name.endswith("contexts"):
                expect_finite(getattr(value, field.name))
    elif isinstance(value, dict):
        for inner in value.values():
            expect_finite(inner)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            expect_finite(inner)


def places(value, path=()):
    """The keys that lead to every value of a document, of lists to the first two."""
    yield path
    inside = value[:2] if isinstance(value, list) else []
    for key, inner in value.items() if isinstance(value, dict) else enumerate(inside):
        yield from places(inner, (*path, key))


def garbled(document, path, text: str | None) -> str:
    """The document with another value at a place, or none."""
    mark = "what stands here is replaced"
    copy = json.loads(json.dumps(document))
    if not path:
        return text or ""
    inside = copy
    for key in path[:-1]:
        inside = inside[key]
    if text is None:
        del inside[path[-1]]
    else:
        inside[path[-1]] = mark
    return json.dumps(copy).replace(json.dumps(mark), text or "")


@pytest.mark.parametrize("kind", DOCUMENTS)
def test_a_document_with_any_other_value_anywhere(take, kind):
    document = DOCUMENTS[kind]
    assert not refused(take, kind, json.dumps(document).encode())
    for path in places(document):
        for text in (None, *INSTEAD):
            try:
                refused(take, kind, garbled(document, path, text).encode())
            except Exception as error:
                raise AssertionError(f"{path} as {(text or 'nothing')[:40]}") from error


def csv_text(table) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(table)
    return text.getvalue().encode(errors="surrogatepass")


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_with_any_other_field_anywhere(take, kind):
    table = TABLES[kind]
    assert not refused(take, kind, csv_text(table))
    for i, row in enumerate(table):
        for j in range(len(row)):
            for text in FIELDS:
                other = [list(line) for line in table]
                other[i][j] = text
                try:
                    refused(take, kind, csv_text(other))
                except Exception as error:
                    raise AssertionError(f"row {i}, {row[j]} as {text[:40]!r}") from error


@pytest.mark.parametrize("kind", READERS)
def test_a_file_with_any_other_byte_or_cut_off_anywhere(take, kind):
    whole = json.dumps(DOCUMENTS[kind]).encode() if kind in DOCUMENTS else csv_text(TABLES[kind])
    dice = random.Random(kind)
    for at in range(0, len(whole), 5):
        byte = bytes([dice.randrange(256)])
        for content in (whole[:at] + byte + whole[at + 1 :], whole[:at]):
            try:
                refused(take, kind, content, drawn=False)
            except Exception as error:
                raise AssertionError(f"{content[max(at - 30, 0) : at + 30]}") from error
