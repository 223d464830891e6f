"""Twelve claims about accuracy: their plots, the numbers that decide them, their verdicts."""

from markupsafe import Markup

from charts.common import Style
from claims import CLAIMS
from claims.claim import Claim
from page.section import Figure, Section, Table
from read.data import Data
from read.replicates import Replicates
from sections import claim_charts, claim_replicates


def section(data: Data) -> Section | None:
    replicates = data.replicates
    if not (len(data.stress) or data.integrations or replicates):
        return None
    claims = [decide(data) for decide in CLAIMS]
    rows = [row for claim in claims for row in claim.plot.rows]
    style = Style((row["variant"] for row in rows), (row["precision"] for row in rows))
    counts = [
        f"{sum(claim.verdict == verdict for claim in claims)} {verdict}"
        for verdict in ("confirmed", "refuted", "open")
    ]
    return Section(
        "Twelve claims, decided by this run",
        [
            "Each claim is a prediction with numbers, tested by fixed rules: one number out of "
            "its range refutes it; it is open while a number is absent from this run, and "
            f"confirmed otherwise. Here {', '.join(counts)}. ABA is Sequential<Conventional>, "
            "Cholesky Batch<EigenLLT>, MGS Sequential<ArrayMGS>, Givens Sequential<ArrayGivens>. u is the unit roundoff, κ the "
            "condition number of M, and kS the structured one: how much the answer changes with "
            "relative changes of the robot’s parameters. η is the error over u kS.",
            *([claim_replicates.paragraph(replicates)] if replicates else []),
        ],
        variants=style.variants,
        precisions=style.precisions,
        figures=[figure for claim in claims if (figure := _figure(claim, style, replicates))],
        tables=[
            _verdicts(claims),
            _numbers(claims),
            *(claim_replicates.tables(replicates) if replicates else []),
        ],
    )


def _figure(claim: Claim, style: Style, replicates: Replicates | None) -> Figure | None:
    title = f"{claim.id} {claim.title}"
    notes = [_verdict(claim), claim.sentence]
    notes += claim_replicates.notes(replicates, claim.id) if replicates else []
    return claim_charts.figure(claim.plot, title, style, notes)


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
        ["Claim", "Number", "Measured", "Claimed", "Holds"],
        [
            [claim.id, check.what, check.measured, check.wanted, words[check.holds]]
            for claim in claims
            for check in claim.checks
        ],
        "lllll",
        folded=True,
    )
