"""The worst mechanisms that searches have found, variant by variant."""

import shlex
from itertools import groupby

from charts import search as search_charts
from charts.common import VIEW, Style
from charts.text import error_text
from page.section import Choice, Figure, Section, Table
from read.data import Asked, Data, Find

SEARCH, RANDOM = "search", "random"
GAP = 1.5  # lanes from one mechanism to the next


def section(data: Data) -> Section | None:
    found = _cases(data.finds)
    if not found:
        return None
    usual = {key: own for key, own in found.items() if key[2] == Asked()}
    rows = [_row(find) for own in usual.values() for find in own if find.error]
    precisions = sorted({row["precision"] for row in rows})
    options = [(precision, precision) for precision in precisions]
    choices = [Choice(VIEW, "Precision", options, precisions[-1])] if precisions else []
    style = Style((row["variant"] for row in rows), precisions)
    return Section(
        "Worst found by search",
        [
            "An optimiser looks for the mechanism and state on which an acceleration is most wrong "
            "without a warning: chains and trees of 1 to 9 degrees of freedom, all joint types, "
            "masses over sixteen decades, lengths over six. Solid lines are the search, dotted "
            "ones as many mechanisms drawn at random, dashed ones a campaign of searches that exchange "
            "what they find. A difference between variants says what was "
            "found, not what there is.",
            "Errors are relative to the acceleration of the mechanism as the precision rounds it. "
            "They count for less where rounding each parameter alone changes the answer by more "
            "than a thousand roundoffs (kS), and where the acceleration is below 0.01 in SI units.",
            "Figures are of accelerations, state by state. The table also has what was asked for "
            "otherwise: M⁻¹, its diagonal, solves, log det M or derivatives, mechanisms of a kernel "
            "of their own, rows of states. Where the objective is claim, the number is the error "
            "divided by the error that comes with the answer, or, where none does, by 10⁻² in "
            "float32 and 10⁻⁶ in float64.",
        ],
        choices=choices,
        variants=style.variants,
        figures=_figures(rows, _drawn(usual), style, choices),
        tables=[_table(found)],
    )


def _figures(rows: list[dict], bodies: list[dict], style: Style, choices: list[Choice]) -> list:
    figures = []
    if rows:
        chart = search_charts.worst_so_far(rows, style, _first(choices))
        figures.append(Figure("worst silent error so far", chart, search_charts.TOOLTIPS))
    if bodies:
        chart = search_charts.mechanisms(bodies, style, _first(choices))
        note = (
            "A body's size says its mass, on a logarithmic scale; lines are not to scale. Positions, "
            "axes and inertias are in the MJCF that the command below the figure writes."
        )
        figures.append(Figure("worst mechanisms", chart, search_charts.BODY_TOOLTIPS, notes=[note]))
    return figures


def _first(choices: list[Choice]) -> dict[str, str]:
    return {choice.signal: choice.first for choice in choices}


def _drawn(found: dict[tuple, list[Find]]) -> list[dict]:
    """Rows of the bodies of each variant's worst mechanism, precision by precision."""
    last = [own[-1] for (*_, method), own in found.items() if method == SEARCH]
    rows, tops = [], {}
    for find in sorted((find for find in last if find.bodies), key=lambda find: -find.error):
        mechanism = {
            "variant": find.variant,
            "precision": find.precision,
            VIEW: find.precision,
            "scene": find.method,
        }
        if any(row["variant"] == find.variant for row in rows if row[VIEW] == find.precision):
            continue  # of another seed, and less wrong
        top = tops.get(find.precision, 0)
        bodies = search_charts.body_rows(mechanism, find.bodies, top)
        tops[find.precision] = max(row["y"] for row in bodies) + GAP
        rows += bodies
    return rows


def _cases(finds: list[Find]) -> dict[tuple, list[Find]]:
    """By variant, precision, what was asked, seed and method; of each the best so far, in order."""

    def case(find: Find) -> tuple:
        return find.variant, find.precision, find.asked, find.seed, find.method

    return {key: list(own) for key, own in groupby(sorted(finds, key=case), case)}


def _row(find: Find) -> dict:
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


def _options(asked: Asked) -> list[str]:
    """Of the command line, where they are not the usual ones."""
    options = [
        word
        for name, value in asked._asdict().items()
        if name != "rows" and value != Asked._field_defaults[name]
        for word in (f"--{name}", value)
    ]
    return options + ["--rows"] * asked.rows


def _words(asked: Asked) -> str:
    words = [asked.task, *(value for value in asked[1:3] if value not in Asked()[1:3])]
    return ", ".join([*words, "rows"] if asked.rows else words)


def _table(found: dict[tuple, list[Find]]) -> Table:
    rows = []
    for variant, precision, asked, seed in dict.fromkeys(key[:4] for key in found):
        last = {
            method: own[-1]
            for method in (SEARCH, RANDOM)
            if (own := found.get((variant, precision, asked, seed, method)))
        }
        if not (search := last.get(SEARCH)):
            continue
        command = shlex.join(
            [
                *("build/bin/adversary", "--variant", variant, "--precision", precision),
                *_options(asked),
                *("--seed", str(seed), "--method", "search"),
                *("--evaluations", str(search.evaluations), "--out", "finds"),
            ]
        )
        rows.append(
            [
                variant,
                precision,
                _words(asked),
                str(search.evaluations),
                error_text(search.error),
                error_text(last[RANDOM].error) if RANDOM in last else "–",
                "–" if search.kS is None else f"{search.kS:.2g}",
                "–" if search.nv is None else str(search.nv),
                command,
            ]
        )
    return Table(
        "Worst silent error found, and the command that finds it again and writes its MJCF and "
        "state for evaluate",
        ["Variant", "Precision", "Asked", "Judged", "Search", "Random", "kS", "DoF", "Command"],
        rows,
        "lllrrrrrl",
        folded=True,
    )
