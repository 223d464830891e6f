"""How conventions are mapped: an engine with others computes the same motion."""

import bodies
import numpy as np
import pytest
from protocol import TASKS, Base, Coordinates, Joint, Mechanism, State, error, rotation

CASES = [
    Base(linear, angular, first)
    for linear in ("world", "body")
    for angular in ("world", "body")
    for first in (True, False)
]


@pytest.fixture
def mechanism(tmp_path):
    return Mechanism(bodies.free_body(tmp_path))


def at(state, t):
    """Where a body of constant acceleration a is t later, to second order: q and v."""
    v = state.v + t * state.a
    p = state.q[:3] + t * state.v[:3] + t * t / 2 * state.a[:3]
    w = state.v[3:] + t / 2 * state.a[3:]
    half = t / 2 * w
    turn = np.array([1 - half @ half / 2, *half])
    a, b = state.q[3:], turn / np.linalg.norm(turn)
    product = [
        a[0] * b[0] - a[1:] @ b[1:],
        *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])),
    ]
    return state._replace(q=np.array([*p, *product]), v=v)


@pytest.mark.parametrize("base", CASES)
def test_an_acceleration_is_the_rate_of_its_velocity(mechanism, base):
    its, h = Coordinates(mechanism, list(range(6)), base), 1e-5
    for state in mechanism.states(True):
        rate = (its.velocity(at(state, h)) - its.velocity(at(state, -h))) / (2 * h)
        np.testing.assert_allclose(its.acceleration(state), rate, atol=1e-8)


@pytest.mark.parametrize("base", CASES)
def test_power_and_kinetic_energy_are_the_same_in_all_conventions(mechanism, base):
    its = Coordinates(mechanism, [3, 1, 0, 2, 5, 4], base)
    for state in mechanism.states(True):
        v, M = its.velocity(state), np.diag(np.arange(1.0, 7))
        assert np.isclose(its.torque(state) @ v, state.tau @ state.v)
        assert np.isclose(state.v @ its.read("mass", state, M) @ state.v, v @ M @ v)
        np.testing.assert_allclose(
            its.read("inverse", state, np.linalg.inv(M)) @ its.read("mass", state, M),
            np.eye(6),
            atol=1e-12,
        )
        np.testing.assert_allclose(
            its.read("acceleration", state, its.acceleration(state)), state.a
        )
        np.testing.assert_allclose(
            its.read("inverse_dynamics", state, its.torque(state)), state.tau
        )


def test_derivatives_of_an_engine_that_orders_joints_otherwise_are_those_of_the_same_motion():
    """a_e = f(q_e, w, tau_e) of the engine; a = T^-1 f(T q, T v, T^-T tau) by differences."""
    record = {"nv": 3, "nq": 3, "gravity": [0, 0, 0], "joints": [], "states": []}
    mechanism = Mechanism.__new__(Mechanism)
    mechanism.record, mechanism.nv = record, 3
    mechanism.joints = [Joint(f"j{i}", "hinge", i, i, 0.0) for i in range(3)]
    its = Coordinates(mechanism, [2, 0, 1])
    draw = np.random.default_rng(2)
    K, D = draw.standard_normal((2, 3, 3))
    q, v, tau = draw.standard_normal((3, 3))
    X = np.diag([1.0, 2.0, 3.0])

    def a(q, v, tau):
        of_engine = K @ np.sin(its.P @ q) + D @ np.sin(its.P @ v) + X @ (its.P @ tau)
        return its.P.T @ of_engine

    h, one = 1e-6, np.eye(3)
    rates = [
        np.stack([(at(h * e) - at(-h * e)) / (2 * h) for e in one], axis=1)
        for at in (
            lambda d: a(q + d, v, tau),
            lambda d: a(q, v + d, tau),
            lambda d: a(q, v, tau + d),
        )
    ]
    of_engine = [K * np.cos(its.P @ q), D * np.cos(its.P @ v), X]
    state = State(q, v, tau, tau, {})
    read = its.read("derivatives", state, np.hstack(of_engine))
    np.testing.assert_allclose(read, np.hstack(rates), atol=1e-9)


def test_derivatives_are_as_wrong_as_their_worst_block():
    truth = np.hstack([1e6 * np.eye(2), np.zeros((2, 2)), np.eye(2)])
    wrong = truth.copy()
    wrong[:, 4:] *= 1.01
    assert np.isclose(error("derivatives", wrong, truth), 0.01)
    wrong[0, 2] = np.nan
    assert np.isnan(error("derivatives", wrong, truth))
    assert error("derivatives", truth, truth) == 0


def test_the_body_axes_are_those_of_the_quaternion():
    turned = rotation(np.array([np.cos(0.3), 0, 0, np.sin(0.3)]) * 5) @ [1, 0, 0]
    np.testing.assert_allclose(turned, [np.cos(0.6), np.sin(0.6), 0])


@pytest.mark.parametrize("task", [task for task in TASKS if task != "derivatives"])
def test_an_error_is_relative_to_the_truth_and_no_shape_passes_for_another(mechanism, task):
    truth = mechanism.states(True)[0].truth[task]
    assert error(task, truth, truth) == 0
    assert np.isclose(error(task, 1.001 * truth, truth), 1e-3)
    with pytest.raises(ValueError, match="shape"):
        error(task, truth[:1], truth)


def test_a_matrix_is_wrong_by_its_worst_entry_whatever_its_units():
    M, D = np.array([[4.0, 1], [1, 9]]), np.diag([1.0, 1e6])
    wrong = M + [[0, 0], [0, 0.9]]
    assert np.isclose(error("mass", wrong, M), 0.1)
    assert np.isclose(error("mass", D @ wrong @ D, D @ M @ D), 0.1)
