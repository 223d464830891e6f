"""A new adapter: written, run as it is, and alone."""

import shutil

import measure
import pytest
from environments import LOCKS
from mechanisms import BadName


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where adapters and locks are written, which is not the repository."""
    monkeypatch.setattr(measure, "LOCKS", tmp_path / "locks")
    shutil.copytree(measure.HERE / "template", tmp_path / "template")
    monkeypatch.setattr(measure, "HERE", tmp_path)
    for name in ("adapters", "locks"):
        (tmp_path / name).mkdir()
    return tmp_path


def test_a_new_adapter_runs_as_it_is_and_says_what_is_to_be_written(
    folder, pendulum, ask, monkeypatch
):
    measure.new("my_engine")
    assert measure.facts("my_engine") == ("my_engine", ["my_engine"], ["float64"], False)
    assert (folder / "locks" / "my_engine.in").read_text() == "numpy\n"
    text = (folder / "adapters" / "my_engine.py").read_text()
    assert len(text.splitlines()) <= 62
    monkeypatch.undo()
    # Its folder `adapters` stands beside ours.
    answers = ask("my_engine", "my_engine", pendulum, path=folder, batches=(16,))
    assert {said["outcome"] for said in answers.errors.values()} == {
        "unsupported: to be written",
        "unsupported: it has no such call",
        "unsupported: it has no call of many states",
    }


def test_a_name_that_is_taken_or_none_is_refused_and_nothing_is_written(folder):
    measure.new("mine")
    with pytest.raises(BadName, match="mine.py is there already"):
        measure.new("mine")
    for name in ("My", "a-b", "../a", ""):
        with pytest.raises(BadName, match="is no name"):
            measure.new(name)
    assert [path.name for path in (folder / "adapters").iterdir()] == ["mine.py"]


def test_engines_of_the_repository_are_locked():
    assert measure.LOCKS == LOCKS
