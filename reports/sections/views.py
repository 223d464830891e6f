"""The choice of task and measure that sections share."""

from charts.common import VIEW, view
from charts.text import measure_text, task_rank, task_text
from page.section import Choice
from summary.points import Point


def view_choice(points: list[Point]) -> Choice:
    """Known tasks first, in their order; within a task the relative error first."""

    def rank(pair):
        task, measure = pair
        return *task_rank(task), measure != "relative", measure

    pairs = sorted({(point.task, point.measure) for point in points}, key=rank)
    options = [
        (view(task, measure), f"{task_text(task)}: {measure_text(measure)}")
        for task, measure in pairs
    ]
    return Choice(VIEW, "Show", options, options[0][0])
