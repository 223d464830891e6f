"""What a campaign has finished, taken file by file as it comes."""

import os
from pathlib import Path

from plan import Plan
from read.data import DataError


class Found:
    """Of one campaign; a kind of campaign says what is taken of a file, and what is written."""

    def __init__(self, plan: Plan, folder: Path):
        self.plan, self.folder = plan, folder
        self.left = dict.fromkeys(plan.jobs)  # in order

    def take(self, name: str, file: Path) -> None:
        """DataError or ValueError if it is not what the job should have written."""
        raise NotImplementedError

    def settle(self) -> None:
        """Takes for an answer what is left by then, where it is one."""

    def result(self) -> str:
        raise NotImplementedError

    def total(self) -> str:
        """What was found, in a few words."""
        raise NotImplementedError

    def look(self) -> int:
        """Takes what is new; returns how many files that were."""
        try:
            names = os.listdir(self.folder / "units")
        except FileNotFoundError:  # Snakemake clears away what a job that fails leaves empty
            names = []
        stems = [name.removesuffix(".json") for name in names if name.endswith(".json")]
        new = sorted(stem for stem in stems if stem in self.left)
        for name in new:
            self._take(name)
        return len(new)

    def _take(self, name: str) -> None:
        file = self.folder / "units" / f"{name}.json"
        try:
            self.take(name, file)
        except (DataError, ValueError) as error:
            refused = file.with_name(f"{name}.refused")
            file.replace(refused)
            why = str(error).removeprefix(f"{file}: ")
            raise DataError(
                f"{refused}: set aside: {why}; start again to measure it anew"
            ) from None
        del self.left[name]

    def log(self, name: str) -> Path:
        return self.folder / "log" / f"{name}.log"

    def said(self, name: str) -> str:
        """What the worker said of this job, if anything."""
        log = self.log(name)
        return log.read_text(errors="replace").strip() if log.is_file() else ""
