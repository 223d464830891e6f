"""A URDF of write_urdf.cpp as SDF 1.10, for engines that read URDF only by Gazebo's programs.

Every pose is told as URDF tells it: of a joint in its parent's link, of a link in its joint. SDF
keeps the name `world` for what is fixed: a root of that name becomes `ground`, which is fixed to
it. Some readers pass over links without mass: the ground has a unit one, which nothing moves.
"""

import xml.etree.ElementTree as ElementTree

GROUND = "ground"


class Massless(Exception):
    """A link that moves has no inertia; says which."""


def _pose(element: ElementTree.Element | None) -> str:
    origin = None if element is None else element.find("origin")
    if origin is None:
        return "0 0 0 0 0 0"
    return f"{origin.get('xyz', '0 0 0')} {origin.get('rpy', '0 0 0')}"


def _inertial(link: ElementTree.Element) -> str:
    inertial = link.find("inertial")
    if inertial is None:
        if link.get("name") != "world":
            raise Massless(link.get("name"))
        mass, moments = "1", {"ixx": "1", "iyy": "1", "izz": "1"}
    else:
        mass, moments = inertial.find("mass").get("value"), inertial.find("inertia").attrib
    inside = "".join(f"<{key}>{value}</{key}>" for key, value in moments.items())
    pose = f"<pose>{_pose(inertial)}</pose>"
    return f"<inertial>{pose}<mass>{mass}</mass><inertia>{inside}</inertia></inertial>"


def _name(link: str) -> str:
    return GROUND if link == "world" else link


def from_urdf(text: str) -> str:
    """Raises Massless."""
    robot = ElementTree.fromstring(text)
    joint_of = {joint.find("child").get("link"): joint.get("name") for joint in robot.iter("joint")}
    lines = [f'<sdf version="1.10"><model name="{robot.get("name")}">']
    for link in robot.findall("link"):
        name = link.get("name")
        placed = (
            f'<pose relative_to="{joint_of[name]}">{_pose(None)}</pose>' if name in joint_of else ""
        )
        lines.append(f'<link name="{_name(name)}">{placed}{_inertial(link)}</link>')
    for joint in robot.findall("joint"):
        parent, child = (_name(joint.find(end).get("link")) for end in ("parent", "child"))
        lines.append(
            f'<joint name="{joint.get("name")}" type="{joint.get("type")}">'
            f'<pose relative_to="{parent}">{_pose(joint)}</pose>'
            f"<parent>{parent}</parent><child>{child}</child>"
            f"<axis><xyz>{joint.find('axis').get('xyz')}</xyz></axis></joint>"
        )
    if robot.find("link[@name='world']") is not None:
        lines.append(
            f'<joint name="to_{GROUND}" type="fixed"><pose>{_pose(None)}</pose>'
            f"<parent>world</parent><child>{GROUND}</child></joint>"
        )
    return "\n".join([*lines, "</model></sdf>\n"])
