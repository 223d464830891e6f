"""What a square root costs, on times whose ratios are known."""

import json

import pytest

from read.data import Data
from read.readers import DataError, load
from sections import square_roots

BATCH = 1000


def call(name: str, nanoseconds: float, states: int = 1, flops: float = 4000) -> dict:
    row = {"name": name, "run_name": name, "run_type": "iteration", "time_unit": "ns"}
    row |= {"real_time": nanoseconds * states, "cpu_time": nanoseconds * states, "flops": flops}
    return row | ({"s/state": 1e-9 * nanoseconds} if states > 1 else {})


@pytest.fixture
def read(tmp_path):
    def read(*rows: dict) -> Data:
        document = {"context": {"timed_call": "all of it"}, "benchmarks": rows}
        (tmp_path / "generated-a.json").write_text(json.dumps(document))
        return load(tmp_path)

    return read


ROWS = (
    call("acceleration/Generated<Sequential<UD>>/arm:7/float64", 500, flops=5000),
    call("acceleration/Generated<Sequential<Conventional>>/arm:7/float64", 400),
    call("acceleration_batch/Generated<Sequential<Conventional>>/arm:7/float32", 20, BATCH),
    call("acceleration_batch/Generated<Sequential<UD>>/arm:7/float32", 30, BATCH),
)


def test_every_update_is_set_against_the_conventional_one(read):
    section = square_roots.section(read(*ROWS))
    assert section.tables[0].rows == [
        ["arm:7", "Sequential<Conventional>", "4\u202f000"]
        + ["400 ns", "1.00", "–", "–", "–", "–", "20.0 ns", "1.00"],
        ["arm:7", "Sequential<UD>", "5\u202f000"]
        + ["500 ns", "1.25", "–", "–", "–", "–", "30.0 ns", "1.50"],
    ]
    assert len(section.tables) == 1  # no M^-1


def test_what_was_not_compiled_is_refused(read):
    refused = {key: ROWS[0][key] for key in ("name", "run_name", "run_type", "time_unit")}
    refused |= {"error_occurred": True, "error_message": "no compiler"}
    section = square_roots.section(read(refused, ROWS[1]))
    assert section.tables[0].rows[1] == ["arm:7", "Sequential<UD>", "–", "refused", *7 * "–"]
    assert section.statements[-1] == "Refused at arm:7: no compiler."
    alone = square_roots.section(read(refused))
    assert not alone.tables and alone.statements == section.statements


def test_code_for_one_robot_is_of_the_first_figure_alone(read):
    data = read(*ROWS)
    assert not data.times
    assert {call.time.variant for call in data.ladder_calls} == {
        "Generated<Sequential<Conventional>>",
        "Generated<Sequential<UD>>",
    }


def test_without_records_there_is_no_section():
    assert square_roots.section(Data()) is None


def test_a_count_that_is_none_is_refused(read):
    with pytest.raises(DataError, match="flops"):
        read(call("acceleration/Generated<Sequential<UD>>/arm:7/float64", 500, flops=-1))
