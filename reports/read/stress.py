"""The records of the program `stress`: up to a million rows, so they are kept by columns."""

from typing import Annotated, NamedTuple

import numpy as np
from pydantic import BeforeValidator

from read.values import Count, Number, Precision, record

TEXTS = ("family", "precision", "task", "variant", "status", "warning")
COLUMNS = (
    "family,value,n,seed,precision,task,kappa,kappa_scaled,kS,variant,status,warning,relative,"
    "energy,componentwise,backward,oettli_prager,eta,estimate,unrefined,steps,widened,"
    "P_min,P_constraint,P_asymmetry"
).split(",")
KEY = ("family", "value", "n", "seed", "precision", "task", "variant")
U = {"float32": 2.0**-24, "float64": 2.0**-53}  # unit roundoff
WRONG = 0.01  # a relative error above is no answer
WILD = "wild"  # the kind of families drawn at random
Said = Annotated[str, BeforeValidator(lambda text: "" if text is None else text)]


@record
class Family(NamedTuple):
    """What a family of mechanisms is; `singular`: exactly singular where its parameter is 0."""

    name: Said
    kind: Said  # such as "heavy_outboard" (FamilyKind in accuracy/stress/families.hpp)
    parameter: Said
    describes: Said
    singular: bool


@record
class Variant(NamedTuple):
    """What a variant is and can do (algorithms/study/variant_traits.hpp)."""

    name: Said
    equation: Said
    kind: Said  # what factors M: such as "sequential"
    contender: bool  # one to choose, else an exhibit of the laboratory
    in_world_frame: bool
    dense: bool
    mixed_precision: bool
    citation: Said


@record
class Described(NamedTuple):
    """What `stress --list` writes."""

    families: list[Family]
    variants: list[Variant]


@record
class Integration(NamedTuple):
    """Calls of the right-hand side that an adaptive integrator made over a fixed time."""

    family: str
    value: Number
    n: Count
    seed: Count
    precision: Precision
    variant: str
    calls: Count
    finished: bool
    energy_drift: Annotated[float, BeforeValidator(lambda cell: cell or "nan")]


class Stress:
    """Rows by columns: numbers as they are, texts as places in a list of names."""

    def __init__(self, columns: dict | None = None, names: dict | None = None):
        self.columns = columns or {
            name: np.empty(0, np.int32 if name in TEXTS else float) for name in COLUMNS
        }
        self.names = names or {name: {} for name in TEXTS}

    def __len__(self) -> int:
        return len(self.columns["relative"])

    def __getitem__(self, column: str) -> np.ndarray:
        return self.columns[column]

    def codes(self, column: str, texts) -> np.ndarray:
        """The places of these names, new ones added."""
        names = self.names[column]
        return np.array([names.setdefault(text, len(names)) for text in texts], np.int32)

    def add(self, blocks: list[dict]) -> None:
        """Appends blocks of columns, whose texts are `codes` of this object."""
        self.columns = {
            name: np.concatenate([self.columns[name], *(block[name] for block in blocks)])
            for name in COLUMNS
        }

    def rows(self, mask: np.ndarray) -> "Stress":
        return Stress({name: values[mask] for name, values in self.columns.items()}, self.names)

    def where(self, **wanted) -> "Stress":
        """The rows whose texts are as wanted: one name, or any of a collection."""
        mask = np.ones(len(self), bool)
        for column, texts in wanted.items():
            texts = {texts} if isinstance(texts, str) else texts
            places = [self.names[column][text] for text in texts if text in self.names[column]]
            mask &= np.isin(self[column], places)
        return self.rows(mask)

    def texts(self, column: str) -> np.ndarray:
        """The column's texts themselves, one a row."""
        return np.array(list(self.names[column]), object)[self[column]]

    def present(self, column: str) -> list[str]:
        """The names that occur."""
        names = list(self.names[column])
        return sorted(names[place] for place in np.unique(self[column]))

    @property
    def u(self) -> np.ndarray:
        """Unit roundoff of each row."""
        return np.array([U[name] for name in self.names["precision"]])[self["precision"]]

    def _is(self, column: str, text: str) -> np.ndarray:
        return self[column] == self.names[column].get(text, -1)

    @property
    def ok(self) -> np.ndarray:
        return self._is("status", "ok")

    @property
    def wrong(self) -> np.ndarray:
        """An answer that is none, warned of or not."""
        return self.ok & (self["relative"] > WRONG)

    @property
    def silent(self) -> np.ndarray:
        """Wrong, and nothing said so."""
        return self.wrong & self._is("warning", "")

    def order(self, columns) -> tuple[np.ndarray, np.ndarray]:
        """The rows sorted by these columns, and where in that order a new group starts."""
        order = np.lexsort([self[column] for column in reversed(columns)])
        new = np.zeros(len(order), bool)
        new[:1] = True
        for column in columns:
            values = self[column][order]
            new[1:] |= values[1:] != values[:-1]
        return order, new

    def repeated(self) -> str:
        """The first key that stands twice, or nothing."""
        order, new = self.order(KEY)
        twice = order[~new]
        if not len(twice):
            return ""
        row = self.rows(twice[:1])
        texts = (row.texts(c)[0] if c in TEXTS else f"{row[c][0]:g}" for c in KEY)
        return "/".join(texts)
