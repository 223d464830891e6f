"""How a reader moves about the page: folds, contents, addresses, files, and how long it takes."""

import csv
import io
import re

from browsing import PHONE, TIME, drawn_section, figure, marks, section, unfold_all
from playwright.sync_api import expect

ENGINES, ANSWER, SIZE = "Which engine, precision and batch", "What to take", "Against N"
WATCH = """
window.tasks = [];
new PerformanceObserver((list) => tasks.push(...list.getEntries()))
  .observe({ type: "longtask", buffered: true });
"""


def height(page):
    return page.evaluate("document.documentElement.scrollHeight")


def folds(page):
    """The titles of what is unfolded."""
    return page.locator(".fold[open] > summary h2").all_inner_texts()


def saved(page, title, name, kind):
    panel = figure(page, title, name)
    with page.expect_download() as download:
        panel.get_by_role("button", name=kind).click()
    return download.value


def test_a_folded_page_is_short(visit, written):
    assert height(visit(written)) <= 6000
    assert height(visit(written, viewport=PHONE, has_touch=True, is_mobile=True)) <= 9000


def test_only_the_first_sections_are_unfolded_and_only_what_is_in_view_is_drawn(page):
    assert folds(page)[:2] == [ENGINES, ANSWER] and len(folds(page)) <= 3
    assert page.locator("figure[data-drawn]").count() < page.locator("figure").count() / 4
    expect(page.locator("figure[data-drawn]").first).to_be_visible()


def test_contents_name_every_section_and_unfold_it(page):
    links = page.get_by_role("navigation", name="Contents").get_by_role("link")
    assert links.all_inner_texts() == page.locator("section h2").all_inner_texts()
    links.filter(has_text=SIZE).click()
    expect(page.locator("#against-n .fold")).to_have_attribute("open", "")
    expect(links.filter(has_text=SIZE)).to_have_attribute("aria-current", "true")
    expect(links.filter(has_text=SIZE)).to_be_in_viewport()
    expect(page.get_by_role("heading", name=SIZE, exact=True)).to_be_in_viewport()


def test_contents_of_a_phone_are_a_menu(visit, written):
    page = visit(written, viewport=PHONE, has_touch=True, is_mobile=True)
    menu = page.get_by_role("navigation", name="Contents")
    expect(menu.get_by_role("link").first).to_be_hidden()
    page.mouse.wheel(0, 900)
    menu.get_by_role("button", name="Contents").tap()
    menu.get_by_role("link", name="Limitations").tap()
    expect(menu.get_by_role("link").first).to_be_hidden()
    expect(page.get_by_role("heading", name="Limitations")).to_be_in_viewport()


def test_sections_fold_from_the_keyboard(page):
    summary = page.locator("#against-n summary").first
    summary.focus()
    page.keyboard.press("Enter")
    expect(page.locator("#against-n .fold")).to_have_attribute("open", "")
    page.keyboard.press("Space")
    expect(page.locator("#against-n .fold")).not_to_have_attribute("open", "")


def test_an_address_brings_back_section_robot_and_choices(visit, written, page):
    answer = section(page, ANSWER)
    answer.get_by_role("combobox", name="Robot").select_option("g1:35")
    answer.get_by_role("combobox", name="Task").select_option("inverse")
    answer.get_by_role("combobox", name="Error asked for").select_option("1e-9")
    reason = answer.get_by_text("is the cheapest within 1e-09").locator("visible=true")
    expect(reason).to_have_count(1)
    address = re.search("#.*", page.url)[0]
    assert address.startswith("#what-to-take?")
    other = visit(written, address)
    answer = section(other, ANSWER)
    expect(answer.get_by_role("combobox", name="Robot")).to_have_value("g1:35")
    expect(answer.get_by_role("combobox", name="Task")).to_have_value("inverse")
    expect(answer.get_by_role("combobox", name="Error asked for")).to_have_value("1e-9")
    assert marks(figure(other, ANSWER, "Worst"), "robot: g1:35").count() == 8
    expect(answer.locator(".answer:visible p").first).to_contain_text("g1:35")


def test_an_address_brings_back_the_legend_and_all_series(visit, written, page):
    place = drawn_section(page, SIZE)
    place.get_by_role("button", name="All ").click()
    place.get_by_role("button", name="float32", exact=True).click()
    other = visit(written, re.search("#.*", page.url)[0])
    there = drawn_section(other, SIZE)
    expect(there.get_by_role("button", name="float32", exact=True)).to_have_attribute(
        "aria-pressed", "false"
    )
    assert marks(there, "float32").count() == 0
    expect(marks(there)).to_have_count(marks(place).count())


def test_a_link_to_a_figure_in_a_folded_section_unfolds_it(visit, written):
    page = visit(written, "#error-against-run-time--g1-35-degrees-of-freedom")
    assert TIME in folds(page)
    panel = page.get_by_role("figure", name=f"{TIME}: g1")
    expect(panel.get_by_role("heading")).to_be_in_viewport()
    expect(panel).to_have_attribute("data-drawn", "yes")


def test_an_address_of_nothing_is_no_matter(visit, written):
    assert folds(visit(written, "#nowhere?scene=panda"))[0] == ENGINES


def test_a_robot_of_the_table_shows_its_answer(page):
    table = section(page, ANSWER).locator("table").first
    table.get_by_role("link", name="panda").click()
    expect(section(page, ANSWER).get_by_role("combobox", name="Robot")).to_have_value("panda:7")
    expect(section(page, ANSWER).locator(".answer:visible p").first).to_contain_text("panda:7")


def test_paper_has_everything(page):
    page.wait_for_selector("body[data-ready]", state="attached")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator(".fold:not([open])").count() == 0
    assert page.locator("figure:not([data-drawn])").count() == 0


def test_few_series_are_shown_until_all_are_asked_for(page):
    for title in (TIME, SIZE):
        for panel in drawn_section(page, title).locator("figure").all():
            names = {
                re.search("variant: ([^;]+); precision: ([^;]+)", label).groups()
                for label in marks(panel, "variant").evaluate_all(
                    "(nodes) => nodes.map((node) => node.ariaLabel)"
                )
            }
            assert len(names) <= 8
        place = section(page, title)
        groups = place.locator(".legend .group:visible small").all_inner_texts()
        assert groups[:3] == ["Ladder", "Cholesky", "Filters"]


def test_names_stand_beside_marks_and_at_the_ends_of_lines(page):
    panel = figure(page, TIME, "panda")
    expect(panel.locator(".chart text", has_text="Ladder<default> f64")).to_be_visible()
    line = figure(page, SIZE, "chain: time")
    expect(line.locator(".chart text", has_text="Sequential<ArrayMGS> f64")).to_be_visible()
    assert line.locator(".chart text", has_text="Sequential<ArrayMGS>").count() <= 2


def test_a_figure_is_saved_as_it_looks(page):
    page.emulate_media(color_scheme="dark")
    file = saved(page, TIME, "panda", "SVG")
    assert file.suggested_filename.endswith("panda-7-degrees-of-freedom.svg")
    svg = file.path().read_text()
    assert svg.startswith("<svg") and "var(" not in svg and "currentColor" not in svg
    assert "rgb(21, 24, 29)" in svg and "median time of a call" in svg
    png = saved(page, TIME, "panda", "PNG").path().read_bytes()
    assert png.startswith(b"\x89PNG") and len(png) > 10_000


def test_the_saved_numbers_are_those_of_the_marks(page):
    panel = figure(page, TIME, "panda")
    text = saved(page, TIME, "panda", "CSV").path().read_text()
    rows = list(csv.DictReader(io.StringIO(text)))
    assert len(rows) == marks(panel).count() == 8
    assert {row["scene"] for row in rows} == {"panda:7"}
    assert all(float(row["time"]) > 0 and float(row["error"]) > 0 for row in rows)
    panel.get_by_text("Numbers", exact=True).click()
    shown = panel.locator(".numbers tbody tr").first.locator("td").all_inner_texts()
    assert list(rows[0].values())[: len(shown)] == shown


def test_how_long_a_reader_waits(visit, written, capsys):
    """Printed, not asserted: the machine is not ours alone."""
    page = visit(written, script=WATCH)
    first = page.evaluate("performance.getEntriesByName('first screen')[0].startTime")
    page.evaluate("document.querySelector('[data-fold=open]').click()")
    page.evaluate("tasks.length = 0")
    for _ in range(height(page) // 900):
        page.mouse.wheel(0, 900)
        page.wait_for_timeout(30)
    unfold_all(page)
    longest = page.evaluate("Math.max(0, ...tasks.map((task) => task.duration))")
    with capsys.disabled():
        print(f"\nfirst screen {first:.0f} ms; longest task while scrolling {longest:.0f} ms")
    assert page.locator("figure:not([data-drawn])").count() == 0
