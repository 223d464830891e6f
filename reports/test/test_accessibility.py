"""What axe-core finds of readers who hear a page, have a keyboard alone, or need contrast; and what the committed
page costs them all."""

import fake_stress
import make_report
import pytest
from axe_playwright_python.sync_playwright import Axe

from browsing import unfold_all
from conftest import REPORTS
from read.readers import load

EXAMPLE = REPORTS / "example" / "index.html"
# Rows of a list of numbers look alike, and most of the time goes into the contrast of their cells.
ASKED = {"exclude": [[".numbers tr:nth-child(n + 3)"]]}
# By night colours are others, and nothing else.
RULES = {"light": {}, "dark": {"runOnly": {"type": "rule", "values": ["color-contrast"]}}}


@pytest.fixture(scope="module")
def written(run, tmp_path_factory):
    """The made-up run with the laboratory and the claims that it decides."""
    folder = tmp_path_factory.mktemp("accessibility")
    fake_stress.write(folder / "data")
    files = sorted(file for data in (run, folder / "data") for file in data.iterdir())
    make_report.write(folder / "index.html", make_report.page(load(None, files)))
    return folder / "index.html"


def sections(page):
    """One at a time, unfolded, alone: axe reads a whole document, whatever part it is asked about."""
    for section in page.locator("section").element_handles():
        section.evaluate(
            """(section) => {
                document.querySelectorAll("section").forEach((each) => each.remove());
                document.querySelector("main").prepend(section);
            }"""
        )
        unfold_all(page)
        yield section.get_attribute("id")


@pytest.mark.parametrize("scheme", RULES)
def test_axe_finds_no_violation_in_any_section(visit, written, scheme):
    page, axe = visit(written, color_scheme=scheme), Axe()
    for _ in sections(page):
        found = axe.run(page, ASKED, RULES[scheme])
        assert found.violations_count == 0, found.generate_report()


def test_the_committed_page_has_at_most_three_megabytes_and_no_script_error(visit):
    assert EXAMPLE.stat().st_size <= 3 * 2**20
    assert sum(1 for _ in sections(visit(EXAMPLE))) > 20
