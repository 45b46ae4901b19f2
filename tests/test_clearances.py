"""Bodies and links against the ground and each other: distances, the judge's tests of them with spoiled motions, and
walks that keep off the ground or say why they cannot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

import bodyplan as bp
from bodyplan.ground.near import clearance_up_to, segment_clearance_up_to
from bodyplan.motion import Claim
from bodyplan.robot import Joint, Row
from bodyplan.spatial import matrix_from_quaternion
from bodyplan.spatial.segments import segment_box_clearance

GAIT = bp.Crawl((0.01, 0.0))
LEGS = ("fl", "fr", "hl", "hr")


# --- distances ---


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["any", "point", "along", "inside"]))
def test_segments_and_boxes_against_a_search(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    half = rng.uniform(0.05, 1.0, 3)
    ends = rng.normal(size=(2, 3)) * rng.choice([0.3, 1.0, 3.0])
    if kind == "point":
        ends[1] = ends[0]
    if kind == "along":
        ends[1] = ends[0] + rng.normal() * np.eye(3)[rng.integers(3)]
    if kind == "inside":
        ends = rng.uniform(-1.0, 1.0, (2, 3)) * half

    def signed(s: float) -> float:
        over = np.abs(ends[0] + s * (ends[1] - ends[0])) - half
        return float(np.linalg.norm(np.maximum(over, 0.0)) + min(over.max(), 0.0))

    # convex along the segment: the distance outside, and minus the depth inside
    found = minimize_scalar(signed, bounds=(0.0, 1.0), method="bounded", options={"xatol": 1e-13})
    want = min(found.fun, signed(0.0), signed(1.0))
    got = float(segment_box_clearance(ends, half))
    assert got == pytest.approx(want, abs=1e-7)
    assert got <= want + 1e-12
    assert float(segment_box_clearance(ends[::-1], half)) == pytest.approx(got, abs=1e-12)


@pytest.mark.parametrize(
    "ground",
    [
        bp.Surface("0.04*sin(6*x)*cos(5*y)"),
        bp.Surface("0.1*abs(sin(3*x))"),
        bp.HeightMap(np.random.default_rng(0).uniform(0.0, 0.1, (30, 30)), 0.1, (-1.5, -1.5)),
        bp.Plane(slope=(0.1, 0.2)),
        bp.Profile([(None, 0.0), (0.1, 0.1)]),
    ],
)
def test_clearance_up_to_a_cap(ground) -> None:
    rng = np.random.default_rng(1)
    xy = rng.uniform(-1.2, 1.2, (300, 2))
    points = np.concatenate([xy, ground.height(xy)[:, None] + rng.uniform(-0.05, 0.3, (300, 1))], axis=1)
    for cap in (0.0, 0.03, rng.uniform(-0.01, 0.2, 300)):
        assert np.abs(clearance_up_to(ground, points, cap) - np.minimum(ground.clearance(points), cap)).max() < 1e-12
    ends = points.reshape(-1, 2, 3)
    want = np.minimum(ground.segment_clearance(ends), 0.05)
    assert np.abs(segment_clearance_up_to(ground, ends, 0.05) - want).max() < 1e-12


# --- the judge ---


@pytest.fixture(scope="module")
def walk():
    return bp.plan(bp.silo4(shell=True), GAIT, bp.Plane(), bp.times(0, 12, dt=0.05)).raise_if_failed()


def failed(motion, kind: str):
    lines = [line for line in bp.check(motion).failures if line.kind == kind]
    return lines[0] if lines else None


def by_hand(motion, name: str, points: int = 41) -> np.ndarray:
    """Points (T, p, 3) of a capsule's skeleton or of a box's edges and faces."""
    robot = motion.robot
    contact = next(c for c in robot.contacts if c.name == name)
    pose = robot.forward(motion.q, motion.base)[contact.frame]
    if contact.shape == "box":
        axis = np.linspace(-1.0, 1.0, points)
        grid = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
        local = np.array(contact.start) + grid[np.abs(grid).max(axis=1) == 1.0] * contact.half
    else:
        local = np.linspace(contact.start, contact.end, points)
    return np.einsum("tij,pj->tpi", matrix_from_quaternion(pose[:, 3:]), local) + pose[:, None, :3]


def test_an_honest_walk_passes_with_the_gaps_that_it_has(walk) -> None:
    report = bp.check(walk)
    assert report.ok, report
    line = report["links and body clear of the ground"]
    links = [c for c in walk.robot.contacts if not c.name.endswith(".foot")]
    assert len(links) == 13
    least = min(by_hand(walk, c.name)[..., 2].min() - c.radius for c in links)
    assert line.value == pytest.approx(least, abs=1e-12)
    assert line.value > 0.017 and ".shin" in line.detail
    assert report["links clear of each other"].value > 0.04
    assert "body" in report["links clear of each other"].detail
    # feet are no part of that claim, and stand
    assert report["clear of the floor"].value == pytest.approx(0.0, abs=1e-12)


def test_a_body_in_a_hill_is_found_between_its_corners(walk) -> None:
    """The hill is narrower than the body: its corners are clear of it."""
    under = walk.base[0, 2] - 0.0465
    for rise, gone in ((0.1, False), (float(under) + 0.003, True)):
        hill = bp.Surface(f"{rise}*exp(-300*(x*x+y*y))")
        assert float(hill.height(0.155, 0.155)) < 1e-6
        line = failed(walk.replace(ground=hill), "clears")
        assert (line is not None) == gone
        # without the planner's claim all shapes are tested
        bare = failed(walk.replace(ground=hill, claims=()), "ground")
        assert (bare is not None) == gone
        if gone:
            assert "body" in line.detail and "body" in bare.detail and line.value == pytest.approx(-0.003, abs=2e-3)


def test_a_body_lowered_into_the_ground_is_found(walk) -> None:
    """On its knees: the legs spread, the body on the floor."""
    robot = walk.robot
    q = np.array([{"shoulder": 0.0, "hip": 0.5, "knee": -0.9}[name.split(".")[1]] for name in robot.joints])
    for height, ok in ((0.0475, True), (0.0455, False)):
        base = np.array([0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0])
        still = walk.replace(
            q=np.tile(q, (len(walk.t), 1)),
            base=np.tile(base, (len(walk.t), 1)),
            qd=0 * walk.qd,
            qdd=0 * walk.qdd,
            claims=(),
        )
        line = failed(still, "ground")
        assert (line is None) == ok
        if not ok:
            assert "body" in line.detail and line.value == pytest.approx(-0.001, abs=1e-9)
    # on a profile, too: at the corner of a step that reaches into an edge of the body
    step = bp.Profile([(None, -1.0), (0.1, 0.0465 - 0.02)])
    still = still.replace(ground=step, base=np.tile([0.0, 0.0, 0.06, 1, 0, 0, 0], (len(walk.t), 1)))
    assert "body" in failed(still, "ground").detail


def test_a_tilted_body_is_found_at_its_corner(walk) -> None:
    tilt = bp.solve.pose_from_coordinates([0.0, 0.0, 0.2, 0.5, -0.5, 0.3])
    motion = walk.replace(base=np.tile(tilt, (len(walk.t), 1)), claims=())
    lowest = by_hand(motion, "body", 2)[0, :, 2].min()
    others = min(
        (by_hand(motion, c.name, 2)[..., 2] - c.radius).min() for c in motion.robot.contacts if c.name != "body"
    )
    line = failed(motion.replace(ground=bp.Plane(float(lowest) + 1e-3)), "ground")
    assert line.value == pytest.approx(min(-1e-3, others - lowest - 1e-3), abs=1e-9)


def test_crossing_legs_are_found(walk) -> None:
    k = walk.robot.joint_index
    q = np.array(walk.q)
    q[100:110, k("fl.shoulder")], q[100:110, k("hl.shoulder")] = 1.5, -1.5
    line = failed(walk.replace(q=q), "self")
    assert "fl" in line.detail and "hl" in line.detail and line.value < -0.005
    assert "5" in line.detail.split("at ")[-1]
    # a leg folded over the body is in the box
    q = np.array(walk.q)
    q[50, [k("fr.shoulder"), k("fr.hip"), k("fr.knee")]] = np.pi, 0.0, -2.0
    line = failed(walk.replace(q=q), "self")
    assert "body and fr." in line.detail and line.value < -0.01 and "2.5 s" in line.detail


def test_boxes_in_each_other_are_found() -> None:
    rows = {"a": [Row(d=Joint("a", 0.5)), Row(a=0.0)], "b": [Row(theta=Joint("b"), a=0.4), Row(a=0.4)]}
    contacts = [
        bp.Contact("one", "a.2", "box", half=(0.1, 0.1, 0.1)),
        bp.Contact("two", "b.2", "box", half=(0.1, 0.2, 0.1)),
    ]
    robot = bp.Robot.from_rows(rows, contacts=contacts)
    t = np.linspace(0.0, 1.0, 3)
    q = np.array([[0.0, 0.0], [-0.2, 0.0], [-0.5, 0.0]])
    made = bp.plan(bp.silo4(), GAIT, bp.Plane(-5.0), bp.times(0, 1, dt=0.5))
    nothing = {"claims": (), "contacts": None, "forces": None, "torques": None}
    motion = made.replace(robot=robot, t=t, q=q, qd=0 * q, qdd=0 * q, **nothing)
    # 0.7 m beside each other, and 0.5 m over each other at first
    line = bp.check(motion)["links clear of each other"]
    assert line.value == pytest.approx(0.6, abs=1e-12) and line.passed
    near = robot.from_rows(rows | {"b": [Row(theta=Joint("b"), a=0.1), Row(a=0.05)]}, contacts=contacts)
    line = bp.check(motion.replace(robot=near))["links clear of each other"]
    assert line.passed is False and "1 s" in line.detail


def test_a_shin_through_a_wall_is_found(walk) -> None:
    """A thin wall beside the front feet, higher than where shins pass it."""
    feet = walk.robot.forward(walk.q, walk.base)
    x = float(feet["fl.foot"][0, 0])
    at = x + 0.04
    knee = float(feet["fl.knee"][0, 0])
    assert knee > at
    wall = bp.Profile([(None, 0.0), (at, 0.12), (at + 0.005, 0.0)])
    first = {f: getattr(walk, f)[:3] for f in ("t", "base", "q", "qd", "qdd", "residual", "status", "contacts")}
    still = walk.replace(ground=wall, forces=None, torques=None, **first)
    line = failed(still, "clears")
    assert "shin" in line.detail and line.value < -0.01
    assert "shin" in failed(still.replace(claims=()), "ground").detail
    low = bp.Profile([(None, 0.0), (at, 0.03), (at + 0.005, 0.0)])
    assert failed(still.replace(ground=low), "clears") is None


def test_claims_that_cannot_be(walk) -> None:
    for data, says in (
        ({"contacts": ["tail"], "required": 0.0}, "tail"),
        ({"contacts": ["body"], "required": 1.0}, "body"),
    ):
        line = failed(walk.replace(claims=[Claim("clears", "x", data)]), "clears")
        assert says in line.detail
    edge = bp.HeightMap(np.zeros((9, 9)), 0.1, (-0.4, -0.4))
    beyond = walk.replace(ground=edge, base=walk.base + 2.0 * np.eye(7)[0])
    assert failed(beyond, "clears") is not None


# --- the planner ---


def stairs(rise: float) -> bp.Profile:
    return bp.Profile([(None, 0.0), (0.45, rise), (0.7, 2.0 * rise)])


@pytest.mark.parametrize("rise", [0.04, 0.06])
def test_shins_keep_off_stairs(rise: float) -> None:
    gait = bp.Crawl((0.012, 0.0), foothold="search")
    motion = bp.plan(bp.silo4(shell=True), gait, stairs(rise), bp.times(0, 60, dt=0.1)).raise_if_failed()
    report = bp.check(motion)
    assert report.ok, report
    assert report["links and body clear of the ground"].value > 0.0045
    # with feet alone nobody looks, and shins come nearer than they should, or into the steps
    plain = bp.plan(bp.silo4(), gait, stairs(rise), bp.times(0, 60, dt=0.1)).raise_if_failed()
    assert any("Only feet are shapes" in note for note in plain.notes)
    shell = bp.silo4(shell=True)
    shown = plain.replace(robot=shell, contacts=None, forces=None, torques=None, claims=motion.claims[-1:])
    assert shown.claims[0].kind == "clears" and failed(shown, "clears") is not None


def test_the_body_rises_over_a_hill_or_the_walk_says_why_not() -> None:
    robot, t = bp.silo4(shell=True), bp.times(0, 60, dt=0.1)
    heights = {}
    for rise in (0.05, 0.175):
        ground = bp.Surface(f"{rise}*exp(-60*((x-0.3)*(x-0.3)+y*y))")
        motion = bp.plan(robot, bp.Crawl((0.01, 0.0), foothold="search"), ground, t).raise_if_failed()
        assert bp.check(motion).ok
        heights[rise] = float(motion.base[:, 2].max())
    assert heights[0.175] > heights[0.05] + 0.01
    tall = bp.Surface("0.26*exp(-60*((x-0.3)*(x-0.3)+y*y))")
    motion = bp.plan(robot, bp.Crawl((0.01, 0.0), foothold="search"), tall, t)
    bad = int(np.flatnonzero(motion.status != "ok")[0])
    assert motion.status[bad] == "below_floor" and motion.t[bad] > 5.0
    note = next(note for note in motion.notes if note.startswith("Stops"))
    assert "body comes within" in note and " swings" in note
    # up to there the judge agrees
    assert bp.check(motion)["links and body clear of the ground"].passed


def test_legs_that_would_cross_are_refused() -> None:
    """Feet so near to each other that legs which stand on them are in each other."""
    mounts = {"a": (0.1, 0.01, 0.0), "b": (0.1, -0.01, 0.0), "c": (-0.1, 0.01, np.pi), "d": (-0.1, -0.01, np.pi)}
    robot = bp.walker(mounts, body=(0.2, 0.1), shell=True, foot_radius=0.02)
    motion = bp.plan(robot, bp.Crawl((0.0, 0.0), reach=0.05, margin=-1.0), bp.Plane(), bp.times(0, 6, dt=0.1))
    assert motion.status[0] == "links_crossing"
    assert any("would be in each other while" in note for note in motion.notes)
    assert failed(motion, "self") is not None


def test_a_shin_that_ends_in_its_foot_keeps_what_it_can() -> None:
    robot = bp.silo4()
    shins = [bp.Contact(f"{leg}.shin", f"{leg}.foot", "capsule", 0.01, start=(-0.24, 0.0, 0.0)) for leg in LEGS]
    robot = bp.Robot.from_rows({c.name: c.elements for c in robot.chains}, contacts=(*robot.contacts, *shins),
                               base_body=robot.base_body)  # fmt: skip
    motion = bp.plan(robot, GAIT, bp.Plane(), bp.times(0, 12, dt=0.1)).raise_if_failed()
    report = bp.check(motion)
    assert report.ok, report
    assert report["shins off the ground"].value == pytest.approx(0.0, abs=1e-9)


def test_clearance_is_an_option() -> None:
    robot = bp.silo4(shell=True)
    assert bp.Crawl().planner(robot, bp.Plane()).clearance == pytest.approx(0.005)
    assert bp.Crawl(clearance=0.012).planner(robot, bp.Plane()).needed.min() == 0.012
    # more than a shin has on level ground is not asked of it
    assert bp.Crawl(clearance=0.03).planner(robot, bp.Plane()).needed.min() == pytest.approx(0.0145, abs=5e-4)
    with pytest.raises(bp.InputError, match="clearance"):
        bp.Crawl(clearance=-0.01)


@given(
    st.tuples(st.floats(-0.015, 0.015), st.floats(-0.015, 0.015)), st.floats(-0.03, 0.03), st.floats(0.0, 0.06),
    st.floats(2.0, 9.0), st.sampled_from(["level", "follow"]),
)  # fmt: skip
@settings(max_examples=4)
def test_any_walk_in_a_shell_either_passes_the_judge_or_says_why(velocity, yaw_rate, height, waves, body) -> None:
    gait = bp.Crawl(velocity, yaw_rate, foothold="search", body=body)
    ground = bp.Surface(f"{height}*sin({waves}*x)*cos({waves}*y)")
    motion = bp.plan(bp.silo4(shell=True), gait, ground, bp.times(0, 9, dt=0.15))
    report = bp.check(motion)
    assert report.ok == motion.ok, report
    if motion.ok:
        assert report["links and body clear of the ground"].value >= 0.0025
