"""The article (docs/article): its PDF has at most six pages, and every result in it is a record's."""

import csv
import io
import re
import shutil
import statistics
import subprocess
import sys
import tarfile
from pathlib import Path

import pypdf
import pytest

ROOT = Path(__file__).parents[3]
sys.path.append(str(ROOT / "scripts/site"))
import article  # noqa: E402
import measured  # noqa: E402

RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻−⋅", "0123456789--·")


def text(made: bytes) -> str:
    """Without spaces; an exponent as in 2·10-7, whether it is raised or a Unicode superscript."""
    pages = pypdf.PdfReader(io.BytesIO(made)).pages
    return re.sub(r"\s", "", "".join(page.extract_text() for page in pages)).translate(RAISED)


def written(value: float) -> str:
    mantissa, exponent = f"{value:.0e}".split("e")
    power = f"10{int(exponent)}"
    return power if mantissa == "1" else f"{mantissa}·{power}"


@pytest.fixture(scope="module")
def made() -> bytes:
    return article.pdf(article.numbers())


@pytest.fixture(scope="module")
def told(made) -> str:
    return text(made)


def test_has_at_most_six_pages(made):
    assert 2 <= len(pypdf.PdfReader(io.BytesIO(made)).pages) <= 6


def test_is_the_same_from_the_same_records(made):
    assert made == article.pdf(article.numbers())


def test_has_the_errors_of_every_engine_of_the_documentation(told):
    heads = ("engine | precision | arm of 7", "a of the arm with", "engine, float32 | arms")
    compared = 0
    for head, _, *rows in measured.tables("docs/engines.md"):
        if " | ".join(head).startswith(heads):
            for row in rows:
                if "float64" not in row:
                    for cell in row[1:]:
                        if re.fullmatch(r"[\d.]+e-?\d+", cell):
                            assert written(float(cell)) in told
                            compared += 1
    assert compared > 30


def test_has_times_and_errors_of_the_example_report(told):
    errors, times = [], measured.times("times", "g1", "float64")
    for row in csv.DictReader(io.StringIO(measured.files(measured.ARCHIVE)["errors-g1.csv"])):
        of = (row["variant"], row["precision"], row["task"], row["measure"])
        if of == ("Ladder<default>", "float64", "acceleration", "relative"):
            errors.append(float(row["value"]))
    time = f"{times['acceleration', 'Ladder<default>']:.3g}"
    line = f"ladder,defaultfloat64{time}{written(statistics.median(errors))}{written(max(errors))}"
    assert line in told


def test_has_counts_of_the_contacts_that_were_measured(told):
    rows = list(csv.DictReader(io.StringIO(measured.files(measured.ARCHIVE)["contacts-g1.csv"])))
    rows = [
        row for row in rows if (row["variant"], row["precision"]) == ("Batch<EigenLLT>", "float32")
    ]
    rows = [row for row in rows if row["stiffness"] == "1000000"]
    refused = sum(row["status"] != "ok" for row in rows)
    wrong = sum(
        row["status"] == "ok" and row["warns"] == "0" and float(row["error"]) > 1e-2 for row in rows
    )
    assert refused + wrong > 0
    assert f"itrefuses{refused}of{len(rows)}statesandissilentlywrongin{wrong};" in told


def test_has_ratios_of_square_roots(told):
    head, _, *rows = next(
        one
        for one in measured.tables("docs/generated.md")
        if one[0][0] == "time of a state [ns], a"
    )
    lines = {row[0].strip("`"): [float(cell) for cell in row[1:]] for row in rows}
    ratios = [x / y for x, y in zip(lines["Sequential<UD>"], lines["Sequential<Conventional>"])]
    one_state = ratios[1::4]
    page = (ROOT / "docs/generated.md").read_text(encoding="utf-8")
    repetitions = re.search(r"Times are medians of (\d+) interleaved repetitions", page)[1]
    assert f"Mediansof{repetitions}repetitions" in told
    assert f"UDtakes{min(one_state):.2g}–{max(one_state):.2g}timesthetime" in told


def test_has_what_searches_found(told):
    _, _, *rows = next(
        one for one in measured.tables("docs/errors.md") if one[0][0] == "answer without a warning"
    )
    for row in rows:
        for cell in row[2:]:
            assert cell.translate(RAISED) in told


def test_no_result_is_typed():
    """Digits of the source outside of code, comments, formulas and the paper's equation numbers."""
    source = (article.SOURCES / "article.typ").read_text(encoding="utf-8")
    prose = source[source.index("*Abstract.*") : source.index("#bibliography")]
    prose = re.sub(r"#let plot.*?\n}\)\n", "", prose, flags=re.DOTALL)  # the figure's code
    prose = re.sub(
        r"data\(\n.*?\n  \),|data\(\(.*?\), \(", "", prose, flags=re.DOTALL
    )  # columns of tables
    prose = re.sub(r"figure\(kind.*?caption:", "", prose, flags=re.DOTALL)  # the block of equations
    prose = re.sub(
        r"\$[^$]*\$|`[^`]*`|\((?:\d\.\d+(?:, )?)+\)|#[\w.]+(?:\([^)]*\)[\w.]*)*", "", prose
    )
    prose = (
        prose.replace("Result 6.1", "")
        .replace("1 %", "")
        .replace("Apache License 2.0", "")
        .replace("2-norm", "")
    )
    prose = re.sub(r"@\w+", "", prose)
    assert [line for line in prose.splitlines() if re.search(r"(?<![A-Za-z\d])\d", line)] == []


@pytest.fixture
def elsewhere(tmp_path):
    """The records that the article reads, to be spoiled."""
    for page in ("engines", "contacts", "generated", "errors"):
        (tmp_path / "docs").mkdir(exist_ok=True)
        shutil.copy(ROOT / f"docs/{page}.md", tmp_path / "docs")
    return tmp_path


def without(archive: Path, name: str) -> Path:
    with tarfile.open(measured.ARCHIVE) as full, tarfile.open(archive, "w") as less:
        for member in full:
            if not member.name.endswith(name):
                less.addfile(member, full.extractfile(member) if member.isfile() else None)
    return archive


@pytest.mark.parametrize("name", ["contacts-g1.csv", "times-g1.json", "errors-straight-127.csv"])
def test_a_missing_file_of_the_example_is_named(elsewhere, name):
    with pytest.raises(article.MissingRecord, match=name):
        article.numbers(without(elsewhere / "data.tar", name), elsewhere)


@pytest.mark.parametrize(
    ("page", "words", "named"),
    [
        ("engines", "| Rounded parameters |", "Rounded|rounded"),
        ("engines", "a of the arm with", "a of the arm with"),
        ("generated", "| `Sequential<UD>` |", "Sequential<UD>"),
        ("errors", "answer without a warning", "answer without a warning"),
        ("errors", "a proof needs about", "a proof needs about"),
    ],
)
def test_a_missing_record_of_a_page_is_named(elsewhere, page, words, named):
    file = elsewhere / f"docs/{page}.md"
    before = file.read_text(encoding="utf-8")
    assert words in before
    file.write_text(before.replace(words, words.replace(words[2:-2], "other")), encoding="utf-8")
    with pytest.raises(article.MissingRecord, match=named):
        article.numbers(measured.ARCHIVE, elsewhere)


def test_the_command_writes_the_same(made, tmp_path):
    command = [sys.executable, ROOT / "scripts/site/article.py", tmp_path / "article.pdf"]
    subprocess.run(command, check=True)
    assert (tmp_path / "article.pdf").read_bytes() == made
    assert subprocess.run(command[:2], capture_output=True).returncode == 2
