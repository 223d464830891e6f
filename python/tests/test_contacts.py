"""Contacts with the world: H = M + J'DJ of M and of Jacobians, dense, and what calls take."""

import numpy as np
import pytest

import kalmarm

FEET = ["left_ankle_roll_link"] * 3 + ["right_ankle_roll_link"] * 3
COUNT = 9  # states, more than one block of lanes


def relative(found, truth):
    return np.abs(found - truth).max() / np.abs(truth).max()


def stand(robot, q, axes, d, seed=1):
    """Rows of contacts of stiffness d, (..., 6 c), and H."""
    w = np.sqrt(d) * np.random.default_rng(seed).standard_normal(q.shape[:-1] + (len(FEET), 6))
    J = robot.kinematics(FEET).compute(["jacobians"], q, axes=axes)["jacobians"]
    rows = np.einsum("...fi,...fij->...fj", w, J)
    H = robot.mass_matrix(q) + np.einsum("...fi,...fj->...ij", rows, rows)
    return w.reshape(*q.shape[:-1], -1), H


@pytest.mark.parametrize("axes", ["local", "world", "aligned"])
@pytest.mark.parametrize("d", [1.0, 1e3])
def test_what_is_made_of_factors_is_that_of_H(g1, axes, d):
    robot = g1.replace(contacts=FEET, frames=["torso_link"])
    q, _, tau = robot.random_state(3, COUNT)
    w, H = stand(robot, q, axes, d)
    given = {"contacts": w, "axes": axes}
    inverse = np.linalg.inv(H)
    J = robot.kinematics(["torso_link"]).compute(["jacobians"], q, axes="local")["jacobians"][:, 0]
    block = J @ inverse @ np.swapaxes(J, -1, -2)
    assert relative(robot.solve(q, tau, **given), np.einsum("...ij,...j", inverse, tau)) < 1e-7
    assert relative(robot.inverse_mass_matrix(q, **given), inverse) < 1e-7
    assert relative(robot.diagonal(q, **given), np.diagonal(inverse, axis1=-2, axis2=-1)) < 1e-7
    assert relative(robot.log_det(q, **given), np.linalg.slogdet(H)[1]) < 1e-9
    assert relative(robot.operational(q, **given), block) < 1e-7
    diagonal = np.diagonal(block, axis1=-2, axis2=-1)
    assert relative(robot.operational_diagonal(q, **given), diagonal) < 1e-7
    one = {"contacts": w[0], "axes": axes}
    assert relative(robot.solve(q[0], tau[0], **one), inverse[0] @ tau[0]) < 1e-7
    factors = robot.factor(q[0], **one)
    assert relative(factors.solve(tau), np.einsum("ij,...j", inverse[0], tau)) < 1e-7


def test_stiff_contacts_in_float32_are_answered_in_double(g1):
    """Within 1e-6 from d = 1e2 to 1e10, where Cholesky's factor of H in float32 is lost from 1e6 on."""
    robot = g1.replace(contacts=FEET)
    q, _, tau = robot.random_state(4, COUNT, dtype=np.float32)
    exact = robot.replace(tolerance=kalmarm.last_bits)
    for d in 10.0 ** np.arange(2, 11, 2):
        w, _ = stand(robot, q.astype(float), "aligned", d)
        w = w.astype(np.float32)
        found, outcomes = robot.solve(q, tau, contacts=w, status=True)
        assert not outcomes["near_singular"].any()
        truth = exact.solve(q.astype(float), tau.astype(float), contacts=w.astype(float))
        error = np.linalg.norm(found - truth, axis=-1) / np.linalg.norm(truth, axis=-1)
        assert error.max() < 1e-6, d


def test_a_of_a_robot_that_stands(g1):
    """a = H^-1 (tau - bias): with stiffer contacts its feet hardly move."""
    robot = g1.replace(contacts=FEET)
    q, qd, tau = robot.random_state(5)
    J = robot.kinematics(FEET).compute(["jacobians"], q)["jacobians"]
    along = np.tile(np.eye(6)[3:], (2, 1))  # the three axes at each foot
    rows = np.einsum("fi,fij->fj", along, J)
    b = tau - robot.bias(q, qd)
    slip = [
        np.linalg.norm(rows @ robot.solve(q, b, contacts=np.sqrt(d) * along.ravel()))
        for d in (1e2, 1e4, 1e6)
    ]
    assert slip[0] > 50 * slip[1] > 2500 * slip[2]


def test_a_step_on_springs_at_bodies(g1):
    """(M + h B + J'DJ) a = tau - B qd - bias + J' f, of one state and of rows."""
    h, damping = 0.005, 0.4
    robot = g1.replace(contacts=FEET, acted_on=["left_ankle_roll_link", "right_ankle_roll_link"])
    q, qd, tau = robot.random_state(7, COUNT)
    w, H = stand(robot, q, "aligned", 1e4)
    f = np.random.default_rng(2).standard_normal((COUNT, 12))
    step = kalmarm.ImplicitStep(robot, h, damping=damping, stiffness=0.0)
    b = np.full(robot.nv, damping)
    b[:6] = 0
    torque = tau - b * qd - robot.bias(q, qd, forces=f)
    exact = np.linalg.solve(H + h * np.diag(b), torque[..., None])[..., 0]
    found = step.acceleration(q, qd, tau, forces=f, contacts=w)
    assert relative(found, exact) < 1e-7
    one = step.acceleration(q[0], qd[0], tau[0], forces=f[0], contacts=w[0])
    assert relative(one, exact[0]) < 1e-7
    moved = step(q, qd, tau, forces=f, contacts=w)
    assert relative(moved.qd, qd + h * exact) < 1e-7
    with pytest.raises(ValueError, match="beside contacts"):
        step.acceleration(q, qd, tau, damping=1.0, contacts=w)


def test_what_does_not_fit_is_refused(g1):
    robot = g1.replace(contacts=FEET)
    q, _, tau = robot.random_state(6, 2)
    with pytest.raises(ValueError, match="contacts"):
        robot.solve(q, tau, contacts=np.zeros((2, 6)))
    with pytest.raises(ValueError, match="a robot without contacts"):
        g1.solve(q, tau, contacts=np.zeros((2, 36)))
    with pytest.raises(ValueError, match="axes 'body' is unknown"):
        robot.solve(q, tau, contacts=np.zeros((2, 36)), axes="body")
    w = np.zeros((2, 36))
    w[1, 4] = np.nan
    found = robot.solve(q, tau, contacts=w)
    assert np.isfinite(found[0]).all() and np.isnan(found[1]).all()
    with pytest.raises(kalmarm.DynamicsError):
        robot.solve(q[1], tau[1], contacts=w[1])
