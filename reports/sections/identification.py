"""Masses, centres of mass and moments of inertia of all bodies, fitted with Ceres to torques and
motion by the program identify. The motion is a Fourier series, chosen for a well-conditioned
regressor, and MuJoCo computes its torques; the fit starts from masses, centres and radii of
gyration 50 % off. Only combinations of the parameters can be seen in the motion, the base
parameters; a rank-revealing QR of the Jacobian finds them. Their error is the largest of all, in
each one’s own size.

The held-out samples are of another motion than those of the fit. The error of their torques is its
root mean square over that of the torques (NRMSE). A body is physical if its pseudo-inertia’s
smallest eigenvalue is positive; the coordinates of the fit keep it so, but where a body that the
data hardly see shrinks to a plane or a line it is 0 to rounding. Simulated motion has the model’s
own joints and no friction that the model does not know, and noise is added to torques alone: that a
real robot is fitted as well is not shown here.
"""

from charts import fits as fit_charts
from charts import palette
from charts.common import Style
from charts.text import error_text, three_digits
from page.section import Choice, Section, Verdict, left, right
from read.data import Data, scene_size
from read.fits import Identification
from sections.common import named, seconds_text
from summary.groups import by_key

RESIDUALS = list(palette.RESIDUALS)
NAMED = 8  # parameters that are named at most


def section(data: Data) -> Section | None:
    fits = sorted(data.fits, key=_order)
    if not fits:
        return None
    known = [fit for fit in fits if any(step.error for step in fit.iterations)]
    exact = [fit for fit in known if not fit.noise]
    noisy = [fit for fit in known if fit.noise and fit.base_parameters]
    predicted = [fit for fit in noisy or fits if fit.predictions]
    page = Section(
        "Inertial parameters from motion", __doc__, Style((fit.residual for fit in exact), [])
    )
    page.say(*_not_seen(fits))
    page.say(*(f"{fit.title}: warning: {text}." for fit in fits for text in fit.warnings))
    for scene, own in by_key(exact, lambda fit: fit.scene).items():
        chart = fit_charts.convergence(own, page.style)
        title = f"{scene}: convergence without noise"
        page.figure(title, chart, fit_charts.CONVERGENCE_TOOLTIPS)
    for fit in noisy:
        held = sum(parameter.holds_truth for parameter in fit.base_parameters)
        page.figure(
            f"{fit.title}: fitted against true",
            fit_charts.intervals(fit),
            fit_charts.PARAMETER_TOOLTIPS,
            notes=f"{held} of {len(fit.base_parameters)} intervals of 95 % hold the truth.",
        )
    for fit in predicted[:1]:
        choice = Choice(fit_charts.JOINT, "Joint", [it.joint for it in fit.predictions])
        chart = fit_charts.torques(fit, choice.first)
        title = f"{fit.title}: held-out torque"
        page.figure(title, chart, fit_charts.TORQUE_TOOLTIPS, [choice])
    page.table(
        """Every fit. Seen: base parameters of all parameters. cond J: of the Jacobian over the base
        parameters. A fit is usable if the solver ended well and the held-out torques are predicted
        no worse than by the start (within a tenth).""",
        [
            left("Scene:N", "scene"),
            left("Residual", "residual"),
            right("Noise", lambda it: "measured" if it.noise is None else f"{100 * it.noise:g} %"),
            right("Samples", "samples"),
            right("Seen", _seen),
            right("cond J", "condition", error_text),
            right("Iterations", lambda it: len(it.iterations)),
            right("Time", "seconds", seconds_text),
            right("Error: start", "error_of_start", error_text),
            right("Error: fitted", "error", error_text),
            right("Held-out NRMSE: start", "nrmse_of_start", _percent),
            right("NRMSE: fitted", "nrmse", _percent),
            right("Least eigenvalue", "smallest_eigenvalue", error_text),
            left("Usable", "usable", Verdict),
        ],
        fits,
    )
    return page


def _order(fit: Identification) -> tuple:
    known = fit.residual in RESIDUALS
    rank = RESIDUALS.index(fit.residual) if known else len(RESIDUALS)
    return scene_size(fit.scene), fit.scene, fit.noise or 0, rank, fit.residual


def _not_seen(fits: list[Identification]) -> list[str]:
    """One statement for all fits of a scene of which it is true."""
    said = []
    for fit in fits:
        unseen, lost = named(fit.unseen, NAMED), named(fit.lost, NAMED)
        if unseen:
            count = f"{len(fit.unseen)} of {fit.parameters} parameters"
            said.append((fit, f"{count} are in nothing that the data see: {unseen}."))
        if lost:
            said.append((fit, f"this motion does not show what another would: {lost}."))
    return [
        f"{scene}, {', '.join(dict.fromkeys(fit.residual for fit, _ in own))}: {text}"
        for (scene, text), own in by_key(said, lambda it: (it[0].scene, it[1])).items()
    ]


def _seen(fit: Identification) -> str | None:
    return None if fit.rank is None else f"{fit.rank} of {fit.parameters}"


def _percent(share: float) -> str:
    """With its digits, however small."""
    return f"{three_digits(100 * share) if share >= 1e-4 else error_text(100 * share)} %"
