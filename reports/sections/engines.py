"""The first section: which engine, precision and batch for a robot, and what every cell says."""

from collections import Counter
from statistics import median

from charts import engines as engine_charts
from charts.common import SCENE, VIEW, view
from charts.engines import BATCH, batch_text
from charts.text import error_text, measure_text, task_rank, task_text, time_text
from page.section import Section, left, right
from read.data import Data, scene_name, scene_size
from read.engines import WARNED
from read.ladder import DEFAULT
from sections.common import Group, groups, style_of
from summary.engines import LADDER, STATUSES, WRONG, Cell, best, cells
from summary.groups import by_key

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
    texts = {view(task, "relative"): task_text(task) for task in tasks}
    first_view = view(FIRST_TASK, "relative")
    rows = engine_charts.cell_rows(found)
    page = Section(
        TITLE if len(scenes) > 1 else f"{TITLE} for {scene_name(first)}",
        style=style_of(rows),
        opened=True,
        wide=True,
    )
    page.say(*(f"Not read: {it}." for it in data.engine_faults))
    page.choose(SCENE, "Robot", scenes, scene_name, first)
    page.choose(VIEW, "Task", texts, texts.get, first_view if first_view in texts else "")
    batches = sorted({cell.batch for cell in found})
    page.choose(BATCH, "States a call", batches, batch_text, slider=True)
    for scene in scenes:
        page.answer([_answer(scene, found)], leads=True, shown={SCENE: scene})
    if rows:
        page.figure(
            "error against time",
            engine_charts.error_against_time(rows, page.style, page.first),
            engine_charts.COLUMNS,
            notes=NOTES + (OF_ENGINES if data.engine_answers else NO_ENGINES),
            table="Every cell: status, times, versions, command",
        )
    single = [it for it in data.engine_answers if it.batch == 1]  # else the error is its cell's
    of_task = groups(single, "task", "measure")
    for it in sorted(of_task, key=lambda it: (task_rank(it.task), it.measure)):
        _over_mechanisms(page, it)
    return page


def _answer(scene: str, found: list[Cell]) -> str:
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
    return f"For {scene_name(scene)}, {said}."


def _costs(cell: Cell, unit: str = "") -> str:
    return f"{time_text(cell.time)}{unit}, error {error_text(cell.median)}"


def _named(cell: Cell) -> str:
    if not cell.ours:
        return f"{cell.variant} ({cell.precision})"
    if cell.variant != LADDER:
        return f"code for this robot ({cell.precision})"
    return DOORS[cell.precision]


NOTES = f"""
Mark: median error; line: up to the largest of the states; hollow: wrong in silence. Down and to
the left is better. Circle: float64, triangle: float32. A line joins the ladder's tolerances; those
that one precision answers alike share a label. One state of Dynamics<float> is answered in float64
and rounded.

A cell is {STATUSES[0]} where the error of every state is below {WRONG:g}, and {STATUSES[3]} where
a larger one came without a word. An engine without armature is asked about the mechanism without:
the model differs. Errors are against proven truth.

"""
OF_ENGINES = """
Engines are called from Python, in states and of parameters that float32 holds; ours marked C++ or
C from C++, in other states. Rounded parameters is no engine: it is how far the true answer moves
when parameters are rounded to float32.
"""
NO_ENGINES = "Other engines were not asked: scripts/engines."


def _over_mechanisms(page: Section, of_task: Group) -> None:
    """A row a series: how many it answered, how many of these are wrong, how wrong, and on what."""
    series = groups(of_task.own, "variant", "precision")
    for it in series:
        it.errors = [row.value for row in it.own if row.value is not None]
        it.warned = sum(row.outcome == WARNED for row in it.own)
        silent = [row.value for row in it.own if row.value is not None and row.outcome != WARNED]
        it.beyond = [sum(value > limit for value in silent) for limit in LIMITS]
        it.worst = max(it.errors, default=None)

    def rank(it: Group) -> tuple:
        answered = len(it.errors) / len(it.own)
        return -answered, *it.beyond, it.worst or 0, it.variant, it.precision

    page.table(
        f"""{task_text(of_task.task)}, {measure_text(of_task.measure)}: engines over the states of
        all mechanisms""",
        [
            left("Engine", "variant"),
            left("Precision", "precision"),
            right("Answered", lambda it: f"{len(it.errors)} of {len(it.own)}"),
            right("Warned", "warned"),
            [
                right(
                    f"Silently beyond {limit:.0e}".replace("e-0", "e-"),
                    lambda it, i=i: it.beyond[i],
                )
                for i, limit in enumerate(LIMITS)
            ],
            right("Worst", "worst", error_text),
            right("Median", lambda it: median(it.errors) if it.errors else None, error_text),
            left("Loses most on", _loses),
        ],
        sorted(series, key=rank),
        folded=True,
        shown={VIEW: view(of_task.task, "relative")},
    )


def _loses(series: Group) -> str | None:
    """The scenes of its largest errors, where they are large."""
    scenes = by_key((row for row in series.own if row.value), lambda row: row.scene)
    worst = {scene: max(row.value for row in scenes[scene]) for scene in sorted(scenes)}
    large = [scene for scene in worst if worst[scene] > LIMITS[-1]]
    large.sort(key=lambda scene: -worst[scene])
    named = (f"{scene_name(scene)} {error_text(worst[scene])}" for scene in large[:SHOWN])
    return ", ".join(named) or None
