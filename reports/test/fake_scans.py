"""Made-up records of the programs bench_scan and scans, which follow exact laws."""

from read.scans import ERRORS, FLOPS

FAMILY = "straight"
SIZES = {100: 4, 1000: 15, 10000: 156}  # N: links of a timed block
COPIED = {1: 10e9, 2: 16e9}  # bytes/s by threads
KINEMATICS = 30.0  # ns a link
CALLS = {  # ns a link, by threads; bytes a link
    "Ladder<default>": ({1: 25.0}, 400),
    "Sequential<Conventional>": ({1: 300.0}, 1500),
    "Sequential<ArrayGivens>": ({1: 1000.0}, 1500),
    "Scan<Conventional>": ({1: 900.0, 2: 480.0}, 4000),
    "Scan<SquareRoot>": ({1: 2500.0, 2: 1300.0}, 4000),
}
FLOPS_OF_LINK = {  # in sequence, and as a scan
    ("Sequential<Conventional>", "Scan<Conventional>"): (742, 2570),
    ("Sequential<ArrayGivens>", "Scan<SquareRoot>"): (2731, 6981),
}
ERRORS_OF = {"Conventional": 4e-16, "ArrayGivens": 2e-16, "SquareRoot": 3e-16}


def times() -> list[dict]:
    """Google Benchmark's rows."""
    rows = [
        _timed(f"bandwidth/copy@{threads}/none:0", 5e7, bytes_per_second=rate)
        for threads, rate in COPIED.items()
    ]
    for n in SIZES:
        rows.append(_timed(f"kinematics/all/{FAMILY}:{n}", KINEMATICS * n))
        for variant, (by_threads, size) in CALLS.items():
            for threads, time in by_threads.items():
                at = f"@{threads}" if variant.startswith("Scan<") else ""
                name = f"acceleration/{variant}{at}/{FAMILY}:{n}"
                rows.append(_timed(name, time * n, bytes=float(size * n)))
    return rows


def _timed(name: str, time: float, **counters) -> dict:
    name = f"{name}/float64/process_time/real_time"
    common = {"name": name, "run_name": name, "run_type": "iteration", "repetitions": 1}
    return common | {"real_time": time, "time_unit": "ns", **counters}


def errors() -> list[list]:
    """Rows of the CSV, in its order of columns."""
    rows = []
    for n, links in SIZES.items():
        for task in ("random", "dynamics"):
            begin = [FAMILY, n, n, 1, "float64", task]
            for pair in FLOPS_OF_LINK:
                for variant in pair:
                    update = variant.split("<")[1][:-1]
                    error = ERRORS_OF[update] * (3 if task == "dynamics" else 1)
                    blocks = [[0, "", 0, 0]]
                    if variant.startswith("Scan"):
                        orders = ("balanced", "tips_first")
                        sizes = (links, 2 * links)
                        blocks = [[size, order, 5, 0] for size in sizes for order in orders]
                    rows += [[*begin, variant, *it, "ok", f"{error:.17g}"] for it in blocks]
    return [ERRORS, *rows]


def flops() -> list[list]:
    """The same."""
    rows = []
    for n, timed in SIZES.items():
        for (sequence, scan), (least, work) in FLOPS_OF_LINK.items():
            for task, share in (("factor", 0.75), ("acceleration", 0.25)):
                begin = [FAMILY, n, n, 1, task]
                rows.append([*begin, sequence, 0, 0, 1, share * least * n])
                for links in (timed, 2 * timed):
                    span = work * (1.5 * links + 10)
                    for processors in (1, 2, 0):
                        one = span + (work * n - span) / processors if processors else span
                        rows.append([*begin, scan, links, 5, processors, share * one])
    return [FLOPS, *rows]
