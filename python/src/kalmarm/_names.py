"""Names as users write them: exact ones, or shell patterns."""

from __future__ import annotations

import difflib
import fnmatch
from collections.abc import Iterable


def unknown(kind: str, name: str, known: Iterable[str]) -> ValueError:
    near = difflib.get_close_matches(name, list(known), n=3, cutoff=0)
    return ValueError(f"{kind} '{name}' is unknown; nearest: {', '.join(near)}")


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
