"""Simulated motions of stiff joints: error at the end against time, by integrator and step."""

from itertools import groupby

from charts import motions as motion_charts
from charts.common import VIEW, Style
from charts.motions import MEASURES, MOTION, step_text
from charts.text import error_text, time_text, tolerance_text
from page.section import Choice, Figure, Section, Table
from read.data import Data, scene_size
from read.motions import Case, Simulation

TOLERANCES = (1e-2, 1e-4, 1e-6)  # errors for which a method is advised
CVODE = "cvode_bdf"
ADAPTIVE = "dopri5"  # measured, where adaptive methods are


def section(data: Data) -> Section | None:
    left_out = [row for row in data.motions if isinstance(row, Case)]
    simulations = [row for row in data.motions if isinstance(row, Simulation)]
    if not data.motions:
        return None
    cases = _cases(simulations)
    measured = [it for own in cases.values() for it in own if it.status == "ok"]
    style = Style((it.variant for it in measured), (it.precision for it in measured))
    choice = Choice(VIEW, "Error of", list(MEASURES.items()), "q")
    figures = [
        _figure(robot, [it for it in measured if it.case.robot == robot], style, choice.first)
        for robot in dict.fromkeys(case.robot for case in cases)
        if any(it.case.robot == robot for it in measured)
    ]
    return Section(
        "Motions",
        [
            "A position controller holds every hinge and slide, with a stiffness k [N m/rad or "
            "N/m] and a damping ratio ζ or damping b, while its target moves. From a seeded state "
            "the motion is simulated, without contacts and limits, and its end compared with a "
            "true one: relative errors of positions, quaternions on their sphere, and of "
            "velocities. Points of a line are steps h, or tolerances of adaptive methods. "
            "springs_at_end and springs_at_start are implicit steps of Kalmarm, mj_ MuJoCo’s "
            "integrators.",
            *_truth(measured),
            *_without_cvode(measured),
        ],
        statements=[_advice(case, own) for case, own in cases.items()]
        + [
            f"{case.robot}, {case.title}: left out, since its true end cannot be proven."
            for case in left_out
        ],
        choices=[choice],
        variants=style.variants,
        precisions=style.precisions,
        figures=figures,
        tables=[_table(cases)] if cases else [],
    )


def _cases(simulations: list[Simulation]) -> dict[Case, list[Simulation]]:
    def order(it: Simulation) -> tuple:
        case = it.case
        damping = (case.damping_ratio or 0, case.damping or 0)
        of_case = (case.stiffness, damping, case.duration, case.seed)
        return scene_size(case.robot), case.robot, of_case

    ordered = sorted(simulations, key=order)  # else as they were recorded
    return {case: list(own) for case, own in groupby(ordered, key=lambda it: it.case)}


def _figure(robot: str, own: list[Simulation], style: Style, measure: str) -> Figure:
    titles = list(dict.fromkeys(it.case.title for it in own))
    choice = Choice(MOTION, "Motion", [(title, title) for title in titles], titles[-1])
    chart = motion_charts.work_precision(own, style, {VIEW: measure, MOTION: choice.first})
    several = len(titles) > 1
    title = f"{robot}: error of the motion against time"
    return Figure(
        title if several else f"{title}, {titles[0]}",
        chart,
        motion_charts.TOOLTIPS,
        choices=[choice] if several else [],
        notes=["Steps that are unstable have no mark: the table has the largest that are stable."],
    )


def _truth(measured: list[Simulation]) -> list[str]:
    if not measured:
        return []
    bound = max(it.truth for it in measured)
    return [
        "True ends are by an integrator of order 8 in long double, at two tolerances, whose ends "
        f"are at most {error_text(bound)} apart."
    ]


def _without_cvode(measured: list[Simulation]) -> list[str]:
    known = {it.integrator for it in measured}
    if ADAPTIVE not in known or CVODE in known:
        return []
    return ["CVODE of SUNDIALS was not there to be measured: scripts/setup --sundials installs it."]


def _series(own: list[Simulation]) -> dict[tuple[str, str], list[Simulation]]:
    out = {}
    for it in own:
        out.setdefault((it.variant, it.precision), []).append(it)
    return out


def _advice(case: Case, own: list[Simulation]) -> str:
    """The cheapest for each error, of q and v; a step counts if no smaller one is unstable."""
    trusted = [it for series in _series(own).values() for it in _trusted(series)]
    parts = []
    for tolerance in TOLERANCES:
        enough = [it for it in trusted if it.error <= tolerance]
        if not enough:
            parts.append(f"within {tolerance_text(tolerance)} none that was measured")
            continue
        best = min(enough, key=lambda it: it.seconds)
        parts.append(
            f"within {tolerance_text(tolerance)} {best.variant} in {best.precision} with "
            f"{step_text(best)}, {time_text(1e9 * best.seconds)} a simulated second"
        )
    return f"{case.robot}, {case.title}: cheapest for q and v {'; '.join(parts)}."


def _trusted(series: list[Simulation]) -> list[Simulation]:
    """Those that are ok, as are all with smaller steps; of adaptive methods all that are ok."""
    out = []
    for it in sorted(series, key=lambda it: it.h or 0):
        if it.status == "ok":
            out.append(it)
        elif it.h is not None:
            break
    return out


def _table(cases: dict[Case, list[Simulation]]) -> Table:
    rows = []
    for case, own in cases.items():
        for (variant, precision), series in _series(own).items():
            if series[0].h is None:
                continue
            trusted = _trusted(series)
            first = [case.robot, case.title, variant, precision]
            if not trusted:
                smallest = min(it.h for it in series)
                rows.append([*first, f"not at {time_text(1e9 * smallest)}", "–", "–", "–"])
                continue
            last = trusted[-1]
            rows.append(
                [
                    *first,
                    time_text(1e9 * last.h),
                    error_text(last.error_q),
                    error_text(last.error_v),
                    time_text(1e9 * last.seconds),
                ]
            )
    return Table(
        "Largest step from which on a method is stable, of those measured: it and all smaller ones "
        "end finite and off by less than the motion itself. Errors and time are of that step.",
        [
            "Robot",
            "Motion",
            "Integrator",
            "Precision",
            "Stable from h",
            "Error of q",
            "Error of v",
            "Time of a second",
        ],
        rows,
        "llllrrrr",
        folded=True,
    )
