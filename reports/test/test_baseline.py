"""Two runs compared: ratios, their noise, errors, machines."""

import csv
import json
import math
import shutil
import tarfile

import pytest

import fake_engines
from browsing import figure, marks
from read.data import Data, DataError, Time
from read.readers import load, load_baseline
from sections import compared
from summary import baseline
from test_engines import answer, text, time as timed
from test_make_report import assert_refused, report

FILES = ("errors-panda-7.csv", "times-panda-7.json")
FASTER = "acceleration/Ladder<default>/panda:7/float64"


@pytest.fixture(scope="module")
def both(run, tmp_path_factory):
    """A run, and one before it in which one call took twice as long and one error was 10 times as
    large."""
    now, before = (tmp_path_factory.mktemp(name) for name in ("now", "before"))
    for name in FILES:
        shutil.copy(run / name, now)
    times = json.loads((run / FILES[1]).read_text())
    for row in times["benchmarks"]:
        if row.get("run_name") == FASTER and row.get("aggregate_name") == "median":
            row["real_time"] *= 2
    (before / FILES[1]).write_text(json.dumps(times))
    with (run / FILES[0]).open() as file:
        rows = list(csv.reader(file))
    for row in rows[1:]:
        if row[2:5] == ["Batch<EigenLLT>", "float64", "inverse"] and row[6] == "relative":
            row[7] = f"{10 * float(row[7]):.17g}"
    with (before / FILES[0]).open("w") as file:
        csv.writer(file).writerows(rows)
    return now, before


@pytest.fixture
def data(both):
    now, before = map(load, both)
    now.baseline = before
    return now


def time(nanoseconds, variation=0.01, repetitions=9):
    return Time("a:7", "V", "float64", "inverse", nanoseconds, variation, repetitions, "")


def change(after, before, **noise):
    runs = [Data(times=[time(nanoseconds, **noise)]) for nanoseconds in (after, before)]
    (found,) = baseline.changes(*runs)
    return found


def test_the_noise_of_a_ratio_is_that_of_two_medians():
    # A median of 9 with a spread of 1 % is good to 1.2533 * 1 % / 3; of two, sqrt(2) times that.
    assert change(100, 100).noise == pytest.approx(math.sqrt(2) * 1.2533 * 0.01 / 3, rel=1e-4)
    assert change(100, 100, variation=None).noise is None
    assert change(100, 100, repetitions=1).noise is None


@pytest.mark.parametrize(
    "after, before, variation, verdict",
    [
        (100, 200, 0.01, "faster"),
        (200, 100, 0.01, "slower"),
        (101, 100, 1e-6, "same"),  # beyond its noise, but of no matter
        (97, 100, 0.001, "faster"),
        (105, 100, 0.05, "same"),  # within its noise
        (300, 100, None, "noise unknown"),
    ],
)
def test_a_change_counts_if_it_is_more_than_noise(after, before, variation, verdict):
    assert change(after, before, variation=variation).verdict == verdict


def test_calls_that_one_run_lacks_are_not_compared():
    other = time(1)._replace(variant="W")
    assert baseline.changes(Data(times=[time(1)]), Data(times=[other])) == []


def test_what_changed_is_told_and_nothing_else(data):
    summary, largest, errors = compared.section(data).tables
    (acceleration,) = [row for row in summary.rows if row[0].startswith("Acceleration")]
    assert acceleration[4:] == ["1", "0", str(int(acceleration[2]) - 1)]
    (row,) = largest.rows
    assert row[:4] == ["panda:7", row[1], "Ladder<default>", "float64"]
    assert (row[6], row[8]) == ("0.500", "faster")
    (row,) = errors.rows
    assert (row[2], row[6]) == ("Batch<EigenLLT>", "0.10") and "relative" in row[1]


def test_a_run_is_the_same_as_itself(both):
    data = load(both[0])
    data.baseline = load(both[0])
    summary, largest, errors = compared.section(data).tables
    assert largest.rows == errors.rows == []
    assert all(row[3] == "1.00" and row[2] == row[6] for row in summary.rows)


def test_times_of_another_machine_are_marked_and_not_judged(data):
    for context in data.baseline.contexts:
        context["cpu"] = "another"
    section = compared.section(data)
    assert any("differ in cpu" in it and "another" in it for it in section.statements)
    assert {row[8] for row in section.tables[1].rows} == {"machines differ"}
    assert all(row[4:6] == ["0", "0"] for row in section.tables[0].rows)


def test_without_a_baseline_nothing_is_compared(run):
    assert compared.section(load(run)) is None


def test_the_page_shows_ratios(both, visit, tmp_path):
    file = tmp_path / "index.html"
    result = report("--data", both[0], "--baseline", both[1], "--out", file)
    assert (result.returncode, result.stderr) == (0, "")
    panel = figure(visit(file), "This run against the baseline", "times now over before")
    assert marks(panel, "now over before: 0.500").count() == 1
    assert marks(panel).count() == 8


def test_a_baseline_that_is_not_there_is_refused(both, tmp_path):
    arguments = ("--data", both[0], "--baseline", tmp_path / "none", "--out", tmp_path / "x.html")
    assert_refused(report(*arguments), "none: no folder or archive of data: No such file")


def engines(folder, error, nanoseconds, outcome="ok", version="2.1"):
    folder.mkdir()
    times = text(fake_engines.TIMES, [timed(nanoseconds=nanoseconds)]).replace("2.1", version)
    (folder / "errors-engines-a.csv").write_text(text(fake_engines.ERRORS, [answer(error, outcome)]))
    (folder / "times-engines-a.csv").write_text(times)
    return load(folder)


@pytest.mark.parametrize(
    ("now", "told"),
    [
        ((1e-5, 4000), None),
        ((1.9e-5, 4100), None),
        ((1e-3, 4000), ["2.1", "verified", "1.0e-5", "1.0e-3", "4.00 µs", "4.00 µs"]),
        ((0.5, 4000), ["2.1", "verified → wrong in silence", "1.0e-5", "5.0e-1"]),
        ((1e-5, 8000), ["2.1", "verified", "1.0e-5", "1.0e-5", "4.00 µs", "8.00 µs"]),
        ((1e-5, 4000, "ok", "2.2"), ["2.1 → 2.2", "verified"]),
    ],
)
def test_of_engines_it_is_told_what_changed_of_a_cell(tmp_path, now, told):
    data = engines(tmp_path / "now", *now)
    data.baseline = engines(tmp_path / "before", 1e-5, 4000)
    tables = [it for it in compared.section(data).tables if it.caption.startswith("Engines")]
    assert bool(tables) == bool(told)
    if told:
        assert tables[0].rows[0][5:][: len(told)] == told


def test_a_baseline_is_an_archive_beside_a_page_and_what_it_holds_of_other_versions_is_named(
    both, tmp_path
):
    (tmp_path / "contacts-g1.csv").write_text("of,another,version\n")
    packed = tmp_path / "data.tar.xz"
    with tarfile.open(packed, "w:xz") as archive:
        for file in (*both[1].iterdir(), tmp_path / "contacts-g1.csv"):
            archive.add(file, f"data/{file.name}")
    data = load(both[0])
    data.baseline = load_baseline(packed)
    assert data.baseline.times == load(both[1]).times
    statements = compared.section(data).statements
    assert "Not read of the baseline: contacts-g1.csv." in statements


@pytest.mark.parametrize("content", [b"", b"no archive"])
def test_a_baseline_that_is_no_archive_is_refused(tmp_path, content):
    file = tmp_path / "data.tar.xz"
    file.write_bytes(content)
    with pytest.raises(DataError, match="data.tar.xz: no folder or archive of data"):
        load_baseline(file)
