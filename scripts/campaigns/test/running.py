"""Runs campaigns with a worker that only pretends to measure."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

HERE = Path(__file__).parent
RUN = HERE.parent / "run.py"
BIN = HERE / "bin"  # the worker's folder
ENGINE = HERE.parents[2] / "build" / "venv-cluster" / "bin" / "snakemake"
needs_engine = pytest.mark.skipif(not ENGINE.exists(), reason="needs scripts/setup --cluster")


def expect_refusal(done: subprocess.CompletedProcess, line: str) -> None:
    assert done.returncode == 2
    assert re.fullmatch(rf"campaign: error: .*{line}.*\n", done.stderr), done.stderr


def start(*arguments: str, **environment: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, RUN, *map(str, arguments)],
        env=os.environ | {"KALMARM_BIN": str(BIN)} | environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell that starts tests in the background lets them ignore it, and what they start.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess:
    process = start(*arguments, **environment)
    out, err = process.communicate(timeout=300)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def wild(out: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    return run(*wild_arguments(out), *arguments, **environment)


def wild_arguments(out: Path) -> list[str]:
    """Of eight units."""
    return ["wild", "--mechanisms=160", "--count=20", f"--out={out}"]


def result(out: Path) -> bytes:
    return (out / "campaign-wild.json").read_bytes()


def units(out: Path) -> list[str]:
    folder = out / "units"
    return sorted(file.name for file in folder.glob("*.json")) if folder.exists() else []


def begun(log: Path) -> list[tuple[int, str]]:
    """Process and unit of each worker that was started."""
    lines = log.read_text().splitlines() if log.exists() else []
    return [(int(line.split()[0]), line.split()[1]) for line in lines]


def wait_for(condition: Callable[[], object], seconds: float = 600) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def has_ended(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return True
    return state.rpartition(")")[2].split()[0] in "ZX"


def document(file: Path) -> dict:
    return json.loads(file.read_text())


def write(file: Path, document: dict) -> None:
    file.write_text(json.dumps(document))
