"""Implicit steps: MuJoCo's own, one state or rows, terms of a file, forces, refusals."""

import warnings

import mujoco
import numpy as np
import pytest
from conftest import load, relative

import kalmarm

H = 0.002
SCHEMES = {
    "springs_at_end": mujoco.mjtIntegrator.mjINT_DISCRETE,
    "springs_at_start": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
}
ARM = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody>
 <body gravcomp=".8"><joint name="a" axis="0 1 0" damping=".4" stiffness="30" springref=".3"/>
  <site name="s" pos=".1 -.05 .2"/><inertial pos=".1 -.05 .2" mass="1.3" diaginertia=".03 .04 .05"/>
  <body pos="0 .1 .4"><joint name="b" type="slide" axis="1 0 1" damping="2"/>
   <site name="t" pos=".1 0 .1"/><inertial pos=".1 0 .1" mass=".7" diaginertia=".03 .04 .05"/>
   <body pos="0 0 .2"><joint name="c" type="ball" damping=".1"/>
    <site name="u" pos=".1 0 .1"/><inertial pos=".1 0 .1" mass=".4" diaginertia=".01 .02 .02"/>
   </body></body></body>
 </worldbody>
 <actuator><position name="p" joint="a" gear="2" kp="2e4" dampratio="1"/>
  <motor name="m" joint="b" gear="3" damping=".2"/>
  <general name="g" joint="b" gaintype="affine" gainprm="7 -300 -4" biastype="affine"
   biasprm="1 -90 -2"/>
  {}</actuator>
 <keyframe><key name="k" ctrl=".4 7 .5 {}"/></keyframe></mujoco>"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format("", ""))
    return path


def stepped_by_mujoco(model, integrator, state, ctrl, applied=None):
    model.opt.integrator = integrator
    model.opt.timestep = H
    model.opt.iterations, model.opt.tolerance = 1000, 1e-15  # of discrete, beside tendons
    model.opt.disableflags |= (
        mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    )
    out = []
    for i, (q, qd, tau) in enumerate(zip(*state, strict=True)):
        data = mujoco.MjData(model)
        data.qpos, data.qvel, data.qfrc_applied, data.ctrl = q, qd, tau, ctrl
        if applied is not None:
            data.xfrc_applied[1:] = applied[i]
        mujoco.mj_step(model, data)
        out.append((data.qpos.copy(), data.qvel.copy()))
    return [np.array(x) for x in zip(*out, strict=True)]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_steps_of_a_file_are_those_of_mujoco(arm, scheme):
    robot = kalmarm.load(arm, key="k", controls={"m": 5}, takes_steps=True)
    assert robot.notes == ()
    assert [one.control for one in robot.terms.actuators] == [0.4, 5, 0.5]
    state = robot.random_state(1, 20)
    q, qd = stepped_by_mujoco(
        mujoco.MjModel.from_xml_path(str(arm)), SCHEMES[scheme], state, [0.4, 5, 0.5]
    )
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    ours = step(*state)
    assert relative(ours.q, q) < 1e-12
    assert relative(ours.qd, qd) < 1e-12
    assert relative(ours.a, (qd - state.qd) / H) < 1e-9


@pytest.mark.parametrize("scheme", SCHEMES)
def test_controls_of_states_step_as_mujocos(arm, scheme):
    """Beyond their limits too, of a gain by length and velocity too."""
    arm.write_text(arm.read_text().replace('gear="3"', 'gear="3" ctrlrange="-1 2"'))
    robot = kalmarm.load(arm, key="k", takes_steps=True)
    model = mujoco.MjModel.from_xml_path(str(arm))
    state = robot.random_state(1, 20)
    u = np.random.default_rng(2).uniform(0, 3, (20, 3))
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    truth = [
        stepped_by_mujoco(model, SCHEMES[scheme], [x[i : i + 1] for x in state], u[i])
        for i in range(20)
    ]
    ours = step(*state, ctrl=u)
    assert relative(ours.q, np.concatenate([q for q, _ in truth])) < 1e-12
    assert relative(ours.qd, np.concatenate([qd for _, qd in truth])) < 1e-12
    for own in (
        step(*(x[3] for x in state), ctrl=u[3]),
        kalmarm.ImplicitStep(robot, H, scheme=scheme, ctrl=u[3])(*(x[3] for x in state)),
    ):
        np.testing.assert_allclose(own.qd, ours.qd[3], rtol=1e-12)
    q, qd = stepped_by_mujoco(model, SCHEMES[scheme], state, [0.5, 0.5, 0.5])
    assert relative(step(*state, ctrl=0.5).qd, qd) < 1e-12
    with pytest.raises(ValueError, match=r"ctrl has shape \(2,\), \(\.\.\., 3\) is needed"):
        step(*state, ctrl=[1, 2])


LIMITS = {
    "of a spring": ('joint="a" gear="2"', 'joint="a" gear="-2" forcerange="-30 50"'),
    "of a motor": ('gear="3"', 'gear="3" forcerange="-2 5"'),
    "of a joint": ('<joint name="b"', '<joint name="b" actuatorfrcrange="-20 30"'),
}


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", LIMITS)
def test_forces_are_limited_as_mujocos(arm, kind, scheme, dtype):
    was, limited = LIMITS[kind]
    text = arm.read_text()
    assert text.count(was) == 1
    arm.write_text(text.replace(was, limited))
    robot = kalmarm.load(arm, key="k", takes_steps=True)
    assert robot.notes == ()
    model = mujoco.MjModel.from_xml_path(str(arm))
    np.testing.assert_array_equal(
        robot.terms.force_range, kalmarm.from_mujoco(model, takes_steps=True).terms.force_range
    )
    state = robot.random_state(3, 40, dtype=dtype)
    q, qd = stepped_by_mujoco(model, SCHEMES[scheme], state, [0.4, 7, 0.5])
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    ours = step(*state)
    bound = 1e-12 if dtype == np.float64 else 1e-5
    assert relative(ours.qd, qd) < bound
    assert relative(ours.q, q) < bound
    unlimited = kalmarm.ImplicitStep(load_text(arm, text), H, scheme=scheme)(*state)
    differs = np.any(np.abs(unlimited.qd - ours.qd) > 1e-4, axis=1)
    assert 0 < np.count_nonzero(differs)
    for i in range(0, 40, 7):
        np.testing.assert_allclose(step(*(x[i] for x in state)).qd, ours.qd[i], rtol=30 * bound)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_forces_are_limited_beside_tendons(tmp_path, scheme):
    path = tmp_path / "arm.xml"
    text = (
        ARM.format("", ".2 2")
        .replace("<keyframe>", TENDONS)
        .replace('gear="2" kp="2e4"', 'gear="2" kp="2e4" forcerange="-3e4 3e4"')
    )
    assert "forcerange" in text
    path.write_text(text)
    with pytest.warns(UserWarning, match="1 tendon with a dead band"):
        robot = kalmarm.load(path, key="k", takes_steps=True)
    model = mujoco.MjModel.from_xml_path(str(path))
    model.tendon_stiffness[2] = 0  # the dead band
    state = robot.random_state(3, 20)
    q, qd = stepped_by_mujoco(model, SCHEMES[scheme], state, [0.4, 7, 0.5, 0.2, 2])
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    ours, outcomes = step(*state, status=True)
    assert np.all(outcomes["status"] == kalmarm.Status.OK)
    assert relative(ours.qd, qd) < 1e-10
    held = np.abs(2e4 * (0.4 - 2 * state.q[:, 0])) > 3e4
    assert 0 < np.count_nonzero(held) < 20
    for i in (np.flatnonzero(held)[0], np.flatnonzero(~held)[0]):
        np.testing.assert_allclose(step(*(x[i] for x in state)).qd, ours.qd[i], rtol=1e-10)


def load_text(path, text, **options):
    path.write_text(text)
    return kalmarm.load(path, key="k", takes_steps=True, **options)


def test_derivatives_have_the_gravity_that_is_compensated(arm):
    robot = kalmarm.load(arm, key="k", takes_steps=True)
    step = kalmarm.ImplicitStep(robot, H)
    q, qd, tau = robot.random_state(3)
    found = step.derivatives(q, qd, tau)
    np.testing.assert_allclose(found.a, step.acceleration(q, qd, tau), rtol=1e-11)
    e = 1e-5
    for k in range(2):  # of the ball joint q is no vector
        d = np.zeros(robot.nq)
        d[k] = e
        difference = (step.acceleration(q + d, qd, tau) - step.acceleration(q - d, qd, tau)) / (
            2 * e
        )
        np.testing.assert_allclose(found.dq[:, k], difference, atol=1e-7 * np.abs(found.dq).max())
    rows = step.derivatives(q, qd, np.stack([tau, 2 * tau]))
    np.testing.assert_allclose(rows.dq[0], found.dq, rtol=1e-12, atol=1e-9)


def test_a_step_writes_to_out_and_says_what_happened(arm):
    robot = kalmarm.load(arm, key="k", takes_steps=True)
    step = kalmarm.ImplicitStep(robot, H)
    for count in (None, 9):
        state = robot.random_state(0, count)
        fresh, out = step(*state), step(*robot.random_state(1, count))
        again, outcomes = step(*state, out=out, status=True)
        assert np.shape(outcomes) == np.shape(fresh.a)[:-1]
        for one, other, given in zip(again, fresh, out, strict=True):
            assert one is given
            np.testing.assert_array_equal(one, other)
        with pytest.raises(ValueError, match=r"out.q lies in the same memory as q"):
            step(out.q, *state[1:], out=out)
    with pytest.raises(TypeError, match="out is not what an earlier call returned"):
        step(*state, out=out.a)
    q = state.q.copy()
    q[4] = np.nan
    _, outcomes = step(q, state.qd, status=True)
    assert (outcomes["status"] != 0).tolist() == [i == 4 for i in range(9)]


@pytest.mark.parametrize("acting", [False, True], ids=["", "forces"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_rows_are_what_single_states_give(arm, dtype, acting):
    robot = kalmarm.load(arm, takes_steps=True, acted_on=["s", "u"] if acting else [])
    step = kalmarm.ImplicitStep(robot, H)
    state = robot.random_state(2, 21, dtype=dtype)
    forces = np.random.default_rng(3).standard_normal((21, 12)).astype(dtype)
    of_all = {"forces": forces, "axes": "local"} if acting else {}
    rows = step(*state, **of_all)
    for threads in (1, 2):
        np.testing.assert_array_equal(step.acceleration(*state, threads=threads, **of_all), rows.a)
    derivatives = step.derivatives(*state, **of_all)
    for i in range(21):
        own = of_all | {"forces": forces[i]} if acting else {}
        one = step(*(x[i] for x in state), **own)
        assert all(x.dtype == dtype for x in one)
        for x, y in zip(one, rows, strict=True):
            bound = 1e-5 if dtype == np.float32 else 1e-13
            assert np.linalg.norm(x - y[i]) <= bound * np.linalg.norm(x)
        single = step.derivatives(*(x[i] for x in state), **own)
        for x, y in zip(single, derivatives, strict=True):
            np.testing.assert_array_equal(x, y[i])


@pytest.mark.parametrize("force", [None, [30.0, -20, 10, 400, 500, -600]])
def test_derivatives_are_differences_of_the_step(iiwa, force):
    robot = iiwa.replace(acted_on=["link7"])
    step = kalmarm.ImplicitStep(robot, H, damping=30, stiffness=1e4, reference=0.2)
    q, qd, tau = iiwa.random_state(3)
    acting = {"forces": force, "axes": "local"}
    found = step.derivatives(q, qd, tau, **acting)
    e = 1e-5
    rounding = 1e-14 / e * np.abs(found.a).max()
    for k in range(iiwa.nv):
        d = np.zeros(iiwa.nv)
        d[k] = e
        for column, up, down in (
            (found.dq, (q + d, qd, tau), (q - d, qd, tau)),
            (found.dqd, (q, qd + d, tau), (q, qd - d, tau)),
            (found.dtau, (q, qd, tau + d), (q, qd, tau - d)),
        ):
            ahead, behind = (step.acceleration(*x, **acting) for x in (up, down))
            difference = (ahead - behind) / (2 * e)
            far = np.abs(column[:, k] - difference).max()
            assert far < 1e-6 * np.abs(column).max() + rounding


def test_robot_of_a_step_has_its_mass_matrix(g1):
    k, b = 1e4, 20.0
    step = kalmarm.ImplicitStep(g1, H, damping=b, stiffness=k)
    q, qd, tau = g1.random_state(4)
    added = np.diag(step.robot.mass_matrix(q) - g1.mass_matrix(q))
    np.testing.assert_allclose(added, [0.0] * 6 + [H * b + H * H * k] * 29, atol=1e-12)
    X = step.robot.inverse_mass_matrix(q)
    np.testing.assert_allclose(X, step.derivatives(q, qd, tau).dtau, rtol=0, atol=1e-10 * X.max())


def test_tolerance_is_the_robots(iiwa):
    state = iiwa.random_state(5, 30)
    both = [
        kalmarm.ImplicitStep(one, H, stiffness=1e6).acceleration(*state)
        for one in (iiwa, iiwa.replace(tolerance=kalmarm.last_bits))
    ]
    assert 0 < relative(both[0], both[1]) < 1e-12


def test_what_a_file_has_beyond_is_named(tmp_path):
    path = tmp_path / "arm.xml"
    more = (
        '<position joint="b" kp="3" timeconst=".1"/><motor joint="c" gear="1 0 0"/>'
        '<motor joint="b" forcerange="-1 1"/>'
        '<general joint="b" biastype="affine" biasprm="0 5 0"/>'
    )
    path.write_text(ARM.format(more, "0 0 0 0"))
    notes = (
        "ignored: 1 actuator with activation dynamics, 1 actuator of a joint of several axes",
        "ignored: 1 actuator with negative stiffness or damping",
    )
    with pytest.warns(UserWarning, match="ignored: "):
        robot = kalmarm.load(path, takes_steps=True)
    model = mujoco.MjModel.from_xml_path(str(path))
    with pytest.warns(UserWarning, match="ignored: "):
        same = kalmarm.from_mujoco(model, takes_steps=True)
    assert robot.notes == same.notes == notes
    assert robot.terms.actuators[-1].force_range == (-1, 1)
    np.testing.assert_array_equal(robot.terms.stiffness, same.terms.stiffness)
    with pytest.warns(UserWarning, match="7 actuators.*damping of 3 joints.*1 body"):
        kalmarm.load(path)


def test_robots_without_files_have_no_terms():
    builder = kalmarm.Builder()
    builder.add_body("rod", joint="hinge", axis=(0, 1, 0), mass=1, inertia=(1, 1, 1))
    robot = builder.build()
    assert robot.terms.compensated is None
    step = kalmarm.ImplicitStep(robot, 0.5, damping=2, stiffness=8)
    # (1 + 0.5 2 + 0.25 8) a = 4 - 8 (0.25 + 0.5 0.5) - 2 0.5
    q, qd, a = step([0.25], [0.5], [4])
    assert (a[0], qd[0], q[0]) == (-0.25, 0.375, 0.4375)


def test_bad_input_is_one_line(iiwa, g1, arm):
    for arguments, words in (
        ({"h": -1e-3}, "h = -0.001"),
        ({"h": np.nan}, "h = nan"),
        ({"h": H, "damping": -1}, "damping -1"),
        ({"h": H, "stiffness": np.inf}, "stiffness inf"),
        ({"h": H, "stiffness": np.ones(3)}, "stiffness has shape"),
        ({"h": H, "scheme": "rk4"}, "springs_at_end, springs_at_start"),
    ):
        with pytest.raises(ValueError, match=words) as refusal:
            kalmarm.ImplicitStep(iiwa, **arguments)
        assert "\n" not in str(refusal.value)
    with pytest.raises(ValueError, match="spring about a ball or a free joint"):
        kalmarm.ImplicitStep(g1, H, stiffness=np.ones(g1.nv))
    with pytest.raises(ValueError, match="leaves joints out"):
        kalmarm.ImplicitStep(iiwa.replace(asked=[1]), H)
    with pytest.raises(kalmarm.LoadError, match="actuator 'q' is unknown"):
        kalmarm.load(arm, controls={"q": 1})
    with pytest.raises(ValueError, match=r"tau has shape"):
        kalmarm.ImplicitStep(iiwa, H).acceleration(np.zeros(7), np.zeros(7), np.zeros(6))
    with pytest.raises(kalmarm.DynamicsError):
        kalmarm.ImplicitStep(iiwa, H)(np.full(7, np.nan), np.zeros(7), np.zeros(7))


@pytest.mark.parametrize("bad", ["q", "forces"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_row_without_an_answer_is_nan(iiwa, bad, dtype):
    step = kalmarm.ImplicitStep(iiwa.replace(acted_on=["link7"]), H, stiffness=1e5)
    state = iiwa.random_state(6, 5, dtype=dtype)._asdict()
    state |= {"forces": np.ones((5, 6), dtype), "axes": "local"}
    gains = {"stiffness": np.full((5, 7), 1e3, dtype)}
    calls = (step, lambda **x: step(**x, **gains), step.derivatives)
    before = [call(**state) for call in calls]
    state[bad][2, 3:5] = np.nan
    for call, whole in zip(calls, before, strict=True):
        for x, y in zip(call(**state), whole, strict=True):
            assert np.all(np.isnan(x[2]))
            np.testing.assert_array_equal(np.delete(x, 2, axis=0), np.delete(y, 2, axis=0))
        _, outcomes = call(**state, status=True)
        assert [status != 0 for status in outcomes["status"]] == [False, False, True, False, False]


def test_stiff_controllers_hold_where_explicit_ones_fly():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        robot = load("panda")
    step = kalmarm.ImplicitStep(robot, H, damping=50, stiffness=1e5, reference=robot.q0)
    q, qd, tau = robot.random_state(7, 8, dtype=np.float32)
    for _ in range(2000):
        q, qd, _ = step(q, qd, tau)
    assert np.abs(q - robot.q0).max() < 1e-2


def two_slides(m1, m2):
    builder = kalmarm.Builder(gravity=(0, 0, 0))
    builder.add_body("x", joint="slide", mass=m1)
    builder.add_body("y", joint="slide", mass=m2)
    return builder.build()


def test_rows_couple_two_slides_as_the_closed_form_says():
    m1, m2, k, b, length = 2.0, 6.0, 4e4, 16.0, 0.25
    row = kalmarm.CoupledRow([1, -1], damping=b, stiffness=k, reference=length)
    step = kalmarm.ImplicitStep(two_slides(m1, m2), H, rows=[row])
    a = step.acceleration(np.array([1, 0.5]), np.array([-2.0, 1]), np.zeros(2))
    stretched, rate = 0.5 - length, -3
    m = m1 * m2 / (m1 + m2)
    expected = -(b * rate + k * (stretched + H * rate)) / (m + H * b + H * H * k)
    assert a[0] - a[1] == pytest.approx(expected, rel=1e-13)
    assert m1 * a[0] + m2 * a[1] == pytest.approx(0, abs=1e-9)


def test_an_imposed_row_is_met_after_one_step_in_every_row_of_states():
    row = kalmarm.CoupledRow([1, -3], reference=0.2, imposed=True)
    step = kalmarm.ImplicitStep(two_slides(1, 2), H, rows=[row])
    q, qd = np.arange(10.0).reshape(5, 2), np.ones((5, 2))
    after = step(q, qd, np.zeros((5, 2))).q
    np.testing.assert_allclose(after @ [1, -3], 0.2, atol=1e-12)


def test_rows_that_are_none_are_refused():
    robot = two_slides(1, 2)
    for row, says in (
        (kalmarm.CoupledRow([1]), r"jacobian has shape \(1,\), \(2,\) is needed"),
        (kalmarm.CoupledRow([1, -1], damping=-1), "row 0: damping -1"),
        (kalmarm.CoupledRow([1, np.nan]), "row 0: jacobian nan"),
    ):
        with pytest.raises(ValueError, match=says):
            kalmarm.ImplicitStep(robot, H, rows=[row])
    twice = [kalmarm.CoupledRow([1, -1], imposed=True)] * 2
    with pytest.raises(kalmarm.DynamicsError, match="singular"):
        kalmarm.ImplicitStep(robot, H, rows=twice).acceleration(*np.zeros((3, 2)))


def with_gains(robot, n, dtype, seed=11):
    rng = np.random.default_rng(seed)
    single = np.array(robot.model.single)
    return {
        "damping": np.where(single, 10 ** rng.uniform(-1, 3, (n, robot.nv)), 0).astype(dtype),
        "stiffness": np.where(single, 10 ** rng.uniform(0, 5, (n, robot.nv)), 0).astype(dtype),
        "reference": rng.uniform(-1, 1, (n, robot.nv)).astype(dtype),
    }


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("tolerance", [None, kalmarm.last_bits])
def test_gains_of_every_state_are_those_of_a_step_with_them(g1, dtype, tolerance):
    robot = g1.replace(tolerance=tolerance)
    n = 19 if tolerance is None else 3
    state = robot.random_state(8, n, dtype=dtype)
    gains = with_gains(robot, n, dtype)
    step = kalmarm.ImplicitStep(robot, H)
    after = step(*state, **gains, threads=2)
    for i in range(n):
        own = kalmarm.ImplicitStep(robot, H, **{name: x[i] for name, x in gains.items()})
        one = own(*(x[i] for x in state))
        bound = 3e-4 if dtype == np.float32 else 1e-12
        assert np.linalg.norm(after.a[i] - one.a) < bound * np.linalg.norm(one.a)
        alone = step.acceleration(
            *(x[i] for x in state), **{name: x[i] for name, x in gains.items()}
        )
        np.testing.assert_array_equal(alone, after.a[i])


def test_bad_gains_of_states_are_one_line(g1):
    step = kalmarm.ImplicitStep(g1, H)
    state = g1.random_state(9, 4)
    for name, value, says in (
        ("damping", -1, "row 2, DoF '.*': damping -1"),
        ("stiffness", np.nan, "row 2, DoF '.*': stiffness nan"),
        ("reference", np.inf, "row 2, DoF '.*': reference inf"),
    ):
        gains = np.zeros((4, g1.nv))
        gains[2, -1] = value
        with pytest.raises(ValueError, match=says) as refusal:
            step.acceleration(*state, **{name: gains})
        assert "\n" not in str(refusal.value)
    with pytest.raises(ValueError, match="spring about a ball or a free joint"):
        step.acceleration(*state, stiffness=np.ones((4, g1.nv)))
    with pytest.raises(ValueError, match="damping has shape"):
        step.acceleration(*state, damping=np.ones(g1.nv - 1))
    row = kalmarm.CoupledRow(np.eye(g1.nv)[-1], damping=1)
    with pytest.raises(ValueError, match="beside terms that couple joints"):
        coupled = kalmarm.ImplicitStep(g1, H, rows=[row])
        coupled.acceleration(*state, damping=np.zeros((4, g1.nv)))


TENDONS = """<tendon>
  <fixed name="t" damping="7" stiffness="700" springlength=".3" armature=".4">
   <joint joint="a" coef="1.5"/><joint joint="b" coef="-2"/></fixed>
  <fixed name="idle"><joint joint="b" coef="1"/></fixed>
  <fixed name="band" stiffness="3" springlength=".1 .3"><joint joint="b" coef="1"/></fixed>
 </tendon>
 <actuator><position name="pt" tendon="t" gear="2" kp="25" kv="3"/>
  <motor name="mt" tendon="t" gear="5" armature=".1"/></actuator>
 <keyframe>"""


@pytest.mark.parametrize("scheme", SCHEMES)
def test_fixed_tendons_step_as_mujocos(tmp_path, scheme):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format("", ".2 2").replace("<keyframe>", TENDONS))
    with pytest.warns(
        UserWarning, match="1 tendon, 1 tendon with a dead band|1 tendon with a dead"
    ):
        robot = kalmarm.load(path, key="k", takes_steps=True)
    (row,) = robot.terms.rows
    np.testing.assert_array_equal(row.jacobian, [1.5, -2, 0, 0, 0])
    assert (row.stiffness, row.damping) == (700 + 100, 7 + 12)
    assert row.armature == pytest.approx(0.4 + 2.5)
    assert row.reference == pytest.approx((700 * 0.3 + 50 * 0.2) / 800)
    state = robot.random_state(1, 20)
    model = mujoco.MjModel.from_xml_path(str(path))
    model.tendon_stiffness[2] = 0  # the dead band
    q, qd = stepped_by_mujoco(model, SCHEMES[scheme], state, [0.4, 7, 0.5, 0.2, 2])
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    ours = step(*state)
    assert relative(ours.a, (qd - state.qd) / H) < 1e-9
    assert relative(ours.q, q) < 1e-12


SPATIAL = """<spatial name="s" stiffness="5"><site site="s1"/><site site="s2"/></spatial>
  <fixed name="t" """
OTHERS = """<actuator><motor site="s1"/><motor tendon="s"/><position tendon="band" kp="2"/>
  <motor joint="b" group="3" gear="7"/><muscle joint="b" lengthrange="0 1"/>"""


def test_a_compiled_model_has_the_terms_of_its_file(tmp_path):
    """Beside tendons and actuators that have none, before those that do."""
    text = ARM.format("", ".2 2").replace("<keyframe>", TENDONS)
    text = text.replace('<fixed name="t" ', SPATIAL).replace("<actuator>", OTHERS, 1)
    text = text.replace(
        "<worldbody>", '<option actuatorgroupdisable="3"/><worldbody><site name="s1"/>'
    )
    text = text.replace("<body pos=", '<site name="s2"/><body pos=', 1)
    text = text.replace('ctrl=".4', 'ctrl="0 0 0 0 0 .4')
    path = tmp_path / "arm.xml"
    path.write_text(text)
    model = mujoco.MjModel.from_xml_path(str(path))
    with pytest.warns(UserWarning, match="1 spatial tendon, 1 tendon, 1 tendon with a dead band"):
        robot = kalmarm.load(path, key="k", takes_steps=True)
        same = kalmarm.from_mujoco(model, ctrl=model.key_ctrl[0], takes_steps=True)
    assert robot.notes == same.notes
    assert len(robot.terms.rows) == 1
    assert [one.name for one in robot.terms.actuators] == ["p", "m", "g", "pt", "mt"]
    for field in ("damping", "stiffness", "reference", "torque"):
        ours, other = getattr(robot.terms, field), getattr(same.terms, field)
        np.testing.assert_allclose(ours, other, rtol=1e-14)
    for one, other in zip(robot.terms.actuators, same.terms.actuators, strict=True):
        assert one[:3] == other[:3] and one.row == other.row
        np.testing.assert_allclose(one[3:-2], other[3:-2], rtol=1e-14)
        assert one[-2:] == other[-2:]
    for one, other in zip(robot.terms.rows, same.terms.rows, strict=True):
        np.testing.assert_array_equal(one.jacobian, other.jacobian)
        np.testing.assert_allclose(one[1:], other[1:], rtol=1e-14)
    q = robot.random_state(0).q
    weights = [one.terms.compensated.gravity(q) for one in (robot, same)]
    np.testing.assert_allclose(*weights, rtol=1e-14)


def test_armature_of_tendons_is_for_steps_alone(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format("", ".2 2").replace("<keyframe>", TENDONS))
    with pytest.raises(kalmarm.LoadError, match="couples joints in M: supported in implicit steps"):
        kalmarm.load(path)


LIMITED = ('gear="2" kp="2e4"', 'gear="2" kp="2e4" forcerange="-3e4 3e4"')
FILES = {  # beside tendons, a state at a limit is a step that is made anew
    "no limits": ARM.format("", ""),
    "limits": ARM.format("", "").replace(*LIMITED),
    "limits beside tendons": ARM.format("", ".2 2")
    .replace("<keyframe>", TENDONS.replace('springlength=".1 .3"', 'springlength=".1"'))
    .replace(*LIMITED),
}


@pytest.mark.filterwarnings("ignore:.*1 tendon")  # "idle"
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", FILES)
def test_forces_from_outside_step_as_mujocos(arm, kind, scheme):
    """xfrc_applied, about the centres of mass, where the sites are."""
    robot = load_text(arm, FILES[kind], acted_on=["s", "t", "u"])
    model = mujoco.MjModel.from_xml_path(str(arm))
    state = robot.random_state(1, 20)
    applied = 10 * np.random.default_rng(4).standard_normal((20, 3, 6))
    ctrl = model.key_ctrl[0]
    q, qd = stepped_by_mujoco(model, SCHEMES[scheme], state, ctrl, applied)
    step = kalmarm.ImplicitStep(robot, H, scheme=scheme)
    ours = step(*state, forces=np.roll(applied, 3, axis=2).reshape(20, 18))
    assert relative(ours.q, q) < 1e-12
    assert relative(ours.qd, qd) < 1e-11
    assert relative(ours.a, (qd - state.qd) / H) < 1e-9
    assert relative(step(*state).a, ours.a) > 1e-4


@pytest.mark.filterwarnings("ignore:.*1 tendon")
@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_forces_are_broadcast_over_states(arm, kind, dtype):
    robot = load_text(arm, FILES[kind], acted_on=["s", "t", "u"])
    step = kalmarm.ImplicitStep(robot, H)
    state = robot.random_state(3, 8, dtype=dtype)
    forces = np.random.default_rng(4).standard_normal((3, 1, 18)).astype(dtype)
    bound = 1e-4 if dtype == np.float32 else 1e-11
    whole = step(*state, forces=forces)
    for some in (whole, step(*state, forces=forces.tolist(), threads=2)):
        assert [x.shape for x in some] == [(3, 8, robot.nq)] + 2 * [(3, 8, robot.nv)]
        assert all(x.dtype == dtype for x in some)
    for i in range(3):
        assert relative(step(*state, forces=forces[i, 0]).a, whole.a[i]) < bound
    for i in range(8):
        one = tuple(x[i] for x in state)
        assert relative(step(*one, forces=forces).a[:, 0], whole.a[:, i]) < bound
        assert relative(step(*one, forces=forces[1, 0]).a[None], whole.a[None, 1, i]) < bound
        of_one_q = step(one[0], one[1], state.tau, forces=forces)
        assert relative(of_one_q.a[:, i], whole.a[:, i]) < bound


@pytest.mark.parametrize("axes", ["local", "world", "aligned"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_forces_are_torques_of_the_transposed_jacobian(g1, axes, dtype):
    names, n = ["left_ankle_roll_link", "torso_link"], 19
    q, qd, tau = g1.random_state(3, n, dtype=dtype)
    forces = np.random.default_rng(1).standard_normal((n, 2, 6)).astype(dtype)
    J = g1.kinematics(names).compute(["jacobians"], q, axes=axes)["jacobians"]
    pushed = tau + np.einsum("sfij,sfi->sj", J, forces)
    flat = forces.reshape(n, 12)
    terms = {"damping": 3.0, "stiffness": 50.0}
    step, without = (
        kalmarm.ImplicitStep(robot, H, **terms) for robot in (g1.replace(acted_on=names), g1)
    )
    bound = 1e4 * np.finfo(dtype).eps
    for gains in ({}, with_gains(g1, n, dtype)):
        truth = without.acceleration(q, qd, pushed, **gains)
        for threads in (1, 2):
            found = step.acceleration(
                q, qd, tau, **gains, threads=threads, forces=flat, axes=axes
            )
            assert found.dtype == dtype
            assert relative(found, truth) < bound
        own = {name: x[5] for name, x in gains.items()}
        one = step.acceleration(q[5], qd[5], tau[5], **own, forces=flat[5], axes=axes)
        assert relative(one[None], truth[5][None]) < bound


def test_bad_forces_of_steps_are_one_line(iiwa):
    state = iiwa.random_state(9, 4)
    step = kalmarm.ImplicitStep(iiwa.replace(acted_on=["link7"]), H)
    none = kalmarm.ImplicitStep(iiwa, H)
    for call, options, kind, says in (
        (none, {"forces": np.zeros(6)}, ValueError, r"forces \(of a robot without acted_on\) has"),
        (none.derivatives, {"forces": np.zeros(6)}, ValueError, "without acted_on"),
        (step, {"forces": np.zeros(5)}, ValueError, r"forces has shape \(5,\), \(4, 6\) is needed"),
        (step, {"forces": np.zeros((3, 6))}, ValueError, r"forces has shape \(3, 6\)"),
        (step, {"forces": np.zeros(6, np.float32)}, TypeError, "forces is float32"),
        (step, {"axes": "body"}, ValueError, "axes 'body' is unknown: local, world, aligned"),
        (step.derivatives, {"axes": "body"}, ValueError, "derivatives: axes 'body' is unknown"),
        (step.derivatives, {"forces": np.zeros(6)}, ValueError, "Axes::local is needed"),
    ):
        with pytest.raises(kind, match=says) as refusal:
            call(*state, **options)
        assert "\n" not in str(refusal.value)
    with pytest.raises(kalmarm.DynamicsError, match=r"forces\[0\] is nan"):
        step(*(x[0] for x in state), forces=np.full(6, np.nan))
