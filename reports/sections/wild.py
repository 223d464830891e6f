"""Mechanisms drawn at random over many orders of magnitude: η, silent failures, refinement."""

import math

import numpy as np

from charts.text import share_text, task_text
from claims.detection import FACTOR, within_factor
from claims.dynamics import HARM, LAW, harmed_by_refinement
from page.section import Choice, Section, Table
from read.data import Data
from read.stress import Stress, U

QUANTILES = (0.5, 0.9, 0.99, 1)
LISTED = 20  # seeds named a series
TASK = "wild_task"
TASKS = ("white", "random", "dynamics")  # white innovations are fair to all scales


def section(data: Data) -> Section | None:
    wild = data.stress.where(family=data.laboratory.wild)
    tasks = [task for task in TASKS if len(wild.where(task=task))]
    if not tasks:
        return None
    series = {task: _series(wild.where(task=task)) for task in tasks}
    trials = max(len(rows) for rows in series[tasks[0]].values())
    return Section(
        "Wild mechanisms",
        [
            f"Up to {trials} mechanisms a variant, drawn at random: trees with masses, lengths and "
            "gyrations over many orders of magnitude. η is the error "
            "over u kS, the error that rounding the parameters alone makes: a method that is "
            "stable in the structured sense has η of a few. A quantile counts failures as "
            "infinite.",
            "Silent: more than 1 % wrong, without a failure or a warning. Harmed: more than "
            f"{HARM} times as wrong as before refinement; in brackets, those of them with η above "
            f"{LAW}. Estimates: those within a factor {FACTOR} of the true error, of the answers "
            "that have an estimate. Widened: refined by factors of the next wider precision.",
        ],
        choices=[Choice(TASK, "Task", [(name, task_text(name)) for name in tasks], tasks[0])],
        tables=[
            *(_quantiles(task, series[task], task == tasks[0]) for task in tasks),
            *_silent(wild),
        ],
    )


def _series(rows: Stress) -> dict[tuple[str, str], Stress]:
    return {
        (variant, precision): own
        for variant in rows.present("variant")
        for precision in U
        if len(own := rows.where(variant=variant, precision=precision))
    }


def _quantiles(task: str, series: dict[tuple[str, str], Stress], first: bool) -> Table:
    return Table(
        f"{task_text(task)}: η at the median, at 90 % and 99 % of the mechanisms, and the largest",
        [
            "Variant",
            "Precision",
            "Trials",
            "η: 50 %",
            "90 %",
            "99 %",
            "largest",
            "Failed",
            "Silent",
            "Harmed",
            "Estimates",
            "Widened",
        ],
        [
            [
                variant,
                precision,
                str(len(rows)),
                *map(eta_text, eta_quantiles(rows)),
                str(int((~rows.ok).sum())),
                str(int(rows.silent.sum())),
                _harmed(rows),
                _estimated(rows),
                _widened(rows),
            ]
            for (variant, precision), rows in series.items()
        ],
        "llrrrrrrrrrr",
        shown={TASK: task},
        first=first,
    )


def eta_quantiles(rows: Stress) -> list[float]:
    """Each an η that occurs: the least that so many of the mechanisms do not exceed."""
    eta = np.sort(np.where(rows.ok, rows["eta"], np.inf))
    eta = eta[~np.isnan(eta)]
    return [
        float(eta[math.ceil(share * len(eta)) - 1]) if len(eta) else math.nan for share in QUANTILES
    ]


def eta_text(eta: float) -> str:
    if math.isnan(eta):
        return "–"
    if math.isinf(eta):
        return "failed"
    return f"{eta:.2g}".replace("e+0", "e").replace("e+", "e")


def _harmed(rows: Stress) -> str:
    """Of the answers that know their error before refinement."""
    if not (rows.ok & (rows["unrefined"] >= 0)).any():
        return "–"
    harmed = rows.rows(harmed_by_refinement(rows))
    return f"{len(harmed)} ({int((harmed['eta'] > LAW).sum())})"


def _estimated(rows: Stress) -> str:
    own = rows.rows(rows.ok & (rows["estimate"] >= 0))
    return share_text(float(within_factor(own).mean())) if len(own) else "–"


def _widened(rows: Stress) -> str:
    widened = rows["widened"][rows.ok & ~np.isnan(rows["widened"])]
    return share_text(float(widened.mean())) if len(widened) else "–"


def _silent(wild: Stress) -> list[Table]:
    """Each with its seeds, so that it can be looked at."""
    rows = []
    failures = wild.rows(wild.silent)
    for task in failures.present("task"):
        for (variant, precision), own in _series(failures.where(task=task)).items():
            seeds = [f"{seed:.0f}" for seed in np.unique(own["seed"])]
            more = f" and {len(seeds) - LISTED} more" if len(seeds) > LISTED else ""
            named = ", ".join(seeds[:LISTED]) + more
            rows.append([variant, precision, task_text(task), str(len(own)), named])
    if not rows:
        return []
    return [
        Table(
            f"All {len(failures)} silent failures on wild mechanisms, with their seeds",
            ["Variant", "Precision", "Task", "Count", "Seeds"],
            rows,
            "lllrl",
            folded=True,
        )
    ]
