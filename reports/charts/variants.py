"""The charts of errors, times and condition numbers of variants, for the page and for a file."""

import altair as alt

from charts.common import (
    BAND,
    HEIGHT,
    NAMED,
    NUMBER,
    TIME,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
    short,
    strip,
    view,
)
from charts.groups import mark_first
from charts.text import error_text, share_text, time_text
from summary.points import Point

TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "precision": "precision",
    "time_text": "median time",
    "variation": "variation of time",
    "error_text": "median error",
    "worst": "largest error",
    "states": "states",
    "failures": "failed",
}

CONDITION_TOOLTIPS = {
    "scene": "scene",
    "number": "number",
    "median": "median",
    "largest": "largest",
    "states": "states",
    "failed": "failed",
}

PEAK_TOOLTIPS = {
    "scene": "scene",
    "variant": "variant",
    "precision": "precision",
    "rate": "operations a second",
    "peak": "peak",
    "share_text": "share of the peak",
    "flops": "operations of a state",
    "time_text": "median time of a state",
}


def point_rows(points: list[Point]) -> list[dict]:
    """Rows for Vega: numbers that place a mark, texts that its tooltip shows."""
    return [
        {
            "scene": point.scene,
            "n": point.n,
            "variant": point.variant,
            "precision": point.precision,
            "view": view(point.task, point.measure),
            "time": short(point.time),
            "error": short(point.median),
            "share": short(point.failures / point.states) if point.states else 0,
            "share_text": share_text(point.failures / point.states) if point.states else "",
            "time_text": time_text(point.time),
            "variation": share_text(point.variation),
            "error_text": error_text(point.median),
            "worst": error_text(point.worst),
            "states": point.states,
            "failures": f"{point.failures} ({point.reasons})" if point.failures else "0",
        }
        for point in points
    ]


def _size_axis(values: list[dict]) -> alt.X:
    sizes = sorted({row["n"] for row in values})
    axis = alt.Axis(title="N, degrees of freedom", values=sizes, format="d", labelOverlap="greedy")
    return alt.X("n:Q", axis=axis, scale=alt.Scale(type="log", nice=False, padding=8))


def series(style: Style, tooltips: dict[str, str] = TOOLTIPS) -> dict:
    """The encoding that all marks of a variant and precision share."""
    return {
        "color": alt.Color("variant:N", scale=style.colour, legend=style.legend, title=None),
        "shape": alt.Shape("precision:N", scale=style.shape, legend=style.legend, title=None),
        "tooltip": [alt.Tooltip(f"{name}:N", title=title) for name, title in tooltips.items()],
    }


def bands(chart, values: list[dict], x, encoding: dict) -> list:
    """What the scale cannot show: crosses for failures above it, marks for errors of zero below."""
    layers = []
    encoding = {"x": x, **encoding}
    if any(row.get("share") for row in values):
        without_shape = {name: channel for name, channel in encoding.items() if name != "shape"}
        failures = chart.transform_filter("datum.share > 0").encode(
            **without_shape, y=alt.YValue(BAND / 2)
        )
        layers += [
            *strip(0, "failed"),
            failures.mark_point(shape="cross", angle=45, filled=True, size=110, opacity=1),
        ]
        if x.shorthand.startswith("time"):
            shares = failures.encode(text=alt.Text("share_text:N")).mark_text(align="left", dx=8)
            layers.append(shares)
    if any(row["error"] == 0 for row in values):
        exact = chart.transform_filter("datum.error === 0").encode(
            **encoding, y=alt.YValue(HEIGHT - BAND / 2)
        )
        layers += [*strip(HEIGHT - BAND, "0"), exact.mark_point(filled=True, size=80, opacity=1)]
    return layers


def front(chart, x, y) -> list:
    """The Pareto front of what is shown, among series without a failure.

    In order of time a point is on the front if its error is below every error before it. The line
    goes on to the right of its last point, as nothing slower does better.
    """
    order = [alt.SortField("time"), alt.SortField("error")]
    steps = (
        chart.transform_filter("isValid(datum.error) && datum.share === 0")
        .transform_window(best="min(error)", sort=order, frame=[None, 0], ignorePeers=True)
        .transform_window(best_before="lag(best)", sort=order)
        .transform_filter("datum.best_before === null || datum.error < datum.best_before")
        .transform_joinaggregate(lowest="min(error)")
        .transform_filter("datum.error > 0")
        .encode(x=x, y=y)
    )
    look = {"color": "currentColor", "opacity": 0.5, "strokeWidth": 1.5}
    last = steps.transform_filter("datum.error === datum.lowest").encode(x2=alt.X2Value("width"))
    return [steps.mark_line(interpolate="step-after", **look), last.mark_rule(**look)]


def work_precision(
    points: list[Point],
    style: Style,
    choices: dict[str, str] | None = None,
    scales: str = "",
    every: bool = False,
):
    """One mark a variant and precision; `scales` begins Vega's names of the chart's scales, `every`
    shows all series at first."""
    values = [row for row in point_rows(points) if row["time"] is not None]
    if not every:
        mark_first(values, "view")
    x = alt.X(
        "time:Q",
        axis=log_axis(f"{scales}x", "median time of a call", TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    y = alt.Y(
        "error:Q", axis=log_axis(f"{scales}y", "median error", NUMBER), scale=error_scale(values)
    )
    chart = filtered(choices)
    drawn = chart.transform_filter("datum.error > 0")
    look = {"filled": True, "size": 80, "opacity": 1, "style": NAMED}
    marks = drawn.mark_point(**look, stroke=style.page, strokeWidth=0.75)
    return alt.layer(
        *front(chart, x, y),
        *bands(chart, values, x, series(style)),
        marks.encode(x=x, y=y, **series(style)),
        **frame(values),
    )


def against_size(points: list[Point], style: Style, choices: dict[str, str], what: str):
    """Error or time against N; `what` is the row's field."""
    values = [row for row in point_rows(points) if row[what] is not None or row["share"]]
    mark_last(mark_first(values, "view"), what, "n")
    x = _size_axis(values)
    chart = filtered(choices)
    if what == "error":
        y = alt.Y("error:Q", axis=log_axis("y", "median error", NUMBER), scale=error_scale(values))
        beyond = bands(chart, values, x, series(style))
    else:
        scale = alt.Scale(type="log", nice=False, padding=8)
        y = alt.Y("time:Q", axis=log_axis("y", "median time of a call", TIME), scale=scale)
        beyond = []
    drawn = chart.transform_filter(f"datum.{what} > 0").encode(x=x, y=y, **series(style))
    return alt.layer(*beyond, *curves(drawn, style), **frame(values))


def curves(drawn, style: Style) -> list:
    """A thin line through the marks of each variant and precision, with its name."""
    dash = alt.StrokeDash("precision:N", scale=style.dash, legend=None)
    lines = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(strokeDash=dash)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=45, opacity=1, stroke=style.page, strokeWidth=0.5)
    return [lines, marks, names(drawn)]


def share_of_peak(rows: list[dict], style: Style, choices: dict[str, str]):
    """Rates over the peak's, against N; a row has n, name, share and tooltip texts."""
    mark_last(mark_first(rows, "view"), "share", "n")
    top = max(1, *(row["share"] for row in rows))
    y = alt.Y(
        "share:Q",
        axis=alt.Axis(title="share of the measured peak", format="%"),
        scale=alt.Scale(domain=[0, top], nice=False),
    )
    drawn = filtered(choices).encode(
        x=_size_axis(rows), y=y, detail=alt.Detail("name:N"), **series(style, PEAK_TOOLTIPS)
    )
    peak = alt.Chart(alt.InlineData(values=[{"peak": 1}])).encode(y=alt.Y("peak:Q"))
    ceiling = [
        peak.mark_rule(color="currentColor", opacity=0.6),
        peak.mark_text(text="peak of fused multiply-adds", align="left", dy=9).encode(
            x=alt.XValue(4)
        ),
    ]
    return alt.layer(*ceiling, *curves(drawn, style), **frame(rows))


def condition(rows: list[dict]):
    """Condition numbers against N; a row has n, number (its name), value and tooltip texts."""
    chart = alt.Chart().encode(
        x=_size_axis(rows),
        y=alt.Y(
            "value:Q",
            axis=log_axis("y", "condition number", NUMBER),
            scale=alt.Scale(type="log", nice=False, padding=12),
        ),
        detail=alt.Detail("number:N"),
    )
    tooltip = [alt.Tooltip(f"{name}:N", title=title) for name, title in CONDITION_TOOLTIPS.items()]
    last = max(row["n"] for row in rows)
    ends = sorted((row for row in rows if row["n"] == last), key=lambda row: -row["value"])
    layers = [
        chart.mark_line(color="currentColor", strokeWidth=1.25, opacity=0.7),
        chart.mark_point(color="currentColor", filled=True, size=45, opacity=1).encode(
            tooltip=tooltip
        ),
    ]
    for end, (left, down) in zip(
        ends, [(-10, -4), (4, 32), (4, 46)]
    ):  # the upper name above its line, others below
        name = chart.transform_filter(f"datum.n == {last} && datum.number == '{end['number']}'")
        layers.append(name.mark_text(align="right", dx=left, dy=down).encode(text=alt.Text("number:N")))
    return alt.layer(*layers, **frame(rows))
