"""The filter as a scan on the page, from records whose numbers are known."""

import pytest

import alt_scene
import fake_scans
from charts import scans as scan_charts
from charts.common import VIEW, Style
from charts.scans import BOUND, SIZE
from read.data import Data, DataError
from read.readers import load
from read.scans import ERRORS, FLOPS
from records import timed
from sections import scans
from summary.scans import (
    Flops,
    Machine,
    Scanned,
    checks,
    family,
    links_of_block,
    machine,
    predicted,
    scanned,
)

SCAN = "Scan<Conventional>"
# 1000 flops in 1000 ns besides 100 of kinematics; on two processors 550 flops one after another.
KNOWN = Scanned(
    "straight:100", 100, SCAN, 4, {1: 1100.0, 2: 975.0}, {}, {4: Flops(1000, 100)}, bytes=600.0
)
IDEAL = Machine({100: 100.0}, {})
COPY = "bandwidth/copy@2/none:0/float64"
CALL = f"acceleration/{SCAN}@2/straight:100/float64"
ERROR = f"straight,100,100,1,float64,random,{SCAN},4,balanced,5,0,ok,3e-16"
COUNTED = f"straight,100,100,1,factor,{SCAN},4,5,1,2000"


def text(header: list[str], *rows: str) -> str:
    return "\n".join([",".join(header), *rows]) + "\n"


def csv(rows: list[list]) -> str:
    return "\n".join(",".join(map(str, row)) for row in rows) + "\n"


@pytest.fixture
def made_up(read) -> Data:
    read("scan-straight.json", {"benchmarks": fake_scans.times()})
    read("scans-straight.csv", csv(fake_scans.errors()))
    return read("spans-straight.csv", csv(fake_scans.flops()))


def test_processors_share_all_but_the_span():
    flops = Flops(1000, 100)
    assert [flops.on(processors) for processors in (1, 2, 9, 10**9)] == pytest.approx(
        [1000, 550, 200, 100]
    )


def test_the_time_predicted_is_of_kinematics_and_flops_at_the_rate_of_one_thread():
    assert predicted(KNOWN, 4, 1, IDEAL) == pytest.approx(1100)
    assert predicted(KNOWN, 4, 2, IDEAL) == pytest.approx(650)
    assert predicted(KNOWN, 4, 2, Machine({}, {})) == pytest.approx(1100 * 0.55)
    other = Scanned(**{**vars(KNOWN), "flops": {4: Flops(1000, 100), 8: Flops(700, 150)}})
    assert predicted(other, 8, 1, IDEAL) == pytest.approx(800)


def test_memory_bounds_the_time_and_bandwidth_grows_up_to_what_was_measured():
    slow = Machine({}, {1: 1e9, 2: 1.5e9})
    assert [slow.bandwidth(processors) for processors in (1, 2, 100)] == [1e9, 1.5e9, 1.5e9]
    assert predicted(KNOWN, 4, 10, slow) == pytest.approx(400)
    assert predicted(KNOWN, 4, 10, slow, memory=False) == pytest.approx(1100 * 0.19)
    assert predicted(KNOWN, 4, 2, slow) == pytest.approx(605)  # arithmetic takes longer
    assert Machine({}, {2: 1e9}).bandwidth(2) is None


def test_nothing_is_predicted_from_what_is_not_known():
    assert predicted(KNOWN, 8, 2, IDEAL) is None
    assert predicted(KNOWN, 4, 2, Machine({100: 1100.0}, {})) is None
    assert predicted(Scanned("a:100", 100, SCAN, 4, {2: 9.0}, {}, KNOWN.flops), 4, 2, IDEAL) is None


def test_a_prediction_is_checked_on_several_threads():
    assert checks([KNOWN], IDEAL) == [(KNOWN, 2, pytest.approx(1.5))]


def test_blocks_that_are_timed_have_their_links_by_the_number_of_links():
    assert [links_of_block(n) for n in (1, 100, 1000, 10**4, 10**6)] == [4, 4, 15, 156, 1024]


def test_records_are_joined_by_variant_and_n(made_up):
    found = {(it.variant, it.n): it for it in scanned(made_up)}
    it = found[SCAN, 1000]
    assert (it.links, it.times) == (15, {1: 900e3, 2: 480e3})
    assert it.timed_errors == {"random": 4e-16, "dynamics": pytest.approx(12e-16)}
    assert list(it.errors) == [15, 30]
    assert it.timed == pytest.approx((2570e3, 2570 * 32.5)) and list(it.flops) == [15, 30]
    assert it.bytes == 4e6
    sequence = found["Sequential<Conventional>", 1000]
    assert (sequence.links, sequence.timed) == (0, (742e3, 742e3))
    assert found["Ladder<default>", 100].times == {1: 2500.0}
    assert machine(made_up) == Machine({n: 30.0 * n for n in fake_scans.SIZES}, fake_scans.COPIED)


def test_bandwidth_is_the_median_of_the_files(read):
    for family, rate in (("straight", 1e9), ("chain", 4e9), ("tree", 2e9)):
        call = CALL.replace("straight", family)
        rows = [timed(call), timed(COPY) | {"bytes_per_second": rate}]
        data = read(f"scan-{family}.json", {"benchmarks": rows})
    assert machine(data).bandwidths == {2: 2e9}


def test_errors_are_medians_over_the_seeds_of_balanced_blocks(read):
    rows = [ERROR.replace("100,1,", f"100,{seed},") for seed in (1, 2, 3)]
    rows[1] = rows[1].replace("3e-16", "9e-16")
    rows += [ERROR.replace("balanced", "tips_first"), ERROR.replace(",4,", ",8,")]
    rows += [ERROR.replace("float64", "float32"), ERROR.replace("ok,3e-16", "singular,")]
    rows[-1] = rows[-1].replace("100,1,", "100,4,")
    (it,) = scanned(read("scans-a.csv", text(ERRORS, *rows)))
    assert it.errors == {4: {"random": 3e-16}, 8: {"random": 3e-16}}


def test_the_family_is_the_one_with_most_kinds_of_records(read):
    read("scans-a.csv", text(ERRORS, ERROR.replace("straight", "wide"), ERROR))
    data = read("scan-a.json", {"benchmarks": [timed(CALL), timed(CALL.replace("ght:1", "ght:2"))]})
    assert family(data) == "straight" and family(Data()) is None


def test_without_scans_there_is_no_section():
    assert scans.section(Data()) is None


def test_the_figures_draw_every_n_thread_and_number_of_processors(made_up):
    found = scans.section(made_up)
    by_title = {figure.title: figure for figure in found.figures}
    assert list(by_title) == [
        "error against run time",
        "error against span",
        "time on any number of processors",
    ]
    counts = [sum(map(len, alt_scene.marks(it.chart, "symbol"))) for it in by_title.values()]
    processors = len(scan_charts.PROCESSORS)
    assert counts == [3 * 6, 3 * (2 + 2 * 2), 2 * 2 * processors + 2 * 2]
    assert len(sum(alt_scene.marks(found.figures[2].chart, "rule"), [])) == 3
    assert found.choices[0].first == "dynamics"
    size, bound = found.figures[2].choices
    assert (size.signal, size.first, bound.signal, bound.first) == (SIZE, "10000", BOUND, "memory")


def test_a_point_stands_at_its_time_and_span(made_up):
    found = [it for it in scanned(made_up) if it.errors and it.n == 100 and it.variant == SCAN]
    style = Style([SCAN], [])
    for draw, field, values in (
        (scan_charts.error_against_time, "time", {9e4, 4.8e4}),
        (scan_charts.error_against_span, "span", {2570.0 * 16, 2570.0 * 22}),
    ):
        (rows,) = draw(found, style, {VIEW: "random"}).to_dict()["datasets"].values()
        assert {row[field] for row in rows} == values
        assert {row["error"] for row in rows if row[VIEW] == "random"} == {4e-16}


def test_what_is_missing_leaves_its_figure_out(read):
    read("scans-straight.csv", csv(fake_scans.errors()))
    data = read("spans-straight.csv", csv(fake_scans.flops()))
    assert [figure.title for figure in scans.section(data).figures] == ["error against span"]
    rows = [row for row in fake_scans.times() if row["name"].startswith("acceleration")]
    rows = [{key: row[key] for key in row if key != "bytes"} for row in rows]
    found = scans.section(read("scan-straight.json", {"benchmarks": rows}))
    assert [choice.signal for choice in found.figures[2].choices] == [SIZE]
    text = " ".join(found.statements)
    assert "arithmetic alone, since bandwidth was not measured" in text
    assert "was not timed apart" in text


def test_errors_alone_are_not_drawn(read):
    assert scans.section(read("scans-straight.csv", csv(fake_scans.errors()))) is None


def test_the_table_compares_with_the_filter_in_sequence_and_the_fast_path(made_up):
    (table,) = scans.section(made_up).tables
    row = next(row for row in table.rows if row[1] == SCAN)
    # 2570 flops over 742 of a link; span 2570 (1.5 · 4 + 10); T(2) = 3 + 87 W(2) / W(1) µs
    assert row == [
        *("100", SCAN, "4", "3.46", "41\u202f100", "1.80", "90.0 µs", "48.0 µs", "0.62", "0.052"),
        "0.90",
    ]
    assert any(
        "Scan<Conventional> on 2 threads 0.90 to" in text
        for text in scans.section(made_up).statements
    )


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("scans-a.csv", "family,n\n", "header is not family,value,n,seed,precision"),
        ("scans-a.csv", text(ERRORS, ERROR[:-1] + "x"), "2: error is '3e-1x'"),
        ("scans-a.csv", text(ERRORS, ERROR.replace("3e-16", "-1")), "2: error is '-1'"),
        ("scans-a.csv", text(ERRORS, ERROR.replace("balanced", "best")), "2: order is 'best'"),
        ("scans-a.csv", text(ERRORS, ERROR.replace("float64", "mp")), "2: precision is 'mp'"),
        ("scans-a.csv", text(ERRORS, ERROR.replace("100,1,", "0,1,")), "2: n is '0'"),
        ("scans-a.csv", text(ERRORS, ERROR.replace(SCAN, "")), "2: variant is ''"),
        ("scans-a.csv", text(ERRORS, ERROR, ERROR), "error of a scan .* recorded 2 times"),
        ("spans-a.csv", "family,n\n", "header is not family,value,n,seed,task"),
        ("spans-a.csv", text(FLOPS, COUNTED.replace("factor", "all")), "2: task is 'all'"),
        ("spans-a.csv", text(FLOPS, COUNTED.replace(",2000", ",0")), "2: flops is '0'"),
        ("spans-a.csv", text(FLOPS, COUNTED.replace("1,2000", "-1,2000")), "2: processors is '-1'"),
        ("spans-a.csv", text(FLOPS, COUNTED, COUNTED), "flops of a scan .* recorded 2 times"),
        ("scan-a.json", {"context": {}}, "'benchmarks' is missing"),
        ("scan-a.json", {"benchmarks": [timed(CALL.replace("@2", "@0"))]}, "ran on 0 threads"),
        ("scan-a.json", {"benchmarks": [timed(CALL.replace("@2", "@x"))]}, "ran on x threads"),
        ("scan-a.json", {"benchmarks": [timed(CALL) | {"bytes": -1}]}, "bytes is -1"),
        ("scan-a.json", {"benchmarks": [timed(COPY)]}, "has no bytes_per_second"),
        ("scan-a.json", {"benchmarks": [timed(COPY) | {"bytes_per_second": 1e9}]}, "no data"),
    ],
)
def test_what_is_no_record_of_a_scan_is_refused(read, name, content, message):
    with pytest.raises(DataError, match=message):
        read(name, content)


def test_what_two_files_time_is_refused(read, tmp_path):
    read("scan-a.json", {"benchmarks": [timed(CALL)]})
    (tmp_path / "scan-b.json").write_text((tmp_path / "scan-a.json").read_text())
    with pytest.raises(DataError, match="time of a scan of straight:100/.* recorded 2 times"):
        load(tmp_path)


def test_a_variant_that_was_refused_has_no_time(read):
    wrong = timed(CALL, error_occurred=True, error_message="wrong acceleration")
    assert scanned(read("scan-a.json", {"benchmarks": [wrong]})) == []
