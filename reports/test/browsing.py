"""What a reader sees of a page."""

import re

PHONE = {"width": 390, "height": 844}


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
