"""Processes: what forks, ends, and goes to other processes."""

import os
import signal
import subprocess
import sys

import pytest

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
