"""What is measured, in which order: kinds of measurement, each with its scenes."""

from dataclasses import dataclass, replace
from pathlib import Path

from measuring.effort import Effort
from measuring.scene import Scene

PEERS_SIZE = 500  # largest member of a family on which peers are timed
STANDING = {  # robots that stand, in a run of all, and on what
    "g1": ("--feet=left_ankle_roll_joint,right_ankle_roll_joint", "--points=4"),
    "go2": ("--points=1",),
}
SIMULATED = "panda"  # where it is measured, or else the first robot
JACOBIANS_SIZE = 100  # largest member of a family on which Jacobians of fits are timed
RESIDUALS = ("inverse_dynamics", "forward_dynamics", "innovations", "mass_matrix", "likelihood")
NOISY = ("panda", 0.01)  # where it is fitted, or else the first robot; noise over size of torques
# Questions that leave something out: title (without , and =, at which --benchmark_context splits),
# scene, options.
ACCELERATION = "--want=acceleration"
ARM = ("shoulder", "elbow", "wrist")
ARMS = ",".join(f"{side}_{part}*" for side in ("left", "right") for part in ARM)
QUESTIONS = (
    ("humanoid with one free leg", "g1", (ACCELERATION, "--free=left_hip*,left_knee*,left_ankle*")),
    ("humanoid with locked arms", "g1", (ACCELERATION, f"--locked={ARMS}")),
    ("arm among 20 things", "table", (ACCELERATION, "--dofs=panda_*", "--alone=panda")),
    ("cart under a locked arm", "moving_base", (ACCELERATION, "--free=cart_*")),
    ("arm at rest", "iiwa14", (ACCELERATION, "--at-rest")),
    ("diagonal at 100 links", "chain:100", ("--want=diagonal",)),
    ("diagonal at 500 links", "chain:500", ("--want=diagonal",)),
    ("one foot of a humanoid", "g1", ("--want=operational", "--site=left_ankle_roll_link")),
    ("determinant of a humanoid", "g1", ("--want=log_det",)),
)


@dataclass(frozen=True)
class Kind:
    """How a program is called that measures one scene after another, and what its result is."""

    program: str
    suffix: str
    out: str  # flag that names its data file
    title: str
    scene: str = "{}"  # how the scene is given
    alone: bool = False
    shows_failure: bool = False  # exit code 1 means that the page will show what is wrong
    partial: bool = False  # the program may refuse a scene that others measure
    data: str = ""  # what its data file's name begins with, if not with the kind


KINDS = {  # in the order in which they are measured
    "times": Kind("bench_inverse", "json", "--benchmark_out", "times", alone=True),
    "estimation": Kind("bench_estimation", "json", "--benchmark_out", "recursions", alone=True),
    "dynamics": Kind("bench_dynamics", "json", "--benchmark_out", "fast path", alone=True),
    "batch": Kind("bench_batch", "json", "--benchmark_out", "batches", alone=True),
    "generated": Kind(
        "bench_inverse", "json", "--benchmark_out", "code for one robot", alone=True, partial=True
    ),
    "peers": Kind("bench_peers", "json", "--benchmark_out", "peers", alone=True, partial=True),
    "jacobians": Kind(
        "bench_derivatives",
        "json",
        "--benchmark_out",
        "Jacobians of fits",
        alone=True,
        partial=True,
    ),
    "pruning": Kind("bench_pruning", "json", "--benchmark_out", "question", alone=True),
    "standing": Kind(
        "bench_contacts", "json", "--benchmark_out", "times of contacts", alone=True, partial=True
    ),
    "scan": Kind("bench_scan", "json", "--benchmark_out", "scans", alone=True),
    "identify": Kind(
        "identify", "json", "--json", "fit", alone=True, shows_failure=True, partial=True
    ),
    "recommend": Kind("recommend", "json", "--json", "advice", alone=True, partial=True),
    "limits": Kind("limits", "json", "--json", "limits", alone=True, partial=True),
    "motions": Kind("trajectories", "csv", "--out", "motions", alone=True, partial=True),
    "errors": Kind("scaling", "csv", "--out", "errors"),
    "mujoco": Kind("compare_mujoco", "json", "--json", "agreement with MuJoCo", shows_failure=True),
    "paper": Kind(
        "paper",
        "json",
        "--json",
        "equations",
        scene="--robot={}",
        shows_failure=True,
        partial=True,
    ),
    "scans": Kind("scans", "csv", "--out", "errors of scans"),
    "spans": Kind("scans", "csv", "--out", "flops of scans"),
    "contacts": Kind("contacts", "csv", "--out", "errors of contacts", partial=True),
    "simulation": Kind("simulate", "csv", "--out", "simulation", partial=True),
    "exhibits": Kind("bench_inverse", "json", "--benchmark_out", "times", alone=True, data="times"),
    # takes all cores by itself; a worker may die where memory is short
    "stress": Kind("stress", "csv", "--out", "errors", alone=True, partial=True),
    "families": Kind("stress", "json", "--json", "list"),
    "integration": Kind("integrate", "csv", "--out", "time integration"),
    "adversary": Kind("adversary", "csv", "--csv", "worst found by search"),
}

# What paper and bench_estimation take by themselves.
RANDOM_CHAIN = Scene("", "chain:6", 6, False, None)
CHAINS = Scene("", "chain", 0, False, None)
SCANNED = "straight"  # the family that bench_scan and scans share
# Where every variant is timed, and what stress and integrate take.
EXHIBITED = Scene("chain:12", "all variants", 12, False, None)
FAMILIES = Scene("", "stressed families", 0, False, None)


def default_scenes(root: Path, effort: Effort) -> list[str]:
    """The names of all robots, and of members of each family."""
    models = sorted(root.glob("robots/models/*/*.xml"))
    robots = [model.stem for model in models if model.stem == model.parent.name]
    return robots + [f"{family}:{size}" for family, sizes in effort.sizes.items() for size in sizes]


def fits(robots: list[Scene], everything: bool, effort: Effort) -> list[Scene]:
    """Without noise by every residual, or of given robots by the first; one with noise."""
    if everything:
        exact = [robot.fitted(residual) for robot in robots for residual in RESIDUALS]
        exact = [scene for scene in exact if scene.label.split()[0] in effort.fits]
    else:
        exact = [robot.fitted(RESIDUALS[0]) for robot in robots]
    name, noise = NOISY
    noisy = [robot for robot in robots if robot.label == name] or robots
    return exact + [robot.fitted(RESIDUALS[0], noise) for robot in noisy[:1]]


def questions(root: Path) -> list[Scene]:
    """Those about scenes that there are; of a scene that a user gives nobody knows the question."""
    known = {name: Scene.shipped(name, root) or Scene.family(name) for _, name, _ in QUESTIONS}
    return [known[name].asked(title, options) for title, name, options in QUESTIONS if known[name]]


def scans(effort: Effort) -> list[Scene]:
    """Of every N, in blocks of every size."""
    return [
        replace(
            Scene.family(f"{SCANNED}:{n}"),
            argument="",
            options=(
                f"--family={SCANNED}",
                f"--values={n}",
                f"--links={','.join(map(str, links))}",
            ),
        )
        for n, links in effort.scanned.items()
    ]


def plan(
    root: Path, scenes: list[Scene], everything: bool, effort: Effort
) -> list[tuple[str, Scene]]:
    """Kinds and scenes: times first, since only they need the machine for themselves."""
    robots = [scene for scene in scenes if scene.model]
    fast, rivalled = scenes, [scene for scene in scenes if scene.size <= PEERS_SIZE]
    if everything:
        fast = [scene for scene in scenes if scene.label in effort.dynamics]
        rivalled = [scene for scene in scenes if scene.label in effort.peers]
    generated = robots
    if everything:
        generated = [scene for scene in robots if scene.label in effort.generated]
    simulated = [scene for scene in robots if scene.label == SIMULATED] or robots
    differentiated = [scene for scene in scenes if scene.size <= JACOBIANS_SIZE]
    if everything:
        known = {scene.label: scene for scene in scenes}
        named = [known.get(name) or Scene.family(name) for name in effort.jacobians]
        differentiated = [scene for scene in named if scene]
    stressed = robots
    if everything:
        stressed = [scene for scene in robots if scene.label in effort.limits] or robots[:1]
    moved = robots
    if everything:
        moved = [scene for scene in robots if scene.label in effort.motions] or robots[:1]
    standing = []
    if everything:
        standing = [scene for scene in robots if scene.label in STANDING] or robots[:1]
        standing = [replace(it, options=STANDING.get(it.label, ())) for it in standing]
    measured = {
        "times": scenes,
        "estimation": [CHAINS] if everything or effort.estimation_always else [],
        "dynamics": fast,
        "batch": fast,
        "generated": generated,
        "peers": rivalled,
        "jacobians": differentiated,
        "pruning": questions(root) if everything else [],
        "standing": standing,
        "scan": [Scene("", SCANNED, 0, False, None)] if everything else [],
        "identify": fits(robots, everything, effort),
        "recommend": robots,
        "limits": stressed,
        "motions": moved,
        "errors": scenes,
        "mujoco": [scene for scene in scenes if scene.in_mujoco],
        "paper": [RANDOM_CHAIN, *robots],
        **dict.fromkeys(("scans", "spans"), scans(effort) if everything else []),
        "contacts": standing,
        "simulation": simulated[:1],
        "exhibits": [EXHIBITED] if everything else [],
        **dict.fromkeys(
            ("stress", "families", "integration", "adversary"), [FAMILIES] if everything else []
        ),
    }
    return [(kind, scene) for kind in KINDS for scene in measured[kind]]
