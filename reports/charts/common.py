"""What all charts share: theme, colours, parameters, frames and scales."""

import re
from itertools import cycle

import altair as alt

from charts import palette
from summary.groups import by_key

# That charts are valid is tested once (test_figures.py), not each time that a part of one is made.
alt.utils.schemapi.disable_debug_mode()

HEIGHT = 280
BAND = 24  # height of the strips beyond the scale: failed above, error exactly zero below

# Parameters of the charts that the page's legends and choices set.
HIDDEN = "hidden"  # variants and precisions that are switched off
VIEW = "view"  # what is drawn: task/measure
SCENE = "scene"
TOLERANCE = "tolerance"  # error asked for
EVERY = "every"  # whether series are drawn that are not shown at first
QUANTITY = "quantity"

NAMED = "named"  # style of marks beside which the page writes their series' name

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

DASHES = ([1, 0], [5, 3], [1, 2], [8, 2, 1, 2])

# Which ticks of a log axis count, by their leading digit: fewer, the more the axis spans.
_SPAN = "domain('{0}')[1] / domain('{0}')[0]"
_COUNTS = (
    "indexof({0} < 1.5 ? '123456789' : {0} < 4 ? '123457' : {0} > 1e3 ? '1' : '125',"
    " slice(format(datum.value, 'e'), 0, 1)) >= 0"
)
TIME = (
    "datum.value < 1e3 ? format(datum.value, '~r') + ' ns'"
    " : datum.value < 1e6 ? format(datum.value / 1e3, '~r') + ' µs'"
    " : datum.value < 1e9 ? format(datum.value / 1e6, '~r') + ' ms'"
    " : format(datum.value / 1e9, '~r') + ' s'"
)
PLAIN = "format(datum.value, '~r')"
NUMBER = "replace(format(datum.value, '~e'), '+', '')"


class Style:
    """Colours named in the page's style sheet, or, for a file, as they are on a light page."""

    def __init__(self, variants, precisions, for_file: bool = False):
        pairs = palette.colours(variants)
        shapes = palette.shapes(precisions)
        colours = [
            light if for_file else css_colour(variant) for variant, (light, _) in pairs.items()
        ]
        self.variants = list(pairs)
        self.precisions = list(shapes)
        self.page = "white" if for_file else "var(--page)"
        look = {"legend": alt.Undefined if for_file else None, "title": None}
        self.colour = looks(alt.Color, "variant", pairs, colours, **look)
        self.shape = looks(alt.Shape, "precision", shapes, shapes.values(), **look)
        self.dash = looks(alt.StrokeDash, "precision", shapes, DASHES)
        self.variant_shape = looks(alt.Shape, "variant", pairs, map(palette.shape, pairs))

    def dots(self, size: float = 45, width: float = 0.5) -> dict:
        """Filled marks that stand out from what is below them."""
        return dots(size) | {"stroke": self.page, "strokeWidth": width}


def dots(size: float) -> dict:
    return {"filled": True, "size": size, "opacity": 1}


def looks(channel, field: str, names, range_, **more):
    """What each name of a field looks like; of more names than looks the last ones look like the
    first. A channel has no legend unless told."""
    scale = alt.Scale(domain=list(names), range=[look for look, _ in zip(cycle(range_), names)])
    return channel(f"{field}:N", scale=scale, **{"legend": None} | more)


def css_name(variant: str) -> str:
    return "--variant-" + re.sub(r"[^A-Za-z0-9]+", "-", variant).strip("-").lower()


def css_colour(variant: str) -> str:
    return f"var({css_name(variant)})"


def view(task: str, measure: str) -> str:
    return f"{task}/{measure}"


def filtered(choices: dict[str, str] | None):
    """The rows that legend and choices leave; a row with `more` is not shown at first.

    `choices` gives each parameter's first value; None means a picture without parameters.
    """
    chart = alt.Chart()
    if choices is None:
        return chart
    chart = chart.add_params(
        alt.param(name=HIDDEN, value=[]), alt.param(name=EVERY, value=False)
    ).transform_filter(
        f"({EVERY} || !datum.more)"
        f" && indexof({HIDDEN}, datum.variant) < 0 && indexof({HIDDEN}, datum.precision) < 0"
    )
    for name, first in choices.items():
        chart = chart.add_params(alt.param(name=name, value=first)).transform_filter(
            f"datum.{name} == {name}"
        )
    return chart


LINES = ("view", "name", QUANTITY)  # fields that set the lines of a variant apart


def mark_last(rows: list[dict], y: str, x: str, apart: tuple[str, ...] = LINES) -> list[dict]:
    """The last row of each line says so: the page writes the line's name there."""
    drawn = [row for row in rows if row[y]]
    fields = ("variant", "precision", *apart)
    for line in by_key(drawn, lambda row: tuple(map(row.get, fields))).values():
        max(reversed(line), key=lambda row: row[x])["last"] = 1
    return rows


def frame(values: list[dict]) -> dict:
    """What the layers of a chart share."""
    return {"data": alt.InlineData(values=values), "height": HEIGHT, "width": "container"}


def short(value: float | None) -> float | None:
    """As many digits as a mark needs, for the page's weight."""
    return None if value is None else float(f"{value:.4g}")


def log_axis(scale: str, title: str, label: str) -> alt.Axis:
    counts = _COUNTS.format(_SPAN.format(scale))
    opacity = alt.condition(counts, alt.value(1), alt.value(0))
    return alt.Axis(
        title=title,
        labelExpr=f"{counts} ? {label} : ''",
        labelOverlap="greedy",
        labelSeparation=4,
        gridOpacity=opacity,
        tickOpacity=opacity,
    )


def error_scale(values: list[dict], floor: float = 0) -> alt.Scale:
    """A log scale that leaves room for failures above it and for errors up to floor below it."""
    top = BAND if any(row.get("share") for row in values) else 0
    below = any(row["error"] is not None and row["error"] <= floor for row in values)
    bottom = HEIGHT - (BAND if below else 0)
    return alt.Scale(type="log", nice=False, padding=8, range=[bottom, top])
