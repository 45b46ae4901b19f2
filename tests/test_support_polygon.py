"""The support polygon: distances from its edges, and the judge's line about the centre of mass over the feet."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

import bodyplan as bp
from bodyplan.check.support import polygon_margin
from bodyplan.motion import Claim, Motion
from bodyplan.spatial import rotations
from bodyplan.spatial.hulls import edge_distances, margin
from crawl_cases import margin_by_hand

RNG = np.random.default_rng(4)
T = np.linspace(0.0, 2.0, 21)


def reference(points, at):
    """Qhull: the normals of its facets point outward."""
    facets = ConvexHull(points).equations
    return float(-(facets[:, :2] @ at + facets[:, 2]).max())


@pytest.mark.parametrize("count", [3, 4, 5, 6, 9])
def test_distances_are_those_of_qhull(count):
    feet = RNG.uniform(-1.0, 1.0, (200, count, 2))
    center = RNG.uniform(-1.2, 1.2, (200, 2))
    found = margin(feet, center)
    wanted = [reference(points, at) for points, at in zip(feet, center, strict=True)]
    assert np.abs(found - wanted).max() < 1e-12
    by_hand = [margin_by_hand(points, at) for points, at in zip(feet, center, strict=True)]
    assert np.abs(found - by_hand).max() < 1e-14
    distances = edge_distances(feet, center)
    assert distances.shape == (200, count)
    edges = np.isfinite(distances).sum(axis=1)
    assert np.array_equal(edges, [len(ConvexHull(points).vertices) for points in feet])


def test_the_hull_of_the_solver_says_the_same():
    feet = RNG.uniform(-1.0, 1.0, (100, 5, 3))
    center = RNG.uniform((-0.5, -0.5, 1.5), (0.5, 0.5, 2.5), (100, 3))
    theirs = bp.solve.stability.tip_margins(feet, [0.0, 0.0, -9.81], center).min_distance
    assert np.abs(margin(feet[..., :2], center[..., :2]) - theirs).max() < 1e-12


@given(st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), min_size=2, max_size=7),
       st.tuples(st.integers(-8, 8), st.integers(-8, 8)))  # fmt: skip
def test_feet_in_a_row_or_in_one_place(points, doubled):
    """On a grid, where many feet coincide or lie in one line."""
    feet, at = np.array(points, dtype=float), 0.5 * np.array(doubled, dtype=float)
    found = float(margin(feet, at))
    assert np.isfinite(found)
    if np.linalg.matrix_rank(feet - feet[0]) == 2:
        assert found == pytest.approx(reference(np.unique(feet, axis=0), at), abs=1e-12)
        return
    # a segment or a point: minus the distance from it
    ends = feet[np.lexsort(feet.T)[[0, -1]]]
    way = ends[1] - ends[0]
    share = np.clip((at - ends[0]) @ way / max(way @ way, 1e-300), 0.0, 1.0)
    distance = float(np.linalg.norm(at - ends[0] - share * way))
    assert found == pytest.approx(-distance, abs=1e-12)
    raised = np.concatenate([feet[[0, *range(len(feet))]], np.zeros((len(feet) + 1, 1))], axis=1)
    if len(raised) > 2 and way.any():  # the solver's hull asks for three feet that are not in one place
        theirs = bp.solve.stability.tip_margins(raised, [0.0, 0.0, -1.0], [*at, 1.0]).min_distance
        assert float(theirs) == pytest.approx(-distance, abs=1e-12)


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_feet_in_a_row_but_for_rounding(far):
    """Any line anywhere: rounding must not make an inside of it."""
    for _ in range(200):
        start, ahead = far * RNG.normal(size=2) + RNG.normal(size=2), np.exp(1j * RNG.uniform(0.0, 2.0 * np.pi))
        way = np.array([ahead.real, ahead.imag])
        places = RNG.permutation(np.append(RNG.uniform(0.0, 1.0, RNG.integers(1, 6)), [0.0, 1.0]))
        feet = start + places[:, None] * way
        along, across = RNG.uniform(-1.0, 2.0), RNG.choice([0.0, *RNG.uniform(-0.5, 0.5, 2)])
        at = start + along * way + across * np.array([-way[1], way[0]])
        distance = np.hypot(max(-along, 0.0, along - 1.0), across)
        assert margin(feet, at) == pytest.approx(-distance, abs=1e-14 * (10.0 + 10.0 * far))


@pytest.mark.parametrize("far", [0.0, 1e3])
def test_margins_do_not_change_with_place_turn_and_order(far):
    for _ in range(50):
        feet, at = RNG.uniform(-1, 1, (5, 2)), RNG.uniform(-0.5, 0.5, 2)
        angle = RNG.uniform(0, 2 * np.pi)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        move = far * RNG.normal(size=2)
        moved = margin(RNG.permutation(feet) @ turn.T + move, turn @ at + move)
        assert moved == pytest.approx(float(margin(feet, at)), abs=1e-13 * (10.0 + 10.0 * far))


def test_inside_of_a_square_is_the_nearest_side():
    square = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], dtype=float)
    for x, y in RNG.uniform(-1.5, 1.5, (50, 2)):
        assert margin(square, np.array([x, y])) == pytest.approx(1.0 - max(abs(x), abs(y)), abs=1e-15)
    batch = np.broadcast_to(square, (3, 7, 4, 2))
    assert margin(batch, np.zeros((3, 7, 2))).shape == (3, 7)


# --- the judge ---


def robot(*places, mass=2.0, com=(0.0, 0.0, 0.1)):
    balls = [bp.Contact(f"foot{k}", "base", "sphere", 0.02, start=(x, y, 0.0)) for k, (x, y) in enumerate(places)]
    body = bp.Body(mass=mass, com=com) if mass else None
    rows = {"mast": [bp.Row(d=bp.Joint("lift"))]}
    return bp.Robot.from_rows(rows, contacts=balls, base_body=body)


def motion_of(made, contacts, base=None, required=0.0, **window):
    zero = np.zeros((len(T), made.n))
    pose = np.tile([0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0], (len(T), 1)) if base is None else base
    claim = Claim("supported", "stands", {"required": required} | window)
    given = None if contacts is None else np.broadcast_to(contacts, (len(T), len(made.contacts))).astype(float)
    ok = np.full(len(T), "ok")
    return Motion(made, bp.Plane(), {}, T, pose, zero, zero, zero, np.zeros(len(T)), ok, (claim,), given)


SQUARE = ((0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2))


def test_the_line_passes_with_room_and_fails_without():
    line = bp.check(motion_of(robot(*SQUARE), True, required=0.19))["stands"]
    assert line.passed and line.at_least and line.unit == "m" and line.limit == 0.19
    assert line.value == pytest.approx(0.2, abs=1e-15)
    assert bp.check(motion_of(robot(*SQUARE), True, required=0.21))["stands"].passed is False
    # without one foot the centre is on the diagonal; a little off it, it tips
    triangle = [True, True, True, False]
    on_edge = bp.check(motion_of(robot(*SQUARE), triangle))["stands"]
    assert on_edge.passed and on_edge.value == pytest.approx(0.0, abs=1e-15)
    off = bp.check(motion_of(robot(*SQUARE, com=(-0.03, -0.02, 0.1)), triangle))["stands"]
    assert off.passed is False and "tips" in off.detail
    assert off.value == pytest.approx(-2 * 0.03 * 0.02 / np.hypot(0.03, 0.02), abs=1e-12)


def test_the_worst_sample_is_named_and_windows_count():
    contacts = np.ones((len(T), 4))
    contacts[5:8, 3] = 0.0
    line = bp.check(motion_of(robot(*SQUARE), contacts, required=0.1))["stands"]
    assert line.passed is False and "0.5 s" in line.detail
    assert bp.check(motion_of(robot(*SQUARE), contacts, required=0.1, start=0.9, end=1.5))["stands"].passed
    assert bp.check(motion_of(robot(*SQUARE), contacts, start=5.0))["stands"].passed is None


@pytest.mark.parametrize("loaded", [(), (0,), (0, 3)])
def test_fewer_than_three_points_do_not_carry(loaded):
    contacts = np.ones((len(T), 4))
    contacts[7] = [k in loaded for k in range(4)]
    line = bp.check(motion_of(robot(*SQUARE), contacts))["stands"]
    assert line.passed is False and line.value is None
    assert "0.7 s fewer than three points" in line.detail


def test_feet_in_one_place_or_in_a_row_do_not_carry():
    for places in (((0.1, 0.1),) * 3, ((0.1, 0.1), (0.2, 0.2), (0.4, 0.4))):
        line = bp.check(motion_of(robot(*places), True))["stands"]
        assert line.passed is False and line.value < -0.1


def test_a_tilted_robot_stands_on_what_is_below_its_feet():
    """Seen from above in the world: turned and tilted feet, in a place far away."""
    turn = rotations.quaternion_exp([0.3, -0.2, 0.0])
    yaw = rotations.quaternion_exp([0.0, 0.0, 1.0])
    pose = np.tile([4.0, -3.0, 1.0, *rotations.multiply(yaw, turn)], (len(T), 1))
    made = robot(*SQUARE, com=(0.02, 0.01, 0.3))
    feet = rotations.rotate(turn, np.array([[x, y, 0.0] for x, y in SQUARE]))
    center = rotations.rotate(turn, np.array([0.02, 0.01, 0.3]))
    found = polygon_margin(motion_of(made, True, base=pose))
    assert np.abs(found - margin_by_hand(feet[:, :2], center[:2])).max() < 1e-12
    assert np.array_equal(polygon_margin(motion_of(made, True, base=pose), slice(3, 5)), found[3:5])


def test_a_box_stands_on_its_lowest_corners():
    box = bp.Contact("body", "base", "box", half=(0.3, 0.2, 0.1))
    body = bp.Body(mass=1.0, com=(0.1, 0.0, 0.0))
    made = bp.Robot.from_rows({"mast": [bp.Row(d=bp.Joint("lift"))]}, contacts=[box], base_body=body)
    assert bp.check(motion_of(made, True))["stands"].value == pytest.approx(0.2, abs=1e-15)
    tilted = np.tile([0.0, 0.0, 0.3, *rotations.quaternion_exp([0.0, 0.1, 0.0])], (len(T), 1))
    line = bp.check(motion_of(made, True, base=tilted))["stands"]
    assert line.passed is False and "fewer than three" in line.detail  # it balances on an edge


def test_what_cannot_be_told_is_not_tested():
    line = bp.check(motion_of(robot(*SQUARE), None))["stands"]
    assert line.passed is None and "which contacts carry" in line.detail
    line = bp.check(motion_of(robot(*SQUARE, mass=0.0), True))["stands"]
    assert line.passed is None and "no mass" in line.detail
