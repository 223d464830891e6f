"""Known defects: what counts as found, and that what cannot be asked is no success."""

import csv
import sys
from pathlib import Path

import defects
import environments
import pytest
from defects import Asked, Defect


@pytest.fixture
def ask(tmp_path):
    def ask(text: str, limit: float = 20.0) -> Asked:
        check = tmp_path / "check.py"
        check.write_text(text)
        return defects.ask(Path(sys.executable), check, limit)

    return ask


def test_a_check_says_its_version_and_error_and_may_say_more_before_it(ask):
    assert ask("""print("loading"); print('{"version": "1.2", "error": 0.5}')""") == Asked(
        "1.2", 0.5
    )


def test_a_check_that_fails_or_hangs_says_why(ask):
    assert ask("raise ValueError('no model')") == Asked("", None, "failed: ValueError: no model")
    assert ask("import time; time.sleep(60)", 1.0) == Asked("", None, "timed out: 1 s")


@pytest.mark.parametrize(
    ("error", "found"), [(0.2, True), (float("nan"), True), (1e-9, False), (None, False)]
)
def test_a_defect_is_found_by_a_large_error_or_by_none_that_is_a_number(error, found):
    assert defects.is_found(error, 1e-3) == found


@pytest.mark.parametrize(
    ("mended", "errors", "code"),
    [
        (True, (0.5, 1e-9), 0),
        (True, (1e-9, 1e-9), 1),
        (True, (0.5, 0.5), 1),
        (True, (0.5, None), 1),
        (False, (0.5, float("nan")), 0),
        (False, (0.5, 1e-9), 1),
    ],
)
def test_the_old_version_must_have_it_and_todays_until_it_is_mended(
    mended, errors, code, tmp_path, monkeypatch
):
    defect = Defect("Engine #1", "check", "engine-1.0", "engine", 1e-3, mended)
    asked = dict(zip(("defects/engine-1.0", "engine"), errors, strict=True))
    monkeypatch.setattr(defects, "DEFECTS", [defect])
    monkeypatch.setattr(defects, "OUT", tmp_path / "out" / "defects.csv")
    monkeypatch.setattr(environments, "prepare", lambda name: name)
    monkeypatch.setattr(
        defects,
        "ask",
        lambda python, *_: (
            Asked("1", asked[python])
            if asked[python] is not None
            else Asked("", None, "failed: no")
        ),
    )
    assert defects.run(1.0) == code
    with defects.OUT.open() as file:
        assert [row["known"] for row in csv.DictReader(file)] == ["1", str(int(not mended))]


@pytest.mark.parametrize("defect", defects.DEFECTS, ids=lambda defect: defect.name)
def test_a_defect_has_a_check_and_versions_that_are_locked(defect):
    assert (defects.HERE / f"{defect.check}.py").is_file()
    for environment in (f"defects/{defect.old}", defect.today):
        assert "--hash=sha256:" in (environments.LOCKS / f"{environment}.txt").read_text()
