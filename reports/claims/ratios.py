"""How errors grow with ratios of masses, with offsets and with gaps: C3, C4 and C5."""

import math

from claims.claim import (
    ABA,
    RISING,
    Check,
    Claim,
    Number,
    collect,
    number_text,
    rising,
    slope,
    swept,
)
from claims.needed import CHOLESKY, GIVENS, HOUSEHOLDER, JOSEPH, MGS, POTTER, UD, WORLD, ZEROED
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import U

GIVENS_FLAT = {"float64": 1e20, "float32": 1e16}
GAP = 1e-6
FLAT = 0.1  # an exponent below is none


def tiers(data: Data) -> Claim:
    """C3. Random torques, exponents of the median error in the mass ratio rho, each of at least
    three values. On heavy_tip where the error is above 100 u and below 0.1: 1 ± 0.25 for ABA,
    Joseph and Cholesky in float64, and for MGS in float32 beyond rho = 1/u. On heavy_point, the
    same window: 0.5 ± 0.2 for Householder and Potter. On heavy_tip 0 ± 0.1 for MGS and UD up to
    rho = 1/u and for Givens up to 1e20 (float32: 1e16). At every rho from 1e12 to 1e16 Givens in
    float32 is more accurate than ABA in float64."""
    lab = data.laboratory

    def tip(precision: str, variant: str, low: float = 0, high: float = math.inf) -> list[Point]:
        points = lab.series("heavy_tip", "random", precision, variant)
        return [point for point in points if low <= point.value <= high]

    def point_mass(variant: str) -> list[Point]:
        return lab.series("heavy_point", "random", "float64", variant)

    checks = [
        Check.slope(f"{variant}, float64", rising(tip("float64", variant)), 1, 0.25)
        for variant in (ABA, JOSEPH, CHOLESKY)
    ]
    checks += [
        Check.slope(f"{variant}, float64, point mass", rising(point_mass(variant)), 0.5, 0.2)
        for variant in (HOUSEHOLDER, POTTER)
    ]
    for precision, u in U.items():
        for variant, end in ((MGS, 1 / u), (UD, 1 / u), (GIVENS, GIVENS_FLAT[precision])):
            what = f"{variant}, {precision}, up to {number_text(end)}"
            checks.append(_flat(what, tip(precision, variant, high=end)))
    beyond = rising(tip("float32", MGS, low=1 / U["float32"]))
    checks.append(Check.slope(f"{MGS}, float32, beyond 1/u", beyond, 1, 0.25))
    float64 = {p.value: p.error for p in tip("float64", ABA, 1e12, 1e16)}
    ratios = [
        p.error / float64[p.value]
        for p in tip("float32", GIVENS, 1e12, 1e16)
        if p.value in float64 and min(p.error, float64[p.value]) < math.inf
    ]
    what = "error of Givens in float32 / that of ABA in float64, from 1e12 to 1e16"
    checks.append(Check.at_most(what, max(ratios, default=None), 1))
    variants = (CHOLESKY, ABA, JOSEPH, HOUSEHOLDER, POTTER, MGS, UD, GIVENS)
    return Claim(
        "C3",
        "Three tiers",
        "With a heavy body at the free end the error grows with the mass ratio ρ like ρ in ABA, "
        "Joseph and Cholesky, like √ρ in Householder and Potter on point masses, not at all in "
        "MGS and UD up to 1/u, and never in Givens.",
        checks,
        swept("mass ratio", lab, ("heavy_tip", "heavy_point"), ["random"], U, variants),
    )


def _flat(what: str, points: list[Point], tolerance: float = FLAT) -> Check:
    """A failure is no error to fit, and not flat."""
    if any(math.isinf(point.error) for point in points):
        failed = Number(what, math.inf, -tolerance, tolerance)
        return Check.of(failed, "failed", f"0 ± {tolerance:g}")
    return Check.slope(what, slope(points), 0, tolerance)


def joseph(data: Data) -> Claim:
    """C4. In float64 for random torques: wherever ABA's median error is above 100 u, it is at
    most 10 times that of Joseph, on every swept family; and in world axes about the world's
    origin the exponents in the base's offset are 4 ± 0.5 for Joseph, 2 ± 0.5 for the conventional
    form, 1 ± 0.5 for MGS, where errors are above 100 u and below 0.1."""
    lab = data.laboratory
    checks = [Check.largest("largest gain of Joseph over ABA", _gains(lab), 10)]
    for variant, expected in WORLD.items():
        points = lab.series("base_offset", "random", "float64", variant)
        checks.append(Check.slope(f"{variant}, in the offset", rising(points), expected, 0.5))
    drawn = ["base_offset"], ["random"], ["float64"], (*WORLD, ABA, JOSEPH, MGS)
    return Claim(
        "C4",
        "Joseph’s form is no cure",
        "Without measurement noise Joseph’s form is never ten times better than the conventional "
        "one, and in the world’s frame its error grows like the fourth power of the base’s offset, "
        "against the square, and the first power of a square root.",
        checks,
        swept("offset of the base", lab, *drawn),
    )


def _gains(lab: Laboratory) -> list[tuple[float, str]]:
    """How many times Joseph's error ABA's is, where that is not small; with family and value."""
    joseph, aba = (
        collect(lab, lab.swept, ["random"], ["float64"], [variant]) for variant in (JOSEPH, ABA)
    )
    errors = {(p.family, p.value): p.error for p in joseph if math.isfinite(p.error)}
    return [
        (p.error / max(errors[p.family, p.value], p.u / RISING), f"{p.family} {p.value:g}")
        for p in aba
        if p.error > RISING * p.u and (p.family, p.value) in errors
    ]


def constraints(data: Data) -> Claim:
    """C5. On axis_gap, random torques, float64: the error with both constraints kept exactly
    (Zeroed) has exponent 0 ± 0.2 in the gap down to 1e-6, at that gap it is 1e4 times smaller
    than ABA's, and ABA's exponent is at most -0.5 where its error is above 100 u."""
    lab = data.laboratory
    aba, zeroed = (
        [p for p in lab.series("axis_gap", "random", "float64", variant) if p.value >= 0.99 * GAP]
        for variant in (ABA, ZEROED)
    )
    gain = None
    at_gap = [points[0] for points in (aba, zeroed) if points and points[0].value <= 1.01 * GAP]
    if len(at_gap) == 2 and math.isfinite(zeroed[0].error):
        gain = aba[0].error / max(zeroed[0].error, U["float64"] / RISING)
    growth = rising(aba)
    variants = (CHOLESKY, ABA, ZEROED, MGS, UD)
    return Claim(
        "C5",
        "Exact constraints",
        "Keeping H P⁺ = 0 and H z⁺ = τ exactly makes the error of the covariance form independent "
        "of the gap between parallel axes, 4 digits better at a gap of 1e-6.",
        [
            _flat("exponent with both kept", zeroed, 0.2),
            Check.at_least(f"gain over ABA at a gap of {number_text(GAP)}", gain, 1e4),
            Check.at_most("exponent of ABA", growth and growth.exponent, -0.5),
        ],
        swept("gap between the axes", lab, ["axis_gap"], ["random"], U, variants),
    )
