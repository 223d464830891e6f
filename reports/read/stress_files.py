"""Reads what the program `stress` recorded, and refuses what is no such record."""

import csv
import math
from itertools import islice
from pathlib import Path

import numpy as np

from read.checks import name_of, opened
from read.data import DataError
from read.stress import COLUMNS, TEXTS, U
from read.values import MOST

STATUSES = ("ok", "singular", "indefinite", "not_finite")
WARNINGS = ("", "near_singular", "inaccurate")
SIGNED = ("value", "P_min", "P_constraint", "P_asymmetry")
WHOLE = ("n", "seed", "steps", "widened")
NEEDED = ("value", "n", "seed")
BLOCK = 20_000  # rows at a time


def read_rows(path: Path, stress) -> None:
    """Adds a shard to `stress`. Whole columns are checked at a time; a bad row is then sought."""
    with opened(path) as file:
        reader = csv.reader(file)
        if next(reader, None) != COLUMNS:
            raise DataError(f"{path}: header is not {','.join(COLUMNS)}")
        blocks = []
        first = reader.line_num + 1
        while rows := list(islice(reader, BLOCK)):
            try:
                blocks.append(_block(rows, stress))
            except ValueError:
                raise _refusal(path, first, rows, stress) from None
            first = reader.line_num + 1
        stress.add(blocks)


def _block(rows: list[list[str]], stress) -> dict:
    """The columns of some rows; ValueError if one of them is malformed."""
    if any(len(row) != len(COLUMNS) for row in rows):
        raise ValueError(f"not {len(COLUMNS)} values")
    texts = dict(zip(COLUMNS, zip(*rows)))
    families = {cell: name_of(cell) for cell in set(texts["family"])}
    texts["family"] = [families[cell] for cell in texts["family"]]
    block = {}
    for name, column in texts.items():
        if name in TEXTS:
            block[name] = stress.codes(name, column)
        else:
            block[name] = np.array([float(text) if text else math.nan for text in column])
    _check_texts(texts)
    _check_numbers(block, np.array([text == "ok" for text in texts["status"]]))
    return block


def _check_texts(texts: dict) -> None:
    for name, known in (("precision", U), ("status", STATUSES), ("warning", WARNINGS)):
        if unknown := set(texts[name]) - set(known):
            raise ValueError(f"{name} '{min(unknown)}' is none of {', '.join(filter(None, known))}")
    for name in ("family", "task", "variant"):
        if "" in texts[name]:
            raise ValueError(f"{name} is empty")


def _check_numbers(block: dict, ok: np.ndarray) -> None:
    for name in NEEDED:
        if not np.isfinite(block[name]).all():
            raise ValueError(f"{name} is not finite")
    for name in WHOLE:
        values = block[name][~np.isnan(block[name])]
        if (values != np.floor(values)).any() or (values > MOST).any():
            raise ValueError(f"{name} is no whole number up to {MOST}")
    for name in COLUMNS:
        if name not in TEXTS and name not in SIGNED and (block[name] < 0).any():
            raise ValueError(f"{name} is negative")
    missing = np.isnan(block["relative"])
    if (missing & ok & (block["value"] != 0)).any():  # at 0 a mechanism may have no right answer
        raise ValueError("status is ok, and relative is no number")
    if (~missing & ~ok).any():
        raise ValueError("status is not ok, and relative is a number")


def _refusal(path: Path, first: int, rows: list[list[str]], stress) -> DataError:
    """What is wrong with the first malformed row."""
    for number, row in enumerate(rows, first):
        try:
            _block([row], stress)
        except ValueError as error:
            return DataError(f"{path}:{number}: {error}")
    raise AssertionError("no row is malformed by itself")
