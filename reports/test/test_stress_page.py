"""The sections of the accuracy laboratory as a reader has them, in headless Chromium."""

import re

import pytest
from playwright.sync_api import expect

import fake_stress
import make_report
from browsing import PHONE, brightness, draw, drawn_section, overflowing, section
from read.readers import load

LABORATORY = "The accuracy laboratory"
CLAIMS = "Twelve claims, decided by this run"


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    fake_stress.write(folder / "data")
    file = folder / "index.html"
    make_report.write(file, make_report.page(load(folder / "data")))
    return file


def test_every_claim_has_its_plot_and_its_verdict(visit, written):
    page = visit(written)
    figures = drawn_section(page, CLAIMS).locator("figure").all()
    assert len(figures) == 11
    for number, figure in enumerate(figures, 1):
        assert figure.get_by_role("heading").inner_text().startswith(f"C{number} ")
        assert figure.locator(".mark-symbol path[aria-label]").count() >= 8
        verdict = figure.locator("strong").inner_text()
        assert verdict == ("Open: not in this run" if number == 8 else "Confirmed")
    assert section(page, CLAIMS).locator("td .confirmed").count() == 10


def test_a_choice_of_task_and_of_variants_changes_the_table(visit, written):
    page = visit(written)
    place = section(page, LABORATORY)
    tables = place.locator("[data-shown]:visible")
    expect(tables).to_have_count(1)
    assert place.get_by_text("WorldOrigin").locator("visible=true").count() == 0
    place.get_by_label("Variants").select_option("Filters in other frames")
    expect(tables).to_have_count(1)
    assert "WorldOrigin" in tables.locator("thead").inner_text()
    place.get_by_label("Task").select_option("consistent")
    expect(tables).to_have_count(0)  # of these filters not measured
    place.get_by_label("Variants").select_option("Contenders")
    expect(tables).to_have_count(1)
    assert tables.locator("tbody tr").count() == 2


def test_a_choice_of_family_changes_the_plot(visit, written):
    page = visit(written)
    figure = section(page, CLAIMS).get_by_role("figure", name=re.compile("C3"))
    draw(figure)
    figure.locator("select").first.select_option("heavy_point")
    mark = figure.locator(".mark-symbol path[aria-label*='family: heavy_point']")
    expect(mark.first).to_be_attached()
    assert figure.locator(".mark-symbol path[aria-label*='family: heavy_tip']").count() == 0


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_cells_are_readable_on_either_page(visit, written, scheme):
    page = visit(written, color_scheme=scheme)
    section(page, LABORATORY)
    usual = (":first-child:not([class])", ":last-child:not([class])")  # in float64, in float32
    for look in (".d0", ".d2", ".d4", ".d5", *usual):
        cell = f".shown:not([hidden]) p{look}"
        back, front = (brightness(page, cell, name) for name in ("backgroundColor", "color"))
        assert abs(back - front) > 0.35, look
        assert (back > front) == (scheme == "light"), look


def test_a_phone_needs_no_sideways_scrolling(visit, written):
    page = visit(written, viewport=PHONE, has_touch=True, is_mobile=True)
    page.evaluate(
        "document.querySelectorAll('details').forEach((details) => (details.open = true))"
    )
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    assert overflowing(page) == []
    table = page.locator(".shown:not([hidden]) .scroll").first
    assert table.evaluate("(node) => node.scrollWidth > node.clientWidth")


def test_without_javascript_every_table_is_there(browser, written):
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(written.as_uri())
    for fold in page.locator(".fold").all():
        if fold.get_attribute("open") is None:
            fold.locator("summary").first.click()
    assert page.locator(".shown").count() == page.locator(".shown:visible").count() > 5
    context.close()


def test_the_page_holds_no_raw_rows(written):
    assert len(written.read_bytes()) < 2_000_000
