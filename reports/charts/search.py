"""The charts of what a search has found: the worst so far against what was spent, and the
mechanisms, drawn as trees."""

import math

import altair as alt

from charts.common import Style, dots, error_scale, filtered, frame, looks, mark_last, short
from charts.layers import INK, log
from charts.rows import titled, tooltip
from charts.variants import lines

METHODS = {"search": [1, 0], "islands": [6, 3], "random": [2, 4]}  # and their dashes
JOINTS = {"hinge": "circle", "slide": "square", "ball": "diamond", "free": "triangle-up"}
MASSES = (1e-8, 1e8)  # kg, drawn smallest and largest
LANE = 44  # height of a row of bodies
LABELLED = 380  # width from which there is room for numbers
TOOLTIPS = titled(
    "variant precision scene evaluations error_text",
    scene="by",
    evaluations="mechanisms judged",
    error_text="worst silent error",
)

BODY_TOOLTIPS = titled(
    "variant precision name on joint mass_text length_text armature_text",
    variant="worst found for",
    name="body",
    length_text="from the parent's joint",
)


def worst_so_far(rows: list[dict], style: Style, choices: dict[str, str]):
    """A staircase each variant and method; a row has evaluations, error and their texts."""
    rows = [row | {"error": short(row["error"])} for row in rows]
    mark_last([row for row in rows if row["scene"] != "random"], "error", "evaluations")
    x = log(alt.X, "evaluations", "mechanisms judged", 12)
    y = log(alt.Y, "error", "worst so far", error_scale(rows))
    path = {"strokeDash": looks(alt.StrokeDash, "scene", METHODS, METHODS.values())}
    look = {"strokeWidth": 1.5, "opacity": 0.8, "interpolate": "step-after"}
    return lines(rows, style, choices, TOOLTIPS, x, y, marks=dots(20), path=path, **look)


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
    right = max(row["x"] for row in rows) + 0.5
    x = {"scale": alt.Scale(domain=[0, right], nice=False, zero=False)}
    y = {"scale": alt.Scale(domain=[lanes - 0.4, -0.7], nice=False, zero=False)}
    none = {"axis": None, "title": None}
    here = {"x": alt.X("x:Q", **x, **none), "y": alt.Y("y:Q", **y, **none)}
    there = {"x": alt.X("from_x:Q", **x, **none), "y": alt.Y("from_y:Q", **y, **none)}
    drawn = filtered(choices)
    links = drawn.mark_rule(strokeWidth=1.5, opacity=0.6, **INK).encode(**there, x2="x", y2="y")
    inks = {"symbolFillColor": "currentColor", "symbolStrokeColor": "currentColor"}
    legend = alt.Legend(orient="top", title=None, **inks)
    joints = drawn.mark_point(filled=True, opacity=1).encode(
        **here,
        size=alt.Size("size:Q", scale=None, legend=None),
        shape=looks(alt.Shape, "joint", JOINTS, JOINTS.values(), legend=legend),
        color=style.colour,
        tooltip=tooltip(BODY_TOOLTIPS),
    )
    small = {"fontSize": 9, "opacity": alt.expr(f"width > {LABELLED} ? 1 : 0")}
    masses = drawn.mark_text(dy=19, **small).encode(**here, text="mass_text:N")
    middle = drawn.transform_calculate(
        x="(datum.x + datum.from_x) / 2", y="(datum.y + datum.from_y) / 2"
    )
    lengths = middle.mark_text(dy=-6, **small).encode(**here, text="label:N")
    first = drawn.transform_filter("isValid(datum.title)")
    titles = first.mark_text(align="left", dy=-22, fontSize=11).encode(
        x=alt.XValue(0), y=there["y"], text="title:N"
    )
    chart = alt.layer(links, joints, masses, lengths, titles, **frame(rows))
    return chart.properties(height=LANE * (lanes + 0.3))
