"""Wheels on a floor in steps: treads, edges and upright faces, exact; motions over them and what the judge finds."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.carry import pose, pose_of, reach, wheel_rates
from bodyplan.gaits.carry.terrain import terrain
from bodyplan.ground import Ground
from bodyplan.spatial import compose, exp

STEP = bp.Profile(floor=[(None, 0.0), (1.0, 0.06)])
STAIRS = bp.Profile(floor=[(None, 0.0), (1.0, 0.06), (1.5, 0.02), (1.62, -0.03)])
ONE = bp.rover({"a": (0.0, 0.0)}, body=(0.02, 0.02))
ROBOT = bp.tri_wheel()


def wheel(x: float, z: float, ground: bp.Profile = STEP, **angles: float):  # type: ignore[no-untyped-def]
    return pose(ONE, ground, (x, 0.0), z, **angles)["a"]


def test_treads_edges_and_faces() -> None:
    below = wheel(0.5, 0.2)
    assert below.radius == pytest.approx(0.2) and below.angle == 0.0 and not below.corner
    on_top = wheel(1.3, 0.2)
    assert on_top.radius == pytest.approx(0.14) and on_top.normal.tolist() == [0.0, 0.0, 1.0]
    edge = wheel(0.9, 0.16)
    assert edge.corner and edge.radius == pytest.approx(np.hypot(0.1, 0.1))
    np.testing.assert_allclose(edge.point, [1.0, 0.0, 0.06], atol=1e-15)
    np.testing.assert_allclose(edge.normal, np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0), atol=1e-15)
    assert edge.angle == pytest.approx(np.pi / 4)
    face = wheel(0.96, 0.05)
    assert face.radius == pytest.approx(0.04) and face.normal.tolist() == [-1.0, 0.0, 0.0] and not face.corner
    assert face.angle == pytest.approx(np.pi / 2) and face.status == "ok"
    assert wheel(0.95, 0.05).double  # in the inner corner, against tread and face
    assert wheel(1.1, 0.05).status == "below_floor"


def test_steps_down_and_headings() -> None:
    """Backwards the same step is behind; along it there is none; obliquely it is further away."""
    back = wheel(0.9, 0.16, heading=np.pi)
    assert back.radius == pytest.approx(np.hypot(0.1, 0.1)) and back.angle == pytest.approx(-np.pi / 4)
    along = wheel(0.9, 0.16, heading=np.pi / 2)
    assert along.radius == pytest.approx(0.16) and not along.corner
    oblique = wheel(0.95, 0.16, heading=0.4)
    assert oblique.radius == pytest.approx(np.hypot(0.05 / np.cos(0.4), 0.1)) and oblique.corner


def test_random_poses_against_dense_rims() -> None:
    """Rims a little smaller are free, rims a little larger are not."""
    rng = np.random.default_rng(0)
    count = 40
    xy, z, psi = rng.uniform(0.3, 2.0, (count, 2)), rng.uniform(0.17, 0.3, count), rng.uniform(-4, 4, count)
    roll, pitch = rng.uniform(-0.12, 0.12, (2, count))
    at = pose(ROBOT, STAIRS, xy, z, heading=psi, roll=roll, pitch=pitch)
    frames = ROBOT.forward(np.zeros((count, ROBOT.n)), at.base)
    phi = np.linspace(-np.pi, np.pi, 10_001)[:, None]
    for one in at:
        assert set(one.status) <= {"ok", "out_of_reach"} and one.residual.max() < 1e-12
        for i in range(count):
            R, centre = frames.rotations[i, 0], frames[f"{one.name}.axle"][i, :3]
            u = np.sin(phi) * R[:, 0] - np.cos(phi) * R[:, 2]
            free, sunk = (centre + one.radius[i] * (1.0 + d) * u for d in (-1e-6, 5e-3))
            assert np.all(free[:, 2] > STAIRS.height(free)) and np.any(sunk[:, 2] < STAIRS.height(sunk))


def test_rates_over_edges_are_differences() -> None:
    twist, h = np.array([0.1, 0.05, 0.02, 0.1, -0.05, 0.3]), 1e-6
    for x, z in ((0.9, 0.17), (0.5, 0.15), (1.2, 0.15)):
        at = pose(ONE, STEP, (x, 0.0), z, heading=0.3, roll=0.1)
        rates = wheel_rates(at, twist)["a"]
        after, before = (pose_of(ONE, STEP, compose(at.base, exp(twist * s)))["a"] for s in (h, -h))
        for field in ("radius", "angle", "q"):
            difference = (getattr(after, field) - getattr(before, field)) / (2 * h)
            assert getattr(rates, field) == pytest.approx(float(difference), rel=1e-6, abs=1e-8)


def test_heights_in_reach_beside_a_step() -> None:
    """Against the face the radius does not change with the height; above the edge it does."""
    heights = reach(ONE, STEP, (0.9, 0.0))
    for z, radius in ((float(heights.lowest), 0.02), (float(heights.highest), ONE.contacts[0].radius)):
        assert wheel(0.9, z).radius == pytest.approx(radius, abs=1e-9)


def test_a_body_rolls_over_stairs_level() -> None:
    motion = bp.plan(ROBOT, bp.Carry("line", height=0.2, speed=0.3), STAIRS, bp.times(0, 9, dt=0.02))
    assert motion.ok
    report = bp.check(motion)
    assert report.ok, str(report)
    np.testing.assert_array_equal(motion.base[:, 2], 0.2)
    text = " ".join(motion.notes)
    assert "Wheel 'fl' stands on an edge" in text and "leaps" in text
    planned = bp.plan(ROBOT, bp.Carry("line", height="auto", speed=0.3), STAIRS, bp.times(0, 9, dt=0.02))
    assert planned.ok and bp.check(planned).ok


def test_the_judge_sees_a_wheel_in_a_face() -> None:
    t = np.array([0.0, 1.0])
    motion = bp.plan(ONE, bp.Carry(("0.96+0*t", "0*t"), height=0.05, heading=0.0), STEP, t)
    assert motion.ok and bp.check(motion)["rims touch"].passed
    q = motion.q.copy()
    q[:, 1] -= 0.02
    found = bp.check(motion.replace(q=q))["rims touch"]
    assert found.passed is False and "below the ground" in found.detail
    assert found.value == pytest.approx(0.02 * 0.13, rel=0.05)


def test_a_flat_profile_is_a_plane() -> None:
    level, plane = (pose(ROBOT, ground, (0.0, 0.0), 0.2, roll=0.1, heading=0.3)
                    for ground in (bp.Profile(floor=0.03), bp.Plane(0.03)))  # fmt: skip
    np.testing.assert_allclose(level.joints, plane.joints, atol=1e-14)


@pytest.mark.parametrize(
    "ground",
    [
        bp.Plane(0.3, slope=(0.1, -0.2)),
        STAIRS,
        bp.Surface("sin(3*x)*cos(2*y) + abs(x)"),
        bp.HeightMap(np.sin(np.arange(63.0)).reshape(7, 9), 0.2, origin=(-0.7, -0.6)),
    ],
    ids=lambda ground: ground.kind,
)
def test_heights_alone_are_those_of_the_jet(ground: Ground) -> None:
    """Also beyond the edge of a map, where no user gets but kernels ask."""
    land = terrain(ground)
    x, y = np.random.default_rng(3).uniform(-1.0, 1.5, (2, 200))
    np.testing.assert_allclose(land.field_height(x, y), land.field_jet(x, y)[0], rtol=1e-14, atol=1e-13)
