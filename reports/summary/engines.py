"""Every cell that was planned: an engine, or a form of ours, in a precision, asked for a task in so
many states a call; its status with the reason, errors and times."""

from typing import NamedTuple

from read.data import Call, Data, EngineAnswer, EngineTime, Error, scene_name
from read.engines import DIFFERS, NOT_ASKED, OK, REFUSED, WARNED
from read.ladder import GENERATED, is_ladder
from summary.groups import by_key
from summary.points import failed, middle_and_worst, summarise

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
    found = []
    for key, rows in by_key(answers, lambda row: row[:5]).items():
        cell = Cell(*key, *_verdict(rows), *middle_and_worst([row.value for row in rows]))
        if time := timed.get(key):
            cell = cell._replace(
                time=time.nanoseconds,
                with_copies=time.with_copies,
                first_call=time.first_call,
                version=time.version,
                machine=time.cpu,
                command=time.engine and f"scripts/engines {time.engine} {argument(time.scene)}",
            )
        found.append(cell)
    return found


def argument(scene: str) -> str:
    """As programs are given a scene."""
    name = scene_name(scene)
    return scene if name in FAMILIES else name


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
    ours = [it for it in data.errors + data.ladder_errors if _is_ours(it.variant)]
    errors = by_key((it for it in ours if it.measure == "relative"), lambda it: it[:4])
    alone = [Call(it, None, None, None) for it in data.times]
    calls = {  # the last counts
        (*call.time[:4], call.states): call
        for call in data.dynamics + alone + data.ladder_calls
        if _is_ours(call.time.variant)
    }
    found = []
    for (scene, variant, precision, task, states), call in calls.items():
        one = task.removesuffix(BATCH)
        rows = errors.get(call.time[:4]) or errors.get((scene, variant, precision, one))
        if not rows:
            continue
        name = LADDER if is_ladder(variant) else f"{variant}, C"
        found.append(
            Cell(
                *(scene, name, precision, one, states if task != one else 1),
                *_our_verdict(rows, call),
                *summarise(rows)[:4],
                *(call.time.nanoseconds, call.time.nanoseconds),
                version=", ".join(_distinct(data, "git_revision")),
                machine=", ".join(_distinct(data, "cpu")),
                command=f"scripts/report {argument(scene)}",
                tolerance=variant,
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
    """Pairs before and now of cells whose status or version is another, whose worst error changed
    by more than a factor of `worse`, or whose time by more than one of `slower`."""

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
