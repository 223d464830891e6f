"""The roofline, of calls and machines whose place on it is known."""

import pytest

import alt_scene
from charts import roofline as roofline_charts
from charts.common import Style
from charts.roofline import ROBOT
from read.data import Bandwidth, Data
from records import peak as peak_of
from records import timed
from sections import peak
from summary.roofline import ARITHMETIC, MEMORY, placed

FAST = "Ladder<default>"
KIB, MIB = 2**10, 2**20
PEAK = 40e9  # FLOP/s
COPIES = {32 * KIB: 20e9, 512 * KIB: 10e9, 512 * MIB: 5e9}  # bytes/s by bytes
MACHINE = [peak_of("float64", PEAK)]
MACHINE += [
    timed(f"bandwidth/copy@1/bytes:{size}/float64/real_time", bytes_per_second=rate)
    for size, rate in COPIES.items()
]


def counted(name: str, flops: float, size: float, rate: float, states: int = 1) -> dict:
    """A call on so many states that did its flops at this rate."""
    seconds = flops / rate
    row = timed(f"{name}/float64", real_time=1e9 * seconds * states, flops=flops, bytes=size)
    row |= {"cpu_time": row["real_time"], "FLOP/s": rate}
    return row | ({"s/state": seconds} if states > 1 else {})


@pytest.fixture
def drawn(read):
    """The data of a file of peers with these rows."""
    return lambda *rows: read("peers-a.json", {"benchmarks": rows})


def only(data: Data):
    (it,) = placed(data)
    return it


@pytest.mark.parametrize(
    "flops, rate, roof, bound",
    [
        (1000, 10e9, 20e9, MEMORY),  # one flop a byte
        (8000, 30e9, 40e9, ARITHMETIC),  # eight
        (2000, 20e9, 40e9, ARITHMETIC),  # on the ridge
    ],
)
def test_the_lower_roof_bounds_a_call(drawn, flops, rate, roof, bound):
    it = only(drawn(*MACHINE, counted(f"mass/{FAST}/arm:7", flops, 1000, rate)))
    assert it.intensity == flops / 1000
    assert (it.roof, it.bound) == (pytest.approx(roof), bound)
    assert it.share == pytest.approx(rate / roof)


@pytest.mark.parametrize(
    "size, states, copied",
    [
        (100, 1, 32 * KIB),  # smaller than all that was copied
        (32 * KIB, 1, 32 * KIB),
        (1000, 512, 32 * KIB),
        (1024, 512, 512 * KIB),
        (100 * KIB, 1024, 512 * KIB),
        (2 * MIB, 1024, 512 * MIB),
    ],
)
def test_bandwidth_is_that_of_a_copy_of_no_larger_arrays(drawn, size, states, copied):
    call = counted(f"mass_batch/{FAST}/arm:7", size, size, 1e9, states)
    it = only(drawn(*MACHINE, call))
    assert it.arrays == size * states
    assert it.copy == Bandwidth(1, COPIES[copied], copied)
    assert it.roof == pytest.approx(COPIES[copied])


def test_copies_of_several_threads_are_of_another_machine(drawn):
    other = timed("bandwidth/copy@2/bytes:1024/float64", bytes_per_second=9e9)
    call = counted(f"mass/{FAST}/arm:7", 1000, 1000, 1e9)
    assert only(drawn(*MACHINE, other, call)).copy.bytes == 32 * KIB
    assert placed(drawn(peak_of("float64", PEAK), other, call)) == []


def test_the_fastest_call_of_each_task_and_scene_is_placed(drawn):
    data = drawn(
        *MACHINE,
        counted(f"mass/{FAST}/arm:7", 1000, 1000, 1e9),
        counted(f"mass/{FAST}@clang/arm:7", 1000, 1000, 2e9),
        counted(f"mass/{FAST}/arm:9", 1000, 1000, 1e9),
        counted(f"mass_batch/{FAST}/arm:7", 1000, 1000, 1e9, 64),
        timed("mass/KDL/arm:7/float64", real_time=1.0),
    )
    found = [(it.call.time.scene, it.call.time.task, it.call.time.variant) for it in placed(data)]
    assert found == [
        ("arm:7", "mass", f"{FAST}@clang"),
        ("arm:9", "mass", FAST),
        ("arm:7", "mass_batch", FAST),
    ]


@pytest.mark.parametrize("missing", ["bytes", "flops", "FLOP/s", "peak", "bandwidth"])
def test_without_one_of_its_numbers_there_is_no_roofline(drawn, missing):
    call = counted(f"mass/{FAST}/arm:7", 1000, 1000, 1e9)
    machine = [row for row in MACHINE if not row["name"].startswith(missing)]
    call = {name: value for name, value in call.items() if name != missing}
    data = drawn(*machine, call)
    assert placed(data) == []
    section = peak.section(data)
    if missing in ("peak", "FLOP/s"):
        assert section is None
    else:
        assert [figure.title for figure in section.figures] == ["share of the peak"]
        assert section.tables == [] and "A roofline is not drawn" in section.paragraphs[1]


def test_the_section_says_what_bounds_which_call(drawn):
    data = drawn(
        *MACHINE,
        counted(f"mass/{FAST}/arm:7", 1000, 1000, 10e9),
        counted(f"mass_batch/{FAST}/arm:7", 8000, 1000, 10e9, 1024),
    )
    section = peak.section(data)
    assert [figure.title for figure in section.figures] == ["roofline", "share of the peak"]
    (table,) = section.tables
    shares = [dict(zip((it.title for it in table.columns), row)) for row in table.rows]
    columns = "Operations a byte", "Rate [GFLOP/s]", "Roof [GFLOP/s]", "Share", "Bound by"
    assert [[row[name] for name in columns] for row in shares] == [
        ["1.00", "10.0", "20.0", "50 %", "memory"],
        ["8.00", "10.0", "40.0", "25 %", "arithmetic"],
    ]
    assert section.statements == [
        "Memory is the lower roof of 1 of 2 calls of the roofline: M of arm:7."
    ]


def items(chart, kind: str) -> list[dict]:
    return [item for layer in alt_scene.marks(chart, kind) for item in layer]


def test_a_call_at_its_roof_stands_on_it_and_others_below(drawn):
    data = drawn(
        *MACHINE,
        counted(f"mass/{FAST}/arm:7", 1000, 1000, 20e9),  # all that memory allows
        counted(f"inverse/{FAST}/arm:7", 4000, 1000, 10e9),  # a quarter of the peak
    )
    chart = roofline_charts.roofline(placed(data), Style([FAST], ["float64"]), {ROBOT: "arm:7"})
    marks = {item["description"].split("task: ")[1][:4]: item for item in items(chart, "symbol")}
    at_roof, below = marks["Mass"], marks["Inve"]
    assert below["x"] > at_roof["x"] and below["y"] > at_roof["y"]
    (peak_line,) = [rule for rule in items(chart, "rule") if rule.get("y2") == rule["y"]][:1]
    octave = at_roof["y"] - peak_line["y"]  # from 20 to 40 GFLOP/s
    assert octave > 5
    assert below["y"] - peak_line["y"] == pytest.approx(2 * octave, rel=0.02)
    texts = alt_scene.texts(chart)
    assert {"float64: 40.0 GFLOP/s", "copies of 32.0 KiB: 20.0 GB/s"} <= texts
    assert "copies of 512 MiB: 5.00 GB/s" in texts and "copies of 512 KiB: 10.0 GB/s" not in texts
    assert "share of the roof: 25 %" in below["description"]
