"""Simulated motions on the page, from records whose numbers are known."""

import pytest

import alt_scene
from read.data import Data, DataError
from read.motions import COLUMNS
from read.readers import load
from sections import motions

HEADER = ",".join(COLUMNS)
CASE = "arm:2,2,1,0.5,100000,1,"
TRUTH = "1e-18,1e-16"
STEPS = [  # of springs at the end in float32, and of Euler in float64
    f"{CASE},springs_at_end,float32,default,0.01,,50,50,ok,1e-4,1e-2,1e-5,{TRUTH}",
    f"{CASE},springs_at_end,float32,default,0.001,,500,500,ok,1e-5,1e-3,1e-4,{TRUTH}",
    f"{CASE},semi_implicit_euler,float64,default,0.01,,7,7,unstable,,,,{TRUTH}",
    f"{CASE},semi_implicit_euler,float64,default,0.001,,500,500,ok,0.2,0.5,1e-4,{TRUTH}",
    f"{CASE},semi_implicit_euler,float64,default,0.0001,,9,9,unstable,,,,{TRUTH}",
    f"{CASE},semi_implicit_euler,float64,default,1e-05,,50000,50000,ok,1e-7,1e-5,1e-2,{TRUTH}",
    f"{CASE},rk4,float64,last_bits,0.01,,7,7,unstable,,,,{TRUTH}",
]
ADAPTIVE = f"{CASE},dopri5,float64,default,,1e-06,90,600,ok,1e-9,1e-8,2e-3,{TRUTH}"
SOFTER = STEPS[0].replace("100000", "1000").replace("1e-4,1e-2", "1e-3,2e-2")
NO_TRUTH = "leg:9,9,1,0.5,100000,,7,,,,,,,,no_truth,,,,,"


@pytest.fixture
def read(tmp_path):
    def read(*rows: str) -> Data:
        (tmp_path / "motions-arm.csv").write_text("\n".join([HEADER, *rows]) + "\n")
        return load(tmp_path)

    return read


def test_no_motions_are_no_section():
    assert motions.section(Data()) is None


def test_a_step_is_stable_where_all_smaller_ones_are(read):
    (table,) = motions.section(read(*STEPS, ADAPTIVE)).tables
    assert {tuple(row[:2]) for row in table.rows} == {("arm:2", "k = 1e5, ζ = 1, 0.5 s, seed 1")}
    assert [row[2:] for row in table.rows] == [
        ["springs_at_end", "float32", "10.0 ms", "1.0e-4", "1.0e-2", "10.0 µs"],
        ["semi_implicit_euler", "float64", "10.0 µs", "1.0e-7", "1.0e-5", "10.0 ms"],
        ["rk4<last bits>", "float64", "not at 10.0 ms", "–", "–", "–"],
    ]


def test_the_cheapest_stable_method_is_advised_for_each_error(read):
    (advice,) = motions.section(read(*STEPS, ADAPTIVE)).statements
    assert advice == (
        "arm:2, k = 1e5, ζ = 1, 0.5 s, seed 1: cheapest for q and v "
        "within 0.01 springs_at_end in float32 with h = 10.0 ms, 10.0 µs a simulated second; "
        "within 0.0001 dopri5 in float64 with tolerance 1.0e-6, 2.00 ms a simulated second; "
        "within 1e-6 dopri5 in float64 with tolerance 1.0e-6, 2.00 ms a simulated second."
    )
    (alone,) = motions.section(read(*STEPS)).statements
    assert alone.endswith("; within 1e-6 none that was measured.")


def test_a_motion_without_truth_is_named(read):
    found = motions.section(read(*STEPS, NO_TRUTH))
    assert found.statements[-1] == (
        "leg:9, k = 1e5, b = 7, 0.5 s, seed 1: left out, since its true end cannot be proven."
    )
    alone = motions.section(read(NO_TRUTH))
    assert (alone.figures, alone.tables, len(alone.statements)) == ([], [], 1)


def test_the_figure_draws_the_steps_that_are_stable_of_the_motion_chosen(read):
    found = motions.section(read(*STEPS, ADAPTIVE, SOFTER))
    (figure,) = found.figures
    (choice,) = figure.choices
    assert [value for value, _ in choice.options] == [
        "k = 1e3, ζ = 1, 0.5 s, seed 1",
        "k = 1e5, ζ = 1, 0.5 s, seed 1",
    ]
    assert choice.first == choice.options[-1][0]
    assert [option for option, _ in found.choices[0].options] == ["q", "v"]
    points = [item for layer in alt_scene.marks(figure.chart, "symbol") for item in layer]
    assert len(points) == 5  # two and two steps, one tolerance
    (rows,) = figure.chart.to_dict()["datasets"].values()
    assert {(row["step"], row["error"]) for row in rows if row["view"] == "v"} >= {
        ("h = 10.0 ms", 1e-2),
        ("tolerance 1.0e-6", 1e-8),
    }


def test_cvode_is_missed_where_adaptive_methods_were_measured(read):
    def missed(*rows: str) -> bool:
        return any("CVODE" in text for text in motions.section(read(*rows)).paragraphs)

    assert missed(ADAPTIVE)
    assert not missed(*STEPS)
    assert not missed(ADAPTIVE, ADAPTIVE.replace("dopri5", "cvode_bdf"))


def test_the_truth_is_said_with_its_largest_bound(read):
    paragraphs = motions.section(read(*STEPS, ADAPTIVE.replace("1e-18", "1e-13"))).paragraphs
    assert any("at most 1.0e-13 apart" in text for text in paragraphs)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        (STEPS[0].replace("ok", "good"), "2: status is 'good'"),
        (STEPS[0].replace("float32", "float16"), "2: precision is 'float16'"),
        (STEPS[0].replace("1e-4,1e-2,", ",,"), "2: errors and time of a simulation that is ok"),
        (STEPS[2].replace("unstable,", "unstable,1"), "2: errors and time .* unstable"),
        (STEPS[0].replace("0.01,,50", "0.01,1e-3,50"), "2: neither h nor tolerance, or both"),
        (STEPS[0].replace("100000,1,", "100000,1,2"), "2: case: neither damping_ratio nor damping"),
        (STEPS[0].replace("0.01,", "0,"), "2: h is '0'"),
        (STEPS[0].replace("arm:2", "arm"), "2: case.robot: 'arm' is not NAME:NV"),
        (STEPS[0].replace("1e-4,1e-2", "nan,1e-2"), "2: error_q is 'nan'"),
        (f"{STEPS[0]}\n{STEPS[0]}", "motion of arm:2.* is recorded 2 times"),
        (f"{NO_TRUTH}\n{NO_TRUTH}", "motion of leg:9.* is recorded 2 times"),
    ],
)
def test_what_is_no_record_of_a_motion_is_refused(read, row, message):
    with pytest.raises(DataError, match=message):
        read(row)
