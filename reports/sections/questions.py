"""What questions leave out: their time before and after, and the rules that acted."""

import shlex

from markupsafe import Markup

from charts import questions as question_charts
from charts.text import factor_text, share_text, task_rank, task_text, three_digits, time_text
from page.section import Figure, Section, Table
from read.data import Call, Data, Question
from sections.method import distinct

DRAWN = "float64"
RULES = {  # what each leaves out
    "locked_joints": "bodies between locked joints are one",
    "untouched_trees": "trees that are not asked about are not solved",
    "massless_branches": "branches without inertia are dropped",
    "separate_trees": "separate trees are solved apart",
    "translations": "slides alone: no angles",
    "zero_terms": "right angles and parallel axes: no turns",
    "rest": "at rest: no velocity terms",
    "partial_answers": "what is not asked of M⁻¹ is not computed",
}


def section(data: Data) -> Section | None:
    if not any(call.time.nanoseconds for question in data.questions for call in question.calls):
        return None
    questions = sorted(data.questions, key=lambda it: (task_rank(it.want), it.title, it.asked))
    blocks = [block for question in questions if (block := _block(question))]
    paragraphs = [
        "A scene holds more than a question about it needs. Once a model, a plan works out what "
        "can go without changing the answer; a call then does the rest. Whole: no rule is used. "
        "Pruned: the rules named. Every pruned answer was compared with the whole one before it "
        "was timed.",
    ]
    if any(_of(question, "alone") for question in questions):
        paragraphs.append("Alone: a scene with nothing but what is asked about, asked the same.")
    return Section(
        "What a question does not need",
        paragraphs,
        statements=[f"A timed call: {it}" for it in distinct(data.questions_contexts, "timed_call")]
        + _refusals(questions),
        figures=[
            Figure(
                f"before and after, {DRAWN}",
                question_charts.before_and_after(blocks),
                question_charts.TOOLTIPS,
            )
        ]
        if blocks
        else [],
        tables=[_table(questions)],
    )


def name_of(question: Question) -> str:
    title = question.title or f"{task_text(question.want)} of {question.scene}"
    return title[:1].upper() + title[1:]


def command(question: Question) -> str:
    return shlex.join(["plan", question.scene, *question.asked.split()])


def rules_in_words(question: Question) -> list[str]:
    return [RULES.get(rule, rule) for rule in question.rules]


def _of(question: Question, how: str, precision: str = DRAWN) -> Call | None:
    """Where it was timed."""
    return next(
        (
            call
            for call in question.calls
            if (call.time.variant, call.time.precision) == (how, precision)
            and call.time.nanoseconds
        ),
        None,
    )


def _block(question: Question) -> tuple[str, list[str], list[dict]] | None:
    """Heading, rules and bars; None where there is nothing to compare."""
    whole, pruned = _of(question, "whole"), _of(question, "pruned")
    if not (whole and pruned):
        return None
    dofs = {"whole": question.dofs, "pruned": question.dofs_left}
    rows = []
    for call in filter(None, (whole, pruned, _of(question, "alone"))):
        time, ratio = call.time, whole.time.nanoseconds / call.time.nanoseconds
        rows.append(
            {
                "question": name_of(question),
                "scene": question.scene,
                "how": time.variant,
                "share": 1 / ratio,
                "time_text": time_text(time.nanoseconds),
                "variation": share_text(time.variation),
                "factor": "–" if call is whole else factor_text(ratio),
                "dofs": dofs.get(time.variant, "–"),
                "flops": _flops(call),
            }
        )
    ratio = whole.time.nanoseconds / pruned.time.nanoseconds
    rules = rules_in_words(question) or ["no rule has anything to leave out"]
    return f"{name_of(question)}: {factor_text(ratio)}", rules, rows


def _table(questions: list[Question]) -> Table:
    with_alone = any(call.time.variant == "alone" for it in questions for call in it.calls)
    columns = ["Question", "Scene:N", "DoF left", "Precision", "Whole", "Pruned", "Pruned is"]
    columns += ["Alone", "Pruned over alone"] if with_alone else []
    columns += ["Operations: whole", "Pruned"]
    rows = []
    for question in questions:
        for precision in sorted({call.time.precision for call in question.calls}, reverse=True):
            whole, pruned, alone = (
                _of(question, how, precision) for how in ("whole", "pruned", "alone")
            )
            cells = [name_of(question), question.scene, str(question.dofs_left), precision]
            cells += [_time(whole), _time(pruned)]
            cells.append(factor_text(_ratio(whole, pruned)) if whole and pruned else "–")
            if with_alone:
                over = three_digits(_ratio(pruned, alone)) if pruned and alone else "–"
                cells += [_time(alone), over]
            rows.append([*cells, _flops(whole), _flops(pruned)])
        rules = "; ".join(rules_in_words(question)) or "nothing"
        rows.append([Markup("<code>{}</code> Left out: {}.").format(command(question), rules)])
    return Table(
        "Median times of a call. Below each question: how to ask for its plan, and what that "
        "leaves out. Operations: additions, multiplications and divisions of floating-point "
        "numbers, as the plan counts them.",
        columns,
        rows,
        "llrl" + "r" * (len(columns) - 4),
    )


def _time(call: Call | None) -> str:
    return time_text(call and call.time.nanoseconds)


def _ratio(first: Call, second: Call) -> float:
    return first.time.nanoseconds / second.time.nanoseconds


def _flops(call: Call | None) -> str:
    return f"{call.flops:.0f}" if call and call.flops else "–"


def _refusals(questions: list[Question]) -> list[str]:
    return [
        f"Not timed: {name_of(question)}, {time.variant}, {time.precision}: {time.refused}."
        for question in questions
        for time, *_ in question.calls
        if time.refused
    ]
