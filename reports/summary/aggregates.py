"""What a variant is over many robots.

With t(p, s) the time of variant s on robot p, infinite where it does not answer,
  r(p, s) = t(p, s) / min over s of t(p, s)          times slower than the best
  G(s)    = exp(mean of log r(p, s))                 over the robots that s answers
  rho(s, tau) = share of the robots with r(p, s) <= tau
rho is the performance profile of Dolan and More (Mathematical Programming 91, 2002): at tau = 1 the
share on which s is the fastest, at the right end the share that it answers. Robots that nobody
answers tell nothing of times and are left out of r, but not of the share answered. All depend on
which variants take part.
"""

import math
import statistics

Solver = tuple[str, str]  # variant and precision


def slowdowns(times: dict[str, dict[Solver, float | None]]) -> dict[Solver, list[float]]:
    """r(p, s) by s, in the order of the robots; `times` has None where s does not answer."""
    solvers = {solver for found in times.values() for solver in found}
    result = {solver: [] for solver in sorted(solvers)}
    for found in times.values():
        best = min((time for time in found.values() if time is not None), default=None)
        if best is None:
            continue
        for solver, ratios in result.items():
            time = found.get(solver)
            ratios.append(math.inf if time is None else time / best)
    return result


def share_answered(times: dict[str, dict[Solver, float | None]], solver: Solver) -> float:
    return statistics.fmean(found.get(solver) is not None for found in times.values())


def geometric_mean(ratios: list[float]) -> float | None:
    """Over the finite ones; None where there are none."""
    finite = [ratio for ratio in ratios if math.isfinite(ratio)]
    return statistics.geometric_mean(finite) if finite else None


def profile(ratios: list[float]) -> list[tuple[float, float]]:
    """The corners (tau, rho) of the steps: rho keeps its value up to the next tau."""
    finite = sorted({ratio for ratio in ratios if math.isfinite(ratio)})
    return [(tau, sum(ratio <= tau for ratio in ratios) / len(ratios)) for tau in finite]
