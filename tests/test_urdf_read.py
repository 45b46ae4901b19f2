"""URDF, read: fixed transforms as rows, mimics, limits, shapes, names, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from bodyplan.cli import app
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.missions import load_mission
from bodyplan.robot import Robot
from bodyplan.robot.reading.rows import axis_frame, decompose
from bodyplan.robot.rows import row_transform
from bodyplan.spatial import matrix_from_pose, matrix_from_quaternion

ANGLES = st.one_of(
    st.floats(-4.0, 4.0),
    st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, 1.5707963, 3.14159, 1e-9, 1e-16, math.pi - 1e-8]),
)
LENGTHS = st.one_of(st.floats(-2.0, 2.0), st.sampled_from([0.0, 1e-17, 1e-12, 1e-6]))


def matrix(position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, position
    return out


def text(links: str = "", joints: str = "", name: str = 'name="test"') -> str:
    return f"<robot {name}>{links}{joints}</robot>"


def link(*names: str) -> str:
    return "".join(f'<link name="{name}"/>' for name in names)


def joint(name: str, parent: str, child: str, kind: str = "revolute", inner: str = "") -> str:
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{inner}</joint>'


def read(tmp_path: Path, content: str, **options: object) -> Robot:
    path = tmp_path / "robot.urdf"
    path.write_text(content, encoding="utf-8")
    return Robot.from_urdf(path, **options)  # type: ignore[arg-type]


# --- rows ---------------------------------------------------------------------------------------------------


@settings(max_examples=400, deadline=None)
@given(st.lists(ANGLES, min_size=3, max_size=3), st.lists(LENGTHS, min_size=3, max_size=3), st.booleans())
def test_any_transform_is_at_most_two_rows_and_a_turn(angles: list[float], place: list[float], proper: bool) -> None:
    rotation = Rotation.from_euler("ZYX" if proper else "ZXZ", angles).as_matrix()
    wanted = matrix(np.array(place), rotation)
    rows, turn, shift = decompose(wanted)
    out = np.eye(4)
    for row in [(r.theta, r.d, r.a, r.epsilon) for r in rows] + [(turn, shift, 0.0, 0.0)]:
        out = out @ matrix(*row_transform(*row))
    np.testing.assert_allclose(out, wanted, rtol=0.0, atol=6e-15)
    assert len(rows) <= 2
    assert shift == 0.0 or not rows


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 1e-3))
def test_an_axis_is_reached_by_one_row(direction: tuple[float, float, float]) -> None:
    axis = np.array(direction) / np.linalg.norm(direction)
    frame, sign = axis_frame(axis)
    np.testing.assert_allclose(sign * frame[:, 2], axis, atol=1e-15)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(frame) > 0.0
    assert len(decompose(matrix(np.zeros(3), frame.T))[0]) <= 1


def test_a_table_that_is_one_already_stays_one(tmp_path: Path) -> None:
    """Joints about z, links along x: a row a joint, and no more."""
    names = [f"l{i}" for i in range(5)]
    origin = '<origin xyz="0.3 0 0" rpy="1.5707963267948966 0 0"/><axis xyz="0 0 1"/>'
    joints = [joint(f"j{i}", names[i], names[i + 1], "continuous", origin) for i in range(4)]
    robot = read(tmp_path, text(link(*names), "".join(joints)))
    assert [row.a for row in robot.elements] == [0.0, 0.3, 0.0, 0.3, 0.0, 0.3, 0.0, 0.3, 0.0]
    assert robot.joints == ("j0", "j1", "j2", "j3")


# --- joints -------------------------------------------------------------------------------------------------


def test_joints_move_as_the_format_says(tmp_path: Path) -> None:
    """Poses by hand: origin, then a turn about the axis or a slide along it, in any direction."""
    rng = np.random.default_rng(1)
    kinds, names = ["revolute", "prismatic", "continuous", "fixed", "prismatic", "revolute"], ["root"]
    joints, steps = [], []
    for i, kind in enumerate(kinds):
        xyz, rpy, axis = rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3), rng.normal(size=3)
        names.append(f"l{i}")
        inner = f'<origin xyz="{" ".join(map(repr, xyz.tolist()))}" rpy="{" ".join(map(repr, rpy.tolist()))}"/>'
        inner += (
            f'<axis xyz="{" ".join(map(repr, axis.tolist()))}"/><limit lower="-2" upper="2" effort="3" velocity="1"/>'
        )
        joints.append(joint(f"j{i}", names[i], names[i + 1], kind, inner))
        steps.append((kind, matrix(xyz, Rotation.from_euler("xyz", rpy).as_matrix()), axis / np.linalg.norm(axis)))
    robot = read(tmp_path, text(link(*names), "".join(joints)))
    q = rng.uniform(-1, 1, robot.n)
    poses, at = robot.forward(dict(zip(robot.joints, q, strict=True))), np.eye(4)
    value = dict(zip(robot.joints, q, strict=True))
    for i, (kind, place, axis) in enumerate(steps):
        moved = np.eye(4)
        if kind in ("revolute", "continuous"):
            moved[:3, :3] = Rotation.from_rotvec(axis * value[f"j{i}"]).as_matrix()
        elif kind == "prismatic":
            moved[:3, 3] = axis * value[f"j{i}"]
        at = at @ place @ moved
        np.testing.assert_allclose(matrix_from_pose(poses[f"l{i}"]), at, rtol=0.0, atol=1e-14)
    assert robot.kinds == ("angle", "length", "angle", "length", "angle")
    assert robot.limits[2].tolist() == [-math.inf, math.inf]
    assert robot.limits[1].tolist() == [-2.0, 2.0]


def test_the_default_axis_is_x(tmp_path: Path) -> None:
    robot = read(tmp_path, text(link("a", "b"), joint("j", "a", "b", "continuous")))
    turned = matrix_from_quaternion(robot.forward([0.3])["b"][3:])
    np.testing.assert_allclose(turned, Rotation.from_euler("x", 0.3).as_matrix(), atol=1e-15)


def test_mimics_follow_also_each_other(tmp_path: Path) -> None:
    limit = '<limit lower="-1" upper="1" effort="2" velocity="3"/><axis xyz="0 -1 0"/>'
    joints = [
        joint("lead", "a", "b", inner=limit),
        joint("half", "b", "c", inner=limit + '<mimic joint="lead" multiplier="0.5" offset="0.1"/>'),
        joint("back", "c", "d", inner=limit + '<mimic joint="half" multiplier="-2" offset="0.4"/>'),
        joint("held", "d", "e", inner=limit + '<mimic joint="lead" multiplier="0" offset="0.7"/>'),
    ]
    content = text(link(*"abcde"), "".join(joints))
    robot = read(tmp_path, content)
    assert robot.joints == ("lead",)
    assert (robot.limits[0].tolist(), robot.efforts[0], robot.rates[0]) == ([-1.0, 1.0], 2.0, 3.0)
    q = 0.37
    angles = [q, 0.5 * q + 0.1, -2.0 * (0.5 * q + 0.1) + 0.4, 0.7]
    end = matrix_from_quaternion(robot.forward([q])["e"][3:])
    np.testing.assert_allclose(end, Rotation.from_euler("y", -sum(angles)).as_matrix(), atol=1e-15)
    assert read(tmp_path, content, mimic=False).joints == ("lead", "half", "back", "held")


def test_limits_that_say_nothing_are_none(tmp_path: Path) -> None:
    limits = [
        '<limit effort="0" velocity="0"/>',
        '<limit lower="-1e31" upper="2" effort="inf" velocity="1"/>',
        '<limit lower="-1e30" upper="1e30" effort="1e30" velocity="1e30"/>',
    ]
    names = [f"l{i}" for i in range(4)]
    robot = read(
        tmp_path,
        text(link(*names), "".join(joint(f"j{i}", names[i], names[i + 1], inner=x) for i, x in enumerate(limits))),
    )
    inf = math.inf
    assert robot.limits.tolist() == [[-inf, inf], [-inf, 2.0], [-inf, inf]]
    assert robot.efforts.tolist() == [inf, inf, inf]
    assert robot.rates.tolist() == [inf, 1.0, inf]


# --- links --------------------------------------------------------------------------------------------------


def test_inertia_is_turned_into_the_axes_of_the_link(tmp_path: Path) -> None:
    inertial = (
        '<inertial><origin xyz="0.1 0.2 0.3" rpy="0.3 -0.4 1.1"/><mass value="2"/>'
        '<inertia ixx="0.1" iyy="0.12" izz="0.15" ixy="0.01" ixz="-0.02" iyz="0.005"/></inertial>'
    )
    massless = '<inertial><mass value="0"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    point = '<inertial><mass value="0.5"/></inertial>'
    links = f'<link name="a">{inertial}</link><link name="b">{massless}</link><link name="c">{point}</link>'
    robot = read(tmp_path, text(links, joint("ab", "a", "b", "fixed") + joint("bc", "b", "c", "fixed")))
    R = Rotation.from_euler("xyz", [0.3, -0.4, 1.1]).as_matrix()
    own = np.array([[0.1, 0.01, -0.02], [0.01, 0.12, 0.005], [-0.02, 0.005, 0.15]])
    body = robot.base_body
    assert body is not None and body.inertia is not None
    assert (body.mass, body.com) == (2.0, (0.1, 0.2, 0.3))
    xx, yy, zz, xy, xz, yz = body.inertia
    np.testing.assert_allclose([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], R @ own @ R.T, atol=1e-16)
    assert [e.body and e.body.mass for e in robot.elements] == [None, None, 0.5]


def collision(geometry: str, origin: str = "", name: str = "") -> str:
    return f"<collision{f' name={name!r}' if name else ''}>{origin}<geometry>{geometry}</geometry></collision>"


def test_shapes(tmp_path: Path) -> None:
    quarter = '<origin xyz="1 0 0" rpy="1.5707963267948966 0 0"/>'
    shapes = [
        collision('<box size="2 4 6"/>', quarter),
        collision('<box size="2 4 6"/>', '<origin rpy="0.3 0.2 0.1"/>', "turned"),
        collision('<cylinder radius="0.1" length="1"/>', quarter, "long"),
        collision('<cylinder radius="0.5" length="0.1"/>', '<origin rpy="0 0 1"/>', "disc"),
        collision('<cylinder radius="0.5" length="0.1"/>', quarter, "wheel"),
        collision('<cylinder radius="0.5" length="1"/>', "", "stub"),
        collision('<capsule radius="0.1" length="1"/>', "", "pill"),
        collision('<sphere radius="0.2"/>', '<origin xyz="0 0 0.5"/>', "ball"),
        collision('<mesh filename="package://x/y.stl"/>', "", "mesh"),
    ]
    tube = [
        collision(
            '<cylinder radius="0.1" length="0.8"/>', '<origin xyz="0.4 0 0" rpy="0 1.5707963267948966 0"/>', "rod"
        ),
        collision('<sphere radius="0.1"/>', "", "rod1"),
        collision('<sphere radius="0.1"/>', '<origin xyz="0.8 0 0"/>', "rod2"),
    ]
    links = f'<link name="root">{"".join(shapes)}</link><link name="arm">{"".join(tube)}</link>'
    robot = read(tmp_path, text(links, joint("j", "root", "arm", "continuous")))
    found = {c.name: c for c in robot.contacts}
    assert list(found) == ["root", "turned", "long", "disc", "wheel", "stub", "pill", "ball", "rod"]
    assert (found["root"].half, found["root"].start, found["root"].frame) == ((1.0, 3.0, 2.0), (1.0, 0.0, 0.0), "base")
    poses = robot.forward([0.0])
    assert found["turned"].half == (1.0, 2.0, 3.0)
    turned = matrix_from_quaternion(poses[found["turned"].frame][3:])
    np.testing.assert_allclose(turned, Rotation.from_euler("xyz", [0.3, 0.2, 0.1]).as_matrix(), atol=1e-15)
    # a capsule in the cylinder, from end to end of it
    assert (found["long"].shape, found["long"].radius) == ("capsule", 0.1)
    np.testing.assert_allclose([found["long"].start, found["long"].end], [[1, 0.4, 0], [1, -0.4, 0]], atol=1e-15)
    assert (found["disc"].shape, found["disc"].frame) == ("rim", "base")
    axle = matrix_from_quaternion(poses[found["wheel"].frame][3:])[:, 2]
    np.testing.assert_allclose(axle, [0.0, -1.0, 0.0], atol=1e-15)
    assert found["stub"].shape == "sphere"
    np.testing.assert_allclose([found["pill"].start, found["pill"].end], [[0, 0, -0.5], [0, 0, 0.5]], atol=1e-16)
    assert (found["ball"].shape, found["ball"].start) == ("sphere", (0.0, 0.0, 0.5))
    # a cylinder with a ball on either end is the capsule that the format cannot say
    assert (found["rod"].shape, found["rod"].frame) == ("capsule", "arm")
    np.testing.assert_allclose([found["rod"].start, found["rod"].end], [[0, 0, 0], [0.8, 0, 0]], atol=1e-15)


def test_names_that_a_robot_keeps_for_itself(tmp_path: Path) -> None:
    content = text(
        link("foot/base", "base", "world", "tip"),
        joint("a", "foot/base", "base", "fixed")
        + joint("x/b", "base", "world", "continuous")
        + joint("c", "world", "tip", "fixed"),
    )
    robot = read(tmp_path, content)
    assert [f for f in robot.frames if ".row" not in f] == ["base", "foot.base", "base.link", "world.link", "tip"]
    assert robot.joints == ("x.b",)
    # a root that has the name of the base is the base
    assert read(tmp_path, text(link("base", "tip"), joint("a", "base", "tip", "fixed"))).frames == ("base", "tip")
    assert read(tmp_path, text(link("only"), name="")).name == "robot"


def test_branches_are_chains_and_the_longest_goes_on(tmp_path: Path) -> None:
    joints = [
        joint("a1", "root", "arm", "continuous"),
        joint("s", "arm", "sensor", "fixed"),
        joint("a2", "arm", "hand", "continuous"),
        joint("l", "root", "leg", "continuous"),
    ]
    robot = read(tmp_path, text(link("root", "arm", "sensor", "hand", "leg"), "".join(joints)))
    assert [(c.name, c.parent) for c in robot.chains] == [("hand", "base"), ("sensor", "arm"), ("leg", "base")]
    assert robot.joints == ("a1", "a2", "l")


def test_a_root_that_floats_on_the_world(tmp_path: Path) -> None:
    floating = joint("free", "world", "trunk", "floating") + joint("j", "trunk", "leg", "continuous")
    robot = read(tmp_path, text(link("world", "trunk", "leg"), floating))
    assert robot.frames[:2] == ("base", "trunk") and robot.joints == ("j",)
    with pytest.raises(InputError, match="joint 'j': is floating"):
        read(tmp_path, text(link("a", "b"), joint("i", "a", "b", "fixed")).replace("</robot>", "")
             + link("c") + joint("j", "b", "c", "floating") + "</robot>")  # fmt: skip


# --- refused ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<robot", "is not XML"),
        ("<sdf/>", "is not URDF: the first element is <sdf>"),
        (text(), "has no links"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot>&a;</robot>', "defines entities"),
        ('<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:macro name="m"/></robot>', "xacro macros"),
        (text(link("a", "a")), "two links are named 'a'"),
        (text("<link/>"), "a <link> has no name"),
        (text(link("a", "b")), "has 2 roots, links that hang on no other: 'a', 'b'"),
        (text(link("a", "b"), joint("j", "a", "c")), "joint 'j', child: unknown link 'c'"),
        (text(link("a", "b"), '<joint name="j" type="fixed"><child link="b"/></joint>'), "joint 'j': names no parent"),
        (text(link("a", "b"), joint("j", "a", "b", "ball")), "joint 'j': unknown type 'ball'"),
        (text(link("a", "b"), joint("j", "a", "b", "planar")), "joint 'j': is planar"),
        (text(link("a", "b"), joint("i", "a", "b") + joint("j", "b", "a")), "every link hangs on another"),
        (
            text(link(*"abc"), joint("h", "b", "c", "fixed") + joint("i", "c", "b", "fixed")),
            "links 'b', 'c': hang on each other in a closed loop",
        ),
        (
            text(link(*"abc"), joint("h", "a", "b") + joint("i", "a", "c") + joint("j", "b", "c")),
            "link 'c': is the child of joints 'i' and 'j'",
        ),
        (text(link(*"ab"), joint("j", "a", "b", inner='<axis xyz="0 0 0"/>')), "joint 'j', axis: must not be zero"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<axis xyz="0 1"/>')), "'j', axis: xyz must be three numbers"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<origin rpy="0 0 nan"/>')), "joint 'j', origin: rpy must be"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<limit lower="2" upper="1"/>')), "lower 2.0 is above upper 1.0"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<limit lower="x"/>')), "'j', limit: lower must be a number"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<mimic joint="k"/>')), "mimic: unknown moving joint 'k'"),
        (text(link(*"ab"), joint("j", "a", "b", inner='<mimic joint="j"/>')), "joints 'j' mimic each other"),
        (
            text(link(*"abc"), joint("i", "a", "b", inner='<mimic joint="j"/>')
                 + joint("j", "b", "c", inner='<mimic joint="i"/>')),
            "mimic each other",
        ),
        (
            text(link(*"abc"), joint("i", "a", "b") + joint("j", "b", "c", "prismatic", '<mimic joint="i"/>')),
            "one of 'j' and 'i' turns and the other one slides",
        ),
        (text('<link name="a"><inertial><mass value="-1"/></inertial></link>'), "link 'a', inertial: mass must be"),
        (text('<link name="a"><inertial><mass/></inertial></link>'), "link 'a', inertial: value must be a number"),
        (text(f'<link name="a">{collision("<sphere/>")}</link>'), "link 'a', collision 1: radius must be a number"),
        (text(link("a, b")), "a name must be"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(InputError, match=message.replace("(", r"\(")) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(str(tmp_path / "robot.urdf"))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        Robot.from_urdf(tmp_path / "nothing.urdf")


# --- missions, command line ---------------------------------------------------------------------------------


def test_missions_and_commands_take_it(tmp_path: Path) -> None:
    joints = "".join(joint(f"j{i}", f"l{i}", f"l{i + 1}", "continuous", '<axis xyz="0 0 1"/>') for i in range(3))
    (tmp_path / "arm.urdf").write_text(text(link("l0", "l1", "l2", "l3"), joints, 'name="arm"'), encoding="utf-8")
    mission = tmp_path / "m.toml"
    mission.write_text(
        'title = "x"\ngait = { kind = "crawl" }\nground = { kind = "plane" }\n'
        'robot = { kind = "urdf", file = "arm.urdf" }\n',
        encoding="utf-8",
    )
    assert load_mission(mission).robot == Robot.from_urdf(tmp_path / "arm.urdf")
    out = CliRunner().invoke(app, ["model", str(tmp_path / "arm.urdf")])
    assert out.exit_code == 0 and out.output.startswith("arm: 1 chain")
    with pytest.raises(UnknownNameError, match=r"file ending in .csv, .toml, .urdf, .xml"):
        from bodyplan.missions.robot_input import load_robot

        load_robot("arm.sdf")
