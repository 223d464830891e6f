import sys
from pathlib import Path

import pytest

REPORTS = Path(__file__).parent.parent
sys.path.insert(0, str(REPORTS))

import fake_run  # noqa: E402


@pytest.fixture(scope="session")
def run(tmp_path_factory) -> Path:
    """The folder of a made-up run."""
    folder = tmp_path_factory.mktemp("data")
    fake_run.write(folder)
    return folder
