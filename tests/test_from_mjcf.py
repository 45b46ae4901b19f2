"""MJCF, read: kinematics, masses and limits are those of MuJoCo."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import bodyplan as bp
from bodyplan.missions import load_mission
from bodyplan.robot import Joint, Robot, Row
from bodyplan.robot.masses import center_of_mass
from bodyplan.spatial import quaternion_exp
from urdf_cases import off, random_q

MODELS = (
    "ant.xml",
    "half_cheetah.xml",
    "hopper.xml",
    "humanoid.xml",
    "inverted_double_pendulum.xml",
    "pusher_v5.xml",
    "reacher.xml",
    "swimmer.xml",
    "walker2d_v5.xml",
)


def asset(name: str) -> Path:
    found = importlib.util.find_spec("gymnasium")
    if found is None or found.origin is None:
        pytest.skip("the package gymnasium is not installed")
    return Path(found.origin).parent / "envs/mujoco/assets" / name


def written(tmp_path: Path, inside: str, more: str = "") -> Path:
    path = tmp_path / "robot.xml"
    path.write_text(
        f'<mujoco model="test"><compiler angle="radian"/><worldbody>{inside}</worldbody>{more}</mujoco>',
        encoding="utf-8",
    )
    return path


def compare(path: Path, values: dict[str, tuple[str, float, float]] | None = None, seed: int = 0) -> Robot:
    """Poses, Jacobians and the centre of mass of every body; ``values``: (leader, factor, offset) of joints that
    follow others."""
    robot, rng = Robot.from_mjcf(path), np.random.default_rng(seed)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    free = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    lines = {model.joint(j).name: (model.joint(j).name, 1.0, 0.0) for j in range(model.njnt) if j not in free}
    lines |= values or {}
    assert set(robot.joints) == {leader for leader, _, _ in lines.values()}
    for _ in range(2):
        q = random_q(robot, rng)
        value = dict(zip(robot.joints, q, strict=True))
        base = None
        if free:
            base = np.concatenate([rng.uniform(-1, 1, 3), quaternion_exp(rng.uniform(-2, 2, 3))])
            data.qpos[:7] = base
        for name, (leader, factor, offset) in lines.items():
            data.joint(name).qpos[0] = offset + factor * value[leader]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        poses = robot.forward(q, base)
        jacp, jacr = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        for i in range(1, model.nbody):
            frame, R = model.body(i).name or f"body{i}", data.xmat[i].reshape(3, 3)
            assert off(poses[frame], data.xpos[i], R) < 1e-13
            mujoco.mj_jacBody(model, data, jacp, jacr, i)
            expected = np.zeros((6, robot.n))
            for name, (leader, factor, _) in lines.items():
                column = model.joint(name).dofadr[0]
                both = np.concatenate([R.T @ jacp[:, column], R.T @ jacr[:, column]])
                expected[:, robot.joint_index(leader)] += factor * both
            np.testing.assert_allclose(robot.jacobian(q, frame), expected, rtol=0.0, atol=1e-13)
        inside = np.arange(1, model.nbody)
        assert robot.mass == pytest.approx(model.body_mass[inside].sum(), rel=1e-14)
        centre = model.body_mass[inside] @ data.xipos[inside] / model.body_mass[inside].sum()
        np.testing.assert_allclose(center_of_mass(robot, q, base), centre, rtol=0.0, atol=1e-13)
    return robot


# MuJoCo warns of words that these files use
@pytest.mark.filterwarnings("ignore:compiler attribute:UserWarning")
@pytest.mark.parametrize("name", MODELS)
def test_models_of_gymnasium(name: str) -> None:
    robot, model = compare(asset(name)), mujoco.MjModel.from_xml_path(str(asset(name)))
    for j, joint in enumerate(robot.joints):
        at = model.joint(joint).id
        expected = model.jnt_range[at] if model.jnt_limited[at] else (-np.inf, np.inf)
        np.testing.assert_array_equal(robot.limits[j], expected)
    driven = {model.joint(int(model.actuator_trnid[a, 0])).name: a for a in range(model.nu)}
    assert {name for name, yes in zip(robot.joints, robot.actuated, strict=True) if yes} == set(driven)
    for joint, a in driven.items():  # motors: gear times the largest control
        assert robot.efforts[robot.joint_index(joint)] == model.actuator_gear[a, 0] * model.actuator_ctrlrange[a].max()


def test_inertia_is_that_of_mujoco() -> None:
    path = asset("humanoid.xml")
    robot, model = Robot.from_mjcf(path), mujoco.MjModel.from_xml_path(str(path))
    bodies = dict(zip(robot.frames, [robot.base_body, *(e.body for e in robot.elements)], strict=True))
    for i in range(2, model.nbody):
        body = bodies[model.body(i).name]
        assert body is not None and body.inertia is not None
        xx, yy, zz, xy, xz, yz = body.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        np.testing.assert_allclose(np.linalg.eigvalsh(tensor), np.sort(model.body_inertia[i]), rtol=1e-12)


def test_geoms_that_touch_are_contacts() -> None:
    robot, model = Robot.from_mjcf(asset("ant.xml")), mujoco.MjModel.from_xml_path(str(asset("ant.xml")))
    contacts = {c.name: c for c in robot.contacts}
    assert contacts["torso_geom"].shape == "sphere" and contacts["torso_geom"].frame == "base"
    ankle = model.geom("left_ankle_geom")
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, ankle.quat)
    reach = ankle.size[1] * R.reshape(3, 3)[:, 2]
    ends = np.array([contacts["left_ankle_geom"].start, contacts["left_ankle_geom"].end])
    np.testing.assert_allclose(ends, [ankle.pos - reach, ankle.pos + reach], rtol=0.0, atol=1e-15)
    assert contacts["left_ankle_geom"].friction == ankle.friction[0]


# --- what the format can say --------------------------------------------------------------------------------

GEOM = '<geom size="0.1" mass="1"/>'


def body(name: str, joints: str = "", inner: str = "", place: str = 'pos="0.1 0.2 0.3" euler="0.3 -0.2 0.1"') -> str:
    return f'<body name="{name}" {place}>{GEOM}{joints}{inner}</body>'


def test_several_joints_on_one_body_each_about_its_own_point(tmp_path: Path) -> None:
    joints = (
        '<joint name="x" axis="1 2 3" pos="0.1 0 0.2" ref="0.4"/>'
        '<joint name="y" type="slide" axis="0 1 1" ref="-0.3"/>'
        '<joint name="z" axis="-1 0 1" pos="0 0.3 0" range="-1 2"/>'
    )
    robot = compare(written(tmp_path, body("trunk", '<freejoint name="free"/>', body("arm", joints, body("hand")))))
    assert robot.joints == ("x", "y", "z") and robot.kinds == ("angle", "length", "angle")
    assert robot.limits[2].tolist() == [-1.0, 2.0]


def test_joints_about_one_axis_share_a_row(tmp_path: Path) -> None:
    joints = '<joint name="turn" axis="0 0 1"/><joint name="lift" type="slide" axis="0 0 -1"/>'
    robot = compare(written(tmp_path, body("arm", joints, place='pos="0.1 0 0"')))
    assert next(row for row in robot.elements if isinstance(row, Row) and isinstance(row.theta, Joint)).d == Joint(
        "lift", scale=-1.0
    )


def test_without_a_free_joint_the_base_is_the_world(tmp_path: Path) -> None:
    robot = compare(written(tmp_path, body("one", '<joint name="a"/>') + body("two", '<joint name="b" axis="1 0 0"/>')))
    assert [(c.name, c.parent) for c in robot.chains] == [("one", "base"), ("two", "base")]
    assert robot.base_body is None


def test_joints_that_equality_constraints_couple(tmp_path: Path) -> None:
    chain = body("a", '<joint name="lead" ref="0.2"/>', body("b", '<joint name="half" ref="0.1"/>', body(
        "c", '<joint name="back" axis="1 0 0"/>')))  # fmt: skip
    more = (
        '<equality><joint joint1="half" joint2="lead" polycoef="0.3 0.5 0 0 0"/>'
        '<joint joint1="back" joint2="half" polycoef="0 -2 0 0 0"/></equality>'
    )
    # half - 0.1 = 0.3 + 0.5 (lead - 0.2); back = -2 (half - 0.1)
    lines = {"half": ("lead", 0.5, 0.3), "back": ("lead", -1.0, -0.4)}
    robot = compare(written(tmp_path, chain, more), lines)
    assert robot.joints == ("lead",)


def test_a_tendon_over_several_joints_couples_them(tmp_path: Path) -> None:
    chain = body("a", '<joint name="p"/>', body("b", '<joint name="q" axis="0 1 0"/>', body(
        "c", '<joint name="r" axis="1 1 0"/>')))  # fmt: skip
    tendon = '<tendon><fixed name="t"><joint joint="p" coef="1"/><joint joint="q" coef="2"/><joint joint="r" coef="4"/>'
    path = written(tmp_path, chain, tendon + '</fixed></tendon><equality><tendon tendon1="t"/></equality>')
    robot, model = Robot.from_mjcf(path), mujoco.MjModel.from_xml_path(str(path))
    assert robot.joints == ("p", "q")
    data = mujoco.MjData(model)
    data.qpos[:] = [0.3, -0.8, -(0.3 - 1.6) / 4]
    mujoco.mj_kinematics(model, data)
    assert off(robot.forward([0.3, -0.8])["c"], data.body("c").xpos, data.body("c").xmat.reshape(3, 3)) < 1e-15


def test_a_joint_held_by_a_constraint_is_none(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        body("a", '<joint name="held" ref="0.2"/>', body("b", '<joint name="j"/>')),
        '<equality><joint joint1="held" polycoef="0.3 0 0 0 0"/></equality>',
    )
    robot, model = Robot.from_mjcf(path), mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = [0.5, 0.7]
    mujoco.mj_kinematics(model, data)
    assert robot.joints == ("j",)
    assert off(robot.forward([0.7])["b"], data.body("b").xpos, data.body("b").xmat.reshape(3, 3)) < 1e-15


DOG = body("dog", "<freejoint/>", body("leg", '<joint name="j"/>'))


def test_one_of_several_robots(tmp_path: Path) -> None:
    path = written(
        tmp_path, body("dog", "<freejoint/>", body("leg", '<joint name="j"/>')) + body("ball", "<freejoint/>")
    )
    with pytest.raises(bp.InputError, match="several bodies that move by themselves, 'dog', 'ball'; say with root"):
        Robot.from_mjcf(path)
    dog = Robot.from_mjcf(path, root="dog")
    assert dog.joints == ("j",) and dog.mass == pytest.approx(2.0) and "ball" not in dog.frames
    assert Robot.from_mjcf(path, root="ball").n == 0
    with pytest.raises(bp.UnknownNameError, match="unknown body on the world 'leg'"):
        Robot.from_mjcf(path, root="leg")


def test_missing_meshes_are_done_without(tmp_path: Path) -> None:
    assets = '<asset><mesh name="m" file="nowhere.stl"/><texture name="t" type="2d" file="no.png"/>'
    assets += '<material name="skin" texture="t"/></asset>'
    mesh = '<geom type="mesh" mesh="m" material="skin"/>'
    inertial = '<inertial pos="0 0 0.1" mass="3" diaginertia="0.1 0.1 0.1"/>'
    inside = (
        f'<body name="a"><freejoint/>{mesh}{inertial}<body name="b" pos="1 0 0"><joint name="j"/>{mesh}</body></body>'
    )
    robot = Robot.from_mjcf(written(tmp_path, inside, assets))
    assert robot.joints == ("j",) and robot.mass == 3.0 and robot.contacts == ()


@pytest.mark.parametrize(
    ("inside", "more", "message"),
    [
        (body("a", '<joint name="j" type="ball"/>'), "", "joint 'j': is a ball joint"),
        ("", "", "has no bodies"),
        ("<body><joint/></body>", "", "MuJoCo cannot read it"),
        (body("a") + "<bodi/>", "", "MuJoCo cannot read it: .*bodi"),
        (
            body("a", '<joint name="i"/>', body("b", '<joint name="j"/>')),
            '<equality><joint name="e" joint1="j" joint2="i" polycoef="0 1 1 0 0"/></equality>',
            "equality 'e': joint 'j' must follow by a straight line",
        ),
        (
            body("a", '<joint name="i"/>', body("b", '<joint name="j"/>')),
            '<equality><connect name="e" body1="b" body2="a" anchor="0 0 0"/></equality>',
            "equality 'e': connects bodies to a closed loop",
        ),
        (
            body("a", '<joint name="i"/>', body("b", '<joint name="j" type="slide"/>')),
            '<equality><joint joint1="j" joint2="i"/></equality>',
            "joint 'j': follows 'i', but one of both turns",
        ),
        (
            body("a", '<joint name="i"/>', body("b", '<joint name="j"/>')),
            '<equality><joint joint1="j" joint2="i"/><joint joint1="i" joint2="j"/></equality>',
            "make them follow each other",
        ),
    ],
)
def test_what_cannot_be_read_is_said(tmp_path: Path, inside: str, more: str, message: str) -> None:
    with pytest.raises(bp.InputError, match=message):
        Robot.from_mjcf(written(tmp_path, inside, more))


# --- ours, written and read back ----------------------------------------------------------------------------

OURS = {
    "straight": lambda: bp.snake(6, 0.1),
    "double": lambda: bp.snake(4, 0.1, joint="double"),
    "alternating": lambda: bp.snake(6, 0.1, axes="alternating"),
    "universal": lambda: bp.snake(5, 0.1, axes="universal"),
    "silo4": bp.silo4,
    "hexapod": bp.hexapod,
}


@pytest.mark.parametrize("name", OURS)
def test_our_own_file_is_the_robot_again(name: str, tmp_path: Path) -> None:
    robot: Robot = OURS[name]()
    path = tmp_path / "robot.xml"
    bp.export.format_of(path).writer(robot, path)
    back: Any = Robot.from_mjcf(path)
    assert back.n == robot.n
    q = random_q(robot, np.random.default_rng(3))
    # a file names the first of several joints by the variable that it drives, in its own measure
    values = {}
    for joint, value in zip(robot.joints, q, strict=True):
        mine = next(n for n in back.joints if n.partition("@")[0] == joint)
        drives = (getattr(e, f) for e in robot.elements for f in e.VARIABLES)
        scale = next(v.scale for v in drives if isinstance(v, Joint) and v.name == joint)
        values[mine] = value if mine == joint and scale == 1.0 else scale * value
    for frame in robot.frames:
        np.testing.assert_allclose(back.forward(values)[frame], robot.forward(q)[frame], rtol=0.0, atol=1e-12)
    assert {c.name for c in back.contacts} == {c.name for c in robot.contacts}
    assert back.mass == pytest.approx(robot.mass, rel=1e-9)


def test_missions_take_it(tmp_path: Path) -> None:
    bp.export.format_of("x.xml").writer(bp.silo4(), tmp_path / "legs.xml")
    mission = tmp_path / "m.toml"
    mission.write_text(
        'title = "x"\ngait = { kind = "crawl" }\nground = { kind = "plane" }\n'
        'robot = { kind = "mjcf", file = "legs.xml" }\n',
        encoding="utf-8",
    )
    assert load_mission(mission).robot == Robot.from_mjcf(tmp_path / "legs.xml")
