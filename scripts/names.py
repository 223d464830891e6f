"""Names of robots' files: they stand in data, on the page and in terminals."""

import re
from pathlib import Path

# Control characters, and bytes that are not UTF-8.
UNFIT = re.compile(r"[\x00-\x1f\x7f-\x9f\ud800-\udfff]")


def fault_of_name(file: Path) -> str:
    """Why the file cannot be measured under its name, in a line; empty: it can."""
    for name in (file.name, file.resolve().name):
        if UNFIT.search(name):
            return f"{str(file)!a}: the file's name has a control character or is not UTF-8"
    return ""
