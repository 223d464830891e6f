"""The charts of fits: Jacobians' time and error, convergence, base parameters, held-out torques."""

import altair as alt

from charts.common import Style, dots, error_scale, filtered, frame, looks, mark_last, short
from charts.layers import INK, log, one
from charts.rows import fields, numbers, titled, tooltip
from charts.text import error_text, share_text, time_text
from charts.variants import coloured, curves, lines
from read.data import Jacobian, scene_size
from read.fits import Identification

JOINT = "joint"  # the parameter that says whose torque is drawn

JACOBIAN_TOOLTIPS = titled(
    "scene variant time_text variation error_text", variant="Jacobian", error_text="relative error"
)
CONVERGENCE_TOOLTIPS = titled(
    "scene variant iteration time_text error_text",
    variant="residual",
    time_text="time",
    error_text="error",
)
PARAMETER_TOOLTIPS = titled(
    "scene name true_text fitted_text low_text high_text holds",
    name="base parameter",
    low_text="95 %: from",
    high_text="to",
    holds="holds the truth",
)
TORQUE_TOOLTIPS = titled("time measured fitted start", time="time [s]")


def work_precision(jacobians: list[Jacobian], style: Style):
    """Error against time: a mark a variant and scene with N beside it, a line a variant."""
    rows = [
        fields(time, "scene", "variant")
        | {"n": scene_size(time.scene), "variation": share_text(time.variation)}
        | numbers(time_text, time=time.nanoseconds)
        | numbers(error_text, error=error)
        for time, error in jacobians
        if time.nanoseconds
    ]
    mark_last(rows, "error", "n")
    drawn = filtered({}).encode(
        x=log(alt.X, "time", "median time of a Jacobian", 18),
        y=log(alt.Y, "error", "relative error", error_scale(rows)),
        **coloured(style, JACOBIAN_TOOLTIPS),
    )
    line, marks, name = curves(drawn, style, style.dots(55), style.variant_shape, {"order": "n:Q"})
    size = drawn.mark_text(align="left", dx=7, dy=-7).encode(text="n:N")
    return alt.layer(line, marks, size, name, **frame(rows))


def convergence(fits: list[Identification], style: Style):
    """Error of the base parameters against iterations, a line a residual."""
    rows = [
        {"scene": fit.scene, "variant": fit.residual, "iteration": i}
        | numbers(error_text, error=step.error)
        | {"time_text": time_text(1e9 * step.seconds)}
        for fit in fits
        for i, step in enumerate(fit.iterations)
        if step.error
    ]
    mark_last(rows, "error", "iteration")
    title = "largest error of a base parameter"
    axis = alt.Axis(title="iteration", format="d", tickMinStep=1)
    x = alt.X("iteration:Q", axis=axis)
    y = log(alt.Y, "error", title, error_scale(rows))
    look = {"marks": style.dots(25), "shape": style.variant_shape, "path": {}}
    return lines(rows, style, {}, CONVERGENCE_TOOLTIPS, x, y, **look)


def intervals(fit: Identification):
    """Fitted minus true in the parameter's own size, with its interval; zero is the truth."""
    rows = []
    for place, parameter in enumerate(fit.base_parameters, 1):
        own = fields(parameter, "true", "fitted", "low", "high")
        rows.append(
            {"scene": fit.scene, "place": place, "name": parameter.name}
            | {
                name: (own[name] - parameter.true) / parameter.unit
                for name in ("fitted", "low", "high")
            }
            | {f"{name}_text": error_text(value) for name, value in own.items()}
            | {"holds": "yes" if parameter.holds_truth else "no"}
        )
    axis = alt.Axis(title="base parameter, the best seen first", format="d")
    low = alt.Y("low:Q", title="(fitted − true) / size of the parameter")
    drawn = alt.Chart().encode(
        x=alt.X("place:Q", axis=axis, scale=alt.Scale(nice=False, padding=8)),
        color=looks(alt.Color, "holds", ("yes", "no"), ("var(--good)", "var(--bad)")),
        tooltip=tooltip(PARAMETER_TOOLTIPS),
    )
    return alt.layer(
        one(y=0).mark_rule(**INK, opacity=0.5).encode(y="y:Q"),
        drawn.mark_rule(strokeWidth=1.5).encode(y=low, y2="high:Q"),
        drawn.mark_point(shape="circle", **dots(40)).encode(y="fitted:Q"),
        **frame(rows),
    )


def torques(fit: Identification, first: str):
    """Held-out torque of the chosen joint: measured, by the fitted robot and by the start."""
    rows = [
        {"scene": fit.scene, JOINT: prediction.joint}
        | dict(zip(TORQUE_TOOLTIPS, map(short, values), strict=True))
        for prediction in fit.predictions
        for values in zip(*prediction[1:], strict=True)
    ]
    drawn = filtered({JOINT: first}).encode(
        x=alt.X("time:Q", axis=alt.Axis(title="time [s]"), scale=alt.Scale(nice=False)),
        tooltip=tooltip(TORQUE_TOOLTIPS, "Q"),
    )
    names, inks = ("measured", "fitted", "start"), ("currentColor", "var(--good)", "var(--bad)")
    legend = alt.Legend(title=None, orient="top", symbolType="circle")

    def series(name: str):
        return drawn.transform_calculate(series=f"'{name}'").encode(
            y=alt.Y(f"{name}:Q", title="torque [N m or N]"),
            color=looks(alt.Color, "series", names, inks, legend=legend),
        )

    return alt.layer(
        series("start").mark_line(strokeWidth=1, strokeDash=[4, 3], opacity=0.8),
        series("fitted").mark_line(strokeWidth=1.5),
        series("measured").mark_point(shape="circle", **dots(14) | {"opacity": 0.8}),
        **frame(rows),
    )
