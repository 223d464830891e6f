"""A scene holds more than a question about it needs. Once a model, a plan works out what can go
without changing the answer; a call then does the rest. Whole: no rule is used. Pruned: the rules
named. Every pruned answer was compared with the whole one before it was timed.
"""

import shlex

from markupsafe import Markup

from charts import questions as question_charts
from charts.text import factor_text, share_text, task_rank, task_text, three_digits, time_text
from page.section import Section, left, of, right
from read.data import Call, Data, Question
from sections.common import Group, ratio
from sections.method import timed_calls

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
    asked = [
        _asked(question, precision)
        for question in questions
        for precision in sorted({it.time.precision for it in question.calls}, reverse=True)
    ]
    drawn = [it for it in asked if it.precision == DRAWN]
    compared = [it for it in drawn if it.whole and it.pruned]
    alone = "Alone: a scene with nothing but what is asked about, asked the same."
    page = Section(
        "What a question does not need", [__doc__, alone if any(it.alone for it in drawn) else ""]
    )
    page.say(*timed_calls(data.questions_contexts))
    for question in questions:
        for time, *_ in question.calls:
            if time.refused:
                what = f"{name_of(question)}, {time.variant}, {time.precision}"
                page.say(f"Not timed: {what}: {time.refused}.")
    if compared:
        chart = question_charts.before_and_after(list(map(_block, compared)))
        page.figure(f"before and after, {DRAWN}", chart, question_charts.TOOLTIPS)
    with_alone = any(call.time.variant == "alone" for it in asked for call in it.question.calls)

    def remark(it: Group) -> Markup | str:
        if it.precision != min(call.time.precision for call in it.question.calls):
            return ""  # a row of the same question follows
        rules = "; ".join(rules_in_words(it.question)) or "nothing"
        return Markup("<code>{}</code> Left out: {}.").format(command(it.question), rules)

    page.table(
        """Median times of a call. Below each question: how to ask for its plan, and what that
        leaves out. Operations: additions, multiplications and divisions of floating-point numbers,
        as the plan counts them.""",
        [
            left("Question", "question", name_of),
            left("Scene:N", "question.scene"),
            right("DoF left", "question.dofs_left"),
            left("Precision", "precision"),
            of("whole", right("Whole", "time.nanoseconds", time_text)),
            of("pruned", right("Pruned", "time.nanoseconds", time_text)),
            right("Pruned is", lambda it: _over(it.whole, it.pruned), factor_text),
            with_alone
            and [
                of("alone", right("Alone", "time.nanoseconds", time_text)),
                right("Pruned over alone", lambda it: _over(it.pruned, it.alone), three_digits),
            ],
            of("whole", right("Operations: whole", _flops)),
            of("pruned", right("Pruned", _flops)),
        ],
        asked,
        remark,
    )
    return page


def name_of(question: Question) -> str:
    title = question.title or f"{task_text(question.want)} of {question.scene}"
    return title[:1].upper() + title[1:]


def command(question: Question) -> str:
    return shlex.join(["plan", question.scene, *question.asked.split()])


def rules_in_words(question: Question) -> list[str]:
    return [RULES.get(rule, rule) for rule in question.rules]


def _asked(question: Question, precision: str) -> Group:
    """With its calls as far as they were timed in this precision."""
    own = (it for it in question.calls if it.time.precision == precision and it.time.nanoseconds)
    calls = dict.fromkeys(("whole", "pruned", "alone")) | {it.time.variant: it for it in own}
    return Group(question=question, precision=precision, **calls)


def _block(asked: Group) -> tuple[str, list[str], list[dict]]:
    """Heading, rules and bars."""
    question, whole = asked.question, asked.whole
    dofs = {"whole": question.dofs, "pruned": question.dofs_left}
    rows = [
        {
            "question": name_of(question),
            "scene": question.scene,
            "how": call.time.variant,
            "share": 1 / _over(whole, call),
            "time_text": time_text(call.time.nanoseconds),
            "variation": share_text(call.time.variation),
            "factor": "–" if call is whole else factor_text(_over(whole, call)),
            "dofs": dofs.get(call.time.variant, "–"),
            "flops": _flops(call) or "–",
        }
        for call in (whole, asked.pruned, asked.alone)
        if call
    ]
    rules = rules_in_words(question) or ["no rule has anything to leave out"]
    return f"{name_of(question)}: {factor_text(_over(whole, asked.pruned))}", rules, rows


def _flops(call: Call) -> str | None:
    return f"{call.flops:.0f}" if call.flops else None


def _over(first: Call | None, second: Call | None) -> float | None:
    return first and second and ratio(first.time.nanoseconds, second.time.nanoseconds)
