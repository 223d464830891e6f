"""A campaign of the claims on the page."""

import math
import re
from statistics import median

import pytest
from scipy.stats import binom

import fake_claims
import fake_stress
import make_report
from claims import REPEATED
from read.data import Data, DataError
from read.readers import load
from read.replicates import Numbers
from sections import claims
from summary.replicates import median_limits, middle, spread


@pytest.mark.parametrize(
    "n, j, coverage",
    [(6, 1, 0.96875), (9, 2, 0.9609375), (10, 2, 0.978515625), (20, 6, 0.9586105)],
)
def test_limits_of_a_median_are_those_of_the_tables(n, j, coverage):
    """Of the sign test: order statistics j and n + 1 - j."""
    assert median_limits(list(range(1, n + 1))) == (j, n + 1 - j)
    assert 1 - 2 * binom.cdf(j - 1, n, 0.5) == pytest.approx(coverage, abs=1e-6)


def test_five_replicates_are_too_few_for_limits_of_a_median():
    assert [median_limits([1.0] * n) is None for n in range(1, 8)] == [True] * 5 + [False] * 2


@pytest.mark.parametrize("n", [6, 13, 50, 201])
def test_limits_of_a_median_hold_as_often_as_they_say_and_no_closer_ones_would(n):
    """Summed over how many of n numbers lie below the median, not sampled."""
    j = median_limits(list(range(1, n + 1)))[0]
    held = {i: sum(binom.pmf(k, n, 0.5) for k in range(i, n - i + 1)) for i in (j, j + 1)}
    assert held[j] >= 0.95 > held[j + 1]


def test_the_middle_leaves_out_as_many_of_both_ends_as_it_may():
    for n, out in ((1, 0), (39, 0), (40, 1), (100, 2), (1000, 25)):
        assert middle(list(range(n))) == (out, n - 1 - out)


def test_failures_are_beyond_all_numbers():
    values = dict(enumerate([0.5, math.inf, 0.1, math.inf, math.inf, 0.3, math.inf]))
    found = spread(Numbers("", -math.inf, 1, values))
    assert (found.median, found.limits, found.middle) == (math.inf, *[(0.1, math.inf)] * 2)
    assert spread(Numbers("", -math.inf, 1, {})) is None


def seven_of_ten(what: str, replicate: int) -> float:
    """C1 holds in all but three, C2 in four: its ratio is replicate / 2, to be at most 2."""
    if what == "exponent":
        return 0.3 if replicate % 3 == 0 else 0.01 * replicate
    return {"median η": 1.0, "correlation": 0.99, "ratio": replicate / 2}[what]


@pytest.fixture
def repeated(read) -> Data:
    return read("claims-campaign.json", fake_claims.record(1, 10, seven_of_ten))


def tables(data: Data) -> tuple[list, list]:
    verdicts, numbers = claims.section(data).tables[-2:]
    return verdicts.rows, numbers.rows


def test_shares_of_replicates_have_exact_limits(repeated):
    first, second, instead = tables(repeated)[0]
    # Clopper and Pearson's of 7, 3, 4 and 6 of 10, as tables have them.
    assert first == ["C1", "7", "70", "34.8 to 93.3", "3", "30", "6.67 to 65.2", "0"]
    assert second == ["C2", "4", "40", "12.2 to 73.8", "6", "60", "26.2 to 87.8", "0"]
    assert instead == [
        "Measured instead: ratio: median 2.75 [1, 4.5] (claimed 0.01 to 2), in 10 replicates."
    ]


def test_every_number_has_its_median_limits_and_range(repeated):
    exponent, eta, _, ratio = tables(repeated)[1]
    assert exponent == [
        *("C1", "exponent", "10", "7"),
        *("0.075", "0.02 to 0.3", "0.01 to 0.3", "at most 0.2"),
    ]
    assert eta[4:7] == ["1", "1 to 1", "1 to 1"]
    assert ratio[4:] == ["2.75", "1 to 4.5", "0.5 to 5", "0.01 to 2"]


def test_half_of_the_replicates_is_not_most_of_them(read):
    data = read("claims-campaign.json", fake_claims.record(1, 8, seven_of_ten))
    assert tables(data)[1][3][2:4] == ["8", "4"]
    assert not any(len(row) == 1 for row in tables(data)[0])


def test_what_some_replicates_lack_is_open_there(read):
    def number(what: str, replicate: int) -> float | None:
        return None if (what, replicate) == ("ratio", 2) else 1.0

    verdicts, numbers = tables(read("claims-campaign.json", fake_claims.record(1, 7, number)))
    assert [row[-1] for row in verdicts if len(row) > 1] == ["0", "1"]
    assert numbers[3][2:6] == ["6", "6", "1", "1 to 1"]


def test_infinity_is_written_as_such_and_few_replicates_have_no_limits(read):
    data = read("claims-campaign.json", fake_claims.record(1, 3, lambda *_: math.inf))
    for row in tables(data)[1]:
        assert row[4:7] == ["∞", "–", "∞ to ∞"]
    assert "exponent: median ∞ (claimed at most 0.2); median η" in tables(data)[0][1][0]


def test_parts_of_a_campaign_of_claims_are_shown_as_one(read):
    read("claims-a.json", fake_claims.record(1, 4, seven_of_ten))
    both = read("claims-b.json", fake_claims.record(5, 6, seven_of_ten))
    assert tables(both)[0][0][1] == "7"
    with pytest.raises(DataError, match="claims-c.json: no part of the campaign .*replicate 10 is"):
        read("claims-c.json", fake_claims.record(10, 1))


def test_a_plot_says_beneath_its_verdict_what_replicates_say(tmp_path):
    fake_stress.write(tmp_path)
    before = make_report.page(load(tmp_path))
    fake = fake_claims.record(1, 10, seven_of_ten)
    fake_claims.write(tmp_path / "claims-campaign.json", fake)
    data = load(tmp_path)
    figures = {figure.title[:3].strip(): figure for figure in claims.section(data).figures}
    held = "Confirmed in {} of 10 replicates: {} %, limits {} %."
    assert figures["C1"].notes[2:] == [held.format(7, 70, "34.8 to 93.3")]
    assert figures["C2"].notes[2:] == [
        held.format(4, 40, "12.2 to 73.8"),
        "Measured instead: ratio: median 2.75 [1, 4.5] (claimed 0.01 to 2), in 10 replicates.",
    ]
    assert figures["C3"].notes[2:] == []
    after = make_report.page(data)
    assert "replicates" in after and len(after) > len(before)
    (tmp_path / "claims-campaign.json").unlink()
    assert make_report.page(load(tmp_path)) == before


def test_without_a_campaign_nothing_tells_of_replicates(tmp_path):
    fake_stress.write(tmp_path)
    section = claims.section(load(tmp_path))
    said = [*section.paragraphs, *(note for figure in section.figures for note in figure.notes)]
    assert len(section.tables) == 2 and not any(re.search("replicate", text) for text in said)
    assert claims.section(Data()) is None


def test_the_numbers_of_checks_and_their_verdicts_agree(tmp_path):
    """Of made-up data, which has every number but a time: the record says what the page says."""
    fake_stress.write(tmp_path)
    data = load(tmp_path)
    for decide in REPEATED:
        for check in decide(data).checks:
            assert check.timed == (check.number.value is None)
            if not check.timed:
                assert check.holds == (check.number.low <= check.number.value <= check.number.high)


def test_the_median_is_that_of_the_numbers():
    values = {r: float(r * r) for r in range(1, 12)}
    assert spread(Numbers("", 0, 1, values)).median == median(values.values()) == 36
