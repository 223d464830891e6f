"""Bodies that states add to a robot: MuJoCo has them as bodies of the model, ours as `loads` of a call."""

import mujoco
import numpy as np
import pytest
from conftest import file_of, load, relative, without_other_forces

import kalmarm
from kalmarm import payload

FRAMES = {"iiwa14": ["link7", "link3"], "go2": ["base", "FL_calf"], "g1": ["left_elbow_link", "pelvis"]}
COUNT = 9  # states, more than one block of lanes
RNG_SEED = 3


def bodies(rng, count):
    """(masses, centres, principal moments), (count, 2, ...) of bodies that can be."""
    sides = rng.uniform(0.01, 0.1, (count, 2, 3)) ** 2
    mass = rng.uniform(0.1, 3, (count, 2))
    return mass, rng.uniform(-0.2, 0.2, (count, 2, 3)), mass[..., None] * (
        sides.sum(axis=-1, keepdims=True) - sides
    )


def in_mujoco(name, mass, center, moments):
    spec = mujoco.MjSpec.from_file(str(file_of(name)))
    for i, frame in enumerate(FRAMES[name]):
        spec.body(frame).add_body(
            name=f"load {i}", mass=mass[i], ipos=center[i], inertia=moments[i], explicitinertial=True
        )
    return without_other_forces(spec.compile())


@pytest.fixture(params=sorted(FRAMES))
def case(request):
    robot = load(request.param, loaded=FRAMES[request.param])
    rng = np.random.default_rng(RNG_SEED)
    q, qd, tau = robot.random_state(RNG_SEED, COUNT)
    mass, center, moments = bodies(rng, COUNT)
    loads = payload(mass, center, moments).reshape(COUNT, -1)
    M, bias = [], []
    for i in range(COUNT):
        model = in_mujoco(request.param, mass[i], center[i], moments[i])
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = q[i], qd[i]
        mujoco.mj_forward(model, data)
        full = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        M.append(full)
        bias.append(data.qfrc_bias.copy())
    return robot, q, qd, tau, loads, np.array(M), np.array(bias)


def test_all_calls_are_those_of_mujoco_with_these_bodies(case):
    robot, q, qd, tau, loads, M, bias = case
    a = np.linalg.solve(M, (tau - bias)[..., None])[..., 0]
    inverse = np.linalg.inv(M)
    assert relative(robot.mass_matrix(q, loads=loads), M) < 1e-12
    assert relative(robot.bias(q, qd, loads=loads), bias) < 1e-11
    still = robot.gravity(q, loads=loads)
    assert relative(robot.bias(q, np.zeros_like(qd), loads=loads), still) < 1e-12
    torques = np.einsum("...ij,...j", M, tau) + bias
    assert relative(robot.inverse_dynamics(q, qd, tau, loads=loads), torques) < 1e-11
    assert relative(robot.forward_dynamics(q, qd, tau, loads=loads), a) < 1e-8
    assert relative(robot.inverse_mass_matrix(q, loads=loads), inverse) < 1e-8
    assert relative(robot.solve(q, tau, loads=loads), np.einsum("...ij,...j", inverse, tau)) < 1e-8
    diagonal = np.diagonal(inverse, axis1=-2, axis2=-1)
    assert relative(robot.diagonal(q, loads=loads), diagonal) < 1e-8
    assert np.allclose(robot.log_det(q, loads=loads), np.linalg.slogdet(M)[1], rtol=1e-9)
    factors = robot.factor(q[0], loads=loads[0])
    assert np.allclose(factors.solve(tau), np.einsum("ij,...j", inverse[0], tau), rtol=1e-7, atol=1e-9)
    for i in range(COUNT):
        one = robot.forward_dynamics(q[i], qd[i], tau[i], loads=loads[i])
        assert np.linalg.norm(one - a[i]) < 1e-8 * np.linalg.norm(a[i])


def test_float32_rows(case):
    robot, q, qd, tau, loads, M, bias = case
    narrow = [x.astype(np.float32) for x in (q, qd, tau, loads)]
    exact = robot.replace(tolerance=kalmarm.last_bits).forward_dynamics(
        *(x.astype(float) for x in narrow[:3]), loads=narrow[3].astype(float)
    )
    found, outcomes = robot.forward_dynamics(*narrow[:3], loads=narrow[3], status=True)
    assert found.dtype == np.float32
    assert not outcomes["near_singular"].any()
    assert relative(found, exact) < 1e-2


def test_derivatives_and_steps(case):
    robot, q, qd, tau, loads, M, bias = case
    found = robot.forward_dynamics_derivatives(q, qd, tau, loads=loads, axes="local")
    assert relative(found.dtau, np.linalg.inv(M)) < 1e-8
    assert relative(found.a, robot.forward_dynamics(q, qd, tau, loads=loads)) < 1e-8
    h, rate = 1e-6, np.random.default_rng(1).standard_normal(qd.shape)
    change = [
        robot.forward_dynamics(robot.integrate(q, s * h * rate), qd, tau, loads=loads) for s in (1, -1)
    ]
    along = np.einsum("...ij,...j", found.dq, rate)
    assert relative((change[0] - change[1]) / (2 * h), along) < 1e-5
    damping = 0.3
    step = kalmarm.ImplicitStep(robot, 0.01, damping=damping, stiffness=0.0)
    free = 6 if robot.nq != robot.nv else 0  # the base has no dampers
    b = np.full(robot.nv, damping)
    b[:free] = 0
    exact = np.linalg.solve(M + 0.01 * np.diag(b), (tau - bias - b * qd)[..., None])[..., 0]
    assert relative(step.acceleration(q, qd, tau, loads=loads), exact) < 1e-8


def test_payload_broadcasts_and_is_about_the_frame():
    assert payload(2.0, (0, 0, 0.5)).tolist() == [2, 0, 0, 1, 0.5, 0.5, 0, 0, 0, 0]
    assert payload(np.ones((4, 1)), np.zeros((5, 3)), np.eye(3)).shape == (4, 5, 10)
    tensor = np.array([[3.0, 0.5, 0], [0.5, 4, 0.25], [0, 0.25, 5]])
    assert payload(0.0, inertia=tensor).tolist() == [0, 0, 0, 0, 3, 4, 5, 0.5, 0, 0.25]
    with pytest.raises(ValueError, match=r"payload: center has shape \(2,\)"):
        payload(1.0, (0, 0))
    with pytest.raises(ValueError, match=r"payload: inertia has shape \(2,\)"):
        payload(1.0, inertia=(1, 1))


def test_what_does_not_fit_is_refused(iiwa):
    q, qd, tau = iiwa.random_state(1)
    with pytest.raises(ValueError, match="loads \\(of a robot without loaded\\)"):
        iiwa.forward_dynamics(q, qd, tau, loads=payload(1.0))
    robot = iiwa.replace(loaded=["link7"])
    with pytest.raises(ValueError, match="loads"):
        robot.forward_dynamics(q, qd, tau, loads=np.zeros(9))
    with pytest.raises(kalmarm.DynamicsError, match="joint7"):
        robot.forward_dynamics(q, qd, tau, loads=payload(-1.0))
    many = payload(np.array([1.0, -1.0, 1.0]), (0, 0, 0.1))
    a, outcomes = robot.forward_dynamics(q, qd, tau, loads=many, status=True)
    assert np.isnan(a[1]).all() and np.isfinite(a[[0, 2]]).all()
    assert outcomes["status"][1] == kalmarm.Status.INDEFINITE
