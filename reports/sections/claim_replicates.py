"""What replicates say of the claims: how often each holds, and what is measured instead."""

from charts.text import share_text
from claims.claim import number_text, range_text
from page.section import Table
from read.replicates import Numbers, Repeated, Replicates
from summary.replicates import spread
from summary.tails import limits


def paragraph(replicates: Replicates) -> str:
    effort = replicates.key["effort"]
    return (
        f"{replicates.count} replicates measure again what decides the claims, each as much as "
        f"scripts/report --{effort} does, by seeds of its own. Times are not measured again: "
        "claims are decided here without them. Shares of replicates have exact binomial limits (Clopper "
        "and Pearson). The limits of a median are the numbers of two replicates and hold whatever "
        "the distribution; it takes at least six. All have a confidence of 95 %. ∞: failed, or "
        "nowhere."
    )


def notes(replicates: Replicates, name: str) -> list[str]:
    """Of one claim."""
    return [
        note
        for claim in replicates.claims
        if claim.id == name
        for note in (_held(claim, replicates.count), _instead(claim, replicates.count))
        if note
    ]


def _held(claim: Repeated, replicates: int) -> str:
    k = claim.verdicts["confirmed"]
    share, between = share_text(k / replicates), _share_limits(k, replicates)
    left = f", open in {claim.verdicts['open']}" if claim.verdicts["open"] else ""
    return f"Confirmed in {k} of {replicates} replicates{left}: {share}, limits {between} %."


def _instead(claim: Repeated, replicates: int) -> str:
    """Of the checks that fail in most replicates."""
    failing = [check for check in claim.checks if 2 * (len(check.values) - check.held) > replicates]
    found = "; ".join(map(_measured, failing))
    return f"Measured instead: {found}, in {replicates} replicates." if failing else ""


def _measured(check: Numbers) -> str:
    found = spread(check)
    between = f" [{', '.join(map(_text, found.limits))}]" if found.limits else ""
    claimed = range_text(check.low, check.high)
    return f"{check.what}: median {_text(found.median)}{between} (claimed {claimed})"


def _share_limits(k: int, n: int) -> str:
    return " to ".join(number_text(100 * limit) for limit in limits(k, n))


def _text(value: float) -> str:
    return "∞" if value == float("inf") else number_text(value)


def tables(replicates: Replicates) -> list[Table]:
    return [_verdicts(replicates), _numbers(replicates)]


def _verdicts(replicates: Replicates) -> Table:
    n = replicates.count
    rows = []
    for claim in replicates.claims:
        row = [claim.id]
        for verdict in ("confirmed", "refuted"):
            k = claim.verdicts[verdict]
            row += [str(k), number_text(100 * k / n), _share_limits(k, n)]
        rows.append([*row, str(claim.verdicts["open"])])
        if instead := _instead(claim, n):
            rows.append([instead])
    shares = ["share, %", "95 % limits, %"]
    return Table(
        f"The verdicts of {n} replicates",
        ["Claim", "Confirmed", *shares, "Refuted", *shares, "Open"],
        rows,
        "lrrrrrrr",
    )


def _numbers(replicates: Replicates) -> Table:
    return Table(
        "All numbers of the replicates",
        [
            "Claim",
            "Number",
            "Replicates",
            "Holds in",
            "Median",
            "its 95 % limits",
            "95 % of the replicates",
            "Claimed",
        ],
        [_row(claim.id, check) for claim in replicates.claims for check in claim.checks],
        "llrrrlll",
        folded=True,
    )


def _row(name: str, check: Numbers) -> list[str]:
    found = spread(check)
    median = _text(found.median) if found else "–"
    limits_, middle = (
        " to ".join(map(_text, pair)) if pair else "–"
        for pair in ((found.limits, found.middle) if found else (None, None))
    )
    counts = [str(len(check.values)), str(check.held)]
    return [name, check.what, *counts, median, limits_, middle, range_text(check.low, check.high)]
