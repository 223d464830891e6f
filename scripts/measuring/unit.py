"""One measurement: its command, its files, and whether it was made before."""

import functools
import hashlib
import os
import re
import signal
import subprocess
from pathlib import Path

from children import end_with_parent
from measuring.effort import FULL, Effort
from measuring.plan import KINDS, SCANNED
from measuring.scene import BadInput, Scene

MUJOCO_STATES = 100
ARMATURE = "--armature="  # option that names a file


def model_files(model: Path) -> list[Path]:
    """The model and the files that it names, such as includes and meshes, as far as they exist."""
    found, queue, folders = [], [model], {model.parent}
    while queue:
        path = queue.pop()
        if path in found or not path.is_file():
            continue
        found.append(path)
        if path.suffix in (".xml", ".urdf"):
            text = path.read_text(errors="replace")
            for name in re.findall(r'(?:mesh|asset)dir="(.*?)"', text):
                folders.add(model.parent / name)
            names = re.findall(r'file(?:name)?="(.*?)"', text)
            queue += [folder / name for folder in sorted(folders) for name in names]
    return found


def digest_now(path: Path) -> bytes:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()


@functools.cache
def digest(path: Path) -> bytes:
    """Of what does not change while we run."""
    return digest_now(path)


@functools.cache
def processor() -> str:
    return re.search(r"model name.*|$", Path("/proc/cpuinfo").read_text())[0]


def called(programs: Path, name: str) -> list[Path | str]:
    """How a program is called: it is a file of the folder `programs`, or a name to that file."""
    return [programs, name] if os.path.isfile(programs) else [programs / name]


def benchmark_options(effort: Effort, repetitions: int, min_time: float) -> list[str]:
    return [
        f"--benchmark_repetitions={repetitions}",
        f"--benchmark_min_time={min_time}",
        "--benchmark_enable_random_interleaving=true",
        "--benchmark_report_aggregates_only=true",
        "--benchmark_out_format=json",
        f"--benchmark_context=mode={effort.name}",
    ]


class Unit:
    """One program run on one scene, whose result is one data file."""

    def __init__(self, kind: str, scene: Scene, effort: Effort, programs: Path, out: Path):
        self.kind, self.scene, self.effort = kind, scene, effort
        self.what = KINDS[kind]
        self.title = f"{self.what.title} of {scene.label}"
        self.alone = self.what.alone
        self.command = called(programs, self.what.program)
        self.program = self.command[0]
        label = scene.label.replace(":", "-").replace(" ", "-")
        name = f"{self.what.data or kind}-{label}"
        self.log = out / "log" / f"{kind}-{label}.log"
        self.data = out / "data" / f"{name}.{self.what.suffix}"
        self.partial = out / "partial" / self.data.name  # becomes `data` once it is complete
        self.key_file = self.data.with_name(self.data.name + ".key")
        self.process = None
        self.has_data = self.is_done()

    def arguments(self, effort: Effort) -> list[str]:
        """All but where the data goes."""
        scene = [self.what.scene.format(self.scene.argument)] if self.scene.argument else []
        return [*scene, *self.scene.read, *self.options(effort)]

    @property
    def ladder(self) -> list[str]:
        """Of a robot every tolerance of the ladder, for the first figure of the page."""
        return ["--ladder"] if self.scene.model else []

    @property
    def generated(self) -> list[str]:
        """Of a robot, whose code is timed, its errors too."""
        return ["--generated"] if self.scene.model else []

    def options(self, effort: Effort) -> list[str]:
        match self.kind:
            case "times" | "batch":
                return [
                    *self.ladder,
                    *benchmark_options(effort, effort.repetitions, effort.min_time),
                ]
            case "generated":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                return ["--generated", "--benchmark_filter=/Generated<", *timing]
            case "dynamics" | "peers":
                return benchmark_options(effort, effort.repetitions, effort.min_time)
            case "estimation":
                timing = benchmark_options(effort, *effort.estimation)
                return [f"--largest={effort.longest}", *timing]
            case "scan":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                return [f"--family={SCANNED}", f"--largest={max(effort.scanned)}", *timing]
            case "scans":
                return list(self.scene.options)
            case "spans":
                return ["--cost", *self.scene.options]
            case "jacobians":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                return ["--benchmark_filter=^jacobian_", *timing]
            case "standing":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                return [*self.scene.options, *timing]
            case "contacts":
                return [*self.scene.options, f"--random={effort.stood}"]
            case "pruning":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                title = f"--benchmark_context=title={self.scene.label}"
                return [*self.scene.options, title, *timing]
            case "identify":
                return ["--start-error=0.5", *self.scene.options]
            case "motions":
                return list(effort.motion_options)
            case "errors":
                states = effort.states_of(self.scene.size)
                return [*self.ladder, *self.generated, "--seed=1", f"--states={states}"]
            case "mujoco":
                return ["--seed=1", f"--random={MUJOCO_STATES}"]
            case "paper":
                return [f"--precision={effort.paper}"] if self.scene.argument else []
            case "simulation":
                return [f"--samples={effort.samples}"] if effort.samples else []
            case "exhibits":
                timing = benchmark_options(effort, effort.repetitions, effort.min_time)
                return ["--exhibits", *timing]
            case "stress" | "integration":
                return [f"--{effort.name}"]
            case "families":
                return ["--list"]
            case "adversary":
                variants = [f"--variant={variant}" for variant in effort.searched]
                return [f"--evaluations={effort.evaluations}", *variants]
            case "recommend" | "limits":
                return []

    def key(self, effort: Effort) -> str:
        sources = [self.program, *(model_files(self.scene.model) if self.scene.model else [])]
        sources += [
            Path(option[len(ARMATURE) :]) for option in self.scene.read if ARMATURE in option
        ]
        what = "\n".join([*self.arguments(effort), processor()])
        return hashlib.sha256(b"".join(map(digest, sources)) + os.fsencode(what)).hexdigest()

    def sealed(self, effort: Effort) -> str:
        """The key file: what determines the data, and what the data was."""
        return f"kalmarm-key-1 {self.key(effort)} {digest_now(self.data).hex()}\n"

    def is_done(self) -> bool:
        """Whether it was measured before, with the same effort or with full effort."""
        # The longest name first: one that no file can have is found before anything is measured.
        if not all(file.is_file() for file in (self.key_file, self.data, self.program)):
            return False
        key = self.key_file.read_text(errors="replace")
        return key in (self.sealed(self.effort), self.sealed(FULL))

    def start(self) -> None:
        out = f"{self.what.out}={self.partial}"
        command = [*self.command, *self.arguments(self.effort), out]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                preexec_fn=end_with_parent(os.getpid()),
            )

    def finish(self) -> str | None:
        """Publishes the result; returns what went wrong, if anything."""
        code = self.process.returncode
        if code == 2 and not self.what.partial:
            raise BadInput(self.last_line())
        if code == 0 or (code == 1 and self.what.shows_failure and self.partial.exists()):
            self.key_file.unlink(missing_ok=True)
            self.partial.replace(self.data)
            self.has_data = True
        if code == 0:
            self.key_file.write_text(self.sealed(self.effort))
            return None
        self.partial.unlink(missing_ok=True)
        end = f"exit {code}" if code > 0 else signal.Signals(-code).name
        return f"{end}: {self.last_line()} ({os.path.relpath(self.log)})"

    def last_line(self) -> str:
        """Of what the program printed: its error line, or else its last one."""
        lines = self.log.read_text(errors="replace").split("\n")
        lines = [line.strip() for line in lines if line.strip()]
        errors = [line for line in lines if ": error: " in line]
        return (errors or lines or [""])[-1]

    def stop(self) -> None:
        if self.process:
            self.process.kill()
            self.process.wait()
