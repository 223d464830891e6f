"""Bad input is refused with the file and the value."""

import math

import pytest

from read.data import DataError
from records import HEADER, ROBOT, ROW, SAMPLE, SAMPLES, changed, fast, paper, peak, timed


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("errors-a.csv", "scene,n\n", "header"),
        (
            "errors-a.csv",
            f"{HEADER}\n{ROW.replace('panda:7', 'panda')}\n",
            "errors-a.csv:2: scene: 'panda'",
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
        ("times-a.json", {"benchmarks": [timed(real_time=0)]}, "real_time of .* is 0"),
        ("times-a.json", {"benchmarks": [timed(real_time=math.nan)]}, "real_time is nan"),
        ("times-a.json", {"benchmarks": [timed(time_unit="h")]}, "time_unit is 'h'"),
        ("mujoco-a.json", {"robots": []}, "'mujoco' is missing"),
        ("mujoco-a.json", {"mujoco": "4", "robots": [{"scene": "panda:7"}]}, "states' is missing"),
        (
            "mujoco-a.json",
            {"mujoco": "4", "robots": [ROBOT | {"notes": [7]}]},
            "notes.0 is 7",
        ),
        (
            "mujoco-a.json",
            {"mujoco": "4", "robots": [ROBOT | {"mass_variants": [{"variant": "CRBA"}]}]},
            "mass' is missing",
        ),
        ("mujoco-a.json", {"mujoco": "4", "robots": [ROBOT, ROBOT]}, "recorded 2 times"),
        ("paper-a.json", {"scene": "chain:6"}, "not a record of the paper: 'pass'"),
        ("paper-a.json", [], "paper-a.json: not a record of the paper"),
        ("paper-a.json", paper() | {"scene": "chain"}, "scene: 'chain' is not"),
        ("paper-a.json", paper() | {"rows": []}, r"rows is \[\]"),
        ("paper-a.json", paper() | {"rows": 2 * paper()["rows"]}, r"\(3.12\) is recorded 2 times"),
        ("paper-a.json", paper(verdict="perhaps"), "verdict is 'perhaps'"),
        ("paper-a.json", paper(printed=-1.0), "printed is -1.0"),
        ("paper-a.json", paper(corrected=math.nan), "corrected is nan"),
        ("paper-a.json", paper(corrected="none"), "not a record of the paper"),
        ("paper-a.json", paper(tolerance=0), "tolerance is 0"),
        ("paper-a.json", changed(paper(), corrected=""), "misprint without a corrected form"),
        ("paper-a.json", changed(paper(), note=None), "note is None"),
        ("paper-a.json", changed(paper(), residuals={"float64": {}}), "printed' is missing"),
        ("simulation-a.csv", "scene,n\n", "header is not scene,n,quantity"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE},1\n", "simulation-a.csv:2: not 9 values"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace(':7', '')}\n", "scene: 'panda'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('64', '6.4')}\n", ":2: .*'6.4'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('64', '-1')}\n", "samples is '-1'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('0.25', 'nan')}\n", "error is 'nan'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE.replace('1e-4', '0')}\n", "seconds is '0'"),
        ("simulation-a.csv", f"{SAMPLES}\n{SAMPLE}\n{SAMPLE}\n", "sample of panda.*2 times"),
        ("simulation-a.csv", f"{SAMPLES}\n", "no data"),
        ("estimation-a.json", {"context": {}}, "estimation-a.json: .*'benchmarks' is missing"),
        ("estimation-a.json", {"benchmarks": [timed("covariances/a/7")]}, "'covariances/a/7'"),
        ("estimation-a.json", {"benchmarks": [timed("harness/empty/none/none")]}, "no data"),
        (
            "peers-a.json",
            {"benchmarks": [fast() | {"FLOP/s": math.nan}]},
            "FLOP/s is nan",
        ),
        ("peers-a.json", {"benchmarks": [peak("float64", 1e9)]}, "no data"),
        ("peers-a.json", {"benchmarks": [fast("mass/KDL/panda/float64")]}, "'panda' is not NAME:NV"),
        ("dynamics-a.json", {"benchmarks": [fast() | {"s/state": -1}]}, "s/state is -1"),
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
