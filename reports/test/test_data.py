"""What is read is what was recorded, and bad input is refused with the file and the value."""

import json
import math

import pytest

import fake_estimation
from data import Data, DataError
from readers import COLUMNS, SAMPLE_COLUMNS, load

HEADER = ",".join(COLUMNS)
ROW = "panda:7,7,Batch<EigenLLT>,float64,inverse,0,relative,1.5e-16,ok"
ROBOT = {
    "scene": "panda:7",
    "states": 100,
    "notes": [],
    "mass": {"max": 1e-15, "median": 1e-16, "bound": 1e-13},
    "mass_variants": [{"variant": "CRBA", "mass": {"max": 1e-15, "median": 1e-16}}],
    "variants": [],
    "pass": True,
}
SAMPLES = ",".join(SAMPLE_COLUMNS)
SAMPLE = "panda:7,7,M,MonteCarlo,64,0,0.25,1e-4,2"


@pytest.fixture
def read(tmp_path):
    def read(name: str, text) -> Data:
        (tmp_path / name).write_text(text if isinstance(text, str) else json.dumps(text))
        return load(tmp_path)

    return read


def timed(name="inverse/Batch<EigenLLT>/panda:7/float64", **row):
    return {
        "name": name,
        "run_name": name,
        "run_type": "iteration",
        "real_time": 1.0,
        "time_unit": "ns",
    } | row


def test_an_error_row_keeps_its_parts(read):
    (row,) = read("errors-a.csv", f"{HEADER}\n{ROW}\n").errors
    assert row == ("panda:7", "Batch<EigenLLT>", "float64", "inverse", 0, "relative", 1.5e-16, "ok")


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


def paper(**residual):
    """A record of one erratum, whose residual in mp is as said."""
    document = fake_estimation.paper("chain:6")
    document["rows"] = [row for row in document["rows"] if row["id"] == "(3.12)"]
    document["rows"][0]["residuals"]["mp"] |= residual
    return document


def changed(document: dict, **row):
    document["rows"][0] |= row
    return document


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


def fast(name="acceleration_batch/Fast<Conventional>/g1:35/float64", **row):
    """A call of 1000 states during which other programs had the processor half of the time."""
    return timed(name, real_time=50.0, cpu_time=25.0, time_unit="us", **row)


def peak(precision: str, rate: float):
    return timed(f"peak/fma/native/{precision}") | {"FLOP/s": rate}


def test_a_call_has_its_counters_and_the_peak_of_its_precision(read):
    counted = fast() | {"flops": 15e3, "FLOP/s": 3e10, "s/state": 2.5e-8}
    rows = [peak("float64", 6e10), counted, peak("float32", 12e10)]
    data = read("peers-g1.json", {"context": {"peers": "KDL 1"}, "benchmarks": rows})
    (call,) = data.peers
    assert (call.flops, call.rate, call.peak) == (15e3, 3e10, 6e10)
    assert call.time[:4] == ("g1:35", "Fast<Conventional>", "float64", "acceleration_batch")
    assert call.time.nanoseconds == pytest.approx(50)  # by the state, as long as it took
    assert (data.times, data.scenes, data.all_contexts) == ([], [], [{"peers": "KDL 1"}])


def test_a_counter_of_real_time_is_taken_for_it(read):
    name = "acceleration_batch/Fast<Conventional>/g1:35/float64/real_time"
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


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("errors-a.csv", "scene,n\n", "header"),
        (
            "errors-a.csv",
            f"{HEADER}\n{ROW.replace('panda:7', 'panda')}\n",
            "errors-a.csv:2: scene 'panda'",
        ),
        (
            "errors-a.csv",
            f"{HEADER}\n{ROW}\n{ROW.replace('1.5e-16', 'x')}\n",
            "errors-a.csv:3: .*'x'",
        ),
        ("errors-a.csv", f"{HEADER}\npanda:7,7\n", "errors-a.csv:2: not 9 values"),
        ("errors-a.csv", f"{HEADER}\n{ROW}\n{ROW}\n", "panda:7/.*recorded 2 times"),
        ("errors-a.csv", f"{HEADER}\n", "no data"),
        ("times-a.json", "{", "times-a.json: not JSON"),
        ("times-a.json", "[]", "not Google Benchmark"),
        ("times-a.json", {"context": {}}, "'benchmarks' is missing"),
        ("times-a.json", {"benchmarks": [timed("inverse/panda")]}, "'inverse/panda'"),
        ("times-a.json", {"benchmarks": [timed(real_time=0)]}, "took 0"),
        ("times-a.json", {"benchmarks": [timed(real_time=math.nan)]}, "took nan"),
        ("times-a.json", {"benchmarks": [timed(time_unit="h")]}, "is in 'h'"),
        ("mujoco-a.json", {"robots": []}, "no data"),
        ("mujoco-a.json", {"mujoco": "4", "robots": [{"scene": "panda:7"}]}, "'notes' is missing"),
        (
            "mujoco-a.json",
            {"mujoco": "4", "robots": [ROBOT | {"notes": [7]}]},
            "a note is no text",
        ),
        (
            "mujoco-a.json",
            {"mujoco": "4", "robots": [ROBOT | {"mass_variants": [{"variant": "CRBA"}]}]},
            "'mass' is missing",
        ),
        ("mujoco-a.json", {"mujoco": "4", "robots": [ROBOT, ROBOT]}, "recorded 2 times"),
        ("paper-a.json", {"scene": "chain:6"}, "not a record of the paper: 'precisions'"),
        ("paper-a.json", [], "paper-a.json: not a record of the paper"),
        ("paper-a.json", paper() | {"scene": "chain"}, "scene 'chain' is not"),
        ("paper-a.json", paper() | {"rows": []}, "no equation in any precision"),
        ("paper-a.json", paper() | {"rows": 2 * paper()["rows"]}, r"\(3.12\) is recorded 2 times"),
        ("paper-a.json", paper(verdict="perhaps"), r"verdict 'perhaps' of \(3.12\)"),
        ("paper-a.json", paper(printed=-1.0), r"residual -1.0 of \(3.12\)"),
        ("paper-a.json", paper(corrected=math.nan), r"residual nan of \(3.12\)"),
        ("paper-a.json", paper(corrected="none"), "not a record of the paper"),
        ("paper-a.json", paper(tolerance=0), r"tolerance 0 of \(3.12\)"),
        ("paper-a.json", changed(paper(), corrected=""), "misprint without a corrected form"),
        ("paper-a.json", changed(paper(), note=None), "None.*not all text"),
        ("paper-a.json", changed(paper(), residuals={"float64": {}}), "'printed' is missing"),
        ("simulation-a.csv", "scene,n\n", "header is not scene,n,quantity"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE},1\n", "simulation-a.csv:2: not 9 values"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace(':7', '')}\n", "scene 'panda'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('64', '6.4')}\n", ":2: .*'6.4'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('64', '-1')}\n", "of -1 samples"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('0.25', 'nan')}\n", "error nan of 64"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('1e-4', '0')}\n", "took 0 s"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE}\n{SAMPLE}\n", "sample of panda.*2 times"),
        ("simulation-a.csv", f"{SAMPLES}\n", "no data"),
        ("estimation-a.json", {"context": {}}, "estimation-a.json: .*'benchmarks' is missing"),
        ("estimation-a.json", {"benchmarks": [timed("covariances/a/7")]}, "'covariances/a/7'"),
        ("estimation-a.json", {"benchmarks": [timed("harness/empty/none/none")]}, "no data"),
        (
            "peers-a.json",
            {"benchmarks": [fast() | {"FLOP/s": math.nan}]},
            r"FLOP/s of .* is \[nan\]",
        ),
        ("peers-a.json", {"benchmarks": [peak("float64", 1e9)]}, "no data"),
        ("peers-a.json", {"benchmarks": [fast("mass/KDL/panda/float64")]}, "scene 'panda' is not"),
        ("dynamics-a.json", {"benchmarks": [fast() | {"s/state": -1}]}, "s/state of .* is"),
    ],
)
def test_bad_data_is_refused_by_name(read, name, text, message):
    with pytest.raises(DataError, match=message):
        read(name, text)


@pytest.mark.parametrize(
    "kind, document, what",
    [
        ("paper", paper(), "check of the paper of chain:6"),
        ("estimation", {"benchmarks": [timed()]}, "time of the recursions of panda:7"),
        ("dynamics", {"benchmarks": [fast()]}, "time of the fast path of g1:35"),
        ("peers", {"benchmarks": [fast()]}, "time against peers of g1:35"),
    ],
)
def test_what_two_files_record_is_refused(read, kind, document, what):
    read(f"{kind}-a.json", document)
    with pytest.raises(DataError, match=f"{what}.* is recorded 2 times"):
        read(f"{kind}-b.json", document)
