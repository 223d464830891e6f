"""Which condition number an error follows: C1, C2 and C10."""

import math
from statistics import correlation, median

from claims.claim import (
    ABA,
    LOST,
    Check,
    Claim,
    Number,
    Plot,
    collect,
    number_text,
    range_text,
    row_of,
    slope,
    swept,
)
from claims.needed import CHOLESKY, GIVENS, MGS, UD
from read.data import Data
from read.laboratory import Laboratory
from read.stress import U
from summary.groups import by_key
from summary.points import FIT_FROM

LENGTHS = ("straight", "zigzag", "bent", "folded", "random_chain")
POINT_MASSES = "non_minimum_phase_length"
INERTIA = "non_minimum_phase"
GROWTH = (1 / 0.3 - 1) ** 2  # of the filter's errors a link, the centre of mass at 0.3


def length(data: Data) -> Claim:
    """C1. Holds if, for random torques in float64, in every family of chains that was measured,
    ABA's exponent in N (N >= 15) is at most 0.2 and its median error at most 10 u kS, and on the
    straight chain Cholesky's exponent is at least 3 where its error is below 0.1."""
    lab = data.laboratory
    exponents, etas = [], []
    for name in LENGTHS:
        points = lab.series(name, "random", "float64", ABA)
        etas += [(point.eta, name) for point in points]
        if fit := slope(points, smallest=FIT_FROM):
            exponents.append((fit.exponent, name))
    straight = lab.series("straight", "random", "float64", CHOLESKY)
    cholesky = slope(straight, high=LOST, smallest=FIT_FROM)
    return Claim(
        "C1",
        "Structured, not spectral",
        "For random torques the error of ABA does not depend on N, while that of Cholesky grows "
        "like the condition number, N⁴ on a straight chain.",
        [
            Check.largest("exponent of ABA’s error in N, the steepest family", exponents, 0.2),
            Check.largest("ABA’s largest median η", etas, 10),
            Check.at_least(
                "exponent of Cholesky’s error, straight chain", cholesky and cholesky.exponent, 3
            ),
        ],
        swept("N", lab, LENGTHS, ("random", "consistent"), U, (ABA, MGS, CHOLESKY)),
    )


def scaled_condition(data: Data) -> Claim:
    """C2. Over all swept families where u kappa_scaled <= 0.1, random torques: log of Cholesky's
    median error and log of u kappa_scaled correlate above 0.95, every family's median of their
    ratio lies in 0.01 to 2 (a failure is an infinite error), and kappa(M) correlates less. Needs
    three families."""
    lab = data.laboratory
    points = {
        point: point.u * point.kappa_scaled
        for point in collect(lab, lab.swept, ["random"], U, [CHOLESKY])
        if point.kappa_scaled >= 1 and point.u * point.kappa_scaled <= LOST
    }
    scaled = plain = None
    medians = [
        (median(point.error / points[point] for point in own), family)
        for family, own in by_key(points, lambda point: point.family).items()
    ]
    (least, easiest), (most, hardest) = (None, ""), (None, "")
    if len(medians) >= 3:
        scaled, plain = (_correlation(points, name) for name in ("kappa_scaled", "kappa"))
        (least, easiest), (most, hardest) = min(medians), max(medians)
    ratio = "median error / (u · scaled κ) of a family"
    return Claim(
        "C2",
        "The scaled condition number is Cholesky’s",
        "Cholesky’s error is 0.01 to 2 times u times the condition number of M scaled to a unit "
        "diagonal, on all families; the condition number of M itself says less.",
        [
            Check.at_least("correlation with u · scaled κ", scaled, 0.95),
            Check.within(f"{ratio}: least", least, 0.01, 2, easiest),
            Check.within(f"{ratio}: largest", most, 0.01, 2, hardest),
            _correlates_less(plain, scaled),
        ],
        Plot(
            "u · condition number of M scaled to a unit diagonal",
            "median relative error",
            [row_of(point, x=x) for point, x in points.items()],
            lines=False,
        ),
    )


def _correlates_less(plain: float | None, scaled: float | None) -> Check:
    what = "correlation with u · κ(M)"
    more = None if plain is None else plain - scaled
    number = Number(f"{what}, less that with u · scaled κ", more, -math.inf, 0)
    if more is None:
        return Check.of(number, "", "less", what)
    return Check.of(number, number_text(plain), range_text(-math.inf, scaled), what)


def _correlation(points, condition: str) -> float:
    pairs = [
        (math.log(point.u * getattr(point, condition)), math.log(point.error))
        for point in points
        if 0 < point.error < math.inf and math.isfinite(getattr(point, condition))
    ]
    x, y = zip(*pairs)
    return correlation(x, y) if len(set(x)) > 1 and len(set(y)) > 1 else 0.0


def exponential(data: Data) -> Claim:
    """C10. Holds if kappa(M) of the chain of point masses grows by 5.44 a link within 20 % between
    the two largest N (a power of N beside the exponential fades), if the median eta of MGS, Givens
    and UD in float64 is at most 10 at the longest, and if ABA's median error reaches 1e-3 on the
    chain with a little inertia, where MGS keeps eta <= 10."""
    lab = data.laboratory
    checks = [Check.within("factor of κ(M) a link", _growth(lab), 0.8 * GROWTH, 1.2 * GROWTH)]
    for variant in (MGS, GIVENS, UD):
        last = lab.series(POINT_MASSES, "random", "float64", variant)[-1:]
        eta = [(point.eta, f"N = {point.value:g}") for point in last]
        checks.append(Check.largest(f"median η of {variant} at the largest N", eta, 10))
    aba, mgs = (lab.series(INERTIA, "random", "float64", variant) for variant in (ABA, MGS))
    error, eta = max((p.error for p in aba), default=None), max((p.eta for p in mgs), default=None)
    checks += [
        Check.at_least("ABA’s largest median error, with a little inertia", error, 1e-3),
        Check.at_most("η of MGS there", eta, 10),
    ]
    variants = (CHOLESKY, ABA, MGS, GIVENS, UD)
    return Claim(
        "C10",
        "κ(M) can grow exponentially",
        "In a chain of unit point masses nearer to the inner joint, κ(M) grows like 5.4ᴺ. Square "
        "roots keep all digits; ABA loses them once the links have a little inertia.",
        checks,
        swept("N, or the links’ inertia", lab, (POINT_MASSES, INERTIA), ["random"], U, variants),
    )


def _growth(lab: Laboratory) -> float | None:
    """The factor a link between the two longest chains."""
    kappa = {
        point.value: point.kappa
        for point in collect(lab, [POINT_MASSES], ["random"], ["float64"], lab.variants)
        if 0 < point.kappa < math.inf
    }
    if len(kappa) < 2:
        return None
    shorter, longer = sorted(kappa)[-2:]
    growth = math.log(kappa[longer]) - math.log(kappa[shorter])
    return math.exp(growth / (longer - shorter))
