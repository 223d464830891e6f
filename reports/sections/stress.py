"""How far each variant is from trouble on a robot: errors under growing loads."""

from charts import advice as advice_charts
from charts.common import SCENE, VIEW, Style
from charts.text import error_text, sentence, task_text
from page.section import Choice, Figure, Section, Table
from read.advice import ADVISED, Curve, Limits, Load
from read.data import Data, scene_name

KEPT = 1e-3  # three digits


def section(data: Data) -> Section | None:
    found = [it for it in data.limits if it.loads]
    if not found:
        return None
    present = {task for it in found for load in it.loads for task in load.curves}
    tasks = [task for task in ADVISED if task in present]
    choices = [
        Choice(SCENE, "Robot", [(it.robot, scene_name(it.robot)) for it in found], found[0].robot),
        Choice(VIEW, "Task", [(task, task_text(task)) for task in tasks], tasks[0]),
    ]
    first = {choice.signal: choice.first for choice in choices}
    rows = {}
    for it in found:
        for i, load in enumerate(it.loads):
            rows.setdefault((load.title, load.unit), []).extend(advice_charts.load_rows(it, i))
    series = [row for own in rows.values() for row in own]
    style = Style((row["variant"] for row in series), (row["precision"] for row in series))
    return Section(
        "Stress of the robot" if len(found) == 1 else "Stress of the robots",
        [
            "The robot is made harder in one way at a time; at each value the worst configuration "
            "is searched for, not sampled. Refused: every answer was called singular or not "
            "finite.",
            *([sentence(found[0].sentence)] if len(found) == 1 else []),
        ],
        choices=[choice for choice in choices if len(choice.options) > 1],
        variants=style.variants,
        precisions=style.precisions,
        figures=[
            Figure(
                title,
                advice_charts.against_load(own, style, first, unit),
                advice_charts.LOAD_TOOLTIPS,
            )
            for (title, unit), own in rows.items()
            if own
        ],
        tables=[_table(it, task, first) for it in found for task in tasks],
    )


def _table(limits: Limits, task: str, first: dict[str, str]) -> Table:
    rows = [
        [load.title, curve.variant, curve.precision, *_ends(load, curve), _reach(load, curve)]
        for load in limits.loads
        for curve in load.curves.get(task, [])
    ]
    return Table(
        f"{scene_name(limits.robot)}, {task_text(task)}: worst error at the first and the last "
        f"value of each stress, and the last value up to which it stays within {KEPT:g}",
        ["Stress", "Variant", "Precision", "First", "Last", f"Within {KEPT:g} up to"],
        rows,
        "lllrrl",
        folded=True,
        shown={SCENE: [limits.robot], VIEW: [task]},
        first=first == {SCENE: limits.robot, VIEW: task},
    )


def _ends(load: Load, curve: Curve) -> list[str]:
    ends = curve.worst[:1] + curve.worst[-1:]
    return ["refused" if worst is None else error_text(worst) for worst in ends]


def _reach(load: Load, curve: Curve) -> str:
    """The last value before the first that is refused or worse than that."""
    reach = "none"
    for value, worst in zip(load.values, curve.worst, strict=True):
        if worst is None or worst > KEPT:
            return reach
        reach = f"{value:g} {load.unit}"
    return reach
