"""The XML files that make one robot: a file, what it includes and what it attaches."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

TAG = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<[?!][^>]*>"  # no tags
    r"|<(?P<close>/?)(?P<name>[^\s/>=]+)(?P<rest>(?:[^>\"']|\"[^\"]*\"|'[^']*')*)>",
    re.DOTALL,
)
_FILE = re.compile(r"\sfile\s*=\s*(\"[^\"]*\"|'[^']*')")
_MOST_MODELS = 1000


@dataclass(frozen=True)
class ModelFile:
    path: Path
    text: str
    folder: Path  # of the model that it belongs to

    def included(self, tag: re.Match[str]) -> Path | None:
        """What an <include> names, if it is there: MuJoCo looks beside the model, and then beside
        this file."""
        if (tag["name"] or "").lower() != "include":
            return None
        return _beside(self.folder, tag) or _beside(self.path.parent, tag)

    def attached(self, tag: re.Match[str]) -> Path | None:
        """What a <model> to attach names, if it is there: beside the model."""
        return _beside(self.folder, tag) if tag["name"] == "model" else None


def model_files(path: Path) -> list[ModelFile]:
    """`path` and every file that MuJoCo's reader would open for it, each behind what names it.
    ValueError where a model attaches itself, where more than 1000 are attached, and where a file is
    none, such as a pipe: that reader crashes on the first, and waits for the last."""
    files: list[ModelFile] = []
    models = 0

    def model(path: Path, attached_by: tuple[Path, ...]) -> None:
        nonlocal models
        if path.resolve() in attached_by:
            raise ValueError(f"{path}: the model attaches itself")
        models += 1
        if models > _MOST_MODELS:
            raise ValueError(f"{path}: more than {_MOST_MODELS} models are attached")
        one(path, path.parent, (*attached_by, path.resolve()), {path.resolve()})

    def one(path: Path, folder: Path, attached_by: tuple[Path, ...], seen: set[Path]) -> None:
        if not path.is_file():
            raise ValueError(f"{path}: is not a file")
        file = ModelFile(path, path.read_text("utf-8", "surrogateescape"), folder)
        files.append(file)
        for tag in TAG.finditer(file.text):
            if inner := file.included(tag):
                if inner.resolve() not in seen:
                    seen.add(inner.resolve())
                    one(inner, folder, attached_by, seen)
            elif other := file.attached(tag):
                model(other, attached_by)

    model(path, ())
    return files


def _beside(folder: Path, tag: re.Match[str]) -> Path | None:
    named = _FILE.search(tag["rest"] or "")
    path = folder / named[1][1:-1] if named and len(named[1]) > 2 else None
    return path if path and path.exists() else None
