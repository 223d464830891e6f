"""The first figure: the ladder at its tolerances, before all other variants."""

import pytest
from playwright.sync_api import expect

from browsing import figure, marks, section
from charts.ladder import by_tolerance, rows
from read.data import Data, Error, Time
from read.ladder import set_apart, tolerance
from sections import SECTIONS, ladder
from summary.points import points

TITLE = "The ladder: error against run time"
LADDER = {  # time [ns] and error
    "Ladder<1>": (100, 2e-16),
    "Ladder<1e-3>": (101, 2e-16),
    "Ladder<default>": (99, 2e-16),
    "Ladder<last_bits>": (350, 5e-17),
    "Rung<two_doubles>": (9000, 5e-17),
}
OTHERS = {"Batch<EigenLLT>": (700, 8e-16), "Sequential<UD>": (900, 2e-16)}


def measured(scene="arm:7", task="acceleration", of=LADDER | OTHERS) -> Data:
    data = Data()
    for variant, (time, error) in of.items():
        series = (scene, variant, "float64", task)
        data.times.append(Time(*series, time, 0.01, 5, ""))
        data.errors.append(Error(*series, 0, "relative", error, "ok"))
    set_apart(data)
    return data


def test_it_is_the_first_section_and_unfolded(page):
    assert SECTIONS[0] is ladder.section
    assert page.locator("section").first.get_by_role("heading", level=2).inner_text() == TITLE
    assert page.locator("section .fold").first.evaluate("(node) => node.open")


def test_other_sections_do_not_take_tolerances_for_contenders():
    data = measured()
    assert {point.variant for point in points(data)} == {
        "Ladder<default>",
        "Ladder<last_bits>",
        *OTHERS,
    }
    assert {it.variant for it in data.ladder_times} == {
        "Ladder<1>",
        "Ladder<1e-3>",
        "Rung<two_doubles>",
    }


def test_tolerances_come_from_the_largest_on_and_rungs_last():
    (found,) = ladder._found(measured()).values()
    assert [it.variant for it in sorted(found, key=by_tolerance)][:5] == list(LADDER)


@pytest.mark.parametrize(
    "variant, precision, expected",
    [
        ("Ladder<default>", "float32", 1e-2),
        ("Ladder<default>", "float64", 1e-8),
        ("Ladder<last_bits>", "float64", 2.0**-50),
        ("Ladder<1e-3>", "float64", 1e-3),
        ("Rung<two_doubles>", "float64", None),
        ("Ladder<A>", "float64", None),
        ("Batch<EigenLLT>", "float64", None),
    ],
)
def test_a_name_says_its_tolerance(variant, precision, expected):
    assert tolerance(variant, precision) == expected


def test_tolerances_that_err_alike_share_a_label_at_the_slowest():
    (found,) = ladder._found(measured()).values()
    drawn = rows(found, "acceleration")
    labels = {row["variant"]: row["label"] for row in drawn if row["group"] == "ladder"}
    assert labels == {
        "Ladder<1>": " ",
        "Ladder<1e-3>": "1 … default, float64",
        "Ladder<default>": " ",
        "Ladder<last_bits>": "last bits, float64",
        "Rung<two_doubles>": "two doubles, float64",
    }


def test_others_answer_batches_one_state_after_another():
    data = measured()
    batch = measured(task="acceleration_batch", of=LADDER)
    data.ladder_errors += batch.ladder_errors
    data.ladder_times += batch.times + batch.ladder_times
    found = ladder._found(data)["arm:7", "acceleration_batch"]
    times = {it.variant: it.time for it in found}
    assert times["Batch<EigenLLT>"] == OTHERS["Batch<EigenLLT>"][0]
    assert {row["view"] for row in rows(found, "acceleration_batch")} == {
        "acceleration_batch/relative"
    }


def test_one_tolerance_alone_is_no_figure():
    assert ladder.section(measured(of={"Ladder<default>": (99, 2e-16)} | OTHERS)) is None


def test_the_table_has_the_numbers_of_the_figure():
    made = ladder.section(measured())
    (table,) = made.tables
    assert table.rows == [
        ["float64", "1", "100 ns", "2.0e-16"],
        ["float64", "1e-3", "101 ns", "2.0e-16"],
        ["float64", "default", "99.0 ns", "2.0e-16"],
        ["float64", "last bits", "350 ns", "5.0e-17"],
        ["float64", "two doubles", "9.00 µs", "5.0e-17"],
    ]
    assert made.choices == []


def test_a_choice_of_robot_and_task_shows_its_marks_and_table(page):
    place = section(page, TITLE)
    panel = figure(page, TITLE, "at each tolerance")
    place.get_by_role("combobox", name="Show").select_option("acceleration_batch/relative")
    expect(marks(panel, "variant: Ladder<1e-3>;").first).to_be_visible()
    assert marks(panel, "variant: Ladder<1e-12>;").count() == 0  # has no time of batches
    place.get_by_role("combobox", name="Show").select_option("acceleration/relative")
    place.get_by_role("combobox", name="Robot").select_option("iiwa14:7")
    expect(marks(panel, "variant: Ladder<1e-12>;").first).to_be_visible()
    assert marks(panel, "scene: panda:7").count() == 0
    expect(place.locator("table:visible caption").first).to_contain_text("iiwa14")
