"""Which condition number an error follows: C1, C2 and C10."""

import math
from collections import defaultdict
from statistics import correlation, median

from claims.claim import (
    ABA,
    CHOLESKY,
    GIVENS,
    LOST,
    MGS,
    UD,
    Check,
    Claim,
    Number,
    Plot,
    check,
    collect,
    number_text,
    range_text,
    row_of,
    rows_of,
    slope,
    within,
)
from read.data import Data
from read.laboratory import Laboratory, Point
from read.stress import U
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
    series = {name: lab.series(name, "random", "float64", ABA) for name in LENGTHS}
    series = {name: points for name, points in series.items() if points}
    fits = {name: slope(points, smallest=FIT_FROM) for name, points in series.items()}
    steepest = _largest({name: fit.exponent for name, fit in fits.items() if fit})
    eta = _largest({name: max(point.eta for point in points) for name, points in series.items()})
    cholesky = slope(
        lab.series("straight", "random", "float64", CHOLESKY), high=LOST, smallest=FIT_FROM
    )
    drawn = collect(lab, LENGTHS, ("random", "consistent"), U, (ABA, MGS, CHOLESKY))
    return Claim(
        "C1",
        "Structured, not spectral",
        "For random torques the error of ABA does not depend on N, while that of Cholesky grows "
        "like the condition number, N⁴ on a straight chain.",
        [
            within(
                "exponent of ABA’s error in N, the steepest family",
                steepest[0],
                -math.inf,
                0.2,
                steepest[1],
            ),
            within("ABA’s largest median η", eta[0], -math.inf, 10, eta[1]),
            within(
                "exponent of Cholesky’s error, straight chain",
                cholesky and cholesky.exponent,
                3,
                math.inf,
            ),
        ],
        Plot("N", "median relative error", rows_of(drawn)),
    )


def _largest(values: dict[str, float]) -> tuple[float | None, str]:
    if not values:
        return None, ""
    name = max(values, key=values.get)
    return values[name], name


def scaled_condition(data: Data) -> Claim:
    """C2. Over all swept families where u kappa_scaled <= 0.1, random torques: log of Cholesky's
    median error and log of u kappa_scaled correlate above 0.95, every family's median of their
    ratio lies in 0.01 to 2 (a failure is an infinite error), and kappa(M) correlates less. Needs
    three families."""
    lab = data.laboratory
    points = [
        point
        for point in collect(lab, lab.swept, ["random"], U, [CHOLESKY])
        if point.kappa_scaled >= 1 and point.u * point.kappa_scaled <= LOST
    ]
    plot = Plot(
        "u · condition number of M scaled to a unit diagonal",
        "median relative error",
        [row_of(point, x=point.u * point.kappa_scaled) for point in points],
        lines=False,
    )
    ratios = defaultdict(list)
    for point in points:
        ratios[point.family].append(point.error / (point.u * point.kappa_scaled))
    agreement = "correlation with u · scaled κ"
    ratio = "median error / (u · scaled κ) of a family"
    checks = [
        within(agreement, None, 0.95, math.inf),
        within(ratio, None, 0.01, 2),
        _correlates_less(None, None),
    ]
    if len(ratios) >= 3:
        medians = {family: median(values) for family, values in ratios.items()}
        low, high = min(medians, key=medians.get), max(medians, key=medians.get)
        scaled, plain = (_correlation(points, name) for name in ("kappa_scaled", "kappa"))
        checks = [
            within(agreement, scaled, 0.95, math.inf),
            within(f"{ratio}: least", medians[low], 0.01, 2, low),
            within(f"{ratio}: largest", medians[high], 0.01, 2, high),
            _correlates_less(plain, scaled),
        ]
    return Claim(
        "C2",
        "The scaled condition number is Cholesky’s",
        "Cholesky’s error is 0.01 to 2 times u times the condition number of M scaled to a unit "
        "diagonal, on all families; the condition number of M itself says less.",
        checks,
        plot,
    )


def _correlates_less(plain: float | None, scaled: float | None) -> Check:
    what = "correlation with u · κ(M)"
    more = None if plain is None else plain - scaled
    number = Number(f"{what}, less that with u · scaled κ", more, -math.inf, 0)
    if more is None:
        return check(number, "", "less", what)
    return check(number, number_text(plain), range_text(-math.inf, scaled), what)


def _correlation(points: list[Point], condition: str) -> float:
    pairs = [
        (math.log(point.u * getattr(point, condition)), math.log(point.error))
        for point in points
        if 0 < point.error < math.inf and math.isfinite(getattr(point, condition))
    ]
    x, y = zip(*pairs)
    return correlation(x, y) if len(set(x)) > 1 and len(set(y)) > 1 else 0.0


def exponential(data: Data) -> Claim:
    """C10. Holds if kappa(M) of the chain of point masses grows by 5.44 a link within 20 % between
    the two largest N (a power of N beside the exponential fades), if the median eta of MGS, Givens and UD in float64 is at most 10 at the
    longest, and if ABA's median error reaches 1e-3 on the chain with a little inertia, where MGS
    keeps eta <= 10."""
    lab = data.laboratory
    chains = {v: lab.series(POINT_MASSES, "random", "float64", v) for v in (MGS, GIVENS, UD)}
    checks = [within("factor of κ(M) a link", _growth(lab), 0.8 * GROWTH, 1.2 * GROWTH)]
    checks += [
        within(
            f"median η of {variant} at the largest N",
            points[-1].eta if points else None,
            -math.inf,
            10,
            f"N = {points[-1].value:g}" if points else "",
        )
        for variant, points in chains.items()
    ]
    inertia = {v: lab.series(INERTIA, "random", "float64", v) for v in (ABA, MGS)}
    worst = {v: max((p.error for p in points), default=None) for v, points in inertia.items()}
    eta = max((point.eta for point in inertia[MGS]), default=None)
    checks += [
        within("ABA’s largest median error, with a little inertia", worst[ABA], 1e-3, math.inf),
        within("η of MGS there", eta, -math.inf, 10),
    ]
    variants = (CHOLESKY, ABA, MGS, GIVENS, UD)
    drawn = collect(lab, (POINT_MASSES, INERTIA), ["random"], U, variants)
    return Claim(
        "C10",
        "κ(M) can grow exponentially",
        "In a chain of unit point masses nearer to the inner joint, κ(M) grows like 5.4ᴺ. Square "
        "roots keep all digits; ABA loses them once the links have a little inertia.",
        checks,
        Plot("N, or the links’ inertia", "median relative error", rows_of(drawn)),
    )


def _growth(lab: Laboratory) -> float | None:
    """The factor a link between the two longest chains."""
    kappa = {
        point.value: point.kappa
        for variant in lab.variants
        for point in lab.series(POINT_MASSES, "random", "float64", variant)
        if 0 < point.kappa < math.inf
    }
    if len(kappa) < 2:
        return None
    shorter, longer = sorted(kappa)[-2:]
    growth = math.log(kappa[longer]) - math.log(kappa[shorter])
    return math.exp(growth / (longer - shorter))
