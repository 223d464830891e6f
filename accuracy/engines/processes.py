"""Processes of worker.py: asked, listened to, and ended where they hang."""

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))

from children import end_with_parent  # noqa: E402


class Ended(Exception):
    """How a worker ended before it was done."""


class Worker:
    """A process of worker.py; `limit`: how long it may say nothing."""

    def __init__(self, command: list, limit: float, asked: bool = False):
        self.limit = limit
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE if asked else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            preexec_fn=end_with_parent(os.getpid()),
        )
        self.said: queue.Queue = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        for line in self.process.stdout:
            self.said.put(line)
        self.said.put(None)

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *_) -> None:
        self.process.kill()
        self.process.wait()
        if self.process.stdin:
            with contextlib.suppress(BrokenPipeError):
                self.process.stdin.close()

    def ask(self, folder: Path) -> None:
        """One that reads folders from its standard input."""
        with contextlib.suppress(BrokenPipeError):  # it died: lines() says how
            self.process.stdin.write(f"{folder}\n")
            self.process.stdin.flush()

    def lines(self) -> Iterator[dict]:
        """What it says, to its end or to "done". Raises Ended where it hangs or dies."""
        try:
            while (line := self.said.get(timeout=self.limit)) is not None:
                record = json.loads(line)
                yield record
                if "done" in record:
                    return
        except queue.Empty:
            raise Ended(f"timed out: {self.limit:g} s") from None
        code = self.process.wait()
        if code > 0:
            raise Ended(f"crashed: exit {code}")
        if code < 0:
            raise Ended(f"crashed: {signal.Signals(-code).name}")
