"""What a square root costs: the study's variants as code for one robot, all else equal."""

from charts.text import TASKS, thousands_text, time_text
from page.section import Section, Table
from read.data import Call, Data, Time, scene_size
from sections.method import distinct

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
    return Section(
        "What a square root costs, all else equal",
        [
            "Every variant is recorded once for the robot from the same templates, what is known of "
            "the robot is folded, and the C is compiled by the same compiler with the same flags: "
            "they differ in nothing but their equations. The code does not test for singularity."
        ],
        statements=[
            *(f"A timed call: {it}" for it in distinct(data.generated_contexts, "timed_call")),
            *_refusals([call.time for call in data.generated]),
        ],
        tables=[
            table for task in ("acceleration", "inverse") if (table := _table(data.generated, task))
        ],
    )


def _table(calls: list[Call], task: str) -> Table | None:
    known = {call.time[:4]: call for call in calls}
    timed = {call.time.scene for call in calls if not call.time.refused}
    of_task = [key for key in known if key[3].removesuffix("_batch") == task]
    series = {key[:2] for key in of_task if key[0] in timed}
    if not series:
        return None
    rows = []
    for scene, variant in sorted(series, key=_rank):
        row = [scene, variant.removeprefix("Generated<").removesuffix(">")]
        row.append(_operations(known, scene, variant, task))
        for precision in PRECISIONS:
            for form in FORMS:
                call = known.get((scene, variant, precision, task + form))
                plain = known.get((scene, PLAIN, precision, task + form))
                row += [_time(call), _ratio(call, plain)]
        rows.append(row)
    return Table(
        f"{TASKS[task]}: median times of a state, and how many times as long as Conventional takes. "
        "Operations: additions, multiplications, divisions and roots. Rows: by the state, of as many "
        "states as a batch has. Refused: wrong, singular, or not compiled.",
        ["Scene:N", "Variant", "Operations"]
        + [
            cell
            for precision in PRECISIONS
            for form in FORMS.values()
            for cell in (f"{precision}, {form}", "Ratio")
        ],
        rows,
        "llr" + "rr" * len(PRECISIONS) * len(FORMS),
    )


def _refusals(times: list[Time]) -> list[str]:
    refused = {(time.scene, time.refused) for time in times if time.refused}
    return [f"Refused at {scene}: {reason}." for scene, reason in sorted(refused)]


def _operations(known: dict, scene: str, variant: str, task: str) -> str:
    counts = [
        call.flops
        for precision in PRECISIONS
        if (call := known.get((scene, variant, precision, task))) and call.flops
    ]
    return thousands_text(counts[0], 6) if counts else "–"


def _time(call: Call | None) -> str:
    if call and call.time.refused:
        return "refused"
    return time_text(call and call.time.nanoseconds)


def _ratio(call: Call | None, plain: Call | None) -> str:
    if not (call and plain and call.time.nanoseconds and plain.time.nanoseconds):
        return "–"
    return f"{call.time.nanoseconds / plain.time.nanoseconds:.2f}"


def _rank(key: tuple[str, str]) -> tuple:
    scene, variant = key
    known = variant in ORDER
    return scene_size(scene), scene, not known, ORDER.index(variant) if known else 0, variant
