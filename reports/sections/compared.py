"""Ratio: time now over time before, below 1 is faster. Noise: the standard error of the ratio, from
the repetitions of both. A change counts if it is more than {noises} of these and more than
{least:.0f} %; the bars in the figure are {noises} either way. Runs hours apart differ by more than
their repetitions say: scripts/bench_compare takes turns.
"""

import math
from collections import Counter
from statistics import geometric_mean

from markupsafe import Markup

from charts import aggregates as aggregate_charts
from charts.common import VIEW
from charts.text import error_text, measure_text, task_rank, task_text, three_digits, time_text
from page.section import Section, left, right
from read.data import Data
from sections.common import SERIES, ratio, style_of
from sections.method import distinct
from summary.baseline import (
    LEAST,
    NOISES,
    WORSE,
    Change,
    by_task,
    changes,
    compared_errors,
    differences,
    worse_and_better,
)
from summary.engines import cells, changed

MOST = 100  # rows of a table of changes
MANY = 8  # rows of a table that is unfolded
SLOWER = 1.5  # factor of a time from Python that is told


def section(data: Data) -> Section | None:
    if data.baseline is None:
        return None
    differ = differences(data, data.baseline)
    found = [
        (change, "machines differ" if "cpu" in differ else change.verdict)
        for change in changes(data, data.baseline)
    ]
    rows = [_row(*it) for it in found]
    page = Section(
        "This run against the baseline",
        __doc__.format(noises=NOISES, least=100 * LEAST),
        style_of(rows),
        opened=True,
    )
    for name, run in (("Baseline", data.baseline), ("This run", data)):
        revision = ", ".join(distinct(run.all_contexts, "git_revision")) or "unknown"
        days = dict.fromkeys(date[:10] for date in distinct(run.all_contexts, "date"))
        page.say(f"{name}: revision {revision}, {', '.join(days)}.")
    told = '<strong class="bad">The runs differ in {}:</strong> before {}; now {}.{}'
    for key, (then, now) in differ.items():
        values = (" | ".join(found) or "unknown" for found in (then, now))
        unjudged = " No time is called faster or slower." if key == "cpu" else ""
        page.say(Markup(told).format(key, *values, unjudged))
    if files := data.baseline.unread + data.baseline.engine_faults:
        page.say(f"Not read of the baseline: {'; '.join(files)}.")
    page.choose(VIEW, "Show", dict.fromkeys(row[VIEW] for row in rows))
    if rows:
        chart = aggregate_charts.ratios(rows, page.style, page.first)
        page.figure("times now over before", chart, aggregate_charts.RATIO_TOOLTIPS)
        _summary(page, found)
        _largest(page, found)
    _engines(page, data)
    _errors(page, data)
    return page


def _engines(page: Section, data: Data) -> None:
    """What changed of engines, robot by robot."""

    def both(name: str):
        return lambda new, old: " → ".join(dict.fromkeys((getattr(old, name), getattr(new, name))))

    pairs = changed(cells(data), cells(data.baseline), WORSE, SLOWER)
    pairs.sort(key=lambda pair: (pair[1].scene, pair[1].variant, pair[1].task, pair[1].batch))
    page.table(
        f"""Engines: cells of another status or version, whose worst error changed by more than a
        factor of {WORSE} or time by more than {SLOWER:g}""",
        [
            left("Scene:N", "scene"),
            left("Engine", "variant"),
            left("Precision", "precision"),
            left("Task", "task", task_text),
            right("States", "batch"),
            left("Version", both("version")),
            left("Status", both("status")),
            right("Worst before", lambda _, old: old.worst, error_text),
            right("Now", "worst", error_text),
            right("Time before", lambda _, old: old.time, time_text),
            right("Now", "time", time_text),
        ],
        [(new, old) for old, new in pairs],
        folded=len(pairs) > MANY,
    )


def _percent(noise: float | None) -> str:
    return "–" if noise is None else f"± {100 * math.expm1(noise):.1f} %"


def _row(change: Change, verdict: str) -> dict:
    time, factor = change.after, change.ratio
    reach = math.exp(NOISES * (change.noise or 0))
    return {
        "scene": time.scene,
        VIEW: f"{change.program}: {task_text(time.task)}",
        "variant": time.variant,
        "precision": time.precision,
        "before": change.before,
        "ratio": float(f"{factor:.5g}"),
        "low": float(f"{factor / reach:.5g}"),
        "high": float(f"{factor * reach:.5g}"),
        "before_text": time_text(change.before),
        "after_text": time_text(time.nanoseconds),
        "ratio_text": f"{factor:.3f}",
        "noise_text": _percent(change.noise),
        "verdict": verdict,
    }


def _summary(page: Section, found: list[tuple[Change, str]]) -> None:
    counts = Counter((it.program, it.after.task, verdict) for it, verdict in found)
    groups = sorted(by_task([it for it, _ in found]).items(), key=lambda it: task_rank(it[0][1]))
    page.table(
        "Times by task: geometric mean of now over before, and how many changed",
        [
            left("Task", lambda key, _: key[1], task_text),
            left("Program", lambda key, _: key[0]),
            right("Calls", lambda _, own: len(own)),
            right("Ratio", lambda _, own: geometric_mean(it.ratio for it in own), three_digits),
            *(
                right(name.capitalize(), lambda key, _, name=name: counts[*key, name])
                for name in ("faster", "slower", "same")
            ),
        ],
        groups,
    )


def _largest(page: Section, found: list[tuple[Change, str]]) -> None:
    told = [(change, verdict) for change, verdict in found if verdict != "same"]
    told.sort(key=lambda it: -abs(math.log(it[0].ratio)))
    rest = f", the first {MOST} of {len(told)}" if len(told) > MOST else ""
    page.table(
        f"Times that changed, the largest first{rest}",
        [
            left("Scene:N", "after.scene"),
            left("Task", "after.task", task_text),
            left("Variant", "after.variant"),
            left("Precision", "after.precision"),
            right("Before", "before", time_text),
            right("Now", "after.nanoseconds", time_text),
            right("Ratio", "ratio", "{:.3f}".format),
            right("Noise", "noise", _percent),
            left("Verdict", lambda _, verdict: verdict),
        ],
        told[:MOST],
        folded=True,
        stays=True,
    )


def _errors(page: Section, data: Data) -> None:
    pairs = worse_and_better(data, data.baseline)
    count = compared_errors(data, data.baseline)
    page.table(
        f"""Errors: {len(pairs)} of {count} largest errors changed by more than a factor of
        {WORSE}, or fail on another share of the states""",
        [
            left("Scene:N", "scene"),
            left("Error", lambda it, _: f"{task_text(it.task)}, {measure_text(it.measure)}"),
            SERIES,
            right("Before", lambda _, old: old.worst, error_text),
            right("Now", "worst", error_text),
            right("Ratio", lambda new, old: ratio(new.worst, old.worst), three_digits),
            right("Failed before", lambda _, old: f"{old.failures} of {old.states}"),
            right("Failed now", lambda new, _: f"{new.failures} of {new.states}"),
        ],
        [(new, old) for old, new in pairs],
        folded=len(pairs) > MANY,
        stays=count > 0,
    )
