"""Robots that stand, from records whose laws are known."""

import pytest

import alt_scene
from read.contacts import COLUMNS
from read.data import Data, DataError
from read.readers import load
from sections import contacts

STIFFNESSES = (1e2, 1e4, 1e6, 1e8)
START = "arm:7,7,3"
CONTACTS = [
    *(f"{START},{d:g},float64,Batch<A>,1,ok,0,{1e-14 * d:g},3" for d in STIFFNESSES),
    *(f"{START},{d:g},float64,Batch<A>,2,ok,0,{1e-14 * d:g},3" for d in STIFFNESSES),
    *(f"{START},{d:g},float32,Sequential<B>,1,ok,0,2e-07,5" for d in STIFFNESSES[:3]),
    f"{START},1e8,float32,Sequential<B>,1,ok,1,0.5,5",
    f"{START},1e8,float32,Sequential<B>,2,singular,0,,",
]


@pytest.fixture
def read(tmp_path):
    def read(*rows: str) -> Data:
        (tmp_path / "contacts-arm.csv").write_text("\n".join([",".join(COLUMNS), *rows]) + "\n")
        return load(tmp_path)

    return read


def test_no_contacts_are_no_section():
    assert contacts.section(Data()) is None


def test_the_table_has_the_law_and_what_is_silent(read):
    (table,) = contacts.section(read(*CONTACTS)).tables
    batch, filtered = table.rows
    assert batch[1:4] == ["Batch<A>", "float64", "–"]
    assert batch[4].startswith("1.00 ±") and batch[5:] == ["0 %", "1.0e-6", "0"]
    assert filtered[4:] == ["–", "20 %", "5.0e-1", "0"]  # what warns is not silent
    assert "kS = 3.0 in the median and 5.0 at most" in table.caption
    (table,) = contacts.section(read(CONTACTS[-2].replace(",1,0.5,", ",0,0.5,"))).tables
    assert table.rows[0][-1] == "1"


def test_the_figure_has_medians_and_shares_that_are_refused(read):
    (figure,) = contacts.section(read(*CONTACTS)).figures
    symbols = [item for layer in alt_scene.marks(figure.chart, "symbol") for item in layer]
    shapes = [item.get("shape") for item in symbols]
    assert shapes.count("cross") == 1
    assert len(symbols) >= 1 + 4 + 4  # and medians of both variants
    assert "failed" in alt_scene.texts(figure.chart)


@pytest.mark.parametrize(
    ("old", "new"),
    [("float64", "float16"), ("Batch<A>", ""), (",1,ok,0", ",1,ok,2"), (",100,", ",0,")],
)
def test_a_wrong_record_is_refused(read, old, new):
    with pytest.raises(DataError):
        read(CONTACTS[0].replace(old, new))
