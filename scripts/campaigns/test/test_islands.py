"""Searches that exchange what they find."""

import csv
import random
import shutil
from pathlib import Path

import pytest
import running
from islands import ANEW, islands
from running import expect_refusal, needs_engine

ARGUMENTS = ("adversary", "--islands=4", "--generations=3", "--evaluations=10", "--variant=Ladder<A>")
ARGUMENTS += ("--precision=float32", "--seed=7")


def run(out: Path, *arguments: str, **environment: str):
    return running.run(*ARGUMENTS, f"--out={out}", *arguments, **environment)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """The folder of a search that nothing disturbed, with what its islands were given beside it."""
    folder = tmp_path_factory.mktemp("finished")
    done = run(folder / "out", FAKE_LOG=str(folder / "log"))
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def result(out: Path) -> bytes:
    return (out / "adversary-islands.csv").read_bytes()


def rows(out: Path) -> list[dict]:
    with (out / "adversary-islands.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def own(seed: int) -> float:
    """What the made-up worker finds by itself."""
    return random.Random(f"{seed}/Ladder<A>/float32").uniform(-8, -6)


def test_no_two_islands_of_a_search_have_one_seed():
    asked = {
        "variants": ["A", "B"],
        "precisions": ["float32"],
        "generations": 4,
        "islands": 5,
        "seed": 3,
    }
    for variant in asked["variants"]:
        seeds = [island.seed for island in islands(asked) if island.variant == variant]
        assert sorted(seeds) == list(range(3, 23))


@needs_engine
def test_a_generation_starts_from_the_best_of_all_islands_before_it(finished):
    expected = [max(own(seed) for seed in range(7, 11))]
    for _ in range(2):
        expected.append(expected[-1] + 0.5)  # as the made-up worker improves what it is given
    found = rows(finished / "out")
    assert [float(row["error"]) for row in found] == pytest.approx(
        [10**value for value in expected]
    )
    assert [row["evaluations"] for row in found] == ["40", "80", "120"]
    assert {row["method"] for row in found} == {"islands"}
    calls = [line.split()[1:] for line in (finished / "log").read_text().splitlines()]
    given = {int(unit.split("+")[0]): int(count) for unit, count in calls if unit.endswith("+10")}
    anew = {seed for seed in range(7, 19) if seed < 11 or (seed - 7) % 4 % ANEW == ANEW - 1}
    assert given == {seed: 0 if seed in anew else 4 for seed in range(7, 19)}


@needs_engine
def test_islands_go_on_and_end_as_if_undisturbed(finished, tmp_path):
    out, fault = tmp_path / "out", tmp_path / "fault"
    fault.write_text("8")
    refused = "Ladder-A-float32-generation-0-island-1.refused: set aside: not JSON"
    expect_refusal(run(out, FAKE_FAULT=str(fault)), refused)
    fault.unlink()
    assert run(out).returncode == 0
    assert result(out) == result(finished / "out")


@needs_engine
def test_an_island_of_another_search_is_set_aside_and_searched_anew(finished, tmp_path):
    out = shutil.copytree(finished / "out", tmp_path / "out")
    (out / "adversary-islands.csv").unlink()
    file = out / "units" / "Ladder-A-float32-generation-2-island-0.json"
    whole = file.read_bytes()
    for change in ("program", "variant", "seed", "value"):
        file.write_bytes(whole)
        island = running.document(file)
        place = {
            "program": island["key"],
            "variant": island["key"]["search"],
            "seed": island["unit"],
            "value": island["best"][0],
        }
        place[change][change] = None
        running.write(file, island)
        expect_refusal(run(out), "generation-2-island-0.refused: set aside: not an island")
        assert not file.exists(), change
    assert run(out).returncode == 0
    assert result(out) == result(finished / "out")


def test_a_precision_that_is_none_is_refused(tmp_path):
    expect_refusal(run(tmp_path, "--precision=float16"), "precision 'float16' is none of")
