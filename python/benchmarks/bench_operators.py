"""Times of the operators of JAX and PyTorch over the robot's call of rows, and of their gradients.

    python python/benchmarks/bench_operators.py          # with kalmarm, and jax or torch or both

Every contender's answer is checked. In each round all contenders run in turn; ratios are taken within a round, and of them
the median is printed; of times also the fastest round. Contenders take arrays that their framework made, and end when the result is there.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from bench import check, load, machine, rounds_of, summary, timed

import kalmarm

BASE = "robot, out="
AGREE = 1e-12  # of rows, which are the same calls
AGREE_GRADIENTS = 1e-3  # of float32


def of_robot(robot: kalmarm.Robot, x: Any, threads: int) -> dict[str, Callable[[], Any]]:
    out, ones = np.empty_like(x.qd), np.ones_like(x.qd)
    calls: dict[str, Callable[[], Any]] = {
        BASE: lambda: robot.forward_dynamics(*x, out, threads=threads),
        "robot": lambda: robot.forward_dynamics(*x, threads=threads),
        "robot, vjp": lambda: robot.forward_dynamics_vjp(*x, ones, threads=threads).dtau,
    }
    return calls


def of_jax(robot: kalmarm.Robot, x: Any, threads: int) -> dict[str, Callable[[], Any]]:
    import jax
    import jax.numpy as jnp

    import kalmarm.jax

    jax.config.update("jax_enable_x64", True)

    def forward(q: Any, qd: Any, tau: Any) -> Any:
        return kalmarm.jax.forward_dynamics(robot, q, qd, tau, threads=threads)

    arrays = [jnp.asarray(part) for part in x]
    operator = jax.jit(forward)
    gradient = jax.jit(jax.grad(lambda *y: jnp.sum(forward(*y)), argnums=(0, 1, 2)))
    return {
        "JAX": lambda: operator(*arrays).block_until_ready(),
        "JAX, gradient": lambda: jax.block_until_ready(gradient(*arrays))[2],
    }


def of_torch(robot: kalmarm.Robot, x: Any, threads: int) -> dict[str, Callable[[], Any]]:
    import torch

    import kalmarm.torch

    torch.set_num_threads(max(threads, 1))
    tensors = [torch.as_tensor(part) for part in x]
    leaves = [part.clone().requires_grad_() for part in tensors]

    def gradient() -> Any:
        total = kalmarm.torch.forward_dynamics(robot, *leaves, threads=threads).sum()
        return torch.autograd.grad(total, leaves)[2]

    return {
        "PyTorch": lambda: kalmarm.torch.forward_dynamics(robot, *tensors, threads=threads),
        "PyTorch, gradient": gradient,
    }


def times(name: str, dtype: str, options: argparse.Namespace) -> None:
    robot = load(name)
    x = robot.random_state(1, options.states, dtype=dtype)
    contenders = of_robot(robot, x, options.threads)
    for module, of in (("jax", of_jax), ("torch", of_torch)):
        if importlib.util.find_spec(module):
            contenders |= of(robot, x, options.threads)
    truth = {False: contenders[BASE](), True: contenders["robot, vjp"]()}
    for contender, call in contenders.items():
        is_gradient = contender.endswith(("vjp", "gradient"))
        check(contender, np.asarray(call()), truth[is_gradient], AGREE_GRADIENTS if is_gradient else AGREE)
    runs = {contender: timed(call) for contender, call in contenders.items()}
    seconds = rounds_of(runs, options.rounds, options.seconds)
    for contender, one in seconds.items():
        ratio = summary(np.array(one) / seconds[BASE])
        print(
            f"{name:8} {dtype:8} {contender:18} {1e6 * np.median(one):9.1f} {1e6 * min(one):9.1f} "
            f"{ratio['median']:7.2f}"
        )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", nargs="+", default=["panda", "g1"], metavar="NAME")
    parser.add_argument("--dtypes", nargs="+", default=["float64", "float32"])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--states", type=int, default=1024)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--seconds", type=float, default=0.1, help="of a contender in a round")
    options = parser.parse_args(arguments)
    about = machine()
    print(f"{about['cpu']}, {about['cores']} cores, {about['instruction_set']}; {options.states} states")
    print(f"{'robot':8} {'dtype':8} {'contender':18} {'us':>9} {'fastest':>9} {'ratio':>7}")
    for name in options.robots:
        for dtype in options.dtypes:
            times(name, dtype, options)


if __name__ == "__main__":
    sys.exit(main())
