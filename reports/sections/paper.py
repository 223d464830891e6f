"""The paper's equations, each checked: what is misprinted, and what it should say."""

from charts.text import error_text
from page.section import Section, Table, Verdict
from read.data import Data, Equation, Paper, scene_name, scene_size

BEYOND = "beyond"


def section(data: Data) -> Section | None:
    if not data.papers:
        return None
    papers = sorted(data.papers, key=_order)
    first = papers[0]
    tables = [_errata(first), _scenes(papers), _all(first), _beyond(papers)]
    return Section(
        "The paper, checked",
        [
            "Every equation of Rodriguez’s paper, evaluated as it is printed and, where that is "
            "not true, as it must be corrected. A residual is the relative difference of both "
            "sides: rounding errors where an equation is true, more by orders of magnitude where "
            f"it is not. In multi-precision rounding cannot hide a misprint. {_digits(first)}"
        ],
        tables=[table for table in tables if table],
    )


def _order(paper: Paper) -> tuple:
    """The random chain first, then by size."""
    name = scene_name(paper.scene)
    return name != "chain", scene_size(paper.scene), name


def _digits(paper: Paper) -> str:
    texts = [f"{precision.name} has {precision.digits} digits" for precision in paper.precisions]
    return f"{', '.join(texts)}."


def _of_the_paper(paper: Paper) -> list[Equation]:
    return [equation for equation in paper.equations if equation.section != BEYOND]


def _errata(paper: Paper) -> Table | None:
    best = max(paper.precisions, key=lambda precision: precision.digits).name
    rows = []
    for equation in _of_the_paper(paper):
        if equation.corrected:
            residual = equation.residuals[best]
            rows.append(
                [
                    equation.id,
                    equation.statement,
                    equation.corrected,
                    error_text(residual.printed),
                    error_text(residual.corrected),
                ]
            )
            rows += [[equation.note]] if equation.note else []
    if not rows:
        return None
    return Table(
        f"Errata. Residuals are those of {paper.scene}, in {best}; – where the printed form "
        "cannot be evaluated.",
        ["Equation", "As printed", "As corrected", "Residual: printed", "Corrected"],
        rows,
        "lffrr",
    )


def _scenes(papers: list[Paper]) -> Table:
    names = list(dict.fromkeys(p.name for paper in papers for p in paper.precisions))
    failed = any(_failed(paper) for paper in papers)
    return Table(
        "All scenes. Condition: of M scaled to a diagonal of ones. Worst: the largest corrected "
        "residual as a share of its tolerance. A scene passes if every equation, corrected where "
        "it must be, is true in every precision.",
        ["Scene", "Condition", "Equations", "Misprints"]
        + [f"Worst: {name}" for name in names]
        + ["Verdict", *(["What fails"] if failed else [])],
        [
            [
                paper.scene,
                error_text(max(precision.condition for precision in paper.precisions)),
                str(len(paper.equations)),
                str(sum(map(_misprinted, paper.equations))),
                *(error_text(_worst(paper, name)) for name in names),
                Verdict(paper.passed and not _failed(paper)),
                *([", ".join(_failed(paper))] if failed else []),
            ]
            for paper in papers
        ],
        "lrrr" + "r" * len(names) + "l" + "l" * failed,
    )


def _failed(paper: Paper) -> list[str]:
    return [equation.id for equation in paper.equations if not equation.holds]


def _misprinted(equation: Equation) -> bool:
    return any(residual.verdict == "misprint" for residual in equation.residuals.values())


def _worst(paper: Paper, precision: str) -> float | None:
    """None where it was not checked in this precision, or where a residual is not a number."""
    if precision not in (p.name for p in paper.precisions):
        return None
    residuals = [equation.residuals[precision] for equation in paper.equations]
    if any(residual.corrected is None for residual in residuals):
        return None
    return max(residual.corrected / residual.tolerance for residual in residuals)


def _all(paper: Paper) -> Table:
    names = [precision.name for precision in paper.precisions]
    equations = _of_the_paper(paper)
    return Table(
        f"All {len(equations)} equations of the paper on {paper.scene}, as printed",
        ["Equation", "Result", "Statement"]
        + [f"{name}: {what}" for name in names for what in ("printed", "corrected", "tolerance")]
        + ["Corrected form"],
        [
            [equation.id, equation.result.removeprefix("Result "), equation.statement]
            + [error_text(value) for name in names for value in equation.residuals[name][:3]]
            + [Verdict(equation.holds)]
            for equation in equations
        ],
        "llf" + "rrr" * len(names) + "l",
        folded=True,
    )


def _beyond(papers: list[Paper]) -> Table | None:
    """What the paper does not say; each from the first record that has it."""
    names = list(dict.fromkeys(p.name for paper in papers for p in paper.precisions))
    found = {}
    for paper in papers:
        for equation in paper.equations:
            if equation.section == BEYOND:
                found.setdefault(equation.id, (paper, equation))
    if not found:
        return None
    rows = []
    for paper, equation in found.values():
        row = [equation.id, equation.corrected or equation.statement, paper.beyond_scene]
        for name in names:
            residual = equation.residuals.get(name)
            row += [error_text(value) for value in residual[1:3]] if residual else ["–", "–"]
        rows.append([*row, Verdict(equation.holds)])
        rows += [[equation.note]] if equation.note else []
    return Table(
        "Beyond the paper: what else holds of the same recursions, checked in the same way",
        ["What", "Statement", "Scene"]
        + [f"{name}: {what}" for name in names for what in ("residual", "tolerance")]
        + ["Verdict"],
        rows,
        "lfl" + "rr" * len(names) + "l",
    )
