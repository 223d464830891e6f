"""A campaign over {mechanisms} mechanisms ({worked}: family, value, first seed and number of
seeds), of which {proven} a proven truth and count here.

Silent: more than {wrong:.2g} % wrong (the edge of the bin that 1 % lies in), without a failure or a
warning. Limits are exact binomial ones (Clopper and Pearson): the band holds the probability with a
confidence of 95 %; the upper limit of silent failures in a million has one of 95 % by itself, also
where none was seen. A warning is false where the answer is less wrong than that, and missing from
each silent failure. Beyond 4 claims: silent answers of a variant that claims an error, with more
than four times that error. Recomputed: the first precision's estimated error was above the
tolerance, and a wider one answered.

kS is how much the answer changes with relative changes of the mechanism’s parameters: a failure at
a small one is the variant’s own.
"""

import shlex

from charts import tails as tail_charts
from charts.common import SCENE, short
from charts.text import error_text, measure_text, share_text, task_rank, task_text, thousands_text
from page.section import Section, left, of, right
from read.campaign import Worst, shortest
from read.data import Data
from sections.common import SERIES, Group, groups, style_of
from summary.groups import by_key
from summary.tails import WRONG, Series, by_condition, limits, series, upper_limit

TASK, MEASURE = "rare_task", "rare_measure"
LISTED = 3  # worst cases named a series
MILLION = 1e6


def section(data: Data) -> Section | None:
    campaign = data.campaign
    if not (campaign and campaign.groups):
        return None
    found = _groups(series(campaign))
    rows = [_row(it, *corner, it.found.trials) for it in found for corner in it.found.tail]
    failures = [  # decades of kS where there are any, and the silent failures of their mechanisms
        _row(it, 10.0**k, decade.silent, decade.trials)
        for it in _groups(by_condition(campaign))
        for k, decade in it.found.items()
        if decade.silent
    ]
    measures = sorted({it.measure for it in found}, reverse=True)  # relative first
    without = sum(campaign.no_truth.values())
    text = __doc__.format(
        mechanisms=campaign.mechanisms,
        worked=", ".join(unit.name for unit in campaign.units),
        proven=f"all but {without} have" if without else "all have",
        wrong=100 * WRONG,
    )
    page = Section("Rare errors", text, style_of(found))
    page.choose(SCENE, "Family", dict.fromkeys(it.case for it in found))
    page.choose(TASK, "Task", sorted({it.task for it in found}, key=task_rank), task_text)
    page.choose(MEASURE, "Measure", measures, measure_text)
    for title, chart, drawn in (
        ("probability of a silent error beyond x", tail_charts.tails, rows),
        ("silent failures by condition", tail_charts.by_condition, failures),
    ):
        if drawn:
            page.figure(title, chart(drawn, page.style, page.first), tail_charts.TOOLTIPS)
    for of_place in groups(found, "case", "task", "measure"):
        _counts(page, of_place)
    seen = by_key(campaign.worst, lambda case: case.series)
    page.table(
        "Worst seen: the largest silent errors, and the command that shows each again",
        [
            SERIES,
            left("Task", "task", task_text),
            right("Error", "error", error_text),
            right("kS", "kS", error_text),
            right("Mass ratio", "mass_ratio", error_text),
            left("Command", command),
        ],
        [case for _, own in sorted(seen.items()) for case in own[:LISTED]],
        folded=True,
    )
    return page


def _groups(found: dict[tuple, object]) -> list[Group]:
    """With what is found of each."""
    return [
        Group(
            case=f"{family}/{shortest(value)}",
            task=task,
            variant=variant,
            precision=precision,
            measure=measure,
            found=own,
        )
        for (family, value, task, variant, precision, measure), own in found.items()
    ]


def _place(it: Group) -> dict[str, str]:
    """What the choices are of it."""
    return {SCENE: it.case, TASK: it.task, MEASURE: it.measure}


def _row(it: Group, x: float, count: int, trials: int) -> dict:
    low, high = limits(count, trials)
    return _place(it) | {
        "task": it.task,
        "variant": it.variant,
        "precision": it.precision,
        "x": short(x),
        "x_text": error_text(x),
        "probability": short(count / trials),
        "low": short(low),
        "high": short(high),
        "count": str(count),
        "trials": str(trials),
        "limits_text": f"{error_text(low)} to {error_text(high)}",
    }


def _counts(page: Section, of_place: Group) -> None:
    def in_a_million(share: float) -> str:
        return thousands_text(MILLION * share)

    def limit(own: Series) -> float:
        return upper_limit(own.silent, own.trials)

    page.table(
        f"""{of_place.case}, {task_text(of_place.task)}, {measure_text(of_place.measure)}: silent
        failures and warnings""",
        [
            SERIES,
            of(
                "found",
                right("Mechanisms", "trials"),
                right("Refused", "refused"),
                right("Recomputed", lambda own: own.counts.recomputed / own.trials, share_text),
                right("Silent", "silent"),
                right("in a million", lambda own: own.silent / own.trials, in_a_million),
                right("95 % limit", limit, in_a_million),
                right("Warned", "warned"),
                right("False warnings", _false, share_text),
                right("Beyond 4 claims", "counts.beyond_claim"),
            ),
        ],
        of_place.own,
        shown=_place(of_place),
    )


def _false(own: Series) -> float | None:
    return own.false_warnings / own.warned if own.warned else None


def command(case: Worst) -> str:
    """What measures this one answer again."""
    unit = f"{case.family}/{shortest(case.value)}/{case.seed}+1"
    of = ["--variant", case.variant, "--precision", case.precision, "--task", case.task]
    return shlex.join(["build/bin/stress", "--unit", unit, *of, "--out", "unit.json"])
