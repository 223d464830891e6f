"""The order of joints that Pinocchio gives a URDF."""

from __future__ import annotations

import os
import re
import xml.etree.ElementTree as ET
from xml.parsers import expat


def pinocchios_order(path: str | os.PathLike[str], dofs: list[str]) -> list[int]:
    """Which of the DoF stands where: depth first, children by the names of their joints. As they
    are, where the file is no URDF, of which Pinocchio keeps the order."""
    try:
        robot = _root(path)
    except expat.ExpatError:  # of parts that the loader left out
        return list(range(len(dofs)))
    children: dict[str, list[tuple[str, str]]] = {}
    inboard = set()
    if robot.tag != "robot":
        return list(range(len(dofs)))
    for joint in robot.findall("joint"):
        parent, child = (one.get("link", "") for one in (joint.find("parent"), joint.find("child")))
        children.setdefault(parent, []).append((joint.get("name", ""), child))
        inboard.add(child)
    names = [link.get("name", "") for link in robot.findall("link")]
    waiting = [("", root) for root in reversed(names) if root not in inboard]
    rank: dict[str, int] = {}
    while waiting:
        joint, link = waiting.pop()
        rank[joint] = len(rank)
        waiting += sorted(children.pop(link, []), reverse=True)
    # DoF of a free base, which the file does not name, are the first.
    return sorted(range(len(dofs)), key=lambda k: rank.get(_joint(dofs[k], rank), -1))


def _root(path: str | os.PathLike[str]) -> ET.Element:
    """As the loader reads it, which knows no namespaces and takes text for UTF-8: files have
    prefixes that nothing declares, such as <sensor:camera>, which ET.parse refuses, name encodings
    that Python does not know, and begin with an empty line."""
    builder, parser = ET.TreeBuilder(), expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        parser.Parse(file.read().lstrip(), True)
    return builder.close()


def _joint(dof: str, known: dict[str, int]) -> str:
    """ "ball" of "ball:x"; "plane" of "plane_TX", "plane_TY" and "plane_RZ" """
    return dof if dof in known else re.sub(r"(:.*|_TX|_TY|_RZ)$", "", dof)
