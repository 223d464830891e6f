"""Known defects: older versions in which they live, and whether a check finds them there and in
today's version: `scripts/engines --defects`.

A check is a file of defects/, run in an environment of the engine's: it prints {"version",
"error"}. A defect is found where the error is above the limit, which is far above what rounding
costs the check.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import environments
import records
from environments import LOCKS, ROOT, Missing

HERE = Path(__file__).resolve().parent / "defects"
OUT = ROOT / "reports" / "out" / "engines" / "defects.csv"
COLUMNS = "defect,version,known,error,limit,found,outcome".split(",")


class Defect(NamedTuple):
    name: str
    check: str  # defects/CHECK.py
    old: str  # the environment that has it: locks/defects/OLD.in
    today: str  # engine
    limit: float
    mended: bool = True  # in today's version


class Asked(NamedTuple):
    version: str
    error: float | None
    outcome: str = "ok"


DEFECTS = [
    Defect("MuJoCo #3767", "mujoco_3767", "mujoco-4.0.0", "mujoco", 1e-4),
    Defect("MuJoCo Warp #1662", "mujoco_warp_1662", "mujoco_warp-3.13.0", "mujoco_warp", 1e-3),
    Defect("MuJoCo Warp #1334", "mujoco_warp_1334", "mujoco_warp-3.8.0", "mujoco_warp", 1e-3),
    Defect(
        "MuJoCo Warp #1415",
        "mujoco_warp_1415",
        "mujoco_warp-3.13.0",
        "mujoco_warp",
        1e-2,
        mended=False,
    ),
]


def environments_of() -> list[str]:
    """Those of older versions alone."""
    return [f"defects/{path.stem}" for path in sorted((LOCKS / "defects").glob("*.in"))]


def ask(python: Path, check: Path, limit: float) -> Asked:
    """`limit`: seconds."""
    cache = {"WARP_CACHE_PATH": str(environments.FOLDER / "warp-cache")}
    try:
        done = subprocess.run(
            [python, check],
            capture_output=True,
            text=True,
            timeout=limit,
            check=False,
            env={**os.environ, **cache},
        )
    except subprocess.TimeoutExpired:
        return Asked("", None, f"timed out: {limit:g} s")
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit {done.returncode}"]
        return Asked("", None, f"failed: {lines[-1][:200]}")
    said = json.loads(done.stdout.strip().splitlines()[-1])
    return Asked(said["version"], said["error"])


def is_found(error: float | None, limit: float) -> bool:
    """No number, such as NaN, is no right answer."""
    return error is not None and not error <= limit


def run(limit: float) -> int:
    """1 where a known defect was not found, a mended one was, or a version could not be asked."""
    rows, wrong = [], 0
    for defect in DEFECTS:
        versions = ((True, f"defects/{defect.old}"), (not defect.mended, defect.today))
        for known, environment in versions:
            try:
                python = environments.prepare(environment)
                asked = ask(python, HERE / f"{defect.check}.py", limit)
            except Missing as why:
                asked = Asked("", None, f"missing: {why}")
            found = is_found(asked.error, defect.limit)
            word = ("found" if found else "not found") if asked.outcome == "ok" else asked.outcome
            wrong += asked.outcome != "ok" or found != known
            error = "" if asked.error is None else f" by {asked.error:.1e}"
            print(f"{defect.name} in {asked.version or environment}: {word}{error}", flush=True)
            error = records.number(asked.error)
            rows.append([defect.name, asked.version, int(known), error, defect.limit])
            rows[-1] += [int(found), asked.outcome]
    OUT.parent.mkdir(parents=True, exist_ok=True)
    records.write(OUT, COLUMNS, rows)
    if wrong:
        print(f"engines: {wrong} of {len(rows)} are not as they should be", file=sys.stderr)
    return 1 if wrong else 0
