"""The first section: which engine, precision and batch for a robot, and what every cell says."""

import statistics
from collections import Counter
from itertools import groupby

from charts import engines as engine_charts
from charts.common import SCENE, VIEW, Style, view
from charts.engines import BATCH, batch_text
from charts.text import error_text, measure_text, task_rank, task_text, time_text
from page.section import Answer, Choice, Figure, Section, Table
from read.data import Data, EngineAnswer, scene_name, scene_size
from read.engines import WARNED
from read.ladder import DEFAULT
from summary.engines import LADDER, STATUSES, WRONG, Cell, best, cells

TITLE = "Which engine, precision and batch"
FIRST, FIRST_TASK = "panda", "acceleration"
LIMITS = (1e-3, 1e-6)  # errors that are counted where nothing was said
SHOWN = 3  # scenes that are named for their errors
DOORS = {"float64": "Dynamics<double>", "float32": "Dynamics<float>"}


def section(data: Data) -> Section | None:
    found = cells(data)
    if not any(cell.time for cell in found) and not data.engine_faults:
        return None
    scenes = sorted({cell.scene for cell in found}, key=lambda it: (scene_size(it), it))
    counts = Counter(cell.scene for cell in found if cell.task == FIRST_TASK and cell.time)
    plain = {it: "+" not in it for it in scenes}  # under no stress
    first = max(scenes, key=lambda it: (plain[it], counts[it], scene_name(it) == FIRST), default="")
    tasks = sorted({cell.task for cell in found}, key=task_rank)
    choices = _choices(scenes, first, tasks, sorted({cell.batch for cell in found}))
    shown = {choice.signal: choice.first for choice in choices}
    rows = engine_charts.cell_rows(found)
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    answers = [_answer(scene, found) for scene in scenes]
    for answer in answers:
        answer.first = answer.shown[SCENE] == first
    return Section(
        TITLE if len(scenes) > 1 else f"{TITLE} for {scene_name(first)}",
        statements=[f"Not read: {it}." for it in data.engine_faults],
        choices=[it for it in choices if len(it.options) > 1],
        variants=style.variants,
        precisions=style.precisions,
        answers=answers,
        figures=[_figure(rows, style, shown, _notes(data))] if rows else [],
        tables=_tables(data.engine_answers, shown.get(VIEW)),
        opened=True,
        wide=True,
    )


def _choices(scenes: list[str], first: str, tasks: list[str], batches: list[int]) -> list[Choice]:
    task = FIRST_TASK if FIRST_TASK in tasks else next(iter(tasks), "")
    counts = [(str(it), batch_text(it)) for it in batches]
    names = [(it, scene_name(it)) for it in scenes]
    tasks = [(view(it, "relative"), task_text(it)) for it in tasks]
    return [
        Choice(SCENE, "Robot", names, first),
        Choice(VIEW, "Task", tasks, view(task, "relative")),
        Choice(BATCH, "States a call", counts, counts[0][0] if counts else "", slider=True),
    ]


def _answer(scene: str, found: list[Cell]) -> Answer:
    """What to call and what it costs, in twenty words."""
    own = [it for it in found if it.scene == scene and it.task == FIRST_TASK]
    own = [it for it in own if it.variant != LADDER or it.tolerance == DEFAULT]
    single = [it for it in own if it.batch == 1]
    one = best([it for it in single if it.precision == "float64"]) or best(single)
    many = best([it for it in own if it.batch > 1 and (not one or it.time and it.time < one.time)])
    parts = [f"call {_named(one)}: {_costs(one, ' a state')}"] if one else []
    if many:
        rows = f"for {batch_text(many.batch)} states rows of {_named(many)}"
        parts.append(f"{rows}: {_costs(many)}")
    said = "; ".join(parts) or "no answer was both right and timed"
    return Answer([f"For {scene_name(scene)}, {said}."], leads=True, shown={SCENE: scene})


def _costs(cell: Cell, unit: str = "") -> str:
    return f"{time_text(cell.time)}{unit}, error {error_text(cell.median)}"


def _named(cell: Cell) -> str:
    if not cell.ours:
        return f"{cell.variant} ({cell.precision})"
    if cell.variant != LADDER:
        return f"code for this robot ({cell.precision})"
    return DOORS[cell.precision]


def _notes(data: Data) -> list[str]:
    said = [
        f"A cell is {STATUSES[0]} where the error of every state is below {WRONG:g}, and "
        f"{STATUSES[3]} where a larger one came without a word. An engine without armature is asked "
        "about the mechanism without: the model differs. Errors are against proven truth."
    ]
    if data.engine_answers:
        return [
            *said,
            "Engines are called from Python, in states and of parameters that float32 holds; ours "
            "marked C++ or C from C++, in other states. Rounded parameters is no engine: it is how "
            "far the true answer moves when parameters are rounded to float32.",
        ]
    return [*said, "Other engines were not asked: scripts/engines."]


def _figure(rows: list[dict], style: Style, shown: dict[str, str], notes: list[str]) -> Figure:
    return Figure(
        "error against time",
        engine_charts.error_against_time(rows, style, shown),
        engine_charts.COLUMNS,
        notes=[
            "Mark: median error; line: up to the largest of the states; hollow: wrong in silence. Down "
            "and to the left is better. Circle: float64, triangle: float32. A line joins the ladder's "
            "tolerances; those that one precision answers alike share a label. One state of "
            "Dynamics<float> is answered in float64 and rounded.",
            *notes,
        ],
        table="Every cell: status, times, versions, command",
    )


def _grouped(rows, key) -> dict:
    return {name: list(own) for name, own in groupby(sorted(rows, key=key), key)}


def _tables(answers: list[EngineAnswer], first: str | None) -> list[Table]:
    """By task, over all mechanisms; the error of a batch belongs to its cell."""
    by_task = _grouped((it for it in answers if it.batch == 1), lambda it: (it.task, it.measure))
    return [
        _over_mechanisms(rows, task, measure, view(task, "relative") == first)
        for (task, measure), rows in sorted(by_task.items(), key=lambda it: task_rank(it[0][0]))
    ]


def _over_mechanisms(rows: list[EngineAnswer], task: str, measure: str, first: bool) -> Table:
    """A row a series: how many it answered, how many of these are wrong, how wrong, and on what."""
    lines = []
    for series, own in _grouped(rows, lambda it: it[1:3]).items():
        errors = [row.value for row in own if row.value is not None]
        silent = [row.value for row in own if row.value is not None and row.outcome != WARNED]
        warned = sum(row.outcome == WARNED for row in own)
        beyond = [sum(value > limit for value in silent) for limit in LIMITS]
        worst = max(errors, default=None)
        cells = [*series, f"{len(errors)} of {len(own)}", str(warned), *map(str, beyond)]
        cells += [error_text(worst), error_text(statistics.median(errors) if errors else None)]
        order = (-len(errors) / len(own), *beyond, worst or 0, series)
        lines.append((order, [*cells, _loses(own)]))
    columns = ["Engine", "Precision", "Answered", "Warned"]
    columns += [f"Silently beyond {limit:.0e}".replace("e-0", "e-") for limit in LIMITS]
    return Table(
        f"{task_text(task)}, {measure_text(measure)}: engines over the states of all mechanisms",
        [*columns, "Worst", "Median", "Loses most on"],
        [cells for _, cells in sorted(lines)],
        "llrrrrrrl",
        folded=True,
        shown={VIEW: view(task, "relative")},
        first=first,
    )


def _loses(rows: list[EngineAnswer]) -> str:
    """The scenes of its largest errors, where they are large."""
    worst = {
        scene: max(row.value for row in own)
        for scene, own in _grouped((row for row in rows if row.value), lambda it: it.scene).items()
    }
    named = sorted(worst, key=lambda scene: -worst[scene])
    named = [scene for scene in named if worst[scene] > LIMITS[-1]][:SHOWN]
    return ", ".join(f"{scene_name(scene)} {error_text(worst[scene])}" for scene in named) or "–"
