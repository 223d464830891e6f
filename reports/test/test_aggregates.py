"""Aggregates over robots, against cases whose answer is known."""

import math

import pytest

from read.readers import load
from sections import over_robots
from summary.aggregates import geometric_mean, profile, share_answered, slowdowns

A, B, C = ("A", "float64"), ("B", "float64"), ("C", "float32")
# Two robots where A and B take turns at twice the other's time; a third that only B answers, and a
# fourth that nobody does.
TIMES = {
    "one": {A: 10.0, B: 20.0, C: None},
    "two": {A: 40.0, B: 20.0, C: 160.0},
    "three": {A: None, B: 7.0, C: None},
    "four": {A: None, B: None, C: None},
}


def test_times_slower_are_over_the_best_of_the_same_robot():
    assert slowdowns(TIMES) == {A: [1, 2, math.inf], B: [2, 1, 1], C: [math.inf, 8, math.inf]}


def test_a_robot_that_was_not_tried_is_not_answered():
    assert slowdowns({"one": {A: 3.0}, "two": {A: 3.0, B: 6.0}}) == {A: [1, 1], B: [math.inf, 2]}


def test_the_share_answered_counts_robots_that_nobody_answers():
    assert [share_answered(TIMES, solver) for solver in (A, B, C)] == [0.5, 0.75, 0.25]


def test_the_geometric_mean_is_of_what_is_answered():
    ratios = slowdowns(TIMES)
    assert geometric_mean(ratios[A]) == pytest.approx(math.sqrt(2))
    assert geometric_mean(ratios[B]) == pytest.approx(2 ** (1 / 3))
    assert geometric_mean([math.inf]) is None


def test_the_profile_of_dolan_and_more():
    ratios = slowdowns(TIMES)
    third = pytest.approx(1 / 3)
    assert profile(ratios[A]) == [(1, third), (2, pytest.approx(2 / 3))]
    assert profile(ratios[B]) == [(1, pytest.approx(2 / 3)), (2, 1)]
    assert profile(ratios[C]) == [(8, third)]
    assert profile([math.inf]) == []


def test_a_profile_never_falls_and_ends_at_the_share_of_finite_ratios():
    ratios = [1.0, 3.0, 1.5, math.inf, 1.5, 9.0]
    corners = profile(ratios)
    assert corners == sorted(corners)
    assert [share for _, share in corners] == sorted(share for _, share in corners)
    assert corners[-1] == (9, pytest.approx(5 / 6))


def test_scaling_all_times_of_a_robot_changes_nothing():
    scaled = {
        robot: {solver: time and time * 2.0**i for solver, time in found.items()}
        for i, (robot, found) in enumerate(TIMES.items())
    }
    assert slowdowns(scaled) == slowdowns(TIMES)


def test_the_section_counts_as_answered_what_is_right_everywhere(run):
    section = over_robots.section(load(run))
    tables = {tuple(table.shown.values()): table for table in section.tables}
    loose, strict = (tables["acceleration", it].rows for it in ("1e-5", "1e-9"))
    assert {row[1] for row in loose} == {"float32", "float64"}
    assert {row[1] for row in strict} == {"float64"}
    (fast,) = [row for row in strict if row[0] == "Ladder<default>"]
    assert fast == strict[0] and fast[2:4] == ["100 %", "88 %"]  # two_link has a faster one
    failing = [row for row in loose if row[:2] == ["ClosedForm<Conventional>", "float32"]]
    assert failing[0][2] == "88 %"  # of eight robots with times it fails on states of g1
    means = [float(row[4]) for row in loose]
    assert means == sorted(means)


def test_two_robots_are_not_worth_a_mean(run):
    files = [
        run / f"{kind}-{name}" for name in ("panda-7", "go2-18") for kind in ("errors", "times")
    ]
    found = [path.with_suffix(".csv" if "errors" in path.name else ".json") for path in files]
    assert over_robots.section(load(None, found)) is None
