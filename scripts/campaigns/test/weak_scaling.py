"""How a campaign on a real Slurm scales from one node to two, each of them a core of this machine,
which must have no other work. Run by scripts/test_cluster --weak-scaling."""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from running import RUN
from slurm import NODES, Cluster

PROFILE = Path(__file__).parent / "profile"
BIN = Path(__file__).parents[3] / "build" / "bin"


def main() -> None:
    parser = argparse.ArgumentParser(prog="test_cluster --weak-scaling", description=__doc__)
    parser.add_argument("--units", type=int, default=2, help="of each node")
    parser.add_argument("--count", type=int, default=8000, help="mechanisms of a unit")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cluster = Cluster(Path(folder))
        try:
            seconds = [measured(nodes, cluster, Path(folder), options) for nodes in (1, 2)]
        finally:
            cluster.end()
    print(f"of ideal: {seconds[0] / seconds[1]:.3f}")


def measured(nodes: int, cluster: Cluster, folder: Path, options: argparse.Namespace) -> float:
    """Wall time of the whole command [s]; the other nodes take no jobs."""
    for i, name in enumerate(NODES):
        state = ["State=RESUME"] if i < nodes else ["State=DRAIN", "Reason=measured"]
        cluster.ask("scontrol", "update", f"NodeName={name}", *state)
    cluster.wait_for(lambda: cluster.states()[:nodes] == ["idle"] * nodes)
    mechanisms = nodes * options.units * options.count
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, RUN, "wild", f"--mechanisms={mechanisms}", f"--count={options.count}"]
        + [f"--profile={PROFILE}", f"--out={folder / str(nodes)}"],
        check=False,
        env={"KALMARM_BIN": str(BIN)} | os.environ,
        stdout=subprocess.DEVNULL,
    )
    if done.returncode:  # which it has told in a line
        sys.exit(done.returncode)
    seconds = time.monotonic() - begin
    print(f"{nodes} node{'s'[: nodes - 1]}: {mechanisms} mechanisms in {seconds:.1f} s", flush=True)
    return seconds


if __name__ == "__main__":
    main()
