"""What Google Benchmark's rows say: times, calls, Jacobians, questions."""

import re
import statistics
from collections import defaultdict
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field

from read.values import LARGEST, Count, Size, at, checked_scene, reading, record, scene_size

NO_SCENE = "none"
PEAK = "peak/"  # begins the names of what measures the machine
BANDWIDTH = "bandwidth/"  # and its memory
HOWS = ("whole", "pruned", "alone")  # ways to answer a question
NANOSECONDS = {"ns": 1, "us": 1e3, "ms": 1e6, "s": 1e9}
Span = Annotated[float, Field(ge=0, le=LARGEST / 1e9)]  # in one of these units


class Time(NamedTuple):
    """One timed call, median. `nanoseconds` is None where it was not timed: `refused` says why."""

    scene: str
    variant: str
    precision: str
    task: str
    nanoseconds: float | None
    variation: float | None  # standard deviation / mean over the repetitions
    repetitions: int
    refused: str


class Bandwidth(NamedTuple):
    """Of memory, by a copy on so many threads."""

    threads: int
    rate: float  # bytes/s, read and written
    bytes: int  # of both arrays; 0: not known, beyond all caches


class Call(NamedTuple):
    """A timed call of the fast path or of a peer; of a batch, time, flops and bytes are by the
    state. Peak and bandwidths are the machine's, as the same file measured them."""

    time: Time
    flops: float | None
    rate: float | None  # FLOP/s
    peak: float | None  # FLOP/s of fused multiply-adds alone
    bytes: float | None = None  # that the call must move at least
    states: int = 1
    bandwidths: tuple[Bandwidth, ...] = ()  # of one thread, the smallest arrays first


class Jacobian(NamedTuple):
    """A timed Jacobian over inertial parameters, and its error; None where it was not timed."""

    time: Time
    error: float | None


class ScanCall(NamedTuple):
    """A call on so many threads, in wall time; task `kinematics`: what a scan has in sequence."""

    time: Time
    threads: int
    bytes: float | None  # that the call has for itself

    @property
    def variant(self) -> str:
        """Without its threads."""
        return self.time.variant.partition("@")[0]


class Question(NamedTuple):
    """What is wanted of a scene, and the calls that answer it: whole, pruned or alone."""

    title: str  # empty where a user asked it
    scene: str
    want: str
    asked: str  # as the command line says it
    rules: list[str]  # those that left something out
    dofs: int
    dofs_left: int
    calls: list[Call]  # their variant says how


@record
class Row(NamedTuple):
    """One repetition, or their mean, median, standard deviation or its ratio to the mean (cv)."""

    name: str
    run_name: str = ""
    run_type: str = ""
    aggregate_name: str = ""
    repetitions: Count = 1
    error_occurred: bool = False
    error_message: str = ""
    time_unit: Literal["ns", "us", "ms", "s"] = "ns"
    real_time: Span | None = None
    cpu_time: Span | None = None
    per_state: Annotated[Size | None, at("s/state")] = None  # s
    rate: Annotated[Size | None, at("FLOP/s")] = None
    flops: Size | None = None
    bytes: Size | None = None
    bytes_per_second: Size | None = None
    error: Size | None = None

    @property
    def measures(self) -> bool:
        single = self.run_type != "aggregate" or self.aggregate_name == "median"
        return single and not self.error_occurred

    @property
    def nanoseconds(self) -> float:
        return self.real_time * NANOSECONDS[self.time_unit]

    def checked(self) -> "Row":
        if self.measures:
            for name in self._fields[self._fields.index("real_time") :]:
                if getattr(self, name) == 0:
                    raise ValueError(f"{name} of '{self.name}' is 0")
            if self.real_time is None or (self.per_state and not self.cpu_time):
                raise ValueError(f"'{self.name}' has no time")
        return self


class Run:
    """All rows of one benchmark, whose name is task/variant/scene/precision; its own settings may
    follow."""

    def __init__(self, name: str, rows: list[Row]):
        self.name = name
        self.rows = rows
        self.refused = next((row.error_message for row in rows if row.error_occurred), "")
        measured = [row for row in rows if row.measures and not self.refused]
        self.measured = [row for row in measured if row.aggregate_name] or measured
        parts = name.split("/")
        if len(parts) < 4:
            raise ValueError(f"name '{name}' is not task/variant/scene/precision")
        self.task, self.variant, self.scene, self.precision = parts[:4]

    def median(self, name: str) -> float | None:
        """Of a counter; None where there is none."""
        values = [getattr(row, name) for row in self.measured if getattr(row, name) is not None]
        return statistics.median(values) if values else None

    @property
    def time(self) -> Time:
        if not (self.refused or self.measured):
            raise ValueError(f"'{self.name}' was neither timed nor refused")
        if self.scene != NO_SCENE:
            checked_scene(self.scene)
        median = variation = None
        if not self.refused:
            median = statistics.median(row.nanoseconds for row in self.measured)
            cvs = (row.real_time for row in self.rows if row.aggregate_name == "cv")
            variation = next(cvs, None)
        repetitions = max(row.repetitions for row in self.rows)
        series = (self.scene, self.variant, self.precision, self.task)
        return Time(*series, median, variation, repetitions, self.refused)

    @property
    def states(self) -> int:
        """That a call takes: its counter `s/state` is in CPU time, unless the name says else."""
        per_state = self.median("per_state")
        if not per_state:
            return 1
        clock = self.median("real_time" if "/real_time" in self.name else "cpu_time")
        return max(1, round(clock * NANOSECONDS[self.rows[0].time_unit] / (1e9 * per_state)))

    @property
    def threads(self) -> int:
        """Variants end in them, as in Scan<Conventional>@2."""
        _, at, threads = self.variant.partition("@")
        if at and not re.fullmatch("[1-9][0-9]{0,5}", threads):
            raise ValueError(f"'{self.name}' ran on {threads} threads")
        return int(threads or 1)

    @property
    def bandwidth(self) -> Bandwidth:
        time, rate = self.time, self.median("bytes_per_second")
        if rate is None:
            raise ValueError(f"'{self.name}' has no bytes_per_second")
        return Bandwidth(self.threads, rate, scene_size(time.scene))


@record
class Benchmarks(NamedTuple):
    """A file of Google Benchmark's."""

    benchmarks: list[Row]
    context: dict = {}

    @property
    def runs(self) -> list[Run]:
        rows = defaultdict(list)
        for row in self.benchmarks:
            rows[row.run_name or row.name].append(row)
        return [Run(name, own) for name, own in rows.items()]


def times(runs: list[Run]) -> list[Time]:
    """Of scenes alone."""
    return [run.time for run in runs if run.scene != NO_SCENE]


def calls(runs: list[Run]) -> list[Call]:
    peaks = {run.precision: run.median("rate") for run in runs if run.name.startswith(PEAK)}
    copies = [run.bandwidth for run in runs if run.name.startswith(BANDWIDTH)]
    bandwidths = tuple(sorted((it for it in copies if it.threads == 1), key=lambda it: it.bytes))
    calls = []
    for run in runs:
        if run.name.startswith((PEAK, BANDWIDTH)):
            continue
        time, states = run.time, run.states
        if not time.refused:
            time = time._replace(nanoseconds=time.nanoseconds / states)
        counters = (run.median("flops"), run.median("rate"), peaks.get(run.precision))
        calls.append(Call(time, *counters, run.median("bytes"), states, bandwidths))
    return calls


def jacobians(runs: list[Run]) -> list[Jacobian]:
    return [Jacobian(run.time, run.median("error")) for run in runs]


def scans(runs: list[Run]) -> list[ScanCall]:
    timed = (run for run in runs if not run.name.startswith(BANDWIDTH))
    return [ScanCall(run.time, run.threads, run.median("bytes")) for run in timed]


@record
class Asking(NamedTuple):
    """What the context of a question's benchmarks says of it, in texts."""

    title: Annotated[str, at("title", default="")]
    question: str
    rules: Annotated[str, AfterValidator(lambda rules: [it for it in rules.split(",") if it])]
    dofs: Count
    dofs_left: Count


_asking = reading(Asking, strict=False)


def questions(measured: Benchmarks) -> dict[str, list]:
    """What the context says of the question is no part of the context."""
    asking = _asking(measured.context)
    context = {k: it for k, it in measured.context.items() if k not in Asking._fields}
    by_want = defaultdict(list)
    for call in calls(measured.runs):
        if call.time.variant not in HOWS:
            raise ValueError(f"'{call.time.variant}' is none of {', '.join(HOWS)}")
        by_want[call.time.scene, call.time.task].append(call)
    asked = [
        Question(asking.title, scene, want, *asking[1:], own)
        for (scene, want), own in by_want.items()
    ]
    return {"questions": asked, "questions_contexts": [context]}
