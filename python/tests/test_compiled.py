"""Robots that answer by code that is generated for them: the same answers, or the loops' and a word about it."""

import pickle
import stat
import warnings

import numpy as np
import pytest
from conftest import load

import kalmarm

TASKS = ("forward_dynamics", "inverse_dynamics", "mass_matrix")


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("compiled") / "cache"


@pytest.fixture(scope="module")
def compiled(cache):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        return load("iiwa14").compile(dtypes=["float64"], cache=cache), load("iiwa14")


def test_answers_are_those_of_the_loops(compiled):
    robot, loops = compiled
    for count in (None, 50):
        q, qd, tau = loops.random_state(1, count)
        for name, given in (("forward_dynamics", (q, qd, tau)), ("inverse_dynamics", (q, qd, tau)), ("bias", (q, qd)),
                            ("gravity", (q,)), ("mass_matrix", (q,)), ("diagonal", (q,))):
            ours, theirs = (getattr(one, name)(*given, status=True) for one in (robot, loops))
            np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-9, atol=1e-9)
            np.testing.assert_array_equal(ours[1]["status"], theirs[1]["status"])
            np.testing.assert_array_equal(ours[1]["rung"], theirs[1]["rung"])


def test_says_what_was_compiled(compiled, cache):
    robot, loops = compiled
    assert loops.compiled == ()
    assert len(robot.compiled) == len(TASKS)
    for line in robot.compiled:
        assert line.startswith("float64 ") and "generated code" in line and str(cache) in line
    assert stat.S_IMODE(cache.stat().st_mode) == 0o700


def test_code_stands_where_others_may_read_what_programs_keep(tmp_path, monkeypatch):
    """They make kalmarm/ for truth, with a mode of 0755."""
    monkeypatch.delenv("KALMARM_CACHE", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    kept = tmp_path / "kalmarm"
    kept.mkdir(mode=0o755)
    robot = load("iiwa14").compile(["mass_matrix"], dtypes=["float64"])
    (line,) = robot.compiled
    assert "generated code" in line and str(kept / "code") in line
    assert stat.S_IMODE((kept / "code").stat().st_mode) == 0o700


def test_what_is_made_of_factors(cache):
    tasks = ("inverse_mass_matrix", "diagonal", "solve")
    robot, loops = load("panda").compile(tasks, dtypes=["float64"], cache=cache), load("panda")
    assert all("generated code" in line for line in robot.compiled) and len(robot.compiled) == len(tasks)
    for count in (None, 50):
        q, _, tau = loops.random_state(2, count)
        for name, given in (("inverse_mass_matrix", (q,)), ("diagonal", (q,)), ("solve", (q, tau))):
            ours, theirs = (getattr(one, name)(*given, status=True) for one in (robot, loops))
            np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-8, atol=1e-9)
            np.testing.assert_array_equal(ours[1]["status"], theirs[1]["status"])


def test_derivatives(cache):
    robot, loops = load("iiwa14").compile(["forward_dynamics_derivatives"], dtypes=["float64"], cache=cache), load("iiwa14")
    assert len(robot.compiled) == 1 and "generated code" in robot.compiled[0]
    states = loops.random_state(3, 40)
    for ours, theirs in zip(*(one.forward_dynamics_derivatives(*states) for one in (robot, loops))):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9 * np.abs(theirs).max())


def test_rows_of_float32(cache):
    robot = load("iiwa14").compile(["forward_dynamics"], dtypes=["float32"], cache=cache)
    assert len(robot.compiled) == 1
    q, qd, tau = robot.random_state(1, 50, dtype=np.float32)
    a, outcomes = robot.forward_dynamics(q, qd, tau, status=True)
    assert a.dtype == np.float32 and np.any(outcomes["rung"] == kalmarm.Rung.FLOAT_LANES)
    exact = robot.forward_dynamics(*(x.astype(np.float64) for x in (q, qd, tau)))
    assert np.all(np.linalg.norm(a - exact, axis=1) <= 1e-2 * np.linalg.norm(exact, axis=1))


def test_goes_to_other_processes_and_to_other_questions(compiled):
    robot, _ = compiled
    assert len(pickle.loads(pickle.dumps(robot)).compiled) == len(TASKS)
    assert len(robot.replace(wants=["mass"]).compiled) == 1
    locked = robot.replace(locked=[robot.dofs[2]])
    assert all("generated code" in line for line in locked.compiled)
    q = locked.random_state(1).q
    np.testing.assert_allclose(
        locked.mass_matrix(q), load("iiwa14", locked=[robot.dofs[2]]).mass_matrix(q), rtol=1e-12, atol=1e-12
    )


@pytest.mark.parametrize(
    "options, why",
    [
        ({"compiler": "/no/compiler"}, "/no/compiler"),
        ({"compiler": ["false"]}, "false failed"),
        ({"compiler": ["sleep", "1000"], "timeout": 0.2}, "sleep"),
        ({"cache": "/proc/kalmarm"}, "/proc/kalmarm"),
    ],
)
def test_the_loops_answer_and_it_says_so(options, why, cache, iiwa):
    with pytest.warns(RuntimeWarning, match="loops answer") as told:
        robot = iiwa.compile(dtypes=["float64"], **({"cache": cache} | options))
    assert len(told) == 1 and why in str(told[0].message) and "\n" not in str(told[0].message)
    state = iiwa.random_state(1)
    np.testing.assert_array_equal(robot.forward_dynamics(*state), iiwa.forward_dynamics(*state))


def test_names_what_is_wrong(iiwa):
    with pytest.raises(ValueError, match="tasks 'inverse' is unknown: forward_dynamics"):
        iiwa.compile(["inverse"])
    with pytest.raises(TypeError, match="tasks is a string"):
        iiwa.compile("mass_matrix")
    with pytest.raises(ValueError, match="dtypes 'int64' is unknown"):
        iiwa.compile(dtypes=[int])
