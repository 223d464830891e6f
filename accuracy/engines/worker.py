"""Asks one engine about one mechanism, in the engine's own environment:

    worker.py ENGINE VARIANT PRECISION FOLDER [--tasks mass,…,batch:64] [--seconds S] [--eager]

A line of JSON each on standard output: {"version"}; {"begin": task} before a task, so that who
reads sees where a worker hangs or dies; {"task", "state", "measure", "error"}, or an "outcome"
that says why there is none; {"task", "nanoseconds", "variation", "repetitions", "first_call"}
once all states of a task are answered; {"batch"} with the time of a state among many.
{"refused"} says why the engine cannot hold the mechanism.

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

from protocol import MEASURE, TASKS, Engine, Mechanism, Refused, State, Unsupported, error

REPETITIONS = 7  # of a timing; the median counts
BATCH = "batch:"  # begins a task that is to answer so many states at once


def say(**record) -> None:
    print(json.dumps(record), file=OUT, flush=True)


def short(exception: Exception) -> str:
    lines = str(exception).strip().splitlines() or [""]
    return f"{type(exception).__name__}: {lines[0]}"[:200]


def judge(engine: Engine, task: str, state: State) -> dict:
    """The error of one answer, or why there is none."""
    try:
        if task not in state.truth:
            raise Unsupported("it is asked of hinges and slides alone")
        if task not in engine.calls:
            raise Unsupported("it has no such call")
        call = engine.call(task, state)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            raw = call.run()
        answer = call.read(raw)
    except Unsupported as reason:
        return {"outcome": f"unsupported: {reason}"}
    except Refused as reason:
        return {"outcome": f"refused: {reason}"}
    except Exception as reason:  # noqa: BLE001, whatever an engine raises is a record
        return {"outcome": f"failed: {short(reason)}"}
    value = error(task, answer, state.truth[task])
    if not math.isfinite(value):
        return {"outcome": "not finite"}
    warned = engine.warning and any(issubclass(one.category, engine.warning) for one in caught)
    return {"error": value} | ({"outcome": "warned"} if warned else {})


def timed(runs: list, seconds: float, states: int = 1) -> dict:
    """Of a state, the runs in turn; each is of so many states."""
    warnings.simplefilter("ignore")
    begin = time.perf_counter()
    runs[0]()
    once = max(time.perf_counter() - begin, 1e-7)
    rounds = max(1, int(seconds / (REPETITIONS * once * len(runs))))
    times = []
    for _ in range(REPETITIONS):
        begin = time.perf_counter()
        for _ in range(rounds):
            for run in runs:
                run()
        times.append((time.perf_counter() - begin) / (rounds * len(runs) * states))
    return {
        "nanoseconds": 1e9 * statistics.median(times),
        "variation": statistics.stdev(times) / statistics.mean(times),
        "repetitions": REPETITIONS,
    }


def batch(engine: Engine, states: list[State], count: int, seconds: float) -> dict:
    """The time of a state in one call of many, where the engine has such a call."""
    begin = time.perf_counter() + engine.saved()
    try:
        run = engine.batch([states[i % len(states)] for i in range(count)])
        run()
    except Unsupported as reason:
        return {"outcome": f"unsupported: {reason}"}
    except Exception as reason:  # noqa: BLE001
        return {"outcome": f"failed: {short(reason)}"}
    first_call = time.perf_counter() + engine.saved() - begin
    return {"first_call": first_call, **timed([run], seconds, count)}


def work(options: argparse.Namespace, adapter: type[Engine], folder: Path) -> None:
    mechanism = Mechanism(folder)
    states = mechanism.states(adapter.armature)
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
    for task in options.tasks.split(","):
        say(begin=task)
        if task.startswith(BATCH):
            count = int(task.removeprefix(BATCH))
            say(batch=count, **batch(engine, states, count, options.seconds))
            continue
        # As if no cache of earlier runs had saved compilation.
        begin, first_call, answered = time.perf_counter() + engine.saved(), None, 0
        for i, state in enumerate(states):
            judged = judge(engine, task, state)
            if first_call is None:
                first_call = time.perf_counter() + engine.saved() - begin
            answered += "error" in judged
            say(task=task, state=i, measure=MEASURE[task], **judged)
        if answered == len(states) and options.seconds > 0:
            runs = [engine.call(task, state).run for state in states]
            say(task=task, first_call=first_call, **timed(runs, options.seconds))


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
    adapter = importlib.import_module(f"adapters.{options.engine}").Adapter
    adapter.eager = options.eager
    say(version=version(adapter.package))
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
