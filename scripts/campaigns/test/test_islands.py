"""Searches that exchange what they find."""

import csv
import random
from pathlib import Path

import pytest
import running
from islands import ANEW, islands
from running import expect_refusal, needs_engine

ARGUMENTS = ("adversary", "--islands=4", "--generations=3", "--evaluations=10", "--variant=Fast<A>")
ARGUMENTS += ("--precision=float32", "--seed=7")


def run(out: Path, *arguments: str, **environment: str):
    return running.run(*ARGUMENTS, f"--out={out}", *arguments, **environment)


def rows(out: Path) -> list[dict]:
    with (out / "adversary-islands.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def own(seed: int) -> float:
    """What the made-up worker finds by itself."""
    return random.Random(f"{seed}/Fast<A>/float32").uniform(-8, -6)


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
def test_a_generation_starts_from_the_best_of_all_islands_before_it(tmp_path):
    log = tmp_path / "log"
    done = run(tmp_path / "out", FAKE_LOG=str(log))
    assert (done.returncode, done.stderr) == (0, "")
    expected = [max(own(seed) for seed in range(7, 11))]
    for _ in range(2):
        expected.append(expected[-1] + 0.5)  # as the made-up worker improves what it is given
    found = rows(tmp_path / "out")
    assert [float(row["error"]) for row in found] == pytest.approx(
        [10**value for value in expected]
    )
    assert [row["evaluations"] for row in found] == ["40", "80", "120"]
    assert {row["method"] for row in found} == {"islands"}
    calls = [line.split()[1:] for line in log.read_text().splitlines()]
    given = {int(unit.split("+")[0]): int(count) for unit, count in calls if unit.endswith("+10")}
    anew = {seed for seed in range(7, 19) if seed < 11 or (seed - 7) % 4 % ANEW == ANEW - 1}
    assert given == {seed: 0 if seed in anew else 4 for seed in range(7, 19)}


@needs_engine
def test_islands_go_on_and_end_as_if_undisturbed(tmp_path):
    run(tmp_path / "whole")
    whole = (tmp_path / "whole" / "adversary-islands.csv").read_bytes()
    out, fault = tmp_path / "out", tmp_path / "fault"
    fault.write_text("8")
    refused = "Fast-A-float32-generation-0-island-1.refused: set aside: not JSON"
    expect_refusal(run(out, FAKE_FAULT=str(fault)), refused)
    fault.unlink()
    assert run(out).returncode == 0
    assert (out / "adversary-islands.csv").read_bytes() == whole


@needs_engine
@pytest.mark.parametrize("change", ["program", "variant", "seed", "value"])
def test_an_island_of_another_search_is_set_aside(tmp_path, change):
    run(tmp_path)
    file = tmp_path / "units" / "Fast-A-float32-generation-2-island-0.json"
    island = running.document(file)
    place = {
        "program": island["key"],
        "variant": island["key"]["search"],
        "seed": island["unit"],
        "value": island["best"][0],
    }
    place[change][change] = None
    running.write(file, island)
    expect_refusal(run(tmp_path), "generation-2-island-0.refused: set aside: not an island")
    assert run(tmp_path).returncode == 0


def test_a_precision_that_is_none_is_refused(tmp_path):
    expect_refusal(run(tmp_path, "--precision=float16"), "precision 'float16' is none of")
