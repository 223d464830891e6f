#!/usr/bin/env python3
"""Doxygen's input filter: plain comments of a header become documentation. Lines that are indented, which are equations and
code, keep their layout; so does what the header opens with.

Usage: comments.py HEADER
"""

import re
import sys
from html import escape
from itertools import groupby
from pathlib import Path

COMMENT = re.compile(r"^ *//(?!/) ?(.*)$")
TRAILING = re.compile(r"^(?=\s*[^\s/])(.*?[;,{}]|.*\w) +// (.*)$")
LINT = re.compile(r"NOLINT|^ *--- ")


def documentation(lines: list[str], whole: bool) -> list[str]:
    out = []
    for laid_out, some in groupby(lines, lambda line: whole or line.startswith("  ")):
        out += ["@code{.txt}", *some, "@endcode"] if laid_out else [escape(line, quote=False) for line in some]
    return out


def filtered(text: str) -> str:
    out = []
    opened = False
    for is_comment, group in groupby(text.splitlines(), lambda line: bool(COMMENT.match(line))):
        lines = list(group)
        if is_comment:
            told = [COMMENT.match(line)[1] for line in lines]
            told = [line for line in told if not LINT.search(line)]
            if told:
                name = [] if opened else ["@file"]
                out += ["/**", *name, *documentation(told, not opened), "*/"]
            opened = True
        else:
            out += [TRAILING.sub(r"\1 ///< \2", line) for line in lines]
    return "\n".join(out) + "\n"


if __name__ == "__main__":
    print(filtered(Path(sys.argv[1]).read_text(encoding="utf-8")), end="")
