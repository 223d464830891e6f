"""An environment of its own for every engine: build/engines/NAME, of what locks/NAME.txt lists.

Engines need other versions of the same packages, and none of them belongs into ours. After a
change of locks/NAME.in: `scripts/engines --lock NAME`.
"""

import hashlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LOCKS = Path(__file__).resolve().parent / "locks"
FOLDER = ROOT / "build" / "engines"
PYTHON = "/usr/bin/python3"  # Debian's: a python3 earlier on PATH may be too new for wheels
INSTALLING = 900  # s
STAMP = "kalmarm-requirements"


class Missing(Exception):
    """Why an engine is not there, in a line."""


def names() -> list[str]:
    return sorted(path.stem for path in LOCKS.glob("*.in"))


def _run(command: list, what: str, seconds: float = INSTALLING, **options) -> None:
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=seconds, check=False, **options
        )
    except subprocess.TimeoutExpired:
        raise Missing(f"{what} took more than {seconds:.0f} s") from None
    if done.returncode:
        lines = (done.stderr.strip() or done.stdout.strip()).splitlines() or ["no reason given"]
        errors = [line for line in lines if "error" in line.lower()] or lines
        raise Missing(f"{what}: {errors[-1].strip()[:200]}")


def _pip(python: Path, *arguments) -> list:
    return [python, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments]


def _without_wheel(engine: str) -> list[str]:
    """`--no-binary NAME` of each package that PyPI has as source alone."""
    text = (LOCKS / f"{engine}.in").read_text()
    return [f"--no-binary={name}" for name in re.findall(r"^--no-binary (\S+)", text, re.MULTILINE)]


def wanted(engine: str) -> str:
    """What an environment is made of."""
    lock = LOCKS / f"{engine}.txt"
    if not lock.is_file():
        raise Missing(f"{lock.relative_to(ROOT)} is not there: scripts/engines --lock {engine}")
    version = subprocess.run([PYTHON, "--version"], capture_output=True, text=True, check=True)
    return f"{hashlib.sha256(lock.read_bytes()).hexdigest()} {version.stdout.strip()}"


def python_of(engine: str) -> Path | None:
    """The interpreter of an environment that is whole and up to date."""
    stamp, python = FOLDER / engine / STAMP, FOLDER / engine / "bin" / "python"
    there = stamp.is_file() and stamp.read_text() == wanted(engine) and python.exists()
    return python if there else None


def prepare(engine: str) -> Path:
    """The same, installed where it is not there. Raises Missing."""
    if python := python_of(engine):
        return python
    folder = FOLDER / engine
    print(f"engines: installing {engine} into {folder.relative_to(ROOT)}", flush=True)
    _run([PYTHON, "-m", "venv", "--clear", folder], "venv")
    python = folder / "bin" / "python"
    wheels = ["--only-binary=:all:", *_without_wheel(engine)]
    install = ["install", *wheels, "--require-hashes", "-r", LOCKS / f"{engine}.txt"]
    try:
        _run(_pip(python, *install), f"installing {engine}")
        if engine == "kalmarm":
            _install_kalmarm(python)
    except Missing:
        shutil.rmtree(folder)
        raise
    (folder / STAMP).write_text(wanted(engine))
    return python


def _install_kalmarm(python: Path) -> None:
    """The wheel of python/, with the library of build/release, as scripts/test_python builds it."""
    release, work = ROOT / "build" / "release", FOLDER / "kalmarm-wheel"
    prefix = work / "prefix"
    if not (release / "CMakeCache.txt").exists():
        raise Missing("build/release is not there: scripts/build kalmarm")
    _run(["cmake", "--build", release, "--target", "kalmarm"], "building kalmarm", 3600)
    component = ["--component", "development", "--prefix", prefix]
    _run(["cmake", "--install", release, *component], "installing kalmarm's library")
    for old in work.glob("*.whl"):
        old.unlink()
    settings = ["KALMARM_INSTALLED=ON", f"kalmarm_DIR={prefix}/lib/cmake/kalmarm"]
    _run(
        _pip(
            python,
            *("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", work),
            *(f"--config-settings=cmake.define.{setting}" for setting in settings),
            ROOT / "python",
        ),
        "building kalmarm's wheel",
        3600,
    )
    (wheel,) = work.glob("*.whl")
    _run(_pip(python, "install", "--no-deps", "--no-index", wheel), "installing kalmarm's wheel")


def lock(engine: str) -> None:
    """Writes locks/NAME.txt anew: the newest versions that fit, with hashes of all their wheels."""
    tools = FOLDER / "tools"
    if not (tools / "bin" / "uv").exists():
        _run([PYTHON, "-m", "venv", "--clear", tools], "venv")
        _run(_pip(tools / "bin" / "python", "install", "uv"), "installing uv")
    options = ["--generate-hashes", "--no-header", "--no-annotate", "--only-binary=:all:"]
    names_of = [LOCKS / f"{engine}.in", "-o", LOCKS / f"{engine}.txt"]
    uv = [tools / "bin" / "uv", "pip", "compile", "--quiet", "--upgrade", "--python", PYTHON]
    _run([*uv, *options, *names_of], f"locking {engine}")


if __name__ == "__main__":
    sys.exit("run scripts/engines")
