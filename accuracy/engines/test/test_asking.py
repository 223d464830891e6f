"""What is recorded of engines that answer, and of those that do not."""

import csv
import sys
from pathlib import Path
from types import SimpleNamespace

import measure
import mechanisms
import pytest
import records
import worker
from protocol import Mechanism

HERE = Path(__file__).resolve().parent
LATER = "inverse_dynamics"  # asked after the task in which engines fail


def outcomes(answers, task):
    return [answers.errors[task, i].get("outcome", "ok") for i in range(answers.states)]


def test_one_that_answers_has_an_error_a_state_and_a_time_a_task(ask, pendulum):
    answers = ask("unruly", "good", pendulum)
    assert {said["error"] for said in answers.errors.values()} == {0.0}
    assert len(answers.errors) == 10 and answers.version
    assert answers.times.keys() == measure.TASKS.keys()
    assert all(
        time["nanoseconds"] > 0 and time["first_call"] > 0 for time in answers.times.values()
    )


@pytest.mark.parametrize(
    ("how", "outcome"),
    [
        ("nan", "not finite"),
        ("crash", "crashed: SIGABRT"),
        ("raise", "failed: ZeroDivisionError: by zero"),
        ("refuse", "refused: singular"),
    ],
)
def test_one_that_does_not_is_a_record_that_says_so_and_the_rest_goes_on(
    ask, pendulum, how, outcome
):
    answers = ask("unruly", how, pendulum)
    assert outcomes(answers, "acceleration") == ["ok", outcome]
    assert outcomes(answers, LATER) == ["ok", "ok"]
    assert "acceleration" not in answers.times and LATER in answers.times


def test_a_call_that_takes_longer_than_the_limit_is_ended(ask, pendulum):
    answers = ask("unruly", "hang", pendulum, limit=15.0)  # a loaded machine takes seconds to begin
    assert outcomes(answers, "acceleration") == ["ok", "timed out: 15 s"]
    assert outcomes(answers, LATER) == ["ok", "ok"]


@pytest.mark.parametrize(
    ("how", "outcome"),
    [("cannot", "unsupported: no such joint, here"), ("dies", "crashed: SIGABRT")],
)
def test_one_that_cannot_hold_the_mechanism_answers_nothing(ask, pendulum, how, outcome):
    answers = ask("unruly", how, pendulum)
    assert {said["outcome"] for said in answers.errors.values()} == {outcome}
    assert len(answers.errors) == 10


def test_a_warning_stands_beside_its_answer(ask, pendulum):
    answers = ask("unruly", "warn", pendulum)
    assert answers.errors["acceleration", 1]["error"] == 0
    assert outcomes(answers, "acceleration") == ["ok", "warned"]


def test_batches_of_every_size_have_a_time(pendulum, monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    monkeypatch.setattr(measure, "OUT", tmp_path)
    monkeypatch.setattr(measure.Unit, "key", "key")
    unit = measure.Unit("unruly", "good", "float64", pendulum)
    measure.write(unit, measure.ask(unit, Path(sys.executable), 20.0, 0.001, (3, 50)))
    with unit.path("times").open() as file:
        rows = [row for row in csv.DictReader(file) if row["task"] == "acceleration"]
    assert [(row["batch"], row["outcome"]) for row in rows] == [
        ("1", "ok"),
        ("3", "ok"),
        ("50", "ok"),
    ]
    assert all(float(row["nanoseconds"]) > 0 and float(row["with_copies"]) > 0 for row in rows)
    assert {row["engine"] for row in rows} == {"unruly"}


def test_answers_of_a_batch_are_judged_as_those_of_one_state_are(ask, pendulum):
    answers = ask("unruly", "rows", pendulum, batches=(1, 50))
    assert [said["error"] for said in answers.of("acceleration")] == [0.0, 0.0]
    (one,) = answers.of("batch:1")
    assert one["error"] == pytest.approx(0.01)
    assert [said["error"] for said in answers.of("batch:50")] == pytest.approx([0.01, 0.01])


@pytest.mark.parametrize(
    ("how", "precision", "outcome"),
    [
        ("lies", "float64", "failed: float32 holds its answers, which were to be float64"),
        ("good", "float32", "failed: its answers are float64, not float32"),
    ],
)
def test_one_that_lies_about_its_precision_has_no_error(ask, pendulum, how, precision, outcome):
    assert outcomes(ask("unruly", how, pendulum, precision), "acceleration")[-1] == outcome


def test_an_answer_about_the_mechanism_without_armature_says_so(pendulum):
    engine = SimpleNamespace(armature=False, warning=None)
    said = worker.verdict(engine, Mechanism(pendulum.folder), 1e-9, "", [])
    assert said == {"error": 1e-9, "outcome": "model differs: without armature"}


def test_one_that_needs_a_gpu_is_neither_installed_nor_asked_without(monkeypatch):
    monkeypatch.setattr(measure, "has_gpu", lambda: False)
    with pytest.raises(measure.NotAsked, match="it needs a GPU"):
        measure.prepared("none", measure.Facts("Needy", ["Needy"], ["float32"], True))


def test_one_that_cannot_be_imported_here_is_a_record_that_says_why(ask, pendulum):
    answers = ask("needy", "Needy", pendulum)
    (outcome,) = {said["outcome"] for said in answers.errors.values()}
    assert outcome == "failed: ModuleNotFoundError: No module named 'cuda_of_nobody'"


def test_derivatives_are_asked_of_hinges_and_slides_alone(ask, pendulum, free_body):
    assert outcomes(ask("unruly", "good", pendulum), "derivatives") == ["ok", "ok"]
    (outcome,) = set(outcomes(ask("unruly", "good", free_body), "derivatives"))
    assert outcome == "unsupported: it is asked of hinges and slides alone"


def test_what_an_engine_prints_is_no_record(ask, pendulum):
    assert outcomes(ask("unruly", "prints", pendulum), "acceleration") == ["ok", "ok"]


def test_records_are_written_as_they_were_measured(ask, pendulum, tmp_path, monkeypatch):
    monkeypatch.setattr(measure, "OUT", tmp_path / "out")
    monkeypatch.setattr(measure.Unit, "key", "key")
    for how in ("cannot", "warn"):
        unit = measure.Unit("unruly", how, "float64", pendulum)
        assert not unit.is_done
        measure.write(unit, ask("unruly", how, pendulum))
        assert unit.is_done
    with measure.Unit("unruly", "cannot", "float64", pendulum).path("errors").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == records.ERRORS
    assert {(row["value"], row["outcome"]) for row in rows} == {
        ("nan", "unsupported: no such joint, here")
    }
    with unit.path("times").open() as file:
        times = {row["task"]: row for row in csv.DictReader(file)}
    assert times[LATER]["outcome"] == "ok" and float(times[LATER]["nanoseconds"]) > 0
    unit.path("errors").with_suffix(".key").write_text("of another adapter")
    assert not unit.is_done


@pytest.mark.parametrize("engine", measure.adapters())
def test_an_adapter_says_what_it_is_without_its_engine(engine):
    facts = measure.facts(engine)
    assert facts.name and facts.variants
    assert set(facts.precisions) <= {"float32", "float64"}
    assert measure.environments.LOCKS.joinpath(f"{engine}.in").is_file()
    assert "--hash=sha256:" in measure.environments.LOCKS.joinpath(f"{engine}.txt").read_text()


def test_names_of_mechanisms_are_scenes_stresses_and_finds():
    assert mechanisms.arguments("chain:31")[0] == "chain:31"
    stressed = mechanisms.arguments("iiwa14+payload=1e4")
    assert stressed[0] == "iiwa14" and stressed[-4:] == ["--stress", "payload", "--value", "1e4"]
    assert "--states" in mechanisms.arguments(mechanisms.found()[0])
    assert mechanisms.Written(mechanisms.label(mechanisms.found()[0], 5), HERE, "").is_found
    assert not mechanisms.Written("chain:31", HERE, "").is_found
    assert mechanisms.label("iiwa14+payload=1e4", 7) == "iiwa14+payload=1e4:7"
    assert mechanisms.label("chain:31", 31) == "chain:31"
    assert mechanisms.label("robots/arm.urdf", 6) == "arm:6"
    with pytest.raises(mechanisms.BadName):
        mechanisms.arguments("panda+payload")
