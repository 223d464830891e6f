"""Median time of one call on the random chain of N links. The covariances, the filter and the
smoother, the gradient of log det M and forward dynamics (acceleration) are recursions, whose time
grows in proportion to N; Result 6.1 has N² entries to write. The literal operators are the paper’s
block matrices, multiplied as written: N³, and there to check the others.
"""

from operator import attrgetter

from charts.text import fit_text
from page.section import Section, left, of, right
from read.data import Data, scene_size
from sections.common import SERIES, Group, call_text, groups, spaced
from summary.points import FIT_FROM, Fit, fit_exponent

SORTED = ("task", "variant", "precision")
ORDERS = {"inverse": "N²", "operators": "N³"}  # by operation count; a recursion's is N


def section(data: Data) -> Section | None:
    if not data.estimation:
        return None
    sizes = sorted({scene_size(time.scene) for time in data.estimation})

    def at(size: int):
        return lambda it: next((time for time in it.own if scene_size(time.scene) == size), None)

    page = Section("Cost of the paper’s recursions", __doc__)
    page.table(
        f"""Order: by count of operations. Exponent: the slope of a least-squares line through log
        of the time against log N, over N ≥ {FIT_FROM}; ± is its standard error. –: not measured,
        since it would take too much time or memory.""",
        [
            left("Task", "task", spaced),
            SERIES,
            left("Order", lambda it: ORDERS.get(it.task, "N")),
            right("Exponent", _exponent, fit_text),
            [of(at(size), right(f"N\u00a0=\u00a0{size}", call_text)) for size in sizes],
        ],
        groups(sorted(data.estimation, key=attrgetter(*SORTED)), *SORTED),
    )
    refused = [it for it in data.estimation if it.refused]
    for it in groups(refused, "task", "refused"):
        scenes = ", ".join(str(scene_size(time.scene)) for time in it.own)
        page.say(f"Not timed: {spaced(it.task)} at N = {scenes}: {it.refused}.")
    return page


def _exponent(series: Group) -> Fit | None:
    return fit_exponent([(scene_size(it.scene), it.nanoseconds) for it in series.own], FIT_FROM)
