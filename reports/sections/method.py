"""How it was measured: what a timed call includes, the machine, the tools."""

from pathlib import Path

from charts.text import time_text
from page.section import Section, left
from read.data import Data
from sections.common import from_to
from summary.points import points

IN_WORDS = ("timed_call",)  # keys of the context that are prose, not a cell


def section(data: Data) -> Section | None:
    contexts = data.all_contexts
    repetitions = {time.repetitions for time in data.all_times}
    states = {point.states for point in points(data) if point.states}
    empty = [time.nanoseconds for time in data.harness if time.nanoseconds is not None]
    keys = sorted({key for context in contexts for key in context if key not in IN_WORDS})
    page = Section("How it was measured")
    page.say(
        *timed_calls(data.contexts),
        *timed_calls(data.estimation_contexts, " of the paper’s recursions"),
        repetitions and f"Each time is the median of {from_to(repetitions)} repetitions.",
        states and f"Each error is the median, or the largest, over {from_to(states)} states.",
        empty
        and f"""Timing a call that does nothing takes {time_text(max(empty))} or less. Every time
        contains it.""",
        "debug" in distinct(contexts, "library_build_type")
        and """The benchmark library itself was built as debug. The code under test and the timing
        loop were not: they are compiled here, with the flags below. The library only reads the
        clock before and after a loop of calls.""",
    )
    page.table(
        "What the benchmark recorded about itself. Where files differ, all their values stand.",
        [left("Key", str), left("Value", lambda key: _few(distinct(contexts, key)))],
        keys,
    )
    return page if page.statements or page.tables else None


def timed_calls(contexts: list[dict], of: str = "") -> list[str]:
    """What benchmarks say that a call includes."""
    return [f"A timed call{of}: {text}" for text in distinct(contexts, "timed_call")]


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
