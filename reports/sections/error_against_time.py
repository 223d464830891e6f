"""Down and to the left is better. The line is the Pareto front of the marks shown: nothing shown is
both faster and more accurate than a mark on it. A variant that failed on some states is not on the
front; a cross at the top edge gives the share of failed states.

Select a name in the legend to switch it off, and again to bring it back. Point at a mark, or tap
it, for its numbers, or open the list below a chart.
"""

from charts import variants as variant_charts
from charts.common import SCENE
from charts.text import task_text
from page.section import Choice, Section
from read.data import Data, Time, scene_size
from sections.common import choose_view, style_of
from summary.groups import by_key
from summary.points import points


def section(data: Data) -> Section | None:
    drawn = [point for point in points(data) if point.time is not None and point.states]
    if not drawn:
        return None
    page = Section("Error against run time", __doc__, style_of(drawn))
    choose_view(page, drawn)
    panels = list(by_key(drawn, lambda point: point.name).values())
    panels.sort(key=lambda panel: (panel[0].name in data.families, panel[0].n, panel[0].name))
    for panel in panels:
        scenes = sorted({point.scene for point in panel}, key=scene_size)
        choice = Choice(SCENE, "N", scenes, _size, first=scenes[len(scenes) // 2])
        first = page.first | {SCENE: choice.first}
        name, several = panel[0].name, len(scenes) > 1
        page.figure(
            name if several else f"{name}, {panel[0].n} degrees of freedom",
            variant_charts.work_precision(panel, page.style, first),
            variant_charts.TOOLTIPS,
            [choice],
            _refusals([time for time in data.times if time.refused and time.scene in scenes]),
        )
    return page


def _size(scene: str) -> str:
    return str(scene_size(scene))


def _refusals(times: list[Time]) -> str:
    """One line, however many."""
    texts = [
        ", ".join(
            f"{it.variant} in {it.precision} ({task_text(it.task)}, {it.scene})" for it in own
        )
        + f": {reason}"
        for reason, own in by_key(times, lambda time: time.refused).items()
    ]
    return f"Not timed: {'; '.join(texts)}" if texts else ""
