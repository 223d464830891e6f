"""Every cell that was planned: an engine, or a form of ours, in a precision, asked for a task in so
many states a call; its status with the reason, errors and times."""

import statistics
from collections import defaultdict
from typing import NamedTuple

from read.data import Call, Data, EngineAnswer, EngineTime, Error, scene_name
from read.engines import DIFFERS, NOT_ASKED, OK, REFUSED, WARNED
from read.ladder import GENERATED, is_ladder
from summary.points import failed

STATUSES = VERIFIED, MODEL, WARN, SILENT, REFUSES, NONE, FAILS = (
    "verified",
    "model differs",
    "warned",
    "wrong in silence",
    "refused",
    "not asked",
    "failed",
)
WRONG = 1e-2  # a larger error is wrong; our forms promise to warn of it
FAMILIES = ("straight", "chain", "tree")  # whose size belongs to the name of a member
BATCH = "_batch"  # ends the task of our forms in many states a call
LADDER = "Kalmarm, C++"  # its tolerances are one series a precision


class Cell(NamedTuple):
    """Errors are over the states that were answered; times are of a state, in ns."""

    scene: str
    variant: str
    precision: str
    task: str
    batch: int
    status: str
    reason: str
    median: float | None
    worst: float | None
    states: int
    failures: int
    time: float | None = None
    with_copies: float | None = None
    first_call: float | None = None  # s, with compilation
    version: str = ""
    machine: str = ""
    command: str = ""  # that measures it again
    tolerance: str = ""  # variant of the ladder, of ours

    @property
    def ours(self) -> bool:
        return bool(self.tolerance)


def cells(data: Data) -> list[Cell]:
    return _of_engines(data.engine_answers, data.engine_times) + _ours(data)


def _of_engines(answers: list[EngineAnswer], times: list[EngineTime]) -> list[Cell]:
    timed = {(it.scene, it.variant, it.precision, it.task, it.batch): it for it in times}
    groups = defaultdict(list)
    for row in answers:
        groups[row[:5]].append(row)
    found = []
    for key, rows in groups.items():
        time = timed.get(key)
        status, reason = _verdict(rows)
        cell = Cell(*key, status, reason, *_errors([row.value for row in rows]))
        if time:
            command = f"scripts/engines {time.engine} {argument(time.scene)}" if time.engine else ""
            cell = cell._replace(
                time=time.nanoseconds,
                with_copies=time.with_copies,
                first_call=time.first_call,
                version=time.version,
                machine=time.cpu,
                command=command,
            )
        found.append(cell)
    return found


def argument(scene: str) -> str:
    """As programs are given a scene."""
    name = scene_name(scene)
    return scene if name in FAMILIES else name


def _errors(values: list[float | None]) -> tuple[float | None, float | None, int, int]:
    known = [value for value in values if value is not None]
    median, worst = (statistics.median(known), max(known)) if known else (None, None)
    return median, worst, len(values), len(values) - len(known)


def _verdict(rows: list[EngineAnswer]) -> tuple[str, str]:
    """The worst that is to be said of a cell."""
    silent = [row for row in rows if row.outcome in (OK, DIFFERS) and row.value > WRONG]
    none = [row for row in rows if row.value is None]
    if silent:
        return SILENT, _of(silent, rows)
    if none:
        word = none[0].outcome
        status = REFUSES if word == REFUSED else NONE if word in NOT_ASKED else FAILS
        said = none[0].reason if word in (REFUSED, *NOT_ASKED) else f"{word}: {none[0].reason}"
        return status, ", ".join(part for part in (said.rstrip(": "), _of(none, rows)) if part)
    for outcome, status in ((WARNED, WARN), (DIFFERS, MODEL)):
        if own := [row for row in rows if row.outcome == outcome]:
            return status, own[0].reason or _of(own, rows)
    return VERIFIED, ""


def _of(some: list, rows: list) -> str:
    return f"{len(some)} of {len(rows)} states" if len(some) < len(rows) else ""


def _ours(data: Data) -> list[Cell]:
    """The ladder at its tolerances and code for one robot, where both error and time are known."""
    errors = defaultdict(list)
    for row in data.errors + data.ladder_errors:
        if row.measure == "relative" and _is_ours(row.variant):
            errors[row[:4]].append(row)
    calls = {}
    alone = [Call(it, None, None, None) for it in data.times]
    for call in data.dynamics + alone + data.ladder_calls:  # the last counts
        if _is_ours(call.time.variant):
            calls[(*call.time[:4], call.states)] = call
    about = {
        "version": ", ".join(_distinct(data, "git_revision")),
        "machine": ", ".join(_distinct(data, "cpu")),
    }
    found = []
    for (scene, variant, precision, task, states), call in calls.items():
        one = task.removesuffix(BATCH)
        rows = errors.get((scene, variant, precision, task)) or errors.get(
            (scene, variant, precision, one)
        )
        if not rows:
            continue
        name = LADDER if is_ladder(variant) else f"{variant}, C"
        found.append(
            Cell(
                *(scene, name, precision, one, states if task != one else 1),
                *_our_verdict(rows, call),
                *_errors([None if failed(row) else row.value for row in rows]),
                *(call.time.nanoseconds, call.time.nanoseconds),
                command=f"scripts/report {argument(scene)}",
                tolerance=variant,
                **about,
            )
        )
    return found


def _is_ours(variant: str) -> bool:
    return (is_ladder(variant) or variant.startswith(GENERATED)) and "@" not in variant


def _our_verdict(rows: list[Error], call: Call) -> tuple[str, str]:
    bad = [row for row in rows if failed(row)]
    if bad:
        outcome = bad[0].outcome if bad[0].outcome != OK else "not finite"
        return REFUSES, ", ".join(part for part in (outcome, _of(bad, rows)) if part)
    wrong = [row for row in rows if row.value > WRONG]
    if wrong:
        return SILENT, _of(wrong, rows)
    return (FAILS, call.time.refused) if call.time.refused else (VERIFIED, "")


def _distinct(data: Data, key: str) -> list[str]:
    return list(dict.fromkeys(str(it[key]) for it in data.all_contexts if it.get(key)))


def best(found: list[Cell]) -> Cell | None:
    """The fastest of those that are right."""
    right = [cell for cell in found if cell.status == VERIFIED and cell.time]
    return min(right, key=lambda cell: cell.time, default=None)


def changed(now: list[Cell], before: list[Cell], worse: float, slower: float) -> list[tuple]:
    """Pairs before and now of cells whose status or version is another, whose worst error changed by
    more than a factor of `worse`, or whose time by more than one of `slower`."""

    def key(cell: Cell) -> tuple:
        return cell.scene, cell.variant, cell.tolerance, cell.precision, cell.task, cell.batch

    def apart(x: float | None, y: float | None, factor: float) -> bool:
        return bool(x and y) and not 1 / factor <= x / y <= factor

    known = {key(cell): cell for cell in before}
    pairs = [(known[key(cell)], cell) for cell in now if key(cell) in known and not cell.ours]
    return [
        (old, new)
        for old, new in pairs
        if (old.status, old.version) != (new.status, new.version)
        or apart(old.worst, new.worst, worse)
        or apart(old.time, new.time, slower)
    ]
