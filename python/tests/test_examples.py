"""The programs of python/examples: what they find, and that they print what docs/jax-and-torch.md says."""

import contextlib
import importlib
import io
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import kalmarm

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/jax-and-torch.md").read_text()
IDENTIFY = ROOT / "build/bin/identify"
NUMBER = re.compile(r"[-+]?\d[\d.]*(e[-+]\d+)?")


def ran(name):
    """The program, what it prints and what its main returns."""
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.syspath_prepend(ROOT / "python/examples")
        program = importlib.import_module(name)
        result = program.main()
    return program, printed.getvalue(), result


def on_page(name):
    return re.search(rf"{name}\.py.*?^```text\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[1]


def within(count):
    """A sum of squares of `count` standard normal numbers, or fewer, is below it: mean and 4 standard deviations."""
    return count + 4 * np.sqrt(2 * count)


class Identified:
    """The arm of identify_masses, and distances of parameters in its torques, whose noise has the size 1."""

    def __init__(self):
        pytest.importorskip("jax")
        self.program, self.printed, (self.robot, self.data, self.found) = ran("identify_masses")
        kinematics = self.robot.kinematics(bodies=self.program.BODIES)
        Y = kinematics.compute(["regressor"], *self.data.motion)["regressor"]
        self.Y = Y.reshape(-1, self.found.size) / self.program.NOISE
        self.rank = np.linalg.matrix_rank(self.Y)

    def apart(self, one, other):
        return np.sum((self.Y @ (one - other).ravel()) ** 2)


@pytest.fixture(scope="module")
def identified():
    return Identified()


def test_no_mass_of_so101_is_seen_by_itself(identified):
    assert identified.rank == 36  # base parameters of 60
    seen = np.linalg.svd(identified.Y, full_matrices=False)[2][: identified.rank]
    masses = seen[:, ::10]  # of unit vectors along the masses, what the motion sees
    assert np.all(np.linalg.norm(masses, axis=0) < 0.2)


def test_descent_in_jax_finds_what_the_noise_leaves_of_the_truth(identified):
    """As does the closed form, linear least squares, of whose errors the sum of squares is that of 36 normal numbers."""
    own = identified.robot.parameters(identified.program.BODIES)
    missed = identified.data.torques - identified.program.torques(identified.robot, own, identified.data.motion)
    right = missed.ravel() / identified.program.NOISE
    closed = own + np.linalg.lstsq(identified.Y, right, rcond=1e-9)[0].reshape(own.shape)
    assert identified.apart(closed, identified.data.truth) < within(identified.rank)
    assert identified.apart(identified.found, identified.data.truth) < within(identified.rank)
    assert identified.apart(own, identified.data.truth) > 1e6
    assert identified.apart(identified.found, closed) < within(identified.rank)


@pytest.mark.skipif(not IDENTIFY.exists(), reason="scripts/build identify builds it")
def test_descent_in_jax_finds_what_ceres_finds(identified, tmp_path):
    robot, (_, motion, torques) = identified.robot, identified.data
    names = ["time", *(f"{one}:{dof}" for one in ("q", "qd", "qdd", "tau") for dof in robot.dofs)]
    rows = np.hstack([np.linspace(0, 10, len(torques))[:, None], *motion, torques])
    header = ",".join(names)
    np.savetxt(tmp_path / "motion.csv", rows, "%.17g", ",", header=header, comments="")
    files = ["--data", tmp_path / "motion.csv", "--hold-out", "0.01", "--out", tmp_path / "fitted.xml"]
    subprocess.run([IDENTIFY, identified.program.FILE, *files], check=True, capture_output=True)
    ceres = kalmarm.load(tmp_path / "fitted.xml").parameters(identified.program.BODIES)
    assert identified.apart(ceres, identified.data.truth) < within(identified.rank)
    assert identified.apart(identified.found, ceres) < within(identified.rank)


@pytest.fixture(scope="module")
def swing():
    pytest.importorskip("jax")
    return ran("ilqr")


def test_ilqr_lowers_the_cost_in_every_iteration(swing):
    _, _, (_, _, costs) = swing
    assert len(costs) > 5 and np.all(np.diff(costs) < 0)


def test_ilqr_brings_the_hand_to_its_pose_within_a_millimetre(swing):
    """Where the commands lead in float64 steps of the robot's own calls, with torques within their limits."""
    program, _, (_, u, _) = swing
    q, qd = program.HOME, np.zeros(program.N)
    torques = program.LIMIT * np.tanh(u)
    assert np.all(np.abs(torques) < program.LIMIT)
    for tau in torques:
        qd = qd + program.H * program.ROBOT.forward_dynamics(q, qd, tau)
        q = q + program.H * qd
    points = program.POINTS.compute(["positions"], q)["positions"]
    assert np.linalg.norm(points - program.GOAL, axis=-1).max() < 1e-3
    assert np.abs(qd).max() < 1e-3


def test_ilqr_ends_where_the_gradient_leads_no_further(swing):
    """jax.grad through the whole swing, against the recursion: the best step along it lowers the cost by less than 1e-5 of
    it; at the start by half."""
    import jax

    program, _, (x, u, costs) = swing
    K = np.zeros((*u.shape, x.shape[1]))

    def lowered(x, u, cost):
        v = program.terminal(x[-1])[1]

        def along(k):
            states, _, way = program.forward(np.ones(1), x, u, k, K)
            return way[0] + v @ states[0, -1]

        ahead = -jax.grad(along)(np.zeros_like(u))
        states, _, way = program.forward(np.logspace(-8, 2, 101), x, u, ahead, K)
        return 1 - np.nanmin(way + program.terminal(np.asarray(states[:, -1]))[0]) / cost

    hold = np.tile(np.arctanh(program.ROBOT.gravity(program.HOME) / program.LIMIT), (len(u), 1))
    rest = np.tile(program.REST, (len(x), 1))
    assert lowered(rest, hold, costs[0]) > 0.5
    assert -1e-9 < lowered(x, u, costs[-1]) < 1e-5


@pytest.fixture(scope="module")
def held():
    pytest.importorskip("torch")
    return ran("payload_estimation")


def test_payload_is_found_to_the_noise(held):
    """(theta - truth)' C^-1 (theta - truth) of one experiment is a sum of squares of 4 standard normal numbers: torques are
    linear in (m, m c, moments) and by far nearly so in theta, within its errors of a millimetre and a gram."""
    program, _, (robot, moved, _) = held
    truth = np.array([program.MASS, *program.CENTER])
    total, count = 0.0, 5
    for seed in range(count):
        theta, covariance = program.estimate(robot, moved, program.measure(robot, moved, seed))
        far = theta.numpy() - truth
        total += far @ np.linalg.solve(covariance.numpy(), far)
        deviations = np.sqrt(np.diag(covariance.numpy()))
        assert deviations[0] < 2e-3 and np.all(deviations[1:] < 1e-3)
    assert within(4 * count) > total > 4 * count - 3 * np.sqrt(8 * count)


@pytest.mark.parametrize("fixture", ["identified", "swing", "held"])
def test_program_prints_what_the_page_says(fixture, request):
    """But for the digits of numbers, which are another processor's."""
    result = request.getfixturevalue(fixture)
    name, printed = (
        (result.program.__name__, result.printed) if fixture == "identified" else (result[0].__name__, result[1])
    )
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", on_page(name))


def test_every_program_has_a_test():
    programs = {path.stem for path in (ROOT / "python/examples").glob("*.py")}
    assert programs == {"identify_masses", "ilqr", "payload_estimation"}
