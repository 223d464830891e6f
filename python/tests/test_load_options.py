"""Options of `load`: what a file leaves open, by the rules of robots/README.md."""

import numpy as np
import pytest

import kalmarm

ARM = """<mujoco><worldbody><body name="a"><joint name="turn" axis="0 0 1" armature=".3"/>
  <inertial pos=".5 0 0" mass="2" {}/></body></worldbody>
  <actuator><motor joint="turn" gear="2" armature=".1"/></actuator></mujoco>"""


@pytest.fixture
def read(tmp_path):
    """Loads what a file of this text holds; returns the robot, without warnings."""

    def one(text, ending="xml", **options):
        file = tmp_path / f"robot.{ending}"
        file.write_text(text)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("warnings.warn", lambda *_, **__: None)
            return kalmarm.load(file, **options)

    return one


def inertia_of(robot) -> float:
    return float(robot.mass_matrix(np.zeros(robot.nq))[0, 0])


def test_armature_takes_the_place_of_the_joints_and_of_its_actuators(read):
    text = ARM.format('diaginertia="1 1 1"')
    assert inertia_of(read(text)) == pytest.approx(1 + 2 * 0.25 + 0.3 + 4 * 0.1)
    assert inertia_of(read(text, armature={"turn": 0.7})) == pytest.approx(1 + 2 * 0.25 + 0.7)
    with pytest.raises(kalmarm.LoadError, match="armature: joint 'trun' is unknown; nearest: turn"):
        read(text, armature={"trun": 0.7})
    with pytest.raises(kalmarm.LoadError, match="'turn': -1 must not be negative"):
        read(text, armature={"turn": -1})


@pytest.mark.parametrize("inertia", ['diaginertia="1 1 5"', 'fullinertia="1 1 5 0 0 0"'])
def test_moments_that_no_solid_body_has_are_refused_or_balanced(read, inertia):
    """Second moments of (1, 1, 5) are (2.5, 2.5, -1.5)."""
    text = ARM.format(inertia).replace('axis="0 0 1"', 'axis="1 0 0"')
    with pytest.raises(kalmarm.LoadError, match=r"'a': no solid body has .*\(1, 1, 5\): inertia="):
        read(text)
    balanced = read(text, inertia="balanced")
    assert inertia_of(balanced) == pytest.approx(2.5 * (1 + 1e-4) + 0.7, rel=1e-14)
    assert balanced.notes[0] == (
        "balanced moments of inertia: 'a' from 1, 1, 5 to 2.5, 2.5, 5 kg m^2"
    )
    with pytest.raises(kalmarm.LoadError, match="inertia 'best' is unknown: given, balanced"):
        read(text, inertia="best")


def test_a_tensor_is_balanced_about_its_own_axes(read):
    """Second moments of (1, 2, 7) are (4, 3, -2), so that moments become (3.0004, 4.0004, 7)."""
    R = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    tensor, balanced = (R @ np.diag(x) @ R.T for x in ([1, 2, 7], [3.0004, 4.0004, 7]))
    six = tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    text = ARM.format(f'fullinertia="{" ".join(map(repr, six.tolist()))}"')
    found = inertia_of(read(text, inertia="balanced"))
    assert found == pytest.approx(balanced[2, 2] + 0.5 + 0.7, rel=1e-13)


def test_a_link_without_mass_between_joints_is_massless(read):
    inertial = '<inertial pos=".1 .2 .3" mass="1" diaginertia=".1 .2 .3"/>'
    joints = '<joint name="a" axis="1 0 0"/>', '<joint name="b" axis="0 1 0"/>'
    body = "<mujoco><worldbody><body name='a'>{}</body></worldbody></mujoco>"
    apart = read(body.format(joints[0] + f"<body name='b'>{joints[1]}{inertial}</body>"))
    together = read(body.format(joints[0] + joints[1] + inertial))
    q, qd, tau = apart.random_state(0, 5)
    np.testing.assert_allclose(apart.mass_matrix(q), together.mass_matrix(q), rtol=1e-14)
    assert apart.notes == ()
    with pytest.raises(kalmarm.LoadError, match="mass and inertia of moving bodies"):
        read(body.format(joints[0]))  # nothing beyond it


def test_the_inertia_of_what_stands_still_is_not_looked_at(read):
    wall = '<body name="wall"><inertial pos="0 0 0" mass="1" fullinertia="-1 1 5 0 0 0"/></body>'
    text = ARM.format('diaginertia="1 1 1"').replace("<worldbody>", "<worldbody>" + wall)
    assert inertia_of(read(text)) == pytest.approx(1 + 0.5 + 0.7)


LINK = """<link name="{}"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{}" type="continuous"><parent link="{}"/><child link="{}"/>
 <axis xyz="0 0 1"/></joint>"""
URDF = f"""<robot name="r"><link name="base"/><link name="arm"><collision><geometry>
 {{}}</geometry></collision></link>{LINK.format("hand")}{JOINT.format("j", "base", "arm")}
 {JOINT.format("k", "arm", "hand")}</robot>"""
BOX = '<box size="1 2 3"/>'
MESH = '<mesh filename="package://some_robot/meshes/box.obj"/>'


def test_a_link_without_inertial_has_its_geometrys_or_none(read):
    heavy = read(URDF.format(BOX), "urdf")
    light = read(URDF.format(BOX), "urdf", urdf_inertia="none")
    assert inertia_of(light) == pytest.approx(1)
    assert inertia_of(heavy) == pytest.approx(1 + 6000 * (1 + 4) / 12)
    assert heavy.notes == ("without <inertial>: weighed by geometry at 1000 kg/m^3: 'arm'",)
    assert light.notes == ("without <inertial>: massless: 'arm'",)
    with pytest.raises(kalmarm.LoadError, match="urdf_inertia 'some' is unknown: geometry, none"):
        read(URDF.format(BOX), "urdf", urdf_inertia="some")


@pytest.fixture
def package(tmp_path):
    """A package that is not above the file, with a mesh of 1 x 2 x 3 m."""
    folder = tmp_path / "elsewhere" / "some_robot"
    (folder / "meshes").mkdir(parents=True)
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-1, 1) for z in (-1.5, 1.5)]
    quads = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = ["v " + " ".join(map(str, corner)) for corner in corners] + ["f " + f for f in quads]
    (folder / "meshes" / "box.obj").write_text("\n".join(lines) + "\n")
    return folder


@pytest.mark.parametrize("given", ["package", "parent", "variable"])
def test_meshes_of_packages_are_found(read, package, given, monkeypatch):
    options = {"package": {"package_path": [package]}, "parent": {"package_path": [package.parent]}}
    if given == "variable":
        monkeypatch.setenv("ROS_PACKAGE_PATH", str(package.parent))
    robot = read(URDF.format(MESH), "urdf", urdf_inertia="geometry", **options.get(given, {}))
    assert inertia_of(robot) == pytest.approx(1 + 6000 * (1 + 4) / 12)


def test_a_mesh_that_is_not_found_leaves_its_link_without_mass(read, tmp_path):
    robot = read(URDF.format(MESH), "urdf")
    assert inertia_of(robot) == pytest.approx(1)
    assert "massless, as a mesh is not found or not STL, OBJ or MSH: 'arm'" in robot.notes[0]
    with pytest.raises(kalmarm.LoadError, match="its mesh package://some_robot/meshes/box.obj"):
        read(URDF.format(MESH), "urdf", urdf_inertia="geometry")
    with pytest.raises(kalmarm.LoadError, match="no such folder"):
        read(URDF.format(MESH), "urdf", package_path=[tmp_path / "none"])


def test_a_urdf_with_several_roots_is_refused(read):
    text = URDF.format(BOX).replace("</robot>", LINK.format("lost") + "</robot>")
    with pytest.raises(kalmarm.LoadError, match="one tree: 'base', 'lost'"):
        read(text, "urdf")


def test_transmissions_are_named(read):
    gear = "<transmission><mechanicalReduction>50</mechanicalReduction></transmission>"
    robot = read(URDF.format(BOX).replace("</robot>", gear + "</robot>"), "urdf")
    assert robot.notes[-1] == (
        "ignored: 1 transmission, 1 gear ratio; armature= gives joints what they add to M"
    )
