"""Merges of made-up units."""

import copy
import json
import math
import random
from pathlib import Path

import pytest

import fake_campaign as units
import fake_claims
from merge import merged, read, written
from read.campaign import Campaign, Range, joined
from read.data import DataError

SPLITS = ((1, 40), (41, 25), (66, 60), (126, 5), (131, 70))


@pytest.fixture
def save(tmp_path):
    """Writes a document to a file of its own."""
    names = iter(range(10_000))
    return lambda document: units.write(tmp_path / f"{next(names)}.json", document)


@pytest.fixture(scope="module")
def parts() -> list[dict]:
    own = [units.unit("wild", 1.0, first, count) for first, count in SPLITS]
    return own + [units.unit("heavy_tip", 1e10, 1, 50), units.unit("wild", 2.5, 7, 30)]


@pytest.fixture(scope="module")
def replicates() -> list[dict]:
    return [fake_claims.record(first, count) for first, count in SPLITS]


def nested(files: list[Path], dice: random.Random, save) -> Path:
    """Merged in groups of random sizes and order, and these again, until one file is left."""
    while len(files) > 1:
        dice.shuffle(files)
        some = dice.randint(2, len(files))
        together = save(json.loads(written(merged(files[:some]))))
        files = [together, *files[some:]]
    return files[0]


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("kind", ["parts", "replicates"])
def test_order_and_nesting_of_merges_leave_no_trace(save, request, kind, seed):
    files = [save(part) for part in request.getfixturevalue(kind)]
    at_once = written(merged(files))
    assert written(read(nested(files, random.Random(seed), save))) == at_once


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize(
    "unit", [lambda *of: units.unit("wild", 1.0, *of), fake_claims.record], ids=["wild", "claims"]
)
def test_how_mechanisms_and_replicates_are_divided_leaves_no_trace(save, unit, seed):
    dice = random.Random(seed)
    ends = sorted(dice.sample(range(2, 200), 6))
    bounds = [1, *ends, 200]
    files = [save(unit(first, end - first)) for first, end in zip(bounds, bounds[1:])]
    dice.shuffle(files)
    whole = save(unit(1, 199))
    assert written(merged(files)) == written(merged([whole]))


def test_every_mechanism_and_answer_counts_once(save, parts):
    campaign = merged(map(save, parts))
    assert campaign.mechanisms == sum(part["mechanisms"] for part in parts) == 280
    left = sum(part["no_truth"].get("digits", 0) for part in parts)
    assert campaign.no_truth == {"digits": left}
    outcomes = sum(counts.status.total() for counts in campaign.groups.values())
    assert outcomes == (280 - left) * 2 * 2 * 2 * 2  # tasks, variants, precisions, measures


def test_the_worst_are_those_of_all_units(save, parts):
    """Against all answers, sorted at once."""
    everything = []
    for part in parts:
        unit = part["unit"]
        for seed in range(unit["first"], unit["first"] + unit["count"]):
            everything += units.unit(unit["family"], unit["value"], seed, 1)["worst"]
    for series in (
        ("dynamics", "Ladder<last_bits>", "float32"),
        ("white", "Ladder<default>", "float64"),
    ):
        errors = [float.fromhex(it["error"]) for it in everything if series == of(it)]
        found = [case.error for case in merged(map(save, parts)).worst if case.series == series]
        assert found == sorted(errors, reverse=True)[: units.WORST]


def of(case: dict) -> tuple:
    return case["task"], case["variant"], case["precision"]


def test_of_equal_errors_the_first_mechanisms_are_kept(save):
    parts = [units.unit("wild", 1.0, first, 20) for first in (1, 21)]
    for part in parts:
        for case in part["worst"]:
            case["error"] = "0x1p-3"
        part["worst"].sort(key=lambda case: tuple(map(case.get, units.ORDER)))
    kept = [case.seed for case in merged(map(save, reversed(parts))).worst]
    assert max(kept) <= 20


def test_sums_over_an_axis_commute_with_merges(save, parts):
    first, second = merged(map(save, parts[:3])), merged(map(save, parts[3:]))
    for axes in (["kS"], ["mass_ratio"], ["mass_ratio", "kS"]):
        sums = [save(json.loads(written(part.sum_over(axes)))) for part in (first, second)]
        assert written(merged(sums)) == written(merged(map(save, parts)).sum_over(axes))


def test_sums_over_an_axis_are_not_mixed_with_others(save, parts):
    summed = save(json.loads(written(merged([save(parts[0])]).sum_over(["kS"]))))
    with pytest.raises(DataError, match=r"summed over \[\], not \['kS'\]"):
        merged([summed, save(parts[1])])


def test_ranges_are_joined_where_they_meet_and_only_there():
    a, b, c = Range("wild", 1.0, 1, 10), Range("wild", 1.0, 11, 5), Range("wild", 1.0, 17, 1)
    other = Range("wild", 2.0, 16, 1)
    assert joined([a, c], [b, other]) == [Range("wild", 1.0, 1, 15), c, other]
    assert joined([a, c], [Range("wild", 1.0, 11, 6)]) == [Range("wild", 1.0, 1, 17)]


@pytest.mark.parametrize("first, count", [(1, 40), (40, 5), (0, 2), (10, 1), (0, 100)])
def test_mechanisms_that_would_count_twice_are_refused(save, parts, first, count):
    again = save(units.unit("wild", 1.0, first, count))
    with pytest.raises(DataError, match=rf"wild/1/{first}\+{count} overlaps wild/1/1\+40"):
        merged([save(parts[0]), again])


def test_another_program_is_refused_and_named(save, parts):
    other = save(units.unit("wild", 1.0, 41, 25, program="1" * 40))
    with pytest.raises(DataError, match=f"another program: {'1' * 40}, not {'0' * 40}"):
        merged([save(parts[0]), other])


@pytest.mark.parametrize("name", ["compiler", "flags", "isa", "blas"])
def test_another_build_is_refused(save, parts, name):
    other = copy.deepcopy(parts[1])
    other["key"][name] = "another"
    with pytest.raises(DataError, match=f"another {name}: another, not "):
        merged([save(parts[0]), save(other)])


@pytest.mark.parametrize("name", ["variants", "precisions", "tasks", "worst"])
def test_other_options_are_refused(save, parts, name):
    other = copy.deepcopy(parts[1])
    value = other["key"]["campaign"][name]
    other["key"]["campaign"][name] = 1000 if name == "worst" else value[:1]
    with pytest.raises(DataError, match="another campaign: "):
        merged([save(parts[0]), save(other)])


def changed(document: dict, path: str, value) -> dict:
    """With another value at a place, or none where it is None."""
    other = copy.deepcopy(document)
    *way, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    inside = other
    for step in way:
        inside = inside[step]
    if value is None:
        del inside[last]
    else:
        inside[last] = value
    return other


@pytest.mark.parametrize(
    "path, value, message",
    [
        ("key", None, "'key' is missing"),
        ("key", "0" * 40, "key is '0"),
        ("key.program", None, "program' is missing"),
        ("key.program", "", "program is ''"),
        ("key.flags", 7, "flags is 7"),
        ("key.campaign.variants", "all", "variants is 'all'"),
        ("format", "kalmarm rows", "format is 'kalmarm rows'"),
        ("version", 1, "version is 1"),
        ("unit.count", 0, "count is 0"),
        ("unit.first", -1, "first is -1"),
        ("unit.family", "wild/1", "family is 'wild/1'"),
        ("unit.value", math.nan, "value is nan"),
        ("mechanisms", 41, "mechanisms is 40 by its units"),
        ("timings", [], "'timings' is not known"),
        ("groups.0.status.ok", 10**6, "errors of 1000000 answers"),
        ("groups.0.status", {}, "errors of 0 answers"),
        ("groups", {}, "groups is {}"),
        ("groups.0.status.perhaps", 1, "is 'perhaps'"),
        ("groups.0.precision", "float16", "precision is 'float16'"),
        ("groups.0.kS", 0.5, "kS is 0.5"),
        ("groups.0.kS", None, r"summed over \['kS'\]"),
        ("groups.0.errors.silent.zero", True, "zero is True"),
        ("groups.0.errors.silent.bins", {"-1.5": 1}, "is '-1.5'"),
        ("groups.0.errors.silent.bins", {"-0": 1}, "is '-0'"),
        ("groups.0.errors.silent.bins", {"40000": 1}, "is '40000'"),
        ("worst.0.error", "nan", "error is 'nan'"),
        ("worst.0.error", "much", "hexadecimal"),
        ("worst.0.seed", 41, "worst of seed 41, which no unit has"),
        ("worst.0.error", "0x0p+0", "worst is not in order"),
    ],
)
def test_what_is_no_unit_is_refused_with_the_value(save, parts, path, value, message):
    file = save(changed(parts[0], path, value))
    with pytest.raises(
        DataError, match=f"^{file}: not a unit or a campaign: .*{message}"
    ) as raised:
        merged([file])
    assert "\n" not in str(raised.value)


def test_a_group_that_stands_twice_is_refused(save, parts):
    other = copy.deepcopy(parts[0])
    other["groups"].append(other["groups"][0])
    with pytest.raises(DataError, match="a group stands twice: wild/1.0/"):
        merged([save(other)])


def test_more_outcomes_than_mechanisms_are_refused(save, parts):
    other = copy.deepcopy(parts[0])
    (group,) = other["groups"][:1]
    group["status"] = {"singular": 41}
    group["errors"] = units.empty("")["errors"]
    with pytest.raises(DataError, match=r"outcomes of 40 wild/1.0/"):
        merged([save(other)])


def test_a_file_that_was_cut_off_is_refused(tmp_path, parts):
    whole = json.dumps(parts[0])
    file = tmp_path / "half.json"
    for length in (0, 1, len(whole) // 2, len(whole) - 1):
        file.write_text(whole[:length])
        with pytest.raises(DataError, match=f"^{file}: not JSON: "):
            merged([file])


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(DataError, match="none.json: No such file"):
        merged([tmp_path / "none.json"])
    with pytest.raises(DataError, match="no file to merge"):
        merged([])


def test_what_is_refused_adds_nothing(save, parts):
    """A caller may set a file aside and go on."""
    campaign = Campaign(read(save(parts[0])).key)
    campaign.add(read(save(parts[0])))
    before = written(campaign)
    for other in (
        units.unit("wild", 1.0, 20, 40),
        units.unit("wild", 1.0, 41, 9, program="1" * 40),
    ):
        with pytest.raises(ValueError):
            campaign.add(read(save(other)))
    assert written(campaign) == before


def test_merged_replicates_are_as_if_counted_at_once(save, replicates):
    """Counts and sorted numbers, worked out apart from what merges."""
    assert json.loads(written(merged(map(save, replicates)))) == fake_claims.record(1, 200)


@pytest.mark.parametrize("first, count", [(1, 40), (40, 5), (10, 1), (1, 100)])
def test_replicates_that_would_count_twice_are_refused(save, replicates, first, count):
    again = save(fake_claims.record(first, count))
    with pytest.raises(DataError, match=f"replicate {first} is there already"):
        merged([save(replicates[0]), again])


@pytest.mark.parametrize("name", list(fake_claims.KEY))
def test_replicates_of_another_key_are_refused_and_the_difference_named(save, replicates, name):
    other = copy.deepcopy(replicates[1])
    other["key"][name] = [] if name == "variants" else "3" * 40
    with pytest.raises(DataError, match=f"not to be merged with .*: another {name}: "):
        merged([save(replicates[0]), save(other)])


def test_replicates_of_other_checks_are_refused(save, replicates):
    other = changed(replicates[1], "claims.1.checks.0.low", 0.9)
    for check in other["claims"][1]["checks"][:1]:
        values = [fake_claims.value("correlation", r) for r in range(41, 66)]
        check |= fake_claims.check(dict(enumerate(values, 41)), "correlation", 0.9, None)
    with pytest.raises(DataError, match="other checks of C2"):
        merged([save(replicates[0]), save(other)])
    fewer = changed(replicates[1], "claims.1", None)
    with pytest.raises(DataError, match="1 claims, not 2"):
        merged([save(replicates[0]), save(fewer)])


def test_campaigns_of_two_kinds_are_not_merged(save, parts, replicates):
    with pytest.raises(DataError, match="a campaign of another kind"):
        merged([save(parts[0]), save(replicates[0])])


@pytest.mark.parametrize(
    "path, value, message",
    [
        ("key.sources", None, "sources' is missing"),
        ("key.stress", "0", "stress is '0'"),
        ("key.variants", "all", "variants is 'all'"),
        ("version", 2, "version is 2"),
        ("replicates", [], "it has no replicate"),
        ("replicates", ["1+40", "40+2"], "replicate 40 stands twice"),
        ("replicates.0", "0+40", "replicates '0.40' are not FIRST.COUNT"),
        ("replicates.0", "1+10001", "are not FIRST.COUNT"),
        ("replicates.0", "1+41", "40 verdicts of 41"),
        ("timings", [], "'timings' is not known"),
        ("claims.0.confirmed", -1, "confirmed is -1"),
        ("claims.1.id", "C1", "C1 stands twice"),
        ("claims.0.checks.0.holds", 40, "exponent: holds is 40"),
        ("claims.0.checks.0.low", "none", "low is 'none'"),
        ("claims.0.checks.0.measured.0", [0.1, 41], "a replicate that is not there, or twice"),
        ("claims.0.checks.0.measured.0", [0.1, 2], "a replicate that is not there, or twice"),
        ("claims.0.checks.0.measured.0", ["much", 1], "is 'much'"),
        ("claims.0.checks.0.measured.0", [0.1], "is missing"),
    ],
)
def test_what_is_no_campaign_of_claims_is_refused_with_the_value(
    save, replicates, path, value, message
):
    file = save(changed(replicates[0], path, value))
    with pytest.raises(DataError, match=f"^{file}: not a campaign of claims: .*{message}"):
        merged([file])
