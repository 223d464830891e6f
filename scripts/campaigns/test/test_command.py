"""The command on this machine: it goes on, keeps what is finished, says in a line what is wrong."""

import ast
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest

import fake_campaign as units
import running as campaign
from merge import merged
from plan import sha1
from read.campaign_files import written
from running import ENGINE, begun, expect_refusal, has_ended, needs_engine, result, wait_for, wild


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """The folder of a campaign that nothing disturbed."""
    folder = tmp_path_factory.mktemp("finished")
    out, log = folder / "out", folder / "log"
    done = wild(out, FAKE_LOG=str(log))
    assert (done.returncode, done.stderr) == (0, "")
    assert len(begun(log)) == 8
    return out


@pytest.fixture
def out(finished, tmp_path) -> Path:
    """A copy of it."""
    return shutil.copytree(finished, tmp_path / "out")


@pytest.fixture(scope="module")
def whole(finished) -> bytes:
    """What it ends with."""
    return result(finished)


@needs_engine
def test_a_campaign_is_the_sum_of_its_mechanisms(tmp_path, whole):
    program = sha1(campaign.BIN / "stress")
    once = units.write(tmp_path / "once.json", units.unit("wild", 1.0, 1, 160, program))
    assert whole.decode() == written(merged([once]))


@needs_engine
def test_what_is_finished_is_not_measured_again(out, tmp_path, whole):
    log = tmp_path / "log"
    (out / "units" / "wild_1_41+20.json").unlink()
    (out / "campaign-wild.json").unlink()
    done = wild(out, FAKE_LOG=str(log))
    assert [unit for _, unit in begun(log)] == ["wild/1/41+20"]
    assert (done.returncode, result(out)) == (0, whole)


@needs_engine
def test_a_campaign_that_is_ended_takes_its_workers_along_and_goes_on(tmp_path, whole):
    """In three ways, one after the other."""
    log, out, two_cores = (tmp_path / name for name in ("log", "out", "profile"))
    two_cores.mkdir()
    (two_cores / "config.yaml").write_text("executor: local\ncores: 2\n")
    arguments = [*campaign.wild_arguments(out), f"--profile={two_cores}"]

    def at_work() -> list[int]:
        return [worker for worker, _ in begun(log) if not has_ended(worker)]

    for end in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM):
        done = len(begun(log))
        process = campaign.start(*arguments, FAKE_LOG=str(log), FAKE_SECONDS="2")
        # Two at work have taken the places of the first two, whose end Snakemake has noted then.
        wait_for(lambda: len(begun(log)) >= done + 4 and len(at_work()) == 2)
        process.send_signal(end)
        _, err = process.communicate(timeout=60)
        wait_for(lambda: not at_work())
        if end != signal.SIGKILL:
            assert process.returncode == 130 and "run again to go on" in err
    finished, before = len(campaign.units(out)), len(begun(log))
    assert 3 <= finished < 8
    assert wild(out, FAKE_LOG=str(log)).returncode == 0
    assert len(begun(log)) - before == 8 - finished
    assert result(out) == whole


@needs_engine
def test_a_worker_that_dies_is_named_and_the_next_start_goes_on(tmp_path, whole):
    fault = tmp_path / "fault"
    out = tmp_path / "out"
    for mode, line in (
        ("die", "7 of 8 units are there, start again to go on"),
        ("refuse", "wild_1_61[+]20: stress: error: wild/1/61[+]20: no such family .*; 7 of 8"),
    ):
        fault.write_text(f"61 {mode}")
        expect_refusal(wild(out, FAKE_FAULT=str(fault)), line)
        assert len(campaign.units(out)) == 7
    fault.unlink()
    assert wild(out, FAKE_FAULT=str(fault)).returncode == 0
    assert result(out) == whole


@needs_engine
def test_a_unit_that_is_none_is_set_aside_whole_and_measured_anew(tmp_path, whole):
    out, fault = tmp_path / "out", tmp_path / "fault"
    refused = out / "units" / "wild_1_61+20.refused"
    for mode, why in (
        ("half", "not JSON: .*"),
        ("other", "another program: f{40}, not [0-9a-f]{40}"),
    ):
        fault.write_text(f"61 {mode}")
        expect_refusal(
            wild(out, FAKE_FAULT=str(fault)), f"{re.escape(str(refused))}: set aside: {why};"
        )
        assert refused.stat().st_size > 1000
        refused.unlink()
    fault.unlink()
    assert wild(out, FAKE_FAULT=str(fault)).returncode == 0
    assert result(out) == whole


@needs_engine
def test_a_finished_unit_is_not_taken_unseen(finished, out, whole):
    (out / "campaign-wild.json").unlink()
    name = "units/wild_1_61+20.json"
    for change, why in (
        (lambda unit: unit.pop("key"), "'key' is missing"),
        (lambda unit: unit["unit"].update(first=1001), "worst of seed"),
        (lambda unit: unit["key"]["campaign"].update(tasks=["white"]), "another campaign: "),
    ):
        unit = campaign.document(finished / name)
        change(unit)
        units.write(out / name, unit)
        expect_refusal(wild(out), f"set aside: .*{why}")
        assert not (out / name).exists(), why
    assert wild(out).returncode == 0
    assert result(out) == whole


@needs_engine
def test_a_unit_of_other_seeds_under_this_ones_name_is_set_aside(out):
    folder = out / "units"
    (folder / "wild_1_41+20.json").replace(folder / "wild_1_61+20.json")
    expect_refusal(wild(out), "wild_1_61[+]20.refused: set aside: it is wild/1/41[+]20;")


@needs_engine
@pytest.mark.parametrize(
    "option", ["--mechanisms=200", "--first=2", "--task=white", "--worst=3", "--family=wild/2"]
)
def test_a_folder_of_another_campaign_is_refused(out, whole, option):
    expect_refusal(wild(out, option), "plan.json: of other options than these; give --out")
    assert result(out) == whole


@needs_engine
def test_a_folder_of_another_program_is_refused(out, tmp_path):
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "stress").write_text("#!/bin/sh\n")
    (programs / "stress").chmod(0o755)
    expect_refusal(wild(out, KALMARM_BIN=str(programs)), "plan.json: of another program than")


@needs_engine
@pytest.mark.parametrize(
    "change",
    [
        lambda plan: plan.clear(),
        lambda plan: plan.pop("key"),
        lambda plan: plan.update(version=2),
        lambda plan: plan.update(jobs={"a": ["--unit=a"]}),
        lambda plan: plan.update(jobs={"a": [7]}),
        lambda plan: plan["key"].pop("isa"),
    ],
)
def test_a_plan_that_is_none_is_refused(out, whole, change):
    plan = campaign.document(out / "plan.json")
    change(plan)
    units.write(out / "plan.json", plan)
    expect_refusal(wild(out), f"{out}/plan.json: not a plan: ")
    assert result(out) == whole


@needs_engine
def test_a_second_run_in_a_folder_is_refused(tmp_path):
    log, out = tmp_path / "log", tmp_path / "out"
    process = campaign.start(*campaign.wild_arguments(out), FAKE_LOG=str(log), FAKE_SECONDS="30")
    wait_for(lambda: begun(log))
    expect_refusal(wild(out), "another run is at work there")
    process.terminate()
    process.communicate(timeout=60)


@needs_engine
def test_what_a_link_in_place_of_the_lock_leads_to_stays(out, tmp_path):
    users = tmp_path / "users"
    users.write_text("a user's")
    (out / "lock").unlink()
    (out / "lock").symlink_to(users)
    assert wild(out).returncode == 0
    assert users.read_text() == "a user's"


@needs_engine
def test_units_of_a_time_follow_from_what_a_mechanism_takes(tmp_path):
    """Of a worker that needs 0.2 ms of CPU time, whatever the machine: at most so many units."""
    out = tmp_path / "out"
    done = campaign.run("wild", "--mechanisms=2000", "--minutes=0.002", f"--out={out}")
    assert done.returncode == 0, done.stderr
    plan = campaign.document(out / "plan.json")
    sizes = [int(name.split("+")[1]) for name in plan["jobs"]]
    assert sum(sizes) == 2000 and len(sizes) >= 16 and max(sizes) - min(sizes) < len(sizes)
    assert f"{len(sizes)} units" in done.stdout


@needs_engine
def test_rows_are_kept_on_demand_sorted_and_as_they_were(tmp_path, whole):
    out = tmp_path / "out"
    assert wild(out, "--rows").returncode == 0
    assert result(out) == whole
    assert sorted(file.suffix for file in (out / "rows").iterdir()) == [".parquet"] * 8
    ask = "import duckdb; t = duckdb.read_parquet('{}/rows/*.parquet'); print(t.{}.fetchall())"
    aggregate = ask.format(out, "aggregate('count(*), sum(seed), min(eta), max(kS)')")
    first = ask.format(out, "limit(21).project('task, seed, relative')")
    ask = [ENGINE.parent / "python", "-c", f"{aggregate}; {first}"]
    shown = subprocess.run(ask, capture_output=True, text=True).stdout.splitlines(keepends=True)
    assert shown[0] == f"[(320, {2 * sum(range(1, 161))}, inf, None)]\n"
    rows = [("dynamics", seed) for seed in range(1, 21)] + [("white", 1)]
    assert ast.literal_eval(shown[1]) == [(task, seed, float(f"{seed}e-17")) for task, seed in rows]


@needs_engine
def test_a_folder_without_rows_is_not_one_with_them(out):
    expect_refusal(wild(out, "--rows"), "plan.json: of other options than these")


@pytest.fixture
def full_disk():
    """A folder of a megabyte."""
    folder = Path("/tmp") / f"kalmarm-full-{os.getpid()}"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", folder], check=False, capture_output=True
    )
    if mounted.returncode:
        folder.rmdir()
        pytest.skip("needs the right to mount")
    yield folder
    subprocess.run(["umount", folder], check=True)
    folder.rmdir()


@needs_engine
def test_a_full_disk_is_told_in_a_line_and_nothing_is_lost(tmp_path, whole, full_disk):
    out = full_disk / "out"
    ballast = full_disk / "ballast"
    ballast.write_bytes(bytes(700_000))
    expect_refusal(wild(out), "[Nn]o space left on device.*")
    finished = campaign.units(out)
    for name in finished:
        assert campaign.document(out / "units" / name)["format"] == "kalmarm unit"
    ballast.unlink()
    subprocess.run(["mount", "-o", "remount,size=16m", full_disk], check=True)
    assert wild(out).returncode == 0
    assert result(out) == whole


def test_a_missing_engine_is_told_with_what_installs_it(tmp_path):
    done = wild(tmp_path / "out", "--engine=/nowhere/snakemake")
    expect_refusal(done, "/nowhere/snakemake: no Snakemake there, run scripts/setup --cluster")


@needs_engine
def test_a_bad_profile_is_told_in_a_line_and_a_good_one_goes_on(tmp_path, whole):
    out, profile = tmp_path / "out", tmp_path / "profile"
    profile.mkdir()
    for text, line in (
        (None, "no .*/config.yaml; there are local, slurm"),
        ("executor: [", "Snakemake: "),
        ("executor: mainframe\njobs: 1", "Snakemake: .*mainframe"),
        ("executor: local\ncores: many", "Snakemake: .*number of cores"),
        ("executor: local\ncores: 1\nwishes: 3", "Snakemake: .*wishes"),
        ("executor: local", "Snakemake: .*cores"),
    ):
        if text:
            (profile / "config.yaml").write_text(text)
        expect_refusal(wild(out, f"--profile={profile}"), line)
        assert not campaign.units(out), text
    assert wild(out).returncode == 0
    assert result(out) == whole


@pytest.mark.parametrize(
    "arguments, line",
    [
        (["tame"], "invalid choice: 'tame'"),
        (["wild"], "--mechanisms"),
        (["wild", "--mechanisms=0"], "invalid whole value: '0'"),
        (["wild", "--mechanisms=1.5"], "invalid whole value: '1.5'"),
        (["wild", "--mechanisms=1e30"], "invalid whole value: '1e30'"),
        (["wild", "--mechanisms=9", "--minutes=nan"], "invalid minutes value: 'nan'"),
        (["wild", "--mechanisms=9", "--profile=big"], "profile big: no .*; there are local, slurm"),
        (["wild", "--mechanisms=9", "--family=a b/1"], "family a b/1"),
        (["wild", "--mechanisms=9", "--family=wild"], "family wild: not FAMILY/VALUE"),
        (["wild", "--mechanisms=9", "--family=wild/x"], "family wild/x: not FAMILY/VALUE"),
        (["merge", "--out=/nowhere/o", "/nowhere/a"], "/nowhere/a: No such file or directory"),
    ],
)
def test_bad_options_are_told_in_a_line(tmp_path, arguments, line):
    more = [f"--out={tmp_path}/out"] if arguments[0] == "wild" else []
    expect_refusal(campaign.run(*arguments, *more), re.escape(line).replace(r"\.\*", ".*"))
    assert not (tmp_path / "out" / "plan.json").exists()


def test_a_folder_of_programs_without_the_worker_is_refused(tmp_path):
    expect_refusal(wild(tmp_path, KALMARM_BIN=str(tmp_path)), "stress: no such program")


def test_merges_of_campaigns_are_written_and_summed(tmp_path):
    parts = [
        units.write(tmp_path / f"{first}.json", units.unit("wild", 1.0, first, 50))
        for first in (1, 51)
    ]
    out = tmp_path / "both.json"
    done = campaign.run("merge", f"--out={out}", "--sum-over=kS", *map(str, parts))
    assert (done.returncode, done.stderr) == (0, "")
    assert out.read_text() == written(merged(parts).sum_over(["kS"]))
    other = units.write(tmp_path / "x.json", units.unit("wild", 1.0, 101, 5, "1" * 40))
    before = out.read_bytes()
    expect_refusal(
        campaign.run("merge", f"--out={out}", str(parts[0]), str(other)), "another program"
    )
    assert out.read_bytes() == before
