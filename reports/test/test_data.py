"""What is read is what was recorded."""

import math

import pytest

from read.readers import load
from records import HEADER, ROBOT, ROW, SAMPLE, SAMPLES, fast, paper, peak, timed


def test_an_error_row_keeps_its_parts(read):
    (row,) = read("errors-a.csv", f"{HEADER}\n{ROW}\n").errors
    assert row == ("panda:7", "Batch<EigenLLT>", "float64", "inverse", 0, "relative", 1.5e-16, "ok")


def test_an_apostrophe_for_spreadsheets_is_no_part_of_a_name(read):
    for name in ("=two:2", "'a:2", "-b:2", "c'd:2"):
        cell = name if name == "c'd:2" else "'" + name
        (row,) = read("errors-a.csv", f"{HEADER}\n{ROW.replace('panda:7', cell)}\n").errors
        assert row.scene == name


def test_a_failure_is_kept(read):
    (row,) = read("errors-a.csv", f"{HEADER}\n{ROW.replace('1.5e-16,ok', 'nan,singular')}\n").errors
    assert math.isnan(row.value) and row.outcome == "singular"


def test_median_and_variation_come_from_the_aggregates(read):
    rows = [timed(real_time=t) for t in (9.0, 1.0)]
    rows += [
        timed(run_type="aggregate", aggregate_name=name, real_time=value, repetitions=2)
        for name, value in (("mean", 5.0), ("median", 4.0), ("cv", 0.25))
    ]
    (time,) = read("times-a.json", {"benchmarks": rows}).times
    assert (time.nanoseconds, time.variation, time.repetitions) == (4.0, 0.25, 2)


def test_without_aggregates_the_median_is_of_the_repetitions(read):
    (time,) = read(
        "times-a.json", {"benchmarks": [timed(real_time=t) for t in (1.0, 9.0, 2.0)]}
    ).times
    assert time.nanoseconds == 2.0


def test_times_are_in_nanoseconds_whatever_their_unit(read):
    (time,) = read("times-a.json", {"benchmarks": [timed(real_time=2.5, time_unit="us")]}).times
    assert time.nanoseconds == 2500


def test_settings_after_a_benchmarks_name_are_no_part_of_it(read):
    name = "inverse/Batch<EigenLLT>/panda:7/float64/min_time:0.1/repeats:5"
    (time,) = read("times-a.json", {"benchmarks": [timed(name)]}).times
    assert time[:4] == ("panda:7", "Batch<EigenLLT>", "float64", "inverse")


def test_a_refused_benchmark_has_a_reason_and_no_time(read):
    row = timed(error_occurred=True, error_message="too far off", real_time=0.0)
    (time,) = read("times-a.json", {"benchmarks": [row]}).times
    assert time.nanoseconds is None and time.refused == "too far off"


def test_a_timing_of_no_scene_is_that_of_the_benchmark_itself(read):
    data = read("times-a.json", {"benchmarks": [timed("harness/empty/none/none"), timed()]})
    assert (len(data.harness), data.scenes) == (1, ["panda:7"])


def test_a_family_has_several_sizes_and_a_robot_one(read):
    rows = [ROW, ROW.replace("panda:7", "chain:3"), ROW.replace("panda:7", "chain:15")]
    data = read("errors-a.csv", "\n".join([HEADER, *rows]))
    assert data.families == ["chain"]
    assert data.robots == ["panda:7"]
    assert data.scenes == ["chain:3", "panda:7", "chain:15"]


def test_an_equation_keeps_its_parts(read):
    (record,) = read("paper-chain-6.json", paper(printed=None, corrected=2e-55)).papers
    assert (record.scene, record.beyond_scene, record.passed) == ("chain:6", "tree:14", True)
    assert record.precisions[1] == ("mp", 55, 1.2e4)
    (equation,) = record.equations
    assert equation[:3] == ("(3.12)", "3", "Result 3.4")
    assert equation.corrected == "Ψ = (I − ΨgH)Φ" and "closed loop" in equation.note
    assert equation.residuals["mp"] == (None, 2e-55, 1e-48, "misprint")


@pytest.mark.parametrize(
    "residual, holds",
    [
        ({"corrected": 1e-48}, True),
        ({"corrected": 1.1e-48}, False),  # whatever its own verdict
        ({"corrected": None}, False),
        ({"verdict": "fails"}, False),
    ],
)
def test_an_equation_holds_by_its_verdict_and_by_its_numbers(read, residual, holds):
    (record,) = read("paper-a.json", paper(**residual)).papers
    assert record.equations[0].holds == holds


def test_a_sample_keeps_its_parts(read):
    (sample,) = read("simulation-a.csv", f"{SAMPLES}\n{SAMPLE}\n").samples
    assert sample == ("panda:7", "M", "MonteCarlo", 64, 0, 0.25, 1e-4, 2)


def test_times_of_the_recursions_are_no_times_of_scenes(read):
    document = {"context": {"cpu": "one"}, "benchmarks": [timed("covariances/a/chain:10/float64")]}
    data = read("estimation-a.json", document)
    (time,) = data.estimation
    assert time[:4] == ("chain:10", "a", "float64", "covariances")
    assert (data.times, data.scenes, data.contexts) == ([], [], [])
    assert data.all_contexts == [{"cpu": "one"}]


def test_a_call_has_its_counters_and_the_peak_of_its_precision(read):
    counted = fast() | {"flops": 15e3, "FLOP/s": 3e10, "s/state": 2.5e-8}
    rows = [peak("float64", 6e10), counted, peak("float32", 12e10)]
    data = read("peers-g1.json", {"context": {"peers": "KDL 1"}, "benchmarks": rows})
    (call,) = data.peers
    assert (call.flops, call.rate, call.peak) == (15e3, 3e10, 6e10)
    assert call.time[:4] == ("g1:35", "Ladder<default>", "float64", "acceleration_batch")
    assert call.time.nanoseconds == pytest.approx(50)  # by the state, as long as it took
    assert (data.times, data.scenes, data.all_contexts) == ([], [], [{"peers": "KDL 1"}])


def test_a_counter_of_real_time_is_taken_for_it(read):
    name = "acceleration_batch/Ladder<default>/g1:35/float64/real_time"
    (call,) = read("peers-g1.json", {"benchmarks": [fast(name) | {"s/state": 5e-8}]}).peers
    assert call.time.nanoseconds == pytest.approx(50)


def test_counters_are_medians(read):
    rows = [
        fast(run_type="aggregate", aggregate_name=name) | {"FLOP/s": rate}
        for name, rate in (("mean", 9.0), ("median", 4.0), ("cv", 7.0))
    ]
    (call,) = read("dynamics-g1.json", {"benchmarks": rows}).dynamics
    assert call.rate == 4
    (call,) = read("dynamics-g1.json", {"benchmarks": [fast() | {"FLOP/s": 7.0}]}).dynamics
    assert (call.rate, call.flops, call.peak) == (7, None, None)
    assert call.time.nanoseconds == 50e3


def test_a_refused_call_has_its_reason_and_no_counters(read):
    row = fast(error_occurred=True, error_message="wrong") | {"FLOP/s": 0.0}
    (call,) = read("peers-g1.json", {"benchmarks": [row]}).peers
    assert (call.time.refused, call.time.nanoseconds, call.rate) == ("wrong", None, None)


def test_scenes_of_paper_and_simulation_are_no_measured_scenes(read):
    read("paper-a.json", paper())
    assert read("simulation-a.csv", f"{SAMPLES}\n{SAMPLE}\n").scenes == []


def test_other_files_of_a_folder_are_left_alone(read, tmp_path):
    (tmp_path / "evaluate-panda.json").write_text("no data")
    assert len(read("mujoco-a.json", {"mujoco": "4", "robots": [ROBOT]}).mujoco) == 1


def test_given_files_are_the_only_ones_read(read, tmp_path):
    read("errors-a.csv", f"{HEADER}\n{ROW}\n")
    (tmp_path / "errors-b.csv").write_text(f"{HEADER}\n{ROW.replace('panda', 'other')}\n")
    assert load(None, [tmp_path / "errors-b.csv"]).scenes == ["other:7"]
