"""The program of python/benchmarks runs, and its numbers are what they are called. No times."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from conftest import load

FILE = Path(__file__).parents[1] / "benchmarks" / "bench.py"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("bench", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def document(bench, tmp_path_factory):
    file = tmp_path_factory.mktemp("times") / "times.json"
    few = ["--states", "33", "--rounds", "3", "--seconds", "1e-6"]
    bench.main(["--robots", "iiwa14", "g1", *few, "--output", str(file)])
    return json.loads(file.read_text())


def rows(document, **fields):
    return [one for one in document["results"] if fields.items() <= one.items()]


def test_every_contender_of_every_robot_dtype_and_number_of_cores_is_there(document):
    over = {"C++", "Python", "Python, out="}
    others = {"pin.abaInParallel", "mujoco.rollout"}
    loops = {"pin.aba in a loop", "mj_forward in a loop"}
    ours = {"kalmarm, float32", "kalmarm, float64"}
    for robot in ("iiwa14", "g1"):
        for dtype in ("float32", "float64"):
            single = rows(document, what="one state", robot=robot, dtype=dtype)
            assert {one["contender"] for one in single} == over
            for threads in (1, 2):
                batch = rows(document, what="batch", robot=robot, dtype=dtype, threads=threads)
                assert {one["contender"] for one in batch} == over
        for threads, wanted in ((1, others | loops | ours), (2, others | ours)):
            found = rows(document, what="peers", robot=robot, threads=threads)
            assert {one["contender"] for one in found} == wanted
    assert document["machine"]["cpu"] and document["versions"]["pinocchio"]


def test_comparisons_are_taken_within_a_round(document):
    (cpp,) = rows(document, what="one state", robot="g1", dtype="float64", contender="C++")
    (ours,) = rows(document, what="one state", robot="g1", dtype="float64", contender="Python")
    more = np.array(ours["rounds"]) - cpp["rounds"]
    assert ours["more_nanoseconds"]["median"] == pytest.approx(np.median(more))
    ratio = np.array(ours["rounds"]) / cpp["rounds"]
    assert ours["times_cpp"]["low"] == pytest.approx(np.percentile(ratio, 25))

    (loop,) = rows(document, what="peers", robot="g1", contender="pin.aba in a loop")
    (single,) = rows(document, what="peers", robot="g1", threads=1, contender="kalmarm, float32")
    ratio = np.array(loop["rounds"]) / single["rounds"]
    assert loop["times_ours"]["float32"]["median"] == pytest.approx(np.median(ratio))
    assert loop["dtype"] == "float64" and single["dtype"] == "float32"


def test_contenders_take_turns_and_are_called_for_the_time_that_was_asked(bench):
    turns = []

    def taking(name, seconds):
        def run(calls):
            turns.append((name, calls))
            return calls * seconds

        return run

    found = bench.rounds_of({"a": taking("a", 0.25), "b": taking("b", 1e-3)}, 4, 0.5)
    assert found == {"a": pytest.approx([0.25] * 4), "b": pytest.approx([1e-3] * 4)}
    assert turns[-8:] == [("a", 2), ("b", 500)] * 4


def test_a_wrong_answer_is_not_timed(bench):
    with pytest.raises(SystemExit, match="pin is 5.0e-01 off"):
        bench.check("pin", np.array([1.0, 1.0]), np.array([1.0, 2.0]), 1e-8)
    with pytest.raises(SystemExit, match="pin is nan off"):
        bench.check("pin", np.array([1.0, np.nan]), np.array([1.0, 2.0]), 1e-8)


@pytest.mark.parametrize("singly", [True, False])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_loop_in_cpp_does_the_work_that_is_timed(singly, dtype):
    robot = load("iiwa14")
    q, qd, tau = robot.random_state(0, 20, dtype=dtype)
    out = np.full_like(qd, np.nan)
    assert robot._time_forward_dynamics(q, qd, tau, out, 1, singly=singly) > 0
    if singly:
        truth = [robot.forward_dynamics(*row) for row in zip(q, qd, tau)]
    else:
        truth = robot.forward_dynamics(q, qd, tau)
    np.testing.assert_array_equal(out, truth)
