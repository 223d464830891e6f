"""What stress recorded is read as it is, or refused by file and line; medians and silence."""

import json
import math
import re

import pytest

import fake_stress
from read.data import Data, DataError
from read.laboratory import Point
from read.readers import INTEGRATION_COLUMNS, load
from read.stress import COLUMNS
from sections import choosing, digits, wild

HEADER = ",".join(COLUMNS)
MGS = "Sequential<ArrayMGS>"
ROW = {
    "family": "heavy_tip",
    "value": "1e4",
    "n": "12",
    "seed": "1",
    "precision": "float64",
    "task": "random",
    "kappa": "1e6",
    "kappa_scaled": "1e5",
    "kS": "10",
    "variant": MGS,
    "status": "ok",
    "relative": "1e-15",
    "eta": "0.9",
}
INTEGRATION = "heavy_tip,1e8,8,1,float64,FactoredBias<ArrayMGS>,134,1,1e-12"


def line(**changed) -> str:
    row = ROW | {name: str(value) for name, value in changed.items()}
    return ",".join(row.get(name, "") for name in COLUMNS)


@pytest.fixture
def read(tmp_path):
    def read(*lines: str, name: str = "stress-0.csv", header: str = HEADER) -> Data:
        (tmp_path / name).write_text("\n".join([header, *lines, ""]))
        listed = tmp_path / "families-stress.json"
        if not listed.exists():
            listed.write_text(json.dumps(fake_stress.described()))
        return load(tmp_path)

    return read


def test_a_row_keeps_its_parts_and_what_is_empty_is_no_number(read):
    stress = read(line()).stress
    assert stress.texts("variant") == [MGS] and stress.texts("warning") == [""]
    assert (stress["value"], stress["kS"], stress["relative"]) == (1e4, 10, 1e-15)
    assert math.isnan(stress["estimate"][0]) and math.isnan(stress["P_min"][0])


def test_shards_are_one(read):
    read(line())
    stress = read(line(seed=2, variant="Batch<EigenLLT>"), name="stress-1.csv").stress
    assert stress.texts("variant").tolist() == [MGS, "Batch<EigenLLT>"]
    assert stress["seed"].tolist() == [1, 2]


def test_what_two_shards_record_is_refused(read):
    read(line())
    with pytest.raises(DataError, match="heavy_tip/10000/12/1/float64/random/Seq.* 2 times"):
        read(line(), name="stress-1.csv")


def test_tasks_of_wild_mechanisms_are_a_choice(read):
    data = read(
        line(family="wild", value=0, task="dynamics"), line(family="wild", value=0, task="white")
    )
    section = wild.section(data)
    assert [value for value, _ in section.choices[0].options] == ["white", "dynamics"]
    assert [table.first for table in section.tables] == [True, False]


@pytest.mark.parametrize(
    "changed, message",
    [
        ({"relative": "x"}, "could not convert.*'x'"),
        ({"relative": "-1"}, "relative is negative"),
        ({"relative": ""}, "status is ok, and relative is no number"),
        ({"relative": "nan"}, "status is ok, and relative is no number"),
        ({"status": "singular"}, "status is not ok, and relative is a number"),
        ({"status": "odd"}, "status 'odd' is none of ok, singular"),
        ({"warning": "odd"}, "warning 'odd' is none of near_singular, inaccurate"),
        ({"precision": "float16"}, "precision 'float16' is none of float32, float64"),
        ({"family": ""}, "family is empty"),
        ({"seed": "1.5"}, "seed is no whole number"),
        ({"value": "nan"}, "value is not finite"),
        ({"kappa": "-2"}, "kappa is negative"),
        ({"P_asymmetry": "1,2"}, f"not {len(COLUMNS)} values"),
    ],
)
def test_a_malformed_row_is_refused_with_its_file_and_line(read, changed, message):
    with pytest.raises(DataError, match=f"stress-0.csv:3: .*{message}"):
        read(line(), line(**({"seed": 2} | changed)), line(seed=3))


def test_the_line_is_right_beyond_the_first_block(read, monkeypatch):
    monkeypatch.setattr("read.stress_files.BLOCK", 2)
    lines = [line(seed=seed) for seed in range(6)]
    with pytest.raises(DataError, match="stress-0.csv:6:"):
        read(*lines[:4], line(relative="x"), *lines[4:])


def test_another_header_is_refused(read):
    with pytest.raises(DataError, match="header is not family,value"):
        read(line(), header="family,value")


def test_no_row_is_no_data(read):
    with pytest.raises(DataError, match="no data"):
        read()


def test_a_singular_mechanism_may_be_answered_without_a_right_answer(read):
    row = line(family="gimbal_lock", value=0, relative="", eta="")
    lab = read(row).laboratory
    assert lab.points == [] and len(lab.impossible) == 1


@pytest.mark.parametrize(
    "row, message",
    [
        (INTEGRATION.replace("134,1", "134,maybe"), "integration-0.csv:2: finished is 'maybe'"),
        (INTEGRATION.replace("64", "16"), "precision is 'float16'"),
        (INTEGRATION.replace("134", "1.5"), "integration-0.csv:2: .*'1.5'"),
        (f"{INTEGRATION}\n{INTEGRATION}", "integration of heavy_tip.*2 times"),
    ],
)
def test_a_malformed_integration_is_refused(read, row, message):
    with pytest.raises(DataError, match=message):
        read(row, name="integration-0.csv", header=",".join(INTEGRATION_COLUMNS))


FAMILY = fake_stress.described()["families"][0]


@pytest.mark.parametrize(
    "change, message",
    [
        ({"families": [{"name": "a"}]}, "kind' is missing"),
        ({"families": [FAMILY | {"singular": "no"}]}, "singular is 'no'"),
        ({"families": [FAMILY]}, "'heavy_tip' stands in no families-"),
        ({"families": 2 * fake_stress.described()["families"][:1]}, "family of straight.*2 times"),
        ({"variants": [{"name": "a"}]}, "equation' is missing"),
        ({"variants": 2 * [fake_stress.variant(MGS)]}, "variant of Sequential.*2 times"),
    ],
)
def test_a_malformed_list_of_families_is_refused(read, tmp_path, change, message):
    document = json.dumps(fake_stress.described() | change)
    (tmp_path / "families-stress.json").write_text(document)
    with pytest.raises(DataError, match=message):
        read(line())


def points(read, *rows: str) -> list[Point]:
    return read(*rows).laboratory.points


def test_a_failure_is_an_infinite_error(read):
    failed = line(seed=3, status="indefinite", relative="", eta="")
    (point,) = points(read, line(), line(seed=2, relative=3e-15), failed)
    assert (point.error, point.worst, point.failures) == (3e-15, math.inf, 1)
    assert point.outcome == "ok" and point.eta == 0.9 and math.isinf(point.worst_eta)


def test_the_median_of_even_counts_lies_between(read):
    (point,) = points(read, line(), line(seed=2, relative=3e-15))
    assert point.error == pytest.approx(2e-15) and point.seeds == 2


@pytest.mark.parametrize(
    "changed, outcome",
    [
        ({"relative": 0.009}, "ok"),
        ({"relative": 0.02}, "wrong"),
        ({"relative": 0.02, "warning": "near_singular"}, "warned"),
        ({"relative": "", "status": "singular"}, "singular"),
        ({"relative": "", "status": "not_finite"}, "not_finite"),
    ],
)
def test_an_outcome_is_that_of_the_median(read, changed, outcome):
    (point,) = points(read, line(**changed))
    assert point.outcome == outcome


def test_digits_are_of_the_worst_value(read):
    series = points(read, line(), line(value=1e6, relative=1e-4), line(value=1e8, relative=1e-9))
    assert digits.worst_point(series).value == 1e6
    assert digits.digits(digits.worst_point(series)) == pytest.approx(4)
    assert digits._cell(series, usual=6) == "<p class=d2>4.0"
    assert digits._cell(series, usual=2) == "<p>4.0"


def test_a_cell_of_no_precision_is_empty(read):
    series = points(read, line())
    assert digits._pair([[], []]) == ""
    assert digits._pair([series, []]).endswith("<p class=none>–")


def test_a_word_of_both_precisions_is_said_once(read):
    refused = points(read, line(status="singular", relative="", eta=""))
    assert digits._pair([refused, refused]) == "<p class=d0>refused"


def test_an_exact_result_has_the_digits_of_its_precision(read):
    (point,) = points(read, line(relative=0))
    assert digits.digits(point) == pytest.approx(15.95, abs=0.01)


def test_some_bad_seed_is_marked(read):
    series = points(read, line(), line(seed=2, relative=2e-15), line(seed=3, relative=0.5))
    assert "14.7*" in digits._cell(series, usual=6)


def test_stress_without_its_families_is_refused(tmp_path):
    (tmp_path / "stress-0.csv").write_text("\n".join([HEADER, line(), ""]))
    with pytest.raises(DataError, match="'heavy_tip' stands in no .*stress --list --json FILE"):
        load(tmp_path)


def test_many_variants_are_grouped_and_contenders_come_first(confirmed):
    variants = [*fake_stress.VARIANTS, *fake_stress.INVERTING[1:], "New<Thing>"]
    groups = digits.grouped(sorted(variants), confirmed.laboratory.known)
    assert list(groups) == [
        "Contenders",
        "Filters",
        "Closed form",
        "Scans",
        "Batch",
        "Refined and mixed precision",
        "Filters in other frames",
        "Others",
    ]
    assert groups["Filters in other frames"][0] == "Sequential<WorldOrigin<ArrayMGS>>"
    assert digits.grouped(["A", "B"], {}) == {"All": ["A", "B"]}


def wild_rows(read, **by_seed):
    rows = [
        line(family="wild", value=0, task="white", seed=seed, eta=seed) for seed in range(1, 101)
    ]
    for seed, changed in by_seed.items():
        number = int(seed.removeprefix("seed"))
        base = {"family": "wild", "value": 0, "task": "white", "seed": number, "eta": number}
        rows[number - 1] = line(**(base | changed))
    return read(*rows)


def test_quantiles_of_eta_are_values_that_occur_and_failures_are_infinite(read):
    assert wild.eta_quantiles(wild_rows(read).stress) == [50, 90, 99, 100]
    failed = {"status": "singular", "relative": "", "eta": ""}
    assert wild.eta_quantiles(wild_rows(read, seed3=failed).stress) == [51, 91, 100, math.inf]


def test_silent_failures_are_counted_exactly_and_named(read):
    warned = {"relative": 0.5, "warning": "near_singular"}
    refused = {"relative": "", "eta": "", "status": "singular"}
    data = wild_rows(
        read,
        seed3={"relative": 0.02},
        seed7={"relative": 0.5},
        seed8={"relative": 0.0099},
        seed9=warned,
        seed10=refused,
    )
    main, silent = wild.section(data).tables
    assert main.rows[0][:3] == [MGS, "float64", "100"]
    assert main.rows[0][7:9] == ["1", "2"]  # failed, silent
    assert "All 2 silent" in silent.caption
    assert silent.rows == [[MGS, "float64", "White innovations", "2", "3, 7"]]


def test_harm_and_estimates_are_counted(read):
    worse = {"relative": 3e-14, "unrefined": 1e-14, "eta": 27, "estimate": 1e-14, "widened": 0}
    little = {"relative": 3e-16, "unrefined": 1e-16, "eta": 0.3, "estimate": 9.1e-16, "widened": 1}
    better = {"relative": 1e-15, "unrefined": 1e-9, "estimate": 2e-15}
    data = wild_rows(read, seed1=worse, seed2=little, seed3=better)
    (row,) = wild.section(data).tables[0].rows
    assert row[-3:] == ["2 (1)", "67 %", "50 %"]


@pytest.fixture(scope="module")
def confirmed(tmp_path_factory) -> Data:
    folder = tmp_path_factory.mktemp("stress")
    fake_stress.write(folder)
    return load(folder)


def test_every_series_of_the_fake_run_has_its_law(confirmed):
    for point in confirmed.laboratory.points:
        law = fake_stress.law(*point[:1], point.value, *point[2:3], point.task, point.variant)
        if point.family != "wild" and not point.failures and law <= 0.5:
            assert point.error == pytest.approx(law), point


def test_the_cheapest_of_those_within_the_digits_is_named():
    found = [
        choosing.Candidate("A", "float32", 1e-2, 1, 0.5),
        choosing.Candidate("B", "float64", 1e-7, 1e3, 1.0),
        choosing.Candidate("C", "float64", 1e-15, 1, 2.5),
    ]
    assert choosing._cheapest(found, lambda c: c.error <= 1e-6) == "B<br>float64, 1×"
    assert choosing._cheapest(found, lambda c: c.error <= 1e-12) == "C<br>float64, 2.5×"
    assert choosing._cheapest(found, lambda c: c.error <= 1e-16) == "none"


def test_families_are_together_by_their_kind(confirmed):
    (table,) = choosing.section(confirmed).tables
    kinds = [re.match("[^<]*", str(row[0]))[0] for row in table.rows]
    assert kinds == [
        "Long arms",
        "Heavy outboard of light: payloads, feet",
        "Heavy inboard or mixed masses",
        "Lengths and offsets of all sizes",
        "Nearly parallel axes",
        "Centres of mass inboard",
        "Drawn at random",
        "Nearly singular, massless bodies",
        "Robots",
    ]


def test_without_times_the_choice_says_so(confirmed):
    part = choosing.section(confirmed)
    assert "No times of these variants" in part.paragraphs[0]
    assert len(part.tables[0].rows) == 9


def test_singular_mechanisms_are_refused_or_answered(confirmed):
    table = next(t for t in digits.section(confirmed).tables if "singular" in t.caption)
    rows = {(row[0], row[1]): row[2:] for row in table.rows}
    assert rows[MGS, "float64"] == ["3", "100 %", "0 %", "0 %"]
    assert rows["Batch<EigenLLT>", "float64"] == ["3", "0 %", "0 %", "100 %"]


def test_the_health_of_covariances_is_the_worst_of_all_mechanisms(read):
    health = {"task": "factors", "P_constraint": 0, "P_asymmetry": 0}
    data = read(
        line(**health | {"P_min": -1e-17}),  # rounding
        line(seed=2, **health | {"P_min": -3e-5, "P_constraint": 2e-9}),
        line(seed=3, **health | {"P_min": 0, "P_asymmetry": 4e-16}),
    )
    (table,) = [t for t in digits.section(data).tables if t.caption.startswith("Health")]
    assert table.rows == [[MGS, "float64", "3", "33 %", "-3.0e-05", "2.0e-09", "4.0e-16"]]
