"""How it was measured: what a timed call includes, the machine, the tools."""

from pathlib import Path

from charts.text import time_text
from page.section import Section, Table
from read.data import Data
from summary.points import points

IN_WORDS = ("timed_call",)  # keys of the context that are prose, not a cell


def section(data: Data) -> Section | None:
    statements = [f"A timed call: {text}" for text in distinct(data.contexts, "timed_call")]
    statements += [
        f"A timed call of the paper’s recursions: {text}"
        for text in distinct(data.estimation_contexts, "timed_call")
    ]
    if repetitions := sorted({time.repetitions for time in data.all_times}):
        statements.append(f"Each time is the median of {_range(repetitions)} repetitions.")
    if states := sorted({point.states for point in points(data) if point.states}):
        statements.append(
            f"Each error is the median, or the largest, over {_range(states)} states."
        )
    if empty := [time.nanoseconds for time in data.harness if time.nanoseconds is not None]:
        statements.append(
            f"Timing a call that does nothing takes {time_text(max(empty))} or less. "
            "Every time contains it."
        )
    if "debug" in distinct(data.all_contexts, "library_build_type"):
        statements.append(
            "The benchmark library itself was built as debug. The code under test and the timing "
            "loop were not: they are compiled here, with the flags below. The library only reads "
            "the clock before and after a loop of calls."
        )
    keys = sorted({key for context in data.all_contexts for key in context if key not in IN_WORDS})
    table = Table(
        "What the benchmark recorded about itself. Where files differ, all their values stand.",
        ["Key", "Value"],
        [[key, _few(distinct(data.all_contexts, key))] for key in keys],
        "ll",
    )
    if not (keys or statements):
        return None
    return Section("How it was measured", tables=[table] if keys else [], statements=statements)


def distinct(contexts: list[dict], key: str) -> list[str]:
    """The values of a key over contexts, in words, each once."""
    values = {in_words(context[key]) for context in contexts if key in context}
    if key == "executable":  # pages are published: the folders of who made them stay out
        values = {Path(value).name for value in values}
    return sorted(values)


def in_words(value) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {in_words(item)}" for key, item in value.items())
    if isinstance(value, list):
        return "; ".join(map(in_words, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)


def _few(values: list[str]) -> str:
    if len(values) <= 4:
        return " | ".join(values)
    return f"{len(values)} values, from {values[0]} to {values[-1]}"


def _range(numbers: list[int]) -> str:
    return str(numbers[0]) if numbers[0] == numbers[-1] else f"{numbers[0]} to {numbers[-1]}"
