"""Inertial parameters fitted to motion: convergence, intervals, held-out torques, what is seen."""

from collections import defaultdict

from charts import fits as fit_charts
from charts import palette
from charts.common import Style
from charts.text import error_text, three_digits, time_text
from page.section import Choice, Figure, Section, Table, Verdict
from read.data import Data, scene_size
from read.fits import Identification

RESIDUALS = list(palette.RESIDUALS)
NAMED = 8  # parameters that are named at most


def section(data: Data) -> Section | None:
    fits = sorted(data.fits, key=_order)
    if not fits:
        return None
    known = [fit for fit in fits if any(step.error for step in fit.iterations)]
    exact = [fit for fit in known if not fit.noise]
    style = Style((fit.residual for fit in exact), [])
    figures = []
    for scene in dict.fromkeys(fit.scene for fit in exact):
        own = [fit for fit in exact if fit.scene == scene]
        chart = fit_charts.convergence(own, style)
        title = f"{scene}: convergence without noise"
        figures.append(Figure(title, chart, fit_charts.CONVERGENCE_TOOLTIPS))
    noisy = [fit for fit in known if fit.noise and fit.base_parameters]
    figures += [_intervals(fit) for fit in noisy]
    shown = [fit for fit in noisy or fits if fit.predictions]
    figures += [_torques(fit) for fit in shown[:1]]
    return Section(
        "Inertial parameters from motion",
        [
            "Masses, centres of mass and moments of inertia of all bodies, fitted with Ceres to "
            "torques and motion by the program identify. The motion is a Fourier series, chosen "
            "for a well-conditioned regressor, and MuJoCo computes its torques; the fit starts "
            "from masses, centres and radii of gyration 50 % off. Only combinations of the "
            "parameters can be seen in the motion, the base parameters; a rank-revealing QR of "
            "the Jacobian finds them. Their error is the largest of all, in each one’s own size.",
            "The held-out samples are of another motion than those of the fit. The error of their "
            "torques is its root mean square over that of the torques (NRMSE). A body is "
            "physical if its pseudo-inertia’s smallest eigenvalue is positive; the coordinates of "
            "the fit keep it so, but where a body that the data hardly see shrinks to a plane or "
            "a line it is 0 to rounding. Simulated motion has the model’s own joints and no "
            "friction that the model does not know, and noise is added to torques alone: that a "
            "real robot is fitted as well is not shown here.",
        ],
        statements=_not_seen(fits) + _warnings(fits),
        variants=style.variants,
        figures=figures,
        tables=[_table(fits)],
    )


def _order(fit: Identification) -> tuple:
    known = fit.residual in RESIDUALS
    rank = RESIDUALS.index(fit.residual) if known else len(RESIDUALS)
    return scene_size(fit.scene), fit.scene, fit.noise or 0, rank, fit.residual


def _intervals(fit: Identification) -> Figure:
    parameters = fit.base_parameters
    held = sum(parameter.holds_truth for parameter in parameters)
    return Figure(
        f"{fit.title}: fitted against true",
        fit_charts.intervals(fit),
        fit_charts.PARAMETER_TOOLTIPS,
        notes=[f"{held} of {len(parameters)} intervals of 95 % hold the truth."],
    )


def _torques(fit: Identification) -> Figure:
    joints = [prediction.joint for prediction in fit.predictions]
    choice = Choice(fit_charts.JOINT, "Joint", [(joint, joint) for joint in joints], joints[0])
    return Figure(
        f"{fit.title}: held-out torque",
        fit_charts.torques(fit, choice.first),
        fit_charts.TORQUE_TOOLTIPS,
        choices=[choice],
    )


def _not_seen(fits: list[Identification]) -> list[str]:
    """One statement for all fits of a scene of which it is true."""
    fits_of = defaultdict(list)
    for fit in fits:
        if fit.unseen:
            text = (
                f"{len(fit.unseen)} of {fit.parameters} parameters are in nothing that the data "
                f"see: {_named(fit.unseen)}."
            )
            fits_of[fit.scene, text].append(fit.residual)
        if fit.lost:
            text = f"this motion does not show what another would: {_named(fit.lost)}."
            fits_of[fit.scene, text].append(fit.residual)
    return [
        f"{scene}, {', '.join(dict.fromkeys(residuals))}: {text}"
        for (scene, text), residuals in fits_of.items()
    ]


def _warnings(fits: list[Identification]) -> list[str]:
    return [f"{fit.title}: warning: {text}." for fit in fits for text in fit.warnings]


def _named(names: list[str]) -> str:
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def _table(fits: list[Identification]) -> Table:
    return Table(
        "Every fit. Seen: base parameters of all parameters. cond J: of the Jacobian over the base "
        "parameters. A fit is usable if the solver ended well and the held-out torques are "
        "predicted no worse than by the start (within a tenth).",
        [
            "Scene:N",
            "Residual",
            "Noise",
            "Samples",
            "Seen",
            "cond J",
            "Iterations",
            "Time",
            "Error: start",
            "Error: fitted",
            "Held-out NRMSE: start",
            "NRMSE: fitted",
            "Least eigenvalue",
            "Usable",
        ],
        [_row(fit) for fit in fits],
        "llrrrrrrrrrrrl",
    )


def _row(fit: Identification) -> list:
    return [
        fit.scene,
        fit.residual,
        "measured" if fit.noise is None else f"{100 * fit.noise:g} %",
        str(fit.samples),
        "–" if fit.rank is None else f"{fit.rank} of {fit.parameters}",
        error_text(fit.condition),
        str(len(fit.iterations)),
        time_text(1e9 * fit.seconds),
        error_text(fit.error_of_start),
        error_text(fit.error),
        _percent(fit.nrmse_of_start),
        _percent(fit.nrmse),
        error_text(fit.smallest_eigenvalue),
        Verdict(fit.usable),
    ]


def _percent(share: float | None) -> str:
    """With its digits, however small."""
    if share is None:
        return "–"
    return f"{three_digits(100 * share) if share >= 1e-4 else error_text(100 * share)} %"
