"""Times of forward dynamics in Python: over the same call in C++, and beside what else a user would
write.

    scripts/test_python --times times.json                   # or, with kalmarm, mujoco and pin:
    python python/benchmarks/bench.py --output times.json

Every contender's answer is checked. In each round all contenders run in turn, so that what slows
the machine slows all. Ratios and differences are taken within a round; of them, as of times,
medians and quartiles over the rounds are given.

C++ times come from a loop within the module (`Robot._time_forward_dynamics`): the same code at the
same addresses, on the same arrays. A program of its own would lay out code and memory otherwise,
which changes times of small robots by more than the difference that is looked for.

What others do differently:
- pin.aba in a loop: float64. pin.abaInParallel, on one core too: its loop is in C++.
- mj_forward in a loop: float64; from M and its factors; contacts, constraints, actuators and
  passive forces off. It stores much besides: frames of bodies and sites, velocities, forces.
- mujoco.rollout: one step of it each, so that it integrates too, and returns the next state.
"""

from __future__ import annotations

import argparse
import datetime
import json
import os
import platform
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np
import pinocchio as pin

import kalmarm

ROBOTS = Path(__file__).parents[2] / "robots" / "models"
SINGLE_STATES = 251  # that calls of one state cycle through
AGREE = 1e-8  # of answers, relative to the largest entry of a
AGREE_ROLLOUT = 1e-6  # of velocities' differences over a step

Contender = Callable[[], Any]


def summary(values: Iterable[float]) -> dict[str, float]:
    low, median, high = np.percentile(list(values), [25, 50, 75])
    return {"median": float(median), "low": float(low), "high": float(high)}


def rounds_of(
    contenders: dict[str, Callable[[int], float]], rounds: int, least: float
) -> dict[str, list[float]]:
    """Seconds of a call, by contender and round; each is called for `least` seconds a round.

    A contender takes a number of calls and returns the seconds that all of them took.
    """
    calls = {}
    for name, run in contenders.items():
        n = 1
        while (seconds := run(n)) < least / 4:
            n *= 4
        calls[name] = max(1, round(n * least / seconds))
    out: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, run in contenders.items():
            out[name].append(run(calls[name]) / calls[name])
    return out


def timed(call: Contender) -> Callable[[int], float]:
    def run(calls: int) -> float:
        start = time.perf_counter()
        for _ in range(calls):
            call()
        return time.perf_counter() - start

    return run


def check(name: str, found: Any, truth: Any, bound: float) -> None:
    error = np.abs(found - truth).max() / np.abs(truth).max()
    if not error < bound:
        raise SystemExit(f"bench: error: {name} is {error:.1e} off, within {bound:.0e} is wanted")


def load(name: str) -> kalmarm.Robot:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return kalmarm.load(ROBOTS / name / f"{name}.xml", wants=["acceleration"])


def single_state(
    robot: kalmarm.Robot, dtype: str, options: argparse.Namespace
) -> dict[str, list[float]]:
    """Seconds of a call of one state."""
    arrays = robot.random_state(0, SINGLE_STATES, dtype=dtype)
    rows = list(zip(*arrays))
    outs = np.empty((SINGLE_STATES, robot.nv), dtype)
    scratch = np.empty_like(outs)
    forward = robot.forward_dynamics

    def fresh() -> None:
        for q, qd, tau in rows:
            forward(q, qd, tau)

    with_out = [(*row, out) for row, out in zip(rows, outs)]

    def given() -> None:
        for q, qd, tau, out in with_out:
            forward(q, qd, tau, out)

    contenders = {
        "C++": lambda calls: robot._time_forward_dynamics(*arrays, scratch, calls, singly=True),
        "Python": timed(fresh),
        "Python, out=": timed(given),
    }
    passes = rounds_of(contenders, options.rounds, options.seconds)
    check("the C++ loop", scratch, outs, np.finfo(dtype).eps)
    return {name: [x / SINGLE_STATES for x in one] for name, one in passes.items()}


def batch(
    robot: kalmarm.Robot, dtype: str, threads: int, options: argparse.Namespace
) -> dict[str, list[float]]:
    """Seconds a state of a call of many."""
    arrays = robot.random_state(1, options.states, dtype=dtype)
    out, scratch = np.empty_like(arrays.qd), np.empty_like(arrays.qd)
    contenders = {
        "C++": lambda calls: robot._time_forward_dynamics(*arrays, scratch, calls, threads=threads),
        "Python": timed(lambda: robot.forward_dynamics(*arrays, threads=threads)),
        "Python, out=": timed(lambda: robot.forward_dynamics(*arrays, out, threads=threads)),
    }
    seconds = rounds_of(contenders, options.rounds, options.seconds)
    check("the C++ loop", scratch, out, np.finfo(dtype).eps)
    return {name: [x / options.states for x in one] for name, one in seconds.items()}


def pinocchio_contenders(
    file: Path, threads: int, robot: kalmarm.Robot, options: argparse.Namespace
) -> dict[str, Contender]:
    model = pin.buildModelFromMJCF(str(file))
    model.damping[:] = 0
    model.friction[:] = 0
    ours = kalmarm.PinocchioStates(model)
    rng = np.random.default_rng(2)
    limits = np.maximum(model.lowerPositionLimit, -1.0), np.minimum(model.upperPositionLimit, 1.0)
    pin.seed(2)
    q = np.array([pin.randomConfiguration(model, *limits) for _ in range(options.states)])
    v, tau = rng.standard_normal((2, options.states, model.nv))
    data, pool = model.createData(), pin.ModelPool(model, threads)
    a = np.empty_like(v)

    def loop() -> Any:
        for i in range(len(q)):
            a[i] = pin.aba(model, data, q[i], v[i], tau[i])
        return a

    q_columns, v_columns, tau_columns = (np.asfortranarray(x.T) for x in (q, v, tau))
    a_columns = np.empty_like(v_columns)

    def parallel() -> Any:
        pin.abaInParallel(threads, pool, q_columns, v_columns, tau_columns, a_columns)
        return a_columns.T

    truth = ours.a(q, v, robot.forward_dynamics(ours.q(q), ours.qd(q, v), ours.tau(q, tau)))
    out = {"pin.abaInParallel": parallel} | ({"pin.aba in a loop": loop} if threads == 1 else {})
    for name, call in out.items():
        check(name, call(), truth, AGREE)
    return out


def mujoco_contenders(
    file: Path, threads: int, robot: kalmarm.Robot, options: argparse.Namespace
) -> dict[str, Contender]:
    model = mujoco.MjModel.from_xml_path(str(file))
    flags = mujoco.mjtDisableBit
    for flag in ("CONTACT", "CONSTRAINT", "ACTUATION", "SPRING", "DAMPER"):
        model.opt.disableflags |= int(getattr(flags, "mjDSBL_" + flag))
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    datas = [mujoco.MjData(model) for _ in range(threads)]
    data = datas[0]
    q, qd, tau = robot.random_state(1, options.states)
    truth = robot.forward_dynamics(q, qd, tau)
    a = np.empty_like(qd)

    def loop() -> Any:
        for i in range(len(q)):
            data.qpos, data.qvel, data.qfrc_applied = q[i], qd[i], tau[i]
            mujoco.mj_forward(model, data)
            a[i] = data.qacc
        return a

    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.empty((len(q), mujoco.mj_stateSize(model, kind)))
    for i in range(len(q)):
        data.qpos, data.qvel = q[i], qd[i]
        mujoco.mj_getState(model, data, start[i], kind)
    ends, sensors = np.empty((len(q), 1, start.shape[1])), np.empty((len(q), 1, model.nsensordata))
    applied = tau[:, None, :]
    workers = mujoco.rollout.Rollout(nthread=threads if threads > 1 else 0)
    spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)

    def rollout() -> Any:
        workers.rollout(
            model, datas, start, applied, control_spec=spec, state=ends, sensordata=sensors
        )
        velocity = 1 + model.nq
        return (ends[:, 0, velocity : velocity + model.nv] - qd) / model.opt.timestep

    check("mujoco.rollout", rollout(), truth, AGREE_ROLLOUT)
    out: dict[str, Contender] = {
        "mujoco.rollout": lambda: workers.rollout(
            model, datas, start, applied, control_spec=spec, state=ends, sensordata=sensors
        )
    }
    if threads == 1:
        check("mj_forward in a loop", loop(), truth, AGREE)
        out["mj_forward in a loop"] = loop
    return out


def peers(
    name: str, robot: kalmarm.Robot, threads: int, options: argparse.Namespace
) -> dict[str, list[float]]:
    """Seconds a state of many, ours in both dtypes and what else there is."""
    file = ROBOTS / name / f"{name}.xml"
    contenders = {}
    for dtype in options.dtypes:
        arrays = robot.random_state(1, options.states, dtype=dtype)
        contenders[f"kalmarm, {dtype}"] = (
            lambda arrays=arrays: robot.forward_dynamics(*arrays, threads=threads)
        )
    contenders |= pinocchio_contenders(file, threads, robot, options)
    contenders |= mujoco_contenders(file, threads, robot, options)
    runs = {name: timed(call) for name, call in contenders.items()}
    seconds = rounds_of(runs, options.rounds, options.seconds)
    return {name: [x / options.states for x in one] for name, one in seconds.items()}


def record(
    what: str, robot: str, dtype: str, threads: int, contender: str, seconds: list[float]
) -> dict[str, Any]:
    nanoseconds = [1e9 * x for x in seconds]
    return {
        "what": what,
        "robot": robot,
        "dtype": dtype,
        "threads": threads,
        "contender": contender,
        "nanoseconds": summary(nanoseconds),
        "rounds": nanoseconds,
    }


def over_cpp(
    what: str, robot: str, dtype: str, threads: int, seconds: dict[str, list[float]]
) -> list[dict[str, Any]]:
    out = [record(what, robot, dtype, threads, name, one) for name, one in seconds.items()]
    base = np.array(out[0]["rounds"])
    for one in out[1:]:
        one["more_nanoseconds"] = summary(one["rounds"] - base)
        one["times_cpp"] = summary(one["rounds"] / base)
    return out


def beside_peers(
    robot: str, dtypes: list[str], threads: int, seconds: dict[str, list[float]]
) -> list[dict[str, Any]]:
    ours = {f"kalmarm, {dtype}": dtype for dtype in dtypes}
    out = []
    for name, one in seconds.items():
        out.append(record("peers", robot, ours.get(name, "float64"), threads, name, one))
        if name not in ours:
            out[-1]["times_ours"] = {
                dtype: summary(np.array(one) / seconds[mine]) for mine, dtype in ours.items()
            }
    return out


def results(options: argparse.Namespace) -> list[dict[str, Any]]:
    """One record a contender, with what it is compared with."""
    out = []
    for name in options.robots:
        robot = load(name)
        for dtype in options.dtypes:
            one = single_state(robot, dtype, options)
            out += over_cpp("one state", name, dtype, 1, one)
            for threads in options.threads:
                many = batch(robot, dtype, threads, options)
                out += over_cpp("batch", name, dtype, threads, many)
        for threads in options.threads:
            many = peers(name, robot, threads, options)
            out += beside_peers(name, options.dtypes, threads, many)
    return out


def machine() -> dict[str, Any]:
    found = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return {
        "cpu": found[1] if found else platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "instruction_set": kalmarm.instruction_set(),
    }


def versions() -> dict[str, str]:
    modules = {"kalmarm": kalmarm, "numpy": np, "mujoco": mujoco, "pinocchio": pin}
    return {"python": platform.python_version()} | {
        name: module.__version__ for name, module in modules.items()
    }


def compared(one: dict[str, Any]) -> str:
    if "times_ours" in one:
        ratios = one["times_ours"].items()
        return ", ".join(f"{ratio['median']:.1f} x ours in {dtype}" for dtype, ratio in ratios)
    if "times_cpp" not in one:
        return ""
    if one["what"] == "one state":
        return f"{one['more_nanoseconds']['median']:+.0f} ns over C++"
    return f"{100 * (one['times_cpp']['median'] - 1):+.1f} % over C++"


def table(document: dict[str, Any]) -> str:
    about = document["machine"]
    lines = [
        f"{about['cpu']}, {about['cores']} cores, {about['instruction_set']}, {document['date']}; "
        + ", ".join(f"{name} {version}" for name, version in document["versions"].items()),
        f"batches of {document['states']} states, {document['number_of_rounds']} rounds",
        "",
        f"{'what':10} {'robot':8} {'dtype':8} {'cores':>5}  {'contender':22} {'ns a state':>10} "
        f"{'quartiles':>17}  compared",
    ]
    for one in document["results"]:
        ns = one["nanoseconds"]
        lines.append(
            f"{one['what']:10} {one['robot']:8} {one['dtype']:8} {one['threads']:5}  "
            f"{one['contender']:22} {ns['median']:10.0f} {ns['low']:8.0f} {ns['high']:8.0f}  "
            f"{compared(one)}".rstrip()
        )
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", nargs="+", default=["iiwa14", "g1"], metavar="NAME")
    parser.add_argument("--dtypes", nargs="+", default=["float64", "float32"])
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2], metavar="N")
    parser.add_argument("--states", type=int, default=4096, help="of a batch")
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--seconds", type=float, default=0.1, help="of a contender in a round")
    parser.add_argument("--output", type=Path, metavar="FILE", help="JSON, every round in it")
    options = parser.parse_args(arguments)
    document = {
        "schema": "kalmarm-python-times-1",
        "date": datetime.date.today().isoformat(),
        "machine": machine(),
        "versions": versions(),
        "states": options.states,
        "number_of_rounds": options.rounds,
        "results": results(options),
    }
    print(table(document))
    if options.output:
        options.output.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
