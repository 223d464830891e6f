"""Robots: how they are made, what is asked of them, and what they say."""

import sys

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from conftest import ROBOTS, file_of, load

import kalmarm


def rods(count: int) -> kalmarm.Robot:
    builder = kalmarm.Builder("rods")
    for k in range(count):
        builder.add_body(
            f"rod{k}",
            parent=f"rod{k - 1}" if k else -1,
            joint="hinge",
            axis=(0, 1, 0),
            position=(0, 0, -1 if k else 0),
            mass=1,
            center_of_mass=(0, 0, -0.5),
            inertia=(1 / 12, 1 / 12, 0),
        )
    return builder.build()


def test_a_pendulum_built_by_hand_swings_by_its_closed_form():
    robot = rods(1)
    q = np.linspace(-2, 2, 5)[:, None]
    zero = np.zeros_like(q)
    np.testing.assert_allclose(
        robot.forward_dynamics(q, zero, zero), -1.5 * 9.81 * np.sin(q), rtol=1e-14, atol=1e-14
    )
    np.testing.assert_allclose(robot.mass_matrix(q)[:, 0, 0], 1 / 3, rtol=1e-15)


def test_builder_refuses_with_one_sentence():
    builder = kalmarm.Builder()
    builder.add_body("arm", joint="hinge", mass=1, inertia=(1, 1, 1))
    with pytest.raises(ValueError, match="body 'am' is unknown; nearest: arm"):
        builder.add_body("hand", parent="am")
    with pytest.raises(ValueError, match="mass is -1"):
        builder.add_body("hand", parent="arm", mass=-1)
    with pytest.raises(ValueError, match="joint 'hing' is unknown: fixed, hinge"):
        builder.add_body("hand", parent="arm", joint="hing")
    with pytest.raises(ValueError, match=r"inertia has shape \(2,\)"):
        builder.add_body("hand", inertia=(1, 2))
    with pytest.raises(ValueError, match="no joint, so no degree of freedom"):
        kalmarm.Builder().build()


def test_locked_joints_leave_the_robot_of_the_others():
    robot = load("iiwa14")
    q, qd, tau = robot.random_state(1)
    locked = ["joint2", "joint5"]
    reduced = robot.replace(locked=locked, q=q)
    free = [k for k in range(7) if robot.dofs[k] not in locked]
    assert reduced.n == 5
    assert reduced.plan().asked == free
    np.testing.assert_allclose(
        reduced.mass_matrix(q), robot.mass_matrix(q)[np.ix_(free, free)], rtol=1e-12
    )
    assert "locked_joints" in reduced.plan().rules


def test_asked_joints_are_a_part_of_the_answer():
    robot = load("g1")
    q, qd, tau = robot.random_state(2, 5)
    some = robot.replace(asked=["left_*"])
    columns = [k for k, name in enumerate(robot.dofs) if name.startswith("left_")]
    np.testing.assert_allclose(
        some.forward_dynamics(q, qd, tau),
        robot.forward_dynamics(q, qd, tau)[:, columns],
        rtol=1e-9,
    )


def test_at_rest_velocities_are_not_looked_at():
    robot = load("ur10e", at_rest=True)
    q, qd, tau = robot.random_state(3, 5)
    np.testing.assert_allclose(
        robot.forward_dynamics(q, qd, tau),
        load("ur10e").forward_dynamics(q, 0 * qd, tau),
        rtol=1e-10,
    )


def test_tolerances_agree_and_are_refused_beyond_the_last_bits():
    robot = load("panda")
    q, qd, tau = robot.random_state(4, 5)
    a = robot.forward_dynamics(q, qd, tau)
    other = robot.replace(tolerance=kalmarm.last_bits)
    assert other.tolerance == kalmarm.last_bits and robot.tolerance is None
    np.testing.assert_allclose(other.forward_dynamics(q, qd, tau), a, rtol=1e-9)
    with pytest.raises(ValueError, match="tolerance 1e-17 is not within 8.88e-16 and 1"):
        robot.replace(tolerance=1e-17).forward_dynamics(q, qd, tau)
    with pytest.raises(TypeError, match="no option is called 'shape'"):
        robot.replace(shape="best")


def test_unknown_names_are_refused_with_the_nearest():
    robot = load("iiwa14")
    with pytest.raises(ValueError, match="joint 'jiont3' is unknown; nearest: joint3"):
        robot.replace(locked=["jiont3"])
    with pytest.raises(ValueError, match="frame 'link_9' is unknown"):
        robot.replace(frames=["link_9"])
    with pytest.raises(ValueError, match="no frames are asked about"):
        robot.operational(robot.q0)
    with pytest.raises(ValueError, match="question does not want it"):
        robot.replace(wants=["mass"]).inverse_mass_matrix(robot.q0)


def test_a_model_of_other_joints_is_refused():
    go2, panda = load("go2"), load("panda")
    with pytest.raises(ValueError, match="with_model: the model is not of go2, .*panda|joint1"):
        go2.with_model(panda.model)
    q, _, _ = go2.random_state(0, 3)
    np.testing.assert_array_equal(go2.with_model(go2.model).mass_matrix(q), go2.mass_matrix(q))
    turned, slid = kalmarm.Builder(), kalmarm.Builder()
    turned.add_body("rod", joint="hinge", mass=1, inertia=(1, 1, 1))
    slid.add_body("rod", joint="slide", mass=1)
    with pytest.raises(ValueError, match=r"DoF are rod \(angle\): it has rod \(distance\)"):
        turned.build().with_model(slid.build().model)


def test_rotations_of_frames_are_unit_quaternions(name):
    builder = kalmarm.Builder()
    builder.add_body("rod", joint="slide", axis=(1, 2, 0), rotation=(0, 3, 4, 0), mass=1)
    builder.add_frame("tip", "rod", rotation=(2, 0, 0, 0))
    for frames in (builder.build().frames, load(name).frames):
        for frame in frames.values():
            assert np.linalg.norm(frame.rotation) == pytest.approx(1, rel=1e-14)


def test_repr_tells_size_tolerance_precision_and_instruction_set():
    text = repr(load("g1", tolerance=1e-10))
    for part in ("g1", "35 DoF", "36 in q", "within 1e-10", "float32", kalmarm.instruction_set()):
        assert part in text


def test_random_states_are_within_limits_and_of_unit_quaternions():
    model = mujoco.MjModel.from_xml_path(str(file_of("g1")))
    q, qd, tau = load("g1").random_state(5, 200)
    np.testing.assert_allclose(np.linalg.norm(q[:, 3:7], axis=1), 1, rtol=1e-14)
    low, high = model.jnt_range[1:].T
    assert np.all((q[:, 7:] >= low) & (q[:, 7:] <= high))
    assert qd.shape == tau.shape == (200, 35)
    again = load("g1").random_state(5, 200)
    np.testing.assert_array_equal(again.q, q)


def test_recommend_takes_float64_where_float32_is_not_enough():
    robot = load("iiwa14")
    coarse, fine = robot.recommend(1e-2, count=20), robot.recommend(1e-12, count=20)
    assert coarse.enough and fine.enough
    assert fine.precision == "float64"
    assert fine.reason
    with pytest.raises(ValueError, match="together or not at all"):
        robot.recommend(q=robot.q0)


CLOSED = """<mujoco><worldbody>
 <body name="a"><joint name="j" damping="1"/><geom size=".1"/></body>
 <body name="b"><joint name="k" frictionloss="1"/><geom size=".1"/></body></worldbody>
 <equality><connect body1="a" body2="b" anchor="0 0 1"/></equality>
 <actuator><motor joint="j"/><motor joint="k"/></actuator></mujoco>"""


def test_what_is_ignored_is_warned_of(tmp_path):
    file = tmp_path / "closed.xml"
    file.write_text(CLOSED)
    ignored = "ignored: 1 connect constraint, 2 actuators, damping of 1 joint, friction of 1 joint"
    with pytest.warns(UserWarning, match=ignored):
        robot = kalmarm.load(file)
    assert robot.notes == (ignored,)


def test_a_file_whose_meshes_are_missing_loads_if_no_inertia_needs_them(tmp_path):
    file = tmp_path / "robot.xml"
    text = """<mujoco><asset><mesh name="m" file="none.stl"/></asset><worldbody><body name="a">
      <joint name="j"/><geom type="mesh" mesh="m"/>{}</body></worldbody></mujoco>"""
    file.write_text(text.format('<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'))
    assert kalmarm.load(file).nv == 1
    file.write_text(text.format(""))
    with pytest.raises(kalmarm.LoadError, match="robot.xml: .*none.stl"):
        kalmarm.load(file)


URDF = """<robot name="r"><link name="base"><inertial><mass value="2"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <link name="arm"><inertial><origin xyz="0 0 .5"/><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
 <limit lower="-1" upper="2" effort="1" velocity="1"/></joint></robot>"""


MIMIC = """<link name="hand"><inertial><mass value="1"/>
 <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
 <joint name="k" type="revolute"><parent link="arm"/><child link="hand"/><axis xyz="0 1 0"/>
 <mimic joint="j" multiplier="2"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint></robot>"""


def test_the_base_of_a_urdf_is_welded_or_floats(tmp_path):
    file = tmp_path / "robot.urdf"
    file.write_text(URDF)
    assert kalmarm.load(file).dofs == ["j"]
    floating = kalmarm.load(file, floating=True)
    assert floating.nv == 7
    assert floating.dofs[0] == "floating_base:x"
    with pytest.raises(kalmarm.LoadError, match="floating link 'leg' is unknown; nearest: base"):
        kalmarm.load(file, floating="leg")


def test_a_keyframe_is_where_the_robot_starts(tmp_path):
    file = tmp_path / "robot.xml"
    file.write_text("""<mujoco>
      <worldbody><body><joint name="j"/><geom size=".1"/></body></worldbody>
      <keyframe><key name="up" qpos="0.7"/></keyframe></mujoco>""")
    assert kalmarm.load(file, key="up").q0.tolist() == [0.7]
    with pytest.raises(kalmarm.LoadError, match=r"'down' \(known: up\)"):
        kalmarm.load(file, key="down")


def test_files_that_are_no_robots_are_refused_in_one_line(tmp_path):
    with pytest.raises(FileNotFoundError, match="no such file"):
        kalmarm.load(tmp_path / "none.xml")
    file = tmp_path / "bad.xml"
    file.write_text("<mujoco><worldbody><body></mujoco>")
    with pytest.raises(kalmarm.LoadError) as error:
        kalmarm.load(file)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"{file}: ")
    file.write_text("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    with pytest.raises(kalmarm.LoadError, match="no joint, so no degree of freedom"):
        kalmarm.load(file)


def test_without_mujoco_load_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ImportError, match="pip install mujoco"):
        kalmarm.load(ROBOTS / "g1" / "g1.xml")


def test_joints_of_pinocchio_that_are_not_supported_are_refused_by_name():
    for kind in (pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]), pin.JointModelHX(0.1)):
        model = pin.Model()
        model.addJoint(0, kind, pin.SE3.Identity(), "rolls")
        words = f"joint 'rolls' is a {kind.shortname()}: not supported"
        with pytest.raises(ValueError, match=words):
            kalmarm.from_pinocchio(model)


def test_a_mimic_of_pinocchio_is_refused_with_what_to_do():
    text = URDF.replace("</robot>", MIMIC)
    model = pin.buildModelFromXML(text)  # without mimic, as it says
    assert kalmarm.from_pinocchio(model).dofs == ["j", "k"]
    model = pin.buildModelFromXML(text, mimic=True)
    with pytest.raises(ValueError, match="joint 'k' is a JointModelMimic.*build the model without"):
        kalmarm.from_pinocchio(model)


def test_moments_of_pinocchio_that_no_solid_body_has_are_taken_or_balanced():
    """Second moments of (1, 1, 5) are (2.5, 2.5, -1.5)."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRX(), pin.SE3.Identity(), "j")
    R = pin.Quaternion(0.1, 0.2, 0.3, 0.4).normalized().matrix()
    model.appendBodyToJoint(
        joint, pin.Inertia(1, np.zeros(3), R @ np.diag([1.0, 1, 5]) @ R.T), pin.SE3.Identity()
    )
    with pytest.warns(UserWarning, match="taken as given, although no solid body has .*: 'j'"):
        given = kalmarm.from_pinocchio(model)
    assert given.mass_matrix([0.0])[0, 0] == pytest.approx(model.inertias[1].inertia[0, 0])
    with pytest.warns(UserWarning, match="balanced.*: 'j'"):
        balanced = kalmarm.from_pinocchio(model, inertia="balanced")
    s = 2.5 * 1e-4
    tensor = R @ np.diag([2.5 + s, 2.5 + s, 5]) @ R.T
    assert balanced.mass_matrix([0.0])[0, 0] == pytest.approx(tensor[0, 0], rel=1e-12)
    with pytest.raises(ValueError, match="inertia 'best' is unknown: given, balanced"):
        kalmarm.from_pinocchio(model, inertia="best")


def test_what_is_no_model_of_pinocchio_is_refused():
    with pytest.raises(ValueError, match="no joint, so no degree of freedom"):
        kalmarm.from_pinocchio(pin.Model())
    with pytest.raises(TypeError, match="from_pinocchio: str is no pinocchio.Model"):
        kalmarm.from_pinocchio("robot.urdf")


def test_friction_of_a_pinocchio_model_is_warned_of():
    model = pin.buildModelFromMJCF(str(file_of("panda")))
    model.damping[:] = 1
    with pytest.warns(UserWarning, match="damping of 9 DoF"):
        kalmarm.from_pinocchio(model)
