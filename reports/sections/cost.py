"""What the paper's recursions and the fast path cost, against N."""

from collections import defaultdict

from charts.text import fit_text, time_text
from page.section import Section, Table
from read.data import Data, Time, scene_size
from summary.points import FIT_FROM, fit_exponent

ORDERS = {"inverse": "N²", "operators": "N³"}  # by operation count; a recursion's is N


def section(data: Data) -> Section | None:
    if not data.estimation:
        return None
    series = defaultdict(dict)
    for time in data.estimation:
        series[time.task, time.variant, time.precision][scene_size(time.scene)] = time
    sizes = sorted({size for times in series.values() for size in times})
    rows = [
        [
            task.replace("_", " "),
            variant,
            precision,
            ORDERS.get(task, "N"),
            fit_text(
                fit_exponent(((size, time.nanoseconds) for size, time in times.items()), FIT_FROM)
            ),
            *(_cell(times.get(size)) for size in sizes),
        ]
        for (task, variant, precision), times in sorted(series.items())
    ]
    return Section(
        "Cost of the paper’s recursions",
        [
            "Median time of one call on the random chain of N links. The covariances, the filter "
            "and the smoother, the gradient of log det M and forward dynamics (acceleration) are "
            "recursions, whose time grows in proportion to N; Result 6.1 has N² entries to write. "
            "The literal operators are the paper’s block matrices, multiplied as written: N³, and "
            "there to check the others."
        ],
        tables=[
            Table(
                "Order: by count of operations. Exponent: the slope of a least-squares line "
                f"through log of the time against log N, over N ≥ {FIT_FROM}; ± is its standard "
                "error. –: not measured, since it would take too much time or memory.",
                ["Task", "Variant", "Precision", "Order", "Exponent"]
                + [f"N\u00a0=\u00a0{size}" for size in sizes],
                rows,
                "llllr" + "r" * len(sizes),
            )
        ],
        statements=_refusals(data.estimation),
    )


def _cell(time: Time | None) -> str:
    if time and time.refused:
        return "failed"
    return time_text(time and time.nanoseconds)


def _refusals(times: list[Time]) -> list[str]:
    scenes = defaultdict(list)
    for time in times:
        if time.refused:
            scenes[time.task.replace("_", " "), time.refused].append(f"{scene_size(time.scene)}")
    return [
        f"Not timed: {task} at N = {', '.join(sizes)}: {reason}."
        for (task, reason), sizes in scenes.items()
    ]
