"""Rows of a chart, and what their tooltips say."""

import altair as alt

from charts.common import short

TITLES = {  # of fields in tooltips, where a chart has no other: else their names
    "time_text": "median time",
    "variation": "variation of time",
    "error_text": "median error",
    "worst": "largest error",
    "worst_text": "largest error",
    "failures": "failed",
    "rate": "operations a second",
    "rate_text": "operations a second",
    "flops": "operations of a state",
    "links": "links of a block",
}


def titled(names: str, **others: str) -> dict[str, str]:
    """Fields of a tooltip, with their titles."""
    known = TITLES | others
    return {name: known.get(name, name.removesuffix("_text")) for name in names.split()}


def tooltip(titles: dict[str, str], kind: str = "N") -> list[alt.Tooltip]:
    return [alt.Tooltip(f"{name}:{kind}", title=title) for name, title in titles.items()]


def fields(it, *names: str) -> dict:
    """These of a record, for a row."""
    return {name: getattr(it, name) for name in names}


def numbers(text, **values: float | None) -> dict:
    """Of each name the number that places a mark, and the text that its tooltip shows."""
    places = {name: short(value) for name, value in values.items()}
    return places | {f"{name}_text": text(value) for name, value in values.items()}
