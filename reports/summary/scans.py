"""The filter as a scan: errors, times and flops of one family put together, and its time on any
number of processors.

Of W flops in all, S of them one after another, p processors have at most

    W(p) = S + (W − S) / p                                                              (1)

one after another (algorithms/study/scan/tasks.hpp). With T1 the time on one thread, of it T0 that
of kinematics, which is not parallel, B the bytes of a call and b(p) the bandwidth of memory,

    T(p) = max(T0 + W(p) / F, B / b(p)),   F = W / (T1 − T0),   b(p) = min(p b(1), b(most))   (2)

where most is the largest number of threads on which bandwidth was measured.
"""

import statistics
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

from read.data import Data, ScanCall, scene_name, scene_size
from read.scans import ANY
from summary.groups import by_key

PRECISION = "float64"  # in which calls are timed
ORDER = "balanced"  # in which their blocks are combined
KINEMATICS = "kinematics"


class Flops(NamedTuple):
    """Of factors and one acceleration."""

    work: float
    span: float  # one after another on any number of processors

    def on(self, processors: int) -> float:
        """(1)."""
        return self.span + (self.work - self.span) / processors


@dataclass
class Scanned:
    """A variant at one N. In sequence it has links 0 and one thread."""

    scene: str
    n: int
    variant: str
    links: int  # of a block, where it is timed
    times: dict[int, float] = field(default_factory=dict)  # ns by threads
    errors: dict[int, dict[str, float]] = field(default_factory=dict)  # medians over the seeds,
    flops: dict[int, Flops] = field(default_factory=dict)  # by links of a block; errors by task
    bytes: float | None = None

    @property
    def timed_errors(self) -> dict[str, float]:
        return self.errors.get(self.links, {})

    @property
    def timed(self) -> Flops | None:
        """Of the blocks that are timed."""
        return self.flops.get(self.links)


@dataclass
class Machine:
    """What a prediction takes besides."""

    kinematics: dict[int, float]  # ns by N
    bandwidths: dict[int, float]  # bytes/s by threads

    def bandwidth(self, processors: int) -> float | None:
        """b(p) of (2)."""
        if 1 not in self.bandwidths:
            return None
        most = self.bandwidths[max(self.bandwidths)]
        return min(processors * self.bandwidths[1], most)


def links_of_block(n: int) -> int:
    """By the number of links, as `bench_scan` has them (algorithms/study/scan/blocks.hpp)."""
    return min(max(n // 64, 4), 1024)


def is_scan(variant: str) -> bool:
    return variant.startswith("Scan<")


def family(data: Data) -> str | None:
    """The one with the most of times, errors and flops, and of these with the most N."""
    records = {("times", scene_name(call.time.scene), call.time.scene) for call in data.scan_calls}
    records |= {("errors", row.family, row.n) for row in data.scan_errors}
    records |= {("flops", row.family, row.n) for row in data.scan_flops}
    sizes = Counter(name for _, name, _ in records)
    kinds = Counter(name for _, name in {record[:2] for record in records})
    return max(sizes, key=lambda name: (kinds[name], sizes[name], name), default=None)


def machine(data: Data) -> Machine:
    times = [call.time for call in _timed(data, KINEMATICS)]
    rates = by_key(data.bandwidths, lambda it: it.threads)  # each file has its own
    return Machine(
        {scene_size(time.scene): time.nanoseconds for time in times},
        {threads: statistics.median(it.rate for it in own) for threads, own in rates.items()},
    )


def _timed(data: Data, task: str) -> list[ScanCall]:
    """Calls of the family that are timed."""
    name = family(data)
    return [
        call
        for call in data.scan_calls
        if (call.time.task, call.time.precision) == (task, PRECISION)
        and scene_name(call.time.scene) == name
        and call.time.nanoseconds
    ]


def scanned(data: Data) -> list[Scanned]:
    """All that is known of the family, in order of N."""
    name = family(data)
    found = {}

    def of(variant: str, n: int) -> Scanned:
        links = links_of_block(n) if is_scan(variant) else 0
        return found.setdefault((variant, n), Scanned(f"{name}:{n}", n, variant, links))

    for call in _timed(data, "acceleration"):
        it = of(call.variant, scene_size(call.time.scene))
        it.times[call.threads] = call.time.nanoseconds
        it.bytes = max(it.bytes or 0, call.bytes or 0) or None
    own = [it for it in data.scan_errors if (it.family, it.precision) == (name, PRECISION)]
    own = [it for it in own if it.error is not None and it.order in ("", ORDER)]
    errors = by_key(own, lambda it: (it.variant, it.n, it.links, it.task))
    for (variant, n, links, task), rows in errors.items():
        median = statistics.median(row.error for row in rows)
        of(variant, n).errors.setdefault(links, {})[task] = median
    for (variant, n, links), flops in _flops(data, name).items():
        of(variant, n).flops[links] = flops
    return sorted(found.values(), key=lambda it: (it.n, it.variant))


def _flops(data: Data, name: str) -> dict[tuple[str, int, int], Flops]:
    """Work and span by variant, N and links of a block: medians over the seeds."""
    tasks = defaultdict(dict)  # of each seed, on so many processors
    for row in data.scan_flops:
        if row.family == name and row.processors in (1, ANY):
            key = row.variant, row.n, row.links, row.processors, row.seed
            tasks[key][row.task] = row.flops
    seeds = defaultdict(list)
    for (*key, _), of_task in tasks.items():
        if len(of_task) == 2:  # factors and acceleration
            seeds[tuple(key)].append(sum(of_task.values()))
    counted = {}
    for (variant, n, links, processors), values in seeds.items():
        if processors == 1:
            work = statistics.median(values)
            span = seeds.get((variant, n, links, ANY), values if links == 0 else None)
            if span is not None:
                counted[variant, n, links] = Flops(work, statistics.median(span))
    return counted


def predicted(
    it: Scanned, links: int, processors: int, machine: Machine, memory: bool = True
) -> float | None:
    """T(p) of (2) in ns, of blocks of so many links at the rate of those that are timed; None where
    something is not known. Without memory: b(p) is infinite."""
    serial = machine.kinematics.get(it.n, 0)
    if 1 not in it.times or not it.timed or links not in it.flops or it.times[1] <= serial:
        return None
    rate = it.timed.work / (it.times[1] - serial)
    time = serial + it.flops[links].on(processors) / rate
    bandwidth = machine.bandwidth(processors)
    if memory and it.bytes and bandwidth:
        time = max(time, 1e9 * it.bytes / bandwidth)
    return time


def checks(scanned: list[Scanned], machine: Machine) -> list[tuple[Scanned, int, float]]:
    """Of each N, variant and number of threads above 1: measured time over the predicted one."""
    found = []
    for it in scanned:
        for threads in sorted(threads for threads in it.times if threads > 1):
            if time := predicted(it, it.links, threads, machine):
                found.append((it, threads, it.times[threads] / time))
    return found
