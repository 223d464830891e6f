"""How many mechanisms have to be looked at to see an error: at random, and by search."""

from charts import search as search_charts
from charts.common import VIEW, Style
from charts.text import error_text, thousands_text
from page.section import Choice, Figure, Section, Table
from read.data import Asked, Data, Find
from read.search import ISLANDS
from sections.adversary import RANDOM, SEARCH
from summary.tails import Series, series, upper_limit

TASKS = {"acceleration": "dynamics"}  # of a search, and what a campaign calls it


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
    shown = {(find.variant, find.precision) for find in finds}
    rows = [_search_row(find) for find in finds]
    rows += [row for key in sorted(shown) for row in _random_rows(key, drawn[key])]
    precisions = sorted({precision for _, precision in shown})
    choice = Choice(VIEW, "Precision", [(name, name) for name in precisions], precisions[-1])
    style = Style((variant for variant, _ in shown), precisions)
    chart = search_charts.worst_so_far(rows, style, {VIEW: choice.first})
    return Section(
        "How far do you have to look?",
        [
            "The largest silent error of an acceleration against the mechanisms that were judged for "
            "it. Solid: a search. Dashed: searches that exchange what they find. Dotted: the error "
            "that one in so many of the campaign’s random mechanisms shows, by its counts.",
            "The two draw from other populations: a search has at most nine degrees of freedom and "
            "ranges that are wider than a family’s, and counts an error for less where it is the "
            "problem’s own (kS above 1000). A random error may be no fault of the variant; one that "
            "was searched for is.",
        ],
        choices=[choice],
        variants=style.variants,
        figures=[Figure("worst silent error by mechanisms judged", chart, search_charts.TOOLTIPS)],
        tables=[_table(finds, drawn)],
    )


def _drawn_at_random(data: Data) -> dict[tuple[str, str], Series]:
    """By variant and precision, of the first family: what a search asks, measured as it does."""
    found: dict[tuple[str, str], Series] = {}
    for (_, _, task, variant, precision, measure), own in series(data.campaign).items():
        if task in TASKS.values() and measure == "relative":
            found.setdefault((variant, precision), own)
    return found


def _search_row(find: Find) -> dict:
    return _row(find.variant, find.precision, find.method, find.evaluations, find.error, find.seed)


def _random_rows(key: tuple[str, str], own: Series) -> list[dict]:
    """One mechanism in n is as wrong: for n from what all are to what a single one is."""
    points = {own.trials / count: x for x, count in own.tail if count}
    return [_row(*key, RANDOM, n, x, 0) for n, x in points.items()]


def _row(variant, precision, method, evaluations, error, seed) -> dict:
    return {
        "variant": variant,
        "precision": precision,
        VIEW: precision,
        "scene": method,
        "name": f"{method} {seed}",  # tells lines of a variant apart
        "evaluations": evaluations,
        "error": error,
        "error_text": error_text(error),
    }


def _table(finds: list[Find], drawn: dict[tuple[str, str], Series]) -> Table:
    """Of each search's largest error, and when it was first seen."""
    worst: dict[tuple[str, str], Find] = {}
    for find in sorted(finds, key=lambda find: (-find.error, find.evaluations)):
        worst.setdefault((find.variant, find.precision), find)
    return Table(
        "Mechanisms judged by search, and random ones that it takes to see as large an error",
        [
            "Variant",
            "Precision",
            "By",
            "Search: judged",
            "worst",
            "Random: judged",
            "worst",
            "for as large",
        ],
        [
            [
                find.variant,
                find.precision,
                find.method,
                str(find.evaluations),
                error_text(find.error),
                str(own.trials),
                error_text(own.tail[-1][0]) if own.tail else "–",
                _needed(find.error, own),
            ]
            for find, own in ((find, drawn[key]) for key, find in sorted(worst.items()))
        ],
        "lllrrrrr",
    )


def _needed(error: float, own: Series) -> str:
    count = own.as_wrong(error)
    if count:
        return thousands_text(own.trials / count, 2)
    return f"> {thousands_text(1 / upper_limit(0, own.trials), 2)}"
