"""A campaign on a real Slurm of two nodes, each of which loses something on the way. Run by
scripts/test_cluster."""

import os
import signal
from pathlib import Path

import pytest
from running import begun, has_ended, result, start, units, wait_for, wild, wild_arguments
from slurm import Cluster

PROFILE = f"--profile={Path(__file__).parent}/profile"


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    made = Cluster(tmp_path_factory.mktemp("slurm"))
    yield made
    made.end()


@pytest.fixture(scope="module")
def local(tmp_path_factory) -> bytes:
    """What the same campaign is on one machine, undisturbed."""
    out = tmp_path_factory.mktemp("local")
    done = wild(out)
    assert (done.returncode, done.stderr) == (0, "")
    return result(out)


class Run:
    """A campaign on the cluster."""

    def __init__(self, folder: Path, seconds: int, **environment: str):
        self.out, self.log = folder / "out", folder / "log"
        environment |= {"FAKE_LOG": str(self.log), "FAKE_SECONDS": str(seconds)}
        self.process = start(*wild_arguments(self.out), PROFILE, **environment)

    def begun(self) -> list[tuple[int, str]]:
        return begun(self.log)

    def at_work(self) -> list[int]:
        """Processes of the workers of units that are not there yet."""
        there = {name.removesuffix(".json").replace("_", "/") for name in units(self.out)}
        return [process for process, unit in self.begun() if unit not in there]

    def finish(self) -> bytes:
        _, err = self.process.communicate(timeout=200)
        assert (self.process.returncode, err) == (0, "")
        return result(self.out)


def test_two_nodes_measure_what_one_machine_does(cluster, local, tmp_path):
    run = Run(tmp_path, seconds=2)
    nodes = set()

    def seen() -> bool:
        nodes.update(line.split()[2] for line in cluster.jobs() if " RUNNING " in line)
        return nodes == {"n1", "n2"}

    wait_for(seen)
    assert run.finish() == local


def test_a_worker_that_is_killed_is_replaced(cluster, local, tmp_path):
    run = Run(tmp_path, seconds=4)
    wait_for(run.at_work)
    os.kill(run.at_work()[0], signal.SIGKILL)
    assert run.finish() == local
    assert len(run.begun()) == 9


def test_a_node_whose_daemon_is_killed_is_done_without(cluster, local, tmp_path):
    run = Run(tmp_path, seconds=4)
    wait_for(lambda: len(run.at_work()) >= 2)
    cluster.kill_node("n2")
    assert run.finish() == local
    cluster.start_node("n2")
    wait_for(lambda: cluster.states() == ["idle", "idle"])


def test_a_head_that_is_killed_leaves_jobs_which_the_next_one_ends(cluster, local, tmp_path):
    fault = tmp_path / "fault"
    fault.write_text("61 hang")
    run = Run(tmp_path, seconds=2, FAKE_FAULT=str(fault))
    wait_for(lambda: units(run.out) and "wild/1/61+20" in dict(map(reversed, run.begun())))
    run.process.send_signal(signal.SIGKILL)
    run.process.communicate(timeout=30)
    hanging = {unit: process for process, unit in run.begun()}["wild/1/61+20"]
    assert cluster.jobs() and not has_ended(hanging)
    assert len(units(run.out)) < 8
    fault.unlink()
    again = wild(run.out, PROFILE, FAKE_LOG=str(run.log))
    assert (again.returncode, again.stderr) == (0, "")
    assert result(run.out) == local
    assert not cluster.jobs() and has_ended(hanging)
