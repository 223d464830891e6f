"""The mass matrix as a sample covariance: how near random samples come, and how fast."""

from itertools import groupby

from charts import palette
from charts import samples as sample_charts
from charts.common import QUANTITY, Style
from charts.text import error_text, fit_text, time_text
from page.section import Choice, Figure, Section, Table
from read.data import Data
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


def section(data: Data) -> Section | None:
    drawn = sorted(bands(data.samples), key=_order)
    if not drawn:
        return None
    quantities = list(dict.fromkeys(band.quantity for band in drawn))
    options = [(quantity, QUANTITIES.get(quantity, quantity)) for quantity in quantities]
    choice = Choice(QUANTITY, "Show", options, quantities[0])
    style = Style((band.method for band in drawn), [])
    figures = []
    for scene in dict.fromkeys(band.scene for band in drawn):
        own = [band for band in drawn if band.scene == scene]
        for what, title in (("samples", "samples"), ("time", "run time")):
            chart = sample_charts.against(own, style, {QUANTITY: quantities[0]}, what)
            title = f"{scene}: error against {title}"
            figures.append(Figure(title, chart, sample_charts.TOOLTIPS))
    return Section(
        "The mass matrix as a sample covariance",
        [
            "The paper’s random model has the mass matrix as the covariance of its joint moments "
            "(Result 5.1), so that M emerges from a simulation; so do P, D and Λ (Results 5.2 to "
            "5.4). The error is relative, in the Frobenius norm. A line is the median over "
            "replicas with other random numbers, its band holds the middle 80 % of them.",
            *_known(drawn),
        ],
        choices=[choice],
        variants=style.variants,
        figures=figures,
        tables=[_table(drawn)],
    )


def _order(band: Band) -> tuple:
    def rank(known, name: str) -> tuple:
        return (known.index(name) if name in known else len(known), name)

    return (
        band.scene,
        rank(list(QUANTITIES), band.quantity),
        rank(METHODS, band.method),
        band.samples,
    )


def _known(drawn: list[Band]) -> list[str]:
    """What theory says of the methods that were measured."""
    texts = {
        "MonteCarlo": "Monte Carlo’s error falls with the root of the number of samples, "
        "rate −1/2, whatever the robot.",
        "Antithetic": "Antithetic pairs, w and −w, have the same second moment twice: they make "
        "a mean exact, but for a covariance they cost a factor √2 at the same number of samples. "
        "−w needs no new random numbers, so that in equal time the two are about even.",
        "QuasiMonteCarlo": "Quasi-Monte Carlo spreads its samples evenly; its rate may be better.",
        "SigmaPoints": "Sigma points are exact, to rounding: 6N samples, and one more a joint "
        "that has noise, have the covariance itself.",
        "Recursion": "The recursion is the exact algorithm in float64, which takes no samples.",
    }
    measured = {band.method for band in drawn}
    known = " ".join(text for method, text in texts.items() if method in measured)
    return [known] if known else []


def _table(drawn: list[Band]) -> Table:
    rows = []
    for (scene, quantity, method), group in groupby(drawn, key=lambda band: band[:3]):
        series = list(group)
        last = series[-1]
        fit = fit_exponent((band.samples, band.median) for band in series)
        rows.append(
            [
                scene,
                QUANTITIES.get(quantity, quantity).split(",")[0],
                method,
                fit_text(fit),
                str(last.samples) if last.samples else "none",
                str(last.replicas),
                error_text(last.median),
                time_text(last.time / last.samples) if last.samples else "–",
                _time_to_target(series, fit),
            ]
        )
    return Table(
        "Rate: the slope of a least-squares line through log of the median error against log of "
        "the number of samples; ± is its standard error. Error and time a sample are medians at "
        f"the largest number of samples. Time to {error_text(TARGET)}: as measured where that "
        "was reached; ≈ is extrapolated from there, not measured, at the rate −1/2 for MonteCarlo "
        "and Antithetic, else at the fitted one.",
        [
            "Scene",
            "Quantity",
            "Method",
            "Rate",
            "Samples",
            "Replicas",
            "Error",
            "Time a sample",
            f"Time to {error_text(TARGET)}",
        ],
        rows,
        "lllrrrrrr",
    )


def _time_to_target(series: list[Band], fit: Fit | None) -> str:
    reached = next((band for band in series if band.median <= TARGET), None)
    if reached:
        return time_text(reached.time)
    last = series[-1]
    rate = RATES.get(last.method, fit.exponent if fit else 0)
    if rate > SLOWEST:
        return "–"
    return f"≈ {time_text(last.time * (TARGET / last.median) ** (1 / rate))}"
