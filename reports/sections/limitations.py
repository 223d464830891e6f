"""What the numbers do not say, and what is missing from this run."""

from collections import defaultdict

from charts.text import share_text, task_text
from page.section import Section, Table
from read.data import Data
from sections.method import distinct
from summary.points import points

NOISY = 0.05


def section(data: Data) -> Section:
    timed = [time for time in data.all_times if time.variation is not None]
    noisy = sum(time.variation > NOISY for time in timed)
    statements = []
    if timed:
        statements.append(
            f"Times are noisy: {noisy} of {len(timed)} vary by more than {share_text(NOISY)} over "
            "their repetitions (standard deviation over mean). The machine may have been shared."
        )
    statements += [
        "Times are those of one machine, one compiler"
        f"{' (but where an @ names another)' if data.peers else ''} and one thread"
        f"{', but of scans' if data.scan_calls else ''}. Another "
        "machine may order the variants differently.",
        "The truth is a multi-precision solution for the model's parameters rounded to the "
        "working precision. The error of that rounding, and how well the parameters are known, "
        f"are not part of any error here.{_proven(data)}",
        "States are random and finite in number. The largest error found is not a bound.",
        f"Not measured: {', '.join(_not_measured(data))}.",
    ]
    if data.papers:
        statements.append(
            "An equation that passes holds to rounding in one random state of the scenes shown. "
            "That is a check, not a proof."
        )
    if data.samples:
        statements.append(
            "The random model is simulated for one state of a robot; its errors depend on the "
            "robot and, through the random numbers, on luck. A time extrapolated over many orders "
            "of magnitude tells its own order at best."
        )
    for key in ("git_revision", "compiler", "flags"):
        if len(distinct(data.all_contexts, key)) > 1:
            statements.append(f"Files of this run differ in {key}: do not compare their times.")
    return Section("Limitations", statements=statements + _missing(data), tables=_failures(data))


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
        "errors": {row.scene for row in data.errors},
        "times": {time.scene for time in data.times},
    }
    statements = []
    for kind, scenes in kinds.items():
        if missing := [scene for scene in data.scenes if scene not in scenes]:
            statements.append(f"No {kind} recorded: {', '.join(missing)}.")
    compared = {robot["scene"] for robot in data.mujoco}
    if missing := [scene for scene in data.robots if scene not in compared]:
        statements.append(f"Not compared with MuJoCo: {', '.join(missing)}.")
    return statements + _missing_variants(data)


def _missing_variants(data: Data) -> list[str]:
    """A variant that other scenes have for the same precision and task, and a scene does not."""
    present = defaultdict(set)
    for point in points(data):
        present[point.task, point.variant, point.precision].add(point.scene)
    scenes_of_task = defaultdict(set)
    for (task, _, _), scenes in present.items():
        scenes_of_task[task] |= scenes
    missing = defaultdict(list)  # series by task and by the scenes that have them
    for (task, variant, precision), scenes in sorted(present.items()):
        if scenes < scenes_of_task[task]:
            missing[task, tuple(sorted(scenes))].append(f"{variant} in {precision}")
    return [
        f"{task_text(task)}: {', '.join(series)}: only on {', '.join(scenes)}."
        if len(scenes) <= len(scenes_of_task[task]) / 2
        else f"{task_text(task)}: {', '.join(series)}: not on "
        f"{', '.join(scene for scene in data.scenes if scene in scenes_of_task[task] - set(scenes))}."
        for (task, scenes), series in missing.items()
    ]


def _failures(data: Data) -> list[Table]:
    rows = {
        (
            point.scene,
            task_text(point.task),
            point.variant,
            point.precision,
        ): f"{point.failures} of {point.states} states: {point.reasons}"
        for point in points(data)
        if point.failures
    }
    for time in data.times:
        if time.refused:
            key = (time.scene, task_text(time.task), time.variant, time.precision)
            rows[key] = "; ".join(filter(None, [rows.get(key), f"not timed: {time.refused}"]))
    if not rows:
        return []
    columns = ["Scene", "Task", "Variant", "Precision", "What failed"]
    return [
        Table(
            f"All {len(rows)} failures",
            columns,
            [[*key, text] for key, text in rows.items()],
            "lllll",
            len(rows) > 8,
        )
    ]


def _proven(data: Data) -> str:
    """How far the truth of this run is from it at most; older runs do not say."""
    widths = [row.value for row in data.errors if row.measure == "truth_width"]
    if not widths:
        return ""
    return (
        f" In {len(widths)} solutions of this run it is proven, rounding included, to be right to "
        f"a relative {max(widths):.1e} or better."
    )
