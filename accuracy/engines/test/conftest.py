import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
ENGINES = HERE.parent
sys.path[:0] = [str(ENGINES), str(HERE), str(ENGINES.parents[1] / "scripts")]

import bodies  # noqa: E402
import measure  # noqa: E402
from mechanisms import Written  # noqa: E402


@pytest.fixture
def pendulum(tmp_path) -> Written:
    return Written("pendulum:1", bodies.pendulum(tmp_path / "pendulum"), "")


@pytest.fixture
def hanging_pendulum(tmp_path) -> Written:
    folder = bodies.pendulum(tmp_path / "hanging_pendulum", bodies.DOWN)
    return Written("hanging_pendulum:1", folder, "")


@pytest.fixture
def free_body(tmp_path) -> Written:
    return Written("free_body:6", bodies.free_body(tmp_path / "free_body"), "")


@pytest.fixture
def ask(monkeypatch):
    """Asks an engine; those of test/adapters by our own interpreter."""

    def ask(
        engine,
        variant,
        mechanism,
        precision="float64",
        python=sys.executable,
        limit=60.0,
        batches=(),
        path=HERE,
    ):
        monkeypatch.setenv("PYTHONPATH", str(path))
        unit = measure.Unit(engine, variant, precision, mechanism)
        return measure.ask(unit, Path(python), limit, 0.0 if limit < 60 else 0.001, batches)

    return ask
