"""The sections of the fast path and its peers, on times whose ratios are known."""

import json

import pytest

import make_report
from read.data import Data
from read.readers import load
from sections import fast_path, peak, peers


def call(name: str, nanoseconds: float | None, **counters) -> dict:
    row = {"name": name, "run_name": name, "run_type": "iteration", "time_unit": "ns"}
    if nanoseconds is None:
        return row | {"error_occurred": True, "error_message": "wrong: error 0.3"}
    return row | {"real_time": nanoseconds, "cpu_time": nanoseconds} | counters


@pytest.fixture
def read(tmp_path):
    def read(*rows: dict, kind: str = "peers", **context) -> Data:
        document = {"context": context, "benchmarks": rows}
        (tmp_path / f"{kind}-a.json").write_text(json.dumps(document))
        return load(tmp_path)

    return read


def tables(section, task: str) -> tuple[list[list[str]], dict[str, list[list[str]]]]:
    """The overview's rows, and by caption those of the bars, without the bars."""
    shown = [table for table in section.tables if table.shown == {"task": task}]
    overview = [table for table in shown if not table.style]
    bars = {
        table.caption: [[str(cell) for cell in row if "<span" not in cell] for row in table.rows]
        for table in shown
        if table.style
    }
    return (overview[0].rows if overview else []), bars


SMALL = [
    call("acceleration/Ladder<default>/arm:7/float64", 400),
    call("acceleration/AxisFrames<SquareRoot>/arm:7/float64", 1600),
    call("acceleration/Pinocchio<LOCAL>@clang/arm:7/float64", 1000),
    call("acceleration/MuJoCo/arm:7/float64", 2000),
]


def test_each_time_is_set_against_the_best_peer(read):
    overview, bars = tables(peers.section(read(*SMALL)), "acceleration")
    best = ["Pinocchio<LOCAL>@clang", "1.00 µs"]
    ours = ["Ladder<default>", "400 ns"]
    assert overview == [["arm:7", "float64", *ours, *best, "2.50 times faster"]]
    assert bars["arm, N = 7: Acceleration a = M⁻¹(τ − bias)"] == [
        [
            "<strong>Ladder&lt;default&gt;</strong>",
            "400 ns",
            "2.50 times faster",
            "float64",
            "ours",
        ],
        ["Pinocchio<LOCAL>@clang", "1.00 µs", "best peer", "float64", "peer"],
        [
            "<strong>AxisFrames&lt;SquareRoot&gt;</strong>",
            "1.60 µs",
            "1.60 times slower",
            "float64",
            "ours",
        ],
        ["MuJoCo", "2.00 µs", "2.00 times slower", "float64", "peer"],
    ]


def test_ours_is_the_fastest_of_each_precision_against_float64(read):
    rows = [
        call(
            f"acceleration_batch/{variant}/arm:7/{precision}",
            1e12 * seconds,
            **{"s/state": seconds},
        )
        for variant, precision, seconds in (
            ("Ladder<default>", "float64", 200e-9),
            ("Ladder<default>@clang", "float64", 100e-9),
            ("Ladder<default>", "float32", 50e-9),
            ("MuJoCo", "float64", 1e-6),
        )
    ]
    overview, bars = tables(peers.section(read(*rows)), "acceleration_batch")
    assert [row[1:4] + row[-1:] for row in overview] == [
        ["float64", "Ladder<default>@clang", "100 ns", "10.0 times faster"],
        ["float32", "Ladder<default>", "50.0 ns", "20.0 times faster"],
    ]
    (rows,) = bars.values()
    assert [row[1] for row in rows] == ["50.0 ns", "100 ns", "200 ns", "1.00 µs"]


def test_what_is_missing_is_told_with_its_reason(read):
    data = read(
        *SMALL,
        call("acceleration/DART/arm:7/float64", None),
        call("acceleration/Ladder<default>/leg:9/float64", 500),
        call("mass/Ladder<default>/arm:7/float64", 100),
        call("mass/KDL/arm:7/float64", 200),
    )
    section = peers.section(data)
    _, bars = tables(section, "acceleration")
    arm, leg = bars.values()
    assert arm[-1] == ["Missing: DART in float64 (wrong: error 0.3), KDL (has no such call)"]
    (missing,) = leg[-1]
    assert "Pinocchio (not measured on this scene), MuJoCo (not measured" in missing
    assert leg[0][2] == "–"  # no peer to be set against
    (absent,) = [text for text in section.statements if text.startswith("Not in this run")]
    assert "Simbody, Bullet. bench_peers" in absent


def test_versions_and_what_a_call_includes_are_told(read):
    data = read(*SMALL, peers="MuJoCo 4.0.0", timed_call="all of it")
    statements = peers.section(data).statements
    assert statements[:2] == ["A timed call: all of it", "Versions: MuJoCo 4.0.0."]


def test_the_share_of_the_peak_is_that_of_the_same_precision(read):
    counted = {"flops": 3000, "FLOP/s": 30e9}
    data = read(
        call("peak/fma/native/float64", 1, **{"FLOP/s": 60e9}),
        call("peak/fma/native/float32", 1, **{"FLOP/s": 120e9}),
        call("acceleration/Ladder<default>/arm:7/float64", 100, **counted),
        call("acceleration/Ladder<default>/arm:7/float32", 100, **counted),
        call("acceleration/MuJoCo/arm:7/float64", 1000),
    )
    section = peak.section(data)
    assert "120 GFLOP/s in float32, 60.0 GFLOP/s in float64" in section.paragraphs[0]
    (figure,) = section.figures
    rows = [row for rows in figure.chart.to_dict()["datasets"].values() for row in rows]
    shares = {(row["variant"], row["precision"]): row["share"] for row in rows if "share" in row}
    fast = "Ladder<default>"
    assert shares == {(fast, "float64"): 0.5, (fast, "float32"): 0.25}


def test_without_a_peak_or_without_rates_there_is_no_share(read):
    assert peak.section(read(*SMALL)) is None
    rated = call("mass/Ladder<default>/arm:7/float64", 100, **{"FLOP/s": 1e9})
    assert peak.section(read(*SMALL, rated)) is None


def test_the_fast_path_is_set_against_one_state_of_the_plain_variant(read):
    plain = "Sequential<Conventional>"
    data = read(
        call(f"acceleration/{plain}/arm:7/float64", 2000),
        call("acceleration/Ladder<default>/arm:7/float64", 500),
        call("acceleration_batch/Ladder<default>/arm:7/float64", 1e5, **{"s/state": 100e-9}),
        call(
            "acceleration_batch/Ladder<default>@all cores/arm:7/float64",
            1e5,
            **{"s/state": 50e-9},
        ),
        call("acceleration/Ladder<default>/arm:7/float32", 400),
        call("acceleration/AxisFrames<SquareRoot>/arm:7/float64", None),
        kind="dynamics",
    )
    (table,) = fast_path.section(data).tables
    assert table.rows == [
        ["arm:7", plain, "float64", "2.00 µs", "1.0", "–", "–"],
        ["arm:7", "AxisFrames<SquareRoot>", "float64", "refused", "–", "–", "–"],
        ["arm:7", "Ladder<default>", "float32", "400 ns", "–", "–", "–"],
        ["arm:7", "Ladder<default>", "float64", "500 ns", "4.0", "100 ns", "20.0"],
        ["arm:7", "Ladder<default>@all cores", "float64", "–", "–", "50.0 ns", "40.0"],
    ]


def test_without_their_data_nothing_is_said_of_peers(run):
    files = [run / "errors-chain-31.csv", run / "times-chain-31.json"]
    data = load(None, files)
    assert not any(module.section(data) for module in (fast_path, peak, peers))
    html = make_report.page(data)
    assert "Pinocchio" not in html and "peers are timed" not in html
