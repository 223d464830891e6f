"""Decides the claims by replicates, each a run of `stress` and `integrate` by seeds of its own.

decide.py STRESS --effort=EFFORT --unit=FIRST+COUNT --out=FILE
"""

import argparse
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[1:1] = [str(ROOT / "scripts"), str(ROOT / "reports")]
from children import end_with_parent  # noqa: E402
from claims import REPEATED  # noqa: E402
from claims.claim import Claim  # noqa: E402
from claims.needed import VARIANTS  # noqa: E402
from page.output import write  # noqa: E402
from plan import last_line, sha1  # noqa: E402
from read import campaign_files  # noqa: E402
from read.data import Data, DataError  # noqa: E402
from read.readers import load  # noqa: E402
from read.replicate_files import part_of, written  # noqa: E402
from read.replicates import Numbers, Repeated, Replicates  # noqa: E402

SEEDS = {"quick": 150, "full": 10_000}  # by effort: of a replicate, as many as its wild mechanisms
LARGEST_SEED = 10**9  # that the programs take
PROBE = ["--unit=wild/1/1+1", "--task=white", "--precision=float64", "--variant=Batch<EigenLLT>"]
RULES = [f"reports/{room}/*.py" for room in ("claims", "read", "summary")]
ROBOTS = "robots/models/*/*.xml"


def seeds(replicate: int, effort: str) -> range:
    first = 1 + (replicate - 1) * SEEDS[effort]
    return range(first, first + SEEDS[effort])


def key(stress: Path, effort: str) -> dict:
    """All that a verdict depends on beside the seeds."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "probe.json"
        ran(stress, *PROBE, f"--out={out}")
        made = campaign_files.read(out).key
    return {
        "stress": made["program"],
        "integrate": sha1(stress.with_name("integrate")),
        "effort": effort,
        "variants": list(VARIANTS),
        "sources": sources(),
        **{name: made[name] for name in ("compiler", "flags", "isa", "blas")},
    }


def sources() -> str:
    """SHA-1 of the rules, and of the robots among the families."""
    hashes = hashlib.sha1()
    for file in sorted(file for pattern in (*RULES, ROBOTS) for file in ROOT.glob(pattern)):
        hashes.update(f"{file.relative_to(ROOT)} {sha1(file)}\n".encode())
    return hashes.hexdigest()


def ran(*command: object) -> None:
    """Keeps no truth: each would be kept for good, and none is asked for again."""
    done = subprocess.run(
        command,
        check=False,
        capture_output=True,
        text=True,
        env=os.environ | {"KALMARM_CACHE": ""},
        preexec_fn=end_with_parent(os.getpid()),
    )
    if done.returncode:
        raise DataError(last_line(done.stderr))


def measured(stress: Path, replicate: int, effort: str, folder: Path) -> Data:
    """What a page would show of this run."""
    own = seeds(replicate, effort)
    options = [f"--{effort}", f"--first-seed={own.start}"]
    variants = [f"--variant={name}" for name in VARIANTS]
    files = [folder / name for name in ("families-a.json", "stress-a.csv", "integration-a.csv")]
    ran(stress, "--list", f"--json={files[0]}")
    ran(stress, *options, *variants, "--jobs=1", f"--out={files[1]}")
    ran(stress.with_name("integrate"), *options, f"--out={files[2]}")
    data = load(None, files)
    seen = {*data.stress["seed"].tolist(), *(run.seed for run in data.integrations)}
    if strange := sorted(seed for seed in seen if seed not in own):
        raise DataError(f"seed {strange[0]:g} is none of {own.start} to {own.stop - 1}")
    return data


def decided(data: Data, replicate: int, key: dict) -> Replicates:
    claims = [_repeated(decide(data), replicate) for decide in REPEATED]
    return Replicates(key, {replicate}, claims)


def _repeated(claim: Claim, replicate: int) -> Repeated:
    """Without times, which no seed changes."""
    claim = claim._replace(checks=[check for check in claim.checks if not check.timed])
    numbers = [check.number for check in claim.checks]
    checks = [
        Numbers(it.what, it.low, it.high, {} if it.value is None else {replicate: float(it.value)})
        for it in numbers
    ]
    return Repeated(claim.id, checks, Counter([claim.verdict]))


@contextmanager
def emptied(folder: Path):
    """For a while; what a process that was killed left there is no obstacle."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


def run(options: argparse.Namespace) -> None:
    own = key(options.stress, options.effort)
    unit = part_of(options.unit)
    total = None
    for replicate in range(unit.first, unit.end):
        try:
            with emptied(options.out.with_suffix(".work")) as folder:
                data = measured(options.stress, replicate, options.effort, folder)
        except DataError as error:
            raise DataError(f"replicate {replicate}: {error}") from None
        part = decided(data, replicate, own)
        total = total or part.emptied()
        total.add(part)
    write(options.out, written(total))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stress", type=Path)
    parser.add_argument("--effort", choices=SEEDS, required=True)
    parser.add_argument("--unit", required=True)
    parser.add_argument("--out", type=Path, required=True)
    try:
        run(parser.parse_args())
    except (DataError, OSError) as error:
        print(f"claims: error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
