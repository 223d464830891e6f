"""What a part of the page is made of. Cells are text, or `Markup` where a tag is meant.

Text may go over several lines; an empty line ends a paragraph. What is empty is left out.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import InitVar, dataclass, field
from functools import partial
from operator import attrgetter
from typing import NamedTuple

from charts.common import Style
from charts.groups import grouped

ABSENT = "–"


class Verdict(NamedTuple):
    """A table cell that passes or fails, said in words as well as in colour."""

    good: bool

    def __str__(self) -> str:
        return "✓ pass" if self.good else "✗ fail"


def plain(value):
    """As it stands: markup and verdicts are the template's."""
    return value if isinstance(value, str | Verdict) else str(value)


What = str | Callable  # the name of an attribute, or a function


class Column(NamedTuple):
    """What a table says of each record. Of a plain tuple an attribute is that of its first part,
    and all parts are a function's arguments."""

    align: str  # l, r or, for a formula, f: its class in the style sheet
    title: str
    what: What
    text: Callable = plain  # how the page writes a value; None is a dash

    def cell(self, record):
        value = _value(self.what, _parts(record))
        return ABSENT if value is None else plain(self.text(value))


def _parts(record) -> tuple:
    return record if type(record) is tuple else (record,)


def _value(what: What, parts: tuple):
    return attrgetter(what)(parts[0]) if isinstance(what, str) else what(*parts)


left, right, formula = (partial(Column, align) for align in "lrf")


def of(find: What, *columns: Column) -> list[Column]:
    """These columns of what belongs to a record; dashes where that is None."""

    def cell(column: Column, *parts):
        other = _value(find, parts)
        return None if other is None else column.cell(other)

    return [column._replace(what=partial(cell, column), text=plain) for column in columns]


@dataclass
class Table:
    """A row a record; `remark` says of a record what stands below its row, if anything, and
    `last` what stands below all."""

    caption: str
    columns: list[Column]  # or lists of these, side by side
    records: InitVar[Iterable]
    remark: InitVar[Callable] = lambda *_: ""
    last: InitVar[str] = ""
    folded: bool = False
    shown: dict = field(default_factory=dict)  # only while the choices are these, or among these
    stays: bool = False  # even without rows
    style: str = ""  # a class of the style sheet
    first: bool = True  # whether it is shown at first

    def __post_init__(self, records, remark, last):
        self.caption = folded(self.caption)
        self.columns = list(_flat(self.columns))
        self.rows = []
        for record in records:
            self.rows.append([column.cell(record) for column in self.columns])
            if said := remark(*_parts(record)):
                self.rows.append([said])
        if last:
            self.rows.append([last])


def _flat(columns: list) -> Iterator[Column]:
    for it in columns:
        if isinstance(it, Column):
            yield it
        elif it:
            yield from _flat(it)


@dataclass
class Choice:
    """One of several things to show; `signal` is the charts' parameter that it sets."""

    signal: str
    label: str
    values: InitVar[Iterable]
    text: InitVar[Callable] = str  # what the page writes for a value
    first: str = ""  # else the first of the values
    slider: bool = False  # of values in order

    def __post_init__(self, values, text):
        self.options = [(str(value), text(value)) for value in values]
        self.first = self.first or next((value for value, _ in self.options), "")


def first_of(choices: list[Choice]) -> dict[str, str]:
    """What charts show at first."""
    return {choice.signal: choice.first for choice in choices}


def several(choices: list[Choice]) -> list[Choice]:
    """Those that leave something to choose."""
    return [choice for choice in choices if len(choice.options) > 1]


@dataclass
class Figure:
    title: str
    chart: object  # altair chart
    columns: dict[str, str]  # the fields of its rows that the list of numbers shows; their titles
    choices: list[Choice] = field(default_factory=list)
    notes: list[str] | str = ""
    table: str = ""  # what the list of numbers is called where it is unfolded at first

    def __post_init__(self):
        self.choices = several(self.choices)
        self.notes = paragraphs(self.notes)


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
    """Choices and legend act on every figure of the section, and on its answers and tables. It is
    built from above: tables and answers come after the choices that they depend on."""

    title: str
    paragraphs: list[str] | str = ""
    style: Style = field(default_factory=lambda: Style([], []))  # its variants are the legend
    opened: bool = False  # at first
    wide: bool = False  # figures below the answers, not beside them
    statements: list[str] = field(default_factory=list)  # a list of points
    choices: list[Choice] = field(default_factory=list)
    first: dict[str, str] = field(default_factory=dict)  # what its choices are at first
    figures: list[Figure] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)

    def __post_init__(self):
        self.paragraphs = paragraphs(self.paragraphs)

    def say(self, *points: str | None) -> None:
        self.statements += paragraphs(points)

    def choose(self, *choice, **options) -> None:
        it = Choice(*choice, **options)
        self.first[it.signal] = it.first
        self.choices += several([it])

    def figure(self, *figure, **options) -> None:
        self.figures.append(Figure(*figure, **options))

    def table(self, *table, **options) -> None:
        it = Table(*table, **options)
        if it.rows or it.stays:
            it.first = self._shows(it.shown)
            self.tables.append(it)

    def answer(self, *answer, **options) -> None:
        it = Answer(*answer, **options)
        it.first = self._shows(it.shown)
        self.answers.append(it)

    def _shows(self, shown: dict) -> bool:
        """Whether its choices are these, or among these, at first."""
        return all(
            self.first.get(signal) in ([values] if isinstance(values, str) else values)
            for signal, values in shown.items()
        )

    @property
    def slug(self) -> str:
        return slug(self.title)

    @property
    def variants(self) -> list[str]:
        return self.style.variants

    @property
    def precisions(self) -> list[str]:
        return self.style.precisions

    @property
    def legend(self) -> dict[str, list[str]]:
        """Its variants by group."""
        return grouped(self.variants)


def paragraphs(text: list[str] | str) -> list[str]:
    """Of a text, or of several."""
    parts = [text] if isinstance(text, str) else filter(None, text)
    split = [type(part)(it) for part in parts for it in re.split(r"\n\s*\n", part)]
    return [folded(it) for it in split if it.strip()]


def folded(text: str) -> str:
    """In one line, as text or markup."""
    return type(text)(re.sub(r"\s*\n\s*", " ", text.strip()))


def slug(title: str) -> str:
    """What an address calls it."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")
