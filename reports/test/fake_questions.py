"""Made-up records of bench_pruning, with round numbers."""

PRECISIONS = {"float64": 1, "float32": 0.75}  # time over that of float64
QUESTIONS = {  # scene, DoF left, want, how it is asked, rules, ns by how
    "planar arm": (
        "planar:10",
        10,
        "acceleration",
        "",
        "zero_terms",
        {"whole": 2400, "pruned": 600},
    ),
    "arm among 20 things": (
        "table:135",
        9,
        "acceleration",
        " --dofs panda_*",
        "untouched_trees,separate_trees",
        {"whole": 30000, "pruned": 1250, "alone": 1000},
    ),
    "arm at rest": (
        "iiwa14:7",
        7,
        "acceleration",
        " --at-rest",
        "rest",
        {"whole": 800, "pruned": 750},
    ),
    "diagonal at 500 links": (
        "chain:500",
        500,
        "diagonal",
        "",
        "partial_answers",
        {"whole": 1.5e6, "pruned": 3e5},
    ),
    "one foot of a humanoid": (
        "g1:35",
        35,
        "operational",
        " --site left_ankle_roll_link",
        "partial_answers",
        {"whole": 24000, "pruned": 8000},
    ),
}
FLOPS = {"whole": 9000, "pruned": 3000, "alone": 2900}


def call(want: str, how: str, scene: str, precision: str, nanoseconds: float) -> list[dict]:
    """Google Benchmark's rows."""
    name = f"{want}/{how}/{scene}/{precision}"
    common = {"run_name": name, "run_type": "aggregate", "repetitions": 5, "time_unit": "ns"}
    return [
        common
        | {"name": f"{name}_{aggregate}", "aggregate_name": aggregate}
        | {"real_time": value, "cpu_time": value, "flops": scale * FLOPS[how]}
        for aggregate, value, scale in (
            ("mean", 1.02 * nanoseconds, 1),
            ("median", nanoseconds, 1),
            ("cv", 0.02, 0),
        )
    ]


def record(title: str, /, **changes) -> dict:
    """A data file; `changes` are of its context."""
    scene, left, want, asked, rules, times = QUESTIONS[title]
    context = {
        "title": title,
        "question": f"--want {want}{asked}",
        "rules": rules,
        "dofs": scene.split(":")[1],
        "dofs_left": str(left),
        "timed_call": "copies of what is needed, kinematics and solution",
    }
    rows = [
        row
        for precision, share in PRECISIONS.items()
        for how, time in times.items()
        for row in call(want, how, scene, precision, share * time)
    ]
    return {"context": context | changes, "benchmarks": rows}
