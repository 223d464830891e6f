"""Every variant is recorded once for the robot from the same templates, what is known of the robot
is folded, and the C is compiled by the same compiler with the same flags: they differ in nothing
but their equations. The code does not test for singularity.
"""

from charts.text import TASKS, thousands_text
from page.section import Column, Section, left, of, right
from read.data import Call, Data, scene_size
from sections.common import call_text, ratio
from sections.method import timed_calls

PLAIN = "Generated<Sequential<Conventional>>"
ORDER = (  # updates of the filter, then what else factors M
    PLAIN,
    "Generated<Sequential<Joseph>>",
    "Generated<Sequential<UD>>",
    "Generated<Sequential<ArrayMGS>>",
    "Generated<Sequential<ArrayGivens>>",
    "Generated<Sequential<ArrayHouseholder>>",
)
PRECISIONS = ("float64", "float32")
FORMS = {"": "one state", "_batch": "rows"}


def section(data: Data) -> Section | None:
    if not data.generated:
        return None
    page = Section("What a square root costs, all else equal", __doc__)
    page.say(*timed_calls(data.generated_contexts))
    refused = {(call.time.scene, call.time.refused) for call in data.generated if call.time.refused}
    page.say(*(f"Refused at {scene}: {reason}." for scene, reason in sorted(refused)))
    for task in ("acceleration", "inverse"):
        _table(page, data.generated, task)
    return page


def _table(page: Section, calls: list[Call], task: str) -> None:
    known = {call.time[:4]: call for call in calls}

    def columns(precision: str, form: str) -> list[Column]:
        def call(scene: str, variant: str) -> Call | None:
            return known.get((scene, variant, precision, task + form))

        def over_plain(*series: str) -> float | None:
            own, plain = call(*series), call(series[0], PLAIN)
            return own and plain and ratio(own.time.nanoseconds, plain.time.nanoseconds)

        return [
            *of(call, right(f"{precision}, {FORMS[form]}", "time", call_text)),
            right("Ratio", over_plain, "{:.2f}".format),
        ]

    def operations(*series: str) -> float | None:
        of_one = (known.get((*series, precision, task)) for precision in PRECISIONS)
        return next((call.flops for call in of_one if call and call.flops), None)

    timed = {call.time.scene for call in calls if not call.time.refused}
    series = {key[:2] for key in known if key[3].removesuffix("_batch") == task and key[0] in timed}
    page.table(
        f"""{TASKS[task]}: median times of a state, and how many times as long as Conventional
        takes. Operations: additions, multiplications, divisions and roots. Rows: by the state, of
        as many states as a batch has. Refused: wrong, singular, or not compiled.""",
        [
            left("Scene:N", lambda scene, _: scene),
            left("Variant", lambda _, it: it.removeprefix("Generated<").removesuffix(">")),
            right("Operations", operations, lambda count: thousands_text(count, 6)),
            [columns(precision, form) for precision in PRECISIONS for form in FORMS],
        ],
        sorted(series, key=_rank),
    )


def _rank(key: tuple[str, str]) -> tuple:
    scene, variant = key
    known = variant in ORDER
    return scene_size(scene), scene, not known, ORDER.index(variant) if known else 0, variant
