"""The charts, as Altair specifications for the page and for a file."""

import re

import altair as alt

import palette
from summary import Point
from text import error_text, share_text, time_text

HEIGHT = 280
BAND = 24  # height of the strips beyond the scale: failed above, error exactly zero below

# Parameters of the charts that the page's legends and choices set.
HIDDEN = "hidden"  # variants and precisions that are switched off
VIEW = "view"  # what is drawn: task/measure
SCENE = "scene"

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

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'DejaVu Sans', sans-serif"
THEME = {
    "font": FONT,
    "background": None,
    "view": {"stroke": None},
    "text": {"fontSize": 11, "color": "currentColor"},
    "axis": {
        "labelColor": "currentColor",
        "labelFontSize": 11,
        "titleColor": "currentColor",
        "titleFontSize": 12,
        "titleFontWeight": "normal",
        "gridColor": "currentColor",
        "gridOpacity": 0.13,
        "domainColor": "currentColor",
        "domainOpacity": 0.4,
        "tickColor": "currentColor",
        "tickOpacity": 0.4,
    },
    "legend": {"labelColor": "currentColor", "labelFontSize": 11, "labelLimit": 0},
    "title": {"color": "currentColor", "fontSize": 13, "fontWeight": "normal"},
}

CONDITION_TOOLTIPS = {
    "scene": "scene",
    "number": "number",
    "median": "median",
    "largest": "largest",
    "states": "states",
    "failed": "failed",
}

# Which ticks of a log axis count, by their leading digit: fewer, the more the axis spans.
_SPAN = "domain('{0}')[1] / domain('{0}')[0]"
_COUNTS = (
    "indexof({0} < 1.5 ? '123456789' : {0} < 4 ? '123457' : {0} > 1e3 ? '1' : '125',"
    " slice(format(datum.value, 'e'), 0, 1)) >= 0"
)
_TIME = (
    "datum.value < 1e3 ? format(datum.value, '~r') + ' ns'"
    " : datum.value < 1e6 ? format(datum.value / 1e3, '~r') + ' µs'"
    " : datum.value < 1e9 ? format(datum.value / 1e6, '~r') + ' ms'"
    " : format(datum.value / 1e9, '~r') + ' s'"
)
_NUMBER = "replace(format(datum.value, '~e'), '+', '')"


class Style:
    """Colours named in the page's style sheet, or, for a file, as they are on a light page."""

    def __init__(self, variants, precisions, for_file: bool = False):
        pairs = palette.colours(variants)
        shapes = palette.shapes(precisions)
        colours = [
            light if for_file else css_colour(variant) for variant, (light, _) in pairs.items()
        ]
        self.colour = alt.Scale(domain=list(pairs), range=colours)
        self.shape = alt.Scale(domain=list(shapes), range=list(shapes.values()))
        self.dash = alt.Scale(domain=list(shapes), range=[[1, 0], [5, 3], [1, 2], [8, 2, 1, 2]])
        self.variants = list(pairs)
        self.precisions = list(shapes)
        self.page = "white" if for_file else "var(--page)"
        self.legend = alt.Undefined if for_file else None


def css_name(variant: str) -> str:
    return "--variant-" + re.sub(r"[^A-Za-z0-9]+", "-", variant).strip("-").lower()


def css_colour(variant: str) -> str:
    return f"var({css_name(variant)})"


def view(task: str, measure: str) -> str:
    return f"{task}/{measure}"


def _values(points: list[Point]) -> list[dict]:
    """Rows for Vega: numbers that place a mark, texts that its tooltip shows."""
    return [
        {
            "scene": point.scene,
            "n": point.n,
            "variant": point.variant,
            "precision": point.precision,
            "view": view(point.task, point.measure),
            "time": point.time,
            "error": point.median,
            "share": point.failures / point.states if point.states else 0,
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


def _chart(choices: dict[str, str] | None):
    """The rows that legend and choices leave.

    `choices` gives each parameter's first value; None means a picture without parameters.
    """
    chart = alt.Chart()
    if choices is None:
        return chart
    chart = chart.add_params(alt.param(name=HIDDEN, value=[]))
    chart = chart.transform_filter(
        f"indexof({HIDDEN}, datum.variant) < 0 && indexof({HIDDEN}, datum.precision) < 0"
    )
    for name, first in choices.items():
        chart = chart.add_params(alt.param(name=name, value=first)).transform_filter(
            f"datum.{name} == {name}"
        )
    return chart


def _frame(values: list[dict]) -> dict:
    """What the layers of a chart share."""
    return {"data": alt.InlineData(values=values), "height": HEIGHT, "width": "container"}


def _log_axis(scale: str, title: str, label: str) -> alt.Axis:
    counts = _COUNTS.format(_SPAN.format(scale))
    opacity = alt.condition(counts, alt.value(1), alt.value(0))
    return alt.Axis(
        title=title,
        labelExpr=f"{counts} ? {label} : ''",
        labelOverlap="greedy",
        gridOpacity=opacity,
        tickOpacity=opacity,
    )


def _size_axis(values: list[dict]) -> alt.X:
    sizes = sorted({row["n"] for row in values})
    axis = alt.Axis(title="N, degrees of freedom", values=sizes, format="d", labelOverlap="greedy")
    return alt.X("n:Q", axis=axis, scale=alt.Scale(type="log", nice=False, padding=8))


def _error_scale(values: list[dict]) -> alt.Scale:
    """A log scale that leaves room for what it cannot show: failures above, exact results below."""
    top = BAND if any(row["share"] for row in values) else 0
    bottom = HEIGHT - (BAND if any(row["error"] == 0 for row in values) else 0)
    return alt.Scale(type="log", nice=False, padding=8, range=[bottom, top])


def _series(style: Style) -> dict:
    """The encoding that all marks of a variant and precision share."""
    return {
        "color": alt.Color("variant:N", scale=style.colour, legend=style.legend, title=None),
        "shape": alt.Shape("precision:N", scale=style.shape, legend=style.legend, title=None),
        "tooltip": [alt.Tooltip(f"{name}:N", title=title) for name, title in TOOLTIPS.items()],
    }


def _bands(chart, values: list[dict], x, style: Style) -> list:
    """What the scale cannot show: crosses for failures above it, marks for errors of zero below."""
    layers = []
    series = {"x": x, **_series(style)}
    if any(row["share"] for row in values):
        series_without_shape = {
            name: channel for name, channel in series.items() if name != "shape"
        }
        failures = chart.transform_filter("datum.share > 0").encode(
            **series_without_shape, y=alt.value(BAND / 2)
        )
        layers += [
            *_strip(0, "failed"),
            failures.mark_point(shape="cross", angle=45, filled=True, size=110, opacity=1),
        ]
        if x.shorthand.startswith("time"):
            shares = failures.encode(text="share_text:N").mark_text(align="left", dx=8)
            layers.append(shares)
    if any(row["error"] == 0 for row in values):
        exact = chart.transform_filter("datum.error === 0").encode(
            **series, y=alt.value(HEIGHT - BAND / 2)
        )
        layers += [*_strip(HEIGHT - BAND, "0"), exact.mark_point(filled=True, size=80, opacity=1)]
    return layers


def _strip(top: float, label: str) -> list:
    one = alt.Chart(alt.InlineData(values=[{}]))
    return [
        one.mark_rect(color="currentColor", opacity=0.06).encode(
            x=alt.value(0), x2=alt.value("width"), y=alt.value(top), y2=alt.value(top + BAND)
        ),
        one.mark_text(text=label, align="right", dx=-7).encode(
            x=alt.value(0), y=alt.value(top + BAND / 2)
        ),
    ]


def _front(chart, x, y) -> list:
    """The Pareto front of what is shown, among series without a failure.

    In order of time a point is on the front if its error is below every error before it. The line
    goes on to the right of its last point, as nothing slower does better.
    """
    order = [alt.SortField("time"), alt.SortField("error")]
    front = (
        chart.transform_filter("isValid(datum.error) && datum.share === 0")
        .transform_window(best="min(error)", sort=order, frame=[None, 0], ignorePeers=True)
        .transform_window(best_before="lag(best)", sort=order)
        .transform_filter("datum.best_before === null || datum.error < datum.best_before")
        .transform_joinaggregate(lowest="min(error)")
        .transform_filter("datum.error > 0")
        .encode(x=x, y=y)
    )
    look = {"color": "currentColor", "opacity": 0.5, "strokeWidth": 1.5}
    last = front.transform_filter("datum.error === datum.lowest").encode(x2=alt.value("width"))
    return [front.mark_line(interpolate="step-after", **look), last.mark_rule(**look)]


def work_precision(
    points: list[Point], style: Style, choices: dict[str, str] | None = None, scales: str = ""
):
    """One mark a variant and precision; `scales` begins Vega's names of the chart's scales."""
    values = [row for row in _values(points) if row["time"] is not None]
    x = alt.X(
        "time:Q",
        axis=_log_axis(f"{scales}x", "median time of a call", _TIME),
        scale=alt.Scale(type="log", nice=False, padding=14),
    )
    y = alt.Y(
        "error:Q", axis=_log_axis(f"{scales}y", "median error", _NUMBER), scale=_error_scale(values)
    )
    chart = _chart(choices)
    drawn = chart.transform_filter("datum.error > 0")
    marks = drawn.mark_point(filled=True, size=80, opacity=1, stroke=style.page, strokeWidth=0.75)
    return alt.layer(
        *_front(chart, x, y),
        *_bands(chart, values, x, style),
        marks.encode(x=x, y=y, **_series(style)),
        **_frame(values),
    )


def against_size(points: list[Point], style: Style, choices: dict[str, str], what: str):
    """Error or time against N; `what` is the row's field."""
    values = [row for row in _values(points) if row[what] is not None or row["share"]]
    x = _size_axis(values)
    chart = _chart(choices)
    if what == "error":
        y = alt.Y(
            "error:Q", axis=_log_axis("y", "median error", _NUMBER), scale=_error_scale(values)
        )
        bands = _bands(chart, values, x, style)
    else:
        scale = alt.Scale(type="log", nice=False, padding=8)
        y = alt.Y("time:Q", axis=_log_axis("y", "median time of a call", _TIME), scale=scale)
        bands = []
    drawn = chart.transform_filter(f"datum.{what} > 0").encode(x=x, y=y, **_series(style))
    dash = alt.StrokeDash("precision:N", scale=style.dash, legend=None)
    lines = drawn.mark_line(strokeWidth=1.25, opacity=0.7).encode(
        strokeDash=dash, shape=alt.Undefined
    )
    marks = drawn.mark_point(filled=True, size=45, opacity=1, stroke=style.page, strokeWidth=0.5)
    return alt.layer(*bands, lines, marks, **_frame(values))


def condition(rows: list[dict]):
    """Condition numbers against N; a row has n, number (its name), value and tooltip texts."""
    chart = alt.Chart().encode(
        x=_size_axis(rows),
        y=alt.Y(
            "value:Q",
            axis=_log_axis("y", "condition number", _NUMBER),
            scale=alt.Scale(type="log", nice=False, padding=12),
        ),
        detail="number:N",
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
        layers.append(name.mark_text(align="right", dx=left, dy=down).encode(text="number:N"))
    return alt.layer(*layers, **_frame(rows))
