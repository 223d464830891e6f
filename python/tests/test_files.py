"""What crosses from Python to the loader and back: options, paths, refusals, inertias. The loader's
rules themselves are tested in robots/loader/test."""

import os
import threading
import time
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

import kalmarm
from kalmarm import _core

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


# --- options


def test_armature_takes_the_place_of_the_joints_and_of_its_actuators(read):
    text = ARM.format('diaginertia="1 1 1"')
    assert inertia_of(read(text)) == pytest.approx(1 + 2 * 0.25 + 0.3 + 4 * 0.1)
    assert inertia_of(read(text, armature={"turn": 0.7})) == pytest.approx(1 + 2 * 0.25 + 0.7)
    with pytest.raises(kalmarm.LoadError, match="armature: joint 'trun' is unknown; nearest: turn"):
        read(text, armature={"trun": 0.7})


@pytest.mark.parametrize("inertia", ['diaginertia="1 1 5"', 'fullinertia="1 1 5 0 0 0"'])
def test_moments_that_no_solid_body_has_are_taken_or_balanced(read, inertia):
    """Second moments of (1, 1, 5) are (2.5, 2.5, -1.5)."""
    text = ARM.format(inertia).replace('axis="0 0 1"', 'axis="1 0 0"')
    given = read(text)
    assert inertia_of(given) == pytest.approx(1 + 0.7, rel=1e-14)
    assert "no solid body has such moments of inertia: 'a'" in given.notes[-1]
    balanced = read(text, inertia="balanced")
    assert inertia_of(balanced) == pytest.approx(2.5 * (1 + 1e-4) + 0.7, rel=1e-14)
    assert balanced.notes[0] == (
        "balanced moments of inertia: 'a' from 1, 1, 5 to 2.5, 2.5, 5 kg m^2"
    )
    with pytest.raises(kalmarm.LoadError, match="option inertia=balanced takes the nearest"):
        read(text.replace("1 1 5", "1 1 -5"))


@pytest.mark.parametrize(
    ("option", "value", "kind", "words"),
    [
        ("inertia", "best", ValueError, "inertia 'best' is unknown: given, balanced"),
        ("urdf_inertia", "some", ValueError, "urdf_inertia 'some' is unknown: geometry, none"),
        ("armature", {"turn": "x"}, TypeError, "armature of 'turn' is 'x': a number is needed"),
        ("package_path", "/opt/ros", TypeError, r"package_path is a string: a list is needed"),
        ("wants", "mass", TypeError, r"wants is a string: a list is needed, wants=\['mass'\]"),
        ("wants", ["mas"], ValueError, "want 'mas' is unknown: acceleration, inverse"),
        ("locked", ["trun"], ValueError, "joint 'trun' is unknown; nearest: turn"),
        ("frames", [3], TypeError, "frames holds 3: a name or a kalmarm.Frame is needed"),
        ("tolerance", "x", TypeError, "tolerance is 'x': a number is needed"),
        ("tolerance", -1, ValueError, "tolerance -1 is not within"),
    ],
)
def test_options_that_are_wrong_are_not_a_fault_of_the_file(read, option, value, kind, words):
    with pytest.raises(kind, match=words) as error:
        read(ARM.format('diaginertia="1 1 1"'), **{option: value})
    assert not isinstance(error.value, kalmarm.LoadError)
    assert "\n" not in str(error.value)


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>'


def inertial(mass: float, tensor: str, origin: str = "") -> str:
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    six = (*tensor.split(), "0", "0", "0")
    numbers = " ".join(f'{name}="{x}"' for name, x in zip(names, six))
    return f'<inertial>{origin}<mass value="{mass}"/><inertia {numbers}/></inertial>'


def joint(name: str, parent: str, child: str, axis: str = "0 0 1", kind: str = "continuous") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<axis xyz="{axis}"/></joint>'
    )


def urdf(*parts: str) -> str:
    return f'<robot name="r">{link("base")}{"".join(parts)}</robot>'


def shaped(geometry: str) -> str:
    arm = f"<collision><geometry>{geometry}</geometry></collision>"
    hand = link("hand", inertial(1, "1 1 1"))
    return urdf(link("arm", arm), hand, joint("j", "base", "arm"), joint("k", "arm", "hand"))


BOX = '<box size="1 2 3"/>'
MESH = '<mesh filename="package://some_robot/meshes/box.obj"/>'


def test_a_link_without_inertial_has_its_geometrys_or_none(read):
    heavy = read(shaped(BOX), "urdf")
    light = read(shaped(BOX), "urdf", urdf_inertia="none")
    assert inertia_of(light) == pytest.approx(1)
    assert inertia_of(heavy) == pytest.approx(1 + 6000 * (1 + 4) / 12)
    assert heavy.notes == ("without <inertial>: weighed by geometry at 1000 kg/m^3: 'arm'",)
    assert light.notes == ("without <inertial>: massless: 'arm'",)


def test_meshes_of_packages_are_found(read, tmp_path):
    """A mesh of 1 x 2 x 3 m, in a package that is not above the file."""
    folder = tmp_path / "elsewhere" / "some_robot"
    (folder / "meshes").mkdir(parents=True)
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-1, 1) for z in (-1.5, 1.5)]
    quads = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    lines = ["v " + " ".join(map(str, corner)) for corner in corners] + ["f " + f for f in quads]
    (folder / "meshes" / "box.obj").write_text("\n".join(lines) + "\n")
    for place in (folder, str(folder.parent)):
        robot = read(shaped(MESH), "urdf", urdf_inertia="geometry", package_path=[place])
        assert inertia_of(robot) == pytest.approx(1 + 6000 * (1 + 4) / 12)
    with pytest.raises(kalmarm.LoadError, match="its mesh package://some_robot/meshes/box.obj"):
        read(shaped(MESH), "urdf", urdf_inertia="geometry")
    with pytest.raises(kalmarm.LoadError, match="no such folder"):
        read(shaped(MESH), "urdf", package_path=[tmp_path / "none"])


def test_a_mimic_is_a_row_where_it_is_imposed(read):
    mimic = joint("k", "a", "b").replace("</joint>", '<mimic joint="j" multiplier="3"/></joint>')
    arms = [link(name, inertial(1, "1 1 1")) for name in "ab"]
    text = urdf(*arms, joint("j", "base", "a"), mimic)
    assert read(text, "urdf", takes_steps=True).notes == ("ignored: 1 coupling of joints",)
    robot = read(text, "urdf", takes_steps=True, imposes_couplings=True)
    (row,) = robot.terms.rows
    assert robot.notes == ()
    assert row.imposed and row.jacobian.tolist() == [-3, 1]


def test_what_only_draws_is_left_out_with_a_warning(tmp_path):
    file = tmp_path / "robot.urdf"
    twice = "<visual><material/><material/></visual>"
    file.write_text(urdf(link("a", inertial(1, "1 1 1") + twice), joint("j", "base", "a")))
    with pytest.warns(UserWarning, match="read without what only draws or collides") as warned:
        assert kalmarm.load(file).nv == 1
    assert warned[0].filename == __file__


# --- order of DoF


def branched() -> str:
    """Children that are no names in order, on fixed joints too."""
    links = [
        link(name, inertial(i + 1, "2 3 4", '<origin xyz=".1 .2 .3"/>'))
        for i, name in enumerate("abcdefg")
    ]
    return urdf(
        *links,
        joint("z", "base", "a"),
        joint("m", "base", "b", kind="fixed"),
        joint("y", "b", "c", "1 0 0", "prismatic").replace(
            "/></joint>", '/><limit effort="1" velocity="1"/></joint>'
        ),
        joint("B", "b", "d", "0 1 0"),
        joint("x10", "a", "e", "1 0 0"),
        joint("x9", "a", "f", "0 1 0"),
        joint("é", "a", "g", "0 1 0"),
    )


@pytest.mark.parametrize("floating", [False, True])
def test_dofs_are_in_the_order_of_the_file_or_of_pinocchio(read, floating):
    text = branched()
    root = (pin.JointModelFreeFlyer(),) if floating else ()
    model = pin.buildModelFromXML(text, *root)
    file, sorted_ = (
        read(text, "urdf", floating=floating, takes_steps=True, dof_order=order)
        for order in ("file", "pinocchio")
    )
    joints = [name for name in model.names if name not in ("universe", "root_joint")]
    assert sorted_.dofs[-6:] == joints
    assert file.dofs[-6:] == ["z", "x10", "x9", "é", "y", "B"]
    assert "dof_order='pinocchio'" in file.notes[-1]
    assert not any("dof_order" in note for note in sorted_.notes)

    states, data = kalmarm.PinocchioStates(model), model.createData()
    q = pin.randomConfiguration(model, -np.ones(model.nq), np.ones(model.nq))
    v = np.arange(1.0, model.nv + 1)
    a = pin.aba(model, data, q, v, v)
    q, qd, tau, a = states.q(q), states.qd(q, v), states.tau(q, v), states.qdd(q, v, a)
    np.testing.assert_allclose(sorted_.forward_dynamics(q, qd, tau), a, rtol=1e-9)

    order = [file.dofs.index(name) for name in sorted_.dofs]
    q, _, _ = file.random_state(0)
    entries = [one + (file.nq - file.nv if one > 5 else 0) for one in order]
    theirs = np.concatenate([q[:7], q[np.array(entries[6:], int)]]) if floating else q[order]
    for name in "acdefg":
        one = file.replace(frames=[name]).operational(q)
        np.testing.assert_allclose(
            sorted_.replace(frames=[name]).operational(theirs), one, rtol=1e-9, atol=1e-12
        )


@pytest.mark.parametrize("what", ["prefix", "encoding", "empty line"])
def test_what_the_loader_does_not_ask_for_keeps_no_file_from_pinocchios_order(read, what):
    text = branched()
    if what == "prefix":
        text = text.replace("</robot>", '<gazebo><sensor:camera name="x"/></gazebo></robot>')
    else:
        head = '<?xml version="1.0" encoding="GB2312"?>'
        head = head if what == "encoding" else '\n<?xml version="1.0"?>'
        text = head + text[text.index("<robot") :]
    joints = list(pin.buildModelFromXML(text).names)[1:]
    assert read(text, "urdf", dof_order="pinocchio").dofs == joints
    assert "dof_order='pinocchio'" in read(text, "urdf").notes[-1]


@pytest.mark.parametrize("parent", ["base", "a"])
def test_a_planar_joint_stands_where_pinocchio_has_it(read, parent):
    links = [link(name, inertial(1, "2 3 4")) for name in "abc"]
    plane = joint("p", parent, "b", kind="planar")
    text = urdf(*links, joint("z", "base", "a"), plane, joint("c", "b", "c"))
    order = list(pin.buildModelFromXML(text).names)[1:]
    expected = [dof for one in order for dof in (["p_TX", "p_TY", "p_RZ"] if one == "p" else [one])]
    robot = read(text, "urdf", dof_order="pinocchio")
    assert robot.dofs == expected
    file = read(text, "urdf")
    assert any("dof_order" in note for note in file.notes) == (file.dofs != expected)


def test_an_order_that_is_none_is_refused(read):
    with pytest.raises(ValueError, match="dof_order 'random' is unknown: file, pinocchio"):
        read(branched(), "urdf", dof_order="random")


# --- inertias (robots/loader/test/test_given_inertia.cpp has more)

TURNED = '<origin rpy="0 0 1.5707963267948966"/>'
WHEEL = joint("j", "base", "wheel", "1 0 0")
ROTOR_AND_ARM = urdf(
    link("rotor", inertial(0, "0.02 0.02 0.03")),
    link("arm", inertial(1, "0.01 0.01 0.01", '<origin xyz="0.1 0 0"/>')),
    joint("j", "base", "rotor"),
    joint("k", "rotor", "arm", "0 1 0"),
)
FROM_GEOMS = """<mujoco><compiler inertiafromgeom="true"/><worldbody><body><joint axis="0 1 0"/>
 <inertial pos="0.1 0 0" mass="2" diaginertia="0.02 0.03 0.04"/><body pos="0.3 0 0">
 <joint axis="0 1 0"/><geom type="box" size="0.1 0.1 0.1" mass="1"/></body></body></worldbody>
 </mujoco>"""
TOTAL = """<mujoco><compiler settotalmass="50"/><worldbody><body>
 <geom type="box" size="0.1 0.1 0.1" mass="20"/><body pos="0 0 0.1"><joint axis="0 1 0"/>
 <inertial pos="0.2 0 0" mass="5" diaginertia="0.01 0.05 0.05"/></body></body></worldbody></mujoco>"""
BOUND = """<mujoco><compiler boundmass="0.5"/><worldbody><body><joint axis="0 0 1"/>
 <inertial pos="0 0 0" mass="0.1" diaginertia="0.01 0.01 0.03"/></body></worldbody></mujoco>"""
NOTHING = "<collision><geometry><box size='0 0 0'/></geometry></collision>"


@pytest.mark.parametrize(
    ("text", "M11"),
    [
        (urdf(link("wheel", inertial(1, "0.001 0.002 0.01", TURNED)), WHEEL), 0.002),
        (ROTOR_AND_ARM, 0.03 + 0.01 + 0.01),
        (FROM_GEOMS, 0.03 + 2 * 0.01 + 0.09 + 1 / 150),
        (TOTAL, 2 * (0.05 + 5 * 0.04)),
        (BOUND, 0.03),
        (urdf(link("wheel", inertial(0.02, "1e-5 1e-6 9e-6 0 0 -1e-6")), WHEEL), 1e-5),
        (
            urdf(
                link("wheel", inertial(1, "2 1 1")),
                link("tip", NOTHING),
                WHEEL,
                joint("f", "wheel", "tip", kind="fixed"),
            ),
            2,
        ),
    ],
    ids=["turned", "without mass", "no geoms", "total mass", "bound", "flat", "no volume"],
)
def test_inertias_are_as_the_file_has_them(read, text, M11):
    robot = read(text, "xml" if text.startswith("<mujoco") else "urdf")
    assert inertia_of(robot) == pytest.approx(M11, rel=1e-13)


# --- paths, refusals, threads


@pytest.mark.parametrize("name", [b"r\xff\xe9.xml", "Zahnräder.xml".encode(), b"a b%s{0}\n.xml"])
@pytest.mark.parametrize("kind", [os.fsencode, os.fsdecode, lambda path: Path(os.fsdecode(path))])
def test_any_name_of_a_file_is_taken(tmp_path, name, kind):
    path = os.path.join(os.fsencode(tmp_path), name)
    with open(path, "w") as file:
        file.write(ARM.format('diaginertia="1 1 1"'))
    with pytest.warns(UserWarning, match="ignored: 1 actuator"):
        robot = kalmarm.load(kind(path))
    assert os.fsencode(robot.name) + b".xml" == name
    with open(path, "w") as file:
        file.write("<mujoco")
    with pytest.raises(kalmarm.LoadError) as error:
        kalmarm.load(kind(path))
    assert str(error.value).startswith(os.fsdecode(path).replace("\n", " ") + ": ")
    assert "\n" not in str(error.value)


def test_what_is_no_file_is_refused(tmp_path):
    with pytest.raises(kalmarm.LoadError, match="is a folder, not a file"):
        kalmarm.load(tmp_path)
    with pytest.raises(kalmarm.LoadError, match="expand them first: xacro"):
        (tmp_path / "r.urdf").write_text("<robot name='r'><xacro:arm/></robot>")
        kalmarm.load(tmp_path / "r.urdf")
    with pytest.raises(TypeError, match="from_mujoco: str is no mujoco.MjModel"):
        kalmarm.from_mujoco("x.xml")


def test_another_release_of_mujoco_is_refused(monkeypatch, read):
    monkeypatch.setattr(mujoco, "__version__", "3.2.1")
    built = f"was built for MuJoCo {_core.mujoco_version}, and 3.2.1 is installed"
    with pytest.raises(ImportError, match=built):
        read(ARM)
    monkeypatch.setattr(_core, "mujoco_version", "")
    with pytest.raises(ImportError, match="was built without MuJoCo"):
        read(ARM)


def test_a_long_file_does_not_hold_other_threads(read):
    """Shapes enough for a second; what else computes in Python meanwhile goes on."""
    shapes = '<geom size="0.1"/>' * 7000
    text = f"<mujoco><worldbody><body><joint/>{shapes}</body></worldbody></mujoco>"
    longest, done = 0.0, threading.Event()

    def tick():
        nonlocal longest
        last = time.monotonic()
        while not done.wait(0.001):
            longest, last = max(longest, time.monotonic() - last), time.monotonic()

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    try:
        assert read(text).nv == 1
    finally:
        took = time.monotonic() - begin
        done.set()
        thread.join()
    assert longest < 0.5 * took


def test_many_threads_load_at_once(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text(ARM.format('diaginertia="1 1 1"'))
    found, wrong = [], []

    def work(bad):
        for _ in range(5):
            try:
                armature = {"none": 1} if bad else {"turn": 0.7}
                found.append(inertia_of(kalmarm.load(file, armature=armature, takes_steps=True)))
            except kalmarm.LoadError:
                wrong.append(bad)

    threads = [threading.Thread(target=work, args=(bad,)) for bad in (True, False, True, False)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [found[0]] * 10
    assert wrong == [True] * 10
    with pytest.raises(ValueError):  # MuJoCo's own errors are MuJoCo's again
        mujoco.MjModel.from_xml_string("<mujoco><none/></mujoco>")
