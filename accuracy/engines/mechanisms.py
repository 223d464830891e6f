"""The mechanisms that engines are asked about, by name; export_mechanism writes their files.

panda  chain:31  my_robot.urdf     a scene of any program
iiwa14+payload=1e4                 the same under a stress of `limits`
found/AxisFrames-SquareRoot-float32      what the adversary found, with its state
finds/MuJoCo-Warp-float32          what a search of arms found of an engine, with its state
"""

import hashlib
import json
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

from environments import FOLDER, ROOT

PROGRAM = ROOT / "build" / "bin" / "export_mechanism"
FOUND = ROOT / "accuracy" / "adversary" / "found"
FINDS = Path(__file__).resolve().parent / "finds"
STATES = 8
ROBOTS = "two_link puma560 panda iiwa14 ur10e so101 go2 g1 shadow_hand".split()
FAMILIES = ["chain:7", "chain:31", "chain:63", "straight:31", "tree:31"]
STRESSED = [
    "iiwa14+payload=1e2",
    "iiwa14+payload=1e4",
    "iiwa14+payload=1e6",
    "iiwa14+long_tool=1e3",
    "iiwa14+light_wrist=1e-4",
    "ur10e+payload=1e4",
]
USUAL = [*ROBOTS, *FAMILIES, *STRESSED]
NAME = re.compile(r"(?P<scene>[^+]+)(\+(?P<stress>[a-z_:A-Z0-9-]+)=(?P<value>[0-9.e+-]+))?")


class BadName(Exception):
    """What is wrong with a name or a mechanism, in a line."""


class Written(NamedTuple):
    scene: str  # with its size, as records have it
    folder: Path
    key: str  # of its contents

    @property
    def is_found(self) -> bool:
        """By a search for errors: its times are those of any mechanism of its size."""
        return self.scene.startswith(("found/", "finds/"))


def found() -> list[str]:
    folders = {"found": FOUND, "finds": FINDS}
    return [
        f"{name}/{path.stem}" for name in folders for path in sorted(folders[name].glob("*.xml"))
    ]


def arguments(name: str) -> list[str]:
    """Of export_mechanism."""
    if name in found():
        folder, stem = name.split("/")
        path = (FOUND if folder == "found" else FINDS) / stem
        return [f"{path}.xml", "--states", f"{path}.json"]
    if not (parts := NAME.fullmatch(name)):
        raise BadName(f"'{name}' is no SCENE, SCENE+STRESS=VALUE, found/NAME or finds/NAME")
    out = [parts["scene"], "--random", str(STATES)]
    return out + (
        ["--stress", parts["stress"], "--value", parts["value"]] if parts["stress"] else []
    )


def slug(name: str) -> str:
    """As a file may be called."""
    return re.sub(r"[^A-Za-z0-9.]+", "-", name).strip("-")


def label(name: str, nv: int) -> str:
    """The scene's name with its size: chain:31, iiwa14+payload=1e4:7."""
    stem = Path(name).stem if Path(name).suffix in (".xml", ".urdf") else name
    return f"{stem.removesuffix(f':{nv}')}:{nv}"


def export(options: list, environment: dict | None = None) -> str:
    """Runs export_mechanism; why it wrote nothing, in a line."""
    command = [PROGRAM, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    if not done.returncode:
        return ""
    lines = done.stderr.strip().splitlines() or [f"exit {done.returncode}"]
    return lines[-1].removeprefix("export_mechanism: error: ")


def write(name: str) -> Written:
    """Its files, made anew: the program keeps truth that it worked out before."""
    folder = FOLDER / "mechanisms" / slug(name)
    if why := export([*arguments(name), "--out", folder]):
        raise BadName(f"{name}: {why}")
    digest = hashlib.sha256()
    for file in ("robot.xml", "truth.json"):
        digest.update((folder / file).read_bytes())
    nv = json.loads((folder / "truth.json").read_text())["nv"]
    return Written(label(name, nv), folder, digest.hexdigest())
