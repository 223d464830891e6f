"""Constraints: loops of files and of JSON, exact and soft; what is refused."""

import json
import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from conftest import ROBOTS, load

import kalmarm
from kalmarm import Constraint, ConstrainedDynamics, Status

LOOPS = ROBOTS / "loops"


@pytest.fixture(scope="module")
def cassie():
    return load("cassie", takes_constraints=True)


def states(robot, closed, count):
    """Near where the robot starts, with velocities that its constraints allow."""
    rng = np.random.default_rng(3)
    q = np.broadcast_to(robot.q0, (count, robot.nq))
    qd = closed.impulse(q, rng.standard_normal((count, robot.nv))).qd
    return q, qd, rng.standard_normal((count, robot.nv))


def exactly(robot):
    return [Constraint(one.name, one.kind, one.first, one.second) for one in robot.constraints]


def test_cassie_closed_accelerates_as_its_rods_allow(cassie):
    closed = ConstrainedDynamics(cassie, exactly(cassie), proximal=1e-8)
    assert closed.rows == 12
    q, qd, tau = states(cassie, closed, 5)
    (a, forces), outcomes = closed.forward_dynamics(q, qd, tau, status=True)
    assert (outcomes["status"] == Status.OK).all() and outcomes["error"].max() < 1e-9
    error, rate, J = closed.evaluate(q, qd)
    assert np.abs(error).max() < 1e-12 and np.abs(rate).max() < 1e-12
    torques = cassie.inverse_dynamics(q, qd, a)
    lacking = np.einsum("nij,ni->nj", J, forces)
    assert np.abs(torques - tau - lacking).max() < 1e-9 * np.abs(torques).max()
    # e'' by differences of e' along the motion
    h = 1e-6
    ahead, behind = (
        closed.evaluate(cassie.integrate(q, t * qd + t * t / 2 * a), qd + t * a).rate
        for t in (h, -h)
    )
    assert np.abs(ahead - behind).max() / (2 * h) < 1e-5 * np.abs(a).max()


def test_one_state_and_rows_and_threads_and_dtypes_agree(cassie):
    closed = ConstrainedDynamics(cassie)  # as soft as the file has them
    q, qd, tau = states(cassie, closed, 70)
    many = closed.forward_dynamics(q, qd, tau)
    again = closed.forward_dynamics(q[0], qd, tau, threads=2)
    np.testing.assert_array_equal(many.a, again.a)
    one = closed.forward_dynamics(q[3], qd[3], tau[3])
    assert one.a.shape == (cassie.nv,) and one.forces.shape == (12,)
    assert np.linalg.norm(one.a - many.a[3]) < 1e-9 * np.linalg.norm(one.a)
    narrow = [x.astype(np.float32) for x in (q, qd, tau)]
    assert closed.solve(q, tau).x.shape == (70, cassie.nv)
    assert closed.impulse(*narrow[:2]).qd.dtype == np.float32


@pytest.mark.parametrize("axes", ["aligned", "world", "local"])
def test_forces_from_outside_accelerate_closed_cassie_as_mujocos_do(axes):
    mujoco = pytest.importorskip("mujoco")
    path = ROBOTS / "cassie" / "cassie.xml"
    pushed = ["cassie-pelvis", "left-foot"]
    robot = load("cassie", takes_constraints=True, acted_on=pushed)
    closed = ConstrainedDynamics(robot)
    model = mujoco.MjModel.from_xml_path(str(path))
    off = mujoco.mjtDisableBit
    model.opt.disableflags |= (
        off.mjDSBL_CONTACT | off.mjDSBL_LIMIT | off.mjDSBL_FRICTIONLOSS | off.mjDSBL_SPRING
        | off.mjDSBL_DAMPER | off.mjDSBL_ACTUATION | off.mjDSBL_WARMSTART
    )  # fmt: skip
    model.opt.solver, model.opt.tolerance, model.opt.iterations = mujoco.mjtSolver.mjSOL_NEWTON, 0, 50
    data = mujoco.MjData(model)
    q, qd, tau = states(robot, closed, 3)
    forces = 30 * np.random.default_rng(5).standard_normal((3, 2, 6))
    answer = closed.forward_dynamics(q, qd, tau, forces=forces.reshape(3, 12), axes=axes)
    for i in range(3):
        data.qpos, data.qvel, data.qfrc_applied = q[i], qd[i], tau[i]
        mujoco.mj_kinematics(model, data)
        data.xfrc_applied[:] = 0
        for name, (*moment, x, y, z) in zip(pushed, forces[i]):
            body = model.body(name).id
            R, p = data.xmat[body].reshape(3, 3), data.xpos[body]
            if axes == "local":
                moment, (x, y, z) = R @ moment, R @ (x, y, z)
            origin = np.zeros(3) if axes == "world" else p
            about_com = moment + np.cross(origin - data.xipos[body], (x, y, z))
            data.xfrc_applied[body] = (x, y, z, *about_com)
        mujoco.mj_forward(model, data)
        assert np.linalg.norm(answer.a[i] - data.qacc) < 1e-9 * np.linalg.norm(data.qacc)
    one = closed.forward_dynamics(q[1], qd[1], tau[1], forces=forces[1].ravel(), axes=axes)
    assert np.linalg.norm(one.a - answer.a[1]) < 1e-9 * np.linalg.norm(one.a)


def test_forces_need_frames_that_are_acted_on(cassie):
    q, qd, tau = states(cassie, ConstrainedDynamics(cassie), 1)
    with pytest.raises(ValueError, match="acted_on"):
        ConstrainedDynamics(cassie).forward_dynamics(q, qd, tau, forces=np.zeros(6))


def test_soft_rows_add_their_inertia(cassie):
    soft = [
        Constraint(one.name, one.kind, one.first, one.second, compliance=(0, 0.01))
        for one in cassie.constraints
    ]
    held = ConstrainedDynamics(cassie, soft)
    b = np.random.default_rng(1).standard_normal(cassie.nv)
    J = held.evaluate(cassie.q0).jacobian
    H = cassie.mass_matrix(cassie.q0) + 100 * J.T @ J
    x, forces = held.solve(cassie.q0, b)
    assert np.linalg.norm(H @ x - b) < 1e-10 * np.linalg.norm(b)
    assert np.linalg.norm(100 * J @ x + forces) < 1e-6 * np.linalg.norm(forces)


def test_rows_that_repeat_each_other_are_refused_by_name_or_shared(cassie):
    q, qd, tau = states(cassie, ConstrainedDynamics(cassie), 1)
    once = ConstrainedDynamics(cassie, exactly(cassie))
    with pytest.raises(kalmarm.DynamicsError, match="singular at 'left-plantar-rod-left-foot'"):
        once.forward_dynamics(q[0], qd[0], tau[0])
    answer, outcomes = once.forward_dynamics(q, qd, tau, status=True)
    assert outcomes["joint"][0] == cassie.nv and np.isnan(answer.a).all()


@pytest.mark.parametrize("name, rows", [("four_bar", 3), ("gripper", 7), ("stewart", 18)])
def test_shipped_loops_are_closed_at_home(name, rows):
    robot = kalmarm.load(LOOPS / f"{name}.xml", takes_constraints=True)  # without a warning
    closed = ConstrainedDynamics(robot, proximal=1e-8)
    assert closed.rows == rows
    assert np.abs(closed.evaluate(robot.q0).error).max() < 1e-9
    a = closed.forward_dynamics(robot.q0, np.zeros(robot.nv), np.zeros(robot.nv)).a
    assert np.isfinite(a).all()


def test_files_name_their_constraints_unless_they_are_taken():
    with pytest.warns(UserWarning, match="ignored: 1 connect constraint"):
        robot = kalmarm.load(LOOPS / "four_bar.xml")
    assert robot.constraints == ()
    with pytest.raises(ValueError, match="no constraint"):
        ConstrainedDynamics(robot)


def test_loops_of_a_json_file_are_those_of_frames_and_joints(tmp_path):
    robot = kalmarm.load(LOOPS / "four_bar.xml", takes_constraints=True)
    file = tmp_path / "loops.json"
    listed = [
        {"name": "pin", "first": {"frame": "coupler", "translation": [0.42, 0, 0.56]},
         "second": {"frame": "rocker", "translation": [0.12, 0, 0.56]}},
        {"name": "gear", "kind": "coupling", "joints": {"crank": 1, "rocker": -0.5}},
    ]  # fmt: skip
    file.write_text(json.dumps({"constraints": listed}))
    with pytest.warns(UserWarning):
        given = kalmarm.load(LOOPS / "four_bar.xml", constraints=file)
    assert [one.name for one in given.constraints] == ["pin", "gear"]
    ours = ConstrainedDynamics(given, given.constraints[:1]).evaluate(robot.q0 + 0.1)
    theirs = ConstrainedDynamics(robot).evaluate(robot.q0 + 0.1)
    np.testing.assert_allclose(ours.error, theirs.error, atol=1e-9)
    np.testing.assert_allclose(ours.jacobian, theirs.jacobian, atol=1e-9)
    e = ConstrainedDynamics(given).evaluate(given.q0).error
    assert e[-1] == pytest.approx(given.q0[0] - 0.5 * given.q0[2])


@pytest.mark.parametrize(
    "text, why",
    [
        ("{", "line 1: a name in quotes is needed"),
        ('{"constraints": [{"first": "a"}]}', "constraint 0 has no name"),
        ('{"constraints": [{"name": "a", "frist": "a"}]}', "constraint 'a': field 'frist' is unknown"),
        ('{"constraints": [{"name": "a", "first": "rode"}]}', "frame 'rode' is unknown"),
    ],
)
def test_bad_files_of_constraints_are_refused_in_one_line(tmp_path, text, why):
    file = tmp_path / "loops.json"
    file.write_text(text)
    with pytest.raises(ValueError, match=why) as caught:
        kalmarm.load(LOOPS / "four_bar.xml", constraints=file)
    assert f"{file}: " in str(caught.value) and "\n" not in str(caught.value)


def test_loops_of_a_json_file_are_those_of_models_of_mujoco_too(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    file = tmp_path / "loops.json"
    file.write_text('{"constraints": [{"name": "pin", "first": "coupler", "second": "rocker"}]}')
    model = mujoco.MjModel.from_xml_path(str(LOOPS / "four_bar.xml"))
    with pytest.warns(UserWarning, match="open at home .*'pin' by"):
        robot = kalmarm.from_mujoco(model, constraints=file)
    assert [one.name for one in robot.constraints] == ["pin"]


@pytest.mark.parametrize(
    "wrong, why",
    [
        ({"first": "rode"}, "frame 'rode' is unknown"),
        ({"kind": "ball"}, "kind 'ball' is unknown"),
        ({"first": "crank", "second": "crank"}, "both frames are on link 0"),
        ({"first": "crank", "stiffness": -1.0}, "stiffness -1"),
        ({"kind": "coupling", "joints": {"cranck": 1}}, "joint 'cranck' is unknown"),
    ],
)
def test_bad_constraints_are_refused_with_their_name(wrong, why):
    robot = kalmarm.load(LOOPS / "four_bar.xml", takes_constraints=True)
    with pytest.raises(ValueError, match=why) as caught:
        ConstrainedDynamics(robot, [Constraint("loop", **wrong)])
    assert "loop" in str(caught.value) or "cranck" in str(caught.value)


def test_copies_answer_alike(cassie):
    closed = ConstrainedDynamics(cassie, proximal=1e-8)
    copy = pickle.loads(pickle.dumps(closed))
    q, qd, tau = states(cassie, closed, 2)
    np.testing.assert_array_equal(
        closed.forward_dynamics(q, qd, tau).a, copy.forward_dynamics(q, qd, tau).a
    )
    assert "left-plantar-rod-left-foot" in repr(copy)


def test_examples_of_the_page_run(monkeypatch):
    page = Path(__file__).parents[2] / "docs" / "contacts.md"
    monkeypatch.chdir(page.parents[1])
    names = {}
    for code in re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)
            exec(compile(code, str(page), "exec"), names)
    robot, standing = names["robot"], names["standing"]
    error = standing.evaluate(robot.q0, np.zeros(robot.nv)).error
    assert np.abs(error).max() < 1e-12
    assert 0 < names["weight"] < 9.81 * robot.kinematics([]).mass
    assert 2 * names["by_H"] < names["by_M"] < names["by_diagonal"] / 5
