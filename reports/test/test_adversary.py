"""What searches have found, on the page."""

import shlex

import pytest

import alt_scene
from charts.search import places
from read.data import Data, DataError
from read.readers import load
from sections import adversary

HEADER = (
    "variant,precision,task,objective,kernel,rows,seed,method,evaluations,error,kS,nv,file,bodies\n"
)
FOUND = """\
Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,1e-6,,,,
Ladder<A>,float32,acceleration,error,spatial,0,1,search,400,0.02,,,,
Ladder<A>,float32,acceleration,error,spatial,0,1,search,1000,0.02,3.25,4,Ladder-A,0 hinge 2 0 0.1;1 ball 1e-8 3 0;2 hinge 1 1 0;1 slide 5e9 2 0
Ladder<A>,float32,acceleration,error,spatial,0,1,random,3,1e-7,,,,
Ladder<A>,float32,acceleration,error,spatial,0,1,random,1000,1e-7,1,2,Ladder-A-random,0 hinge 1 1 0
Ladder<A>,float64,acceleration,error,spatial,0,1,search,1000,1e-12,,,,
Ladder<B>,float32,acceleration,error,spatial,0,1,search,1000,,,,,
"""


@pytest.fixture
def read(tmp_path):
    def read(text):
        (tmp_path / "adversary-all.csv").write_text(HEADER + text)
        return load(tmp_path)

    return read


def test_a_row_a_search_with_its_command_and_what_as_many_random_ones_showed(read):
    (table,) = adversary.section(read(FOUND)).tables
    assert [row[:8] for row in table.rows] == [
        ["Ladder<A>", "float32", "acceleration", "1000", "2.0e-2", "1.0e-7", "3.2", "4"],
        ["Ladder<A>", "float64", "acceleration", "1000", "1.0e-12", "–", "–", "–"],
        ["Ladder<B>", "float32", "acceleration", "1000", "–", "–", "–", "–"],
    ]
    command = table.rows[0][-1]
    assert command.startswith(
        "build/bin/adversary --variant 'Ladder<A>' --precision float32 --seed 1"
    )
    assert "--evaluations 1000" in command


def test_a_variant_s_name_stays_a_name_in_its_command(read):
    (table,) = adversary.section(read(FOUND.replace("Ladder<B>", "B'; id '"))).tables
    command = next(row[-1] for row in table.rows if row[0] == "B'; id '")
    assert shlex.split(command)[1:3] == ["--variant", "B'; id '"]


def test_what_is_asked_otherwise_has_its_own_row_and_no_figure(read):
    other = FOUND.replace("acceleration,error,spatial,0", "inverse,claim,translational,1")
    found = adversary.section(read(FOUND + other))
    (table,) = found.tables
    assert [row[2] for row in table.rows if row[0] == "Ladder<B>"] == [
        "acceleration",
        "inverse, claim, translational, rows",
    ]
    command = next(row[-1] for row in table.rows if row[0] == "Ladder<B>" and "claim" in row[2])
    options = "--precision float32 --task inverse --objective claim --kernel translational --rows --seed 1"
    assert options in command
    alone = adversary.section(read(FOUND))
    assert [figure.chart.to_dict() for figure in found.figures] == [
        figure.chart.to_dict() for figure in alone.figures
    ]


def test_the_staircases_end_where_the_search_did(read):
    found = adversary.section(read(FOUND))
    assert [choice.options for choice in found.choices] == [
        [("float32", "float32"), ("float64", "float64")]
    ]
    lines = alt_scene.marks(found.figures[0].chart, "line")
    (only,) = lines  # of float64, which is shown first
    assert "worst silent error: 1.0e-12" in only[-1]["description"]


def test_a_first_child_goes_on_in_its_parents_lane():
    assert places([0, 1, 2, 1, 4, 2]) == [(1, 0), (2, 0), (3, 0), (2, 1), (3, 1), (3, 2)]
    assert places([0, 0]) == [(1, 0), (1, 1)]


def test_the_worst_mechanism_is_drawn_body_by_body(read):
    better = (
        "Ladder<A>,float32,acceleration,error,spatial,0,2,search,1000,0.01,1,1,Ladder-A,0 slide 1 1 0\n"
    )
    found = adversary.section(read(FOUND + better))
    chart = found.figures[1].chart
    rows = chart.data.values
    assert [(row["on"], row["joint"], row["label"]) for row in rows] == [
        ("the ground", "hinge", ""),
        ("body 1", "ball", "3 m"),
        ("body 2", "hinge", "1 m"),
        ("body 1", "slide", "2 m"),
    ]
    assert [row["mass_text"] for row in rows] == ["2 kg", "1e-8 kg", "1 kg", "5e9 kg"]
    assert rows[3]["size"] == 400 and rows[1]["size"] == 20  # no larger than the scale
    assert [row.get("title") for row in rows] == ["Ladder<A>", None, None, None]


def test_without_a_find_there_is_a_table_and_no_figure(read):
    found = adversary.section(
        read("Ladder<B>,float32,acceleration,error,spatial,0,1,search,1000,,,,,\n")
    )
    assert not found.figures and len(found.tables[0].rows) == 1


def test_without_a_search_there_is_no_section(read):
    assert adversary.section(Data()) is None


@pytest.mark.parametrize(
    "row",
    [
        "Ladder<A>,float16,acceleration,error,spatial,0,1,search,10,1e-6,,,,",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,guessed,10,1e-6,,,,",
        "Ladder<A>,float32,torque,error,spatial,0,1,search,10,1e-6,,,,",
        "Ladder<A>,float32,inverse,hope,spatial,0,1,search,10,1e-6,,,,",
        "Ladder<A>,float32,inverse,claim,curved,0,1,search,10,1e-6,,,,",
        "Ladder<A>,float32,inverse,claim,translational,2,1,search,10,1e-6,,,,",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,-1,,,,",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,many,1,,,,",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,1,1,1,x,1 hinge 1 1 0",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,1,1,1,x,0 hinge 1 1",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,1,1,1,x,0 gear 1 1 0",
        "Ladder<A>,float32,acceleration,error,spatial,0,1,search,10,1,1,1,x,0 hinge -1 1 0",
    ],
)
def test_what_is_no_such_record_is_refused_by_name(read, row):
    with pytest.raises(DataError, match=r"adversary-all.csv:2"):
        read(row + "\n")
