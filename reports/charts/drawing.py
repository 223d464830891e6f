"""Charts as Vega draws them, compiled here so that the page need not, with names on marks."""

import functools
import json

import altair as alt
import vl_convert

from charts.common import NAMED, THEME

VEGA_LITE = ".".join(alt.SCHEMA_VERSION.lstrip("v").split(".")[:2])
SHORT = {"float32": " f32", "float64": " f64"}
ANCHORS = "right top-right bottom-right top-left bottom-left top bottom left".split()
OFFSETS = [5, 14, 24, 36, 50, 66, 84, 104]  # from the mark, tried in turn


def compiled(chart) -> dict:
    """The Vega specification of an Altair chart."""
    spec = vl_convert.vegalite_to_vega(
        chart.to_dict(validate=False), vl_version=VEGA_LITE, config=THEME, show_warnings=False
    )
    _describe(spec["marks"])
    spec["marks"] = [drawn for mark in spec["marks"] for drawn in (mark, *_names(mark))]
    return spec


def _describe(marks: list[dict]) -> None:
    """Vega takes marks of which none has numbers for one picture, which needs a name."""
    for mark in marks:
        mark.setdefault("description", f"{mark['type']} marks")
        _describe(mark.get("marks", []))


def _names(mark: dict) -> list[dict]:
    """Texts beside the marks, as many as have room, by Vega's own placing of labels."""
    if NAMED not in mark.get("style", []):
        return []
    series = f"datum.datum.variant + ({json.dumps(SHORT)}[datum.datum.precision] || '')"
    label = f"datum.datum.label || {series}"
    return [
        {
            "type": "text",
            "from": {"data": mark["name"]},
            "interactive": False,
            "aria": False,
            "encode": {
                "update": {
                    "text": {"signal": label},
                    "fill": {"signal": "datum.fill"},
                    "stroke": {"value": "var(--page)"},  # a halo, painted below the letters
                    "strokeWidth": {"value": 2.5},
                    "fontSize": {"value": 11},
                }
            },
            "transform": [
                {
                    "type": "label",
                    "size": {"signal": "[width, height]"},
                    "anchor": ANCHORS * len(OFFSETS),
                    "offset": [offset for offset in OFFSETS for _ in ANCHORS],
                    "padding": 0,
                }
            ],
        }
    ]


@functools.cache
def bundle() -> str:
    """Vega alone, as a script that defines `vega`: a third less than with Vega-Lite and Vega-Embed.

    vl_convert carries it under the address from which it was taken; nothing is fetched.
    """
    module = f"https://cdn.jsdelivr.net/npm/vega@{vl_convert.get_vega_version()}/+esm.js"
    return vl_convert.javascript_bundle(
        f'import * as all from "{module}"; window.vega = all;', vl_version=VEGA_LITE
    )
