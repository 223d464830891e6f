"""The worst arms that searches have found: files and rows belong together."""

import csv
import json

import measure
import mechanisms
import pytest
import search

FOUND = mechanisms.FINDS / "found.csv"
REPRODUCED = 0.01  # errors above it have a reproducer in the engine's own API


def rows() -> list[dict]:
    with FOUND.open() as file:
        return list(csv.DictReader(file))


def test_every_find_has_a_row_and_every_row_its_files():
    names = {path.stem for path in mechanisms.FINDS.glob("*.xml")}
    assert names == {row["file"] for row in rows()} and names
    assert names == {path.stem for path in mechanisms.FINDS.glob("*.json")}
    assert {f"finds/{name}" for name in names} <= set(mechanisms.found())


@pytest.mark.parametrize("row", rows(), ids=lambda row: row["file"])
def test_a_row_tells_of_an_adapter_and_of_the_state_beside_it(row):
    assert list(row) == search.COLUMNS
    its = measure.facts(row["engine"])
    assert row["variant"] in its.variants and row["precision"] in its.precisions
    path = mechanisms.FINDS / f"{row['file']}.json"
    (state,) = json.loads(path.read_text())["states"]
    hinges = int(row["hinges"])
    assert path.with_suffix(".xml").read_text().count("<joint ") == hinges
    assert [len(state[key]) for key in ("qpos", "qvel", "tau")] == [hinges] * 3
    assert 0 < float(row["median"]) <= float(row["error"])


@pytest.mark.parametrize("row", rows(), ids=lambda row: row["file"])
def test_a_large_silent_error_has_a_reproducer(row):
    scripts = list((measure.HERE / "reproducers").glob(f"{row['engine']}_*.py"))
    assert scripts or float(row["error"]) < REPRODUCED
