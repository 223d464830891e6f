"""A Slurm cluster of two nodes, made of this machine, in namespaces of its own: the configuration
that is mounted and every process that is started end with the first process of the namespace."""

import os
import signal
import socket
import subprocess
import time
from pathlib import Path

NODES = ("n1", "n2")
PORT = 17001  # of the first node
CONFIGURATION = """\
ClusterName=kalmarm
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
SlurmdTimeout=15
MinJobAge=3600
SchedulerParameters=sched_interval=1,bf_interval=1
{nodes}
PartitionName=all Nodes=ALL Default=YES State=UP
"""


class Cluster:
    def __init__(self, folder: Path):
        assert os.getpid() == 1, (
            "what is mounted and started here ends with scripts/test_cluster alone"
        )
        self.folder, self.daemons = folder, {}
        (folder / "state").mkdir()
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        # Slurm binds to any address of the machine; the C library counts those of 127/8 as none.
        subprocess.run(["ip", "address", "add", "10.0.0.1/32", "dev", "lo"], check=True)
        for place in ("/etc/slurm", "/run"):
            subprocess.run(["mount", "-t", "tmpfs", "tmpfs", place], check=True)
        nodes = "\n".join(
            f"NodeName={name} NodeHostname={socket.gethostname()} NodeAddr=127.0.0.1 "
            f"Port={PORT + i} CPUs=1 RealMemory=2000"
            for i, name in enumerate(NODES)
        )
        text = CONFIGURATION.format(host=socket.gethostname(), folder=folder, nodes=nodes)
        Path("/etc/slurm/slurm.conf").write_text(text)
        munge = Path("/run/munge")
        munge.mkdir()
        subprocess.run(["chown", "munge:munge", munge], check=True)
        as_munge = ["setpriv", "--reuid=munge", "--regid=munge", "--clear-groups"]
        self._start("munged", [*as_munge, "munged", "--foreground"])
        self.wait_for(lambda: (munge / "munge.socket.2").exists())
        self._start("slurmctld", ["slurmctld", "-D"])
        for name in NODES:
            self.start_node(name)
        self.wait_for(lambda: self.states() == ["idle", "idle"])

    def _start(self, name: str, command: list[str]) -> None:
        with (self.folder / f"{name}.out").open("ab") as log:
            self.daemons[name] = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def start_node(self, name: str) -> None:
        self._start(name, ["slurmd", "-D", "-N", name])

    def kill_node(self, name: str) -> None:
        """Its daemon alone, as it dies of a fault of its own."""
        daemon = self.daemons.pop(name)
        daemon.send_signal(signal.SIGKILL)
        daemon.wait()

    def states(self) -> list[str]:
        """Of the nodes, in order."""
        return self.ask("sinfo", "--Node", "--noheader", "--format=%t").split()

    def jobs(self) -> list[str]:
        return self.ask("squeue", "--noheader", "--format=%i %T %N").splitlines()

    @staticmethod
    def ask(*command: str) -> str:
        return subprocess.run(command, check=False, capture_output=True, text=True).stdout

    @staticmethod
    def wait_for(condition, seconds: float = 60) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline
            time.sleep(0.1)

    def end(self) -> None:
        subprocess.run(["scancel", "--user=root"], check=False, capture_output=True)
        for daemon in reversed(self.daemons.values()):
            daemon.terminate()
        for daemon in self.daemons.values():
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
