"""What only a renderer, a collision checker or a middleware reads of a robot's file."""

from __future__ import annotations

import re
from collections.abc import Callable

from ._model_files import TAG, ModelFile

_DRAWN_IN_URDF = {"visual", "material", "gazebo", "transmission"}
_DRAWN_IN_MJCF = {"visual", "material", "texture", "light", "camera"}


def without_drawn_parts(text: str) -> str:
    """The text with such elements blanked out, and its lines as they are."""
    root = next((tag["name"] for tag in TAG.finditer(text) if tag["name"]), "")
    drawn = _DRAWN_IN_URDF if root == "robot" else _DRAWN_IN_MJCF
    text = _without_elements(text, lambda tag: tag["name"] in drawn)
    if root != "robot":
        return text
    weightless = _weightless_collisions(text)
    return _without_elements(text, lambda tag: tag.start() in weightless)


def _weightless_collisions(text: str) -> set[int]:
    """Where a URDF's collisions begin that weigh nothing, since their link has an inertia."""
    if re.search(r"""inertiafromgeom\s*=\s*["']true["']""", text):
        return set()
    found: set[int] = set()
    of_link: set[int] = set()
    has_inertia = False
    for tag in TAG.finditer(text):
        if tag["name"] == "link":
            if tag["close"] and has_inertia:
                found |= of_link
            of_link, has_inertia = set(), False
        elif tag["name"] == "inertial":
            has_inertia = True
        elif tag["name"] == "collision" and not tag["close"]:
            of_link.add(tag.start())
    return found


def all_without_drawn_parts(files: list[ModelFile]) -> dict[str, str]:
    """By path. What includes a file of which nothing is left does so no more: MuJoCo's reader
    refuses empty ones."""
    texts: dict[str, str] = {}
    empty: set[str] = set()
    for file in reversed(files):  # from what is included

        def includes_nothing(tag: re.Match[str], file: ModelFile = file) -> bool:
            return str(file.included(tag)) in empty

        text = _without_elements(without_drawn_parts(file.text), includes_nothing)
        texts[str(file.path)] = text
        if sum(1 for tag in TAG.finditer(text) if tag["name"] and not tag["close"]) < 2:
            empty.add(str(file.path))
    return texts


def _without_elements(text: str, unwanted: Callable[[re.Match[str]], bool]) -> str:
    parts: list[str] = []  # of the result
    kept, depth = 0, 0  # text up to `kept` is done
    first: re.Match[str] | None = None  # of the element that is left out
    for tag in TAG.finditer(text):
        if not tag["name"]:
            continue
        closes, alone = bool(tag["close"]), tag["rest"].endswith("/")
        begin = tag.start()
        if first is None:
            if closes or not unwanted(tag):
                continue
            if not alone:
                first, depth = tag, 1
                continue
        elif tag["name"] != first["name"] or alone:
            continue
        else:
            depth += -1 if closes else 1
            if depth > 0:
                continue
            begin, first = first.start(), None
        parts.append(text[kept:begin] + re.sub(r"[^\r\n]", " ", text[begin : tag.end()]))
        kept = tag.end()
    return "".join(parts) + text[kept:]
