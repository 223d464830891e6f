"""The examples of docs/python.md and docs/controllers.md run, and draw their pictures."""

import re
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^## (.+?)$.*?^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
COUNTS = {"python": 6, "controllers": 4}
BLOCKS = {page: BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text()) for page in COUNTS}
EXAMPLES = [(page, title, code) for page, blocks in BLOCKS.items() for title, code in blocks]


@pytest.mark.parametrize(
    ("page", "title", "code"), EXAMPLES, ids=[f"{page}: {title}" for page, title, _ in EXAMPLES]
)
def test_example_runs_and_draws_its_picture(page, title, code, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").symlink_to(ROOT / "robots")
    (tmp_path / "docs" / page).mkdir(parents=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        exec(compile(code, f"docs/{page}.md: {title}", "exec"), {"__name__": "__main__"})
    (picture,) = (tmp_path / "docs" / page).iterdir()
    assert (ROOT / "docs" / page / picture.name).exists()


@pytest.mark.parametrize("page", COUNTS)
def test_page_has_all_its_examples(page):
    assert len(BLOCKS[page]) == COUNTS[page]
