"""The chart of questions: bars before and after, with the rules between."""

import altair as alt

from charts.common import frame, looks
from charts.rows import titled, tooltip

LINE = 17  # height of a bar or of a line of words
LABELS = 0.4  # room for the times beside the bars, by the longest bar

TOOLTIPS = titled(
    "question scene how time_text variation factor dofs flops",
    factor="against the whole",
    dofs="degrees of freedom solved",
    flops="operations",
)


def before_and_after(blocks: list[tuple[str, list[str], list[dict]]]):
    """A block a question: its heading, lines below that, and bars.

    A bar has how, share (its time over that of the whole) and tooltip texts.
    """
    rows, lines = [], []

    def line(label: str, row: dict) -> None:
        lines.append(f"{len(lines):03}|{label}")  # sorted by the number, labelled by the rest
        rows.append({"line": lines[-1], **row})

    for heading, remarks, bars in blocks:
        if rows:
            line("", {})
        line("", {"heading": heading})
        for remark in remarks:
            line("", {"remark": remark})
        for bar in bars:
            line(bar["how"], bar)
    longest = max(row.get("share", 0) for row in rows)
    axis = {"labelExpr": "split(datum.label, '|')[1]", "ticks": False, "domain": False}
    spaced = alt.Scale(domain=lines, paddingInner=0.12, paddingOuter=0.12)
    y = alt.Y("line:O", title=None, axis=alt.Axis(labelOverlap=False, **axis), scale=spaced)
    quarters = [0, 0.25, 0.5, 0.75, 1]
    title = {"title": "time over that of the whole", "titleAnchor": "start"}
    x = alt.X(
        "share:Q",
        axis=alt.Axis(**title, format="%", values=quarters),
        scale=alt.Scale(domain=[0, longest * (1 + LABELS)], nice=False),
    )
    bars = alt.Chart().transform_filter("isValid(datum.share)").encode(x=x, y=y)
    inks = {"whole": "var(--other)", "pruned": "var(--good)", "alone": "var(--other)"}
    colour = looks(alt.Color, "how", inks, inks.values())
    words = {"align": "left", "baseline": "middle"}

    def text(field: str, **look):
        own = alt.Chart().transform_filter(f"isValid(datum.{field})").mark_text(**words, **look)
        return own.encode(x=alt.XValue(0), y=y, text=f"{field}:N")

    return alt.layer(
        bars.mark_bar(cornerRadius=1).encode(color=colour, tooltip=tooltip(TOOLTIPS)),
        bars.mark_text(**words, dx=5).encode(text="time_text:N"),
        text("heading", fontWeight=600),
        text("remark", opacity=0.8),
        **frame(rows) | {"height": LINE * len(lines)},
    )
