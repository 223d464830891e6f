"""This run against another: ratios of times with their noise, errors that changed, the machines."""

import math
from collections import Counter
from statistics import geometric_mean

from markupsafe import Markup

from charts import aggregates as aggregate_charts
from charts.common import VIEW, Style
from charts.text import error_text, measure_text, task_rank, task_text, three_digits, time_text
from page.section import Choice, Figure, Section, Table
from read.data import Data
from sections.method import distinct
from summary.engines import cells, changed
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

MOST = 100  # rows of a table of changes
SLOWER = 1.5  # factor of a time from Python that is told
OTHER_MACHINE = "machines differ"


def section(data: Data) -> Section | None:
    if data.baseline is None:
        return None
    found = changes(data, data.baseline)
    differ = differences(data, data.baseline)
    foreign = "cpu" in differ
    rows = [_row(change, foreign) for change in found]
    views = _choice(rows)
    figures, tables = [], []
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    if rows:
        chart = aggregate_charts.ratios(rows, style, {VIEW: views.first})
        figures = [Figure("times now over before", chart, aggregate_charts.RATIO_TOOLTIPS)]
        tables = [_summary(found, foreign), _largest(found, foreign)]
    return Section(
        "This run against the baseline",
        [
            "Ratio: time now over time before, below 1 is faster. Noise: the standard error of the "
            "ratio, from the repetitions of both. A change counts if it is more than "
            f"{NOISES} of these and more than {100 * LEAST:.0f} %; the bars in the figure are "
            f"{NOISES} either way. Runs hours apart differ by more than their repetitions say: "
            "scripts/bench_compare takes turns.",
        ],
        statements=[*_runs(data), *_machines(differ), *_unread(data.baseline)],
        choices=[views] if views and len(views.options) > 1 else [],
        variants=style.variants,
        precisions=style.precisions,
        figures=figures,
        tables=[*tables, *_engines(data), *_errors(data)],
        opened=True,
    )


def _runs(data: Data) -> list[str]:
    return [
        f"{name}: revision {', '.join(distinct(run.all_contexts, 'git_revision')) or 'unknown'}, "
        f"{', '.join(dict.fromkeys(date[:10] for date in distinct(run.all_contexts, 'date')))}."
        for name, run in (("Baseline", data.baseline), ("This run", data))
    ]


def _machines(differ: dict) -> list[Markup]:
    return [
        Markup('<strong class="bad">The runs differ in {}:</strong> before {}; now {}.{}').format(
            key,
            " | ".join(then) or "unknown",
            " | ".join(now) or "unknown",
            " No time is called faster or slower." if key == "cpu" else "",
        )
        for key, (then, now) in differ.items()
    ]


def _unread(baseline: Data) -> list[str]:
    files = baseline.unread + baseline.engine_faults
    return [f"Not read of the baseline: {'; '.join(files)}."] if files else []


def _engines(data: Data) -> list[Table]:
    """What changed of engines, robot by robot."""
    before = cells(data.baseline)
    pairs = changed(cells(data), before, WORSE, SLOWER)
    if not pairs:
        return []
    pairs.sort(key=lambda pair: (pair[1].scene, pair[1].variant, pair[1].task, pair[1].batch))
    rows = [
        [new.scene, new.variant, new.precision, task_text(new.task), str(new.batch)]
        + [f"{old.version} → {new.version}" if old.version != new.version else new.version]
        + [f"{old.status} → {new.status}" if old.status != new.status else new.status]
        + [error_text(old.worst), error_text(new.worst), time_text(old.time), time_text(new.time)]
        for old, new in pairs
    ]
    return [
        Table(
            "Engines: cells of another status or version, whose worst error changed by more than a "
            f"factor of {WORSE} or time by more than {SLOWER:g}",
            ["Scene:N", "Engine", "Precision", "Task", "States", "Version", "Status"]
            + ["Worst before", "Now", "Time before", "Now"],
            rows,
            "llllrllrrrr",
            folded=len(rows) > 8,
        )
    ]


def _verdict(change: Change, foreign: bool) -> str:
    return OTHER_MACHINE if foreign else change.verdict


def _percent(noise: float | None) -> str:
    return "–" if noise is None else f"± {100 * math.expm1(noise):.1f} %"


def _view(change: Change) -> str:
    return f"{change.program}: {task_text(change.after.task)}"


def _row(change: Change, foreign: bool) -> dict:
    time, ratio = change.after, change.ratio
    reach = math.exp(NOISES * (change.noise or 0))
    return {
        "scene": time.scene,
        VIEW: _view(change),
        "variant": time.variant,
        "precision": time.precision,
        "before": change.before,
        "ratio": float(f"{ratio:.5g}"),
        "low": float(f"{ratio / reach:.5g}"),
        "high": float(f"{ratio * reach:.5g}"),
        "before_text": time_text(change.before),
        "after_text": time_text(time.nanoseconds),
        "ratio_text": f"{ratio:.3f}",
        "noise_text": _percent(change.noise),
        "verdict": _verdict(change, foreign),
    }


def _choice(rows: list[dict]) -> Choice | None:
    views = list(dict.fromkeys(row[VIEW] for row in rows))
    return Choice(VIEW, "Show", [(view, view) for view in views], views[0]) if views else None


def _summary(found: list[Change], foreign: bool) -> Table:
    rows = []
    for (program, task), own in sorted(by_task(found).items(), key=lambda it: task_rank(it[0][1])):
        counts = Counter(_verdict(change, foreign) for change in own)
        cells = [str(counts[name]) for name in ("faster", "slower", "same")]
        mean = three_digits(geometric_mean(change.ratio for change in own))
        rows.append([task_text(task), program, str(len(own)), mean, *cells])
    return Table(
        "Times by task: geometric mean of now over before, and how many changed",
        ["Task", "Program", "Calls", "Ratio", "Faster", "Slower", "Same"],
        rows,
        "llrrrrr",
    )


def _largest(found: list[Change], foreign: bool) -> Table:
    told = [change for change in found if foreign or change.verdict != "same"]
    told.sort(key=lambda change: -abs(math.log(change.ratio)))
    rows = [
        [
            change.after.scene,
            task_text(change.after.task),
            change.after.variant,
            change.after.precision,
            time_text(change.before),
            time_text(change.after.nanoseconds),
            f"{change.ratio:.3f}",
            _percent(change.noise),
            _verdict(change, foreign),
        ]
        for change in told[:MOST]
    ]
    rest = f", the first {MOST} of {len(told)}" if len(told) > MOST else ""
    return Table(
        f"Times that changed, the largest first{rest}",
        ["Scene:N", "Task", "Variant", "Precision", "Before", "Now", "Ratio", "Noise", "Verdict"],
        rows,
        "llllrrrrl",
        folded=True,
    )


def _errors(data: Data) -> list[Table]:
    pairs = worse_and_better(data, data.baseline)
    count = compared_errors(data, data.baseline)
    if not count:
        return []
    rows = [
        [
            new.scene,
            f"{task_text(new.task)}, {measure_text(new.measure)}",
            new.variant,
            new.precision,
            error_text(old.worst),
            error_text(new.worst),
            three_digits(new.worst / old.worst) if old.worst and new.worst else "–",
            f"{old.failures} of {old.states}",
            f"{new.failures} of {new.states}",
        ]
        for old, new in pairs
    ]
    return [
        Table(
            f"Errors: {len(rows)} of {count} largest errors changed by more than a factor of "
            f"{WORSE}, or fail on another share of the states",
            ["Scene:N", "Error", "Variant", "Precision", "Before", "Now", "Ratio", "Failed before"]
            + ["Failed now"],
            rows,
            "llllrrrrr",
            folded=len(rows) > 8,
        )
    ]
