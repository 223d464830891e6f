"""Snakemake, run on the units of a folder."""

import hashlib
import os
import shutil
import subprocess
import sys
import threading
from collections import deque
from pathlib import Path

from children import end_with_parent
from read.data import DataError

HERE = Path(__file__).parent
PROFILES = HERE / "profiles"
KEPT = 400  # lines of what it says
DECIDED = ("--rerun-incomplete", "--rerun-triggers=mtime", "--nocolor")


class Engine:
    """One run in a folder that nobody else runs in."""

    def __init__(self, snakemake: Path, profile: str, folder: Path, worker: Path):
        if not os.access(snakemake, os.X_OK):
            raise DataError(f"{snakemake}: no Snakemake there, run scripts/setup --cluster")
        self.folder = folder
        # Names the jobs of this folder, whichever run has submitted them.
        self.jobs = "kalmarm-" + hashlib.sha1(os.fsencode(folder)).hexdigest()[:12]
        self.base = [snakemake, "--snakefile", HERE / "Snakefile", "--directory", folder]
        self.base += ["--config", f"worker={worker}", f"python={sys.executable}"]
        self.command = [*self.base, "--profile", profile_folder(profile), *DECIDED]
        self.command += [f"--slurm-jobname-prefix={self.jobs}"]
        self.said: deque[str] = deque(maxlen=KEPT)
        self.process: subprocess.Popen | None = None

    def start(self) -> None:
        self._end_orphans()
        if any((self.folder / ".snakemake" / "locks").glob("*")):  # left by a run that was killed
            subprocess.run([*self.base, "--unlock", "--cores=1"], check=False, capture_output=True)
        # A group of its own: an interruption from the terminal is ours alone to tell.
        self.process = subprocess.Popen(
            self.command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            process_group=0,
            preexec_fn=end_with_parent(os.getpid()),
        )
        self.listener = threading.Thread(target=self._listen)
        self.listener.start()

    def _listen(self) -> None:
        for line in self.process.stdout:
            self.said.append(line.decode(errors="replace").rstrip())

    def _end_orphans(self) -> None:
        """Jobs of a run that was killed would go on beside those that replace them."""
        if not shutil.which("squeue"):
            return
        listed = subprocess.run(
            ["squeue", "--me", "--noheader", "--format=%i %j"],
            check=False,
            capture_output=True,
            text=True,
        )
        jobs = [line.split() for line in listed.stdout.splitlines()]
        orphans = [job[0] for job in jobs if len(job) == 2 and job[1].startswith(self.jobs)]
        if orphans:
            subprocess.run(["scancel", *orphans], check=False, capture_output=True)

    def running(self) -> bool:
        return self.process.poll() is None

    def wait(self) -> int:
        self.process.wait()
        self.listener.join()
        return self.process.returncode

    def stop(self) -> None:
        """Its jobs end too. Interrupted, it would wait for those that run, half an hour each."""
        if self.process and self.running():
            self.process.kill()
            self.wait()
            self._end_orphans()


def profile_folder(profile: str) -> Path:
    """One of ours, or the path of another."""
    folder = PROFILES / profile if "/" not in profile else Path(profile).resolve()
    if not any((folder / name).is_file() for name in ("config.yaml", "config.v9+.yaml")):
        known = ", ".join(sorted(path.name for path in PROFILES.iterdir()))
        raise DataError(f"profile {profile}: no {folder}/config.yaml; there are {known}")
    return folder
