"""Products of an implicit step's Jacobians with vectors: its matrices, differences, adjoints, rows, refusals."""

import numpy as np
import pytest
from conftest import load

import kalmarm

H = 0.002
ARM = """<mujoco><compiler angle="radian"/><worldbody>
 <body><joint name="a" axis="0 1 0" damping=".4" stiffness="30" springref=".3"/>
  <inertial pos=".1 -.05 .2" mass="1.3" diaginertia=".03 .04 .05"/>
  <body pos="0 .1 .4"><joint name="b" type="slide" axis="1 0 1" damping="2"/>
   <inertial pos=".1 0 .1" mass=".7" diaginertia=".03 .04 .05"/>
   <body pos="0 0 .2"><joint name="c" type="ball" damping=".1"/>
    <inertial pos=".1 0 .1" mass=".4" diaginertia=".01 .02 .02"/>
   </body></body></body>
 </worldbody>
 <actuator><position name="p" joint="a" gear="2" kp="200" kv="3"/><motor name="m" joint="b" gear="3"/></actuator>
</mujoco>"""


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM)
    return kalmarm.load(path, takes_steps=True)


def gains(robot, rows, seed):
    """Springs at hinges and slides alone."""
    random = np.random.default_rng(seed)
    has_spring = np.array([not name.startswith("c") for name in robot.dofs])
    shape = (*rows, robot.nv)
    return {
        "damping": random.uniform(0, 5, shape),
        "stiffness": random.uniform(0, 300, shape) * has_spring,
        "reference": random.uniform(-1, 1, shape) * has_spring,
        "armature": random.uniform(0, 0.5, shape),
    }


@pytest.mark.parametrize("scheme", ["springs_at_end", "springs_at_start"])
def test_products_are_those_of_the_matrices(arm, scheme):
    step = kalmarm.ImplicitStep(arm, H, scheme=scheme)
    q, qd, tau = arm.random_state(1, 5)
    w = np.random.default_rng(2).normal(size=(5, arm.nv))
    matrices = step.derivatives(q, qd, tau, ctrl=[0.4, 2])
    found = step.acceleration_vjp(q, qd, tau, w, ctrl=[0.4, 2])
    np.testing.assert_allclose(found.a, step.acceleration(q, qd, tau, ctrl=[0.4, 2]), rtol=1e-12)
    for name in ("dq", "dqd", "dtau"):
        expected = np.einsum("ri,rij->rj", w, getattr(matrices, name))
        np.testing.assert_allclose(getattr(found, name), expected, rtol=1e-9, atol=1e-9, err_msg=name)
    da = step.acceleration_jvp(q, qd, tau, w, 2 * w, 3 * w, ctrl=[0.4, 2])
    expected = (matrices.dq + 2 * matrices.dqd + 3 * matrices.dtau) @ w[..., None]
    np.testing.assert_allclose(da, expected[..., 0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", ["damping", "stiffness", "reference", "armature"])
@pytest.mark.parametrize("scheme", ["springs_at_end", "springs_at_start"])
def test_gains_of_rows_are_derived_by(arm, scheme, name):
    step = kalmarm.ImplicitStep(arm, H, scheme=scheme)
    q, qd, tau = arm.random_state(3, 4)
    own = gains(arm, (4,), 4)
    w, along = np.random.default_rng(5).normal(size=(2, 4, arm.nv))
    along = along * (gains(arm, (4,), 4)["stiffness"] > 0)
    found = step.acceleration_vjp(q, qd, tau, w, **own)
    e = 1e-4
    moved = [
        step.acceleration(q, qd, tau, **(own | {name: own[name] + sign * e * along}))
        for sign in (1, -1)
    ]
    difference = np.sum(w * (moved[0] - moved[1]), axis=-1) / (2 * e)
    product = np.sum(getattr(found, name) * along, axis=-1)
    np.testing.assert_allclose(product, difference, rtol=1e-6, atol=1e-7)
    none = np.zeros_like(w)
    da = step.acceleration_jvp(q, qd, tau, none, none, none, **own, **{f"d{name}": along})
    np.testing.assert_allclose(np.sum(w * da, axis=-1), product, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_rows_are_states_and_one_that_fails_is_nan(dtype):
    robot = load("g1")
    step = kalmarm.ImplicitStep(robot, H)
    q, qd, tau = (x.astype(dtype) for x in robot.random_state(6, 9))
    w = np.ones((9, robot.nv), dtype)
    w[4, 2] = np.nan
    found, outcomes = step.acceleration_vjp(q, qd, tau, w, inertias=True, status=True, threads=0)
    assert found.inertias.shape == (9, robot.nv, 10) and found.dq.dtype == dtype
    is_sound = np.arange(9) != 4
    np.testing.assert_array_equal(outcomes["status"] == kalmarm.Status.OK, is_sound)
    for x in (found.dq, found.damping, found.inertias, found.a):
        np.testing.assert_array_equal(np.isfinite(x.reshape(9, -1)).all(axis=-1), is_sound)
    one = step.acceleration_vjp(q[0], qd[0], tau[0], w[0])
    scale = np.linalg.norm(one.dq)
    np.testing.assert_allclose(found.dq[0] / scale, one.dq / scale, atol=5e3 * np.finfo(dtype).eps)


def test_what_is_wrong_is_named(arm, tmp_path):
    q, qd, tau = arm.random_state(0)
    w = np.ones(arm.nv)
    row = kalmarm.CoupledRow([1, -1, 0, 0, 0], stiffness=3)
    step = kalmarm.ImplicitStep(arm, H, rows=[row])
    with pytest.raises(ValueError, match="of terms that couple joints"):
        step.acceleration_vjp(q, qd, tau, w)
    step = kalmarm.ImplicitStep(arm, H)
    with pytest.raises(ValueError, match=r"acceleration_vjp: w has shape \(3,\)"):
        step.acceleration_vjp(q, qd, tau, w[:3])
    with pytest.raises(ValueError, match="damping -1"):
        step.acceleration_vjp(q, qd, tau, w, damping=-1.0)
    path = tmp_path / "compensated.xml"
    path.write_text(ARM.replace("<body><joint", '<body gravcomp="1"><joint'))
    step = kalmarm.ImplicitStep(kalmarm.load(path, takes_steps=True), H)
    with pytest.raises(ValueError, match="compensates gravity"):
        step.acceleration_vjp(q, qd, tau, w)


def test_armatures_of_states_are_those_of_robots_that_are_built_with_them():
    """With h = 0 it is forward dynamics."""
    masses = {"link1": 2.0, "link2": 1.5}

    def arm(armatures):
        builder, parent = kalmarm.Builder(), -1
        for (name, mass), armature in zip(masses.items(), armatures):
            builder.add_body(
                name, joint="hinge", axis=(0, 1, 0), parent=parent, position=(0, 0, 0.3), mass=mass,
                center_of_mass=(0.1, 0, 0.1), inertia=(0.01, 0.02, 0.01), armature=armature,
            )
            parent = name
        return builder.build()

    given = np.array([[0.2, 0.0], [0.05, 0.7], [0.0, 0.3]])
    robot = arm((0.1, 0.1))
    q, qd, tau = robot.random_state(9, 3)
    a = kalmarm.ImplicitStep(robot, 0.0).acceleration(q, qd, tau, armature=given)
    own = [arm(row).forward_dynamics(*state) for row, *state in zip(given, q, qd, tau)]
    np.testing.assert_allclose(a, own, rtol=1e-12)
