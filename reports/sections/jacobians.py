"""Time and error of the Jacobians of a fit: factored, by dual numbers, by differences."""

from charts import fits as fit_charts
from charts.common import Style
from charts.text import error_text, task_rank, task_text, three_digits, time_text
from page.section import Figure, Section, Table
from read.data import Data, Jacobian, scene_size
from sections.method import distinct

OURS = "Factored"
OTHERS = {
    "AutoDiff": "dual numbers",
    "NumericDiff": "forward differences",
    "NumericDiffCentral": "central differences",
}


def section(data: Data) -> Section | None:
    timed = [jacobian for jacobian in data.jacobians if jacobian.time.nanoseconds]
    if not timed:
        return None
    timed.sort(key=lambda jacobian: (scene_size(jacobian.time.scene), jacobian.time.variant))
    tasks = sorted({jacobian.time.task for jacobian in timed}, key=task_rank)
    style = Style((jacobian.time.variant for jacobian in timed), [])
    own = {task: [jacobian for jacobian in timed if jacobian.time.task == task] for task in tasks}
    return Section(
        "Jacobians of a fit",
        [
            "A fit asks for the Jacobian of the residual of every sample over ten log-Cholesky "
            "coordinates of each body. Factored is by the filter’s own recursions; AutoDiff is "
            "Ceres’ dual numbers, eight directions at a time, through the same templates; "
            "NumericDiff and NumericDiffCentral are Ceres’ forward and central differences with "
            "its default steps. Down and to the left is better; a number beside a mark is N.",
            "The error is relative, in the Frobenius norm, against dual numbers in extended "
            "precision: the largest over the states checked. Dual numbers and differences run the "
            "whole residual each time, kinematics included, which depends on no parameter: who "
            "takes that out by hand has less to wait for than is shown here. The Jacobian of the "
            "mass matrix has 5 N³ entries, which every method writes: there the ratio falls with "
            "N.",
        ],
        statements=[
            f"A timed call: {text}" for text in distinct(data.jacobians_contexts, "timed_call")
        ]
        + _refusals(data.jacobians),
        variants=style.variants,
        figures=[
            Figure(
                task_text(task),
                fit_charts.work_precision(own[task], style),
                fit_charts.JACOBIAN_TOOLTIPS,
            )
            for task in tasks
        ],
        tables=[_ratios(timed)],
    )


def _ratios(timed: list[Jacobian]) -> Table:
    calls = {}
    for jacobian in timed:
        call = jacobian.time.task, jacobian.time.scene
        calls.setdefault(call, {})[jacobian.time.variant] = jacobian
    rows = []
    for (task, scene), by in sorted(
        calls.items(), key=lambda item: (task_rank(item[0][0]), scene_size(item[0][1]), item[0][1])
    ):
        ours = by.get(OURS)
        if not ours:
            continue
        cells = [task_text(task), scene, time_text(ours.time.nanoseconds), error_text(ours.error)]
        for variant in OTHERS:
            other = by.get(variant)
            ratio = other and other.time.nanoseconds / ours.time.nanoseconds
            cells += [three_digits(ratio) if other else "–", error_text(other and other.error)]
        rows.append(cells)
    columns = ["Residual", "Scene:N", "Factored", "Error"]
    for name in OTHERS.values():
        columns += [f"{name.capitalize()}: times as long", "Error"]
    return Table(
        "Median time of a factored Jacobian, and how many times as long the others take",
        columns,
        rows,
        "ll" + "r" * (len(columns) - 2),
    )


def _refusals(jacobians: list[Jacobian]) -> list[str]:
    return [
        f"Not timed: {task_text(time.task)}, {time.variant}, {time.scene}: {time.refused}."
        for time, _ in jacobians
        if time.refused
    ]
