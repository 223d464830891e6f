"""The program: what it writes, and what it refuses to write."""

import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
from contextlib import redirect_stderr
from unittest import mock

import pytest

import fake_estimation
import make_report
from conftest import REPORTS
from page.archive import archive
from read.data import Data, Error
from read.readers import SAMPLE_COLUMNS, data_files, load
from sections import limitations
from sections.method import distinct


def report(*arguments) -> subprocess.CompletedProcess:
    """In this process, which has imported what the program needs seconds for."""
    said, status = io.StringIO(), 0
    with redirect_stderr(said), mock.patch.object(sys, "argv", ["make_report.py", *map(str, arguments)]):
        try:
            make_report.main()
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess(arguments, status, "", said.getvalue())


def program(*arguments) -> subprocess.CompletedProcess:
    """The same by itself."""
    command = [sys.executable, REPORTS / "make_report.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def assert_refused(result, *parts: str) -> None:
    assert result.returncode == 2
    (line,) = result.stderr.splitlines()
    assert line.startswith("make_report.py: error: ")
    assert all(part in line for part in parts), line


@pytest.fixture
def out(tmp_path):
    return tmp_path / "out" / "index.html"


def test_page_and_figure_are_written_and_nothing_else(run, out):
    files = [run / "errors-panda-7.csv", run / "times-panda-7.json"]
    result = program("--files", *files, "--out", out, "--figure", out.with_name("figure.svg"))
    assert (result.returncode, result.stderr) == (0, "")
    assert sorted(path.name for path in out.parent.iterdir()) == ["figure.svg", "index.html"]
    assert out.with_name("figure.svg").read_text().startswith("<svg")
    assert "panda" in out.read_text() and "iiwa14" not in out.read_text()


def test_a_page_is_made_again_from_its_archive_to_the_byte(run, tmp_path):
    """By another process, whose sets have another order."""

    def made(report, folder, data):
        out, packed = folder / "index.html", folder / "data.tar.xz"
        result = report("--data", data, "--out", out, "--archive", packed)
        assert (result.returncode, result.stderr) == (0, "")
        return out.read_bytes(), packed.read_bytes()

    first = made(report, tmp_path / "first", run)
    subprocess.run(["tar", "xf", "first/data.tar.xz"], cwd=tmp_path, check=True)
    check = ["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"]
    subprocess.run(check, cwd=tmp_path, check=True)
    assert len((tmp_path / "SHA256SUMS").read_text().splitlines()) == len(data_files(run))
    assert made(program, tmp_path / "again", tmp_path / run.name) == first


def test_the_page_names_its_archive_and_the_checksum(run, tmp_path):
    files, packed = [run / "errors-panda-7.csv"], tmp_path / "data" / "panda.tar.xz"
    result = report("--files", *files, "--out", tmp_path / "page.html", "--archive", packed)
    assert (result.returncode, result.stderr) == (0, "")
    html = (tmp_path / "page.html").read_text()
    assert '<a href="data/panda.tar.xz">panda.tar.xz</a>' in html
    assert hashlib.sha256(packed.read_bytes()).hexdigest() in html


def test_of_a_file_left_out_an_archive_has_the_checksum_alone(run, tmp_path):
    kept, left = run / "errors-panda-7.csv", run / "times-panda-7.json"
    page, packed = tmp_path / "page.html", tmp_path / "data.tar.xz"
    named = ["--out", page, "--archive", packed, "--leave-out", left.name]
    result = report("--files", kept, left, *named)
    assert (result.returncode, result.stderr) == (0, "")
    with tarfile.open(packed) as tar:
        sums = tar.extractfile("SHA256SUMS").read().decode()
        assert tar.getnames() == [f"{run.name}/{kept.name}", "SHA256SUMS"]
    assert [line.split()[0] for line in sums.splitlines()] == [
        hashlib.sha256(file.read_bytes()).hexdigest() for file in (kept, left)
    ]
    assert f"without {left.name} (" in page.read_text()


def test_what_is_left_out_is_one_of_the_files(run, out):
    files = ["--files", run / "errors-panda-7.csv", "--out", out, "--archive", out.with_suffix(".xz")]
    assert_refused(report(*files, "--leave-out", "times.json"), "times.json", "none of the data")
    assert not out.exists()


def test_an_archive_keeps_files_of_one_name_apart(run, tmp_path):
    source = run / "errors-panda-7.csv"
    files = [tmp_path / where / source.name for where in ("data", "campaigns/wild")]
    for file in files:
        file.parent.mkdir(parents=True)
        shutil.copy(source, file)
    with tarfile.open(fileobj=io.BytesIO(archive(files))) as tar:
        names = tar.getnames()
    assert names == [f"campaigns/wild/{source.name}", f"data/{source.name}", "SHA256SUMS"]


def test_an_archive_has_files_of_any_name(run, tmp_path):
    file = tmp_path / "data" / f"errors-{'é' * 100}.csv"
    file.parent.mkdir()
    shutil.copy(run / "errors-panda-7.csv", file)
    with tarfile.open(fileobj=io.BytesIO(archive([file]))) as tar:
        assert tar.getnames() == [f"data/{file.name}", "SHA256SUMS"]


def test_the_figure_is_of_panda_or_else_of_the_first_robot(run):
    assert "panda: Acceleration" in make_report.figure(load(run))
    files = [run / f"{kind}-go2-18.{end}" for kind, end in (("errors", "csv"), ("times", "json"))]
    assert "go2: Acceleration" in make_report.figure(load(None, files))


def test_the_figures_error_axes_name_powers_of_ten_alone(run):
    files = [run / "errors-two_link-2.csv", run / "times-two_link-2.json"]
    labels = re.findall(r">(\d+)e-\d+</text>", make_report.figure(load(None, files)))
    assert len(labels) > 10 and set(labels) == {"1"}


def test_a_figure_needs_times(run, out):
    svg = out.with_name("figure.svg")
    assert_refused(report("--files", run / "errors-panda-7.csv", "--figure", svg), "panda:7")
    assert not svg.exists()


def test_a_page_that_cannot_be_made_leaves_the_old_one(run, out):
    out.parent.mkdir()
    out.write_text("old")
    assert_refused(
        report("--files", run / "errors-none.csv", "--out", out), "errors-none.csv", "No such file"
    )
    assert out.read_text() == "old"
    assert list(out.parent.iterdir()) == [out]


@pytest.mark.parametrize("name", "errors-a.csv stress-a.csv times-a.json campaign-a.json".split())
def test_a_data_file_that_may_never_end_is_refused(tmp_path, out, name):
    os.mkfifo(tmp_path / name)
    assert_refused(report("--data", tmp_path, "--out", out), f"{name}: no regular file")


def test_a_half_written_data_file_is_named(run, tmp_path, out):
    shutil.copy(run / "times-panda-7.json", tmp_path)
    broken = tmp_path / "times-panda-7.json"
    broken.write_text(broken.read_text()[:500])
    assert_refused(report("--data", tmp_path, "--out", out), "times-panda-7.json", "not JSON")
    assert not out.parent.exists()


@pytest.mark.parametrize(
    "arguments, part",
    [
        (["--out", "x.html"], "--data"),
        (["--data", "nowhere", "--out", "x.html"], "nowhere: no such folder"),
        (["--data", "."], "--out"),
        (["--data", ".", "--figure", "x.svg", "--archive", "x.tar.xz"], "--archive"),
        (["--data", ".", "--out", "x.html", "--leave-out", "x.csv"], "--leave-out"),
        (["--data", ".", "--out", "x.html", "--colour"], "--colour"),
        (["--files", "evaluate-panda.json", "--out", "x.html"], "evaluate-panda.json"),
    ],
)
def test_bad_arguments_are_one_line(arguments, part):
    assert_refused(report(*arguments), part)


def test_an_empty_folder_is_no_data(tmp_path, out):
    assert_refused(report("--data", tmp_path, "--out", out), "no data")


def test_a_target_that_is_no_file_is_refused(run, tmp_path):
    assert_refused(report("--files", run / "errors-panda-7.csv", "--out", tmp_path), str(tmp_path))


def test_names_from_the_data_cannot_become_markup(run, tmp_path):
    for path in run.glob("*-panda-7.*"):
        (tmp_path / path.name).write_text(path.read_text().replace("Sequential<UD>", "<img src=x>"))
    page = make_report.page(load(tmp_path))
    assert "<img src=x>" not in page and page.count("&lt;img src=x&gt;") > 2


def section(html: str, title: str) -> str:
    part = next(part for part in html.split("<section")[1:] if f">{title}</h2>" in part)
    return re.sub(r"\n(?=<)", "", part)  # cells have no end tags


@pytest.fixture(scope="module")
def html(run):
    return make_report.page(load(run))


def test_failures_and_gaps_are_told(html):
    limits = section(html, "Limitations")
    assert "No times recorded: so101:6." in limits
    assert "Not compared with MuJoCo: ur10e:6." in limits
    assert "3 of 20 states: singular" in limits
    assert "not timed: error 3e-2 &gt; 1e-3" in limits


def test_series_that_are_missing_alike_are_one_line():
    having = {"a:1": "UVWX", "b:2": "UVW", "c:3": "U"}
    rows = [
        Error(scene, variant, "float64", "inverse", 0, "relative", 1e-15, "ok")
        for scene, variants in having.items()
        for variant in variants
    ]
    statements = limitations.section(Data(errors=rows)).statements
    told = [it for it in statements if "only on" in it or "not on" in it]
    assert told == [
        "Inverse M⁻¹: V in float64, W in float64: not on c:3.",
        "Inverse M⁻¹: X in float64: only on a:1.",
    ]


def test_limitations_say_to_what_the_truth_is_proven():
    def told(rows: list[Error]) -> str:
        return " ".join(limitations.section(Data(errors=rows)).statements)

    def row(measure: str, value: float) -> Error:
        return Error("a:1", "", "float64", "model", 0, measure, value, "ok")

    assert "proven" not in told([row("kappa", 3.0)])
    text = told([row("truth_width", 3e-31), row("truth_width", 2e-28), row("kappa", 3.0)])
    assert "In 2 solutions" in text and "relative 2.0e-28" in text


def test_a_robot_beyond_its_bound_fails(html):
    agreement = section(html, "Agreement with MuJoCo")
    overview = agreement.split("<details><summary>")[0]  # the section's own fold has a class
    (row,) = [row for row in overview.split("<tr>") if ">allegro<" in row]
    assert "✗ fail" in row and "3.0e-13" in row
    assert overview.count("✓ pass") == 7


def test_what_was_not_measured_follows_what_was(html, run):
    limits = section(html, "Limitations")
    assert "actuators, constraints, GPUs." in limits
    recursions = make_report.page(load(None, [run / "estimation-chain.json"]))
    assert "derivatives (but for that of log det M)" in section(recursions, "Limitations")
    plain = make_report.page(load(None, [run / "errors-panda-7.csv"]))
    limits = section(plain, "Limitations")
    assert "derivatives, several" in limits and "not a proof" not in limits


def test_every_key_of_the_context_is_shown(html):
    method = section(html, "How it was measured")
    for text in (
        "mhz_per_cpu",
        "-ffp-contract=fast",
        "AMD EPYC 7B13 &lt;made up&gt;",
        "a pool of 61",
        "built as debug",
        "0.90 ns",
    ):
        assert text in method


def rows_of(part: str, first: str) -> list[str]:
    """The table rows whose first cell is this."""
    rows = [row + "<" for row in part.split("<tr")[1:]]
    return [row for row in rows if re.search(rf"<th[^>]*>{first}<", row)]


def test_an_erratum_shows_both_forms_both_residuals_and_why(html):
    errata = section(html, "The paper, checked").split("</table>")[0]
    (row,) = rows_of(errata, r"\(3.12\)")
    assert "Ψ = (I − gH)Φ" in row and "Ψ = (I − ΨgH)Φ" in row
    printed, corrected = re.findall(r">(\d\.\de-?\d+)<", row)
    assert 0.1 < float(printed) < 2 and float(corrected) < 1e-50  # of the chain, in mp
    assert "The closed loop acts at every joint" in errata
    (unevaluable,) = rows_of(errata, r"\(4.2\)")
    assert ">–<" in unevaluable
    assert not rows_of(errata, r"\(1.5\)") and errata.count('class="remark"') == 4


def test_a_scene_where_a_corrected_equation_fails_is_told(html):
    scenes = section(html, "The paper, checked").split("</table>")[1]
    (good,), (bad,) = rows_of(scenes, "panda:7"), rows_of(scenes, "g1:35")
    assert "✓ pass" in good and ">9<" in good and ">4<" in good
    assert "✗ fail" in bad and "(5.5)" in bad and "4.0e9" in bad and "4.0e45" in bad


def test_all_equations_are_folded_and_what_is_beyond_the_paper_is_apart(html):
    _, _, everything, beyond = section(html, "The paper, checked").split("</table>")[:4]
    assert "<details>" in everything and everything.count("✓ pass") == 7
    assert beyond.count("✓ pass") == 2
    (row,) = rows_of(beyond, "trees")
    assert ">tree:14<" in row and not rows_of(everything, "trees")


def test_a_record_in_float64_alone_is_shown_in_float64_alone(tmp_path):
    record = json.dumps(fake_estimation.paper("panda:7", ["float64"]))
    (tmp_path / "paper-panda.json").write_text(record)
    checked = section(make_report.page(load(tmp_path)), "The paper, checked")
    assert "float64: residual" in checked and "mp" not in checked.replace("map", "")
    assert "those of panda:7, in float64" in checked


def test_recursions_have_their_exponents_and_refusals(html):
    cost = section(html, "Cost of the paper’s recursions")
    (gradient,) = rows_of(cost, "log det gradient")
    exponent = float(re.search(r"(\d\.\d\d) ± 0\.0\d", gradient)[1])
    assert exponent == pytest.approx(1, abs=0.03)
    tasks = re.findall(r'<tr><th[^>]*>([^<]*)', cost.split("<tbody>")[1])
    assert tasks == sorted(tasks) and len(tasks) == 6  # the benchmark's own order is random
    assert ">N<" in gradient and rows_of(cost, "inverse")[0].count(">–<") == 2
    (literal,) = rows_of(cost, "operators")
    assert literal.count(">refused<") == 1 and literal.count(">–<") == 5 and ">N³<" in literal
    assert "Not timed: operators at N = 60: singular." in cost
    assert "covariances" not in section(html, "Against N")


def test_rates_and_extrapolated_times_are_right(tmp_path):
    lines = [",".join(SAMPLE_COLUMNS)]
    for method, rate in (("MonteCarlo", -0.75), ("Another", -1)):
        for samples in (100, 400, 1600, 6400):
            error = 0.2 * (samples / 100) ** rate
            lines.append(f"arm:2,2,M,{method},{samples},0,{error},{samples * 2e-6},1")
    lines.append("arm:2,2,M,SigmaPoints,12,0,1e-16,2e-6,1")
    (tmp_path / "simulation-arm.csv").write_text("\n".join(lines))
    part = section(make_report.page(load(tmp_path)), "The mass matrix as a sample covariance")
    cells = [re.findall(r"<t[dh][^>]*>([^<]*)", row) for row in rows_of(part, "arm:2")]
    assert [row[1:] for row in cells] == [
        # 0.2 / 64^0.75 at 6400 samples: 8839² times as many at the known rate, 2 µs a sample
        ["M", "MonteCarlo", "−0.75 ± 0.00", "6400", "1", "8.8e-3", "2.00 µs", "≈ 11.6 days"],
        ["M", "SigmaPoints", "–", "12", "1", "1.0e-16", "167 ns", "2.00 µs"],
        # 1/320 at 6400 samples: 3125 times as many
        ["M", "Another", "−1.00 ± 0.00", "6400", "1", "3.1e-3", "2.00 µs", "≈ 40.0 s"],
    ]
    assert "Antithetic pairs" not in part and "Sigma points are exact" in part


def test_a_figure_of_the_paper_alone_is_refused(run, out):
    svg = out.with_name("figure.svg")
    result = report("--files", run / "paper-chain-6.json", "--figure", svg)
    assert_refused(result, "errors and times")


def test_the_answer_of_a_robot_says_what_was_ignored_of_it(html):
    assert "Ignored: 7 actuators." in section(html, "What to take")


def test_the_page_is_of_a_size_that_loads(html):
    assert len(html.encode()) < 3_000_000


def test_folders_of_the_executable_stay_out(run):
    data = load(run, None)
    data.contexts[0]["executable"] = "somebody/build/bin/bench_inverse"
    assert "bench_inverse" in distinct(data.contexts, "executable")
    assert not any("somebody" in name for name in distinct(data.contexts, "executable"))
