"""The command `kalmarm`: what it says, in one line, where a program cannot run."""

import sys

import pytest
from kalmarm import __main__ as command


@pytest.fixture
def programs(tmp_path, monkeypatch):
    """A build that has the programs, none of which is run."""
    monkeypatch.setattr(command, "COMMAND", tmp_path / "kalmarm_command")
    command.COMMAND.touch()


@pytest.fixture
def refused(monkeypatch, capsys):
    def line(*arguments: str) -> str:
        monkeypatch.setattr(sys, "argv", ["kalmarm", *arguments])
        with pytest.raises(SystemExit) as end:
            command.main()
        out, told = capsys.readouterr()
        assert end.value.code == 2
        assert not out
        assert told.startswith("kalmarm: error: ") and told.count("\n") == 1
        return told

    return line


def test_a_build_without_programs_says_where_they_are(refused, tmp_path, monkeypatch):
    monkeypatch.setattr(command, "COMMAND", tmp_path / "kalmarm_command")
    for arguments in (["recommend", "g1.xml"], ["report", "g1.xml"], ["--help"]):
        assert "take a wheel" in refused(*arguments)


def test_help_names_programs_and_what_is_absent(programs, monkeypatch, capsys):
    for arguments in ([], ["--help"], ["-h"]):
        monkeypatch.setattr(sys, "argv", ["kalmarm", *arguments])
        assert command.main() == 0
        told = capsys.readouterr().out
        for name in (*command.PROGRAMS, *command.ABSENT):
            assert name in told


def test_what_no_wheel_has_is_refused_with_the_reason(programs, refused):
    for name, reason in command.ABSENT.items():
        assert reason in refused(name)
    assert "one of report, recommend" in refused("nonsense")


def test_without_mujoco_its_release_is_named(programs, refused, monkeypatch):
    monkeypatch.setattr(command.importlib.util, "find_spec", lambda name: None)
    assert f"pip install mujoco=={command._core.mujoco_version}" in refused("plan", "g1.xml")


def test_beside_another_mujoco_its_release_is_named(programs, refused, monkeypatch):
    monkeypatch.setattr(command._core, "mujoco_version", "1.2.3")
    assert "pip install mujoco==1.2.3, in place of" in refused("plan", "g1.xml")


def test_an_old_processor_is_refused_before_a_program_runs(programs, refused, monkeypatch):
    def refuse():
        raise RuntimeError("kalmarm: no kernels for this processor")

    monkeypatch.setattr(command, "instruction_set", refuse)
    assert "error: no kernels for this processor" in refused("plan", "g1.xml")


def test_report_says_what_it_lacks(programs, refused, monkeypatch):
    monkeypatch.setattr(command, "DRAWING", ("numpy", "no_such_package"))
    told = refused("report", "g1.xml")
    assert "with no_such_package: pip install 'kalmarm[report]'" in told


def test_report_refuses_what_it_does_not_know(programs, refused, monkeypatch):
    monkeypatch.setattr(command, "DRAWING", ())
    assert "no option --nonsense" in refused("report", "--nonsense", "g1.xml")
    assert "needs a robot's file" in refused("report", "--quick")
