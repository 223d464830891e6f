"""What searches have found, on the page."""

import alt_scene
import pytest
from data import Data, DataError
from readers import load
from sections import adversary

HEADER = "variant,precision,seed,method,evaluations,error,kS,nv,file\n"
FOUND = """\
Fast<A>,float32,1,search,10,1e-6,,,
Fast<A>,float32,1,search,400,0.02,,,
Fast<A>,float32,1,search,1000,0.02,3.25,4,Fast-A
Fast<A>,float32,1,random,3,1e-7,,,
Fast<A>,float32,1,random,1000,1e-7,1,2,Fast-A-random
Fast<A>,float64,1,search,1000,1e-12,,,
Fast<B>,float32,1,search,1000,,,,
"""


@pytest.fixture
def read(tmp_path):
    def read(text):
        (tmp_path / "adversary-all.csv").write_text(HEADER + text)
        return load(tmp_path)

    return read


def test_a_row_a_search_with_its_command_and_what_as_many_random_ones_showed(read):
    (table,) = adversary.section(read(FOUND)).tables
    assert [row[:7] for row in table.rows] == [
        ["Fast<A>", "float32", "1000", "2.0e-2", "1.0e-7", "3.2", "4"],
        ["Fast<A>", "float64", "1000", "1.0e-12", "–", "–", "–"],
        ["Fast<B>", "float32", "1000", "–", "–", "–", "–"],
    ]
    command = table.rows[0][-1]
    assert command.startswith("build/bin/adversary --variant 'Fast<A>' --precision float32 --seed 1")
    assert "--evaluations 1000" in command


def test_the_staircases_end_where_the_search_did(read):
    found = adversary.section(read(FOUND))
    assert [choice.options for choice in found.choices] == [
        [("float32", "float32"), ("float64", "float64")]
    ]
    lines = alt_scene.marks(found.figures[0].chart, "line")
    (only,) = lines  # of float64, which is shown first
    assert "worst silent error: 1.0e-12" in only[-1]["description"]


def test_without_a_find_there_is_a_table_and_no_figure(read):
    found = adversary.section(read("Fast<B>,float32,1,search,1000,,,,\n"))
    assert not found.figures and len(found.tables[0].rows) == 1


def test_without_a_search_there_is_no_section(read):
    assert adversary.section(Data()) is None


@pytest.mark.parametrize(
    "row",
    [
        "Fast<A>,float16,1,search,10,1e-6,,,",
        "Fast<A>,float32,1,guessed,10,1e-6,,,",
        "Fast<A>,float32,1,search,10,-1,,,",
        "Fast<A>,float32,1,search,many,1,,,",
    ],
)
def test_what_is_no_such_record_is_refused_by_name(read, row):
    with pytest.raises(DataError, match=r"adversary-all.csv:2"):
        read(row + "\n")
