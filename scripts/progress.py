"""How far a list of units is, and how long the rest will take."""

import shutil
import sys
from collections import defaultdict


def clock(seconds: float) -> str:
    return f"{int(seconds + 0.5) // 60}:{int(seconds + 0.5) % 60:02}"


class Progress:
    """On a terminal a bar with what is running and the time left, else one line for each unit.

    A unit has kind, title, expected [s], elapsed() [s] and alone; others run `parallel` at a time.
    """

    def __init__(self, units, parallel: int):
        self.parallel = parallel
        self.waiting = list(units)
        # Seconds by kind, as expected and as spent. Both begin with a fifth of what is expected, so
        # that one odd unit does not sway the estimate.
        self.expected, self.spent = defaultdict(float), defaultdict(float)
        for unit in units:
            self.expected[unit.kind] += unit.expected / 5
            self.spent[unit.kind] += unit.expected / 5
        self.terminal = sys.stdout.isatty()
        self.done = 0.0  # s on the clock
        self.share = 0.0

    def weight(self, unit) -> float:
        return 1 if unit.alone else 1 / self.parallel

    def seconds(self, unit) -> float:
        """Expected seconds, corrected by what the finished units of its kind have taken."""
        return unit.expected * self.spent[unit.kind] / self.expected[unit.kind]

    def show(self, running) -> None:
        left = 0.0
        for unit in self.waiting:
            seconds = self.seconds(unit)
            if unit in running:
                seconds = max(seconds - unit.elapsed(), 0.05 * seconds)
            left += self.weight(unit) * seconds
        done = self.done + sum(self.weight(unit) * unit.elapsed() for unit in running)
        self.share = max(self.share, done / (done + left) if done + left else 1.0)
        if self.terminal:
            bar = f"[{'#' * int(20 * self.share):.<20}] {100 * self.share:3.0f} %"
            line = f"{bar} {', '.join(unit.title for unit in running)}, about {clock(left)} left"
            self.write(line[: shutil.get_terminal_size().columns - 1])

    def finished(self, unit, fault: str | None) -> None:
        self.waiting.remove(unit)
        self.spent[unit.kind] += unit.elapsed()
        self.expected[unit.kind] += unit.expected
        self.done += self.weight(unit) * unit.elapsed()
        if fault:
            self.clear()
            print(f"report: {unit.title} failed: {fault}", file=sys.stderr, flush=True)
        elif not self.terminal:
            self.show([])
            print(f"[{100 * self.share:3.0f} %] {unit.title}, {unit.elapsed():.1f} s", flush=True)

    def write(self, text: str) -> None:
        print(f"\r\x1b[K{text}", end="", flush=True)

    def clear(self) -> None:
        if self.terminal:
            self.write("")
