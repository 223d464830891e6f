"""What shows an error and what does not: C7 and C9."""

import math
from itertools import permutations

from charts.text import share_text
from claims.claim import ABA, Check, Claim, Number, Plot, collect, number_text, row_of, swept
from claims.needed import CHOLESKY, INVERTING, JOSEPH, JUDGED
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import WRONG, U
from summary.groups import by_key

APART = 1e6  # forward errors that differ so much should show in a residual
ALIKE = 30
SMALL = 10  # in units of u: a residual that shows nothing
FACTOR = 3
FLAGGED = 0.9


def residuals(data: Data) -> Claim:
    """C7. Float64, swept families, medians. Of every pair of methods on the same mechanisms whose
    forward errors differ by 1e6 or more, the worse one's residual is less than 30 times that of
    the better one: the Oettli–Prager error of a = M⁻¹τ for random torques, and |M X − I| of the
    inverse. Over those methods the first is at most 10 u, and the second at most 10 u times the
    scaled condition number. Open where no such pair was measured."""
    lab = data.laboratory
    pairs = _pairs(lab, "random", JUDGED)
    inverse = _pairs(lab, "inverse", INVERTING)
    checks = [
        *_blind("Oettli–Prager", pairs, "oettli_prager", lambda p: p.u),
        *_blind("|M X − I|", inverse, "backward", lambda p: p.u * p.kappa_scaled),
    ]
    judged = dict.fromkeys(point for pair in (*pairs, *inverse) for point in pair)
    rows = [
        row_of(point, x=point.error, error=residual, share=0)
        for point in judged
        if (residual := point.backward if point.task == "inverse" else point.oettli_prager) > 0
    ]
    return Claim(
        "C7",
        "Residuals lie",
        "|M M⁻¹ − I| and the Oettli–Prager backward error are small for all methods, and hardly "
        "differ between methods whose forward errors differ by six orders of magnitude.",
        checks,
        Plot("median forward error", "median residual", rows, lines=False),
    )


def _pairs(lab: Laboratory, task: str, variants) -> list[tuple[Point, Point]]:
    """Worse and better of every two methods whose errors are that far apart."""
    points = collect(lab, lab.swept, [task], ["float64"], variants)
    finite = [point for point in points if math.isfinite(point.error)]
    cases = by_key(finite, lambda point: (point.family, point.value))
    return [
        (worse, better)
        for points in cases.values()
        for worse, better in permutations(points, 2)
        if worse.error >= APART * max(better.error, better.u / 100)
    ]


def _blind(name: str, pairs: list[tuple[Point, Point]], residual: str, scale) -> list[Check]:
    unit = "u" if residual == "oettli_prager" else "u · scaled κ"
    finite = [
        (worse, better)
        for worse, better in pairs
        if math.isfinite(getattr(worse, residual)) and math.isfinite(getattr(better, residual))
    ]
    ratios, sizes = [], []
    for worse, better in finite:
        ratio = getattr(worse, residual) / max(getattr(better, residual), worse.u / 100)
        ratios.append((ratio, f"{worse.family} {worse.value:g}, {len(finite)} pairs"))
        for point in (worse, better):
            size = getattr(point, residual) / scale(point)
            sizes.append((size, f"{point.family} {point.value:g}"))
    return [
        Check.largest(f"{name}: the worse method’s / the better one’s", ratios, ALIKE),
        Check.largest(f"{name}: largest, in {unit}", sizes, SMALL),
    ]


def silence(data: Data) -> Claim:
    """C9. On heavy_tip for random torques, in each precision measured: over a stretch of
    neighbouring mass ratios of at least a decade ABA's median error is above 1 % while no seed
    ends as singular, indefinite or not finite. And over that stretch ABA's own estimate, plain or
    before refinement was refused, lies within a factor 3 of the error in at least 90 % of the
    answers that have one."""
    lab = data.laboratory
    checks, near = [], []
    for precision in U:
        points = lab.series("heavy_tip", "random", precision, ABA)
        low, high = _stretch(points)
        decades, where = 0.0 if points else None, ""
        if low > 0:
            decades, where = math.log10(high / low), f"{number_text(low)} to {number_text(high)}"
            near += _estimates(data, precision, low, high)
        checks.append(Check.at_least(f"decades of silence, {precision}", decades, 1, where))
    share = sum(near) / len(near) if near else None
    number = Number(f"estimates within a factor {FACTOR}", share, FLAGGED, math.inf)
    measured = f"{share_text(share)} of {number_text(len(near))}"
    checks.append(Check.of(number, measured, f"at least {share_text(FLAGGED)}"))
    variants = (ABA, JOSEPH, CHOLESKY)
    return Claim(
        "C9",
        "Wrong before it shows",
        "There is a decade of mass ratios over which ABA is more than 1 % wrong and no D is "
        "negative; the error estimate shows it.",
        checks,
        swept("mass ratio", lab, ["heavy_tip"], ["random"], U, variants),
    )


def _stretch(points: list[Point]) -> tuple[float, float]:
    """The longest run of neighbouring values where the answer is wrong and nothing failed."""
    best, first = (0.0, 0.0), None
    for point in points:
        if WRONG < point.error < math.inf and not point.failures:
            first = first or point.value
            if not best[0] or point.value / first > best[1] / best[0]:
                best = (first, point.value)
        else:
            first = None
    return best


def _estimates(data: Data, precision: str, low: float, high: float) -> list[bool]:
    """Of each estimate over the stretch, whether it is near."""
    rows = data.stress.where(
        family="heavy_tip", task="random", precision=precision, variant=(ABA, f"Refined<{ABA}>")
    )
    rows = rows.rows(
        rows.wrong & (rows["value"] >= low) & (rows["value"] <= high) & (rows["estimate"] >= 0)
    )
    return within_factor(rows).tolist()


def within_factor(rows):
    """Which estimates lie within the factor of the true error."""
    return (rows["estimate"] <= FACTOR * rows["relative"]) & (
        rows["relative"] <= FACTOR * rows["estimate"]
    )
