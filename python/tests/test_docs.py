"""The examples of docs/python.md run, and draw their pictures."""

import re
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "python.md"
BLOCK = re.compile(r"^## (.+?)$.*?^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
BLOCKS = BLOCK.findall(PAGE.read_text())


@pytest.mark.parametrize(("title", "code"), BLOCKS, ids=[title for title, _ in BLOCKS])
def test_example_runs_and_draws_its_picture(title, code, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").symlink_to(ROOT / "robots")
    (tmp_path / "docs" / "python").mkdir(parents=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        exec(compile(code, f"{PAGE}: {title}", "exec"), {"__name__": "__main__"})
    (picture,) = (tmp_path / "docs" / "python").iterdir()
    assert (ROOT / "docs" / "python" / picture.name).exists()


def test_there_are_eight_examples():
    assert len(BLOCKS) == 8
