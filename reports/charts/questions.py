"""The chart of questions: bars before and after, with the rules between."""

import altair as alt

from charts.common import frame

LINE = 17  # height of a bar or of a line of words
LABELS = 0.4  # room for the times beside the bars, by the longest bar

TOOLTIPS = {
    "question": "question",
    "scene": "scene",
    "how": "how",
    "time_text": "median time",
    "variation": "variation of time",
    "factor": "against the whole",
    "dofs": "degrees of freedom solved",
    "flops": "operations",
}


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
    chart = alt.Chart().encode(
        y=alt.Y(
            "line:O",
            title=None,
            axis=alt.Axis(
                labelExpr="split(datum.label, '|')[1]",
                labelOverlap=False,
                ticks=False,
                domain=False,
            ),
            scale=alt.Scale(domain=lines, paddingInner=0.12, paddingOuter=0.12),
        )
    )
    x = alt.X(
        "share:Q",
        axis=alt.Axis(
            title="time over that of the whole",
            titleAnchor="start",
            format="%",
            values=[0, 0.25, 0.5, 0.75, 1],
        ),
        scale=alt.Scale(domain=[0, longest * (1 + LABELS)], nice=False),
    )
    colour = alt.Color(
        "how:N",
        scale=alt.Scale(
            domain=["whole", "pruned", "alone"],
            range=["var(--other)", "var(--good)", "var(--other)"],
        ),
        legend=None,
    )
    tooltip = [alt.Tooltip(f"{name}:N", title=title) for name, title in TOOLTIPS.items()]
    bars = chart.transform_filter("isValid(datum.share)").encode(x=x)
    words = {"align": "left", "baseline": "middle"}
    return alt.layer(
        bars.mark_bar(cornerRadius=1).encode(color=colour, tooltip=tooltip),
        bars.mark_text(**words, dx=5).encode(text=alt.Text("time_text:N")),
        chart.transform_filter("isValid(datum.heading)")
        .mark_text(**words, fontWeight=600)
        .encode(x=alt.XValue(0), text=alt.Text("heading:N")),
        chart.transform_filter("isValid(datum.remark)")
        .mark_text(**words, opacity=0.8)
        .encode(x=alt.XValue(0), text=alt.Text("remark:N")),
        **frame(rows) | {"height": LINE * len(lines)},
    )
