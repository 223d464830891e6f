"""The section of other engines, on answers whose errors are known."""

import csv
import io

import fake_engines
import pytest
from charts.common import VIEW

import make_report
from read.data import Data, DataError
from sections import engines

ACCELERATION = {VIEW: "acceleration/relative"}


def text(columns: list[str], rows: list[list]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([columns, *rows])
    return out.getvalue()


@pytest.fixture
def take(read):
    def take(errors, times=()):
        read("errors-engines-a.csv", text(fake_engines.ERRORS, errors))
        return read("times-engines-a.csv", text(fake_engines.TIMES, list(times)))

    return take


def answer(value, outcome="ok", variant="Some", scene="arm:7", state=0, precision="float32"):
    return [scene, 7, variant, precision, "acceleration", state, "relative", value, outcome]


def rows(section, shown=ACCELERATION):
    (table,) = (table for table in section.tables if table.shown == shown)
    return table.rows


def test_silent_errors_are_counted_apart_from_warnings_and_from_what_is_not_answered(take):
    data = take(
        [
            answer(1e-2, state=0),
            answer(1e-2, "warned", state=1),
            answer(5e-6, state=2),
            answer(1e-8, state=3),
            answer("nan", "refused: singular", state=4),
        ]
    )
    ((*cells, loses),) = rows(engines.section(data))
    assert cells == ["Some", "float32", "4 of 5", "1", "1", "2", "1.0e-2", "5.0e-3"]
    assert loses == "arm 1.0e-2"


def test_engines_that_answer_come_first_and_then_those_that_are_less_wrong(take):
    data = take(
        [
            answer(1e-5, variant="Small"),
            answer("nan", "crashed: SIGSEGV", variant="Dead"),
            answer(0.1, variant="Large"),
            answer(1e-16, variant="Exact"),
        ]
    )
    assert [row[0] for row in rows(engines.section(data))] == ["Exact", "Small", "Large", "Dead"]
    assert rows(engines.section(data))[-1][2:] == ["0 of 1", "0", "0", "0", "–", "–", "–"]


def test_each_engine_has_the_scenes_that_it_loses_most_on(take):
    scenes = {"a:7": 1e-4, "b:7": 1e-2, "c:7": 1e-9, "d:7": 1e-3, "e:7": 1e-5}
    data = take([answer(value, scene=scene) for scene, value in scenes.items()])
    assert rows(engines.section(data))[0][-1] == "b 1.0e-2, d 1.0e-3, a 1.0e-4"


def test_what_is_not_answered_is_told_with_its_reason(take):
    data = take(
        [answer("nan", "failed: ValueError: no mesh", scene=s) for s in ("b:7", "a:7")]
        + [answer("nan", "not finite", variant="Other")]
    )
    silences = engines.section(data).tables[-1]
    assert silences.rows == [
        ["Other", "float32", "not finite", "acceleration", "arm:7"],
        ["Some", "float32", "failed: ValueError: no mesh", "acceleration", "a:7, b:7"],
    ]


def test_times_are_of_one_state_and_of_many_and_stand_beside_errors(take):
    def time(batch, nanoseconds, outcome="ok", scene="arm:7"):
        row = [scene, 7, "Some", "2.1", "float32", "acceleration", batch]
        return [*row, nanoseconds, 0.1, 7, 12.5, "EPYC", outcome]

    data = take(
        [answer(1e-5), answer(1e-5, scene="leg:7")],
        [
            time(1, 4000),
            time(64, 300),
            time(4096, 100),
            time(1, "nan", "failed: x", scene="leg:7"),
            time(64, 200, scene="leg:7"),
        ],
    )
    section = engines.section(data)
    assert section.tables[1].rows == [
        ["arm:7", "Some", "float32", "4.00 µs", "300 ns", "100 ns", "12 s"],
        ["leg:7", "Some", "float32", "–", "200 ns", "–", "12 s"],
    ]
    assert section.tables[1].columns[3:6] == ["One state", "A state of 64", "A state of 4096"]
    assert section.statements == ["Versions: Some 2.1."]
    (figure,) = section.figures
    drawn = [row for rows in figure.chart.to_dict()["datasets"].values() for row in rows]
    marks = {(row["scene"], row["variant"], row["time"], row["error"]) for row in drawn if row}
    assert marks == {("arm:7", "Some", 4000, 1e-5)}


def test_forms_of_ours_have_one_version_and_engines_with_alike_names_their_own(take):
    names = {
        "Kalmarm certified": "1",
        "Kalmarm conventional": "1",
        "MuJoCo": "4",
        "MuJoCo Warp": "5",
    }
    row = ["float32", "acceleration", 1, 4000, 0.1, 7, 12.5, "EPYC", "ok"]
    times = [["arm:7", 7, name, version, *row] for name, version in names.items()]
    section = engines.section(take([answer(1e-5)], times))
    assert section.statements == ["Versions: Kalmarm 1, MuJoCo 4, MuJoCo Warp 5."]


def test_engines_are_in_no_other_section(take):
    data = take(fake_engines.errors(), fake_engines.times())
    assert not data.errors and not data.times and not data.scenes
    html = make_report.page(data)
    assert "Every engine" in html and "Error against run time" not in html


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (answer(1e-5, "fine"), "outcome 'fine' is none of"),
        (answer(-1), "value is -1"),
        (answer("nan"), "value is nan"),
        (answer(1e-5, "crashed: SIGSEGV"), "value 1e-05 of an answer that is crashed"),
        (answer(1e-5, scene="arm"), "scene 'arm'"),
    ],
)
def test_what_is_no_such_record_is_refused_by_name(take, row, reason):
    with pytest.raises(DataError, match=f"errors-engines-a.csv:2: {reason}"):
        take([row])


def test_an_answer_that_stands_twice_is_refused(take):
    with pytest.raises(DataError, match="answer of an engine of arm:7/Some.* is recorded 2 times"):
        take([answer(1e-5), answer(1e-6)])


def test_without_engines_there_is_nothing_of_them():
    assert engines.section(Data()) is None
