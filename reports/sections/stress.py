"""The robot is made harder in one way at a time; at each value the worst configuration is searched
for, not sampled. Refused: every answer was called singular or not finite.
"""

from charts import advice as advice_charts
from charts.common import SCENE, VIEW
from charts.text import error_text, sentence, task_text
from page.section import Section, left, right
from read.advice import ADVISED, Curve, Limits, Load
from read.data import Data, scene_name
from sections.common import SERIES, style_of

KEPT = 1e-3  # three digits


def section(data: Data) -> Section | None:
    found = [it for it in data.limits if it.loads]
    if not found:
        return None
    present = {task for it in found for load in it.loads for task in load.curves}
    tasks = [task for task in ADVISED if task in present]
    rows = {}
    for it in found:
        for i, load in enumerate(it.loads):
            rows.setdefault((load.title, load.unit), []).extend(advice_charts.load_rows(it, i))
    of_one = sentence(found[0].sentence) if len(found) == 1 else ""
    page = Section(
        "Stress of the robot" if of_one else "Stress of the robots",
        [__doc__, of_one],
        style_of(row for own in rows.values() for row in own),
    )
    page.choose(SCENE, "Robot", [it.robot for it in found], scene_name)
    page.choose(VIEW, "Task", tasks, task_text)
    for (title, unit), own in rows.items():
        if own:
            chart = advice_charts.against_load(own, page.style, page.first, unit)
            page.figure(title, chart, advice_charts.LOAD_TOOLTIPS)
    for it in found:
        for task in tasks:
            _table(page, it, task)
    return page


def _table(page: Section, limits: Limits, task: str) -> None:
    def worst(error: float | None) -> str:
        return "refused" if error is None else error_text(error)

    page.table(
        f"""{scene_name(limits.robot)}, {task_text(task)}: worst error at the first and the last
        value of each stress, and the last value up to which it stays within {KEPT:g}""",
        [
            left("Stress", lambda _, load: load.title),
            SERIES,
            right("First", lambda curve, _: worst(curve.worst[0])),
            right("Last", lambda curve, _: worst(curve.worst[-1])),
            left(f"Within {KEPT:g} up to", _reach),
        ],
        [(curve, load) for load in limits.loads for curve in load.curves.get(task, [])],
        folded=True,
        shown={SCENE: limits.robot, VIEW: task},
    )


def _reach(curve: Curve, load: Load) -> str:
    """The last value before the first that is refused or worse than that."""
    reach = "none"
    for value, worst in zip(load.values, curve.worst, strict=True):
        if worst is None or worst > KEPT:
            return reach
        reach = f"{value:g} {load.unit}"
    return reach
