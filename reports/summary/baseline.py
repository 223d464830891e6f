"""Two runs: what became faster, slower or less accurate, and whether that is more than noise.

A median of n repetitions whose standard deviation over mean is v has a relative standard error of
about sqrt(pi/2) v / sqrt(n), for normal noise. Of log(after / before) it is the root of the sum of
both squares. A change counts if it is more than NOISES of these and more than LEAST.
"""

import math
from typing import NamedTuple

from read.data import Data, Time
from summary.groups import by_key
from summary.points import Point, points

NOISES = 3
LEAST = 0.02  # smaller changes come from where code lies in memory
WORSE = 2  # factor of an error that is told
MACHINE = ("cpu", "num_cpus", "compiler", "flags", "mode")  # keys of a benchmark's context


class Change(NamedTuple):
    """Of a time; `noise` is the standard error of the ratio's logarithm, None where unknown."""

    program: str
    after: Time
    before: float
    noise: float | None

    @property
    def ratio(self) -> float:
        return self.after.nanoseconds / self.before

    @property
    def verdict(self) -> str:
        if self.noise is None:
            return "noise unknown"
        if abs(math.log(self.ratio)) <= max(NOISES * self.noise, math.log1p(LEAST)):
            return "same"
        return "faster" if self.ratio < 1 else "slower"


def changes(data: Data, baseline: Data) -> list[Change]:
    """Of every call that both runs timed with the same program."""
    found = []
    old = _programs(baseline)
    for program, times in _programs(data).items():
        before = {time[:4]: time for time in old[program]}
        for time in times:
            then = before.get(time[:4])
            if then and then.nanoseconds and time.nanoseconds:
                found.append(Change(program, time, then.nanoseconds, _noise(time, then)))
    return found


def _programs(data: Data) -> dict[str, list[Time]]:
    """Lists of times, of which each has a call once."""
    return {
        "bench_inverse": data.times,
        "bench_estimation": data.estimation,
        "bench_dynamics, bench_batch": [call.time for call in data.dynamics],
        "bench_peers": [call.time for call in data.peers],
        "bench_derivatives": [jacobian.time for jacobian in data.jacobians],
    }


def _noise(*times: Time) -> float | None:
    if any(time.variation is None or time.repetitions < 2 for time in times):
        return None
    return math.sqrt(sum(math.pi / 2 * time.variation**2 / time.repetitions for time in times))


def worse_and_better(data: Data, baseline: Data) -> list[tuple[Point, Point]]:
    """Pairs before and now whose largest errors differ by more than a factor of WORSE, or that
    fail more or less often."""
    return [(old, new) for old, new in _both(data, baseline) if _differs(old, new)]


def compared_errors(data: Data, baseline: Data) -> int:
    return len(_both(data, baseline))


def _both(data: Data, baseline: Data) -> list[tuple[Point, Point]]:
    """What has errors before and now."""
    before, now = (
        {(it.scene, *it[3:7]): it for it in points(run) if it.states} for run in (baseline, data)
    )
    return [(before[key], point) for key, point in now.items() if key in before]


def _differs(old: Point, new: Point) -> bool:
    if old.failures / old.states != new.failures / new.states:
        return True
    if not (old.worst and new.worst):
        return (old.worst or 0) != (new.worst or 0)
    return abs(math.log(new.worst / old.worst)) > math.log(WORSE)


def differences(data: Data, baseline: Data) -> dict[str, tuple[list[str], list[str]]]:
    """Of machine, compiler and effort: the values before and now, where they are not the same."""
    found = {
        key: tuple(_values(run.all_contexts, key) for run in (baseline, data)) for key in MACHINE
    }
    return {key: (then, now) for key, (then, now) in found.items() if then != now}


def _values(contexts: list[dict], key: str) -> list[str]:
    return sorted({str(context[key]) for context in contexts if key in context})


def by_task(found: list[Change]) -> dict[tuple[str, str], list[Change]]:
    return by_key(found, lambda change: (change.program, change.after.task))
