"""What a run recorded: errors, times, agreement with MuJoCo, equations, simulations, fits."""

from collections import Counter
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Annotated, NamedTuple

from pydantic import Field

from read.advice import Advice, Limits
from read.benchmarks import Bandwidth, Call, Jacobian, Question, ScanCall, Time
from read.campaign import Campaign
from read.contacts import ContactError
from read.engines import EngineAnswer, EngineTime
from read.fits import Identification
from read.laboratory import Laboratory
from read.motions import Case, Simulation, told_apart
from read.paper import Equation as Equation
from read.paper import Paper
from read.replicates import Replicates
from read.robots import Kept
from read.scans import ScanError, ScanFlops
from read.search import Asked as Asked
from read.search import Find
from read.stress import Family, Integration, Stress, Variant
from read.values import Count, Positive, SceneName, record, scene_name, scene_size

LONGEST = 1000  # letters of an error


class DataError(Exception):
    """Bad input; the message is one short line that names the file and the value."""

    def __init__(self, message: str):
        line = "".join(letter if letter.isprintable() else " " for letter in message)
        super().__init__(line if len(line) <= LONGEST else f"{line[:LONGEST]} …")


@record
class Error(NamedTuple):
    """One measured error. `outcome` is `ok`, or says why there is no value."""

    scene: SceneName
    variant: str
    precision: str
    task: str
    state: Count
    measure: str
    value: float
    outcome: str


@record
class Sample(NamedTuple):
    """The error of one estimate from random samples; no samples: the exact algorithm."""

    scene: SceneName
    quantity: str
    method: str
    samples: Count
    replica: Count
    error: Annotated[float, Field(ge=0, le=1e100)]  # whose square is taken
    seconds: Positive
    threads: Count


def _recorded(what: str, key):
    """A list of records, which stand once each: `key` tells them apart, or so many first fields."""
    told_apart = key if callable(key) else lambda record: record[:key]
    return field(default_factory=list, metadata={"what": what, "key": told_apart})


def _timed(call) -> tuple:
    return call.time[:4]


@dataclass
class Data:
    """All records of a run, and the benchmark contexts, one a file."""

    errors: list[Error] = _recorded("error", 6)
    times: list[Time] = _recorded("time", 4)
    harness: list[Time] = field(default_factory=list)  # of no scene: what timing itself takes
    ladder_errors: list[Error] = field(default_factory=list)  # of the first figure (read/ladder.py)
    ladder_calls: list[Call] = field(default_factory=list)
    mujoco: list[dict] = _recorded("agreement", lambda robot: (robot["scene"],))
    contexts: list[dict] = field(default_factory=list)
    papers: list[Paper] = _recorded("check of the paper", 1)
    samples: list[Sample] = _recorded("sample", 5)
    estimation: list[Time] = _recorded("time of the recursions", 4)  # the paper's recursions
    estimation_contexts: list[dict] = field(default_factory=list)
    dynamics: list[Call] = _recorded(
        "time of the fast path", _timed
    )  # the fast path alone, with batches
    dynamics_contexts: list[dict] = field(default_factory=list)
    generated: list[Call] = field(default_factory=list)  # code for one robot, with rows
    generated_contexts: list[dict] = field(default_factory=list)
    peers: list[Call] = _recorded(
        "time against peers", _timed
    )  # the fast path and peers, in one run
    peers_contexts: list[dict] = field(default_factory=list)
    jacobians: list[Jacobian] = _recorded("time of a Jacobian", _timed)
    jacobians_contexts: list[dict] = field(default_factory=list)
    scan_calls: list[ScanCall] = _recorded("time of a scan", _timed)
    scan_contexts: list[dict] = field(default_factory=list)
    bandwidths: list[Bandwidth] = field(default_factory=list)
    scan_errors: list[ScanError] = _recorded("error of a scan", 9)
    scan_flops: list[ScanFlops] = _recorded("flops of a scan", 8)
    contact_errors: list[ContactError] = _recorded("error of contacts", 6)
    contact_times: list[Time] = _recorded("time of contacts", 4)
    contact_times_contexts: list[dict] = field(default_factory=list)
    questions: list[Question] = field(default_factory=list)
    questions_contexts: list[dict] = field(default_factory=list)
    fits: list[Identification] = _recorded("fit", 4)
    advice: list[Advice] = _recorded("advice", 1)
    limits: list[Limits] = _recorded("limits", 1)
    stress: Stress = field(default_factory=Stress)
    stress_families: list[Family] = _recorded("family", 1)
    stress_variants: list[Variant] = _recorded("variant", 1)
    integrations: list[Integration] = _recorded("integration", 6)
    motions: list[Simulation | Case] = _recorded("motion", told_apart)  # a case that has no truth
    finds: list[Find] = field(default_factory=list)  # of each search in order
    campaign: Campaign | None = None
    replicates: Replicates | None = None  # of the claims
    robot_limits: list[Kept] = _recorded("stress of a robot", 2)  # of a campaign of many robots
    engine_answers: list[EngineAnswer] = _recorded("answer of an engine", 6)
    engine_times: list[EngineTime] = _recorded("time of an engine", 5)
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
