"""The charts of what a search has found: the worst so far against what was spent, and the
mechanisms, drawn as trees."""

import math

import altair as alt

from charts.common import (
    NUMBER,
    Style,
    error_scale,
    filtered,
    frame,
    log_axis,
    mark_last,
    names,
    short,
)
from charts.variants import series

METHOD_DASH = alt.Scale(domain=["search", "islands", "random"], range=[[1, 0], [6, 3], [2, 4]])
JOINT_SHAPE = alt.Scale(
    domain=["hinge", "slide", "ball", "free"],
    range=["circle", "square", "diamond", "triangle-up"],
)
JOINT_LEGEND = {
    "orient": "top",
    "title": None,
    "symbolFillColor": "currentColor",
    "symbolStrokeColor": "currentColor",
}
MASSES = (1e-8, 1e8)  # kg, drawn smallest and largest
LANE = 44  # height of a row of bodies
LABELLED = 380  # width from which there is room for numbers
TOOLTIPS = {
    "variant": "variant",
    "precision": "precision",
    "scene": "by",
    "evaluations": "mechanisms judged",
    "error_text": "worst silent error",
}

BODY_TOOLTIPS = {
    "variant": "worst found for",
    "precision": "precision",
    "name": "body",
    "on": "on",
    "joint": "joint",
    "mass_text": "mass",
    "length_text": "from the parent's joint",
    "armature_text": "armature",
}


def worst_so_far(rows: list[dict], style: Style, choices: dict[str, str]):
    """A staircase each variant and method; a row has evaluations, error and their texts."""
    rows = [row | {"error": short(row["error"])} for row in rows]
    mark_last([row for row in rows if row["scene"] != "random"], "error", "evaluations")
    x = alt.X(
        "evaluations:Q",
        axis=log_axis("x", "mechanisms judged", NUMBER),
        scale=alt.Scale(type="log", nice=False, padding=12),
    )
    y = alt.Y("error:Q", axis=log_axis("y", "worst so far", NUMBER), scale=error_scale(rows))
    drawn = filtered(choices).encode(x=x, y=y, **series(style, TOOLTIPS))
    dash = alt.StrokeDash("scene:N", scale=METHOD_DASH, legend=None)
    lines = drawn.mark_line(strokeWidth=1.5, opacity=0.8, interpolate="step-after")
    lines = lines.encode(strokeDash=dash)
    lines.encoding.shape = alt.Undefined  # Vega-Lite would draw the marks a second time
    marks = drawn.mark_point(filled=True, size=20, opacity=1)
    return alt.layer(lines, marks, names(drawn), **frame(rows))


def places(parents: list[int]) -> list[tuple[int, int]]:
    """Of each body how many stand between it and the ground, itself included, and its lane.

    Parents come first and are counted from 1, 0 is the ground. A body's first child goes on in its
    lane, each other one begins a new lane: lines never cross a body.
    """
    depth, lane = [0], [0]
    begun = [False]
    for parent in parents:
        depth.append(depth[parent] + 1)
        lane.append(max(lane) + 1 if begun[parent] else lane[parent])
        begun[parent] = True
        begun.append(False)
    return list(zip(depth, lane, strict=True))[1:]


def _number(value: float) -> str:
    """Two digits."""
    rounded = f"{value:.1e}"
    return f"{float(rounded):g}".replace("e-0", "e-").replace("e+0", "e")


def body_rows(mechanism: dict, bodies, top: int) -> list[dict]:
    """A row each body, with what `mechanism` says of them all; lanes are counted from top."""
    at = [(0, 0), *places([body.parent for body in bodies])]
    smallest, largest = map(math.log10, MASSES)
    rows = []
    for number, body in enumerate(bodies, 1):
        (x, lane), (from_x, from_lane) = at[number], at[body.parent]
        size = math.log10(min(max(body.mass, MASSES[0]), MASSES[1]))
        rows.append(
            mechanism
            | {
                "name": str(number),
                "on": f"body {body.parent}" if body.parent else "the ground",
                "joint": body.joint,
                "x": x,
                "y": top + lane,
                "from_x": from_x,
                "from_y": top + from_lane,
                "size": 20 + 380 * (size - smallest) / (largest - smallest),
                "mass_text": f"{_number(body.mass)} kg",
                "length_text": f"{_number(body.length)} m",
                "armature_text": _number(body.armature),
                "label": f"{_number(body.length)} m" if body.length else "",
            }
        )
    rows[0]["title"] = mechanism["variant"]
    return rows


def mechanisms(rows: list[dict], style: Style, choices: dict[str, str]):
    """Of each variant the tree of its worst mechanism: joints by shape, masses by size, lengths
    in words, since they span decades."""
    lanes = max(row["y"] for row in rows) + 1
    x = alt.Scale(domain=[0, max(row["x"] for row in rows) + 0.5], nice=False, zero=False)
    y = alt.Scale(domain=[lanes - 0.4, -0.7], nice=False, zero=False)
    none = {"axis": None, "title": None}
    here = {"x": alt.X("x:Q", scale=x, **none), "y": alt.Y("y:Q", scale=y, **none)}
    there = {"x": alt.X("from_x:Q", scale=x, **none), "y": alt.Y("from_y:Q", scale=y, **none)}
    tooltip = [alt.Tooltip(f"{name}:N", title=title) for name, title in BODY_TOOLTIPS.items()]
    drawn = filtered(choices)
    lines = drawn.mark_rule(strokeWidth=1.5, opacity=0.6, color="currentColor").encode(
        **there, x2=alt.X2("x"), y2=alt.Y2("y")
    )
    joints = drawn.mark_point(filled=True, opacity=1).encode(
        **here,
        size=alt.Size("size:Q", scale=None, legend=None),
        shape=alt.Shape("joint:N", scale=JOINT_SHAPE, legend=alt.Legend(**JOINT_LEGEND)),
        color=alt.Color("variant:N", scale=style.colour, legend=style.legend, title=None),
        tooltip=tooltip,
    )
    room = alt.expr(f"width > {LABELLED} ? 1 : 0")
    masses = drawn.mark_text(dy=19, fontSize=9, opacity=room).encode(**here, text=alt.Text("mass_text:N"))
    middle = drawn.transform_calculate(
        x="(datum.x + datum.from_x) / 2", y="(datum.y + datum.from_y) / 2"
    )
    lengths = middle.mark_text(dy=-6, fontSize=9, opacity=room).encode(**here, text=alt.Text("label:N"))
    first = drawn.transform_filter("isValid(datum.title)")
    titles = first.mark_text(align="left", dy=-22, fontSize=11).encode(
        x=alt.XValue(0), y=there["y"], text=alt.Text("title:N")
    )
    chart = alt.layer(lines, joints, masses, lengths, titles, **frame(rows))
    return chart.properties(height=LANE * (lanes + 0.3))
