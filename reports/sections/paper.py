"""Every equation of Rodriguez’s paper, evaluated as it is printed and, where that is not true, as
it must be corrected. A residual is the relative difference of both sides: rounding errors where an
equation is true, more by orders of magnitude where it is not. In multi-precision rounding cannot
hide a misprint. {digits}.
"""

from charts.text import error_text
from page.section import Column, Section, Verdict, formula, left, of, right
from read.data import Data, Equation, Paper, scene_name, scene_size

BEYOND = "beyond"
PRINTED = right("printed", "printed", error_text)  # of a residual
CORRECTED = right("corrected", "corrected", error_text)
TOLERANCE = right("tolerance", "tolerance", error_text)
EQUATION = left("Equation", "id")


def section(data: Data) -> Section | None:
    if not data.papers:
        return None
    papers = sorted(data.papers, key=_order)
    first = papers[0]
    digits = [f"{precision.name} has {precision.digits} digits" for precision in first.precisions]
    page = Section("The paper, checked", __doc__.format(digits=", ".join(digits)))
    _errata(page, first)
    page.table(
        """All scenes. Condition: of M scaled to a diagonal of ones. Worst: the largest corrected
        residual as a share of its tolerance. A scene passes if every equation, corrected where it
        must be, is true in every precision.""",
        [
            left("Scene", "scene"),
            right("Condition", lambda it: max(p.condition for p in it.precisions), error_text),
            right("Equations", lambda it: len(it.equations)),
            right("Misprints", lambda it: sum(map(_misprinted, it.equations))),
            [
                right(f"Worst: {name}", lambda it, name=name: _worst(it, name), error_text)
                for name in _names(papers)
            ],
            left("Verdict", lambda it: Verdict(it.passed and not _failed(it))),
            any(map(_failed, papers)) and left("What fails", _failed),
        ],
        papers,
    )
    _all(page, first)
    found = {}
    for paper in papers:
        for equation in paper.equations:
            if equation.section == BEYOND:
                found.setdefault(equation.id, (equation, paper))
    residual = CORRECTED._replace(title="residual")
    page.table(
        "Beyond the paper: what else holds of the same recursions, checked in the same way",
        [
            left("What", "id"),
            formula("Statement", lambda equation, _: equation.corrected or equation.statement),
            left("Scene", lambda _, paper: paper.beyond_scene),
            [_residuals(name, residual, TOLERANCE) for name in _names(papers)],
            left("Verdict", "holds", Verdict),
        ],
        found.values(),
        remark=lambda equation, _: equation.note,
    )
    return page


def _order(paper: Paper) -> tuple:
    """The random chain first, then by size."""
    name = scene_name(paper.scene)
    return name != "chain", scene_size(paper.scene), name


def _of_the_paper(paper: Paper) -> list[Equation]:
    return [equation for equation in paper.equations if equation.section != BEYOND]


def _names(papers: list[Paper]) -> list[str]:
    """Of the precisions."""
    return list(dict.fromkeys(it.name for paper in papers for it in paper.precisions))


def _residuals(name: str, *columns: Column) -> list[Column]:
    """Of an equation in a precision."""
    titled = (column._replace(title=f"{name}: {column.title}") for column in columns)
    return of(lambda equation, *_: equation.residuals.get(name), *titled)


def _errata(page: Section, paper: Paper) -> None:
    best = max(paper.precisions, key=lambda precision: precision.digits).name
    page.table(
        f"""Errata. Residuals are those of {paper.scene}, in {best}; – where the printed form cannot
        be evaluated.""",
        [
            EQUATION,
            formula("As printed", "statement"),
            formula("As corrected", "corrected"),
            of(
                lambda equation: equation.residuals[best],
                PRINTED._replace(title="Residual: printed"),
                CORRECTED._replace(title="Corrected"),
            ),
        ],
        [equation for equation in _of_the_paper(paper) if equation.corrected],
        remark=lambda equation: equation.note,
    )


def _failed(paper: Paper) -> str:
    return ", ".join(equation.id for equation in paper.equations if not equation.holds)


def _misprinted(equation: Equation) -> bool:
    return any(residual.verdict == "misprint" for residual in equation.residuals.values())


def _worst(paper: Paper, precision: str) -> float | None:
    """None where it was not checked in this precision, or where a residual is not a number."""
    if precision not in _names([paper]):
        return None
    residuals = [equation.residuals[precision] for equation in paper.equations]
    if any(residual.corrected is None for residual in residuals):
        return None
    return max(residual.corrected / residual.tolerance for residual in residuals)


def _all(page: Section, paper: Paper) -> None:
    equations = _of_the_paper(paper)
    page.table(
        f"All {len(equations)} equations of the paper on {paper.scene}, as printed",
        [
            EQUATION,
            left("Result", lambda equation: equation.result.removeprefix("Result ")),
            formula("Statement", "statement"),
            [_residuals(name, PRINTED, CORRECTED, TOLERANCE) for name in _names([paper])],
            left("Corrected form", "holds", Verdict),
        ],
        equations,
        folded=True,
    )
