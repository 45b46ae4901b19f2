"""The contact of a wheel: both equations, globally nearest against brute force, twice, on edges, and what is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.gaits.carry import contact, pose, pose_of
from bodyplan.gaits.carry.planes import Planes
from wheel_cases import nearest_by_brute_force, paper_system, rotation

ROBOT = bp.tri_wheel()
GROUNDS = {
    "hills": "sin(0.5*(x+y))/15",
    "paraboloid": "0.4*(x**2+y**2)",
    "ripples": "0.02*sin(25*x)*cos(19*y)",
    "waves": "0.06*sin(14*x+3*y)",
    "bump": "0.1*exp(-30*((x-0.4)**2+y**2))",
    "step": "0.04*tanh(25*(x+0.2*y))",
    "sharp step": "min(0.05, max(0, 2*(x-0.1)))",
    "roof": "0.12-abs(0.6*x)",
    "plane": "0.1*x-0.15*y+0.02",
}


def random_poses(ground: bp.Surface, count: int, tilt: float, seed: int) -> tuple[np.ndarray, ...]:
    """Places within 1 m, heights some way above the highest ground below the robot, tilts and headings."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-0.5, 0.5, (count, 2))
    near = np.linspace(-1.2, 1.2, 41)
    x, y = np.meshgrid(near, near)
    top = float(ground.height(x, y).max())
    height = top + 1.3 * tilt + rng.uniform(0.02, 0.2, count)
    return xy, height, *rng.uniform(-tilt, tilt, (2, count)), rng.uniform(-4, 4, count)


@pytest.mark.parametrize("name", GROUNDS)
@pytest.mark.parametrize("tilt", [0.0, 0.15])
def test_contacts_are_the_nearest_ground_there_is(name: str, tilt: float) -> None:
    ground = bp.Surface(GROUNDS[name])
    xy, height, roll, pitch, heading = random_poses(ground, 6, tilt, 1)
    at = pose(ROBOT, ground, xy, height, "absolute", roll, pitch, heading)
    places = ROBOT.forward(np.zeros(ROBOT.n), at.base)
    for wheel in at:
        assert set(wheel.status) <= {"ok", "out_of_reach"}
        for i in range(len(xy)):
            R = places.rotations[i, 0]
            brute = nearest_by_brute_force(ground, places[f"{wheel.name}.axle"][i, :3], R, 1.05 * wheel.radius[i])
            assert wheel.radius[i] <= brute + 1e-9, f"{wheel.name} at {i}: something is nearer"
            assert wheel.radius[i] == pytest.approx(brute, abs=2e-7)


@pytest.mark.parametrize("name", [n for n in GROUNDS if n not in ("sharp step", "roof")])
def test_both_equations_hold_to_rounding(name: str) -> None:
    ground = bp.Surface(GROUNDS[name])
    xy, height, roll, pitch, heading = random_poses(ground, 200, 0.2, 2)
    at = pose(ROBOT, ground, xy, height, "absolute", roll, pitch, heading)
    for wheel in at:
        assert wheel.residual.max() < 1e-12
        assert np.abs(wheel.point[:, 2] - ground.height(wheel.point)).max() < 1e-12
        np.testing.assert_allclose(wheel.normal, ground.normal(wheel.point), atol=1e-12)
        assert not wheel.corner.any() and wheel.radius.min() > 0.0
        # second-order condition of a nearest point
        assert wheel.slack.min() > -1e-9


@settings(max_examples=40, deadline=None)
@given(
    place=st.tuples(st.floats(-1, 1), st.floats(-1, 1)),
    roll=st.floats(-0.1, 0.1),
    pitch=st.floats(-0.1, 0.1),
    heading=st.floats(-3.1, 3.1),
    height=st.floats(0.12, 0.2),
)
def test_solutions_satisfy_the_papers_equations(
    place: tuple[float, float], roll: float, pitch: float, heading: float, height: float
) -> None:
    """Eqs. (12), (14) with the corrected normal, written down separately, and forward kinematics of the contact."""
    ground = bp.Surface("sin(0.5*(x+y))/15")
    at = pose(ROBOT, ground, place, height, "absolute", roll, pitch, heading)
    R = rotation(roll, pitch, float(bp.gaits.carry.yaw(heading, roll, pitch)))
    poses = ROBOT.forward(at.joints, at.base)
    for wheel in at:
        if wheel.status == "ok":
            found = paper_system(ground, ROBOT, at.base[:3], R, wheel.name, float(wheel.angle), float(wheel.q))
            assert np.abs(found).max() < 1e-12
            np.testing.assert_allclose(poses[wheel.name][:3], wheel.point, atol=1e-12)


def test_the_systems_of_the_wheels_are_apart_and_their_determinant_is_known() -> None:
    """det d(h, T)/d(phi, q) = (dR/dq) (N.u)^2 (1 - kappa R), up to the sign of the order of the unknowns."""
    ground = bp.Surface("0.1*sin(4*x)*cos(3*y)")
    at = pose(ROBOT, ground, (0.1, -0.2), 0.17, "absolute", 0.05, -0.04, 0.7)
    assert at.ok
    R = rotation(0.05, -0.04, float(bp.gaits.carry.yaw(0.7, 0.05, -0.04)))
    h = 1e-6
    for wheel in at:
        phi, q = float(wheel.angle), float(wheel.q)

        def system(a: float, b: float, name: str = wheel.name) -> np.ndarray:
            return paper_system(ground, ROBOT, at.base[:3], R, name, a, b)

        by_phi = (system(phi + h, q) - system(phi - h, q)) / (2 * h)
        by_q = (system(phi, q + h) - system(phi, q - h)) / (2 * h)
        determinant = by_phi[0] * by_q[1] - by_phi[1] * by_q[0]
        gx, gy = ground.gradient(wheel.point)
        u = R @ np.array([np.sin(phi), 0.0, -np.cos(phi)])
        slope = -0.5 * 0.3 * np.cos(np.radians(30)) * np.sin(q / 2)
        expected = slope * (np.array([-gx, -gy, 1.0]) @ u) ** 2 * wheel.slack
        assert abs(determinant) == pytest.approx(abs(float(expected)), rel=1e-7)


def test_mirror_images_and_far_sides_are_not_contacts() -> None:
    """Over waves whose valleys are narrower than the wheel many stationary points satisfy both equations; in every one
    of 60 poses the nearest one is found."""
    ground = bp.Surface("0.05*sin(22*x)")
    x = np.linspace(0.0, 2.0 * np.pi / 22.0, 60)
    at = pose(ROBOT, ground, np.stack([x, 0.0 * x], axis=1), 0.2)
    for wheel, offset in (("fl", 0.6), ("r", -0.6)):
        s = np.linspace(-0.4, 0.4, 80001)
        for i in range(60):
            away = np.hypot(s, 0.2 - 0.05 * np.sin(22 * (x[i] + offset + s)))
            assert at[wheel].radius[i] == pytest.approx(away.min(), abs=2e-8)
        assert at[wheel].radius.min() > 0.0 and np.all(np.abs(at[wheel].angle) < 0.5 * np.pi)


def test_a_wheel_across_a_narrow_valley_touches_twice() -> None:
    """cos(22 x) has its trough at the middle: both walls are equally near."""
    ground = bp.Surface("-0.05*cos(22*x)")
    place = (-0.6, 0.0)  # the front wheels are over x = 0
    at = pose(ROBOT, ground, place, 0.2)
    for name in ("fl", "fr"):
        wheel = at[name]
        assert wheel.double and wheel.status == "ok"
        assert wheel.second == pytest.approx(-float(wheel.angle), abs=1e-6) and abs(wheel.angle) > 0.1
    assert not pose(ROBOT, ground, (-0.59, 0.0), 0.2)["fl"].double


def test_a_wheel_next_to_twice_touching_takes_the_nearer_side() -> None:
    ground = bp.Surface("-0.05*cos(22*x)")
    left, right = (pose(ROBOT, ground, (-0.6 + d, 0.0), 0.2)["fl"] for d in (-1e-6, 1e-6))
    assert left.angle < 0.0 < right.angle


def test_ground_as_curved_as_the_rim() -> None:
    """A parabolic valley z = x^2/2r is osculated at its bottom by a circle of radius r: kappa R -> 1 from below."""
    ground = bp.Surface("x**2/(2*0.2)")
    for height, slack in ((0.199999, 5e-6), (0.19, 0.05), (0.1, 0.5)):
        wheel = pose(ROBOT, ground, (-0.6, 0.0), height)["fl"]
        assert wheel.slack == pytest.approx(slack, rel=1e-6) and wheel.status == "ok"
        assert wheel.radius == pytest.approx(height, abs=1e-12) and wheel.residual < 1e-12
    # exactly there the minimum is of fourth order and still found; above it the wheel rests on both flanks
    assert pose(ROBOT, ground, (-0.6, 0.0), 0.2)["fl"].radius == pytest.approx(0.2, abs=1e-9)
    above = pose(ROBOT, ground, (-0.6, 0.0), 0.25)["fl"]
    assert above.double and above.radius == pytest.approx(np.sqrt(0.25**2 - 0.05**2), abs=1e-12)


def test_edges_of_the_ground_are_contacts_without_a_tangent() -> None:
    """On the ridge of a roof the contact is the ridge, and its normal points to the axle."""
    ground = bp.Surface("0.12-abs(0.6*x)")
    wheel = pose(ROBOT, ground, (-0.55, 0.0), 0.25)[
        "fl"
    ]  # the axle is at x = 0.05, over the right flank near the ridge
    assert wheel.corner and wheel.status == "ok"
    assert wheel.radius == pytest.approx(np.hypot(0.05, 0.13), abs=1e-12)
    np.testing.assert_allclose(wheel.point, [0.0, 0.6, 0.12], atol=1e-11)
    np.testing.assert_allclose(wheel.normal, np.array([0.05, 0.0, 0.13]) / np.hypot(0.05, 0.13), atol=1e-10)
    assert not pose(ROBOT, ground, (-0.3, 0.0), 0.25)["fl"].corner


def test_leaning_wheels_touch_in_their_own_plane() -> None:
    """On level ground a wheel that leans by the roll needs the radius height / cos(roll)."""
    at = pose(bp.rover({"a": (0.0, 0.0)}, body=(0.2, 0.1)), bp.Plane(), (0.0, 0.0), 0.15, roll=[0.0, 0.3, -0.6])
    np.testing.assert_allclose(at["a"].radius, 0.15 / np.cos([0.0, 0.3, -0.6]), rtol=1e-14)
    np.testing.assert_allclose(at["a"].normal, [[0, 0, 1]] * 3, atol=1e-15)


def test_what_is_not_a_contact_is_a_status_with_a_reason() -> None:
    ground = bp.Surface("0.02*sin(3*x)")
    low, high, deep = (pose(ROBOT, ground, (0.0, 0.0), h) for h in (0.01, 0.4, -0.1))
    assert high.status == "out_of_reach" and "wheel 'fl' needs a radius of 0.3" in high.reason()
    assert "0.02 to 0.2798 m" in high.reason() and high["fl"].radius > 0.3 and high["fl"].q == 0.0
    assert low.status != "ok" and "wheel" in low.reason()
    assert deep.status == "below_floor" and "axle in the ground" in deep.reason()
    with pytest.raises(bp.SolveError, match="'fl'") as raised:
        high.raise_if_failed()
    assert raised.value.status == "out_of_reach"
    edge = pose(ROBOT, bp.HeightMap(np.zeros((5, 5)), 0.4), (1.4, 0.8), 0.15)
    assert edge.status == "no_contact" and "edge of the ground" in edge.reason()
    bowl = pose(bp.rover({"a": (0, 0)}, body=(0.1, 0.1)), bp.Surface("0.2-sqrt(0.04-x*x-y*y)"), (0, 0), 0.2)
    assert bowl.status == "not_converged" and "tie" in bowl.reason()


def test_the_hull_may_touch_where_no_wheel_is() -> None:
    ground = bp.Surface("0.15*exp(-60*(x**2+y**2))")
    at = pose(ROBOT, ground, (0.0, 0.0), [0.1, 0.2])
    assert at.status.tolist() == ["below_floor", "ok"] and at.hull.tolist() == [True, False]
    assert at.reason(0) == "the hull touches the ground" and at["fl"].status[0] == "ok"
    bare = pose(bp.tri_wheel(thickness=0.0), ground, (0.0, 0.0), 0.1)
    assert bare.ok


def test_wheels_of_fixed_radius_touch_or_do_not() -> None:
    cart = bp.rover({"a": (0.3, 0.2), "b": (0.3, -0.2), "c": (-0.3, 0.2), "d": (-0.3, -0.2)}, radius=0.1)
    slope = bp.Plane(slope=(0.1, 0.0))
    flat = pose(cart, bp.Plane(), (0.0, 0.0), [0.1, 0.101, 0.099])
    assert flat.status.tolist() == ["ok", "no_contact", "below_floor"]
    assert "hangs 1 mm" in flat.reason(1) and "sink 1 mm" in flat.reason(2)
    tilted = pose(cart, slope, (0.0, 0.0), 0.1 * np.hypot(1.0, 0.1), pitch=-np.arctan(0.1))
    assert tilted.ok
    np.testing.assert_allclose(tilted["a"].angle, 0.0, atol=1e-12)  # at right angles to the body
    assert tilted["a"].q == 0.0


def test_poses_of_any_number_of_wheels_and_headings() -> None:
    places = {f"w{i}": (0.5 * np.cos(a), 0.5 * np.sin(a), 0.0, a) for i, a in enumerate(np.arange(6) * np.pi / 3)}
    ground = bp.Surface("0.03*sin(3*x+2*y)")
    at = pose(bp.rover(places), ground, (0.2, 0.1), 0.15, heading=0.4)
    assert at.ok
    poses = at.robot.forward(at.joints, at.base)
    for name, place in places.items():
        np.testing.assert_allclose(poses[name][:3], at[name].point, atol=1e-12)
        turn = np.array([np.cos(0.4 + place[3]), np.sin(0.4 + place[3]), 0.0])
        away = at[name].point - poses[f"{name}.axle"][:3]
        assert abs(np.cross(turn, away)[2]) < 1e-12  # in the plane of the wheel


def test_batches_broadcast_and_agree_with_single_poses() -> None:
    ground = bp.Surface("0.05*sin(5*x)*sin(4*y)")
    many = pose(ROBOT, ground, np.zeros((3, 1, 2)), np.linspace(0.12, 0.2, 4), heading=[[0.0], [1.0], [2.0]])
    assert many.status.shape == (3, 4) and many["fl"].point.shape == (3, 4, 3) and many.joints.shape == (3, 4, 9)
    one = pose(ROBOT, ground, (0.0, 0.0), float(np.linspace(0.12, 0.2, 4)[2]), heading=1.0)
    for wheel in one:
        assert wheel.radius == pytest.approx(many[wheel.name].radius[1, 2], abs=1e-13)
    same = pose_of(ROBOT, ground, many.base)
    np.testing.assert_allclose(same.joints, many.joints, atol=1e-11)


def test_far_from_the_origin_nothing_is_lost() -> None:
    here = pose(ROBOT, bp.Surface("0.05*sin(3*x)"), (0.3, 0.0), 0.15)
    shift = 2.0 * np.pi / 3.0 * 100
    there = pose(ROBOT, bp.Surface("0.05*sin(3*x)"), (0.3 + shift, 50.0), 0.15)
    for wheel in here:
        assert there[wheel.name].radius == pytest.approx(float(wheel.radius), abs=1e-11)


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: pose(bp.snake(4, 0.1), bp.Plane(), (0, 0)), ["no wheels"]),
        (lambda: pose(ROBOT, bp.Profile(floor=0.0, ceiling=1.0), (0, 0)), ["ceiling", "open sky"]),
        (lambda: pose(ROBOT, bp.Corridor(width=2.0, height=1.0), (0, 0)), ["corridor", "height_map and profile"]),
        (lambda: pose(ROBOT, bp.Plane(), (0, 0, 0)), ["position", "(..., 2)"]),
        (lambda: pose(ROBOT, bp.Plane(), (0, 0), 0.1, "relative"), ["height_mode", "relative", "absolute"]),
        (lambda: pose(ROBOT, bp.Plane(), (0, 0), roll=1.6), ["roll", "pi/2"]),
        (lambda: pose(ROBOT, bp.Plane(), np.zeros((3, 2)), np.zeros(2)), ["broadcast"]),
        (lambda: pose(ROBOT, bp.Plane(), (0, np.nan)), ["position", "finite"]),
        (lambda: pose(ROBOT, bp.Plane(), (0, 0))["rear"], ["rear", "fl, fr, r"]),
        (lambda: pose_of(ROBOT, bp.Plane(), np.zeros(7)), ["base", "unit"]),
    ],
)
def test_refusals(make, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(bp.InputError) as raised:
        make()
    for word in words:
        assert word in str(raised.value)


@pytest.mark.parametrize("rough, cell", [(0.03, 0.1), (0.01, 0.03), (0.08, 0.25), (0.0, 0.2)])
def test_contacts_on_a_height_map_are_those_of_any_ground(rough: float, cell: float) -> None:
    """Wheel by wheel in kernels, or all at once over any ground: the same contacts, the same proofs; also of wheels
    that lean, that reach over the edge, whose axle is in the ground, and from other places to start from."""
    rng = np.random.default_rng(3)
    ground = bp.HeightMap(rough * rng.normal(size=(41, 41)), cell, (-20.0 * cell, -20.0 * cell))
    count, inner = 80, 20.0 * cell - 0.5
    place = rng.uniform(-inner, inner, (count, 2))
    place[:4] *= 20.0 * cell / inner  # some near the edge
    centre = np.concatenate([place, (ground.height(place) + rng.uniform(-0.02, 0.3, count))[:, None]], axis=1)
    turns = [rotation(*(rng.normal(size=3) * [0.2 * (i % 2), 0.2 * (i % 2), 2.0])) for i in range(count)]
    planes = Planes.of(centre, np.array([R[:, 0] for R in turns]), np.array([R[:, 1] for R in turns]))
    for start in (None, rng.uniform(-1.0, 1.0, count)):
        quick, plain = contact._in_kernels(ground, planes, start), contact._at_once(ground, planes, start)
        inside = np.abs(place).max(axis=1) < inner
        np.testing.assert_array_equal(quick.outcome[inside], plain.outcome[inside])
        assert (quick.outcome == contact.TOUCHES).mean() > 0.8
        some = (quick.outcome == contact.TOUCHES) & (plain.outcome == contact.TOUCHES)
        np.testing.assert_allclose(quick.radius[some], plain.radius[some], rtol=1e-12)
        for name, off in (("phi", 1e-9), ("point", 1e-9), ("normal", 1e-8), ("curvature", 1e-6), ("hessian", 1e-6)):
            np.testing.assert_allclose(getattr(quick, name)[some], getattr(plain, name)[some], atol=off)
        np.testing.assert_array_equal(np.isnan(quick.second[some]), np.isnan(plain.second[some]))
        assert not quick.corner.any() and quick.residual[some].max() < 1e-12
