"""Many robots, some of which are refused."""

import csv
import os

import pytest
import running
from running import expect_refusal, needs_engine


@pytest.fixture
def files(tmp_path):
    """By what they hold."""

    def files(**texts: str) -> list[str]:
        for name, text in texts.items():
            (tmp_path / f"{name}.xml").write_text(text)
        return [str(tmp_path / f"{name}.xml") for name in texts]

    return files


def rows(out) -> list[dict]:
    with (out / "robots-campaign.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@needs_engine
def test_a_robot_that_is_refused_is_told_beside_the_others(tmp_path, files):
    out = tmp_path / "out"
    done = running.run("robots", *files(b="four", a="two", c="bad"), f"--out={out}")
    assert (done.returncode, done.stderr) == (0, "")
    assert "3 robots, 1 of them refused" in done.stdout
    first, second, third = rows(out)
    assert (first["robot"], first["digits"], first["kept"], first["silent"]) == (
        "a:7",
        "3",
        "1.0",
        "1",
    )
    assert (second["robot"], second["digits"]) == ("b:7", "4")
    assert third["name"] == "c" and third["refused"].endswith("c.xml: mass is negative")
    assert third["robot"] == ""


@needs_engine
def test_robots_may_all_be_refused(tmp_path, files):
    out = tmp_path / "out"
    done = running.run("robots", *files(a="bad", b="bad"), f"--out={out}")
    assert (done.returncode, done.stderr) == (0, "")
    assert [row["name"] for row in rows(out)] == ["a", "b"]


@needs_engine
def test_a_worker_that_dies_is_no_refusal(tmp_path, files):
    out = tmp_path / "out"
    done = running.run("robots", *files(a="two", b="dies"), f"--out={out}")
    expect_refusal(done, "1 of 2 units are there, start again to go on")
    assert not (out / "robots-campaign.csv").exists()


@needs_engine
def test_a_file_that_was_changed_is_another_campaign(tmp_path, files):
    out = tmp_path / "out"
    running.run("robots", *files(a="two"), f"--out={out}")
    done = running.run("robots", *files(a="four"), f"--out={out}")
    expect_refusal(done, "plan.json: of other options than these")


def test_files_of_one_name_and_files_that_are_none_are_refused(tmp_path, files):
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "a.xml").write_text("")
    out = f"--out={tmp_path}/out"
    done = running.run("robots", *files(a="two"), str(tmp_path / "other" / "a.xml"), out)
    expect_refusal(done, "other/a.xml: another file is called a too")
    expect_refusal(running.run("robots", "/nowhere/a.xml", out), "/nowhere/a.xml: No such file")


@pytest.mark.parametrize("name", ["a\nb.xml", os.fsdecode(b"\xff.xml")])
def test_a_name_that_no_table_can_have_is_refused_before_anything_is_measured(tmp_path, name):
    (tmp_path / name).write_text("two")
    (tmp_path / "link.xml").symlink_to(tmp_path / name)
    for file in (tmp_path / name, tmp_path / "link.xml"):
        done = running.run("robots", str(file), f"--out={tmp_path}/out")
        expect_refusal(done, "the file's name has a control character or is not UTF-8")
    assert not (tmp_path / "out").exists()
