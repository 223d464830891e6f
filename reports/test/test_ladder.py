"""The ladder at its tolerances: cells of the first section, set apart from contenders."""

import pytest

from charts.engines import cell_rows
from read.data import Call, Data, Error, Time
from read.ladder import set_apart, tolerance
from summary.engines import VERIFIED, cells
from summary.points import points

LADDER = {  # time [ns] and error
    "Ladder<1>": (100, 2e-16),
    "Ladder<1e-3>": (101, 2e-16),
    "Ladder<default>": (99, 2e-16),
    "Ladder<last_bits>": (350, 5e-17),
    "Rung<two_doubles>": (9000, 5e-17),
}
OTHERS = {"Batch<EigenLLT>": (700, 8e-16), "Sequential<UD>": (900, 2e-16)}


def measured(task="acceleration", of=LADDER | OTHERS) -> Data:
    data = Data()
    for variant, (time, error) in of.items():
        series = ("arm:7", variant, "float64", task)
        data.times.append(Time(*series, time, 0.01, 5, ""))
        data.errors.append(Error(*series, 0, "relative", error, "ok"))
    set_apart(data)
    return data


def test_other_sections_do_not_take_tolerances_for_contenders():
    data = measured()
    assert {point.variant for point in points(data)} == {
        "Ladder<default>",
        "Ladder<last_bits>",
        *OTHERS,
    }
    assert {it.time.variant for it in data.ladder_calls} == {
        "Ladder<1>",
        "Ladder<1e-3>",
        "Rung<two_doubles>",
    }


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


def test_every_tolerance_is_a_cell_of_one_series_with_its_error_and_time():
    found = {cell.tolerance: cell for cell in cells(measured())}
    assert {name: (cell.time, cell.median) for name, cell in found.items()} == LADDER
    assert {cell.status for cell in found.values()} == {VERIFIED}
    assert {cell.variant for cell in found.values()} == {"Kalmarm, C++"}


def test_tolerances_that_err_alike_share_a_label_at_the_slowest():
    labels = {row["tolerance"]: row["label"] for row in cell_rows(cells(measured()))}
    assert labels == {
        "1": " ",
        "1e-3": "1 … default, float64",
        "default": " ",
        "last bits": "last bits, float64",
        "two doubles": "two doubles, float64",
    }


def test_rows_are_cells_of_as_many_states_as_a_call_had():
    data = measured(of={"Ladder<1e-3>": (50, 1e-7)}, task="acceleration_batch")
    call = data.ladder_calls[0]
    data.ladder_calls = [Call(call.time, None, None, None, states=1024)]
    (cell,) = cells(data)
    assert (cell.task, cell.batch, cell.time) == ("acceleration", 1024, 50)
