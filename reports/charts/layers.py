"""What layers of charts are made of: log axes, strips beyond them, the names of lines."""

import altair as alt

from charts.common import BAND, NAMED, NUMBER, TIME, log_axis

INK = {"color": "currentColor"}  # of what belongs to no variant


def log_scale(padding: float) -> alt.Scale:
    return alt.Scale(type="log", nice=False, padding=padding)


def log(channel, field: str, title: str, scale: alt.Scale | float, label="", prefix: str = ""):
    """A channel, X or Y, of a log axis. `scale` may be its padding; a time is labelled as such;
    `prefix` begins the name that Vega has for the scale."""
    scale = scale if isinstance(scale, alt.Scale) else log_scale(scale)
    label = label or (TIME if field == "time" else NUMBER)
    axis = log_axis(f"{prefix}{channel.__name__.lower()}", title, label)
    return channel(f"{field}:Q", axis=axis, scale=scale)


def one(**values):
    """A chart of one row."""
    return alt.Chart(alt.InlineData(values=[values]))


def strip(top: float, label: str) -> list:
    left, right = alt.XValue(0), alt.X2Value("width")
    middle, bottom = alt.YValue(top + BAND / 2), alt.Y2Value(top + BAND)
    band = one().mark_rect(**INK, opacity=0.06)
    name = one().mark_text(text=label, align="right", dx=-7)
    return [
        band.encode(x=left, x2=right, y=alt.YValue(top), y2=bottom),
        name.encode(x=left, y=middle),
    ]


def names(drawn):
    """What the page names of lines: the rows with `last`, which others show."""
    ends = drawn.transform_filter("datum.last === 1")
    return ends.mark_point(filled=True, size=40, opacity=0, aria=False, style=NAMED)
