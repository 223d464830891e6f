"""The filter in float32 on a GPU (here Warp's own processor), beside MuJoCo Warp's and MJX's
Cholesky. The scripts run in the environments of mujoco_warp and mjx, and compile for minutes: with
KALMARM_ENGINES=all alone.
"""

import json
import os
import subprocess
from pathlib import Path

import environments
import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
ROBOTS = ("g1", "go2")
COMPILING = 3600  # s; a quiet machine takes two minutes


def said_by(script: Path, engine: str = "mujoco_warp") -> list:
    """Its lines of JSON; Warp prints others between them."""
    if os.environ.get("KALMARM_ENGINES") != "all":
        pytest.skip("compiles for minutes: KALMARM_ENGINES=all")
    if not (python := environments.python_of(engine)):
        pytest.skip(f"{engine} is not installed: scripts/engines {engine}")
    cache = {"WARP_CACHE_PATH": str(environments.FOLDER / "warp-cache")}
    done = subprocess.run(
        [python, script],
        capture_output=True,
        text=True,
        timeout=COMPILING,
        check=False,
        cwd=environments.FOLDER,  # MuJoCo writes its log there
        env={**os.environ, **cache},
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


@pytest.fixture(scope="module")
def standing() -> dict:
    """Records by robot and d; that of the issue has a d of MuJoCo's."""
    records = said_by(HERE.parent / "contacts" / "standing.py")
    return {(of["robot"], of["d"] if of["robot"] in ROBOTS else None): of for of in records}


@pytest.fixture(scope="module")
def standing_in_mjx() -> dict:
    records = said_by(HERE.parent / "contacts" / "standing_mjx.py", "mjx")
    return {(of["robot"], of["d"]): of["cholesky"] for of in records}


@pytest.fixture(scope="module")
def every_joint() -> dict:
    (record,) = said_by(HERE / "contacts" / "every_joint.py")
    return record


@pytest.mark.parametrize("d", [10.0**e for e in range(2, 9)])
@pytest.mark.parametrize("robot", ROBOTS)
def test_stiffness_costs_the_filter_no_digits(standing, robot, d):
    errors = standing[robot, d]["filter"]
    assert None not in errors
    assert np.median(errors) <= 1e-6
    assert max(errors) <= 1e-4


@pytest.mark.parametrize("robot", ROBOTS)
def test_cholesky_in_float32_loses_what_the_filter_keeps(standing, robot):
    assert np.median(standing[robot, 1e5]["cholesky"]) > 1e-3
    assert standing[robot, 1e8]["cholesky"] == [None] * len(standing[robot, 1e8]["filter"])


@pytest.mark.parametrize("robot", ROBOTS)
def test_mjx_in_float32_loses_digits_with_stiffness_and_at_last_all(standing_in_mjx, robot):
    assert max(standing_in_mjx[robot, 1e2]) < 1e-4  # the same H as the truth's
    assert np.median(standing_in_mjx[robot, 1e5]) > 1e-3
    assert standing_in_mjx[robot, 1e8] == [None] * len(standing_in_mjx[robot, 1e8])


def test_the_state_of_issue_1415_has_an_answer_in_float32(standing):
    said = standing["#1415", None]
    assert said["d"] > 1e8
    assert said["cholesky"] == [None]
    assert said["filter"][0] <= 1e-6


@pytest.mark.parametrize("cone", ["pyramidal", "elliptic"])
def test_every_kind_of_joint_and_of_row_that_is_covered_is_right(every_joint, cone):
    said = every_joint[cone]
    assert said["outcome"] == "SOLVED"
    assert said["error"] < 3e-6
    friction, limit, frictionless, contact = 1, 3, 5, {"pyramidal": 6, "elliptic": 7}[cone]
    assert said["kinds"] == [friction, limit, frictionless, contact]
    assert said["dims"] == [1, 3, 4, 6]


@pytest.mark.parametrize(("case", "outcome"), [("pair", "UNCOVERED"), ("massless", "SINGULAR")])
def test_what_has_no_answer_says_so_and_is_nan(every_joint, case, outcome):
    assert every_joint[case] == {"outcome": outcome, "nothing": True}
