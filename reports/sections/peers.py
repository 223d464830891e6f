"""The fast path against other libraries: a bar table a task and robot, all of one run."""

from itertools import groupby
from typing import NamedTuple

from markupsafe import Markup

from charts import palette
from charts.groups import LIBRARIES
from charts.text import factor_text, task_rank, task_text, time_text
from page.section import Choice, Section, Table
from read.data import Call, Data, scene_name, scene_size
from sections.method import distinct

TASK = "task"


class Row(NamedTuple):
    variant: str
    precision: str
    nanoseconds: float | None
    refused: str
    is_peer: bool


class Contest(NamedTuple):
    """All that does one task on one scene, the fastest first; what is not timed is last."""

    task: str
    scene: str
    rows: list[Row]

    @property
    def best_peer(self) -> Row | None:
        timed = (row for row in self.rows if row.is_peer and row.nanoseconds)
        return next(timed, None)


def section(data: Data) -> Section | None:
    if not data.peers:
        return None
    contests = _contests(data.peers)
    tasks = list(dict.fromkeys(contest.task for contest in contests))
    present = {_peer(call.time.variant) for call in data.peers}
    statements = [
        f"A timed call: {text}" for text in distinct(data.peers_contexts, "timed_call")
    ] + [f"Versions: {text}." for text in distinct(data.peers_contexts, "peers")]
    if absent := [peer for peer in LIBRARIES if peer not in present]:
        statements.append(
            f"Not in this run: {', '.join(absent)}. bench_peers measures those that it was built "
            "with; scripts/setup --peers installs them."
        )
    return Section(
        "Against peers",
        [
            "Our fast path and other libraries on the same model and states in one run, by one "
            "thread; a library that knows no armature solves the model without. Every result was "
            "checked before it was timed. After an @ stands the compiler, in brackets the "
            "convention of a library that has several.",
        ],
        statements=statements,
        choices=[Choice(TASK, "Task", [(task, task_text(task)) for task in tasks], tasks[0])],
        tables=[table for task in tasks if (table := _overview(contests, task, task == tasks[0]))]
        + [_bars(contest, data.peers, contest.task == tasks[0]) for contest in contests],
    )


def _peer(variant: str) -> str | None:
    """The library, or None for ours."""
    name = palette.family(variant)
    return name if name in LIBRARIES else None


def _contests(calls: list[Call]) -> list[Contest]:
    def key(call: Call):
        scene = call.time.scene
        return *task_rank(call.time.task), scene_size(scene), scene

    contests = []
    for (_, task, _, scene), group in groupby(sorted(calls, key=key), key):
        rows = [_row(call) for call in group]
        rows.sort(key=lambda row: (row.nanoseconds is None, row.nanoseconds, row.variant))
        contests.append(Contest(task, scene, rows))
    return contests


def _row(call: Call) -> Row:
    time = call.time
    is_peer = _peer(time.variant) is not None
    return Row(time.variant, time.precision, time.nanoseconds, time.refused, is_peer)


def _overview(contests: list[Contest], task: str, first: bool) -> Table | None:
    """Our best in each precision against the best peer."""
    rows = []
    for contest in contests:
        best = contest.best_peer
        if contest.task != task or not best:
            continue
        ours = [row for row in contest.rows if not row.is_peer]
        for precision in sorted({row.precision for row in ours}, reverse=True):
            mine = next(row for row in ours if row.precision == precision)
            if mine.nanoseconds:
                cells = [contest.scene, precision, mine.variant, time_text(mine.nanoseconds)]
                cells += [best.variant, time_text(best.nanoseconds)]
                rows.append([*cells, factor_text(best.nanoseconds / mine.nanoseconds)])
    if not rows:
        return None
    return Table(
        f"{task_text(task)}: our fastest against the fastest peer, in float64",
        ["Scene:N", "Precision", "Ours", "Time", "Best peer", "Time", "Ours is"],
        rows,
        "lllrlrr",
        shown={TASK: task},
        first=first,
    )


def _bars(contest: Contest, calls: list[Call], first: bool) -> Table:
    timed = [row for row in contest.rows if row.nanoseconds]
    longest = max((row.nanoseconds for row in timed), default=0)
    best = contest.best_peer
    rows = []
    for row in timed:
        width = f"{100 * row.nanoseconds / longest:.2f}%"
        whose = "peer" if row.is_peer else "ours"
        bar = Markup('<span class="bar {}" style="width: {}"></span>').format(whose, width)
        name = row.variant if row.is_peer else Markup("<strong>{}</strong>").format(row.variant)
        against = "–"
        if best:
            ratio = best.nanoseconds / row.nanoseconds
            against = "best peer" if row == best else factor_text(ratio)
        rows.append([name, time_text(row.nanoseconds), bar, against, row.precision, whose])
    if missing := _missing(contest, calls):
        rows.append([f"Missing: {', '.join(missing)}"])
    size = f"{scene_name(contest.scene)}, N = {scene_size(contest.scene)}"
    return Table(
        f"{size}: {task_text(contest.task)}",
        ["Variant", "Time", "As a bar", "Against the best peer", "Precision", "Whose"],
        rows,
        "lrlrll",
        shown={TASK: contest.task},
        first=first,
        style="bars",
    )


def _missing(contest: Contest, calls: list[Call]) -> list[str]:
    """What of this run is not among the times, and why."""
    here = {_peer(row.variant) for row in contest.rows}
    present = {_peer(call.time.variant) for call in calls} - {None}
    able = {_peer(call.time.variant) for call in calls if call.time.task == contest.task}
    missing = [
        f"{row.variant} in {row.precision} ({row.refused})"
        for row in contest.rows
        if row.nanoseconds is None
    ]
    for peer in LIBRARIES:
        if peer in present - here:
            why = "not measured on this scene" if peer in able else "has no such call"
            missing.append(f"{peer} ({why})")
    return missing
