"""A campaign's counts on the page."""

import math
import shlex

import pytest
from scipy.stats import binom, binomtest

import alt_scene
import fake_campaign
from read.campaign import Counts, Errors
from read.data import Data, DataError
from sections import looking, rare
from summary.tails import WRONG, WRONG_BIN, Series, limits, upper_limit
from summary.tails import series as series_of


@pytest.mark.parametrize("k, n", [(0, 10), (1, 10), (5, 10), (10, 10), (3, 10**6), (0, 10**7)])
def test_limits_are_clopper_and_pearsons(k, n):
    exact = binomtest(k, n).proportion_ci(0.95, method="exact")
    assert limits(k, n) == pytest.approx((exact.low, exact.high), rel=1e-6)


def test_limits_of_known_cases():
    assert limits(5, 10) == pytest.approx((0.18708603, 0.81291397), abs=1e-8)
    assert upper_limit(0, 10**6) == pytest.approx(1 - 0.05 ** (1 / 10**6), rel=1e-9)
    assert upper_limit(0, 10**7) * 10**7 == pytest.approx(2.9957, abs=1e-3)  # the rule of three
    assert limits(0, 1)[0] == 0 and limits(1, 1)[1] == 1


@pytest.mark.parametrize("p", [0.003, 0.02, 0.3])
def test_limits_hold_the_probability_as_often_as_they_say(p):
    """Summed over all outcomes, not sampled."""
    n = 200
    held = sum(binom.pmf(k, n, p) for k in range(n + 1) if limits(k, n)[0] <= p <= limits(k, n)[1])
    assert held >= 0.95
    below = sum(binom.pmf(k, n, p) for k in range(n + 1) if p <= upper_limit(k, n))
    assert below >= 0.95


def counted(bins: dict[int, int], warned: dict[int, int] = {}, refused: int = 0) -> Series:
    ok = sum(bins.values()) + sum(warned.values())
    counts = Counts(silent=Errors(), warned=Errors())
    counts.status.update({"ok": ok, "singular": refused})
    counts.silent.bins.update(bins)
    counts.warned.bins.update(warned)
    return Series(counts)


def test_one_percent_lies_in_the_bin_that_counts_as_wrong():
    assert WRONG <= 0.01 < 2 ** ((WRONG_BIN + 1) / 32)
    own = counted({WRONG_BIN - 1: 90, WRONG_BIN: 4, WRONG_BIN + 1: 1}, {WRONG_BIN - 9: 3, 0: 2}, 10)
    assert (own.trials, own.refused, own.silent) == (110, 10, 5)
    assert (own.warned, own.false_warnings) == (5, 3)


def test_a_tail_counts_what_is_at_least_as_wrong():
    own = counted({-70: 5, -64: 2, -33: 3, -32: 4, 7: 1})
    assert own.tail == [(2**-3, 15), (2**-2, 10), (2**-1, 5), (1.0, 1), (2 ** (7 / 32), 1)]
    for error, count in ((2**-2.2, 15), (0.26, 8), (0.5, 5), (1.17, 0), (3.0, 0)):
        expected = sum(
            n for b, n in own.counts.silent.bins.items() if b >= math.floor(32 * math.log2(error))
        )
        assert own.as_wrong(error) == expected


def test_infinite_errors_and_those_that_are_no_number_are_beyond_everything():
    own = counted({-64: 1})
    own.counts.silent.inf, own.counts.silent.nan = 2, 3
    assert own.silent == 6
    assert own.tail[-1] == (0.25, 6)


@pytest.fixture
def campaign(read) -> Data:
    return read("campaign-wild.json", fake_campaign.unit("wild", 1.0, 1, 400))


def test_every_choice_has_a_table_that_counts_every_mechanism(campaign):
    found = rare.section(campaign)
    tables = [table for table in found.tables if table.shown]
    assert len(tables) == 4  # two tasks, two measures
    assert [table.first for table in tables].count(True) == 1
    left = campaign.campaign.no_truth["digits"]
    for table in tables:
        assert {row[2] for row in table.rows} == {str(400 - left)}
        assert len(table.rows) == 4
    first = {choice.signal: choice.first for choice in found.choices}
    assert first == {"rare_task": "white", "rare_measure": "relative"}  # of one family


def test_a_series_without_a_silent_failure_has_a_limit_nevertheless(read):
    data = read("campaign-a.json", only(fake_campaign.unit("wild", 1.0, 1, 400), "-700"))
    (row,) = rare.section(data).tables[0].rows[:1]
    trials = int(row[2])
    assert row[5:7] == ["0", "0"]
    limit = float(row[7].replace("\u202f", ""))
    assert limit == pytest.approx(1e6 * (1 - 0.05 ** (1 / trials)), rel=5e-3)


def test_what_the_certified_form_answered_instead_is_shown(read):
    unit = fake_campaign.unit("wild", 1.0, 1, 400)
    for group in unit["groups"]:
        group["recomputed"] = sum(group["status"].values())
    tables = rare.section(read("campaign-a.json", unit)).tables
    shown = {row[4] for table in tables if table.shown for row in table.rows}
    assert shown == {"100 %"}


def only(unit: dict, place: str) -> dict:
    """All errors moved into one bin."""
    for group in unit["groups"]:
        for errors in group["errors"].values():
            errors["bins"] = {place: sum(errors["bins"].values())} if errors["bins"] else {}
    return unit


def test_failures_by_condition_are_all_of_them(campaign):
    tails, by_condition = rare.section(campaign).figures
    counted: dict[tuple, int] = {}
    for row in by_condition.chart.data.values:
        series = row["rare_task"], row["variant"], row["precision"], row["rare_measure"]
        counted[series] = counted.get(series, 0) + int(row["count"])
        assert row["x"] in (1.0, 1e3, 1e7)  # as fake_campaign.py has them
        assert int(row["trials"]) < 400
    # The made-up mechanisms of which kS is unknown count in the table alone.
    whole = {key[2:6]: own.silent for key, own in series_of(campaign.campaign).items()}
    unknown = sum(
        counts.silent.bins[place]
        for cell, counts in campaign.campaign.groups.items()
        for place in counts.silent.bins
        if cell.kS is None and place >= WRONG_BIN
    )
    assert sum(counted.values()) == sum(whole.values()) - unknown > 0


def test_without_decades_of_the_condition_there_is_no_figure_of_them(campaign):
    campaign.campaign = campaign.campaign.sum_over(["kS"])
    assert len(rare.section(campaign).figures) == 1


def test_the_chart_draws_bands_about_lines(campaign):
    figure = rare.section(campaign).figures[0]
    chart = figure.chart
    assert len(alt_scene.marks(chart, "area")) == 4 and len(alt_scene.marks(chart, "line")) == 4
    for row in chart.data.values:
        assert row["low"] <= row["probability"] <= row["high"]
    for line in alt_scene.marks(chart, "line"):
        heights = [item["y"] for item in line]
        assert heights == sorted(heights)  # the page's y grows downwards: tails fall


def test_the_worst_are_listed_with_the_command_that_repeats_each(campaign):
    table = rare.section(campaign).tables[-1]
    assert len(table.rows) == 8 * rare.LISTED
    worst = campaign.campaign.worst[0]
    (command,) = {row[-1] for row in table.rows if f"/{worst.seed}+1 " in row[-1]} & {
        rare.command(worst)
    }
    assert command == (
        f"build/bin/stress --unit wild/1/{worst.seed}+1 --variant '{worst.variant}' "
        f"--precision {worst.precision} --task {worst.task} --out unit.json"
    )


def test_a_family_s_name_stays_a_name_in_its_command(campaign):
    worst = campaign.campaign.worst[0]._replace(family="wild; id", value=1.0, seed=7)
    assert shlex.split(rare.command(worst))[1:3] == ["--unit", "wild; id/1/7+1"]


def test_parts_of_a_campaign_are_shown_as_one(read):
    read("campaign-a.json", fake_campaign.unit("wild", 1.0, 1, 40))
    both = read("campaign-b.json", fake_campaign.unit("wild", 1.0, 41, 60)).campaign
    assert [unit.name for unit in both.units] == ["wild/1/1+100"]


def test_what_is_no_part_of_the_campaign_beside_it_is_refused(read):
    read("campaign-a.json", fake_campaign.unit("wild", 1.0, 1, 40))
    with pytest.raises(DataError, match="campaign-b.json: no part of the campaign .*overlaps"):
        read("campaign-b.json", fake_campaign.unit("wild", 1.0, 40, 60))
    with pytest.raises(DataError, match="campaign-b.json: no part of the campaign .*program"):
        read("campaign-b.json", fake_campaign.unit("wild", 1.0, 41, 60, "1" * 40))


SEARCHED = """\
variant,precision,task,objective,kernel,rows,seed,method,evaluations,error,kS,nv,file,bodies
Ladder<default>,float32,acceleration,error,spatial,0,1,search,100,1e-7,,,,
Ladder<default>,float32,acceleration,error,spatial,0,1,search,700,1e30,,,,
Ladder<default>,float32,acceleration,error,spatial,0,1,search,1000,1e30,1,1,A,0 hinge 1 1 0
Ladder<default>,float32,inverse,error,spatial,0,1,search,9,1e40,,,,
Ladder<last_bits>,float32,acceleration,error,spatial,0,1,islands,1000,6e-8,,,,
Other,float32,acceleration,error,spatial,0,1,search,1000,1,,,,
"""


def test_what_random_mechanisms_it_takes_to_see_what_a_search_found(read):
    read("adversary-a.csv", SEARCHED)
    data = read("campaign-wild.json", fake_campaign.unit("wild", 1.0, 1, 400))
    (table,) = looking.section(data).tables
    by_default, last_bits = table.rows
    assert by_default[:5] == ["Ladder<default>", "float32", "search", "700", "1.0e30"]
    assert by_default[-1] == "> 130"
    assert last_bits[:5] == ["Ladder<last_bits>", "float32", "islands", "1000", "6.0e-8"]
    assert 1 < float(last_bits[-1]) < 5  # a roundoff, which half the made-up errors are above


def test_the_staircase_of_random_mechanisms_rises_to_the_worst_of_all(read):
    read("adversary-a.csv", SEARCHED)
    data = read("campaign-wild.json", fake_campaign.unit("wild", 1.0, 1, 400))
    (figure,) = looking.section(data).figures
    rows = [row for row in figure.chart.data.values if row["scene"] == "random"]
    for variant in ("Ladder<default>", "Ladder<last_bits>"):
        own = [row for row in rows if row["variant"] == variant]
        numbers, errors = ([row[name] for row in own] for name in ("evaluations", "error"))
        assert numbers == sorted(numbers) and errors == sorted(errors)
        assert numbers[-1] == 400 - data.campaign.no_truth["digits"]


def test_without_a_campaign_there_is_nothing_of_it(read):
    assert rare.section(Data()) is None
    assert looking.section(read("adversary-a.csv", SEARCHED)) is None
