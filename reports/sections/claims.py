"""Each claim is a prediction with numbers, tested by fixed rules: one number out of its range
refutes it; it is open while a number is absent from this run, and confirmed otherwise. Here
{counts}. ABA is Sequential<Conventional>, Cholesky Batch<EigenLLT>, MGS Sequential<ArrayMGS>,
Givens Sequential<ArrayGivens>. u is the unit roundoff, κ the condition number of M, and kS the
structured one: how much the answer changes with relative changes of the robot’s parameters. η is
the error over u kS.
"""

from markupsafe import Markup

from claims import CLAIMS
from claims.claim import Check, Claim
from page.section import Section, formula, left
from read.data import Data
from sections import claim_charts, claim_replicates
from sections.common import style_of

WORDS = {True: "✓", False: "✗ not so", None: "–"}  # whether a check holds
OPEN = "open: not in this run"


def section(data: Data) -> Section | None:
    replicates = data.replicates
    if not (len(data.stress) or data.integrations or replicates):
        return None
    claims = [decide(data) for decide in CLAIMS]
    counts = [
        f"{sum(claim.verdict == verdict for claim in claims)} {verdict}"
        for verdict in ("confirmed", "refuted", "open")
    ]
    page = Section(
        "Twelve claims, decided by this run",
        [
            __doc__.format(counts=", ".join(counts)),
            replicates and claim_replicates.paragraph(replicates),
        ],
        style_of(row for claim in claims for row in claim.plot.rows),
    )
    for claim in claims:
        notes = [_verdict(claim), claim.sentence]
        notes += claim_replicates.notes(replicates, claim.id) if replicates else []
        claim_charts.draw(page, claim.plot, f"{claim.id} {claim.title}", notes)
    name = left("Claim", lambda _, claim: claim.id)
    number = [left("Number", "what"), left("Measured", "measured"), left("Claimed", "wanted")]
    page.table(
        "The verdicts of this run, each with the number that decides it",
        [
            name,
            formula("Says", lambda _, claim: claim.sentence),
            formula("Verdict", lambda _, claim: _word(claim)),
            number,
        ],
        [(_deciding(claim), claim) for claim in claims],
    )
    page.table(
        "All numbers of the claims",
        [name, number, left("Holds", lambda check, _: WORDS[check.holds])],
        [(check, claim) for claim in claims for check in claim.checks],
        folded=True,
    )
    if replicates:
        claim_replicates.tabulate(page, replicates)
    return page


def _word(claim: Claim) -> Markup:
    word = OPEN if claim.verdict == "open" else claim.verdict
    return Markup('<span class="{}">{}</span>').format(claim.verdict, word)


def _verdict(claim: Claim) -> Markup:
    """The verdict, and the number that decides it."""
    text = (OPEN if claim.verdict == "open" else claim.verdict).capitalize()
    check = _deciding(claim)
    number = f"{check.what}: {check.measured}, claimed {check.wanted}."
    return Markup('<strong class="{}">{}</strong>: {}').format(claim.verdict, text, number)


def _deciding(claim: Claim) -> Check:
    """The first check that refutes or is absent, or else the first."""
    wanted = {"refuted": False, "open": None, "confirmed": True}[claim.verdict]
    return next(check for check in claim.checks if check.holds is wanted)
