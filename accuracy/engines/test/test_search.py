"""Searches of arms: what is drawn, in which order, and what counts as an error."""

import csv
import json
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import arms
import bodies
import measure
import numpy as np
import pytest
import search
from search import Contender, Journal, Judged


@pytest.fixture
def served(monkeypatch):
    """Engines of test/adapters, in our own interpreter."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parent))

    def served(how: str, limit: float = 20.0):
        contender = Contender("unruly", how, "float64")
        return search.Served(contender, Path(sys.executable), limit)

    return served


def drawn(count: int) -> list:
    return list(np.random.default_rng(5).random((count, arms.LENGTH)))


def test_arms_have_ordinary_proportions_and_every_number_of_hinges():
    decoded = [arms.decode(x) for x in drawn(300)]
    links = [link for arm in decoded for link in arm]
    assert {len(arm) for arm in decoded} == set(range(3, 8))
    assert min(link.mass for link in links) >= 0.01 and max(link.mass for link in links) <= 10
    assert min(link.length for link in links) >= 0.01 and max(link.length for link in links) <= 1
    assert all(0 < link.com < link.length and link.width < link.length for link in links)
    assert {link.twist for link in links} == {-1, 0, 1}
    assert {link.along for link in links} == {True, False}


@pytest.mark.parametrize("limit", [0.0, 1.0])
def test_the_ends_of_the_range_are_arms(limit):
    arm = arms.decode([limit] * arms.LENGTH)
    assert len(arm) == (7 if limit else 3)


def test_a_file_has_the_links_that_were_drawn_and_moments_that_a_body_can_have():
    for x in drawn(20):
        arm, bodies_of = arms.decode(x), []
        body = ElementTree.fromstring(arms.mjcf(arm)).find("worldbody/body")
        while body is not None:
            bodies_of.append(body)
            body = body.find("body")
        assert len(bodies_of) == len(arm)
        for link, body in zip(arm, bodies_of, strict=True):
            inertial = body.find("inertial")
            moments = sorted(map(float, inertial.get("diaginertia").split()))
            assert float(inertial.get("mass")) == link.mass
            assert 0 < moments[0] and moments[2] <= moments[0] + moments[1]


def record_of(evaluations: int, seed: int) -> tuple[list, list]:
    asked, values = [], []

    def judge_all(population):
        asked.extend(map(tuple, population))
        values.extend(float(np.sum((np.array(x) - 0.9) ** 2)) for x in population)
        return values[-len(population) :]

    search.maximise(judge_all, evaluations, seed)
    return asked, values


def test_a_search_asks_what_it_may_and_finds_better_than_what_it_drew_first():
    asked, values = record_of(300, 3)
    assert len(asked) == 300
    assert min(values) < 0.8 * min(values[:30])
    assert all(0 <= number <= 1 for x in asked for number in x)


def test_more_evaluations_go_on_where_fewer_ended_and_seeds_differ():
    whole = record_of(300, 3)[0]
    assert record_of(150, 3)[0] == whole[:150] and record_of(20, 3)[0] == whole[:30]
    assert record_of(30, 3)[0] != record_of(30, 4)[0]


def test_an_error_that_was_warned_of_or_is_no_number_is_not_silent():
    said = [
        {"state": 0, "error": 0.1},
        {"state": 1, "error": 0.9, "outcome": "warned"},
        {"state": 2, "outcome": "not finite"},
        {"state": 3, "error": 0.2},
    ]
    assert search.judged(said) == Judged(0.2, 3, "warned")
    assert search.judged(said[1:3]) == Judged(None, 0, "warned")
    assert search.judged([{"refused": "unsupported: no"}]).value == search.UNANSWERED


def test_an_engine_that_dies_or_hangs_is_asked_again(served, pendulum):
    for how, limit, outcome in (
        ("dies", 20.0, "crashed: SIGABRT"),
        ("hang", 3.0, "timed out: 3 s"),
    ):
        with served(how, limit) as engine:
            for _ in range(2):
                assert engine.judge(pendulum.folder) == Judged(None, 0, outcome)


def test_one_process_answers_one_mechanism_after_another(served, pendulum, free_body):
    with served("good") as engine:
        assert engine.judge(pendulum.folder) == Judged(0.0, 1)
        process = engine.worker.process.pid
        assert engine.judge(free_body.folder) == Judged(0.0, 2)
        assert engine.worker.process.pid == process and engine.version


def test_what_was_asked_is_not_asked_again_unless_by_another_adapter(tmp_path):
    path, x = tmp_path / "journal.jsonl", (0.1, 1 / 3)
    journal = Journal(path, "key")
    journal.begin("1.0")
    journal.add(x, Judged(0.5, 2))
    with path.open("a") as file:
        file.write('{"x": [0.2, 0.4], "error": 0.')  # interrupted here
    again = Journal(path, "key")
    assert again.known == {x: Judged(0.5, 2)} and again.version == "1.0"
    again.begin("1.0")
    again.add((0.3, 0.4), Judged(None, 0, "not finite"))
    assert len(Journal(path, "key").known) == 2
    assert not Journal(path, "another").known


def test_a_search_keeps_its_worst_arm_with_its_state(served, tmp_path, monkeypatch):
    monkeypatch.setattr(search, "FOLDER", tmp_path)
    monkeypatch.setattr(Contender, "key", "key")
    asked = []

    def export(x, seed, folder):
        asked.append(x)
        bodies.pendulum(folder)
        (folder / "arm.xml").write_text(arms.mjcf(arms.decode(x)))
        return ""

    monkeypatch.setattr(search, "export", export)
    contender = Contender("unruly", "wrong", "float64")
    for _ in range(2):
        journal = search.search(contender, Path(sys.executable), 30, 1, 20.0)
        assert len(asked) == 30  # the second time it is all known
    row = search.keep(contender, journal, 1, tmp_path / "finds")
    search.record(row, tmp_path / "finds")
    search.record(row, tmp_path / "finds")
    with (tmp_path / "finds" / "found.csv").open() as file:
        (line,) = csv.DictReader(file)
    assert line["version"] == journal.version and line["answered"] == "30"
    assert float(line["error"]) == pytest.approx(0.01)
    state = json.loads((tmp_path / "finds" / "wrong-float64.json").read_text())["states"]
    assert [one["qpos"] for one in state] == [[-2.0]]  # the one in which it is wrong
    assert (tmp_path / "finds" / "wrong-float64.xml").read_text() == arms.mjcf(
        arms.decode(asked[-1])
    )


def test_a_search_of_no_arms_is_refused(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["engines", "--search", "--evaluations", "0"])
    with pytest.raises(SystemExit):
        measure.main()
    assert "'0' is no positive number" in capsys.readouterr().err
