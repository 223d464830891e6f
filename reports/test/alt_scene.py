"""What a chart draws, from Vega itself."""

import vl_convert


def _walk(node):
    if isinstance(node, dict):
        if "marktype" in node:
            yield node
        for child in node.values():
            yield from _walk(child)
    elif isinstance(node, list):
        for child in node:
            yield from _walk(child)


def marks(chart, kind: str) -> list[list[dict]]:
    """The items of each layer of this kind that can be seen."""
    scene = vl_convert.vegalite_to_scenegraph(chart.properties(width=400).to_dict())
    return [
        [item for item in node["items"] if item.get("opacity") != 0]
        for node in _walk(scene)
        if node["marktype"] == kind and node["role"] == "mark"
    ]


def texts(chart) -> set[str]:
    scene = vl_convert.vegalite_to_scenegraph(chart.properties(width=400).to_dict())
    return {
        item["text"]
        for node in _walk(scene)
        if node["marktype"] == "text"
        for item in node["items"]
        if "text" in item
    }
