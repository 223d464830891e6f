"""Engines that are installed, on bodies whose dynamics are known in closed form. Those that compile
for seconds are asked with KALMARM_ENGINES=all, or NAME,NAME of some, alone.
"""

import os
from pathlib import Path

import environments
import measure
import pytest

TOLERANCE = {"float64": 1e-13, "float32": 1e-5}
DIFFERENCES = {("mujoco", "derivatives"): 1e-5}  # by finite differences, whose step is 1e-6
# What scripts/test_python has anyway serves where an engine has no environment of its own.
BESIDE = {"mujoco": "mujoco", "pinocchio": "pinocchio"}

CHEAP = ("kalmarm", "mujoco", "pinocchio")
WANTED = os.environ.get("KALMARM_ENGINES") or ",".join(CHEAP)
ASKED = measure.adapters() if WANTED == "all" else WANTED.split(",")


def interpreter(engine: str) -> Path | None:
    if python := environments.python_of(engine):
        return python
    venv = environments.ROOT / "build" / "venv-python"
    there = engine in BESIDE and list(venv.glob(f"lib/python3*/site-packages/{BESIDE[engine]}"))
    return venv / "bin" / "python" if there else None


CASES = [
    (engine, variant, precision)
    for engine in ASKED
    for variant in measure.facts(engine).variants
    for precision in measure.facts(engine).precisions
]


@pytest.mark.parametrize(("engine", "variant", "precision"), CASES)
@pytest.mark.parametrize("body", ["pendulum", "hanging_pendulum", "free_body"])
def test_an_engine_agrees_with_the_closed_form(ask, body, engine, variant, precision, request):
    python = interpreter(engine)
    if not python:
        pytest.skip(f"{engine} is not installed: scripts/engines {engine}")
    mechanism = request.getfixturevalue(body)
    answers = ask(engine, variant, mechanism, precision, python, limit=measure.LIMIT)
    refused = [said["outcome"] for said in answers.errors.values() if "error" not in said]
    assert all(outcome.startswith("unsupported") for outcome in refused), refused
    errors = {key: said["error"] for key, said in answers.errors.items() if "error" in said}
    assert all(
        error < max(TOLERANCE[precision], DIFFERENCES.get((engine, task), 0))
        for (task, _), error in errors.items()
    ), errors
    assert errors or body != "hanging_pendulum"
