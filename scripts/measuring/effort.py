"""How much is measured: every number that decides how long a run takes."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """What a quick run and a full one differ in."""

    name: str  # shown on the page
    sizes: dict[str, list[int]]  # family: its members that are measured
    repetitions: int  # of a timing; the page shows their median
    min_time: float  # of a repetition, s
    states: dict[int, int]  # up to this many degrees of freedom: states whose error is measured
    paper: str  # precision in which the paper is checked on robots
    samples: int  # of the simulation, at most; 0: as many as the program takes by itself
    estimation: tuple[int, float]  # repetitions and min_time of the paper's recursions
    longest: int  # chain that they and the fast path are timed on
    estimation_always: bool  # or else only in a run of all scenes
    dynamics: tuple[str, ...]  # scenes of the fast path in a run of all, or else those given
    generated: tuple[str, ...]  # robots whose code is compiled, in a run of all, or else those given
    peers: tuple[str, ...]  # scenes in a run of all, against other libraries
    jacobians: tuple[str, ...]  # scenes of the Jacobians of fits in a run of all
    fits: tuple[str, ...]  # robots that are fitted by every residual in a run of all
    limits: tuple[str, ...]  # robots that are stressed in a run of all, or else those given
    motions: tuple[str, ...]  # robots of simulated motions in a run of all, or else those given
    stood: int  # states of each robot that stands
    motion_options: tuple[str, ...]  # of `trajectories`
    searched: tuple[str, ...]  # variants whose worst mechanisms are searched for
    scanned: dict[int, tuple[int, ...]]  # N of scans: links of blocks, first those that are timed
    evaluations: int  # of mechanisms, each variant and precision, by search and at random

    def states_of(self, size: int) -> int:
        """How many states of so many degrees of freedom have their error measured."""
        return next((count for limit, count in self.states.items() if size <= limit), 1)


QUICK = Effort(
    name="quick",
    sizes={
        "straight": [3, 7, 15, 31, 63, 127],
        "chain": [3, 7, 15, 31, 63, 127],
        "tree": [7, 31, 127],
    },
    repetitions=5,
    min_time=0.01,
    states={40: 50, 127: 5, 1000: 1},
    paper="float64",
    samples=16384,
    estimation=(3, 0.01),
    longest=100_000,
    estimation_always=False,
    dynamics=("panda", "g1", "chain:7", "chain:31", "chain:63", "chain:127"),
    generated=("iiwa14",),
    peers=("panda", "g1", "chain:31"),
    jacobians=("iiwa14", "chain:31"),
    fits=("iiwa14",),
    limits=("panda",),
    motions=("panda",),
    stood=30,
    motion_options=("--T=0.1", "--h=1e-2,5e-3,2e-3,1e-3,5e-4,2e-4,1e-4,5e-5,2e-5"),
    searched=("Ladder<default>", "Ladder<last_bits>", "AxisFrames<SquareRoot>"),
    scanned={100: (4,), 1000: (15, 4)},
    evaluations=1000,
)
FULL = Effort(
    name="full",
    sizes=dict.fromkeys(("straight", "chain", "tree"), [3, 7, 15, 31, 63, 127, 255, 500, 1000]),
    repetitions=9,
    min_time=0.02,
    states={40: 200, 127: 30, 255: 10, 500: 3, 1000: 1},
    paper="both",
    samples=0,
    estimation=(9, 0.02),
    longest=1_000_000,
    estimation_always=True,
    dynamics=("panda", "iiwa14", "g1", *(f"chain:{n}" for n in (7, 15, 31, 63, 127, 255, 500))),
    generated=("iiwa14", "panda", "ur10e", "go2"),
    peers=("panda", "iiwa14", "g1", *(f"chain:{n}" for n in (7, 31, 63, 127, 255, 500))),
    jacobians=("iiwa14", "go2", "chain:31", "chain:100"),
    fits=("iiwa14", "panda", "go2"),
    limits=("panda", "iiwa14", "ur10e", "go2", "g1"),
    motions=("panda", "ur10e", "g1"),
    stood=200,
    motion_options=("--stiffness=1e3,1e4,1e5",),
    searched=(
        "Ladder<default>",
        "Ladder<last_bits>",
        "AxisFrames<SquareRoot>",
        "Sequential<Conventional>",
        "Sequential<UD>",
        "Sequential<ArrayMGS>",
        "WideRefined<FactoredBias<ArrayGivens>>",
    ),
    scanned={100: (4,), 1000: (15, 4), 10_000: (156, 4), 100_000: (1024, 4)},
    evaluations=5000,
)
