"""Up to {trials} mechanisms a variant, drawn at random: trees with masses, lengths and gyrations
over many orders of magnitude. η is the error over u kS, the error that rounding the parameters
alone makes: a method that is stable in the structured sense has η of a few. A quantile counts
failures as infinite.

Silent: more than 1 % wrong, without a failure or a warning. Harmed: more than {harm} times as wrong
as before refinement; in brackets, those of them with η above {law}. Estimates: those within a
factor {factor} of the true error, of the answers that have an estimate. Widened: refined by factors
of the next wider precision.
"""

import math

import numpy as np

from charts.text import share_text, task_text
from claims.detection import FACTOR, within_factor
from claims.dynamics import HARM, LAW, harmed_by_refinement
from page.section import Section, left, right
from read.data import Data
from read.stress import Stress
from sections.common import SERIES, Group, named
from sections.digits import series_of

QUANTILES = {0.5: "η: 50 %", 0.9: "90 %", 0.99: "99 %", 1: "largest"}
LISTED = 20  # seeds named a series
TASK = "wild_task"
TASKS = ("white", "random", "dynamics")  # white innovations are fair to all scales


def section(data: Data) -> Section | None:
    wild = data.stress.where(family=data.laboratory.wild)
    tasks = [task for task in TASKS if len(wild.where(task=task))]
    if not tasks:
        return None
    trials = max(len(it.own) for it in series_of(wild.where(task=tasks[0])))
    page = Section(
        "Wild mechanisms", __doc__.format(trials=trials, harm=HARM, law=LAW, factor=FACTOR)
    )
    page.choose(TASK, "Task", tasks, task_text)
    for task in tasks:
        _quantiles(page, task, wild.where(task=task))

    def seeds(series: Group) -> str:
        return named([f"{seed:.0f}" for seed in np.unique(series.own["seed"])], LISTED)

    failures = wild.rows(wild.silent)
    page.table(
        f"All {len(failures)} silent failures on wild mechanisms, with their seeds",
        [
            SERIES,
            left("Task", lambda _, task: task_text(task)),
            right("Count", "own", len),
            left("Seeds", lambda series, _: seeds(series)),
        ],
        [
            (series, task)
            for task in failures.present("task")
            for series in series_of(failures.where(task=task))
        ],
        folded=True,
    )
    return page


def _quantiles(page: Section, task: str, wild: Stress) -> None:
    page.table(
        f"{task_text(task)}: η at the median, at 90 % and 99 % of the mechanisms, and the largest",
        [
            SERIES,
            right("Trials", "own", len),
            [
                right(title, lambda it, i=i: eta_text(eta_quantiles(it.own)[i]))
                for i, title in enumerate(QUANTILES.values())
            ],
            right("Failed", lambda it: int((~it.own.ok).sum())),
            right("Silent", lambda it: int(it.own.silent.sum())),
            right("Harmed", lambda it: _harmed(it.own)),
            right("Estimates", lambda it: _estimated(it.own), share_text),
            right("Widened", lambda it: _widened(it.own), share_text),
        ],
        series_of(wild),
        shown={TASK: task},
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


def _harmed(rows: Stress) -> str | None:
    """Of the answers that know their error before refinement."""
    if not (rows.ok & (rows["unrefined"] >= 0)).any():
        return None
    harmed = rows.rows(harmed_by_refinement(rows))
    return f"{len(harmed)} ({int((harmed['eta'] > LAW).sum())})"


def _estimated(rows: Stress) -> float | None:
    own = rows.rows(rows.ok & (rows["estimate"] >= 0))
    return float(within_factor(own).mean()) if len(own) else None


def _widened(rows: Stress) -> float | None:
    widened = rows["widened"][rows.ok & ~np.isnan(rows["widened"])]
    return float(widened.mean()) if len(widened) else None
