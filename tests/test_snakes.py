"""Snakes of double joints: the paper's formulas, their parts, and ACM-L2."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.motion import Motion
from bodyplan.robot.neighbours import separate_contacts
from bodyplan.robot.snakes import AXES

X, Y, Z = np.eye(3)


def turn(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    k = np.cross(axis, np.eye(3)).T
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def arc(pitch, yaw):
    """Tip (3,) and rotation (3, 3) of an arc of length 1: eqs. (18), (25), (26) as rotations about a fixed axis."""
    size = np.hypot(pitch, yaw)
    axis = np.array([0.0, pitch, yaw]) / size
    aside = np.cross(axis, X)
    return (np.sin(size) * X + (1.0 - np.cos(size)) * aside) / size, turn(axis, size)


def double_angles(pitch, yaw):
    """Eqs. (33), (34), literally."""
    size = np.hypot(pitch, yaw)
    p = 2.0 * np.arcsin(np.sin(size / 2.0) * pitch / size)
    return p, 2.0 * np.arcsin(np.sin(size / 2.0) * yaw / size / np.cos(p / 2.0))


def tip_gap(share, angles):
    """Distance of the tips of a double joint and of an arc, of length 1, bent by the angles (k,)."""
    robot = bp.snake(1, 1.0, "double", end_link=share)
    tips = robot.forward(angles[:, None])["link1"][..., :3]
    return np.hypot(tips[:, 0] - np.sin(angles) / angles, tips[:, 1] - (1.0 - np.cos(angles)) / angles)


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.01, 0.49), st.floats(0.01, 2.0), st.sampled_from(["yaw", "pitch"]))
def test_the_tip_of_one_unit_is_that_of_the_paper(angle, share, length, axis):
    robot = bp.snake(1, length, "double", axes=axis, end_link=share)
    tip = robot.forward([angle])["link1"][:3]
    x = (1.0 - 2.0 * share) * np.cos(angle / 2.0) + share * (1.0 + np.cos(angle))
    y = (1.0 - 2.0 * share) * np.sin(angle / 2.0) + share * np.sin(angle)
    want = [x, y, 0.0] if axis == "yaw" else [x, 0.0, -y]
    assert np.abs(tip - length * np.array(want)).max() < 1e-14 * (1.0 + length)


@settings(deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(AXES))
def test_forward_kinematics_is_the_chain_of_parts(seed, axes):
    rng = np.random.default_rng(seed)
    count, share = int(rng.integers(1, 6)), float(rng.uniform(0.05, 0.45))
    lengths = rng.uniform(0.05, 0.3, count)
    robot = bp.snake(count, lengths, "double", axes=axes, end_link=share)
    q = rng.uniform(-2.0, 2.0, robot.n)
    poses = robot.forward(q)
    angle = dict(zip(robot.joints, q, strict=True))
    at, R = np.zeros(3), np.eye(3)
    for i, length in enumerate(lengths, start=1):
        y, p = angle.get(f"yaw{i}", 0.0), angle.get(f"pitch{i}", 0.0)
        at = at + R @ (share * length * X)
        R = R @ turn(Z, y / 2.0) @ turn(Y, p / 2.0)
        at = at + R @ ((1.0 - 2.0 * share) * length * X)
        assert np.abs(poses[f"middle{i}"][:3] - at).max() < 1e-14
        R = R @ turn(Y, p / 2.0) @ turn(Z, y / 2.0)
        at = at + R @ (share * length * X)
        k = robot.frame_index(f"link{i}")
        assert np.abs(poses.positions[k] - at).max() < 1e-14
        assert np.abs(poses.rotations[k] - R).max() < 1e-14


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_a_unit_turns_by_half_the_yaw_the_pitch_and_half_the_yaw(yaw, pitch):
    robot = bp.snake(1, 0.1, "double", axes="universal")
    rotation = robot.forward({"yaw1": yaw, "pitch1": pitch}).rotations[-1]
    assert np.abs(rotation - turn(Z, yaw / 2.0) @ turn(Y, pitch) @ turn(Z, yaw / 2.0)).max() < 1e-14


@settings(deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.05, 0.45))
def test_the_paper_s_angles_turn_the_end_exactly_like_the_arc(pitch, yaw, share):
    if np.hypot(pitch, yaw) < 1e-6:
        pitch = 1e-6
    robot = bp.snake(1, 1.0, "double", axes="universal", end_link=share)
    p, y = double_angles(pitch, yaw)
    rotation = robot.forward({"yaw1": y, "pitch1": p}).rotations[-1]
    assert np.abs(rotation - arc(pitch, yaw)[1]).max() < 1e-13


def test_tips_within_one_per_cent_of_the_arc():
    angles = np.linspace(1e-3, np.pi / 2.0, 2000)
    assert 0.0099 < tip_gap(0.1531, angles).max() < 0.01
    assert 0.0099 < tip_gap(0.1872, angles).max() < 0.01
    assert tip_gap(0.1872 + 0.0002, angles).max() > 0.01 and tip_gap(0.1531 - 0.0002, angles).max() > 0.01
    # between them the gap is convex in R_s, being that of a line of tips from a point
    assert tip_gap(0.16, angles).max() == pytest.approx(0.0060, abs=5e-5)
    assert tip_gap(0.18, angles).max() == pytest.approx(0.0058, abs=5e-5)
    best = {share: tip_gap(share, angles).max() for share in (0.16945, 0.16955, 0.16965)}
    assert best[0.16955] == pytest.approx(3.6e-4, abs=1e-5) and min(best, key=best.get) == 0.16955


def test_a_sixth_is_simpson_s_rule():
    # the tip is a quadrature of the tangent with nodes at the ends and the middle, weights R_s, 1 - 2 R_s, R_s
    angles = np.array([0.2, 0.4])
    for share, order in ((1.0 / 6.0, 4.0), (0.18, 2.0), (0.15, 2.0)):
        gap = tip_gap(share, angles) / angles  # the sagitta itself is of order 1
        assert np.log2(gap[1] / gap[0]) == pytest.approx(order - 1.0, abs=0.05)


# --- parts, masses, contacts ---


@pytest.mark.parametrize("axes", AXES)
def test_parts_are_joined_at_the_hinges_at_every_bend(axes):
    lengths, share = [0.1, 0.2, 0.15], 0.2
    robot = bp.snake(3, lengths, "double", axes=axes, end_link=share, radius=0.01)
    names = ["tail", "middle1", "link1", "middle2", "link2", "middle3", "link3"]
    assert [c.name for c in robot.contacts] == names
    assert [c.frame for c in robot.contacts] == ["base", *names[1:]]
    q = np.random.default_rng(1).uniform(-1.0, 1.0, robot.n)
    poses = robot.forward(q)
    ends = []
    for contact in robot.contacts:
        k = robot.frame_index(contact.frame)
        ends.append(poses.positions[k] + contact.points() @ poses.rotations[k].T)
    assert np.abs(ends[0][0]).max() == 0.0
    assert np.abs(ends[-1][1] - poses["link3"][:3]).max() < 1e-15
    for (_, front), (rear, _) in itertools.pairwise(ends):
        assert np.abs(front - rear).max() < 1e-15
    sizes = [np.linalg.norm(b - a) for a, b in ends]
    assert np.allclose(sizes, [0.02, 0.06, 0.02 + 0.04, 0.12, 0.04 + 0.03, 0.09, 0.03], rtol=0, atol=1e-15)


def test_mass_is_spread_evenly_along_each_unit():
    lengths, mass = np.array([0.1, 0.2, 0.15]), 0.3
    robot = bp.snake(3, lengths, "double", axes="universal", mass=mass, end_link=0.2)
    assert robot.mass == pytest.approx(0.9, rel=1e-14)
    rest = robot.forward(np.zeros(robot.n))
    bodies = [(0, robot.base_body), *((i + 1, e.body) for i, e in enumerate(robot.elements) if e.body is not None)]
    centre = sum(b.mass * (rest.positions[i] + rest.rotations[i] @ b.com) for i, b in bodies) / robot.mass
    middles = np.cumsum(lengths) - 0.5 * lengths
    assert np.abs(centre - [middles.mean(), 0.0, 0.0]).max() < 1e-15
    # what carries a body also carries the contact of that body
    assert {robot.frames[i] for i, _ in bodies} == {c.frame for c in robot.contacts}


@pytest.mark.parametrize("axes", AXES)
def test_double_joints_have_n_bends_and_upright_frames(axes):
    robot = bp.snake(4, 0.1, "double", axes=axes, limits=(-1, 1), rate=2.0, effort=0.5)
    assert (
        robot.joints
        == {
            "yaw": ("yaw1", "yaw2", "yaw3", "yaw4"),
            "pitch": ("pitch1", "pitch2", "pitch3", "pitch4"),
            "alternating": ("yaw1", "pitch2", "yaw3", "pitch4"),
            "universal": tuple(f"{a}{i}" for i in range(1, 5) for a in ("yaw", "pitch")),
        }[axes]
    )
    assert np.array_equal(robot.limits, np.tile([-1.0, 1.0], (robot.n, 1))) and (robot.efforts == 0.5).all()
    rest = robot.forward(np.zeros(robot.n))
    for i in range(1, 5):
        k = robot.frame_index(f"link{i}")
        assert np.abs(rest.positions[k] - [0.1 * i, 0.0, 0.0]).max() < 1e-15
        assert np.abs(rest.rotations[k] - np.eye(3)).max() < 1e-15


@pytest.mark.parametrize("axes", AXES)
def test_round_trips(axes, tmp_path):
    robot = bp.snake(3, [0.1, 0.2, 0.15], "double", axes=axes, end_link=0.17, limits=(-1.2, 1.2), friction=0.3)
    assert bp.Robot.from_dict(robot.to_dict()) == robot
    robot.to_toml(tmp_path / "snake.toml")
    assert bp.Robot.from_toml(tmp_path / "snake.toml") == robot


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"joint": "straight"}, 'end_link: only joint="double".*straight'),
        ({"joint": "arc"}, "end_link.*arc"),
        ({"end_link": 0.0}, "end_link.*> 0.0 and < 0.5"),
        ({"end_link": 0.5}, "end_link"),
        ({"end_link": 1.8}, "end_link"),
        ({"end_link": np.nan}, "end_link"),
        ({"end_link": "0.18"}, "end_link"),
        ({"joint": "doubled"}, "arc, double, straight"),
        ({"mass": 0.0}, "mass"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(bp.InputError, match=message):
        bp.snake(**{"links": 3, "link_length": 0.1, "joint": "double", "end_link": 0.18, **arguments})


# --- neighbours ---


def still(robot, q):
    t = np.linspace(0.0, 1.0, 60)
    shape = np.tile(np.asarray(q, dtype=float), (60, 1))
    base = np.tile([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], (60, 1))
    zero = np.zeros_like(shape)
    return Motion(robot, bp.Plane(), {}, t, base, shape, zero, zero, np.zeros(60), np.full(60, "ok"))


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("joint", ["straight", "arc", "double"])
@pytest.mark.parametrize("radius", [None, 0.055])
def test_a_straight_snake_is_clear_of_itself(joint, axes, radius):
    robot = bp.snake(6, 0.1, joint, axes=axes, radius=radius)
    report = bp.check(still(robot, np.zeros(robot.n)))
    assert report.ok, report.failures


def test_a_bent_snake_is_clear_of_itself_and_a_folded_one_is_not():
    robot = bp.acm_l2()
    bend = np.radians(60.0) * np.sin(2.0 * np.pi * np.arange(9) / 8.0)
    q = np.zeros(18)
    q[::2] = bend
    assert bp.check(still(robot, q)).ok
    q[::2] = np.radians(75.0)  # a closed loop
    failures = bp.check(still(robot, q)).failures
    assert {line.kind for line in failures} == {"self"}


def test_which_shapes_are_neighbours():
    robot = bp.snake(3, 0.1, "double", end_link=0.2, radius=0.029)
    names = [c.name for c in robot.contacts]
    apart = {(names[i], names[j]) for i, j in separate_contacts(robot)}
    # 60 mm of middle link between end links: more than two radii, 58 mm; 40 mm between middle links: less
    assert ("tail", "link1") in apart and ("link1", "link2") in apart
    assert ("middle1", "middle2") not in apart and ("middle1", "link1") not in apart
    assert ("middle1", "link2") in apart and ("middle1", "middle3") in apart
    thick = bp.snake(3, 0.1, "double", end_link=0.2, radius=0.031)
    assert ("link1", "link2") not in {(names[i], names[j]) for i, j in separate_contacts(thick)}


def test_shapes_on_two_branches_are_neighbours_only_where_they_cannot_be_apart():
    def limbs(width, radius):
        rows = {
            f"leg{k}": [bp.Row(theta=side * np.pi / 2.0, a=width, name=f"mount{k}"),
                        bp.Row(theta=bp.Joint(f"hip{k}"), a=0.2, name=f"foot{k}")]
            for k, side in ((1, 1.0), (2, -1.0))
        }  # fmt: skip
        contacts = [bp.Contact(f"c{k}", f"foot{k}", "capsule", radius, start=(-0.2, 0, 0)) for k in (1, 2)]
        return bp.Robot.from_rows(rows, contacts=contacts)

    assert separate_contacts(limbs(0.1, 0.05)) == [(0, 1)]
    assert separate_contacts(limbs(0.04, 0.05)) == []


# --- ACM-L2 ---


def test_acm_l2_is_that_of_table_1():
    robot = bp.acm_l2()
    assert robot.n == 18 and robot.joints[:2] == ("yaw1", "pitch1")
    assert robot.mass == pytest.approx(0.99, rel=1e-12)
    assert np.allclose(np.degrees(robot.limits), [-75.0, 75.0], rtol=1e-14, atol=0)
    assert (robot.efforts == 0.5).all() and {c.radius for c in robot.contacts} == {0.025}
    rest = robot.forward(np.zeros(18))
    assert rest["link9"][0] == pytest.approx(9 * 0.078, rel=1e-14)
    ends = [rest[c.frame][0] + np.array([c.start[0], c.end[0]]) for c in robot.contacts]
    assert np.max(ends) - np.min(ends) == pytest.approx(0.8, rel=1e-12)
    assert rest["middle1"][0] == pytest.approx(0.82 * 0.078, rel=1e-14)
    assert bp.acm_l2(joints=5).n == 10


def test_acm_l2_is_evenly_heavy():
    robot = bp.acm_l2()
    rest = robot.forward(np.zeros(18))
    bodies = {"base": robot.base_body} | {f: e.body for f, e in zip(robot.frames[1:], robot.elements, strict=True)}
    for contact in robot.contacts:
        body = bodies[contact.frame]
        length = contact.end[0] - contact.start[0]
        assert body.mass / length == pytest.approx(0.99 / 0.8, rel=1e-12)
        assert body.com[0] == pytest.approx(0.5 * (contact.start[0] + contact.end[0]), abs=1e-15)
    centre = sum(b.mass * (rest[f][0] + b.com[0]) for f, b in bodies.items() if b is not None) / robot.mass
    assert centre == pytest.approx(0.351, abs=1e-14)


def test_acm_l2_in_a_mission():
    from bodyplan.missions.schema import ROBOTS, json_schema

    build, units = ROBOTS["acm_l2"]
    assert build is bp.acm_l2 and units["limits"] == "angle"
    assert {"joints", "limits", "effort"} <= set(json_schema()["kinds"]["robot"]["acm_l2"]["properties"])


# --- arcs ---


@pytest.mark.parametrize("axes", AXES)
def test_arcs_touch_where_they_meet_and_are_as_heavy_as_they_should(axes):
    lengths = np.array([0.1, 0.2, 0.15])
    robot = bp.snake(3, lengths, "arc", axes=axes, mass=0.3, radius=0.02)
    assert [c.name for c in robot.contacts] == ["tail", "link1", "link2", "link3"]
    assert [c.frame for c in robot.contacts] == ["base", "link1", "link2", "link3"]
    reach = np.array([[0.0, 0.1], [-0.1, 0.2], [-0.2, 0.15], [-0.15, 0.0]]) / 8.0
    for contact, ends in zip(robot.contacts, reach, strict=True):
        assert np.abs(contact.points() - np.outer(ends, X)).max() < 1e-16 and contact.shape == "capsule"
    assert robot.mass == pytest.approx(0.9, rel=1e-14)
    # the mass and the moments of three rods, wherever they are cut
    rest = robot.forward(np.zeros(robot.n)).positions[:, 0]
    bodies = [robot.base_body, *(element.body for element in robot.elements)]
    places = [x + b.com[0] for x, b in zip(rest, bodies, strict=True)]
    assert sum(b.mass * x for b, x in zip(bodies, places, strict=True)) == pytest.approx(
        0.3 * np.sum(np.cumsum(lengths) - lengths / 2.0), rel=1e-13
    )
    about_tail = sum(b.inertia[1] + b.mass * x**2 for b, x in zip(bodies, places, strict=True))
    front = np.cumsum(lengths)
    rods = 0.3 / lengths * (front**3 - (front - lengths) ** 3) / 3.0
    assert about_tail == pytest.approx(rods.sum() + 0.9 * 0.02**2 / 4.0, rel=1e-12)
    assert sum(b.inertia[0] for b in bodies) == pytest.approx(0.9 * 0.02**2 / 2.0, rel=1e-12)


def test_the_contact_of_an_arc_leaves_it_by_less_than_one_per_cent():
    bend = 1.0
    # the arc an eighth of its length before its end, seen from the end
    x, y = np.sin(bend / 8.0) / bend, (1.0 - np.cos(bend / 8.0)) / bend
    assert np.hypot(x - 0.125, y) < 0.01
