"""What the paper's recursions cost, against N."""

from collections import defaultdict

from data import Data, Time, scene_size
from section import Section, Table
from summary import fit_exponent
from text import fit_text, time_text

ORDERS = {  # as the operation count says; a recursion's is N
    "closed_form_inverse": "N²",
    "literal_operators": "N³",
}


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
            *(_cell(times.get(size)) for size in sizes),
            ORDERS.get(task, "N"),
            fit_text(fit_exponent((size, time.nanoseconds) for size, time in times.items())),
        ]
        for (task, variant, precision), times in series.items()
    ]
    return Section(
        "Cost of the paper’s recursions",
        [
            "Median time of one call on a chain of N links. The filter, the smoother, the "
            "covariances and the gradient of log det M are recursions and take a time in "
            "proportion to N; the closed-form inverse has N² entries to write. The literal "
            "operators are the paper’s block matrices, multiplied as written: N³, and there to "
            "check the others."
        ],
        tables=[
            Table(
                "Times, and the slope of a least-squares line through log of the time against "
                "log N over all N; ± is its standard error. –: not measured.",
                ["Task", "Variant", "Precision", *(f"N = {size}" for size in sizes)]
                + ["Order", "Exponent"],
                rows,
                "lll" + "r" * len(sizes) + "lr",
            )
        ],
        statements=_refusals(data.estimation),
    )


def _cell(time: Time | None) -> str:
    if time and time.refused:
        return "refused"
    return time_text(time and time.nanoseconds)


def _refusals(times: list[Time]) -> list[str]:
    scenes = defaultdict(list)
    for time in times:
        if time.refused:
            scenes[time.task.replace("_", " "), time.refused].append(f"{scene_size(time.scene)}")
    return [
        f"Refused: {task} at N = {', '.join(sizes)}: {reason}."
        for (task, reason), sizes in scenes.items()
    ]
