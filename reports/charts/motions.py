"""The chart of simulated motions: error at the end against the time that was spent."""

import altair as alt

from charts.common import VIEW, Style, error_scale, mark_last
from charts.layers import log
from charts.rows import numbers, titled
from charts.text import error_text, time_text
from charts.variants import lines
from read.motions import Simulation

MOTION = "motion"  # the parameter that says which motion of a robot is drawn
MEASURES = {"q": "positions q", "v": "velocities v"}
FIRST = {  # what is shown at first
    ("springs_at_end", "float32"),
    ("springs_at_end", "float64"),
    ("springs_at_start", "float64"),
    ("semi_implicit_euler", "float64"),
    ("rk4", "float64"),
    ("mj_discrete", "float64"),
    ("dopri5", "float64"),
    ("cvode_bdf", "float64"),
}
TOOLTIPS = titled(
    "scene variant precision step error_text time_text calls",
    scene="robot",
    variant="integrator",
    error_text="error",
    time_text="time of a simulated second",
    calls="accelerations",
)


def step_text(simulation: Simulation) -> str:
    if simulation.h is None:
        return f"tolerance {error_text(simulation.tolerance)}"
    return f"h = {time_text(1e9 * simulation.h)}"


def work_precision(simulations: list[Simulation], style: Style, choices: dict[str, str]):
    """A line each integrator, form and precision; its points are steps or tolerances."""
    rows = [
        {
            "scene": it.case.robot,
            MOTION: it.case.title,
            VIEW: measure,
            "variant": it.variant,
            "precision": it.precision,
            "step": step_text(it),
            "calls": it.calls,
        }
        | numbers(time_text, time=1e9 * it.seconds)
        | numbers(error_text, error=error)
        | ({} if (it.variant, it.precision) in FIRST else {"more": 1})
        for it in simulations
        if it.status == "ok"
        for measure, error in (("q", it.error_q), ("v", it.error_v))
    ]
    mark_last(rows, "error", "time", (VIEW, MOTION))
    x = log(alt.X, "time", "time of a simulated second", 12)
    y = log(alt.Y, "error", "relative error at the end", error_scale(rows))
    return lines(rows, style, choices, TOOLTIPS, x, y)
