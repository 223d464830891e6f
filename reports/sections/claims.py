"""Ten claims about accuracy: their plots, the numbers that decide them, their verdicts."""

from markupsafe import Markup

from charts.common import Style
from claims import CLAIMS
from claims.claim import Claim
from page.section import Figure, Section, Table
from read.data import Data
from sections import claim_charts


def section(data: Data) -> Section | None:
    if not len(data.stress) and not data.integrations:
        return None
    claims = [decide(data) for decide in CLAIMS]
    rows = [row for claim in claims for row in claim.plot.rows]
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    counts = [
        f"{sum(claim.verdict == verdict for claim in claims)} {verdict}"
        for verdict in ("confirmed", "refuted", "open")
    ]
    return Section(
        "Ten claims, decided by this run",
        [
            "Each claim is a prediction with numbers, tested by fixed rules: one number out of "
            "its range refutes it; it is open while a number is absent from this run, and "
            f"confirmed otherwise. Here {', '.join(counts)}. ABA is Sequential<Conventional>, "
            "Cholesky Batch<EigenLLT>, MGS Sequential<ArrayMGS>. u is the unit roundoff, κ the "
            "condition number of M, and kS the structured one: how much the answer changes with "
            "relative changes of the robot’s parameters. η is the error over u kS.",
        ],
        variants=style.variants,
        precisions=style.precisions,
        figures=[figure for claim in claims if (figure := _figure(claim, style))],
        tables=[_verdicts(claims), _numbers(claims)],
    )


def _figure(claim: Claim, style: Style) -> Figure | None:
    title = f"{claim.id} {claim.title}"
    return claim_charts.figure(claim.plot, title, style, [_verdict(claim), claim.sentence])


def _verdict(claim: Claim) -> Markup:
    """The verdict, and the number that decides it."""
    texts = {"open": "Open: not in this run"}
    text = texts.get(claim.verdict, claim.verdict.capitalize())
    check = _deciding(claim)
    number = f": {check.what}: {check.measured}, claimed {check.wanted}." if check else "."
    return Markup('<strong class="{}">{}</strong>{}').format(claim.verdict, text, number)


def _deciding(claim: Claim):
    """The first check that refutes or is absent, or else the first."""
    wanted = {"refuted": False, "open": None, "confirmed": True}[claim.verdict]
    return next((check for check in claim.checks if check.holds is wanted), None)


def _verdicts(claims: list[Claim]) -> Table:
    rows = []
    for claim in claims:
        check = _deciding(claim)
        word = "open: not in this run" if claim.verdict == "open" else claim.verdict
        verdict = Markup('<span class="{}">{}</span>').format(claim.verdict, word)
        rows.append([claim.id, claim.sentence, verdict, check.what, check.measured, check.wanted])
    return Table(
        "The verdicts of this run, each with the number that decides it",
        ["Claim", "Says", "Verdict", "Number", "Measured", "Claimed"],
        rows,
        "lfflll",
    )


def _numbers(claims: list[Claim]) -> Table:
    words = {True: "✓", False: "✗ not so", None: "–"}
    return Table(
        "All numbers of the claims",
        ["Claim", "Number", "Measured", "Claimed", ""],
        [
            [claim.id, check.what, check.measured, check.wanted, words[check.holds]]
            for claim in claims
            for check in claim.checks
        ],
        "lllll",
        folded=True,
    )
