"""The program: what it writes, and what it refuses to write."""

import re
import shutil
import subprocess
import sys

import pytest

import make_report
from conftest import REPORTS
from data import load
from sections.method import distinct


def report(*arguments) -> subprocess.CompletedProcess:
    command = [sys.executable, REPORTS / "make_report.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


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
    result = report("--files", *files, "--out", out, "--figure", out.with_name("figure.svg"))
    assert (result.returncode, result.stderr) == (0, "")
    assert sorted(path.name for path in out.parent.iterdir()) == ["figure.svg", "index.html"]
    assert out.with_name("figure.svg").read_text().startswith("<svg")
    assert "panda" in out.read_text() and "iiwa14" not in out.read_text()


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
    return next(part for part in html.split("<section")[1:] if f">{title}</h2>" in part)


@pytest.fixture(scope="module")
def html(run):
    return make_report.page(load(run))


def test_failures_and_gaps_are_told(html):
    limits = section(html, "Limitations")
    assert "No times recorded: so101:6." in limits
    assert "Not compared with MuJoCo: ur10e:6." in limits
    assert "3 of 20 states: singular" in limits
    assert "not timed: error 3e-2 &gt; 1e-3" in limits


def test_a_robot_beyond_its_bound_fails(html):
    agreement = section(html, "Agreement with MuJoCo")
    overview = agreement.split("<details")[0]
    (row,) = [row for row in overview.split("<tr>") if ">allegro<" in row]
    assert "✗ fail" in row and "3.0e-13" in row
    assert overview.count("✓ pass") == 7


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


def test_at_a_glance_names_the_fastest_variant(run):
    data = load(None, [run / "errors-panda-7.csv", run / "times-panda-7.json"])
    times = {
        t.variant: t.nanoseconds
        for t in data.times
        if (t.task, t.precision) == ("inverse", "float64")
    }
    glance = section(make_report.page(data), "At a glance")
    fastest = min(times, key=times.get).replace("<", "&lt;").replace(">", "&gt;")
    assert f"{fastest}<br>{times[min(times, key=times.get)]:.0f} ns" in glance


def test_the_page_is_of_a_size_that_loads(html):
    assert len(html.encode()) < 6_000_000


def test_folders_of_the_executable_stay_out(run):
    data = load(run, None)
    data.contexts[0]["executable"] = "somebody/build/bin/bench_inverse"
    assert "bench_inverse" in distinct(data, "executable")
    assert not any("somebody" in name for name in distinct(data, "executable"))
