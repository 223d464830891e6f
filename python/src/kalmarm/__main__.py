"""`kalmarm PROGRAM ARGUMENT…`, also `python -m kalmarm`: programs of the suite, and the page of a robot.

The programs are one executable of the wheel. It takes MuJoCo's library from the package `mujoco`.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from typing import NoReturn

from . import __version__, _core, instruction_set

FOLDER = Path(__file__).parent
COMMAND = FOLDER / "programs" / "kalmarm_command"  # of scripts/cmake/KalmarmCommand.cmake
PROGRAMS = {  # the first is not in COMMAND: Python's part of the suite calls programs that are there
    "report": "a page: errors against times, and which tolerance is enough",
    "recommend": "which tolerance is enough, measured on the robot",
    "limits": "digits left in a robot's worst states",
    "evaluate": "one variant on given or random states, as JSON",
    "compare": "every variant against MuJoCo",
    "plan": "what a question needs of a robot",
    "generate": "C code for one robot",
}
LONG = {"compare": "compare_mujoco"}  # names in COMMAND that differ from ours
ABSENT = {
    "identify": "Ceres, by which it fits, brings parts of SuiteSparse that are under the GPL",
    "Batch<OpenBLAS>": "OpenBLAS has 35 MB",
}
DRAWING = ("altair", "jinja2", "numpy", "scipy", "vl_convert")  # what reports/ imports
READING = (
    "--floating",
    "--inertia=",
    "--urdf-inertia=",
    "--armature=",
    "--package-path=",
    "--key=",
)
REPORT = """usage: kalmarm report [--quick|--full] [--out=FOLDER] [OPTION…] ROBOT…

Measures robots, each an MJCF or URDF file, and writes FOLDER/index.html, kalmarm-report unless told:
errors against times, and which tolerance is enough. What is measured already is kept.

--floating[=LINK], --inertia=balanced, --urdf-inertia=none, --armature=FILE, --package-path=DIR and
--key=NAME say how files are read."""


def main() -> int:
    name, *arguments = sys.argv[1:] or ["--help"]
    if name == "--version":
        print(__version__)
        return 0
    if not COMMAND.exists():
        _fail("this build of kalmarm has no programs: take a wheel, which scripts/wheel makes")
    if name in ("--help", "-h"):
        print(_help())
        return 0
    if name in ABSENT:
        _fail(f"no wheel has {name}, since {ABSENT[name]}; a clone has: scripts/build {name}")
    if name not in PROGRAMS:
        _fail(f"no program '{name}': one of {', '.join(PROGRAMS)}")
    try:
        instruction_set()
    except RuntimeError as error:  # COMMAND itself would end by an illegal instruction
        _fail(str(error).removeprefix("kalmarm: "))
    if name == "report":
        return _report(arguments)
    os.execve(COMMAND, [str(COMMAND), LONG.get(name, name), *arguments], _environment())


def _fail(reason: str) -> NoReturn:
    print(f"kalmarm: error: {reason}", file=sys.stderr)
    raise SystemExit(2)


def _help() -> str:
    width = max(map(len, PROGRAMS))
    programs = "\n".join(f"  {name:{width}}  {does}" for name, does in PROGRAMS.items())
    absent = "; ".join(f"{name} ({why})" for name, why in ABSENT.items())
    return (
        f"usage: kalmarm PROGRAM ARGUMENT…    with --help: of the program\n\n{programs}\n\n"
        f"Programs need MuJoCo: pip install 'kalmarm[robots]'; report needs 'kalmarm[report]'.\n"
        f"In a clone alone: {absent}."
    )


def _environment() -> dict[str, str]:
    """Ours, with the folder of the `libmujoco.so` that the programs were built for."""
    found = importlib.util.find_spec("mujoco")
    folders = found.submodule_search_locations if found else None
    built = _core.mujoco_version
    needed = f"programs read robots through MuJoCo {built}: pip install mujoco=={built}"
    if not folders:
        _fail(f"{needed}, or 'kalmarm[robots]'")
    if not Path(folders[0], f"libmujoco.so.{built}").exists():
        _fail(f"{needed}, in place of the one that is installed")
    paths = [folders[0], os.environ.get("LD_LIBRARY_PATH", "")]
    return {**os.environ, "LD_LIBRARY_PATH": ":".join(filter(None, paths))}


def _report(arguments: list[str]) -> int:
    if not arguments or {"--help", "-h"} & set(arguments):
        print(REPORT)
        return 0 if arguments else 2
    lacking = [name for name in DRAWING if not importlib.util.find_spec(name)]
    if lacking:
        _fail(f"report draws with {', '.join(lacking)}: pip install 'kalmarm[report]'")
    passed = ["--out=kalmarm-report"]
    for one in arguments:
        if one.startswith("-") and not one.startswith(("--quick", "--full", "--out=", *READING)):
            _fail(f"report has no option {one}")
        passed.append(f"--read={one}" if one.startswith(READING) else one)
    if all(one.startswith("-") for one in passed):
        _fail("report needs a robot's file")
    script = FOLDER / "_suite" / "scripts" / "measure"
    command = [sys.executable, str(script), f"--bin={COMMAND}", *passed]
    os.execve(sys.executable, command, _environment())


if __name__ == "__main__":
    sys.exit(main())
