"""Reads the checks of the paper's equations."""

import math
from collections import Counter
from pathlib import Path

from read.checks import checked_scene, read_json, refusing
from read.data import Data, Equation, Paper, Precision, Residual
from read.values import count, number, text

VERDICTS = ("holds", "misprint", "fails")


def read_paper(path: Path, data: Data) -> None:
    document = read_json(path)
    with refusing(path, "a record of the paper"):
        precisions = [
            Precision(
                text(entry["precision"]),
                count("digits", entry["digits"]),
                number("condition", entry["condition"]),
            )
            for entry in document["precisions"]
        ]
        names = [precision.name for precision in precisions]
        equations = [_equation(row, names) for row in document["rows"]]
        for id, times in Counter(equation.id for equation in equations).items():
            if times > 1:
                raise ValueError(f"{id} is recorded {times} times")
        if not (precisions and equations):
            raise ValueError("no equation in any precision")
        scene = checked_scene(document["scene"])
        beyond = checked_scene(document.get("beyond_scene", scene))
        data.papers.append(Paper(scene, beyond, bool(document["pass"]), precisions, equations))


def _equation(row: dict, precisions: list[str]) -> Equation:
    texts = [text(row[name]) for name in Equation._fields[:-1]]
    residuals = {name: _residual(row["id"], row["residuals"][name]) for name in precisions}
    equation = Equation(*texts, residuals)
    if not equation.corrected and any(r.verdict == "misprint" for r in residuals.values()):
        raise ValueError(f"{equation.id} is a misprint without a corrected form")
    return equation


def _residual(id: str, entry: dict) -> Residual:
    residual = Residual(*(entry[name] for name in Residual._fields))
    if residual.verdict not in VERDICTS:
        raise ValueError(f"verdict '{residual.verdict}' of {id}")
    for value in (residual.printed, residual.corrected):
        if value is not None and not (math.isfinite(value) and value >= 0):
            raise ValueError(f"residual {value} of {id}")
    if not (math.isfinite(residual.tolerance) and residual.tolerance > 0):
        raise ValueError(f"tolerance {residual.tolerance} of {id}")
    return residual
