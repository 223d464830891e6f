"""A URDF as SDF: the same poses, axes and inertias under SDF's names."""

import xml.etree.ElementTree as ElementTree

import pytest
import sdf


def model(folder):
    return ElementTree.fromstring(sdf.from_urdf((folder / "robot.urdf").read_text())).find("model")


def test_a_fixed_base_is_a_link_with_mass_that_is_fixed_to_the_world(pendulum):
    robot = model(pendulum.folder)
    fixed, hinge = sorted(robot.findall("joint"), key=lambda joint: joint.get("type"))
    assert (fixed.find("parent").text, fixed.find("child").text) == ("world", "ground")
    assert (hinge.get("type"), hinge.find("parent").text) == ("revolute", "ground")
    assert {link.get("name") for link in robot.findall("link")} == {"ground", "hinge_link"}
    assert all(float(link.find("inertial/mass").text) > 0 for link in robot.findall("link"))


def test_poses_are_told_of_joints_in_their_parent_and_of_links_in_their_joint(pendulum):
    robot = model(pendulum.folder)
    hinge = robot.find("joint[@name='hinge']")
    assert hinge.find("pose").get("relative_to") == "ground"
    assert hinge.find("axis/xyz").text == "0 0 1"
    urdf = ElementTree.parse(pendulum.folder / "robot.urdf")
    origin = urdf.find("joint/origin")
    assert hinge.find("pose").text == f"{origin.get('xyz')} {origin.get('rpy')}"
    link = robot.find("link[@name='hinge_link']")
    assert link.find("pose").get("relative_to") == "hinge"
    assert link.find("inertial/pose").text == "0.5 0 0 0 0 0"
    inertia = {entry.tag: float(entry.text) for entry in link.find("inertial/inertia")}
    assert inertia == {"ixx": 0.2, "ixy": 0, "ixz": 0, "iyy": 0.25, "iyz": 0, "izz": 0.3}


def test_a_free_base_is_fixed_to_nothing(free_body):
    robot = model(free_body.folder)
    assert [link.get("name") for link in robot.findall("link")] == ["base_link"]
    assert not robot.findall("joint")


def test_a_link_that_moves_without_inertia_is_named():
    urdf = """<robot name="r"><link name="world"/><link name="hand"/>
      <joint name="j" type="revolute"><parent link="world"/><child link="hand"/><axis xyz="0 0 1"/>
      </joint></robot>"""
    with pytest.raises(sdf.Massless, match="hand"):
        sdf.from_urdf(urdf)
