"""Claims decided again and again, with workers that only pretend to measure."""

import re
import subprocess
import sys
from pathlib import Path

import claims_programs as fake
import decide
import pytest
import running
from running import begun, expect_refusal, needs_engine

import fake_claims
from claims import REPEATED
from measuring.effort import FULL, QUICK

PROGRAMS = Path(fake.__file__)


@pytest.fixture(scope="session")
def programs(tmp_path_factory) -> Path:
    """A folder of them."""
    return make_programs(tmp_path_factory.mktemp("bin"))


def make_programs(folder: Path, comment: str = "") -> Path:
    for name in ("stress", "integrate"):
        file = folder / name
        file.write_text(
            f'#!/bin/sh\n# {comment}\nexport FAKE_STRESS="$0"\n'
            f'exec {sys.executable} {PROGRAMS} {name} "$@"\n'
        )
        file.chmod(0o755)
    return folder


@pytest.fixture
def run(programs):
    def run(out: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
        options = ["claims", "--replicates=10", "--count=2", f"--out={out}", *arguments]
        return running.run(*options, **{"KALMARM_BIN": str(programs)} | environment)

    return run


def result(out: Path) -> bytes:
    return (out / "claims-campaign.json").read_bytes()


@pytest.fixture(scope="module")
def whole(programs, tmp_path_factory) -> Path:
    """The folder of a campaign that nothing disturbs."""
    out = tmp_path_factory.mktemp("whole")
    options = ["claims", "--replicates=10", "--count=2", f"--out={out}"]
    done = running.run(*options, KALMARM_BIN=str(programs))
    assert (done.returncode, done.stderr) == (0, "")
    assert "5 units" in done.stdout and "10 replicates" in done.stdout
    return out


def test_efforts_are_those_of_reports():
    assert set(decide.SEEDS) == {QUICK.name, FULL.name}


def test_seeds_of_two_replicates_are_apart_and_the_first_are_those_of_a_report():
    for effort, count in decide.SEEDS.items():
        blocks = [decide.seeds(replicate, effort) for replicate in range(1, 50)]
        assert blocks[0].start == 1 and {len(block) for block in blocks} == {count}
        assert all(a.stop == b.start for a, b in zip(blocks, blocks[1:]))


@needs_engine
def test_a_claim_holds_in_as_many_replicates_as_it_does(whole):
    """By the worker, C1 in those that three does not divide: 7 of 10."""
    document = running.document(whole / "claims-campaign.json")
    claims = {claim["id"]: claim for claim in document["claims"]}
    assert document["replicates"] == ["1+10"] and len(claims) == len(REPEATED)
    verdicts = {
        name: tuple(claim[it] for it in ("confirmed", "refuted", "open"))
        for name, claim in claims.items()
    }
    assert verdicts == dict.fromkeys(claims, (10, 0, 0)) | {"C1": (7, 3, 0)}
    eta = claims["C1"]["checks"][1]
    assert (eta["holds"], eta["fails"], eta["absent"]) == (7, 3, 0)
    assert eta["measured"] == sorted([fake.eta(r), r] for r in range(1, 11))
    times = [check["what"] for check in claims["C8"]["checks"] if "time" in check["what"]]
    assert not times


@needs_engine
def test_replicates_measured_apart_add_up_to_the_same(whole, run, tmp_path):
    for first, count in ((8, 3), (1, 7)):
        done = run(tmp_path / str(first), f"--first={first}", f"--replicates={count}", "--count=5")
        assert (done.returncode, done.stderr) == (0, "")
    both = tmp_path / "both.json"
    parts = [str(tmp_path / first / "claims-campaign.json") for first in "81"]
    done = running.run("merge", f"--out={both}", *parts)
    assert (done.returncode, done.stderr) == (0, "")
    assert both.read_bytes() == result(whole)


@needs_engine
def test_what_is_finished_is_not_measured_again(whole, run, tmp_path):
    out, log, fault = tmp_path / "out", tmp_path / "log", tmp_path / "fault"
    fault.write_text("6 die")
    done = run(out, FAKE_LOG=str(log), FAKE_FAULT=str(fault))
    said = "replicates-5[+]2: claims: error: replicate 6: .*; 4 of 5 units are there"
    expect_refusal(done, said)
    assert sorted(replicate for _, replicate in begun(log)) == sorted(map(str, range(1, 11)))
    assert sorted(file.suffix for file in (out / "units").iterdir()) == [".json"] * 4
    fault.unlink()
    assert run(out, FAKE_LOG=str(log)).returncode == 0
    assert [replicate for _, replicate in begun(log)[10:]] == ["5", "6"]
    assert result(out) == result(whole)


@needs_engine
def test_a_campaign_that_is_killed_goes_on(whole, programs, run, tmp_path):
    out, log = tmp_path / "out", tmp_path / "log"
    process = running.start(
        *["claims", "--replicates=10", "--count=2", f"--out={out}"],
        **{"KALMARM_BIN": str(programs), "FAKE_LOG": str(log), "FAKE_SECONDS": "1"},
    )
    running.wait_for(lambda: running.units(out) and len(begun(log)) > 4)  # a third unit
    process.kill()
    process.communicate(timeout=60)
    running.wait_for(lambda: all(running.has_ended(worker) for worker, _ in begun(log)))
    finished, before = len(running.units(out)), len(begun(log))
    assert 1 <= finished < 5
    assert run(out, FAKE_LOG=str(log)).returncode == 0
    # What Snakemake had no time to take note of is measured again too.
    assert 10 - 2 * finished <= len(begun(log)) - before < 10
    assert result(out) == result(whole)
    assert {file.suffix for file in (out / "units").iterdir()} == {".json"}


@needs_engine
@pytest.mark.parametrize(
    "mode, line",
    [
        ("refuse", "replicate 6: stress: error: no memory"),
        ("early", "replicate 6: seed 750 is none of 751 to 900"),
        ("late", "replicate 6: seed 1750 is none of 751 to 900"),
    ],
)
def test_a_worker_that_refuses_or_takes_other_seeds_is_told(run, tmp_path, mode, line):
    fault = tmp_path / "fault"
    fault.write_text(f"6 {mode}")
    done = run(tmp_path / "out", "--first=5", "--replicates=2", FAKE_FAULT=str(fault))
    expect_refusal(done, f"replicates-5[+]2: claims: error: {line}")


@needs_engine
def test_a_finished_unit_is_not_taken_unseen(whole, run, tmp_path):
    out = tmp_path / "out"
    subprocess.run(["cp", "-r", whole, out], check=True)
    (out / "claims-campaign.json").unlink()
    name = "units/replicates-5+2.json"
    for change, why in (
        (lambda unit: unit["key"].update(sources="f" * 40), "another sources: f{40}, not "),
        (lambda unit: unit["key"].update(isa="SSE2"), "another isa: SSE2, not none"),
        (lambda unit: unit.update(replicates=["7+2"]), "a replicate that is not there"),
        (lambda unit: unit.update(fake_claims.record(5, 2)), "another flags: none, not "),
        (lambda unit: unit["claims"].pop(), "10 claims, not 11"),
    ):
        unit = running.document(whole / name)
        change(unit)
        running.write(out / name, unit)
        expect_refusal(run(out), f"replicates-5[+]2.refused: set aside: .*({why})")
        assert not (out / name).exists(), why
    assert run(out).returncode == 0
    assert result(out) == result(whole)


@needs_engine
def test_the_plan_says_which_units_are_of_another_key(whole, run, tmp_path):
    """Not the unit that is taken first."""
    out = tmp_path / "out"
    subprocess.run(["cp", "-r", whole, out], check=True)
    file = out / "units" / "replicates-1+2.json"
    unit = running.document(file)
    unit["key"]["blas"] = "another"
    running.write(file, unit)
    expect_refusal(run(out), "replicates-1[+]2.refused: set aside: another blas: another, not none")


@needs_engine
def test_a_unit_of_other_replicates_under_this_ones_name_is_set_aside(whole, run, tmp_path):
    out = tmp_path / "out"
    subprocess.run(["cp", "-r", whole, out], check=True)
    units = out / "units"
    (units / "replicates-3+2.json").replace(units / "replicates-5+2.json")
    expect_refusal(run(out), r"replicates-5[+]2.refused: set aside: it is 3[+]2;")


@needs_engine
@pytest.mark.parametrize("option", ["--replicates=12", "--first=2", "--full"])
def test_a_folder_of_another_campaign_is_refused(whole, run, option):
    before = result(whole)
    expect_refusal(run(whole, option), "plan.json: of other options than these")
    assert result(whole) == before


@needs_engine
def test_a_folder_of_other_programs_is_refused(whole, run, tmp_path):
    """Of the one that is not the worker as well."""
    make_programs(tmp_path)
    (tmp_path / "integrate").write_text("#!/bin/sh\n")
    done = run(whole, KALMARM_BIN=str(tmp_path))
    expect_refusal(done, "plan.json: of another program than")


@pytest.mark.parametrize(
    "arguments, line",
    [
        ([], "--replicates"),
        (["--replicates=0"], "invalid whole value: '0'"),
        (["--replicates=10001"], "10001 replicates: at most 10000"),
        (["--replicates=2", "--first=1.5"], "invalid whole value: '1.5'"),
        (["--replicates=2", "--full", "--first=99999"], "replicate 100000: its seeds are above"),
        (["--replicates=2", "--profile=big"], "profile big: no .*; there are local, slurm"),
        (["--replicates=2", "--count=0"], "invalid whole value: '0'"),
    ],
)
def test_bad_options_are_told_in_a_line(programs, tmp_path, arguments, line):
    done = running.run("claims", *arguments, f"--out={tmp_path}", KALMARM_BIN=str(programs))
    expect_refusal(done, re.escape(line).replace(r"\.\*", ".*"))
    assert not (tmp_path / "plan.json").exists()


def test_a_folder_of_programs_without_one_of_them_is_refused(programs, tmp_path):
    (tmp_path / "stress").symlink_to(programs / "stress")
    done = running.run(
        "claims", "--replicates=2", f"--out={tmp_path}/out", KALMARM_BIN=str(tmp_path)
    )
    expect_refusal(done, f"{tmp_path}/integrate: no such program")


def test_claims_have_no_groups_to_sum_over(tmp_path):
    file = fake_claims.write(tmp_path / "claims-a.json", fake_claims.record(1, 3))
    done = running.run("merge", f"--out={tmp_path}/o", "--sum-over=kS", str(file))
    expect_refusal(done, "--sum-over: claims have no groups")
    assert not (tmp_path / "o").exists()
