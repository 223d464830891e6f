"""What the numbers do not say, and what is missing from this run."""

from operator import attrgetter

from charts.text import share_text, task_text
from page.section import Section, left
from read.data import Data
from sections.common import SERIES, groups
from sections.method import distinct
from summary.groups import by_key
from summary.points import points

NOISY = 0.05
MANY = 8  # rows of a table that is unfolded


def section(data: Data) -> Section:
    timed = [time for time in data.all_times if time.variation is not None]
    noisy = sum(time.variation > NOISY for time in timed)
    compilers = " (but where an @ names another)" if data.peers else ""
    threads = ", but of scans" if data.scan_calls else ""
    page = Section("Limitations")
    page.say(
        timed
        and f"""Times are noisy: {noisy} of {len(timed)} vary by more than {share_text(NOISY)} over
        their repetitions (standard deviation over mean). The machine may have been shared.""",
        f"""Times are those of one machine, one compiler{compilers} and one thread{threads}. Another
        machine may order the variants differently.""",
        f"""The truth is a multi-precision solution for the model's parameters rounded to the
        working precision. The error of that rounding, and how well the parameters are known, are
        not part of any error here. {_proven(data)}""",
        "States are random and finite in number. The largest error found is not a bound.",
        f"Not measured: {', '.join(_not_measured(data))}.",
        data.papers
        and """An equation that passes holds to rounding in one random state of the scenes shown.
        That is a check, not a proof.""",
        data.samples
        and """The random model is simulated for one state of a robot; its errors depend on the
        robot and, through the random numbers, on luck. A time extrapolated over many orders of
        magnitude tells its own order at best.""",
    )
    for key in ("git_revision", "compiler", "flags"):
        if len(distinct(data.all_contexts, key)) > 1:
            page.say(f"Files of this run differ in {key}: do not compare their times.")
    page.say(*_missing(data), *_missing_variants(data))
    found = [
        (point, f"{point.failures} of {point.states} states: {point.reasons}")
        for point in points(data)
        if point.failures
    ]
    found += [(time, f"not timed: {time.refused}") for time in data.times if time.refused]
    rows = by_key(found, lambda it: (it[0].scene, it[0].task, it[0].variant, it[0].precision))
    page.table(
        f"All {len(rows)} failures",
        [
            left("Scene", "scene"),
            left("Task", "task", task_text),
            SERIES,
            left("What failed", lambda _, text: text),
        ],
        [(own[0][0], "; ".join(dict.fromkeys(text for _, text in own))) for own in rows.values()],
        folded=len(rows) > MANY,
    )
    return page


def _not_measured(data: Data) -> list[str]:
    tasks = {call.time.task for call in data.dynamics + data.peers}
    what = ["contacts", "joint limits", "damping", "actuators", "constraints"]
    if "derivatives" not in tasks:
        what.append(f"derivatives{' (but for that of log det M)' if data.estimation else ''}")
    if "acceleration_batch" not in tasks:
        what.append("several states at once")
    return [*what, "GPUs"]


def _missing(data: Data) -> list[str]:
    kinds = {
        "No errors recorded": (data.scenes, {row.scene for row in data.errors}),
        "No times recorded": (data.scenes, {time.scene for time in data.times}),
        "Not compared with MuJoCo": (data.robots, {robot["scene"] for robot in data.mujoco}),
    }
    return [
        f"{said}: {', '.join(missing)}."
        for said, (wanted, present) in kinds.items()
        if (missing := [scene for scene in wanted if scene not in present])
    ]


def _missing_variants(data: Data) -> list[str]:
    """A variant that other scenes have for the same precision and task, and a scene does not."""
    known = points(data)
    of_task = {it.task: {point.scene for point in it.own} for it in groups(known, "task")}
    order = ("task", "variant", "precision")
    series = groups(sorted(known, key=attrgetter(*order)), *order)
    for it in series:
        it.scenes = tuple(sorted({point.scene for point in it.own}))
    statements = []
    for it in groups((it for it in series if set(it.scenes) < of_task[it.task]), "task", "scenes"):
        absent = [scene for scene in data.scenes if scene in of_task[it.task] - set(it.scenes)]
        only = len(it.scenes) <= len(of_task[it.task]) / 2
        where = f"only on {', '.join(it.scenes)}" if only else f"not on {', '.join(absent)}"
        names = ", ".join(f"{one.variant} in {one.precision}" for one in it.own)
        statements.append(f"{task_text(it.task)}: {names}: {where}.")
    return statements


def _proven(data: Data) -> str:
    """How far the truth of this run is from it at most; older runs do not say."""
    widths = [row.value for row in data.errors if row.measure == "truth_width"]
    if not widths:
        return ""
    return f"""In {len(widths)} solutions of this run it is proven, rounding included, to be right
        to a relative {max(widths):.1e} or better."""
