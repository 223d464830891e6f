"""An optimiser looks for the mechanism and state on which an acceleration is most wrong without a
warning: chains and trees of 1 to 9 degrees of freedom, all joint types, masses over sixteen
decades, lengths over six. Solid lines are the search, dotted ones as many mechanisms drawn at
random, dashed ones a campaign of searches that exchange what they find. A difference between
variants says what was found, not what there is.

Errors are relative to the acceleration of the mechanism as the precision rounds it. They count for
less where rounding each parameter alone changes the answer by more than a thousand roundoffs (kS),
and where the acceleration is below 0.01 in SI units.

Figures are of accelerations, state by state. The table also has what was asked for otherwise: M⁻¹,
its diagonal, solves, log det M or derivatives, mechanisms of a kernel of their own, rows of states.
Where the objective is claim, the number is the error divided by the error that comes with the
answer, or, where none does, by 10⁻² in float32 and 10⁻⁶ in float64.
"""

import shlex
from operator import attrgetter

from charts import search as search_charts
from charts.common import VIEW, Style
from charts.text import error_text
from page.section import Section, left, of, right
from read.data import Asked, Data, Find
from sections.common import SERIES, groups

SEARCH, RANDOM = "search", "random"
GAP = 1.5  # lanes from one mechanism to the next


def section(data: Data) -> Section | None:
    case = ("variant", "precision", "asked", "seed", "method")
    found = groups(sorted(data.finds, key=attrgetter(*case)), *case)
    if not found:
        return None
    usual = [it for it in found if it.asked == Asked()]
    rows = [row(find) for it in usual for find in it.own if find.error]
    precisions = sorted({row["precision"] for row in rows})
    style = Style((row["variant"] for row in rows), precisions)
    page = Section("Worst found by search", __doc__, Style(style.variants, []))
    page.choose(VIEW, "Precision", precisions, first=next(reversed(precisions), ""))
    if rows:
        chart = search_charts.worst_so_far(rows, style, page.first)
        page.figure("worst silent error so far", chart, search_charts.TOOLTIPS)
    last = [it.own[-1] for it in found]
    if bodies := _drawn([it.own[-1] for it in usual if it.method == SEARCH]):
        page.figure(
            "worst mechanisms",
            search_charts.mechanisms(bodies, style, page.first),
            search_charts.BODY_TOOLTIPS,
            notes="""A body's size says its mass, on a logarithmic scale; lines are not to scale.
            Positions, axes and inertias are in the MJCF that the command below the figure
            writes.""",
        )
    at_random = {it[:4]: it for it in last if it.method == RANDOM}
    page.table(
        """Worst silent error found, and the command that finds it again and writes its MJCF and
        state for evaluate""",
        [
            SERIES,
            left("Asked", "asked", _words),
            right("Judged", "evaluations"),
            right("Search", "error", error_text),
            of(lambda find: at_random.get(find[:4]), right("Random", "error", error_text)),
            right("kS", "kS", "{:.2g}".format),
            right("DoF", "nv"),
            left("Command", _command),
        ],
        [find for find in last if find.method == SEARCH],
        folded=True,
    )
    return page


def row(find: Find) -> dict:
    """A point of a line of the chart."""
    return {
        "variant": find.variant,
        "precision": find.precision,
        VIEW: find.precision,
        "scene": find.method,  # the page lists rows that have one
        "name": f"{find.method} {find.seed}",  # tells lines of a variant apart
        "evaluations": find.evaluations,
        "error": find.error,
        "error_text": error_text(find.error),
    }


def _drawn(last: list[Find]) -> list[dict]:
    """Rows of the bodies of each variant's worst mechanism, precision by precision."""
    rows, tops, drawn = [], {}, set()
    for find in sorted((find for find in last if find.bodies), key=lambda find: -find.error):
        if (find.variant, find.precision) in drawn:
            continue  # of another seed, and less wrong
        drawn.add((find.variant, find.precision))
        mechanism = {
            "variant": find.variant,
            "precision": find.precision,
            VIEW: find.precision,
            "scene": find.method,
        }
        bodies = search_charts.body_rows(mechanism, find.bodies, tops.get(find.precision, 0))
        tops[find.precision] = max(row["y"] for row in bodies) + GAP
        rows += bodies
    return rows


def _command(find: Find) -> str:
    words = ["build/bin/adversary", "--variant", find.variant, "--precision", find.precision]
    for name in ("task", "objective", "kernel"):
        value = getattr(find.asked, name)
        if value != Asked._field_defaults[name]:
            words += [f"--{name}", value]
    words += ["--rows"] * find.asked.rows
    words += ["--seed", str(find.seed), "--method", "search"]
    return shlex.join([*words, "--evaluations", str(find.evaluations), "--out", "finds"])


def _words(asked: Asked) -> str:
    words = [asked.task, *(value for value in asked[1:3] if value not in Asked()[1:3])]
    return ", ".join([*words, "rows"] if asked.rows else words)
