"""What to take and how far it holds: records, answers, code, and a page without them."""

import json
import re
import shlex

import pytest
from playwright.sync_api import expect

import fake_advice
import make_report
from browsing import figure, marks, section
from charts.groups import first_series, group
from charts.text import sentence
from read.data import DataError
from read.readers import load
from sections import answer, stress
from sections.fragment import fragment

PANDA = "panda:7"


@pytest.fixture
def read(tmp_path):
    def read(recommend=None, limits=None):
        for kind, record in (("recommend", recommend), ("limits", limits)):
            if record:
                (tmp_path / f"{kind}-panda.json").write_text(json.dumps(record))
        return load(tmp_path)

    return read


def test_the_answer_says_both_sentences_and_does_what_is_advised(read):
    record = fake_advice.recommend(PANDA)
    found = answer.section(read(record, fake_advice.limits(PANDA)))
    assert found.title == "What to take for panda" and found.opened
    first, *others = found.answers
    assert first.sentences == [record["sentence"], fake_advice.limits(PANDA)["sentence"]]
    for task, part in record["tasks"].items():
        for choice in part["choices"]:
            tolerance = f"{choice['tolerance']:g}".replace("e-0", "e-")
            here = {"view": task, "tolerance": tolerance}
            said = [it for it in others if all(v in it.shown[name] for name, v in here.items())]
            (reason,) = [it for text in said for it in text.sentences]
            (code,) = [it.code for it in said if it.code]
            assert choice["reason"] in reason
            assert reason.startswith("Nothing is predicted") == (not choice["enough"])
            assert {"float32": "<float>", "float64": "<double>"}[choice["precision"]] in code or (
                choice["precision"] in code and choice["variant"] in code
            )


def test_what_a_program_says_is_printed_as_a_sentence():
    assert sentence("take it") == "Take it."
    assert sentence("float32 is right.") == "float32 is right."
    assert sentence("Ladder<default> errs") == "Ladder<default> errs."


def test_code_has_ten_lines_by_the_door_and_else_a_command():
    code = fragment("panda", "panda.urdf", "", "acceleration", "Ladder<last_bits>", "float32")
    assert len(code.splitlines()) == 10 and max(map(len, code.splitlines())) < 90
    assert "Dynamics<float> robot(file.model, {.tolerance = kalmarm::last_bits});" in code
    assert 'load_robot("panda.urdf")' in code
    panda = ("panda", "panda.urdf", '{.floating = ""}', "inverse")
    code = fragment(*panda, "Ladder<default>", "float64")
    assert "inverse_mass(q, X)" in code
    assert 'load_robot("panda.urdf", {.floating = ""});' in code
    assert fragment(*panda, "Sequential<UD>", "float64").startswith("build/bin/evaluate")


def test_code_of_rows_takes_many_states():
    code = fragment("panda", "panda.urdf", "", "acceleration_batch", "Ladder<default>", "float32")
    assert "std::vector<float> q(rows * robot.nq()), qd(rows * robot.nv()), tau(qd), a(qd);" in code
    assert "robot.forward_dynamics(q, qd, tau, a, outcomes);" in code
    code = fragment("panda", "panda.urdf", "", "inverse_batch", "Ladder<last_bits>", "float64")
    assert "std::vector<double> q(rows * robot.nq()), X(rows * robot.nv() * robot.nv());" in code
    assert "{.tolerance = kalmarm::last_bits}" in code


def test_a_file_s_name_stays_a_name_in_code():
    name = """e"); system("id"); ("; $(id) '\\\t"""
    code = fragment(name, name, "", "inverse", "Ladder<default>", "float64")
    literal = r'''"e\"); system(\"id\"); (\"; $(id) '\\\t"'''
    assert f"= kalmarm::load_robot({literal});" in code
    command = fragment(name, name, "", "inverse", "Batch<A>' B", "float64")
    given = ["build/bin/evaluate", name, "--variant", "Batch<A>' B", "--precision", "float64"]
    given += ["--want", "inverse", "--out", f"{name}.json"]
    assert shlex.split(command.replace("\\\n", "")) == given


def test_the_worst_of_the_stresses_is_beside_the_median(read):
    record, limits = fake_advice.recommend(PANDA), fake_advice.limits(PANDA)
    chart = answer.section(read(record, limits)).figures[0].chart.to_dict()
    rows = [row for rows in chart["datasets"].values() for row in rows if "variant" in row]
    worst = {
        (task, row["variant"], row["precision"]): max(it for it in row["worst"] if it is not None)
        for load in limits["stresses"]
        for task, own in load["tasks"].items()
        for row in own
        if load["name"] == "payload"
    }
    assert len(rows) == 2 * len(fake_advice.VARIANTS) * 2 + 2
    stressed = [row for row in rows if row["view"] != "acceleration_batch"]
    for row in stressed:
        assert row["error"] < row["worst"] < row["stressed"]
        key = row["view"], row["variant"], row["precision"]
        assert row["stressed"] >= worst[key] * 0.999
    texts = {(row["view"], row["variant"], row["precision"]): row["stressed_text"] for row in rows}
    assert "3 refused" in texts["inverse", "Batch<EigenLLT>", "float32"]


def test_what_is_picked_is_among_the_first_shown(read):
    record = fake_advice.recommend(PANDA)
    chart = answer.section(read(record)).figures[0].chart.to_dict()
    rows = [row for rows in chart["datasets"].values() for row in rows if "variant" in row]
    assert all("more" not in row for row in rows if row["chosen"])
    for task in ("acceleration", "inverse"):
        assert sum("more" not in row for row in rows if row["view"] == task) == 8


def test_a_run_without_advice_says_so_and_shows_what_was_measured(run):
    found = answer.section(_older(run))
    assert "No advice was recorded" in found.answers[0].sentences[0]
    names = [name for it in found.answers for name, _ in it.numbers]
    assert "Fastest in float32" in names and "Fastest in float64" in names
    assert not any("predicted" in value for it in found.answers for _, value in it.numbers)
    assert found.figures and "ring" not in found.figures[0].notes[0]


def _older(run):
    return load(None, [run / "errors-panda-7.csv", run / "times-panda-7.json"])


def test_without_times_and_advice_nothing_is_answered(run):
    assert answer.section(load(None, [run / "mujoco-panda-7.json"])) is None
    assert stress.section(_older(run)) is None


def test_a_load_is_followed_until_it_is_too_much(read):
    limits = fake_advice.limits(PANDA)
    table = stress.section(read(limits=limits)).tables[0]
    (row,) = [
        row
        for row in table.rows
        if row[:3] == ["Payload on the hand", "Batch<EigenLLT>", "float32"]
    ]
    assert row[4:] == ["refused", "10 times the mass of the last link"]


@pytest.mark.parametrize(
    "kind, change, reason",
    [
        ("recommend", lambda it: it.pop("sentence"), "sentence"),
        ("recommend", lambda it: it.update(robot="panda"), "NAME:NV"),
        ("recommend", lambda it: it["tasks"]["inverse"]["choices"][0].update(enough=1), "enough"),
        (
            "recommend",
            lambda it: it["tasks"]["inverse"]["contenders"][0].update(worst="x"),
            "worst",
        ),
        ("limits", lambda it: it["stresses"][0]["values"].pop(), "has not 8 values"),
        ("limits", lambda it: it.update(stresses=None), "stresses is None"),
    ],
)
def test_what_is_no_such_record_is_refused_by_name(read, kind, change, reason):
    record = getattr(fake_advice, kind)(PANDA)
    change(record)
    with pytest.raises(DataError, match=f"{kind}-panda.json: not what {kind} writes: .*{reason}"):
        read(**{kind: record})


def test_advice_for_a_robot_that_stands_twice_is_refused(read, tmp_path):
    (tmp_path / "recommend-again.json").write_text(json.dumps(fake_advice.recommend(PANDA)))
    with pytest.raises(DataError, match="advice of panda:7 is recorded 2 times"):
        read(fake_advice.recommend(PANDA))


def test_groups_have_the_names_of_the_field():
    expected = {
        "AxisFrames<SquareRoot>@gcc": "Square roots",
        "Batch<SparseLTDL>": "Cholesky",
        "Sequential<Conventional>": "Filters",
        "Sequential<WorldAxes<Joseph>>": "Filters",
        "Sequential<WorldOrigin<UD>>": "Square roots",
        "FactoredBias<ArrayGivens>": "Square roots",
        "ClosedForm<ArrayMGS>": "Square roots",
        "WideRefined<FactoredBias<ArrayGivens>>": "Refined",
        "MixedPrecision<Sequential<ArrayMGS>>": "Refined",
        "Pinocchio<LOCAL>@clang": "Peers",
        "MonteCarlo": "Others",
    }
    assert {variant: group(variant) for variant in expected} == expected


def test_the_first_series_are_of_every_group():
    series = [(v, p) for v in fake_advice.VARIANTS for p in ("float32", "float64")]
    kept = first_series(series)
    assert len(kept) == 8
    assert {group(variant) for variant, _ in kept} == {group(variant) for variant, _ in series}
    assert ("Ladder<default>", "float32") in kept
    assert first_series(series[:3]) == set(series[:3])


def test_a_robots_page_begins_with_what_to_call_a_figure_and_the_answer(visit, run, tmp_path):
    file = tmp_path / "index.html"
    make_report.write(file, make_report.page(load(None, sorted(run.glob("*-panda-7.*")))))
    page = visit(file, viewport={"width": 1280, "height": 800})
    title = "What to take for panda"
    expect(page.get_by_text("For panda, call Dynamics<double>")).to_be_in_viewport()
    expect(page.locator("figure[data-drawn] .chart").first).to_be_in_viewport()
    assert page.evaluate("scrollY") == 0
    expect(page.get_by_text("Take Dynamics<double> for panda")).to_be_visible()
    expect(page.locator(".answer:visible code")).to_be_visible()
    panel = figure(page, title, "Worst error")
    assert marks(panel).count() == 8
    page.get_by_role("button", name=re.compile("^All 14 series")).first.click()
    expect(marks(panel)).to_have_count(14)
    section(page, title).get_by_role("combobox", name="Error asked for").select_option("1e-12")
    expect(page.locator(".answer:visible code")).to_contain_text("<double>")
