import warnings
from pathlib import Path

import numpy as np
import pytest

import kalmarm

ROBOTS = Path(__file__).parents[2] / "robots" / "models"
NAMES = sorted(path.parent.name for path in ROBOTS.glob("*/*.xml") if path.parent.name == path.stem)


def file_of(name: str) -> Path:
    return ROBOTS / name / f"{name}.xml"


def load(name: str, **options) -> kalmarm.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(file_of(name), **options)


@pytest.fixture(params=NAMES)
def name(request) -> str:
    return request.param


@pytest.fixture(scope="session")
def iiwa() -> kalmarm.Robot:
    return load("iiwa14")


@pytest.fixture(scope="session")
def g1() -> kalmarm.Robot:
    return load("g1")


def relative(x, truth) -> float:
    """Largest |x - truth| over a row, by the row's own size."""
    axis = tuple(range(1, np.ndim(truth)))
    return float(np.max(np.linalg.norm(x - truth, axis=axis) / np.linalg.norm(truth, axis=axis)))
