"""What a run recorded: errors, times, agreement with MuJoCo, equations, simulations, fits."""

from collections import Counter
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import NamedTuple

from read.advice import Advice, Limits
from read.campaign import Campaign
from read.contacts import ContactError
from read.fits import Identification
from read.laboratory import Laboratory
from read.motions import Case, Simulation
from read.replicates import Replicates
from read.scans import ScanError, ScanFlops
from read.stress import Family, Integration, Stress, Variant

LONGEST = 1000  # letters of an error


class DataError(Exception):
    """Bad input; the message is one short line that names the file and the value."""

    def __init__(self, message: str):
        line = "".join(letter if letter.isprintable() else " " for letter in message)
        super().__init__(line if len(line) <= LONGEST else f"{line[:LONGEST]} …")


class Error(NamedTuple):
    """One measured error. `outcome` is `ok`, or says why there is no value."""

    scene: str
    variant: str
    precision: str
    task: str
    state: int
    measure: str
    value: float
    outcome: str


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
    """A call on so many threads, in wall time; of task `kinematics`, what a scan has in sequence."""

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


class Residual(NamedTuple):
    """How far both forms of an equation are from true, in one precision; None: not a number."""

    printed: float | None
    corrected: float | None
    tolerance: float
    verdict: str

    @property
    def holds(self) -> bool:
        """The record's own verdict, and what its numbers say."""
        within = self.corrected is not None and self.corrected <= self.tolerance
        return self.verdict != "fails" and within


class Equation(NamedTuple):
    """An equation of the paper; `corrected` and `note` are empty where it is true as printed."""

    id: str
    section: str
    result: str
    statement: str
    corrected: str
    note: str
    residuals: dict[str, Residual]  # by precision

    @property
    def holds(self) -> bool:
        return all(residual.holds for residual in self.residuals.values())


class Precision(NamedTuple):
    name: str
    digits: int
    condition: float


class Paper(NamedTuple):
    """The paper's equations, each checked on one scene."""

    scene: str
    beyond_scene: str  # where what the paper does not say is checked
    passed: bool
    precisions: list[Precision]
    equations: list[Equation]


class Sample(NamedTuple):
    """The error of one estimate from random samples; no samples: the exact algorithm."""

    scene: str
    quantity: str
    method: str
    samples: int
    replica: int
    error: float
    seconds: float
    threads: int


class FoundBody(NamedTuple):
    """A body of a mechanism that was found, with the joint that holds it."""

    parent: int  # its number from 1; 0: the ground
    joint: str
    mass: float  # kg
    length: float  # from the parent's joint, m
    armature: float  # kg m^2 or kg


class Asked(NamedTuple):
    """What a search asks of a variant, in the words of `adversary`'s options."""

    task: str = "acceleration"
    objective: str = "error"  # or claim: the error over what is claimed
    kernel: str = "spatial"
    rows: bool = False  # of states, answered together


class Find(NamedTuple):
    """The worst silent error that so many mechanisms have shown, or its ratio to what was claimed;
    None: none of them had any."""

    variant: str
    precision: str
    asked: Asked
    seed: int
    method: str  # search, islands or random
    evaluations: int
    error: float | None
    kS: float | None  # noqa: N815, the structured condition number; of the last alone
    nv: int | None  # of the last alone
    bodies: tuple[FoundBody, ...] = ()  # of the last alone


class EngineAnswer(NamedTuple):
    """One answer of an engine, or why there is none."""

    scene: str
    variant: str
    precision: str
    task: str
    batch: int  # states of a call
    state: int
    measure: str
    value: float | None
    outcome: str  # ok, warned, model differs, or one of those without an answer
    reason: str  # of the outcome


class EngineTime(NamedTuple):
    """A call of an engine, by the state; None where it was not timed: `refused` says why."""

    scene: str
    variant: str
    precision: str
    task: str
    batch: int  # states of a call
    engine: str  # that scripts/engines knows; empty: published by others
    version: str
    nanoseconds: float | None
    with_copies: float | None  # the same from NumPy's arrays to NumPy's, ns
    variation: float | None
    first_call: float | None  # s
    cpu: str
    refused: str


class Kept(NamedTuple):
    """How far a stress may go; a robot that was refused has a name and a reason alone."""

    name: str
    robot: str
    promise: str  # what keeps how many digits; empty: nothing keeps three
    stress: str
    unit: str
    kept: float | None  # the last value that keeps the promise
    whole: bool  # whether that is the last one tried
    silent: int  # errors without a warning, of all variants
    refused: str = ""


@dataclass
class Data:
    """All records of a run, and the benchmark contexts, one a file."""

    errors: list[Error] = field(default_factory=list)
    times: list[Time] = field(default_factory=list)
    harness: list[Time] = field(
        default_factory=list
    )  # timings of no scene: what timing itself takes
    ladder_errors: list[Error] = field(default_factory=list)  # of the first figure (read/ladder.py)
    ladder_calls: list[Call] = field(default_factory=list)
    mujoco: list[dict] = field(default_factory=list)
    contexts: list[dict] = field(default_factory=list)
    papers: list[Paper] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)
    estimation: list[Time] = field(default_factory=list)  # the paper's recursions
    estimation_contexts: list[dict] = field(default_factory=list)
    dynamics: list[Call] = field(default_factory=list)  # the fast path alone, with batches
    dynamics_contexts: list[dict] = field(default_factory=list)
    generated: list[Call] = field(default_factory=list)  # code for one robot, with rows
    generated_contexts: list[dict] = field(default_factory=list)
    peers: list[Call] = field(default_factory=list)  # the fast path and peers, in one run
    peers_contexts: list[dict] = field(default_factory=list)
    jacobians: list[Jacobian] = field(default_factory=list)
    jacobians_contexts: list[dict] = field(default_factory=list)
    scan_calls: list[ScanCall] = field(default_factory=list)
    scan_contexts: list[dict] = field(default_factory=list)
    bandwidths: list[Bandwidth] = field(default_factory=list)
    scan_errors: list[ScanError] = field(default_factory=list)
    scan_flops: list[ScanFlops] = field(default_factory=list)
    contact_errors: list[ContactError] = field(default_factory=list)
    contact_times: list[Time] = field(default_factory=list)
    contact_times_contexts: list[dict] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    questions_contexts: list[dict] = field(default_factory=list)
    fits: list[Identification] = field(default_factory=list)
    advice: list[Advice] = field(default_factory=list)
    limits: list[Limits] = field(default_factory=list)
    stress: Stress = field(default_factory=Stress)
    stress_families: list[Family] = field(default_factory=list)
    stress_variants: list[Variant] = field(default_factory=list)
    integrations: list[Integration] = field(default_factory=list)
    motions: list[Simulation | Case] = field(default_factory=list)  # a case that has no truth
    finds: list[Find] = field(default_factory=list)  # of each search in order
    campaign: Campaign | None = None
    replicates: Replicates | None = None  # of the claims
    robot_limits: list[Kept] = field(default_factory=list)  # of a campaign of many robots
    engine_answers: list[EngineAnswer] = field(default_factory=list)
    engine_times: list[EngineTime] = field(default_factory=list)
    engine_faults: list[str] = field(default_factory=list)  # of files of theirs, which are not read
    unread: list[str] = field(default_factory=list)  # files of a baseline
    baseline: "Data | None" = None  # another run, to compare with

    @cached_property
    def laboratory(self) -> Laboratory:
        """Of all records of `stress`: ask only once they are read."""
        families = {family.name: family for family in self.stress_families}
        variants = {variant.name: variant for variant in self.stress_variants}
        return Laboratory(self.stress, families, variants)

    @property
    def all_contexts(self) -> list[dict]:
        lists = (it.name for it in fields(self) if it.name.endswith("contexts"))
        return [context for name in lists for context in getattr(self, name)]

    @property
    def all_times(self) -> list[Time]:
        calls = [call.time for call in self.dynamics + self.generated + self.peers + self.jacobians]
        calls += [call.time for call in self.scan_calls]
        answers = [call.time for question in self.questions for call in question.calls]
        return self.times + self.estimation + self.contact_times + calls + answers

    @property
    def scenes(self) -> list[str]:
        """All scenes whose inverse is measured, in order of their size."""
        records = {row.scene for row in self.errors} | {time.scene for time in self.times}
        records |= {robot["scene"] for robot in self.mujoco}
        records |= {it.robot for it in self.advice + self.limits}
        return sorted(records, key=lambda scene: (scene_size(scene), scene))

    @property
    def families(self) -> list[str]:
        """Names that occur with more than one number of degrees of freedom."""
        return families(self.scenes)

    @property
    def robots(self) -> list[str]:
        """The scenes that belong to no family."""
        scenes = self.scenes
        several = families(scenes)
        return [scene for scene in scenes if scene_name(scene) not in several]


def families(scenes) -> list[str]:
    """Names that occur with more than one size."""
    sizes = Counter(map(scene_name, set(scenes)))
    return sorted(name for name, count in sizes.items() if count > 1)


def scene_name(scene: str) -> str:
    return scene.rsplit(":", 1)[0]


def scene_size(scene: str) -> int:
    return int(scene.rsplit(":", 1)[1])
