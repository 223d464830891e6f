"""What better factors buy: calls of an integrator and refinement, C6 and C8."""

import math
from statistics import median

from claims.claim import ABA, Check, Claim, Number, Plot, number_text, row, swept
from claims.needed import CHOLESKY, FACTORED, MGS
from read.data import Data
from read.stress import Integration, Stress, U
from summary.groups import by_key

TIP = ("heavy_tip", "float64")
GRACE = 1e8  # below, the motion itself changes with the mass ratio
LAST = 1e14
REFINED = "refined"  # the kind of variants
STARTS = 1e-3  # a first error that refinement can start from
LAW = 10
ENOUGH = 0.99
HARM = 2  # times the error before refinement


def stiffness(data: Data) -> Claim:
    """C6. On heavy_tip in float64: for every seed the calls of FactoredBias<ArrayMGS> at mass
    ratios from 1e8 to 1e14 lie within 2 % of the middle of their range, and all runs finish; and
    Cholesky, ABA and MGS with a plain bias each need more than twice its calls, or do not finish,
    at some mass ratio up to 1e14."""
    own = [it for it in data.integrations if (it.family, it.precision) == TIP]
    runs = {
        variant: dict(sorted(by_key(of_variant, lambda run: run.value).items()))
        for variant, of_variant in sorted(by_key(own, lambda run: run.variant).items())
    }
    factored = runs.get(FACTORED, {})
    reached = [group for rho, group in factored.items() if GRACE <= rho <= LAST]
    spread = _spread(sum(reached, [])) if len(reached) >= 3 else None
    what = "spread of the calls of FactoredBias, ± in %"
    blown_up = [_blows_up(it, runs.get(it, {}), factored) for it in (CHOLESKY, ABA, MGS)]
    rows = [
        _row(variant, rho, group) for variant, own in runs.items() for rho, group in own.items()
    ]
    return Claim(
        "C6",
        "No formulation stiffness",
        "With the bias carried in factored form an adaptive integrator needs the same number of "
        "calls at every mass ratio from 1e8 to 1e14; with Cholesky, ABA or a plain bias its steps "
        "collapse.",
        [Check.within(what, spread, 0, 2), *blown_up],
        Plot("mass ratio", "calls of the right-hand side", rows),
    )


def _spread(runs: list[Integration]) -> float:
    """Half the range over its middle in per cent, of the worst seed; infinite if one gave up."""
    if not all(run.finished for run in runs):
        return math.inf
    seeds = by_key(runs, lambda run: run.seed).values()
    ends = [(min(run.calls for run in own), max(run.calls for run in own)) for own in seeds]
    return max(100 * (most - least) / (most + least) for least, most in ends)


def _blows_up(variant: str, runs: dict, factored: dict) -> Check:
    common = sorted(rho for rho in runs.keys() & factored.keys() if rho <= LAST)
    first = next((rho for rho in common if _doubled(runs[rho], factored[rho])), math.inf)
    what = f"{variant} needs twice the calls"
    number = Number(f"mass ratio at which {what}", first if common else None, -math.inf, LAST)
    measured = f"from {number_text(first)}" if first <= LAST else "nowhere"
    return Check.of(number, measured, "at some mass ratio up to 1e14", what)


def _doubled(runs: list[Integration], factored: list[Integration]) -> bool:
    calls, least = (median(run.calls for run in group) for group in (runs, factored))
    return calls > 2 * least or not all(run.finished for run in runs)


def _row(variant: str, rho: float, group: list[Integration]) -> dict:
    finished = [run.calls for run in group if run.finished]
    calls = median(finished) if finished else None
    place = "heavy_tip", "integration", variant, "float64", rho
    return row(*place, calls, 1 - len(finished) / len(group), len(group))


def refinement(data: Data) -> Claim:
    """C8. Of all answers of refined variants with k >= 1 accepted steps from an error e0 < 1e-3,
    at least 99 % have an error of at most 10 max(u kS, e0^(k+1)); no answer, whatever e0, is more
    than twice as wrong as before refinement and beyond 10 u kS; and the time that Refined adds to
    ABA is at most half of ABA's, in the median over the timed scenes in float64."""
    names = [variant.name for variant in data.stress_variants if variant.kind == REFINED]
    refined = data.stress.where(variant=names)
    refined = refined.rows(refined.ok & (refined["unrefined"] >= 0))
    law = refined.rows(
        (refined["steps"] >= 1) & (refined["unrefined"] < STARTS) & (refined["kS"] >= 0)
    )
    share, harmed = None, None
    if len(law):
        bound = LAW * (law["unrefined"] ** (law["steps"] + 1)).clip(min=law.u * law["kS"])
        share = float((law["relative"] <= bound).mean())
    if len(refined):
        beyond = refined["relative"] > LAW * refined.u * refined["kS"]
        harmed = int((harmed_by_refinement(refined) & beyond).sum())
    within_law = Number(f"share within {LAW} max(u kS, e₀ᵏ⁺¹)", share, ENOUGH, math.inf)
    spoilt = Number("answers made twice as wrong", harmed, -math.inf, 0)
    added = Check.at_most("time added to ABA / ABA’s", _added_time(data), 0.5)
    checks = [
        Check.of(within_law, f"{100 * (share or 0):.1f} %", "at least 99 %"),
        Check.of(spoilt, f"{harmed} of {len(refined)}", "0"),
        added._replace(timed=True),
    ]
    variants = (ABA, CHOLESKY, f"Refined<{ABA}>", f"Refined<{CHOLESKY}>", f"Refined<{MGS}>")
    drawn = data.laboratory, ["heavy_tip"], ("random", "dynamics"), U, variants
    return Claim(
        "C8",
        "The refinement law",
        "k refinement steps with the Newton–Euler residual leave an error of "
        "max(u kS, e₀ᵏ⁺¹) within a factor 10, whatever the factorisation, for half the time of "
        "ABA; where they would do harm the guard refuses them.",
        checks,
        swept("mass ratio", *drawn),
    )


def harmed_by_refinement(rows: Stress):
    """Which answers are more wrong than before, by more than rounding can make them."""
    return rows.ok & (rows["relative"] > HARM * rows["unrefined"])


def _added_time(data: Data) -> float | None:
    """As a share of ABA's own time."""
    times = {time[:4]: time.nanoseconds for time in data.times if time.nanoseconds}
    added = [
        times[scene, f"Refined<{ABA}>", precision, task] / nanoseconds - 1
        for (scene, variant, precision, task), nanoseconds in times.items()
        if (variant, precision, task) == (ABA, "float64", "acceleration")
        and (scene, f"Refined<{ABA}>", precision, task) in times
    ]
    return median(added) if added else None
