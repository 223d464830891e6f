"""Asks one engine about one mechanism, in the engine's own environment:

    worker.py ENGINE VARIANT PRECISION FOLDER [--tasks mass,…,batch:64] [--seconds S] [--eager]

A line of JSON each on standard output: {"version"}; {"begin": task} before a task, so that who
reads sees where a worker hangs or dies; {"task", "state", "error"}, or an "outcome"
that says why there is none; {"task", "nanoseconds", "with_copies", "variation", "repetitions",
"first_call"} once all states of a task are answered. Of batch:64 the task is the acceleration, its
errors are those of 64 states in one call, the worst of each state, its times those of a state.
{"refused"} says why the engine cannot be loaded, or cannot hold the mechanism.

FOLDER - reads folders from standard input, a line each, and says {"done": folder} after each: an
engine is imported once, and what it compiled for one mechanism serves the next of its structure.
"""

import argparse
import importlib
import json
import math
import os
import statistics
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path

import numpy as np

from protocol import (
    TASKS,
    Call,
    Engine,
    Mechanism,
    Refused,
    State,
    Unsupported,
    error,
    fault_of_precision,
)

REPETITIONS = 7  # of a timing; the median counts
FEWER, LONG = 3, 1.0  # of a call that takes longer than so many seconds
BATCH = "batch:"  # begins a task that is to answer so many states at once
BATCHED = "acceleration"  # by that task
WITHOUT_ARMATURE = "model differs: without armature"


def say(**record) -> None:
    print(json.dumps(record), file=OUT, flush=True)


def short(exception: Exception) -> str:
    lines = str(exception).strip().splitlines() or [""]
    return f"{type(exception).__name__}: {lines[0]}"[:200]


def run(call: Call) -> tuple[object, list]:
    """What it answers, and the warnings that it gives."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        return call.run(), caught


def judged(make, judge) -> tuple[Call | None, dict | list[dict]]:
    """Of the call that `make` gives what `judge` says of its answer, or why there is none."""
    try:
        call = make()
        raw, caught = run(call)
        return call, judge(raw, call.read(raw), caught)
    except Unsupported as reason:
        return None, {"outcome": f"unsupported: {reason}"}
    except Refused as reason:
        return None, {"outcome": f"refused: {reason}"}
    except Exception as reason:  # noqa: BLE001, whatever an engine raises is a record
        return None, {"outcome": f"failed: {short(reason)}"}


def verdict(engine: Engine, mechanism: Mechanism, value: float, fault: str, caught: list) -> dict:
    """Of an error, with what else is to be said of the answer."""
    if fault:
        return {"outcome": f"failed: {fault}"}
    if not math.isfinite(value):
        return {"outcome": "not finite"}
    if engine.warning and any(issubclass(one.category, engine.warning) for one in caught):
        return {"error": value, "outcome": "warned"}
    differs = mechanism.has_armature and not engine.armature
    return {"error": value} | ({"outcome": WITHOUT_ARMATURE} if differs else {})


def judge(engine: Engine, mechanism: Mechanism, precision: str, task: str, state: State) -> dict:
    """The error of one answer, or why there is none."""

    def make() -> Call:
        if task not in state.truth:
            raise Unsupported("it is asked of hinges and slides alone")
        if task not in engine.calls:
            raise Unsupported("it has no such call")
        return engine.call(task, state)

    def of(raw, answer, caught) -> dict:
        truth = state.truth[task]
        fault = fault_of_precision(precision, raw, answer, truth)
        return verdict(engine, mechanism, error(task, answer, truth), fault, caught)

    return judged(make, of)[1]


def judge_batch(engine: Engine, mechanism: Mechanism, precision: str, states: list, count: int):
    """The call of so many states, which take turns, and of each the worst of its answers."""
    asked = [states[i % len(states)] for i in range(count)]

    def of(raw, rows, caught) -> list[dict]:
        said = []
        for i, state in enumerate(asked[: len(states)]):
            truth, own = state.truth[BATCHED], rows[i :: len(states)]
            fault = fault_of_precision(precision, raw, own, truth)
            value = float(np.max([error(BATCHED, row, truth) for row in own]))  # NaN stays
            said.append(verdict(engine, mechanism, value, fault, caught))
        return said

    call, said = judged(lambda: engine.batch(asked), of)
    return call, said if call else [said] * min(count, len(states))


def seconds_of(runs: list, seconds: float, states: int) -> list[float]:
    """Of a state, by repetitions; the runs take turns, each is of so many states."""
    begin = time.perf_counter()
    runs[0]()
    once = max(time.perf_counter() - begin, 1e-7)
    repetitions = REPETITIONS if once < LONG else FEWER
    rounds = max(1, int(seconds / (repetitions * once * len(runs))))
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        for _ in range(rounds):
            for run in runs:
                run()
        times.append((time.perf_counter() - begin) / (rounds * len(runs) * states))
    return times


def timed(calls: list[Call], seconds: float, states: int = 1) -> dict:
    """Of a state, from the engine's own arrays and, where these are not NumPy's, from NumPy's."""
    warnings.simplefilter("ignore")
    times = seconds_of([call.run for call in calls], seconds, states)
    median = with_copies = statistics.median(times)
    if calls[0].with_copies:
        copied = seconds_of([call.with_copies for call in calls], seconds, states)
        with_copies = statistics.median(copied)
    return {
        "nanoseconds": 1e9 * median,
        "with_copies": 1e9 * with_copies,
        "variation": statistics.stdev(times) / statistics.mean(times),
        "repetitions": len(times),
    }


def ask(engine: Engine, mechanism: Mechanism, states: list[State], task: str, options) -> None:
    """Says all of a task, each answer as soon as it is there."""
    count = int(task.removeprefix(BATCH)) if task.startswith(BATCH) else 1
    # As if no cache of earlier runs had saved compilation.
    begin, first_call, said, calls = time.perf_counter() + engine.saved(), None, [], []
    if task.startswith(BATCH):
        call, said = judge_batch(engine, mechanism, options.precision, states, count)
        calls = [call] if call else []
    for i, state in enumerate(states[: len(said) or None]):
        if len(said) == i:
            said.append(judge(engine, mechanism, options.precision, task, state))
        first_call = first_call or time.perf_counter() + engine.saved() - begin
        say(task=task, state=i, **said[i])
    if options.seconds > 0 and all("error" in one for one in said):
        calls = calls or [engine.call(task, state) for state in states]
        say(task=task, first_call=first_call, **timed(calls, options.seconds, count))


def work(options: argparse.Namespace, adapter: type[Engine], folder: Path) -> None:
    mechanism = Mechanism(folder)
    say(begin="load")
    try:
        settings = adapter.variants.get(options.variant, {})
        engine = adapter(mechanism, options.precision, **settings)
    except Unsupported as reason:
        say(refused=f"unsupported: {reason}")
        return
    except Exception as reason:  # noqa: BLE001
        say(refused=f"failed: {short(reason)}")
        return
    states = mechanism.states(adapter.armature)
    for task in options.tasks.split(","):
        say(begin=task)
        ask(engine, mechanism, states, task, options)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("engine")
    parser.add_argument("variant")
    parser.add_argument("precision", choices=("float32", "float64"))
    parser.add_argument("folder", help="of export_mechanism, or -")
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--eager", action="store_true", help="no compilation for each mechanism")
    parser.add_argument("--seconds", type=float, default=0.1, help="of a timing; 0: none")
    options = parser.parse_args()
    try:
        adapter = importlib.import_module(f"adapters.{options.engine}").Adapter
        say(version=version(adapter.package))
    except Exception as reason:  # noqa: BLE001, one that cannot be imported here
        say(refused=f"failed: {short(reason)}")
        return 1
    adapter.eager = options.eager
    if options.folder != "-":
        work(options, adapter, Path(options.folder))
        return 0
    for line in sys.stdin:
        work(options, adapter, Path(line.strip()))
        say(done=line.strip())
    return 0


if __name__ == "__main__":
    # What an engine prints is no record.
    OUT = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    sys.exit(main())
