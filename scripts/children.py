"""Programs that end with us."""

import ctypes
import os
import signal
from collections.abc import Callable

PR_SET_PDEATHSIG = 1  # of prctl(2)


def end_with_parent(parent: int) -> Callable[[], None]:
    """What a child of ours calls first: it is killed when we end, in whatever way."""
    libc = ctypes.CDLL(None)

    def call() -> None:
        libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that
            os._exit(1)

    return call
