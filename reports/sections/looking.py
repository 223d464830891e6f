"""The largest silent error of an acceleration against the mechanisms that were judged for it.
Solid: a search. Dashed: searches that exchange what they find. Dotted: the error that one in so
many of the campaign’s random mechanisms shows, by its counts.

The two draw from other populations: a search has at most nine degrees of freedom and ranges that
are wider than a family’s, and counts an error for less where it is the problem’s own (kS above
1000). A random error may be no fault of the variant; one that was searched for is.
"""

from charts import search as search_charts
from charts.common import VIEW, Style
from charts.text import error_text, thousands_text
from page.section import Section, left, right
from read.data import Asked, Data, Find
from read.search import ISLANDS
from sections.adversary import RANDOM, SEARCH, row
from sections.common import SERIES
from summary.tails import Series, series, upper_limit

TASK = "dynamics"  # what a campaign calls the acceleration of a search


def section(data: Data) -> Section | None:
    if not data.campaign:
        return None
    drawn = _drawn_at_random(data)
    finds = [
        find
        for find in data.finds
        if find.error and find.method in (SEARCH, ISLANDS) and find.asked == Asked()
        if (find.variant, find.precision) in drawn
    ]
    if not finds:
        return None
    shown = sorted({(find.variant, find.precision) for find in finds})
    rows = [row(find) for find in finds]
    rows += [row(find) for key in shown for find in _at_random(key, drawn[key])]
    precisions = sorted({precision for _, precision in shown})
    style = Style((variant for variant, _ in shown), precisions)
    page = Section("How far do you have to look?", __doc__, Style(style.variants, []))
    page.choose(VIEW, "Precision", precisions, first=precisions[-1])
    chart = search_charts.worst_so_far(rows, style, page.first)
    page.figure("worst silent error by mechanisms judged", chart, search_charts.TOOLTIPS)
    worst: dict[tuple[str, str], Find] = {}
    for find in sorted(finds, key=lambda find: (-find.error, find.evaluations)):
        worst.setdefault((find.variant, find.precision), find)
    page.table(
        "Mechanisms judged by search, and random ones that it takes to see as large an error",
        [
            SERIES,
            left("By", "method"),
            right("Search: judged", "evaluations"),
            right("worst", "error", error_text),
            right("Random: judged", lambda _, own: own.trials),
            right("worst", lambda _, own: error_text(own.tail[-1][0]) if own.tail else None),
            right("for as large", lambda find, own: _needed(find.error, own)),
        ],
        [(find, drawn[key]) for key, find in sorted(worst.items())],
    )
    return page


def _drawn_at_random(data: Data) -> dict[tuple[str, str], Series]:
    """By variant and precision, of the first family: what a search asks, measured as it does."""
    found: dict[tuple[str, str], Series] = {}
    for (_, _, task, variant, precision, measure), own in series(data.campaign).items():
        if (task, measure) == (TASK, "relative"):
            found.setdefault((variant, precision), own)
    return found


def _at_random(key: tuple[str, str], own: Series) -> list[Find]:
    """One mechanism in n is as wrong: for n from what all are to what a single one is."""
    points = {own.trials / count: x for x, count in own.tail if count}
    return [Find(*key, Asked(), 0, RANDOM, n, x, None, None) for n, x in points.items()]


def _needed(error: float, own: Series) -> str:
    count = own.as_wrong(error)
    if count:
        return thousands_text(own.trials / count, 2)
    return f"> {thousands_text(1 / upper_limit(0, own.trials), 2)}"
