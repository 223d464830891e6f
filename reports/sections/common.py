"""What several sections need: records by a key, their legend, the choice of task and measure."""

from types import SimpleNamespace

from charts.common import VIEW, Style, view
from charts.text import measure_text, task_rank, task_text, time_text
from page.section import Section, left
from read.data import Time
from summary.groups import by_key
from summary.points import Point


def style_of(records) -> Style:
    """Of the variants and precisions of records, or of a chart's rows."""
    pairs = [
        (it["variant"], it["precision"]) if isinstance(it, dict) else (it.variant, it.precision)
        for it in records
    ]
    return Style((variant for variant, _ in pairs), (precision for _, precision in pairs))


def choose_view(page: Section, points: list[Point]) -> None:
    """Of task and measure: known tasks first, in their order; within a task the relative error."""

    def rank(pair):
        task, measure = pair
        return *task_rank(task), measure != "relative", measure

    texts = {
        view(task, measure): f"{task_text(task)}: {measure_text(measure)}"
        for task, measure in sorted({(point.task, point.measure) for point in points}, key=rank)
    }
    page.choose(VIEW, "Show", texts, texts.get)


def named(names: list[str], most: int) -> str:
    """The first of them, and how many more there are."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def spaced(name: str) -> str:
    return name.replace("_", " ")


def from_to(values, text=str) -> str:
    """The least and the greatest, once where they are written alike."""
    return " to ".join(dict.fromkeys(map(text, (min(values), max(values)))))


def call_text(time: Time) -> str:
    """In the cell of a table that says below it what was refused."""
    return "refused" if time.refused else time_text(time.nanoseconds)


def ratio(one: float | None, other: float | None) -> float | None:
    """None where either is absent or zero."""
    return one / other if one and other else None


def seconds_text(seconds: float) -> str:
    return time_text(1e9 * seconds)


class Group(SimpleNamespace):
    """Records that have something in common: its parts are attributes, and `own` is a list."""


def groups(records, *names: str) -> list[Group]:
    """By these attributes, in the order in which their values occur."""
    keys = by_key(records, lambda it: tuple(getattr(it, name) for name in names))
    return [Group(**dict(zip(names, key, strict=True)), own=own) for key, own in keys.items()]


SERIES = [left("Variant", "variant"), left("Precision", "precision")]  # of a record
