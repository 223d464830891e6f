"""Errors that one mechanism in many shows: a campaign's tails, and the worst that it has seen."""

import shlex

from charts import tails as tail_charts
from charts.common import SCENE, Style, short
from charts.text import error_text, measure_text, share_text, task_rank, task_text, thousands_text
from page.section import Choice, Figure, Section, Table
from read.campaign import Campaign, Worst, shortest
from read.data import Data
from summary.tails import WRONG, Series, by_condition, limits, series, upper_limit

TASK, MEASURE = "rare_task", "rare_measure"
LISTED = 3  # worst cases named a series
MILLION = 1e6


def section(data: Data) -> Section | None:
    campaign = data.campaign
    if not (campaign and campaign.groups):
        return None
    found = series(campaign)
    rows = [_row(key, x, *of) for key, own in found.items() for x, *of in _tail(own)]
    decades = by_condition(campaign).items()
    failures = [_row(key, x, *of) for key, own in decades for x, *of in _failures(own)]
    choices = _choices(found)
    style = Style((key[3] for key in found), (key[4] for key in found))
    first = {choice.signal: choice.first for choice in choices}
    figures = [
        Figure(title, chart(of, style, first), tail_charts.TOOLTIPS)
        for title, chart, of in (
            ("probability of a silent error beyond x", tail_charts.tails, rows),
            ("silent failures by condition", tail_charts.by_condition, failures),
        )
        if of
    ]
    return Section(
        "Rare errors",
        _paragraphs(campaign),
        choices=choices,
        variants=style.variants,
        precisions=style.precisions,
        figures=figures,
        tables=[*_counts(found, first), *_worst(campaign)],
    )


def _paragraphs(campaign: Campaign) -> list[str]:
    left = sum(campaign.no_truth.values())
    without = "all have" if not left else f"all but {left} have"
    worked = ", ".join(unit.name for unit in campaign.units)
    return [
        f"A campaign over {campaign.mechanisms} mechanisms ({worked}: family, value, first seed "
        f"and number of seeds), of which {without} a proven truth and count here.",
        f"Silent: more than {100 * WRONG:.2g} % wrong (the edge of the bin that 1 % lies in), "
        "without a failure or a warning. Limits are exact binomial ones (Clopper and Pearson): the "
        "band holds the probability with a confidence of 95 %; the upper limit of silent failures "
        "in a million has one of 95 % by itself, also where none was seen. A warning is false "
        "where the answer is less wrong than that, and missing from each silent failure. Beyond 4 "
        "claims: silent answers of a variant that claims an error, with more than four times "
        "that error. Recomputed: the first precision's estimated error was above the tolerance, "
        "and a wider one answered.",
        "kS is how much the answer changes with relative changes of the mechanism’s parameters: a "
        "failure at a small one is the variant’s own.",
    ]


def _case(key: tuple) -> str:
    """Family and value."""
    return f"{key[0]}/{shortest(key[1])}"


def _choices(found: dict[tuple, Series]) -> list[Choice]:
    cases = list(dict.fromkeys(map(_case, found)))
    tasks = sorted({key[2] for key in found}, key=task_rank)
    measures = sorted({key[5] for key in found}, reverse=True)  # relative first
    of = {
        SCENE: ("Family", [(case, case) for case in cases]),
        TASK: ("Task", [(task, task_text(task)) for task in tasks]),
        MEASURE: ("Measure", [(measure, measure_text(measure)) for measure in measures]),
    }
    return [
        Choice(signal, label, options, options[0][0]) for signal, (label, options) in of.items()
    ]


def _place(key: tuple) -> dict[str, str]:
    """What the choices are of a series."""
    return {SCENE: _case(key), TASK: key[2], MEASURE: key[5]}


def _tail(own: Series) -> list[tuple[float, int, int]]:
    """Errors, and the answers at least as wrong of all mechanisms."""
    return [(x, count, own.trials) for x, count in own.tail]


def _failures(own: dict[int, Series]) -> list[tuple[float, int, int]]:
    """Decades of kS where there are any, and the silent failures of their mechanisms."""
    return [(10.0**k, it.silent, it.trials) for k, it in own.items() if it.silent]


def _row(key: tuple, x: float, count: int, trials: int) -> dict:
    low, high = limits(count, trials)
    return _place(key) | {
        "task": key[2],
        "variant": key[3],
        "precision": key[4],
        "x": short(x),
        "x_text": error_text(x),
        "probability": short(count / trials),
        "low": short(low),
        "high": short(high),
        "count": str(count),
        "trials": str(trials),
        "limits_text": f"{error_text(low)} to {error_text(high)}",
    }


def _counts(found: dict[tuple, Series], first: dict[str, str]) -> list[Table]:
    """One for each choice."""
    tables = {}
    for key, own in found.items():
        tables.setdefault(tuple(_place(key).items()), []).append((key, own))
    return [
        Table(
            f"{place[SCENE]}, {task_text(place[TASK])}, {measure_text(place[MEASURE])}: silent "
            "failures and warnings",
            [
                "Variant",
                "Precision",
                "Mechanisms",
                "Refused",
                "Recomputed",
                "Silent",
                "in a million",
                "95 % limit",
                "Warned",
                "False warnings",
                "Beyond 4 claims",
            ],
            [_counts_row(key, series_) for key, series_ in own],
            "llrrrrrrrrr",
            shown=place,
            first=place == first,
        )
        for place, own in ((dict(items), own) for items, own in tables.items())
    ]


def _counts_row(key: tuple, own: Series) -> list[str]:
    claimed = own.counts.beyond_claim
    return [
        key[3],
        key[4],
        str(own.trials),
        str(own.refused),
        share_text(own.counts.recomputed / own.trials),
        str(own.silent),
        thousands_text(MILLION * own.silent / own.trials),
        thousands_text(MILLION * upper_limit(own.silent, own.trials)),
        str(own.warned),
        share_text(own.false_warnings / own.warned) if own.warned else "–",
        "–" if claimed is None else str(claimed),
    ]


def _worst(campaign: Campaign) -> list[Table]:
    seen: dict[tuple, list[Worst]] = {}
    for case in campaign.worst:
        seen.setdefault(case.series, []).append(case)
    rows = [
        [
            case.variant,
            case.precision,
            task_text(case.task),
            error_text(case.error),
            "–" if case.kS is None else error_text(case.kS),
            "–" if case.mass_ratio is None else error_text(case.mass_ratio),
            command(case),
        ]
        for _, own in sorted(seen.items())
        for case in own[:LISTED]
    ]
    if not rows:
        return []
    return [
        Table(
            "Worst seen: the largest silent errors, and the command that shows each again",
            ["Variant", "Precision", "Task", "Error", "kS", "Mass ratio", "Command"],
            rows,
            "lllrrrl",
            folded=True,
        )
    ]


def command(case: Worst) -> str:
    """What measures this one answer again."""
    unit = f"{case.family}/{shortest(case.value)}/{case.seed}+1"
    of = ["--variant", case.variant, "--precision", case.precision, "--task", case.task]
    return shlex.join(["build/bin/stress", "--unit", unit, *of, "--out", "unit.json"])
