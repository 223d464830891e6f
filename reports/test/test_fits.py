"""The sections of fits and of their Jacobians, on records whose numbers are known."""

import json

import pytest
from playwright.sync_api import expect

import make_report
from browsing import unfold_all
from fake_fits import JOINTS, TIMES, fit, jacobians
from read.data import DataError
from read.fits import Identification
from read.readers import load
from read.values import reading
from sections import identification as identification_section
from sections import jacobians as jacobians_section

FITS = "Inertial parameters from motion"
NOISY = "arm:2, inverse_dynamics, 1 % noise"


@pytest.fixture
def read(tmp_path):
    def read(*fits: dict, benchmarks: list[dict] = (), **context):
        for i, record in enumerate(fits):
            (tmp_path / f"identify-{i}.json").write_text(json.dumps(record))
        if benchmarks:
            document = {"context": context, "benchmarks": list(benchmarks)}
            (tmp_path / "jacobians-a.json").write_text(json.dumps(document))
        return load(tmp_path)

    return read


def failed_fit() -> dict:
    """What `identify` writes where the solver failed."""
    known = "robot residual jacobian noise samples held_out seconds columns warnings".split()
    record = fit("likelihood", usable=False)
    return {name: record[name] for name in known} | {"usable": False, "iterations": []}


def test_each_fit_has_its_row_in_order_of_noise_and_residual(read):
    noisy = fit("inverse_dynamics", 0.01)
    data = read(noisy, failed_fit(), fit("innovations"), fit("inverse_dynamics", None))
    (table,) = identification_section.section(data).tables
    assert [[str(cell) for cell in row] for row in table.rows] == [
        "arm:2|inverse_dynamics|measured|200|2 of 20|1.2e1|9|250 ms|5.0e-1|1.0e-8|30.0 %|1.0e-6 %"
        "|2.0e-2|✓ pass".split("|"),
        "arm:2|innovations|0 %|200|2 of 20|1.2e1|9|250 ms|5.0e-1|1.0e-8|30.0 %|1.0e-6 %|2.0e-2"
        "|✓ pass".split("|"),
        "arm:2|likelihood|0 %|200|–|–|0|250 ms|–|–|–|–|–|✗ fail".split("|"),
        "arm:2|inverse_dynamics|1 %|200|2 of 20|1.2e1|3|250 ms|5.0e-1|1.0e-2|30.0 %|1.00 %|2.0e-2"
        "|✓ pass".split("|"),
    ]


def test_intervals_are_counted_and_told_by_whether_they_hold_the_truth(read):
    section = identification_section.section(read(fit("inverse_dynamics", 0.01)))
    figure = next(figure for figure in section.figures if "against true" in figure.title)
    assert figure.title == f"{NOISY}: fitted against true"
    assert figure.notes == ["1 of 2 intervals of 95 % hold the truth."]
    datasets = figure.chart.to_dict()["datasets"].values()
    first, second = [row for rows in datasets for row in rows if "name" in row]
    ends = [first[end] for end in ("low", "fitted", "high")]
    assert ends == pytest.approx([-0.075, -0.025, 0.025])
    assert second["fitted"] == pytest.approx(0.5)
    assert (first["holds"], second["holds"]) == ("yes", "no")


def test_noise_free_fits_converge_in_a_line_each(read):
    data = read(fit("inverse_dynamics"), fit("innovations"), fit("inverse_dynamics", 0.01))
    section = identification_section.section(data)
    assert section.variants == ["innovations", "inverse_dynamics"]
    (figure,) = [figure for figure in section.figures if "convergence" in figure.title]
    (rows,) = figure.chart.to_dict()["datasets"].values()
    for residual in section.variants:
        line = [(row["iteration"], row["error"]) for row in rows if row["variant"] == residual]
        assert line == [(i, pytest.approx(10.0**-i)) for i in range(9)]


def test_what_is_not_seen_is_said_once_of_all_fits_with_the_same(read):
    lost = fit("mass_matrix", unseen=[], lost=["m(hand)"], warnings=["too little excitation"])
    data = read(fit("inverse_dynamics"), fit("innovations"), lost)
    unseen, motion, warning = identification_section.section(data).statements
    assert unseen == (
        "arm:2, inverse_dynamics, innovations: 9 of 20 parameters are in nothing that the data see: "
        "p0, p1, p2, p3, p4, p5, p6, p7 and 1 more."
    )
    assert motion == "arm:2, mass_matrix: this motion does not show what another would: m(hand)."
    assert warning == "arm:2, mass_matrix: warning: too little excitation."


def test_held_out_torques_are_those_of_the_noisy_fit_joint_by_joint(read):
    data = read(fit("innovations"), fit("inverse_dynamics", 0.01))
    section = identification_section.section(data)
    (figure,) = [figure for figure in section.figures if "torque" in figure.title]
    assert figure.title == f"{NOISY}: held-out torque"
    assert [option for option, _ in figure.choices[0].options] == JOINTS
    (rows,) = figure.chart.to_dict()["datasets"].values()
    assert len(rows) == len(JOINTS) * len(TIMES)
    assert all(row["start"] == pytest.approx(1.3 * row["fitted"], rel=1e-3) for row in rows)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"robot": "arm"}, "'arm' is not NAME:NV"),
        ({"seconds": float("nan")}, "seconds is nan"),
        ({"columns": None}, "columns is None"),
        ({"prediction": {"time": [], "joints": fit("x")["prediction"]["joints"]}}, "are not 0"),
        (
            {"base_parameters": [{"name": "m", "unit": 1, "fitted": 3, "low": 4, "high": 5}]},
            "m is 3.0",
        ),
    ],
)
def test_a_broken_record_is_refused_with_its_file(read, changes, reason):
    with pytest.raises(DataError, match=r"identify-0\.json: not a record of a fit: ") as error:
        read(fit("innovations", **changes))
    assert reason in str(error.value)


def test_a_missing_key_is_named():
    record = fit("innovations")
    del record["samples"]
    with pytest.raises(ValueError, match="samples"):
        reading(Identification)(record)


def test_the_same_fit_twice_is_refused(read):
    with pytest.raises(DataError, match="fit of arm:2/innovations/analytic/0.0 is recorded 2"):
        read(fit("innovations"), fit("innovations"))


def test_ratios_are_against_the_factored_jacobian_of_the_same_scene(read):
    task = "jacobian_inverse_dynamics"
    small = {"Factored": 2000, "AutoDiff": 8000, "NumericDiff": 20000}
    rows = jacobians("chain:31", {"Factored": 1e4, "NumericDiff": 3e5}, task)
    rows += jacobians("arm:7", small, task)
    wrong = {"name": f"{task}/AutoDiff/chain:31/float64", "error_occurred": True}
    rows.append(wrong | {"error_message": "wrong: error 0.1, bound 1e-9"})
    section = jacobians_section.section(read(benchmarks=rows, timed_call="kinematics included"))
    (table,) = section.tables
    assert [row[1:] for row in table.rows] == [
        ["arm:7", "2.00 µs", "2.0e-16", "4.00", "3.0e-16", "10.0", "4.0e-7", "–", "–"],
        ["chain:31", "10.0 µs", "2.0e-16", "–", "–", "30.0", "4.0e-7", "–", "–"],
    ]
    assert section.statements == [
        "A timed call: kinematics included",
        "Not timed: Inverse dynamics, τ − ID, AutoDiff, chain:31: wrong: error 0.1, bound 1e-9.",
    ]
    (figure,) = section.figures
    (marks,) = figure.chart.to_dict()["datasets"].values()
    assert {(row["variant"], row["n"], row["time"]) for row in marks} == {
        ("Factored", 7, 2000),
        ("AutoDiff", 7, 8000),
        ("NumericDiff", 7, 20000),
        ("Factored", 31, 1e4),
        ("NumericDiff", 31, 3e5),
    }


def test_without_their_data_both_sections_are_absent(run):
    data = load(None, [run / "errors-chain-31.csv"])
    assert not any(m.section(data) for m in (identification_section, jacobians_section))


def test_the_page_shows_what_is_chosen(read, visit, tmp_path):
    rows = jacobians("arm:2", {"Factored": 2000, "NumericDiff": 2e4}, "jacobian_innovations")
    data = read(fit("innovations"), fit("inverse_dynamics", 0.01), benchmarks=rows)
    file = tmp_path / "index.html"
    make_report.write(file, make_report.page(data))
    page = visit(file)
    unfold_all(page)
    expect(page.get_by_text("Nothing is shown").locator("visible=true")).to_have_count(0)
    torque = page.get_by_role("figure", name=f"{FITS}: {NOISY}: held-out torque")
    assert torque.locator(".mark-symbol path[aria-label*='measured']").count() == len(TIMES)
    expect(torque.locator(".numbers tbody tr")).to_have_count(len(TIMES))
    torque.get_by_label("Joint").select_option(JOINTS[1])
    expect(torque.locator(".numbers tbody tr")).to_have_count(len(TIMES))
    line = page.get_by_role("figure", name=f"{FITS}: arm:2: convergence without noise")
    marks = line.locator(".mark-symbol path[aria-label*='innovations']")
    assert marks.count() == 9
    page.get_by_role("button", name="innovations", exact=True).click()
    expect(marks).to_have_count(0)
