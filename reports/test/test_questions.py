"""What questions leave out, on records whose ratios are known."""

import json

import pytest
from markupsafe import Markup
from playwright.sync_api import expect

import make_report
from browsing import PHONE, overflowing, unfold_all
from fake_questions import QUESTIONS, call, record
from read.data import DataError
from read.readers import load
from sections import questions

TITLE = "What a question does not need"
RULES = (  # of Rule in algorithms/dynamics/question.hpp
    "locked_joints untouched_trees massless_branches separate_trees translations zero_terms "
    "rest partial_answers"
).split()


@pytest.fixture
def read(tmp_path):
    def read(*records: dict):
        for i, document in enumerate(records):
            (tmp_path / f"pruning-{i}.json").write_text(json.dumps(document))
        return load(tmp_path)

    return read


def drawn(section) -> list[dict]:
    (figure,) = section.figures
    return [row for rows in figure.chart.to_dict()["datasets"].values() for row in rows]


def test_each_question_is_read_with_its_answers(read):
    (question,) = read(record("arm among 20 things")).questions
    assert question[:-1] == (
        "arm among 20 things",
        "table:135",
        "acceleration",
        "--want acceleration --dofs panda_*",
        ["untouched_trees", "separate_trees"],
        135,
        9,
    )
    times = {(call.time.variant, call.time.precision): call for call in question.calls}
    assert len(times) == 6 and times["alone", "float32"].time.nanoseconds == 750
    assert times["pruned", "float64"].flops == 3000


def test_bars_are_relative_to_the_whole_below_the_rules_that_acted(read):
    rows = drawn(questions.section(read(record("arm among 20 things"), record("planar arm"))))
    words = [row.get("heading") or row.get("remark") or row.get("how") for row in rows]
    assert words == [
        "Arm among 20 things: 24.0 times faster",
        "trees that are not asked about are not solved",
        "separate trees are solved apart",
        *("whole", "pruned", "alone"),
        None,
        "Planar arm: 4.00 times faster",
        "right angles and parallel axes: no turns",
        *("whole", "pruned"),
    ]
    bars = {(row["scene"], row["how"]): row for row in rows if "how" in row}
    assert {key: row["share"] for key, row in bars.items()} == {
        ("table:135", "whole"): 1,
        ("table:135", "pruned"): pytest.approx(1 / 24),
        ("table:135", "alone"): pytest.approx(1 / 30),
        ("planar:10", "whole"): 1,
        ("planar:10", "pruned"): 0.25,
    }
    pruned = bars["table:135", "pruned"]
    assert (pruned["time_text"], pruned["dofs"], pruned["flops"]) == ("1.25 µs", 9, "3000")
    assert bars["table:135", "whole"]["dofs"] == 135


def test_bars_are_drawn_in_the_order_of_their_lines(read):
    rows = drawn(questions.section(read(*map(record, QUESTIONS))))
    lines = [row["line"] for row in rows]
    assert lines == sorted(lines) and len(set(lines)) == len(lines)


def test_the_table_has_both_precisions_and_the_command(read):
    (table,) = questions.section(read(record("arm among 20 things"))).tables
    name = ["Arm among 20 things", "table:135", "9"]
    flops = ["9000", "3000"]
    *rows, (remark,) = table.rows
    assert rows == [
        [*name, "float64", "30.0 µs", "1.25 µs", "24.0 times faster", "1.00 µs", "1.25", *flops],
        [*name, "float32", "22.5 µs", "938 ns", "24.0 times faster", "750 ns", "1.25", *flops],
    ]
    assert remark == Markup(
        "<code>plan table:135 --want acceleration --dofs &#39;panda_*&#39;</code> Left out: trees "
        "that are not asked about are not solved; separate trees are solved apart."
    )


def test_columns_of_the_scene_alone_are_there_where_it_was_timed(read):
    section = questions.section(read(record("planar arm")))
    (table,) = section.tables
    assert not any("lone" in text for text in [it.title for it in table.columns] + section.paragraphs)


def test_a_question_without_title_or_rules_is_named_by_what_is_wanted(read):
    data = read(record("planar arm", title="", rules=""))
    headings = [row["heading"] for row in drawn(questions.section(data)) if "heading" in row]
    assert headings == ["Acceleration a = M⁻¹(τ − bias) of planar:10: 4.00 times faster"]
    remarks = [row["remark"] for row in drawn(questions.section(data)) if "remark" in row]
    assert remarks == ["no rule has anything to leave out"]


def test_two_wants_of_a_file_are_two_questions(read):
    both = record("planar arm", question="--want acceleration,diagonal")
    for how in ("whole", "pruned"):
        both["benchmarks"] += call("diagonal", how, "planar:10", "float64", 1000)
    wants = [question.want for question in read(both).questions]
    assert wants == ["acceleration", "diagonal"]


def test_every_rule_has_its_words():
    assert list(questions.RULES) == RULES


def test_a_pruned_answer_that_was_wrong_is_told_and_not_drawn(read):
    wrong = record("planar arm")
    name = "acceleration/pruned/planar:10/float64"
    kept = [row for row in wrong["benchmarks"] if row["run_name"] != name]
    row = {"name": name, "run_name": name, "run_type": "iteration", "error_occurred": True}
    wrong["benchmarks"] = [*kept, row | {"error_message": "wrong: error 0.1, bound 1e-9"}]
    section = questions.section(read(wrong))
    assert section.figures == []
    assert section.statements[-1] == (
        "Not timed: Planar arm, pruned, float64: wrong: error 0.1, bound 1e-9."
    )
    assert [row[5:7] for row in section.tables[0].rows[:-1]] == [
        ["–", "–"],
        ["450 ns", "4.00 times faster"],
    ]


@pytest.mark.parametrize("key", ["question", "rules", "dofs", "dofs_left"])
def test_a_record_without_its_question_is_refused(read, key):
    broken = record("planar arm")
    del broken["context"][key]
    reason = rf"0\.json: not a record of a question: '{key}' is missing"
    with pytest.raises(DataError, match=reason):
        read(broken)


def test_broken_numbers_and_unknown_answers_are_refused(read):
    with pytest.raises(DataError, match=r"0\.json: not a record of a question: .*'many'"):
        read(record("planar arm", dofs="many"))
    unknown = record("planar arm")
    for row in unknown["benchmarks"]:
        row["run_name"] = row["run_name"].replace("pruned", "halved")
    with pytest.raises(DataError, match=r"'halved' is none of whole, pruned, alone"):
        read(unknown)


def test_the_same_question_twice_is_refused_but_two_about_one_scene_are_not(read):
    other = record("planar arm", question="--want acceleration --at-rest")
    assert len(read(record("planar arm"), other).questions) == 2
    with pytest.raises(DataError, match="time of an answer of --want acceleration/planar:10/whole"):
        read(record("planar arm"), record("planar arm"))


def test_without_their_data_the_section_is_absent(run):
    data = load(None, [run / "errors-chain-31.csv"])
    assert questions.section(data) is None
    assert TITLE not in make_report.page(data)


def test_the_page_draws_a_bar_an_answer_and_lists_them(read, visit, tmp_path):
    file = tmp_path / "index.html"
    make_report.write(file, make_report.page(read(*map(record, QUESTIONS))))
    page = visit(file)
    unfold_all(page)
    figure = page.get_by_role("figure", name=TITLE)
    answers = sum(len(times) for *_, times in QUESTIONS.values())
    expect(figure.locator(".mark-rect path[aria-label*='median time']")).to_have_count(answers)
    texts = figure.locator(".chart text").all_text_contents()
    for text in ("One foot of a humanoid: 3.00 times faster", "8.00 µs", "pruned", "at rest: no"):
        assert any(text in it for it in texts), text
    expect(figure.locator(".numbers tbody tr")).to_have_count(answers)


def test_a_finger_anywhere_on_a_bar_shows_its_numbers(read, visit, tmp_path):
    file = tmp_path / "index.html"
    make_report.write(file, make_report.page(read(*map(record, QUESTIONS))))
    page = visit(file, viewport=PHONE, has_touch=True)
    unfold_all(page)
    assert overflowing(page) == []
    bar = page.locator(".mark-rect path[aria-label*='how: whole'][aria-label*='g1:35']")
    box = bar.bounding_box()
    assert box["width"] > 100
    bar.scroll_into_view_if_needed()
    bar.tap(position={"x": 5, "y": box["height"] / 2})
    expect(page.locator("#numbers-of-a-mark.visible")).to_contain_text("24.0 µs")
