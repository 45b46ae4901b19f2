"""Robots people have, from their URDF: kinematics and masses are those of Pinocchio."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.robot import Contact, Robot
from bodyplan.robot.masses import center_of_mass
from urdf_cases import Reference, data_file, mimics, off, random_q

#: file, joints of the robot that remain when followers follow
MODELS = {
    "ur5_robot.urdf": 6,
    "panda.urdf": 8,
    "kinova.urdf": 6,
    "solo12.urdf": 12,
    "hyq_no_sensors.urdf": 12,
    "a1.urdf": 12,
    "anymal-kinova.urdf": 18,
    "talos_left_arm.urdf": 7,
    "talos_reduced.urdf": 32,
    "talos_full_v2.urdf": 32,
    "romeo.urdf": 33,
    "tiago.urdf": 48,
    "icub.urdf": 32,
    "pr2.urdf": 20,
    "double_pendulum_continuous.urdf": 2,
    "xarm7.urdf": 7,
    "quadrotor_base.urdf": 0,
}


def frame_of(link: str, robot: Robot) -> str:
    """ "base" and "world" are the robot's own words for its base."""
    root = robot.frames[1] if len(robot.frames) > 1 else "base"
    if link in ("base", "world") and f"{link}.link" in robot.frames:
        return f"{link}.link"
    return link if link in robot.frames else root if link == root else "base"


@pytest.mark.parametrize("name", MODELS)
def test_poses_jacobians_and_masses_of_every_link(name: str) -> None:
    path = data_file(name)
    reference = Reference(path)
    robot = Robot.from_urdf(path)
    followers = mimics(path)
    assert set(robot.joints) == set(reference.model.names[2:]) - set(followers)
    assert robot.n == MODELS[name]
    rng = np.random.default_rng(len(name))
    for _ in range(2):
        q = random_q(robot, rng)
        reference.set(dict(zip(robot.joints, q, strict=True)))
        poses = robot.forward(q)
        frames = {link: frame_of(link, robot) for link in reference.links()}
        assert len(set(frames.values())) == len(frames)
        for link, frame in frames.items():
            assert off(poses[frame], *reference.pose(link)) < 1e-13
            if robot.n and frame != "base":
                expected = reference.jacobian(link, robot.joints)
                np.testing.assert_allclose(robot.jacobian(q, frame), expected, rtol=0.0, atol=1e-13)
        pin, data = reference.pin, reference.data
        assert robot.mass == pytest.approx(pin.computeTotalMass(reference.model), rel=1e-13)
        centre = pin.centerOfMass(reference.model, data, reference.at)
        np.testing.assert_allclose(center_of_mass(robot, q), centre, rtol=0.0, atol=1e-13)


def test_limits_rates_and_efforts_are_those_of_pinocchio() -> None:
    reference = Reference(data_file("ur5_robot.urdf"))
    robot, model = Robot.from_urdf(reference.path), reference.model
    for j, name in enumerate(robot.joints):
        joint = model.joints[model.getJointId(name)]
        pair = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
        np.testing.assert_array_equal(robot.limits[j], pair)
        assert robot.efforts[j] == model.effortLimit[joint.idx_v]
        assert robot.rates[j] == model.velocityLimit[joint.idx_v]


def test_the_inertia_of_the_whole_is_that_of_pinocchio() -> None:
    """The locked inertia about the base: masses, centres and inertia tensors of all links at once."""
    reference = Reference(data_file("anymal-kinova.urdf"))
    robot = Robot.from_urdf(reference.path)
    q = random_q(robot, np.random.default_rng(4))
    reference.set(dict(zip(robot.joints, q, strict=True)))
    poses = robot.forward(q)
    total = np.zeros((3, 3))
    for frame, body in zip(robot.frames, [robot.base_body, *(e.body for e in robot.elements)], strict=True):
        if body is not None:
            xx, yy, zz, xy, xz, yz = body.inertia or (0.0,) * 6
            R = bp.spatial.matrix_from_quaternion(poses[frame][3:])
            c = poses[frame][:3] + R @ body.com
            total += R @ [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] @ R.T + body.mass * (
                c @ c * np.eye(3) - np.outer(c, c)
            )
    locked = reference.pin.crba(reference.model, reference.data, reference.at)[3:6, 3:6]
    np.testing.assert_allclose(total, locked, rtol=0.0, atol=1e-12)


def test_collision_shapes_become_contacts_where_they_are() -> None:
    """The feet of A1 are balls, its legs boxes and cylinders, some of them turned."""
    robot = Robot.from_urdf(data_file("a1.urdf"))
    feet = {c.frame: c for c in robot.contacts if c.shape == "sphere"}
    assert set(feet) == {"FL_foot", "FR_foot", "RL_foot", "RR_foot"}
    assert all(foot.radius == 0.02 and foot.start == (0.0, 0.0, 0.0) for foot in feet.values())
    trunk = next(c for c in robot.contacts if c.frame == "trunk" and c.shape == "box" and max(c.half) > 0.1)
    assert trunk.half == (0.267 / 2, 0.194 / 2, 0.114 / 2)
    assert Robot.from_urdf(data_file("a1.urdf"), contacts=[Contact("toe", "FL_foot", "sphere", 0.03)]).contacts == (
        Contact("toe", "FL_foot", "sphere", 0.03),
    )


@pytest.mark.parametrize(
    ("name", "foot", "radius"),
    [("solo12.urdf", "{}_FOOT", 0.016), ("a1.urdf", "{}_foot", 0.02), ("hyq_no_sensors.urdf", "{}_foot", 0.02)],
)
def test_a_robot_from_its_file_walks(name: str, foot: str, radius: float) -> None:
    """Also where legs hang on a trunk that is fixed on the root, and with sensors about."""
    path = data_file(name)
    legs = {"solo12.urdf": ("FL", "FR", "HL", "HR"), "a1.urdf": ("FL", "FR", "RL", "RR")}
    feet = [foot.format(leg) for leg in legs.get(name, ("lf", "rf", "lh", "rh"))]
    contacts = [Contact(f"{frame}.ball", frame, "sphere", radius) for frame in feet]
    robot = Robot.from_urdf(path, ends=feet, contacts=contacts)
    assert [(chain.name, chain.parent) for chain in robot.chains] == [(frame, "base") for frame in robot_order(robot)]
    motion = bp.plan(robot, bp.Crawl(velocity=(0.02, 0.0)), bp.Plane(), bp.times(0, 6, dt=0.04))
    assert set(motion.status) == {"ok"}
    report = bp.check(motion)
    assert report.ok, str(report)


def robot_order(robot: Robot) -> list[str]:
    """Frames with a ball, in the order of the frames."""
    return sorted((contact.frame for contact in robot.contacts), key=robot.frame_index)


def test_links_without_a_purpose_become_part_of_what_carries_them() -> None:
    """HyQ without its fixed extras: the same kinematics and the same centre of mass."""
    path = data_file("hyq_no_sensors.urdf")
    whole, feet = Robot.from_urdf(path), ["lf_foot", "rf_foot", "lh_foot", "rh_foot"]
    robot = Robot.from_urdf(path, ends=feet)
    assert [chain.name for chain in robot.chains] == feet and len(whole.chains) > 4
    assert robot.mass == pytest.approx(whole.mass, rel=1e-14)
    q = random_q(robot, np.random.default_rng(5))
    values = dict(zip(robot.joints, q, strict=True))
    here, there = robot.forward(values), whole.forward(values)
    for frame in set(robot.frames) & set(whole.frames):
        np.testing.assert_allclose(here[frame], there[frame], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(center_of_mass(robot, q), center_of_mass(whole, values), rtol=0.0, atol=1e-14)
    assert {c.name for c in robot.contacts} == {c.name for c in whole.contacts}
    with pytest.raises(bp.InputError, match="joint 'rh_haa_joint' moves link 'rh_hipassembly', on the way to no end"):
        Robot.from_urdf(path, ends=feet[:3])
    with pytest.raises(bp.UnknownNameError, match=r"ends: unknown link 'lf_fot'. Did you mean 'lf_foot'"):
        Robot.from_urdf(path, ends=["lf_fot"])


def test_merged_inertia_is_that_of_pinocchio() -> None:
    """Pinocchio merges fixed links by itself: inertia of every joint's part."""
    reference = Reference(data_file("a1.urdf"))
    robot = Robot.from_urdf(reference.path, ends=["FL_calf", "FR_calf", "RL_calf", "RR_calf"])
    bodies = dict(zip(robot.frames[1:], (e.body for e in robot.elements), strict=True))
    for leg in ("FL", "FR", "RL", "RR"):
        for link, joint in (("hip", "hip"), ("thigh", "thigh"), ("calf", "calf")):
            body = bodies[f"{leg}_{link}"]
            expected = reference.model.inertias[reference.model.getJointId(f"{leg}_{joint}_joint")]
            assert body is not None and body.inertia is not None
            xx, yy, zz, xy, xz, yz = body.inertia
            assert body.mass == pytest.approx(expected.mass, rel=1e-14)
            np.testing.assert_allclose(body.com, expected.lever, rtol=0.0, atol=1e-15)
            np.testing.assert_allclose(
                [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], expected.inertia, rtol=0.0, atol=1e-15
            )


def test_broken_models_are_refused_by_name() -> None:
    path = data_file("alex_psyonic_hands.urdf")
    with pytest.raises(bp.UnknownNameError, match="'Left_index_q2', mimic: unknown moving joint 'index_q1'"):
        Robot.from_urdf(path)
    assert "Left_index_q2" in Robot.from_urdf(path, mimic=False).joints
    with pytest.raises(bp.InputError, match="no links"):
        Robot.from_urdf(data_file("ur3.urdf"))


def test_nothing_heavy_is_loaded_to_read(tmp_path: Path) -> None:
    import subprocess

    path = data_file("ur5_robot.urdf")
    code = (
        "import sys, bodyplan as bp; bp.Robot.from_urdf(sys.argv[1]);"
        "assert not {'mujoco', 'pinocchio', 'sympy', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, cwd=tmp_path)
