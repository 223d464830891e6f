"""What replicates say of the claims: how often each holds, and what is measured instead."""

from charts.text import share_text
from claims.claim import number_text, range_text
from page.section import Column, Section, left, of, right
from read.replicates import Numbers, Repeated, Replicates
from summary.replicates import spread
from summary.tails import limits


def paragraph(replicates: Replicates) -> str:
    return f"""
        {replicates.count} replicates measure again what decides the claims, each as much as
        scripts/report --{replicates.key["effort"]} does, by seeds of its own. Times are not
        measured again: claims are decided here without them. Shares of replicates have exact
        binomial limits (Clopper and Pearson). The limits of a median are the numbers of two
        replicates and hold whatever the distribution; it takes at least six. All have a confidence
        of 95 %. ∞: failed, or nowhere."""


def notes(replicates: Replicates, name: str) -> list[str]:
    """Of one claim."""
    claims = [claim for claim in replicates.claims if claim.id == name]
    return [say(it, replicates.count) for it in claims for say in (_held, _instead)]


def _held(claim: Repeated, replicates: int) -> str:
    k = claim.verdicts["confirmed"]
    share, between = share_text(k / replicates), _share_limits(k, replicates)
    left_open = f", open in {claim.verdicts['open']}" if claim.verdicts["open"] else ""
    return f"Confirmed in {k} of {replicates} replicates{left_open}: {share}, limits {between} %."


def _instead(claim: Repeated, replicates: int) -> str:
    """Of the checks that fail in most replicates."""
    failing = [check for check in claim.checks if 2 * (len(check.values) - check.held) > replicates]
    found = "; ".join(map(_measured, failing))
    return f"Measured instead: {found}, in {replicates} replicates." if failing else ""


def _measured(check: Numbers) -> str:
    found = spread(check)
    between = f" [{', '.join(map(_text, found.limits))}]" if found.limits else ""
    return f"{check.what}: median {_text(found.median)}{between} (claimed {_claimed(check)})"


def _share_limits(k: int, n: int) -> str:
    return " to ".join(number_text(100 * limit) for limit in limits(k, n))


def _text(value: float) -> str:
    return "∞" if value == float("inf") else number_text(value)


def _to_text(ends: tuple[float, float]) -> str:
    return " to ".join(map(_text, ends))


def _claimed(check: Numbers) -> str:
    return range_text(check.low, check.high)


def tabulate(page: Section, replicates: Replicates) -> None:
    n = replicates.count

    def counted(verdict: str) -> list[Column]:
        return [
            right(verdict.capitalize(), lambda claim: claim.verdicts[verdict]),
            right("share, %", lambda claim: number_text(100 * claim.verdicts[verdict] / n)),
            right("95 % limits, %", lambda claim: _share_limits(claim.verdicts[verdict], n)),
        ]

    page.table(
        f"The verdicts of {n} replicates",
        [
            left("Claim", "id"),
            counted("confirmed"),
            counted("refuted"),
            right("Open", lambda claim: claim.verdicts["open"]),
        ],
        replicates.claims,
        remark=lambda claim: _instead(claim, n),
    )
    page.table(
        "All numbers of the replicates",
        [
            left("Claim", lambda _, claim: claim.id),
            left("Number", "what"),
            right("Replicates", "values", len),
            right("Holds in", "held"),
            of(
                lambda check, _: spread(check),
                right("Median", "median", _text),
                left("its 95 % limits", "limits", _to_text),
                left("95 % of the replicates", "middle", _to_text),
            ),
            left("Claimed", lambda check, _: _claimed(check)),
        ],
        [(check, claim) for claim in replicates.claims for check in claim.checks],
        folded=True,
    )
