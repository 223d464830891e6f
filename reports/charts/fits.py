"""The charts of fits: Jacobians' time and error, convergence, base parameters, held-out torques."""

import altair as alt

from charts.common import (
    NUMBER,
    TIME,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
)
from charts.text import error_text, share_text, time_text
from read.data import Jacobian, scene_size
from read.fits import Identification

JOINT = "joint"  # the parameter that says whose torque is drawn

JACOBIAN_TOOLTIPS = {
    "scene": "scene",
    "variant": "Jacobian",
    "time_text": "median time",
    "variation": "variation of time",
    "error_text": "relative error",
}
CONVERGENCE_TOOLTIPS = {
    "scene": "scene",
    "variant": "residual",
    "iteration": "iteration",
    "time_text": "time",
    "error_text": "error",
}
PARAMETER_TOOLTIPS = {
    "scene": "scene",
    "name": "base parameter",
    "true_text": "true",
    "fitted_text": "fitted",
    "low_text": "95 %: from",
    "high_text": "to",
    "holds": "holds the truth",
}
TORQUE_TOOLTIPS = {"time": "time [s]", "measured": "measured", "fitted": "fitted", "start": "start"}


def work_precision(jacobians: list[Jacobian], style: Style):
    """Error against time: a mark a variant and scene with N beside it, a line a variant."""
    rows = [
        {
            "scene": time.scene,
            "n": scene_size(time.scene),
            "variant": time.variant,
            "time": time.nanoseconds,
            "error": error,
            "time_text": time_text(time.nanoseconds),
            "variation": share_text(time.variation),
            "error_text": error_text(error),
        }
        for time, error in jacobians
        if time.nanoseconds
    ]
    mark_last(rows, "error", "n")
    x = alt.X(
        "time:Q",
        axis=log_axis("x", "median time of a Jacobian", TIME),
        scale=alt.Scale(type="log", nice=False, padding=18),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "relative error", NUMBER), scale=error_scale(rows))
    drawn = filtered({}).encode(x=x, y=y, **_series(style, JACOBIAN_TOOLTIPS))
    line = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(order=alt.Order("n:Q"))
    name = drawn.mark_text(align="left", dx=7, dy=-7).encode(text=alt.Text("n:N"))
    return alt.layer(line, _marks(drawn, style), name, names(drawn), **frame(rows))


def convergence(fits: list[Identification], style: Style):
    """Error of the base parameters against iterations, a line a residual."""
    rows = [
        {
            "scene": fit.scene,
            "variant": fit.residual,
            "iteration": i,
            "error": step.error,
            "time_text": time_text(1e9 * step.seconds),
            "error_text": error_text(step.error),
        }
        for fit in fits
        for i, step in enumerate(fit.iterations)
        if step.error
    ]
    mark_last(rows, "error", "iteration")
    y = alt.Y(
        "error:Q",
        axis=log_axis("y", "largest error of a base parameter", NUMBER),
        scale=error_scale(rows),
    )
    drawn = filtered({}).encode(
        x=alt.X("iteration:Q", axis=alt.Axis(title="iteration", format="d", tickMinStep=1)),
        y=y,
        **_series(style, CONVERGENCE_TOOLTIPS),
    )
    line = drawn.mark_line(strokeWidth=1.25, opacity=0.7)
    return alt.layer(line, _marks(drawn, style, 25), names(drawn), **frame(rows))


def intervals(fit: Identification):
    """Fitted minus true in the parameter's own size, with its interval; zero is the truth."""
    rows = [
        {
            "scene": fit.scene,
            "place": i + 1,
            "name": parameter.name,
            **{
                name: (getattr(parameter, name) - parameter.true) / parameter.unit
                for name in ("fitted", "low", "high")
            },
            **{
                f"{name}_text": error_text(getattr(parameter, name))
                for name in ("true", "fitted", "low", "high")
            },
            "holds": "yes" if parameter.holds_truth else "no",
        }
        for i, parameter in enumerate(fit.base_parameters)
    ]
    title = "(fitted − true) / size of the parameter"
    tooltip = [alt.Tooltip(f"{name}:N", title=title) for name, title in PARAMETER_TOOLTIPS.items()]
    colour = alt.Color(
        "holds:N",
        scale=alt.Scale(domain=["yes", "no"], range=["var(--good)", "var(--bad)"]),
        legend=None,
    )
    axis = alt.Axis(title="base parameter, the best seen first", format="d")
    drawn = alt.Chart().encode(
        x=alt.X("place:Q", axis=axis, scale=alt.Scale(nice=False, padding=8)),
        color=colour,
        tooltip=tooltip,
    )
    truth = alt.Chart(alt.InlineData(values=[{"y": 0}])).mark_rule(
        color="currentColor", opacity=0.5
    )
    return alt.layer(
        truth.encode(y=alt.Y("y:Q")),
        drawn.mark_rule(strokeWidth=1.5).encode(y=alt.Y("low:Q", title=title), y2=alt.Y2("high:Q")),
        drawn.mark_point(shape="circle", filled=True, size=40, opacity=1).encode(y=alt.Y("fitted:Q")),
        **frame(rows),
    )


def torques(fit: Identification, first: str):
    """Held-out torque of the chosen joint: measured, by the fitted robot and by the start."""
    rows = [
        {
            "scene": fit.scene,
            JOINT: prediction.joint,
            **{
                name: float(f"{value:.4g}")
                for name, value in zip(("time", "measured", "fitted", "start"), values, strict=True)
            },
        }
        for prediction in fit.predictions
        for values in zip(*prediction[1:], strict=True)
    ]
    tooltip = [alt.Tooltip(f"{name}:Q", title=title) for name, title in TORQUE_TOOLTIPS.items()]
    drawn = filtered({JOINT: first}).encode(
        x=alt.X("time:Q", axis=alt.Axis(title="time [s]"), scale=alt.Scale(nice=False)),
        tooltip=tooltip,
    )
    colour = alt.Scale(
        domain=["measured", "fitted", "start"],
        range=["currentColor", "var(--good)", "var(--bad)"],
    )

    def series(name: str):
        legend = alt.Legend(title=None, orient="top", symbolType="circle")
        return drawn.transform_calculate(series=f"'{name}'").encode(
            y=alt.Y(f"{name}:Q", title="torque [N m or N]"),
            color=alt.Color("series:N", scale=colour, legend=legend),
        )

    return alt.layer(
        series("start").mark_line(strokeWidth=1, strokeDash=[4, 3], opacity=0.8),
        series("fitted").mark_line(strokeWidth=1.5),
        series("measured").mark_point(shape="circle", filled=True, size=14, opacity=0.8),
        **frame(rows),
    )


def _series(style: Style, tooltips: dict[str, str]) -> dict:
    return {
        "color": alt.Color("variant:N", scale=style.colour, legend=None),
        "tooltip": [alt.Tooltip(f"{name}:N", title=title) for name, title in tooltips.items()],
    }


def _marks(drawn, style: Style, size: int = 55):
    shape = alt.Shape("variant:N", scale=style.variant_shape, legend=None)
    look = {"filled": True, "opacity": 1, "stroke": style.page, "strokeWidth": 0.5}
    return drawn.encode(shape=shape).mark_point(size=size, **look)
