"""`kalmarm.check` of answers whose error is known, of other engines' answers, and the truth of `kalmarm.testing`."""

import hashlib
import pickle

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import file_of, load

import kalmarm
from kalmarm import testing
from kalmarm.testing import assert_forward_dynamics, assert_inverse_dynamics, mechanisms

RIGHT, WRONG, UNKNOWN = kalmarm.Verdict


@pytest.mark.parametrize("size", [1e-14, 1e-10, 1e-6, 1e-2, 1.0])
def test_error_of_a_spoiled_answer_is_that_of_the_energy_norm(name, size):
    robot = load(name)
    q, qd, tau = robot.random_state(0, 20)
    a = robot.replace(tolerance=kalmarm.last_bits).forward_dynamics(q, qd, tau)
    da = size * np.random.default_rng(1).standard_normal(a.shape) * np.linalg.norm(a, axis=1, keepdims=True)
    da = (a + da) - a  # as it is rounded
    M = robot.mass_matrix(q)
    energy = np.sqrt(np.einsum("ri,rij,rj->r", da, M, da) / np.einsum("ri,rij,rj->r", a, M, a))
    checked = kalmarm.check(robot, q, qd, tau, a + da, tolerance=size)
    np.testing.assert_allclose(checked.error, energy, rtol=0.1)
    np.testing.assert_allclose(checked.euclid, np.linalg.norm(da, axis=1) / np.linalg.norm(a, axis=1), rtol=0.1)
    assert (kalmarm.check(robot, q, qd, tau, a + da, tolerance=2 * checked.euclid.max() + 2 * energy.max()).verdict == RIGHT).all()
    assert (kalmarm.check(robot, q, qd, tau, a + da, tolerance=0.9 * energy.min()).verdict == WRONG).all()


def test_other_engines_and_float32_have_the_errors_that_their_precision_has():
    robot = load("panda")
    model = mujoco.MjModel.from_xml_path(str(file_of("panda")))
    data = mujoco.MjData(model)
    arm = pin.buildModelFromMJCF(str(file_of("panda")))
    arm_data = arm.createData()
    q, qd, tau = robot.random_state(3, 100)
    of_mujoco, of_pinocchio, effective = np.empty_like(qd), np.empty_like(qd), tau.copy()
    for i in range(len(q)):
        data.qpos, data.qvel, data.qfrc_applied = q[i], qd[i], tau[i]
        mujoco.mj_forward(model, data)
        of_mujoco[i] = data.qacc
        effective[i] += data.qfrc_passive + data.qfrc_actuator + data.qfrc_constraint
        of_pinocchio[i] = pin.aba(arm, arm_data, q[i], qd[i], tau[i])
    for answers, torques in ((of_mujoco, effective), (of_pinocchio, tau)):
        checked = kalmarm.check(robot, q, qd, torques, answers, tolerance=1e-12)
        assert (checked.verdict == RIGHT).all() and checked.error.max() < 1e-13
        checked = kalmarm.check(robot, q, qd, torques, answers.astype(np.float32))
        assert (checked.verdict == RIGHT).all() and 1e-9 < checked.error.min() and checked.error.max() < 1e-6


def test_torques_solves_mass_matrices_and_inverses_are_checked():
    robot = load("go2")
    q, qd, tau = robot.random_state(5, 10)
    answers = {
        "torques": lambda e: {"qd": qd, "qdd": tau, "tau": robot.inverse_dynamics(q, qd, tau) * (1 + e)},
        "solve": lambda e: {"tau": tau, "x": robot.solve(q, tau) * (1 + e)},
        "mass": lambda e: {"mass": robot.mass_matrix(q) * (1 + e)},
        "inverse": lambda e: {"inverse": robot.inverse_mass_matrix(q) * (1 + e)},
    }
    for what, answer in answers.items():
        right, wrong = kalmarm.check(robot, q, **answer(0.0)), kalmarm.check(robot, q, **answer(1e-3))
        assert (right.verdict == RIGHT).all() and right.error.max() < 1e-12, what
        assert (wrong.verdict == WRONG).all(), what
        np.testing.assert_allclose(wrong.error, 1e-3, rtol=1e-3, err_msg=what)


def test_shapes_threads_and_copies_make_no_difference():
    robot = load("iiwa14")
    q, qd, tau = robot.random_state(0, 300)
    a = robot.forward_dynamics(q, qd, tau)
    one = kalmarm.AnswerCheck(robot, tolerance=1e-9)
    rows = one.check(q, qd, tau, a, threads=0)
    shaped = pickle.loads(pickle.dumps(one)).check(*(x.reshape(3, 100, -1) for x in (q, qd, tau, a)))
    assert shaped.error.shape == shaped.outcome.shape == (3, 100)
    np.testing.assert_array_equal(shaped.error.ravel(), rows.error)
    single = one.check(q[7], qd[7], tau[7], a[7])
    assert single.error.shape == () and single.error == rows.error[7] and single.verdict == RIGHT


def test_what_cannot_be_checked_says_so():
    robot = load("iiwa14")
    q, qd, tau = robot.random_state(0, 2)
    a = robot.forward_dynamics(q, qd, tau)
    a[0, 2] = np.nan
    q[1, 0] = np.inf
    checked = kalmarm.check(robot, q, qd, tau, a)
    assert checked.verdict.tolist() == [WRONG, UNKNOWN] and checked.error[0] == np.inf
    assert checked.outcome["status"][1] == kalmarm.Status.NOT_FINITE
    for call, error, text in (
        (lambda: kalmarm.check(robot, q, qd, tau), TypeError, "one answer is needed"),
        (lambda: kalmarm.check(robot, q, tau=tau, a=a), TypeError, "a needs qd"),
        (lambda: kalmarm.check(robot, q, qd, mass=np.eye(7)), TypeError, "mass is checked without qd"),
        (lambda: kalmarm.check(robot, q, mass=np.ones(7)), ValueError, r"\(\.\.\., nv, nv\) is needed"),
        (lambda: kalmarm.check(robot, q, qd, tau, a[:, :6]), ValueError, "the answer"),
        (lambda: kalmarm.check(robot, q, qd, tau, a, tolerance=0), ValueError, "tolerance"),
        (lambda: kalmarm.check(robot.replace(locked=[robot.dofs[0]]), q, qd, tau, a), ValueError, "locked"),
    ):
        with pytest.raises(error, match=text):
            call()


# --- kalmarm.testing


def kalmarm_engine(mechanism, tolerance=None):
    return kalmarm.load(mechanism.mjcf, tolerance=tolerance).forward_dynamics


def test_dataset_is_what_its_checksums_say():
    sums = dict(reversed(line.split("  ")) for line in (testing.FOLDER / "SHA256SUMS").read_text().splitlines())
    files = {path.name: path for path in testing.FOLDER.iterdir() if path.suffix in (".json", ".xml", ".urdf")}
    assert sums.keys() == files.keys() and len(mechanisms()) >= 8
    for name, path in files.items():
        assert hashlib.sha256(path.read_bytes()).hexdigest() == sums[name]
    assert sum(path.stat().st_size for path in files.values()) < 1_000_000


@pytest.mark.parametrize("mechanism", mechanisms(), ids=str)
def test_truth_is_what_the_last_bits_are(mechanism):
    assert_forward_dynamics(lambda m: kalmarm_engine(m, kalmarm.last_bits), 1e-14, [mechanism])
    assert_inverse_dynamics(lambda m: kalmarm.load(m.mjcf).inverse_dynamics, 1e-12, [mechanism])


@pytest.mark.parametrize("mechanism", mechanisms("panda", "g1"), ids=str)
def test_checks_agree_with_the_truth(mechanism):
    robot = kalmarm.load(mechanism.mjcf)
    a = robot.forward_dynamics(mechanism.q, mechanism.qd, mechanism.tau)
    checked = kalmarm.check(robot, mechanism.q, mechanism.qd, mechanism.tau, a)
    np.testing.assert_allclose(checked.euclid, testing.errors(a, mechanism.a), rtol=0.1)
    tau = robot.inverse_dynamics(mechanism.q, mechanism.qd, mechanism.qdd)
    checked = kalmarm.check(robot, mechanism.q, mechanism.qd, tau, qdd=mechanism.qdd)
    np.testing.assert_allclose(checked.error, testing.errors(tau, mechanism.torques), rtol=0.1)


def test_wrong_engines_are_told_where():
    def engine(mechanism):
        return lambda *state: kalmarm_engine(mechanism)(*state) * (1 + 1e-6 * (mechanism.name == "panda"))

    with pytest.raises(AssertionError, match=r"wrong by more than 1e-07:\n  panda: 8 of 8 states, worst 1.00e-06"):
        assert_forward_dynamics(engine, 1e-7, mechanisms("panda", "ur10e"))
    with pytest.raises(ValueError, match="'pandas' is unknown: chain_31"):
        mechanisms("pandas")
