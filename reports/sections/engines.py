"""Other engines on the same mechanisms: what they answer, how wrong, how fast."""

import statistics
from collections import defaultdict
from itertools import groupby
from typing import NamedTuple

from charts import variants as variant_charts
from charts.common import SCENE, VIEW, Style, view
from charts.text import error_text, measure_text, task_rank, task_text, time_text
from page.section import Choice, Figure, Section, Table
from read.data import Data, EngineAnswer, EngineTime, scene_name, scene_size
from read.engines import OK, WARNED
from summary.points import Point

WRONG = (1e-3, 1e-6)  # errors that are counted where nothing was said
OURS = "Kalmarm"  # begins the names of its forms
SHOWN = 3  # scenes that are named for their errors


class Series(NamedTuple):
    variant: str
    precision: str


def section(data: Data) -> Section | None:
    if not data.engine_answers:
        return None
    by_task = _grouped(data.engine_answers, lambda it: (it.task, it.measure))
    tasks = sorted(by_task, key=lambda key: task_rank(key[0]))
    options = [(view(*key), f"{task_text(key[0])}, {measure_text(key[1])}") for key in tasks]
    first = view(*next((key for key in tasks if key[0] == "acceleration"), tasks[0]))
    choice = Choice(VIEW, "Task", options, first)
    drawn = _points(data.engine_answers, data.engine_times)
    style = Style((it.variant for it in drawn), (it.precision for it in drawn))
    tables = [_answers(by_task[key], view(*key), view(*key) == first) for key in tasks]
    return Section(
        "Every engine",
        [
            "Engines that people use, asked about the same mechanisms in the same states through "
            "their own Python packages, against proven truth of parameters and states as float32 "
            "holds them. Silently wrong: an answer beyond the error with neither refusal nor "
            "warning. An engine that knows no armature is asked about the mechanism without.",
            "Rounded parameters is no engine: it is how far the true answer moves when parameters "
            "are rounded to float32, which an engine in float32 cannot avoid.",
        ],
        statements=[f"Versions: {_versions(data.engine_times)}."] if data.engine_times else [],
        choices=[choice],
        variants=style.variants,
        precisions=style.precisions,
        figures=_figures(drawn, style, first),
        tables=[*tables, *_times(data.engine_times), *_silences(data.engine_answers)],
    )


def _grouped(rows, key) -> dict:
    return {name: list(own) for name, own in groupby(sorted(rows, key=key), key)}


def _series(row) -> Series:
    return Series(row.variant, row.precision)


def _order(scene: str) -> tuple:
    return scene_size(scene), scene


def _versions(times: list[EngineTime]) -> str:
    versions = {
        OURS if time.variant.startswith(OURS) else time.variant: time.version
        for time in times
        if time.version
    }
    return ", ".join(f"{name} {version}" for name, version in sorted(versions.items()))


def _answers(rows: list[EngineAnswer], shown: str, first: bool) -> Table:
    """A row a series: how many it answered, how many of these are wrong, how wrong, and on what."""
    lines = []
    for series, own in _grouped(rows, _series).items():
        errors = [row.value for row in own if row.value is not None]
        silent = [row.value for row in own if row.outcome == OK]
        warned = sum(row.outcome == WARNED for row in own)
        beyond = [sum(value > limit for value in silent) for limit in WRONG]
        worst = max(errors, default=None)
        cells = [series.variant, series.precision, f"{len(errors)} of {len(own)}", str(warned)]
        cells += map(str, beyond)
        cells += [error_text(worst), error_text(statistics.median(errors) if errors else None)]
        order = (-len(errors) / len(own), *beyond, worst or 0, series)
        lines.append((order, [*cells, _loses(own)]))
    columns = ["Engine", "Precision", "Answered", "Warned"]
    columns += [f"Silently beyond {limit:.0e}".replace("e-0", "e-") for limit in WRONG]
    return Table(
        "What engines answer, and how wrong they are: of all states",
        [*columns, "Worst", "Median", "Loses most on"],
        [cells for _, cells in sorted(lines)],
        "llrrrrrrl",
        shown={VIEW: shown},
        first=first,
    )


def _loses(rows: list[EngineAnswer]) -> str:
    """The scenes of its largest errors, where they are large."""
    worst = {
        scene: max(row.value for row in own)
        for scene, own in _grouped((row for row in rows if row.value), lambda it: it.scene).items()
    }
    named = sorted(worst, key=lambda scene: -worst[scene])
    named = [scene for scene in named if worst[scene] > WRONG[-1]][:SHOWN]
    return ", ".join(f"{scene_name(scene)} {error_text(worst[scene])}" for scene in named) or "–"


def _points(answers: list[EngineAnswer], times: list[EngineTime]) -> list[Point]:
    """Of series that were timed, one state a call."""
    known = {
        (time.scene, _series(time), time.task): time
        for time in times
        if time.batch == 1 and time.nanoseconds is not None
    }
    points = []
    groups = _grouped(answers, lambda it: (it.scene, _series(it), it.task, it.measure))
    for (scene, series, task, measure), own in groups.items():
        if not (time := known.get((scene, series, task))):
            continue
        errors = [row.value for row in own if row.value is not None]
        reasons = ", ".join(sorted({row.outcome for row in own if row.value is None}))
        points.append(
            Point(
                scene,
                scene_name(scene),
                scene_size(scene),
                *series,
                task,
                measure,
                time.nanoseconds,
                time.variation,
                statistics.median(errors) if errors else None,
                max(errors, default=None),
                len(own),
                len(own) - len(errors),
                reasons,
            )
        )
    return points


def _figures(points: list[Point], style: Style, first: str) -> list[Figure]:
    if not points:
        return []
    scenes = sorted({point.scene for point in points}, key=_order)
    counts = {scene: sum(point.scene == scene for point in points) for scene in scenes}
    most = max(scenes, key=lambda scene: counts[scene])
    choice = Choice(SCENE, "Mechanism", [(scene, scene) for scene in scenes], most)
    chart = variant_charts.work_precision(points, style, {VIEW: first, SCENE: most}, every=True)
    title = "error against the time of a call from Python"
    return [Figure(title, chart, variant_charts.TOOLTIPS, choices=[choice])]


def _times(times: list[EngineTime]) -> list[Table]:
    """Of accelerations: one state, a state of so many at once, and the first call."""
    own = [time for time in times if time.task == "acceleration"]
    counts = sorted({time.batch for time in own if time.nanoseconds} | {1})
    rows = []
    for scene, here in sorted(
        _grouped(own, lambda it: it.scene).items(), key=lambda it: _order(it[0])
    ):
        for series, calls in _grouped(here, _series).items():
            known = {call.batch: call for call in calls if call.nanoseconds}
            if not known:
                continue
            first = next(
                (call.first_call for _, call in sorted(known.items()) if call.first_call), 0
            )
            cells = [
                time_text(known[count].nanoseconds) if count in known else "–" for count in counts
            ]
            rows.append([scene, *series, *cells, f"{first:.2g} s"])
    if not rows:
        return []
    at_once = [f"A state of {count}" for count in counts if count > 1]
    columns = ["Scene:N", "Engine", "Precision", "One state", *at_once, "First call"]
    caption = "Time of an acceleration from Python; the first call has what is compiled"
    return [Table(caption, columns, rows, "lll" + "r" * (len(counts) + 1), folded=True)]


def _silences(answers: list[EngineAnswer]) -> list[Table]:
    """Why there is no answer, a row a series and reason."""
    scenes = defaultdict(set)
    for row in answers:
        if row.value is None:
            reason = f"{row.outcome}: {row.reason}" if row.reason else row.outcome
            scenes[_series(row), reason].add((row.scene, row.task))
    rows = [
        [
            *series,
            reason,
            ", ".join(sorted({task for _, task in where}, key=task_rank)),
            ", ".join(sorted({scene for scene, _ in where}, key=_order)),
        ]
        for (series, reason), where in sorted(scenes.items())
    ]
    if not rows:
        return []
    columns = ["Engine", "Precision", "Reason", "Tasks", "Scenes"]
    return [Table("What engines do not answer", columns, rows, "lllll", folded=True)]
