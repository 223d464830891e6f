"""The paper’s random model has the mass matrix as the covariance of its joint moments (Result 5.1),
so that M emerges from a simulation; so do P, D and Λ (Results 5.2 to 5.4). The error is relative,
in the Frobenius norm. A line is the median over replicas with other random numbers, its band holds
the middle 80 % of them.
"""

from charts import palette
from charts import samples as sample_charts
from charts.common import QUANTITY, Style
from charts.text import error_text, fit_text, time_text
from page.section import Section, left, of, right
from read.data import Data
from sections.common import Group, groups, ratio
from summary.groups import by_key
from summary.points import Band, Fit, bands, fit_exponent

TARGET = 1e-6
RATES = {"MonteCarlo": -0.5, "Antithetic": -0.5}  # known, so better than a fitted one
SLOWEST = -0.1  # a fitted rate that is worth extrapolating
QUANTITIES = {
    "M": "M, the mass matrix (Result 5.1)",
    "P": "P, the estimation error (Result 5.2)",
    "D": "D, the innovations (Result 5.3)",
    "Lambda": "Λ, the co-states (Result 5.4)",
}
METHODS = list(palette.METHODS)
KNOWN = {  # what theory says of a method
    "MonteCarlo": """Monte Carlo’s error falls with the root of the number of samples, rate −1/2,
        whatever the robot.""",
    "Antithetic": """Antithetic pairs, w and −w, have the same second moment twice: they make a
        mean exact, but for a covariance they cost a factor √2 at the same number of samples. −w
        needs no new random numbers, so that in equal time the two are about even.""",
    "QuasiMonteCarlo": "Quasi-Monte Carlo spreads its samples evenly; its rate may be better.",
    "SigmaPoints": """Sigma points are exact, to rounding: 6N samples, and one more a joint that
        has noise, have the covariance itself.""",
    "Recursion": "The recursion is the exact algorithm in float64, which takes no samples.",
}


def section(data: Data) -> Section | None:
    drawn = sorted(bands(data.samples), key=_order)
    if not drawn:
        return None
    measured = {band.method for band in drawn}
    page = Section(
        "The mass matrix as a sample covariance",
        [__doc__, " ".join(text for method, text in KNOWN.items() if method in measured)],
        Style((band.method for band in drawn), []),
    )
    page.choose(QUANTITY, "Show", dict.fromkeys(band.quantity for band in drawn), _quantity)
    for scene, own in by_key(drawn, lambda band: band.scene).items():
        for what, title in (("samples", "samples"), ("time", "run time")):
            chart = sample_charts.against(own, page.style, page.first, what)
            page.figure(f"{scene}: error against {title}", chart, sample_charts.TOOLTIPS)
    target = error_text(TARGET)
    page.table(
        f"""Rate: the slope of a least-squares line through log of the median error against log of
        the number of samples; ± is its standard error. Error and time a sample are medians at the
        largest number of samples. Time to {target}: as measured where that was reached; ≈ is
        extrapolated from there, not measured, at the rate −1/2 for MonteCarlo and Antithetic, else
        at the fitted one.""",
        [
            left("Scene", "scene"),
            left("Quantity", lambda it: _quantity(it.quantity).split(",")[0]),
            left("Method", "method"),
            right("Rate", _rate, fit_text),
            of(
                lambda it: it.own[-1],
                right("Samples", lambda band: band.samples or "none"),
                right("Replicas", "replicas"),
                right("Error", "median", error_text),
                right("Time a sample", lambda it: ratio(it.time, it.samples), time_text),
            ),
            right(f"Time to {target}", _time_to_target),
        ],
        groups(drawn, "scene", "quantity", "method"),
    )
    return page


def _quantity(name: str) -> str:
    return QUANTITIES.get(name, name)


def _order(band: Band) -> tuple:
    def rank(known, name: str) -> tuple:
        return (known.index(name) if name in known else len(known), name)

    return (
        band.scene,
        rank(list(QUANTITIES), band.quantity),
        rank(METHODS, band.method),
        band.samples,
    )


def _rate(series: Group) -> Fit | None:
    return fit_exponent((band.samples, band.median) for band in series.own)


def _time_to_target(series: Group) -> str | None:
    """As it was measured, or else extrapolated."""
    reached = next((band for band in series.own if band.median <= TARGET), None)
    if reached:
        return time_text(reached.time)
    fit, last = _rate(series), series.own[-1]
    rate = RATES.get(series.method, fit.exponent if fit else 0)
    if rate > SLOWEST:
        return None
    return f"≈ {time_text(last.time * (TARGET / last.median) ** (1 / rate))}"
