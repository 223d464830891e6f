"""Processes: what forks, ends, and goes to other processes."""

import copy
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys

import numpy as np
import pytest
from conftest import load

import kalmarm

BEGIN = """
import os, sys, threading, time
import numpy as np
import kalmarm

def arm(count=7):
    builder = kalmarm.Builder("arm")
    for k in range(count):
        builder.add_body(f"b{k}", parent=k - 1, joint="hinge", axis=(0, k % 2, 1 - k % 2),
                         position=(0, 0, 0.3), mass=1, center_of_mass=(0, 0.1, 0.2),
                         inertia=(0.1, 0.1, 0.1))
    return builder.build()

robot = arm()
state = robot.random_state(0, 500)
"""


def run(text: str) -> None:
    """Fails where the process crashes, or hangs: it or a process that it has forked."""
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN + text],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        _, words = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise
    assert process.returncode == 0, words


WITH_THREADS = """
step = kalmarm.ImplicitStep(robot, 0.01, stiffness=100)
call = lambda: (robot.forward_dynamics(*state, threads=2), step.acceleration(*state, threads=2))
truth = call()
"""
JOIN = """
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
for x, y in zip(call(), truth):  # the parent's threads are there as before
    np.testing.assert_array_equal(x, y)
"""


@pytest.mark.parametrize("end", ["sys.exit(7)", "os._exit(7)"])
def test_a_forked_process_has_threads_of_its_own(end):
    run(
        WITH_THREADS
        + f"""
child = os.fork()
if child == 0:
    for x, y in zip(call(), truth):
        np.testing.assert_array_equal(x, y)
    {end}
"""
        + JOIN
    )


def test_a_forked_process_that_only_ends_ends():
    run(
        WITH_THREADS
        + """
child = os.fork()
if child == 0:
    del robot, step
    sys.exit(7)
"""
        + JOIN
    )


def test_more_threads_than_there_are_do_the_work():
    run("""
alone = robot.forward_dynamics(*state)
np.testing.assert_array_equal(robot.forward_dynamics(*state, threads=10**6), alone)
import resource
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
fresh = arm()  # whose threads find no memory for a stack
fresh.forward_dynamics(*state)
resource.setrlimit(resource.RLIMIT_AS, (used + 2**22, resource.RLIM_INFINITY))
np.testing.assert_array_equal(fresh.forward_dynamics(*state, threads=2), alone)
""")


def test_threads_that_compute_when_the_interpreter_ends_do_not_abort():
    for _ in range(3):
        run("""
large = arm(80)
many, one = large.random_state(0, 50), large.random_state(0)

def work(call, given):
    while True:
        call(*given)

for target in ((robot.forward_dynamics, state), (large.mass_matrix, many[:1]),
               (large.forward_dynamics, one)):
    for _ in range(3):
        threading.Thread(target=work, args=target, daemon=True).start()
time.sleep(0.2)
""")


WAYS = {
    "pickle": lambda one: pickle.loads(pickle.dumps(one)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}


@pytest.fixture(params=WAYS)
def way(request):
    return WAYS[request.param]


def test_a_robot_goes_elsewhere_with_its_options_and_answers(name, way):
    given = load(name, tolerance=1e-10, takes_steps=True)
    asked = given.replace(asked=given.dofs[-3:], frames=list(given.frames)[-1:], at_rest=True)
    q, qd, tau = given.random_state(0, 5)
    for robot in (given, asked):
        other = way(robot)
        assert repr(other) == repr(robot) and other.plan().asked == robot.plan().asked
        assert (other.notes, other.dofs, other.at_rest) == (robot.notes, robot.dofs, robot.at_rest)
        assert other.terms.actuators == robot.terms.actuators
        np.testing.assert_array_equal(other.q0, robot.q0)
        np.testing.assert_array_equal(
            other.forward_dynamics(q, qd, tau), robot.forward_dynamics(q, qd, tau)
        )
    np.testing.assert_array_equal(other.operational(q), asked.operational(q))
    np.testing.assert_array_equal(other.random_state(1, 3).q, given.random_state(1, 3).q)


def test_frames_models_and_steps_go_elsewhere(g1, way):
    frame = way(g1.frames["pelvis"])
    assert str(frame) == str(g1.frames["pelvis"])
    q, qd, tau = g1.random_state(0, 5)
    np.testing.assert_array_equal(g1.with_model(way(g1.model)).bias(q, qd), g1.bias(q, qd))
    row = kalmarm.CoupledRow(np.eye(g1.nv)[-1] - np.eye(g1.nv)[-2], stiffness=1e4)
    for options in (
        {"damping": 3, "rows": [row]},
        {"stiffness": 1e3, "scheme": "springs_at_start"},
    ):
        step = kalmarm.ImplicitStep(g1, 0.01, **options)
        other = way(step)
        assert repr(other) == repr(step)
        for one, of_copy in zip(step(q, qd, tau), other(q, qd, tau), strict=True):
            np.testing.assert_array_equal(one, of_copy)


def test_an_error_goes_elsewhere_with_its_outcome(iiwa, way):
    with pytest.raises(kalmarm.DynamicsError) as error:
        iiwa.gravity(np.full(7, np.nan))
    other = way(error.value)
    assert type(other) is kalmarm.DynamicsError and str(other) == str(error.value)
    assert str(other.outcome) == str(error.value.outcome)


def test_kinematics_go_elsewhere(g1, way):
    given = g1.kinematics(["pelvis", "torso_link"])
    other = way(given)
    assert repr(other) == repr(given)
    assert "35 DoF" in repr(given) and "torso_link" in repr(given)
    of = (["jacobians", "momentum"], g1.q0, np.ones(g1.nv))
    for name, result in given.compute(*of).items():
        np.testing.assert_array_equal(other.compute(*of)[name], result)


def test_what_is_made_anew_says_how(iiwa, way):
    with pytest.raises(TypeError, match=r"robot\.factor\(q\) makes them again"):
        way(iiwa.factor(iiwa.q0))
    with pytest.raises(TypeError, match=r"its build\(\) makes a robot"):
        way(kalmarm.Builder())


def test_what_is_printed_says_of_which_robot_it_is(iiwa):
    builder = kalmarm.Builder("pendulum")
    builder.add_body("rod", joint="hinge", mass=1, inertia=(1, 1, 1))
    assert repr(builder) == "<kalmarm.Builder of pendulum: 1 DoF>"
    assert repr(iiwa.model) == "<kalmarm.Model of 7 DoF>"
    assert repr(iiwa.factor(iiwa.q0)) == "<kalmarm.Factors of M in one state, 7 DoF>"


def accelerations(robot, step, state):
    return robot.forward_dynamics(*state, threads=2), step.acceleration(*state)


@pytest.mark.parametrize("start", ["spawn", "fork", "forkserver"])
def test_pools_of_processes_take_robots(iiwa, start):
    step = kalmarm.ImplicitStep(iiwa, 0.01, stiffness=100)
    jobs = [(iiwa, step, iiwa.random_state(seed, 100)) for seed in range(4)]
    here = [accelerations(*job) for job in jobs]
    with multiprocessing.get_context(start).Pool(2) as pool:
        there = pool.starmap(accelerations, jobs)
    for one, other in zip(here, there, strict=True):
        np.testing.assert_array_equal(one, other)
