"""What a reader can switch, choose and point at on the page."""

import re

import pytest
from playwright.sync_api import expect

from browsing import (
    EIGEN,
    PHONE,
    TIME,
    drawn_section,
    figure,
    legend,
    marks,
    section,
    show,
    show_every,
)
from charts.text import error_text, time_text
from read.readers import load
from summary.points import points

SIZE = "Against N"
SIMULATION = "The mass matrix as a sample covariance"
PEERS = "Against peers"
PEAK = "How near the machine’s peak"


def test_a_legend_entry_switches_off_and_on_in_its_section(page):
    for title, entry, text in (
        (TIME, EIGEN, f"variant: {EIGEN};"),
        (SIZE, "float32", "precision: float32;"),
    ):
        place = drawn_section(page, title)
        before, all_before = marks(place, text).count(), marks(place).count()
        assert before > 0
        legend(page, title, entry).click()
        expect(legend(page, title, entry)).to_have_attribute("aria-pressed", "false")
        expect(marks(place, text)).to_have_count(0)
        assert marks(place).count() == all_before - before
        legend(page, title, entry).click()
        expect(marks(place, text)).to_have_count(before)
        assert marks(place).count() == all_before


def test_the_front_is_of_what_is_shown(page):
    panel = figure(page, TIME, "panda")
    line = panel.locator(".mark-line path").first
    before = line.get_attribute("d")
    legend(page, TIME, "float64").click()
    expect(marks(panel, "float64")).to_have_count(0)
    assert line.get_attribute("d") != before
    legend(page, TIME, "float64").click()
    expect(line).to_have_attribute("d", before)


def test_the_legend_works_from_the_keyboard(page):
    entry = legend(page, TIME, EIGEN)
    entry.focus()
    page.keyboard.press("Space")
    expect(marks(section(page, TIME), f"variant: {EIGEN};")).to_have_count(0)


def test_the_legend_names_only_what_can_be_shown(page):
    section(page, TIME)
    expect(legend(page, TIME, "CRBA")).to_be_hidden()
    show(page, TIME, "mass/relative")
    expect(legend(page, TIME, "CRBA")).to_be_visible()
    expect(legend(page, TIME, EIGEN)).to_be_hidden()


def test_a_point_shows_its_numbers(page, run):
    (point,) = [
        point
        for point in points(load(run))
        if (point.scene, point.variant, point.precision) == ("panda:7", EIGEN, "float64")
        and (point.task, point.measure) == ("acceleration", "relative")
    ]
    marks(figure(page, TIME, "panda"), f"variant: {EIGEN}; precision: float64").hover()
    tooltip = page.locator("#numbers-of-a-mark.visible")
    expect(tooltip).to_be_visible()
    shown = dict(row.inner_text().split("\t") for row in tooltip.locator("tr").all())
    expected = {
        "scene": "panda:7",
        "variant": EIGEN,
        "precision": "float64",
        "median time": time_text(point.time),
        "median error": error_text(point.median),
        "largest error": error_text(point.worst),
        "states": "20",
        "failed": "0",
    }
    assert {name: shown.get(name) for name in expected} == expected
    assert re.fullmatch(r"(< )?\d+ %", shown["variation of time"])


def test_a_tap_near_a_point_shows_its_numbers_until_the_next_elsewhere(visit, written):
    page = visit(written, viewport=PHONE, has_touch=True, is_mobile=True)
    mark = marks(figure(page, TIME, "panda"), "Sequential<ArrayMGS>; precision: float64")
    mark.scroll_into_view_if_needed()
    box = mark.bounding_box()
    page.touchscreen.tap(box["x"] + box["width"] + 6, box["y"] + box["height"] + 6)
    tooltip = page.locator("#numbers-of-a-mark.visible")
    expect(tooltip).to_contain_text("Sequential<ArrayMGS>")
    place = tooltip.bounding_box()
    assert place["x"] >= 0 and place["x"] + place["width"] <= PHONE["width"]
    figure(page, TIME, "panda").get_by_role("heading").tap()
    expect(tooltip).to_have_count(0)


def test_a_choice_changes_what_is_drawn(page):
    panel = figure(page, TIME, "panda")
    mark = marks(panel, EIGEN).first
    before = mark.get_attribute("aria-label")
    show(page, TIME, "inverse/scaled")
    expect(mark).not_to_have_attribute("aria-label", before)


def test_a_family_shows_the_chosen_size(page):
    panel = figure(page, TIME, "chain")
    show_every(page, TIME)
    panel.locator("select").select_option("chain:127")
    expect(marks(panel, "scene: chain:127")).not_to_have_count(0)
    assert marks(panel).count() == marks(panel, "scene: chain:127").count()
    assert marks(panel, "indefinite").count() > 0  # the failure marks of EigenLLT in float32


def test_the_list_of_numbers_follows_the_chart(page):
    panel = figure(page, TIME, "panda")
    panel.get_by_text("Numbers", exact=True).click()
    rows = panel.locator(".numbers tbody tr")
    expect(rows).to_have_count(marks(panel).count())
    before = marks(panel).count()
    legend(page, TIME, EIGEN).click()
    expect(rows).to_have_count(before - 1)
    expect(marks(panel)).to_have_count(before - 1)
    expect(rows.filter(has_text=EIGEN)).to_have_count(0)


def test_nothing_shown_is_said(page):
    panel = figure(page, TIME, "panda")
    said = panel.get_by_text("Nothing is shown")
    expect(said).to_be_hidden()
    for precision in ("float32", "float64"):
        legend(page, TIME, precision).click()
    expect(said).to_be_visible()


def test_every_method_has_its_line_its_shape_and_its_place_in_the_legend(page):
    samples = figure(page, SIMULATION, "panda:7: error against samples")
    time = figure(page, SIMULATION, "panda:7: error against run time")
    for method in ("MonteCarlo", "Antithetic", "QuasiMonteCarlo"):
        assert marks(samples, f"method: {method};").count() == 9
        assert marks(time, f"method: {method};").count() == 9
    assert marks(samples, "method: SigmaPoints;").count() == 1
    assert samples.locator(".mark-rule line[aria-label*='method: Recursion;']").count() == 1
    assert marks(time, "method: Recursion; samples: 0;").count() == 1
    glyphs = [glyph.inner_html() for glyph in section(page, SIMULATION).locator(".glyph").all()]
    assert len(set(glyphs)) == len(glyphs) == 5


def test_a_method_switched_off_leaves_both_charts(page):
    place = drawn_section(page, SIMULATION)
    legend(page, SIMULATION, "Recursion").click()
    expect(place.locator("[aria-label*='method: Recursion;']")).to_have_count(0)
    expect(place.locator(".chart text").filter(has_text="Recursion")).to_have_count(0)
    legend(page, SIMULATION, "MonteCarlo").click()
    expect(marks(place, "method: MonteCarlo;")).to_have_count(0)
    assert marks(place, "method: Antithetic;").count() == 18


def test_another_quantity_has_other_errors(page):
    panel = figure(page, SIMULATION, "panda:7: error against samples")
    mark = marks(panel, "method: MonteCarlo;").first
    before = mark.get_attribute("aria-label")
    count = marks(panel).count()
    show(page, SIMULATION, "Lambda")
    expect(mark).not_to_have_attribute("aria-label", before)
    assert marks(panel).count() == count


def test_a_task_shows_its_own_bars(page):
    place = section(page, PEERS)
    captions = place.locator("table:visible caption")
    expect(captions).to_have_count(6)  # five scenes and the overview
    assert all("Acceleration a =" in text for text in captions.all_inner_texts())
    place.get_by_label("Task").select_option("derivatives")
    expect(captions).to_have_count(6)
    assert all("Derivatives of a" in text for text in captions.all_inner_texts())


def test_bars_are_as_long_as_their_times(page):
    table = section(page, PEERS).locator("table.bars:visible").first
    rows = [row for row in table.locator("tbody tr").all() if row.locator(".bar").count()]
    units = {"ns": 1, "µs": 1e3}
    times, widths = [], []
    for row in rows:
        number, unit = row.locator("td").first.inner_text().split()
        times.append(float(number) * units[unit])
        widths.append(row.locator(".bar").bounding_box()["width"])
    assert times == sorted(times) and len(times) == 10
    for time, width in zip(times, widths):
        assert width == pytest.approx(widths[-1] * time / times[-1], abs=2)
    ours, peer = table.locator(".bar.ours"), table.locator(".bar.peer")
    assert (ours.count(), peer.count()) == (5, 5)


def test_times_against_n_have_peers_beside_ours(page):
    show(page, SIZE, "derivatives/time")
    panel = figure(page, SIZE, "chain: time")
    for variant in ("Ladder<default>", "Pinocchio<LOCAL>@clang"):
        expect(marks(panel, f"variant: {variant}; precision: float64;")).to_have_count(3)
    show(page, SIZE, "acceleration/energy")  # a measure that peers do not have
    expect(marks(panel, "variant: Batch<EigenLLT>;")).not_to_have_count(0)
    expect(marks(panel, "variant: Pinocchio<LOCAL>@clang;")).to_have_count(3)


def test_the_share_of_the_peak_is_of_the_chosen_task(page):
    panel = figure(page, PEAK, "share of the peak")
    assert marks(panel).count() == 20  # three of ours on five scenes, one in float32 too
    show_task = panel.get_by_label("Task")
    show_task.select_option("acceleration_batch")
    expect(marks(panel)).to_have_count(30)
    assert marks(panel, "precision: float32;").count() == 15


def test_the_roofline_is_of_the_chosen_scene(page):
    panel = figure(page, PEAK, "roofline")
    calls = marks(panel, "operations a byte")
    expect(calls).to_have_count(10)  # five tasks in both precisions
    assert marks(panel, "scene: panda:7;").count() == 10
    panel.locator("select").select_option("chain:500")
    expect(marks(panel, "scene: panda:7;")).to_have_count(0)
    assert marks(panel, "scene: chain:500;").count() == 10
    assert marks(panel, "bound by: memory").count() > 0

