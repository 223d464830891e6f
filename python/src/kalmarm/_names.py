"""Names as users write them: exact ones, or shell patterns."""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")


def unknown(kind: str, name: str, known: Iterable[str]) -> ValueError:
    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0)
    return ValueError(f"{kind} '{name}' is unknown; nearest: {', '.join(near)}")


def several(option: str, given: Iterable[T]) -> tuple[T, ...]:
    """What an option lists. A string would be taken for a list of its letters."""
    if isinstance(given, (str, bytes)):
        raise TypeError(f"{option} is a string: a list is needed, {option}=[{given!r}]")
    return tuple(given)


def one_of(option: str, given: Any, known: tuple[str, ...]) -> str:
    if given not in known:
        raise ValueError(f"{option} '{given}' is unknown: {', '.join(known)}")
    name: str = given
    return name


def number(option: str, given: Any) -> float:
    try:
        return float(given)
    except (TypeError, ValueError):
        raise TypeError(f"{option} is {given!r}: a number is needed") from None


def numbers(what: str, given: Any) -> NDArray[np.float64]:
    """An array of any shape. Masks would be lost without a word."""
    if isinstance(given, np.ma.MaskedArray):
        raise TypeError(f"{what} is a masked array, and masks are not kept: give its filled()")
    return np.asarray(given, float)


def as_array(given: Any, dtype: Any = None) -> NDArray[Any]:
    """What lends its memory as an array of it, anything else as one of this dtype."""
    if isinstance(given, np.ndarray):
        return given
    if hasattr(given, "__dlpack__"):
        return np.from_dlpack(given)
    return np.asarray(given, dtype)


def dofs_of(names: list[str], chosen: Iterable[str | int]) -> list[int]:
    """Numbers of DoF, in rising order: of numbers, and of names, where "ball" stands for its DoF
    "ball:x", ... and "left_*" for all that match."""
    out: set[int] = set()
    for one in chosen:
        if not isinstance(one, str):
            out.add(int(one))
            continue
        found = {
            k
            for k, name in enumerate(names)
            if fnmatch.fnmatchcase(name, one) or name.startswith(one + ":")
        }
        if not found:
            raise unknown("joint", one, names)
        out |= found
    return sorted(out)
