"""Error against run time: one panel a robot, one a family with a choice of N."""

from collections import defaultdict
from itertools import groupby

from charts import variants as variant_charts
from charts.common import SCENE, VIEW, Style
from charts.text import task_text
from page.section import Choice, Figure, Section
from read.data import Data, Time
from sections.views import view_choice
from summary.points import Point, points


def section(data: Data) -> Section | None:
    drawn = [point for point in points(data) if point.time is not None and point.states]
    if not drawn:
        return None
    views = view_choice(drawn)
    style = Style((p.variant for p in drawn), (p.precision for p in drawn))
    panels = [list(group) for _, group in groupby(drawn, key=lambda point: point.name)]
    panels.sort(key=lambda panel: (panel[0].name in data.families, panel[0].n, panel[0].name))
    return Section(
        "Error against run time",
        [
            "Down and to the left is better. The line is the Pareto front of the marks shown: "
            "nothing shown is both faster and more accurate than a mark on it. A variant that "
            "failed on some states is not on the front; a cross at the top edge gives the share "
            "of failed states.",
            "Select a name in the legend to switch it off, and again to bring it back. "
            "Point at a mark, or tap it, for its numbers, or open the list below a chart.",
        ],
        choices=[views],
        variants=style.variants,
        precisions=style.precisions,
        figures=[_panel(panel, style, views, data.times) for panel in panels],
    )


def _panel(panel: list[Point], style: Style, views: Choice, times: list[Time]) -> Figure:
    sizes = {point.scene: point.n for point in sorted(panel, key=lambda point: point.n)}
    middle = list(sizes)[len(sizes) // 2]
    scenes = Choice(SCENE, "N", [(scene, str(n)) for scene, n in sizes.items()], middle)
    several = len(sizes) > 1
    name = panel[0].name
    first = {VIEW: views.first, SCENE: scenes.first}
    return Figure(
        name if several else f"{name}, {panel[0].n} degrees of freedom",
        variant_charts.work_precision(panel, style, first),
        variant_charts.TOOLTIPS,
        choices=[scenes] if several else [],
        notes=_refusals([time for time in times if time.refused and time.scene in sizes]),
    )


def _refusals(times: list[Time]) -> list[str]:
    """One line, however many."""
    if not times:
        return []
    reasons = defaultdict(list)
    for time in times:
        series = f"{time.variant} in {time.precision} ({task_text(time.task)}, {time.scene})"
        reasons[time.refused].append(series)
    texts = (f"{', '.join(series)}: {reason}" for reason, series in reasons.items())
    return [f"Not timed: {'; '.join(texts)}"]
