"""What only a renderer or a middleware reads refuses no robot."""

from pathlib import Path

import numpy as np
import pytest

import kalmarm
from kalmarm._drawn import without_drawn_parts

INERTIA = (
    "<inertial><origin xyz='0.1 0 0.2'/><mass value='2'/>"
    "<inertia ixx='.3' iyy='.4' izz='.5' ixy='.1' ixz='0' iyz='0'/></inertial>"
)
PENDULUM = "<worldbody><body><joint axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/></body></worldbody>"
NOTE = "read without what only draws or collides, which MuJoCo refuses"


def urdf(parts: str, rest: str = "") -> str:
    return (
        f"<robot name='r'><link name='base'/><link name='arm'>{INERTIA}{parts}</link>"
        "<joint name='j' type='revolute'><parent link='base'/><child link='arm'/>"
        "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
        f"{rest}</robot>"
    )


def read(folder: Path, text: str, ending: str = ".urdf") -> kalmarm.Robot:
    path = folder / f"robot{ending}"
    path.write_text(text)
    return kalmarm.load(path)


@pytest.mark.parametrize(
    ("parts", "rest"),
    [
        ("<visual><material name='a'/><material name='b'/></visual>", ""),
        ("<visual><geometry><box size='1 1 1'/></geometry>" + 2 * "<material/>" + "</visual>", ""),
        ("<visual><material/><material/></visual>", "<material name='c'><color/></material>"),
    ],
)
def test_of_a_urdf_refuse_nothing(tmp_path: Path, parts: str, rest: str) -> None:
    plain = read(tmp_path, urdf(""))
    with pytest.warns(UserWarning, match=NOTE):
        drawn = read(tmp_path, urdf(parts, rest))
    q = np.array([0.3])
    assert drawn.mass_matrix(q) == plain.mass_matrix(q)


SCALED_WRONGLY = (
    "<collision><geometry><mesh filename='a.stl' scale='1 1 1 1'/></geometry></collision>"
)


def test_collisions_of_a_link_with_an_inertia_refuse_nothing(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=NOTE):
        read(tmp_path, urdf(SCALED_WRONGLY))


def test_collisions_that_weigh_are_not_left_out(tmp_path: Path) -> None:
    geometry = "<mujoco><compiler inertiafromgeom='true'/></mujoco>"
    for text in (urdf(SCALED_WRONGLY).replace(INERTIA, ""), urdf(SCALED_WRONGLY, geometry)):
        with pytest.raises(kalmarm.LoadError, match="scale"):
            read(tmp_path, text)


@pytest.mark.parametrize(
    ("joint", "rest", "nv"),
    [("<freejoint/>", "<size memory='64'/>", 6), ("<joint type='ball' range='10 20'/>", "", 3)],
)
def test_what_only_a_simulation_needs_refuses_nothing(
    tmp_path: Path, joint: str, rest: str, nv: int
) -> None:
    text = PENDULUM.replace("<joint axis='0 1 0'/>", joint)
    assert read(tmp_path, f"<mujoco>{text}{rest}</mujoco>", ".xml").nv == nv


@pytest.mark.parametrize(
    "parts",
    [
        "<visual><globe/></visual>",
        "<asset><material name='steel' sheen='1'><layer/></material></asset>",
        "<worldbody><light colour='1'/><camera lens='2'/></worldbody>",
    ],
)
def test_of_an_mjcf_and_what_it_includes_refuse_nothing(tmp_path: Path, parts: str) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/look.xml").write_text(f"<mujoco>{parts}</mujoco>")
    (tmp_path / "parts/hand.xml").write_text(f"<mujoco>{parts}{PENDULUM}</mujoco>")
    texts = {
        1: f"<mujoco>{parts}{PENDULUM}</mujoco>",
        2: f"<mujoco><include file='parts/look.xml'/>{PENDULUM}"
        "<asset><model name='m' file='parts/hand.xml'/></asset><worldbody>"
        "<frame><attach model='m' prefix='a_'/></frame></worldbody></mujoco>",
    }
    for dofs, text in texts.items():
        with pytest.warns(UserWarning, match=NOTE):
            assert read(tmp_path, text, ".xml").nv == dofs


def test_do_not_hide_what_is_wrong_elsewhere(tmp_path: Path) -> None:
    wrong = urdf("<visual><material/><material/></visual>").replace("revolute", "twisting")
    with pytest.raises(kalmarm.LoadError, match="joint"):
        read(tmp_path, wrong)


def test_lines_and_all_else_stay_where_they_are() -> None:
    text = (
        "<robot>\n<!-- <visual> -->\n<link name='a'><visual name='>' >\r\n<visual/>\n</visual>"
        "</link><material/></robot>\n"
    )
    left = (
        "<robot>\n<!-- <visual> -->\n<link name='a'>                  \r\n         \n         "
        "</link>           </robot>\n"
    )
    assert without_drawn_parts(text) == left
    assert without_drawn_parts(left) == left


def test_a_model_that_attaches_itself_is_refused(tmp_path: Path) -> None:
    text = f"<mujoco><asset><model name='m' file='robot.xml'/></asset>{PENDULUM}</mujoco>"
    with pytest.raises(kalmarm.LoadError, match="attaches itself"):
        read(tmp_path, text, ".xml")
