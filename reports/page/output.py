"""Writes a file whole or not at all."""

import os
import tempfile
from pathlib import Path

from read.data import DataError


def write(path: Path, content: str | bytes) -> None:
    """A run that dies, or a full disk, leaves the old file or none."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
                os.fsync(handle)
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise
    except OSError as error:
        raise DataError(f"{path}: {error.strerror}") from None
