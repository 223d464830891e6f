"""A position controller holds every hinge and slide, with a stiffness k [N m/rad or N/m] and a
damping ratio ζ or damping b, while its target moves. From a seeded state the motion is simulated,
without contacts and limits, and its end compared with a true one: relative errors of positions,
quaternions on their sphere, and of velocities. Points of a line are steps h, or tolerances of
adaptive methods. springs_at_end and springs_at_start are implicit steps of Kalmarm, mj_ MuJoCo’s
integrators.
"""

from charts import motions as motion_charts
from charts.common import VIEW
from charts.motions import MEASURES, MOTION, step_text
from charts.text import error_text, tolerance_text
from page.section import Choice, Section, left, of, right
from read.data import Data, scene_size
from read.motions import Case, Simulation
from sections.common import Group, groups, seconds_text, style_of
from summary.groups import by_key

TOLERANCES = (1e-2, 1e-4, 1e-6)  # errors for which a method is advised
CVODE = "cvode_bdf"
ADAPTIVE = "dopri5"  # measured, where adaptive methods are


def section(data: Data) -> Section | None:
    if not data.motions:
        return None
    left_out = [row for row in data.motions if isinstance(row, Case)]
    simulations = [row for row in data.motions if isinstance(row, Simulation)]
    simulations.sort(key=_order)
    cases = by_key(simulations, lambda it: it.case)
    measured = [it for own in cases.values() for it in own if it.status == "ok"]
    page = Section(
        "Motions", [__doc__, _truth(measured), _without_cvode(measured)], style_of(measured)
    )
    page.say(*(_advice(case, own) for case, own in cases.items()))
    for case in left_out:
        page.say(f"{case.robot}, {case.title}: left out, since its true end cannot be proven.")
    page.choose(VIEW, "Error of", MEASURES, MEASURES.get)
    for robot, own in by_key(measured, lambda it: it.case.robot).items():
        titles = list(dict.fromkeys(it.case.title for it in own))
        choice = Choice(MOTION, "Motion", titles, first=titles[-1])
        first = page.first | {MOTION: choice.first}
        title = f"{robot}: error of the motion against time"
        page.figure(
            title if len(titles) > 1 else f"{title}, {titles[0]}",
            motion_charts.work_precision(own, page.style, first),
            motion_charts.TOOLTIPS,
            [choice],
            "Steps that are unstable have no mark: the table has the largest that are stable.",
        )

    def largest(series: Group) -> Simulation | None:
        return next(reversed(_trusted(series.own)), None)

    def stable_from(series: Group) -> str:
        if last := largest(series):
            return seconds_text(last.h)
        return f"not at {seconds_text(min(it.h for it in series.own))}"

    series = groups(simulations, "case", "variant", "precision")
    page.table(
        """Largest step from which on a method is stable, of those measured: it and all smaller ones
        end finite and off by less than the motion itself. Errors and time are of that step.""",
        [
            left("Robot", "case.robot"),
            left("Motion", "case.title"),
            left("Integrator", "variant"),
            left("Precision", "precision"),
            right("Stable from h", stable_from),
            of(
                largest,
                right("Error of q", "error_q", error_text),
                right("Error of v", "error_v", error_text),
                right("Time of a second", "seconds", seconds_text),
            ),
        ],
        [it for it in series if it.own[0].h is not None],
        folded=True,
    )
    return page


def _order(it: Simulation) -> tuple:
    """By cases; else as they were recorded."""
    case = it.case
    damping = (case.damping_ratio or 0, case.damping or 0)
    return scene_size(case.robot), case.robot, case.stiffness, damping, case.duration, case.seed


def _truth(measured: list[Simulation]) -> str:
    if not measured:
        return ""
    return f"""True ends are by an integrator of order 8 in long double, at two tolerances, whose
        ends are at most {error_text(max(it.truth for it in measured))} apart."""


def _without_cvode(measured: list[Simulation]) -> str:
    known = {it.integrator for it in measured}
    if ADAPTIVE not in known or CVODE in known:
        return ""
    return "CVODE of SUNDIALS was not there to be measured: scripts/setup --sundials installs it."


def _advice(case: Case, own: list[Simulation]) -> str:
    """The cheapest for each error, of q and v; a step counts if no smaller one is unstable."""
    series = groups(own, "variant", "precision")
    trusted = [it for one in series for it in _trusted(one.own)]
    parts = []
    for tolerance in TOLERANCES:
        enough = [it for it in trusted if it.error <= tolerance]
        best = min(enough, key=lambda it: it.seconds, default=None)
        said = (
            f"{best.variant} in {best.precision} with {step_text(best)}, "
            f"{seconds_text(best.seconds)} a simulated second"
            if best
            else "none that was measured"
        )
        parts.append(f"within {tolerance_text(tolerance)} {said}")
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
