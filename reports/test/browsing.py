"""What a reader sees of a page."""

import re

from playwright.sync_api import expect

PHONE = {"width": 390, "height": 844}

TIME = "Error against run time"  # of sections and variants of the made-up run
EIGEN = "Batch<EigenLLT>"


def section(page, title):
    """Unfolded."""
    place = page.locator("section").filter(
        has=page.get_by_role("heading", level=2, name=title, exact=True)
    )
    if not place.locator(".fold").evaluate("(node) => node.open"):
        place.locator("summary").first.click()
    return place


def drawn_section(page, title):
    """With all its figures, as a reader has it who scrolled through it."""
    place = section(page, title)
    for drawn in place.locator("figure").all():
        draw(drawn)
    return place


def draw(figure):
    figure.scroll_into_view_if_needed()
    expect(figure).to_have_attribute("data-drawn", "yes")


def figure(page, title, name):
    section(page, title)
    found = page.get_by_role("figure", name=f"{title}: {name}")
    draw(found)
    return found


def marks(place, text=""):
    """The marks of points and failures whose numbers contain the text."""
    numbers = f'*="{text}"' if text else ""
    return place.locator(f".mark-symbol path[aria-label{numbers}]")


def unfold_all(page):
    """Everything, with all figures drawn."""
    page.evaluate("document.querySelectorAll('details').forEach((it) => (it.open = true))")
    for drawn in page.locator("figure").all():
        draw(drawn)


def overflowing(page):
    """What sticks out of the window, other than inside a box that scrolls."""
    return page.evaluate(
        """() => [...document.body.querySelectorAll("*")]
            .filter((node) => !node.closest(".scroll, .said, svg"))
            .filter((node) => node.getBoundingClientRect().right > innerWidth + 0.5)
            .map((node) => node.outerHTML.slice(0, 80))"""
    )


def brightness(page, selector, name):
    """0 for black to 1 for white, of the first node found."""
    colour = page.locator(selector).first.evaluate(f"(node) => getComputedStyle(node).{name}")
    red, green, blue = (int(part) / 255 for part in re.findall(r"\d+", colour)[:3])
    return 0.21 * red + 0.72 * green + 0.07 * blue


def legend(page, title, entry):
    return section(page, title).get_by_role("button", name=entry, exact=True)


def show(page, title, task):
    section(page, title).get_by_label("Show").select_option(task)


def show_every(page, title):
    section(page, title).get_by_role("button", name="All ", exact=False).click()
