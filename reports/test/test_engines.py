"""The first section, on answers of engines whose errors are known."""

import csv
import io
import math

import fake_engines
import pytest
from charts.common import VIEW
from playwright.sync_api import expect

import make_report
from browsing import figure, marks, section as unfolded
from read.data import Data
from sections import SECTIONS, engines
from summary.engines import cells

TITLE = "Which engine, precision and batch"
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


def answer(
    value, outcome="ok", variant="Some", scene="arm:7", state=0, precision="float32", batch=1
):
    series = [scene, 7, variant, precision, "acceleration", batch]
    return [*series, state, "relative", value, outcome]


def time(batch=1, nanoseconds=4000, outcome="ok", scene="arm:7", variant="Some", engine="some"):
    row = [scene, 7, engine, variant, "2.1", "float32", "acceleration", batch]
    return [*row, nanoseconds, 2 * nanoseconds, 0.1, 7, 12.5, "EPYC", outcome]


def rows(section, shown=ACCELERATION):
    (table,) = (table for table in section.tables if table.shown == shown)
    return table.rows


def drawn(section) -> list[dict]:
    (figure,) = section.figures
    sets = figure.chart.to_dict()["datasets"].values()
    return [row for rows in sets for row in rows if "scene" in row]


@pytest.mark.parametrize(
    ("given", "status", "reason"),
    [
        ([(1e-7, "ok"), (9e-3, "ok")], "verified", ""),
        ([(1e-7, "ok"), (2e-2, "ok")], "wrong in silence", "1 of 2 states"),
        ([(1e-7, "ok"), (2e-2, "warned")], "warned", "1 of 2 states"),
        ([(1e-7, "model differs: without armature")], "model differs", "without armature"),
        ([(0.5, "model differs: without armature")], "wrong in silence", ""),
        ([(1e-7, "ok"), ("nan", "refused: singular")], "refused", "singular, 1 of 2 states"),
        ([("nan", "unsupported: it has no such call")], "not asked", "it has no such call"),
        ([("nan", "not asked: it needs a GPU")], "not asked", "it needs a GPU"),
        ([("nan", "missing: no wheel")], "not asked", "no wheel"),
        ([("nan", "timed out: 120 s")], "failed", "timed out: 120 s"),
        ([("nan", "not finite")], "failed", "not finite"),
        ([(0.5, "ok"), ("nan", "crashed: SIGSEGV")], "wrong in silence", "1 of 2 states"),
    ],
)
def test_a_cell_has_a_status_and_the_reason(take, given, status, reason):
    data = take([answer(*one, state=i) for i, one in enumerate(given)])
    ((cell),) = cells(data)
    assert (cell.status, cell.reason) == (status, reason)


def test_every_planned_cell_is_a_row_of_the_table_and_those_with_a_time_are_marks(take):
    data = take(
        [answer(1e-5), answer(2e-5, batch=64), answer("nan", "crashed: SIGSEGV", variant="Dead")],
        [time(), time(64, 100), time(1, math.nan, "crashed: SIGSEGV", variant="Dead")],
    )
    found = {(row["variant"], row["batch"]): row for row in drawn(engines.section(data))}
    assert found.keys() == {("Some", "1"), ("Some", "64"), ("Dead", "1")}
    assert found["Some", "64"]["time"] == 100 and found["Some", "64"]["error"] == 2e-5
    assert found["Dead", "1"]["time"] is None
    assert found["Dead", "1"]["reason"] == "crashed: SIGSEGV"
    texts = ("time_text", "copies_text", "first_text", "version", "machine", "command")
    assert [found["Some", "1"][name] for name in texts] == [
        *("4.00 µs", "8.00 µs", "12 s", "2.1", "EPYC", "scripts/engines some arm")
    ]


def test_what_others_published_has_no_command(take):
    data = take([answer(1e-5, "model differs: published")], [time(engine="")])
    (row,) = drawn(engines.section(data))
    assert (row["command"], row["status"]) == ("–", "model differs")


def test_the_first_sentence_says_in_twenty_words_what_to_call_and_what_it_costs(take):
    data = take(
        [answer(1e-5), answer(1e-6, batch=64), answer(0.5, variant="Wrong"), answer(2e-5, batch=16)],
        [time(), time(64, 100), time(1, 1, variant="Wrong"), time(16, 200)],
    )
    ((said,),) = [answer.sentences for answer in engines.section(data).answers]
    assert said == (
        "For arm, call Some (float32): 4.00 µs a state, error 1.0e-5; "
        "for 64 states rows of Some (float32): 100 ns, error 1.0e-6."
    )
    assert len(said.split()) <= 24  # a number and its unit are one word to a reader


def test_silent_errors_are_counted_apart_from_warnings_and_from_what_is_not_answered(take):
    data = take(
        [
            answer(1e-2, state=0),
            answer(1e-2, "warned", state=1),
            answer(5e-6, state=2),
            answer(1e-8, state=3),
            answer("nan", "refused: singular", state=4),
        ],
        [time()],
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
        ],
        [time(variant="Small")],
    )
    assert [row[0] for row in rows(engines.section(data))] == ["Exact", "Small", "Large", "Dead"]
    assert rows(engines.section(data))[-1][2:] == ["0 of 1", "0", "0", "0", "–", "–", "–"]


def test_each_engine_has_the_scenes_that_it_loses_most_on(take):
    scenes = {"a:7": 1e-4, "b:7": 1e-2, "c:7": 1e-9, "d:7": 1e-3, "e:7": 1e-5}
    data = take([answer(value, scene=scene) for scene, value in scenes.items()], [time(scene="a:7")])
    assert rows(engines.section(data))[0][-1] == "b 1.0e-2, d 1.0e-3, a 1.0e-4"


def test_engines_are_in_no_other_section(take):
    data = take(fake_engines.errors(), fake_engines.times())
    assert not data.errors and not data.times and not data.scenes
    html = make_report.page(data)
    assert TITLE in html and "Error against run time" not in html


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        (answer(1e-5, "fine"), "outcome is 'fine'"),
        (answer(-1), "value is '-1'"),
        (answer("nan"), "no value of an answer that is ok"),
        (answer(1e-5, "crashed: SIGSEGV"), "value 1e-05 of an answer that is crashed"),
        (answer(1e-5, scene="arm"), "scene: 'arm'"),
        (answer(1e-5)[:-1], "not 10 values"),
    ],
)
def test_a_file_that_holds_no_such_record_is_named_and_the_rest_is_shown(read, take, row, reason):
    read("errors-engines-b.csv", text(fake_engines.ERRORS, [answer(1e-6, variant="Other")]))
    data = take([answer(1e-5), row], [time()])
    (said,) = engines.section(data).statements
    assert said.startswith(f"Not read: errors-engines-a.csv:3: {reason}")
    assert [cell.variant for cell in cells(data)] == ["Other"]


def test_a_file_of_another_version_is_named(read):
    data = read("errors-engines-a.csv", "scene,n,variant\n")
    assert "errors-engines-a.csv: header is not" in engines.section(data).statements[0]
    assert "header is not" in make_report.page(data)


def test_without_engines_there_is_nothing_of_them():
    assert engines.section(Data()) is None


def test_it_is_the_first_section_and_unfolded(page):
    assert SECTIONS[0] is engines.section
    assert page.locator("section").first.get_by_role("heading", level=2).inner_text() == TITLE
    assert page.locator("section .fold").first.evaluate("(node) => node.open")


def test_the_slider_chooses_the_batch_of_marks_and_table_by_the_keyboard_and_stays_in_the_address(
    page, visit, written
):
    panel = figure(page, TITLE, "error against time")
    slider = unfolded(page, TITLE).get_by_role("slider", name="States a call")
    table = panel.locator(".numbers tbody tr")
    expect(marks(panel, "time of a state: 4.00 µs;")).to_be_visible()
    slider.press("End")
    expect(slider).to_have_attribute("aria-valuetext", "4\u202f096")
    expect(marks(panel, "time of a state: 200 ns;")).to_be_visible()
    expect(table.filter(has_text="Pinocchio")).to_contain_text("verified")
    again = visit(written, page.evaluate("location.hash"))
    expect(unfolded(again, TITLE).get_by_role("slider")).to_have_attribute(
        "aria-valuetext", "4\u202f096"
    )


def test_a_choice_of_robot_and_task_shows_its_marks_and_sentence(page):
    place, panel = unfolded(page, TITLE), figure(page, TITLE, "error against time")
    place.get_by_role("combobox", name="Robot").select_option("iiwa14:7")
    expect(marks(panel, "engine: Kalmarm, C++;").first).to_be_visible()
    assert marks(panel, "engine: Pinocchio;").count() == 0
    expect(place.locator(".answer:visible")).to_contain_text("For iiwa14, call Dynamics<double>")
