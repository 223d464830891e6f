"""A fit asks for the Jacobian of the residual of every sample over ten log-Cholesky coordinates of
each body. Factored is by the filter’s own recursions; AutoDiff is Ceres’ dual numbers, eight
directions at a time, through the same templates; NumericDiff and NumericDiffCentral are Ceres’
forward and central differences with its default steps. Down and to the left is better; a number
beside a mark is N.

The error is relative, in the Frobenius norm, against dual numbers in extended precision: the
largest over the states checked. Dual numbers and differences run the whole residual each time,
kinematics included, which depends on no parameter: who takes that out by hand has less to wait for
than is shown here. The Jacobian of the mass matrix has 5 N³ entries, which every method writes:
there the ratio falls with N.
"""

from charts import fits as fit_charts
from charts.common import Style
from charts.text import error_text, task_rank, task_text, three_digits, time_text
from page.section import Column, Section, left, of, right
from read.data import Data, Jacobian, scene_size
from sections.common import ratio
from sections.method import timed_calls
from summary.groups import by_key

OURS = "Factored"
OTHERS = {
    "AutoDiff": "dual numbers",
    "NumericDiff": "forward differences",
    "NumericDiffCentral": "central differences",
}
ERROR = right("Error", "error", error_text)


def section(data: Data) -> Section | None:
    timed = [jacobian for jacobian in data.jacobians if jacobian.time.nanoseconds]
    if not timed:
        return None
    timed.sort(key=lambda jacobian: (scene_size(jacobian.time.scene), jacobian.time.variant))
    page = Section(
        "Jacobians of a fit", __doc__, Style((jacobian.time.variant for jacobian in timed), [])
    )
    page.say(*timed_calls(data.jacobians_contexts))
    for time, _ in data.jacobians:
        if time.refused:
            what = f"{task_text(time.task)}, {time.variant}, {time.scene}"
            page.say(f"Not timed: {what}: {time.refused}.")
    own = by_key(timed, lambda jacobian: jacobian.time.task)
    for task in sorted(own, key=task_rank):
        chart = fit_charts.work_precision(own[task], page.style)
        page.figure(task_text(task), chart, fit_charts.JACOBIAN_TOOLTIPS)
    known = {(it.time.task, it.time.scene, it.time.variant): it for it in timed}

    def columns(variant: str, name: str) -> list[Column]:
        def other(ours: Jacobian) -> tuple[Jacobian, Jacobian] | None:
            found = known.get((ours.time.task, ours.time.scene, variant))
            return found and (found, ours)

        def times_as_long(other: Jacobian, ours: Jacobian) -> float | None:
            return ratio(other.time.nanoseconds, ours.time.nanoseconds)

        title = f"{name.capitalize()}: times as long"
        return of(other, right(title, times_as_long, three_digits), ERROR)

    def rank(it: Jacobian) -> tuple:
        return task_rank(it.time.task), scene_size(it.time.scene), it.time.scene

    page.table(
        "Median time of a factored Jacobian, and how many times as long the others take",
        [
            left("Residual", "time.task", task_text),
            left("Scene:N", "time.scene"),
            right("Factored", "time.nanoseconds", time_text),
            ERROR,
            [columns(*other) for other in OTHERS.items()],
        ],
        sorted((it for it in timed if it.time.variant == OURS), key=rank),
    )
    return page
