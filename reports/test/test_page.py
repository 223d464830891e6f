"""The page as a reader has it: opened in headless Chromium, on a phone, by night."""

import pytest
from playwright.sync_api import expect

import make_report
from browsing import (
    PHONE,
    TIME,
    brightness,
    figure,
    marks,
    overflowing,
    section,
    show_every,
    unfold_all,
)
from read.data import scene_name
from read.readers import load
from summary.points import points


def test_every_figure_is_drawn(page, run):
    data = load(run)
    timed = {
        scene_name(point.scene) for point in points(data) if point.time is not None and point.states
    }
    unfold_all(page)
    figures = page.locator("figure").all()
    # Engines, what to take, three stresses, all robots, two of the simulation, two of the peak, questions, two of rare errors,
    # three of scans.
    others = 16
    assert len(figures) == len(timed) + 3 * len(data.families) + others
    for drawn in figures:
        frame, *boxes = drawn.locator(".chart svg").evaluate(
            """(svg) => {
                const marks = ":is(.mark-symbol, .mark-rect) path[aria-label]";
                return [svg, ...svg.querySelectorAll(marks)].map((node) => {
                    const { x, y, width, height } = node.getBoundingClientRect();
                    return { x: x + width / 2, y: y + height / 2, width, height };
                });
            }"""
        )
        assert frame["width"] > 250 and len(boxes) >= 8
        for box in boxes:
            assert min(box["width"], box["height"]) > 2
            assert abs(box["x"] - frame["x"]) < frame["width"] / 2
            assert abs(box["y"] - frame["y"]) < frame["height"] / 2


def test_each_series_has_its_mark_once_all_are_asked_for(page, run):
    wanted = {
        (point.variant, point.precision)
        for point in points(load(run))
        if (point.scene, point.task, point.measure) == ("panda:7", "acceleration", "relative")
    }
    panel = figure(page, TIME, "panda")
    assert marks(panel).count() == 8
    show_every(page, TIME)
    expect(marks(panel)).to_have_count(len(wanted))
    for variant, precision in wanted:
        assert marks(panel, f"variant: {variant}; precision: {precision};").count() == 1


def test_bars_stand_out_on_either_page(page):
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        background = brightness(page, "body", "backgroundColor")
        bars = [brightness(page, f".bar.{kind}", "backgroundColor") for kind in ("ours", "peer")]
        assert min(abs(bar - background) for bar in bars) > 0.2
        assert abs(bars[0] - bars[1]) > 0.2


def test_an_explanation_stays_in_sight_of_a_phone(visit, written):
    page = visit(written, viewport=PHONE, has_touch=True, is_mobile=True)
    table = section(page, "The paper, checked").locator(".scroll").first
    table.evaluate("(node) => (node.scrollLeft = node.scrollWidth)")
    assert table.evaluate("(node) => node.scrollLeft") > 50
    for remark in table.locator(".remark span").all():
        box = remark.bounding_box()
        assert box["x"] >= 0 and box["x"] + box["width"] <= PHONE["width"]


def test_a_phone_needs_no_sideways_scrolling(visit, written):
    page = visit(written, viewport=PHONE, has_touch=True, is_mobile=True)
    unfold_all(page)
    page.wait_for_function(
        "[...document.querySelectorAll('.numbers .scroll')].every((list) => list.firstChild)"
    )
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert overflowing(page) == []
    for chart in page.locator(".chart svg").all():
        assert 300 < chart.bounding_box()["width"] <= 390


def test_charts_follow_the_window(page):
    chart = figure(page, TIME, "panda").locator(".chart svg")
    page.set_viewport_size({"width": 1300, "height": 900})
    wide = chart.bounding_box()["width"]
    page.set_viewport_size(PHONE)
    page.wait_for_timeout(300)
    assert chart.bounding_box()["width"] < 390
    assert overflowing(page) == []
    assert wide > 300


def test_dark_mode_turns_page_and_charts_at_once(page):
    texts = ["h2", ".chart .role-axis-label text", ".chart .role-axis-title text"]
    mark = '.chart path[aria-label*="Pinocchio"]'
    page.emulate_media(color_scheme="light")
    assert brightness(page, "body", "backgroundColor") > 0.9
    assert all(
        brightness(page, text, "fill" if "chart" in text else "color") < 0.3 for text in texts
    )
    light = brightness(page, mark, "fill")
    page.emulate_media(color_scheme="dark")
    assert brightness(page, "body", "backgroundColor") < 0.15
    assert all(
        brightness(page, text, "fill" if "chart" in text else "color") > 0.7 for text in texts
    )
    assert brightness(page, mark, "fill") > light


def test_masses_of_every_variant_stand_in_a_table(page):
    table = page.locator("table", has_text="The mass matrix by every variant")
    assert "1.5e-16" in table.text_content()


def test_figures_tables_and_lists_have_names(page):
    assert page.locator("figure:not([aria-label])").count() == 0
    assert page.locator("main table:not(:has(caption))").count() == 0
    assert page.locator("section:not([aria-labelledby])").count() == 0
    assert page.locator("h1").count() == 1


@pytest.mark.parametrize(
    "kind, figures",
    [
        ("errors", 6),
        ("times", 3),
        ("mujoco", 0),
        ("paper", 0),
        ("simulation", 2),
        ("estimation", 0),
        ("dynamics", 1),
        ("batch", 1),
        ("peers", 3),
        ("pruning", 1),
        ("scan", 0),
        ("s[cp]ans", 1),
        ("s[cp]an*", 3),
    ],
)
def test_a_part_of_the_data_makes_a_part_of_the_page(visit, run, tmp_path, kind, figures):
    file = tmp_path / "index.html"
    make_report.write(file, make_report.page(load(None, sorted(run.glob(f"{kind}-*")))))
    page = visit(file)
    unfold_all(page)
    assert page.locator("figure").count() == figures
    for chart in page.locator("figure .chart").all():
        assert chart.locator(":is(.mark-symbol, .mark-rect) path[aria-label]").count() > 0
