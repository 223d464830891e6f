"""What the pages and notebooks of docs/ and the README show in Python runs, draws its pictures and prints what they say."""

import re
import runpy
import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^## (.+?)$.*?^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
COUNTS = {"python": 7, "controllers": 4, "check": 1, "gradients": 2}
WITHOUT_PICTURES = {"gradients"}
BLOCKS = {page: BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text()) for page in COUNTS}
EXAMPLES = [(page, title, code) for page, blocks in BLOCKS.items() for title, code in blocks]
SESSION = re.compile(r"^```python\n(.*?)^```\n\n```text\n(.*?)^```", re.DOTALL | re.MULTILINE)
SESSIONS = {"README.md": 1, "docs/tutorials/five-minutes.md": 6}
NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.py"))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where examples run: what they write does not come into the repository."""
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    for name in ("robots", "reports"):
        (tmp_path / name).symlink_to(ROOT / name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        yield tmp_path


@pytest.mark.parametrize(
    ("page", "title", "code"), EXAMPLES, ids=[f"{page}: {title}" for page, title, _ in EXAMPLES]
)
def test_example_runs_and_draws_its_picture(page, title, code, folder):
    (folder / "docs" / page).mkdir(parents=True)
    exec(compile(code, f"docs/{page}.md: {title}", "exec"), {"__name__": "__main__"})
    if page in WITHOUT_PICTURES:
        return
    (picture,) = (folder / "docs" / page).iterdir()
    assert (ROOT / "docs" / page / picture.name).exists()


@pytest.mark.parametrize("page", COUNTS)
def test_page_has_all_its_examples(page):
    assert len(BLOCKS[page]) == COUNTS[page]


@pytest.mark.parametrize("page", SESSIONS)
def test_session_prints_what_the_page_says(page, folder, capsys):
    blocks = SESSION.findall((ROOT / page).read_text())
    assert len(blocks) == SESSIONS[page]
    names = {"__name__": "__main__"}
    for code, printed in blocks:
        exec(compile(code, page, "exec"), names)
        assert capsys.readouterr().out == printed


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def test_notebook_runs_from_a_fresh_start(notebook, folder):
    pytest.importorskip("duckdb")
    runpy.run_path(str(notebook))


def test_notebooks_were_found():
    assert len(NOTEBOOKS) == 5
