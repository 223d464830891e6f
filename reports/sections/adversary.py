"""The worst mechanisms that searches have found, variant by variant."""

from itertools import groupby

import search_figures
from charts import VIEW, Style
from data import Data, Find
from section import Choice, Figure, Section, Table
from text import error_text

SEARCH, RANDOM = "search", "random"
GAP = 1.5  # lanes from one mechanism to the next


def section(data: Data) -> Section | None:
    found = _cases(data.finds)
    if not found:
        return None
    rows = [_row(find) for own in found.values() for find in own if find.error]
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
            "ones as many mechanisms drawn at random. A difference between variants says what was "
            "found, not what there is.",
            "Errors are relative to the acceleration of the mechanism as the precision rounds it. "
            "They count for less where rounding each parameter alone changes the answer by more "
            "than a thousand roundoffs (kS), and where the acceleration is below 0.01 in SI units.",
        ],
        choices=choices,
        variants=style.variants,
        figures=_figures(rows, _drawn(found), style, choices),
        tables=[_table(found)],
    )


def _figures(rows: list[dict], bodies: list[dict], style: Style, choices: list[Choice]) -> list:
    figures = []
    if rows:
        chart = search_figures.worst_so_far(rows, style, _first(choices))
        figures.append(Figure("worst silent error so far", chart, search_figures.TOOLTIPS))
    if bodies:
        chart = search_figures.mechanisms(bodies, style, _first(choices))
        note = (
            "A body's size says its mass, on a logarithmic scale; lines are not to scale. Positions, "
            "axes and inertias are in the MJCF that the command below the figure writes."
        )
        figures.append(
            Figure("worst mechanisms", chart, search_figures.BODY_TOOLTIPS, notes=[note])
        )
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
        bodies = search_figures.body_rows(mechanism, find.bodies, top)
        tops[find.precision] = max(row["y"] for row in bodies) + GAP
        rows += bodies
    return rows


def _cases(finds: list[Find]) -> dict[tuple, list[Find]]:
    """By variant, precision, seed and method; of each the best so far, in order."""

    def case(find: Find) -> tuple:
        return find.variant, find.precision, find.seed, find.method

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


def _table(found: dict[tuple, list[Find]]) -> Table:
    rows = []
    for variant, precision, seed in dict.fromkeys(key[:3] for key in found):
        last = {
            method: own[-1]
            for method in (SEARCH, RANDOM)
            if (own := found.get((variant, precision, seed, method)))
        }
        if not (search := last.get(SEARCH)):
            continue
        command = (
            f"build/bin/adversary --variant '{variant}' --precision {precision} --seed {seed} "
            f"--method search --evaluations {search.evaluations} --out finds"
        )
        rows.append(
            [
                variant,
                precision,
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
        ["Variant", "Precision", "Judged", "Search", "Random", "kS", "DoF", "Command"],
        rows,
        "llrrrrrl",
        folded=True,
    )
