"""What a part of the page is made of. Cells are text, or `Markup` where a tag is meant."""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from charts.groups import grouped


class Verdict(NamedTuple):
    """A table cell that passes or fails, said in words as well as in colour."""

    good: bool

    def __str__(self) -> str:
        return "✓ pass" if self.good else "✗ fail"


@dataclass
class Table:
    caption: str
    columns: list[str]
    rows: list[list]  # one cell alone is a remark on the row above
    align: str  # one letter a column: l, r or, for a formula, f
    folded: bool = False
    shown: dict = field(default_factory=dict)  # only while the choices are these, or among these
    first: bool = True  # whether they are so at first
    style: str = ""  # a class of the style sheet


@dataclass
class Choice:
    """One of several things to show; `signal` is the charts' parameter that it sets."""

    signal: str
    label: str
    options: list[tuple[str, str]]  # value and what the page writes for it
    first: str
    slider: bool = False  # of values in order


@dataclass
class Figure:
    title: str
    chart: object  # altair chart
    columns: dict[
        str, str
    ]  # the fields of its rows that the list of numbers shows, and their titles
    choices: list[Choice] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    table: str = ""  # what the list of numbers is called where it is unfolded at first


@dataclass
class Answer:
    """What to take: sentences, numbers under their names, and code that does it."""

    sentences: list[str]
    numbers: list[tuple[str, str]] = field(default_factory=list)
    code: str = ""
    leads: bool = False  # whether the first sentence is the one to read
    shown: dict = field(default_factory=dict)
    first: bool = True


@dataclass
class Section:
    """Choices and legend act on every figure of the section, and on its answers and tables."""

    title: str
    paragraphs: list[str] = field(default_factory=list)
    statements: list[str] = field(default_factory=list)  # a list of points
    choices: list[Choice] = field(default_factory=list)
    variants: list[str] = field(default_factory=list)  # legend entries, with precisions
    precisions: list[str] = field(default_factory=list)
    coloured: list[str] = field(default_factory=list)  # variants with colours, but without a legend
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    opened: bool = False  # at first
    wide: bool = False  # figures below the answers, not beside them

    @property
    def slug(self) -> str:
        return slug(self.title)

    @property
    def legend(self) -> dict[str, list[str]]:
        """Its variants by group."""
        return grouped(self.variants)


def slug(title: str) -> str:
    """What an address calls it."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
