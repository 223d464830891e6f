"""The charts of errors, times and condition numbers of variants, for the page and for a file."""

import altair as alt

from charts.common import (
    BAND,
    HEIGHT,
    NAMED,
    Style,
    dots,
    error_scale,
    filtered,
    frame,
    mark_last,
    short,
    view,
)
from charts.groups import mark_first
from charts.layers import INK, log, log_scale, names, one, strip
from charts.rows import fields, numbers, titled, tooltip
from charts.text import error_text, share_text, time_text
from summary.points import Point

TOOLTIPS = titled("scene variant precision time_text variation error_text worst states failures")
CONDITION_TOOLTIPS = titled("scene number median largest states failed")
PEAK_TOOLTIPS = titled(
    "scene variant precision rate peak share_text flops time_text",
    share_text="share of the peak",
    time_text="median time of a state",
)


def point_rows(points: list[Point]) -> list[dict]:
    """Rows for Vega: numbers that place a mark, texts that its tooltip shows."""
    return [
        fields(point, "scene", "n", "variant", "precision", "states")
        | numbers(time_text, time=point.time)
        | numbers(error_text, error=point.median)
        | {
            "view": view(point.task, point.measure),
            "share": short(point.failures / point.states) if point.states else 0,
            "share_text": share_text(point.failures / point.states) if point.states else "",
            "variation": share_text(point.variation),
            "worst": error_text(point.worst),
            "failures": f"{point.failures} ({point.reasons})" if point.failures else "0",
        }
        for point in points
    ]


def _size_axis(values: list[dict]) -> alt.X:
    sizes = sorted({row["n"] for row in values})
    axis = alt.Axis(title="N, degrees of freedom", values=sizes, format="d", labelOverlap="greedy")
    return alt.X("n:Q", axis=axis, scale=log_scale(8))


def coloured(style: Style, tooltips: dict[str, str]) -> dict:
    """The encoding that all marks of a variant share."""
    return {"color": style.colour, "tooltip": tooltip(tooltips)}


def series(style: Style, tooltips: dict[str, str] = TOOLTIPS) -> dict:
    """The same of a variant and precision."""
    return coloured(style, tooltips) | {"shape": style.shape}


def bands(chart, values: list[dict], x, encoding: dict) -> list:
    """What the scale cannot show: crosses for failures above it, marks for errors of zero below."""
    layers = []
    chart = chart.encode(x=x)
    if any(row.get("share") for row in values):
        layers += failures(chart, "failed", encoding)
        if x.shorthand.startswith("time"):
            layers.append(layers[-1].mark_text(align="left", dx=8).encode(text="share_text:N"))
    if any(row["error"] == 0 for row in values):
        exact = chart.transform_filter("datum.error === 0").encode(
            **encoding, y=alt.YValue(HEIGHT - BAND / 2)
        )
        layers += [*strip(HEIGHT - BAND, "0"), exact.mark_point(**dots(80))]
    return layers


def failures(chart, label: str, encoding: dict, size: float = 110) -> list:
    """A strip above the scale with a cross for each row that has a share of failures."""
    failed = chart.transform_filter("datum.share > 0").encode(
        y=alt.YValue(BAND / 2), color=encoding["color"], tooltip=encoding["tooltip"]
    )
    return [*strip(0, label), failed.mark_point(shape="cross", angle=45, **dots(size))]


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
    look = INK | {"opacity": 0.5, "strokeWidth": 1.5}
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
    x = log(alt.X, "time", "median time of a call", 14, prefix=scales)
    y = log(alt.Y, "error", "median error", error_scale(values), prefix=scales)
    chart = filtered(choices)
    marks = chart.transform_filter("datum.error > 0").encode(x=x, y=y, **series(style))
    return alt.layer(
        *front(chart, x, y),
        *bands(chart, values, x, series(style)),
        marks.mark_point(style=NAMED, **style.dots(80, 0.75)),
        **frame(values),
    )


def against_size(points: list[Point], style: Style, choices: dict[str, str], what: str):
    """Error or time against N; `what` is the row's field."""
    values = [row for row in point_rows(points) if row[what] is not None or row["share"]]
    mark_last(mark_first(values, "view"), what, "n")
    x = _size_axis(values)
    if what == "error":
        y = log(alt.Y, "error", "median error", error_scale(values))
        beyond = bands(filtered(choices), values, x, series(style))
    else:
        y = log(alt.Y, "time", "median time of a call", 8)
        beyond = []
    return lines(values, style, choices, TOOLTIPS, x, y, *beyond)


def curves(drawn, style: Style, marks=None, shape=None, path: dict | None = None, **line) -> list:
    """A thin line through the marks of each variant and precision, with its name.

    `path` is what lines are encoded by, else by the dash of the precision; `shape` that of marks,
    where it is not yet encoded.
    """
    line = {"strokeWidth": 1.25, "opacity": 0.7} | line
    lines = drawn.mark_line(**line).encode(**{"strokeDash": style.dash} if path is None else path)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    dots = drawn.mark_point(**marks or style.dots())
    return [lines, dots.encode(shape=shape) if shape else dots, names(drawn)]


def lines(
    rows: list[dict],
    style: Style,
    choices: dict,
    tooltips: dict,
    x,
    y,
    *below,
    shape=None,
    more=(),
    **look,
):
    """A chart of such curves above other layers. Marks have the precision's shape unless told."""
    encoding = coloured(style, tooltips) if shape else series(style, tooltips)
    field = y.shorthand.partition(":")[0]
    drawn = (
        filtered(choices)
        .transform_filter(f"datum.{field} > 0")
        .encode(x=x, y=y, **encoding, **dict(more))
    )
    return alt.layer(*below, *curves(drawn, style, shape=shape, **look), **frame(rows))


def share_of_peak(rows: list[dict], style: Style, choices: dict[str, str]):
    """Rates over the peak's, against N; a row has n, name, share and tooltip texts."""
    mark_last(mark_first(rows, "view"), "share", "n")
    top = max(1, *(row["share"] for row in rows))
    axis = alt.Axis(title="share of the measured peak", format="%")
    y = alt.Y("share:Q", axis=axis, scale=alt.Scale(domain=[0, top], nice=False))
    peak = one(peak=1).encode(y="peak:Q")
    rule = peak.mark_rule(**INK, opacity=0.6)
    name = peak.mark_text(text="peak of fused multiply-adds", align="left", dy=9)
    below = rule, name.encode(x=alt.XValue(4))
    more = {"detail": "name:N"}
    return lines(rows, style, choices, PEAK_TOOLTIPS, _size_axis(rows), y, *below, more=more)


def condition(rows: list[dict]):
    """Condition numbers against N; a row has n, number (its name), value and tooltip texts."""
    y = log(alt.Y, "value", "condition number", 12)
    chart = alt.Chart().encode(x=_size_axis(rows), y=y, detail="number:N")
    last = max(row["n"] for row in rows)
    ends = sorted((row for row in rows if row["n"] == last), key=lambda row: -row["value"])
    layers = [
        chart.mark_line(**INK, strokeWidth=1.25, opacity=0.7),
        chart.mark_point(**INK, **dots(45)).encode(tooltip=tooltip(CONDITION_TOOLTIPS)),
    ]
    # the upper name above its line, others below
    for end, (left, down) in zip(ends, [(-10, -4), (4, 32), (4, 46)]):
        name = chart.transform_filter(f"datum.n == {last} && datum.number == '{end['number']}'")
        layers.append(name.mark_text(align="right", dx=left, dy=down).encode(text="number:N"))
    return alt.layer(*layers, **frame(rows))
