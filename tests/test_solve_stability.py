"""Margins against tipping over and objectives to raise them: SciPy's hulls, closed forms, differences, real motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

import bodyplan as bp
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.masses import center_of_mass
from bodyplan.solve.stability import DOWN, KINDS, Objective, center_and_slope, tip_margins
from robot_cases import random_robot
from solve_cases import LEGS, crouching, random_base

G = np.array(DOWN)


def random_stance(rng: np.random.Generator, *shape: int, feet: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Feet on rough ground and a centre of mass above some 0.3 m, inside of their hull or not."""
    points = rng.normal(size=(*shape, feet, 3)) * [0.3, 0.3, 0.05]
    return points, rng.normal(size=(*shape, 3)) * [0.1, 0.1, 0.03] + [0.0, 0.0, 0.3]


# --- margins ------------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 8))
def test_hull_and_distances_are_those_of_scipy(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    feet, com = random_stance(rng, feet=count)
    got = tip_margins(feet, G, com)
    hull = ConvexHull(feet[:, :2])
    clockwise = hull.vertices[::-1]  # SciPy goes round counter-clockwise
    assert got.count == len(clockwise)
    corners = got.edges[: got.count, 0]
    first = int(np.flatnonzero(clockwise == corners[0])[0])
    assert np.array_equal(np.roll(clockwise, -first), corners)
    assert np.array_equal(got.edges[: got.count, 1], np.roll(corners, -1))
    inside = -(hull.equations[:, :2] @ com[:2] + hull.equations[:, 2])
    assert np.abs(np.sort(inside) - np.sort(got.distance[: got.count])).max() < 1e-12
    assert np.all(got.edges[got.count :] == -1)
    for margin in (got.mu, got.angle, got.distance):
        assert np.all(np.isposinf(margin[got.count :]))
        assert np.all(np.sign(margin) == np.sign(got.distance))


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 8), st.booleans())
def test_any_direction_of_gravity_by_trying_all_pairs_of_feet(seed: int, count: int, inside: bool) -> None:
    """Without a hull: a pair of feet is an edge where the plane through it along gravity has all feet on one side."""
    rng = np.random.default_rng(seed)
    feet, gravity = rng.normal(size=(count, 3)), rng.normal(size=3) * rng.uniform(0.1, 10.0)
    share = rng.uniform(0.1, 1.0, count)
    com = share @ feet / share.sum() - rng.uniform(0.0, 1.0) * gravity
    if not inside:
        com = com + 10.0 * rng.normal(size=3)
    g = gravity / np.linalg.norm(gravity)
    mu, distance = [], []
    for i in range(count):
        for j in range(count):
            along = feet[j] - feet[i]
            inward = np.cross(along, g)
            if i == j or np.any((feet - feet[i]) @ inward < -1e-12):
                continue
            s = np.cross(feet[i] - com, feet[j] - com)
            mu.append(abs(s @ g) / np.linalg.norm(s) * np.sign((com - feet[i]) @ inward))
            distance.append((com - feet[i]) @ inward / np.linalg.norm(inward))
    got = tip_margins(feet, gravity, com)
    assert got.count == len(mu)
    assert np.abs(np.sort(got.mu[: got.count]) - np.sort(mu)).max() < 1e-9
    assert np.abs(np.sort(got.distance[: got.count]) - np.sort(distance)).max() < 1e-9
    assert got.stable == (min(distance) > 0.0)
    assert not inside or got.stable
    order = rng.permutation(count)
    again = tip_margins(feet[order], gravity, com)
    assert float(again.min_mu) == pytest.approx(min(mu), abs=1e-9)


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_mu_by_the_formulas_of_the_paper(seed: int) -> None:
    """(19), (21) with the edges clockwise seen from above, and the angle of the notes."""
    rng = np.random.default_rng(seed)
    feet, com = random_stance(rng, feet=5)
    got = tip_margins(feet, 9.81 * G, com)
    for k in range(got.count):
        i, j = got.edges[k]
        w, v = feet[i] - com, feet[j] - com
        s = np.cross(w, v) / np.linalg.norm(np.cross(w, v))
        assert got.mu[k] == pytest.approx(G @ s, abs=1e-13)
        e = (feet[j] - feet[i]) / np.linalg.norm(feet[j] - feet[i])
        across = G - (G @ e) * e
        assert np.sin(got.angle[k]) * np.linalg.norm(across) == pytest.approx(got.mu[k], abs=1e-13)
    assert got.min_mu == got.mu.min()
    assert got.min_angle == got.angle.min()
    assert got.min_distance == got.distance.min()
    assert bool(got.stable) == bool(got.min_distance > 0.0)
    assert got.tipping_edge.tolist() == got.edges[np.argmin(got.angle)].tolist()


def test_turning_about_the_edge_by_the_tip_angle_puts_the_mass_above_it() -> None:
    rng = np.random.default_rng(1)
    feet, com = random_stance(rng, 300)
    feet[..., 2] *= 0.1  # an angle beyond 90 deg has the sine of one below
    got = tip_margins(feet, G, com)
    for b in range(300):
        i, j = got.tipping_edge[b]
        e = (feet[b, j] - feet[b, i]) / np.linalg.norm(feet[b, j] - feet[b, i])
        # outwards over a clockwise edge is a right-handed turn against its direction
        R = bp.spatial.rotation_exp(-e * got.min_angle[b])
        over = feet[b, i] + R @ (com[b] - feet[b, i])
        assert abs(tip_margins(feet[b], G, over).mu).min() < 1e-13


def test_the_order_of_the_feet_does_not_matter() -> None:
    rng = np.random.default_rng(2)
    feet, com = random_stance(rng, 50, feet=6)
    got = tip_margins(feet, G, com)
    order = rng.permutation(6)
    other = tip_margins(feet[:, order], G, com)
    for name in ("min_mu", "min_angle", "min_distance"):
        assert np.abs(getattr(got, name) - getattr(other, name)).max() < 1e-15
    assert np.array_equal(np.sort(order[other.tipping_edge]), np.sort(got.tipping_edge))
    # as printed, mu of one and the same stable stance is all positive or all negative
    square, above = np.array([[1.0, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]]), np.array([0.1, 0.0, 0.5])

    def printed(ordered: np.ndarray) -> np.ndarray:
        w = ordered - above
        s = np.cross(w, np.roll(w, -1, axis=0))
        return np.asarray(s @ G / np.linalg.norm(s, axis=1))

    assert np.all(printed(square) > 0.0)  # clockwise seen from above
    assert np.all(printed(square[::-1]) < 0.0)
    crossed = printed(square[[0, 2, 1, 3]])
    assert crossed.min() < 0.0 < crossed.max()
    assert tip_margins(square[[0, 2, 1, 3]], G, above).stable


def test_every_frame_says_the_same() -> None:
    """Feet, gravity and centre of mass turned and moved together, as in the paper's body frame."""
    rng = np.random.default_rng(3)
    feet, com = random_stance(rng, 40)
    pose = random_base(rng, 40)
    R = bp.spatial.matrix_from_quaternion(pose[:, 3:])
    moved = np.einsum("bij,bkj->bki", R, feet) + pose[:, None, :3]
    got, other = (
        tip_margins(feet, G, com),
        tip_margins(moved, R @ G, np.einsum("bij,bj->bi", R, com) + pose[:, :3]),
    )
    for name in ("min_mu", "min_angle", "min_distance"):
        assert np.abs(getattr(got, name) - getattr(other, name)).max() < 1e-13


def test_far_from_the_origin_nothing_is_lost() -> None:
    rng = np.random.default_rng(4)
    feet, com = random_stance(rng)
    far = np.array([2.0**20, -(2.0**21), 2.0**10])  # representable with the feet's offsets rounded to 2^-32
    feet, com = (np.round(a * 2**30) / 2**30 for a in (feet, com))
    got, other = tip_margins(feet, G, com), tip_margins(feet + far, G, com + far)
    assert np.array_equal(got.mu, other.mu)
    assert np.array_equal(got.distance, other.distance)


def test_mass_height_does_not_change_who_is_stable() -> None:
    """With x and y of the centre of mass given, the sign of mu is: no lowering makes a robot stable."""
    rng = np.random.default_rng(5)
    feet, com = random_stance(rng, 500)
    up = np.array([0.0, 0.0, 1.0])
    signs = [np.sign(tip_margins(feet, G, com + z * up).mu) for z in (-0.2, -0.05, 0.0, 0.3, 2.0)]
    for sign in signs[1:]:
        assert np.array_equal(sign, signs[0])


def test_a_product_is_no_test_of_stability() -> None:
    """Beyond a corner two of three mu are negative. For feet at random around the centre of mass (normal in x and y)
    the share of unstable triangles with a positive product is that of directions nearer to an axis of an octant than
    to the plane of the two others: the area of a spherical triangle."""
    rng = np.random.default_rng(6)
    feet = np.concatenate([rng.normal(size=(40_000, 3, 2)), -np.ones((40_000, 3, 1))], axis=-1)
    mu = tip_margins(feet, G, np.zeros(3)).mu
    unstable = np.any(mu < 0.0, axis=-1)
    assert unstable.mean() == pytest.approx(0.75, abs=4.0 * np.sqrt(0.75 * 0.25 / 40_000))
    share = (2.0 * np.arccos(1.0 / np.sqrt(3.0)) - 0.5 * np.pi) / (0.5 * np.pi)
    positive = (np.prod(mu[unstable], axis=-1) > 0.0).mean()
    assert positive == pytest.approx(share, abs=4.0 * np.sqrt(share * (1 - share) / unstable.sum()))
    assert share > 0.2


def test_feet_in_one_line_and_feet_inside() -> None:
    line = np.array([[0.0, 0, 0], [0.1, 0, 0], [0.3, 0, 0]])
    got = tip_margins(line, G, [0.1, 0.02, 0.3])
    assert got.count == 2
    assert got.edges.tolist() == [[0, 2], [2, 0], [-1, -1]]
    assert got.distance[:2] == pytest.approx([-0.02, 0.02])
    assert not got.stable
    above = tip_margins(line, G, [0.1, 0.0, 0.3])
    assert (above.min_mu, above.min_angle, above.min_distance) == (0.0, 0.0, 0.0)
    square = np.array([[1.0, 1, 0], [-1, 1, 0], [0.1, 0.2, 0], [-1, -1, 0], [1, -1, 0], [1, 0, 0]])
    got = tip_margins(square, G, [0, 0, 1.0])
    assert got.count == 4
    assert {frozenset(e) for e in got.edges[:4].tolist()} == {frozenset(e) for e in ([0, 1], [1, 3], [3, 4], [4, 0])}
    assert got.angle[:4] == pytest.approx([np.pi / 4] * 4)
    twice = tip_margins(np.vstack([square, square]), G, [0, 0, 1.0])
    assert np.array_equal(twice.edges[:4], got.edges[:4])


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(3, 6))
def test_feet_in_one_line_carry_on_it_alone(seed: int, count: int) -> None:
    """Any line, any gravity: the way of the centre of mass to what is between the feet, seen along gravity; beyond an
    end the robot turns about that foot."""
    rng = np.random.default_rng(seed)
    start, way, gravity = rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    g = gravity / np.linalg.norm(gravity)
    feet = start + rng.permutation(np.append(rng.uniform(size=count - 2), [0.0, 1.0]))[:, None] * way
    level = way - (way @ g) * g
    length = float(np.linalg.norm(level))
    x, y = level / length, np.cross(g, level / length)
    along, across, height = rng.uniform(-1.0, 2.0) * length, rng.choice([0.0, rng.normal()]), rng.uniform(0.2, 2.0)
    com = start + along * x + across * y - height * g
    got = tip_margins(feet, gravity, com)
    assert got.count == 2
    beyond = max(-along, 0.0, along - length)
    away = np.hypot(beyond, across)
    assert got.min_distance == pytest.approx(-away, abs=1e-12)
    assert not got.stable or away < 1e-12
    if beyond > 0.0:
        below = height if along < 0.0 else height + way @ g  # the foot it tips over, below the centre of mass
        assert got.min_mu == pytest.approx(-away / np.hypot(away, below), abs=1e-12)
        assert got.min_angle == pytest.approx(-np.arctan2(away, abs(below)), abs=1e-12)
    h = 1e-6
    for kind in ("min_mu", "barrier") if across else ():  # on the line itself edges change sides
        psi = Objective(kind, k2=0.0, k3=0.0, sharpness=9.0, relax=0.05)
        by = [(psi(feet, com + h * e, gravity=gravity).value - psi(feet, com - h * e, gravity=gravity).value) / (2 * h)
              for e in np.eye(3)]  # fmt: skip
        at = psi(feet, com, gravity=gravity)
        assert np.abs(by - at.com).max() < 1e-5 * (1.0 + np.abs(at.feet).max())


def test_a_centre_of_mass_on_an_edge() -> None:
    feet = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0]])
    got = tip_margins(feet, G, [0.2, 0.0, 0.0])
    assert got.min_mu == got.min_angle == got.min_distance == 0.0
    assert got.tipping_edge.tolist() in ([0, 1], [1, 0])


@pytest.mark.parametrize("shape", [(), (1,), (4,), (2, 3), (0,)])
def test_batches(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(7)
    feet, com = random_stance(rng, *shape)
    got = tip_margins(feet, G, com)
    assert got.mu.shape == got.angle.shape == got.distance.shape == (*shape, 4)
    assert got.edges.shape == (*shape, 4, 2)
    assert np.shape(got.min_mu) == np.shape(got.stable) == np.shape(got.count) == shape
    for index in np.ndindex(shape):
        one = tip_margins(feet[index], G, com[index])
        assert np.array_equal(got.mu[index], one.mu)
        assert np.array_equal(got.edges[index], one.edges)


def test_batches_broadcast_and_are_shared_between_threads() -> None:
    rng = np.random.default_rng(8)
    feet, _ = random_stance(rng)
    coms = rng.normal(size=(20_000, 3)) * 0.2
    got = tip_margins(feet, np.tile(G, (20_000, 1)), coms)
    few = tip_margins(feet, G, coms[:7])
    assert np.array_equal(got.mu[:7], few.mu)
    assert np.array_equal(got.edges[-1], few.edges[0])


def test_refusals_of_margins() -> None:
    feet = np.eye(3)
    with pytest.raises(InputError, match=r"feet: expected shape \(..., m, 3\) with m >= 3"):
        tip_margins(feet[:2], G, np.zeros(3))
    with pytest.raises(InputError, match="gravity: must not be 0"):
        tip_margins(feet, np.zeros(3), np.zeros(3))
    with pytest.raises(InputError, match="com: expected shape"):
        tip_margins(feet, G, np.zeros(2))
    with pytest.raises(InputError, match="finite"):
        tip_margins(feet * np.nan, G, np.zeros(3))
    with pytest.raises(InputError, match="do not broadcast"):
        tip_margins(np.zeros((2, 3, 3)), G, np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"at \(1,\) all lie on one line along gravity"):
        tip_margins(np.stack([feet, np.outer([1.0, 2, 3], G)]), G, np.zeros(3))


# --- objectives ---------------------------------------------------------------------------------------------


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from(KINDS))
def test_gradients_are_differences(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    feet, com = random_stance(rng, feet=5)
    attitude, gravity = rng.normal(size=2) * 0.2, G + 0.2 * rng.normal(size=3)
    psi = Objective(kind, k1=1.3, k2=0.7, k3=0.4, height=0.2, k4=2.0, sharpness=9.0, relax=0.05)

    def difference(change: Any, steps: np.ndarray, h: float = 1e-5) -> np.ndarray:
        return np.array([(change(h * e) - change(-h * e)) / (2 * h) for e in steps])

    at = psi(feet, com, attitude, gravity)
    scale = 1.0 + np.abs(at.feet).max()
    by_com = difference(lambda e: psi(feet, com + e, attitude, gravity).value, np.eye(3))
    by_feet = difference(lambda e: psi(feet + e, com, attitude, gravity).value, np.eye(15).reshape(15, 5, 3))
    by_attitude = difference(lambda e: psi(feet, com, attitude + e, gravity).value, np.eye(2))
    assert np.abs(by_com - at.com).max() < 1e-5 * scale
    assert np.abs(by_feet - at.feet.ravel()).max() < 1e-5 * scale
    assert np.abs(by_attitude - at.attitude).max() < 1e-7
    # all moved together, only the height counts
    up = -gravity / np.linalg.norm(gravity)
    height = -2.0 * 2.0 * (up @ com - 0.2) * up
    assert np.abs(at.com + at.feet.sum(axis=0) - height).max() < 1e-12 * scale


def test_objectives_are_what_they_say() -> None:
    rng = np.random.default_rng(9)
    feet, com = random_stance(rng, 100, feet=3)
    a, b = attitude = rng.normal(size=(2, 100)) * 0.2
    mu, d = (getattr(tip_margins(feet, G, com), name) for name in ("mu", "distance"))
    k1, k2, k3 = 2.0, 0.3, 0.5
    tilt = k2 * a**2 + k3 * b**2

    def value(kind: str, **more: Any) -> np.ndarray:
        return np.asarray(Objective(kind, k1, k2, k3, **more)(feet, com, attitude.T).value)

    assert np.abs(value("printed") - k1 * np.prod(mu - tilt[:, None], axis=1)).max() < 1e-14
    assert np.abs(value("text") - (k1 * np.prod(mu, axis=1) - tilt)).max() < 1e-14
    smooth = value("min_mu", sharpness=80.0)
    below = k1 * mu.min(axis=1) - tilt - smooth
    assert np.all((below >= 0.0) & (below <= k1 * np.log(3.0) / 80.0))
    assert np.abs(value("min_mu", sharpness=1e5) - (k1 * mu.min(axis=1) - tilt)).max() < 1e-4
    inside = d.min(axis=1) > 0.01
    assert inside.sum() > 10
    barrier = value("barrier", relax=0.01)
    assert np.abs(barrier[inside] - (k1 * np.log(d[inside] / 0.01).sum(axis=1) - tilt[inside])).max() < 1e-12
    # outside it goes on smoothly, and downhill
    assert np.all(np.isfinite(barrier))
    edge = np.linspace(-0.05, 0.05, 4001)
    square = np.array([[1.0, 1, 0], [1, -1, 0], [-1, -1, 0], [-1, 1, 0]])
    walk = Objective("barrier", k2=0, k3=0, relax=0.01)(square, np.stack([1.0 - edge, 0 * edge, 1 + 0 * edge], axis=-1))
    assert np.all(np.diff(walk.value) > 0.0)
    assert np.abs(np.diff(walk.com[:, 0], 2)).max() < 1e-2 * np.abs(walk.com[:, 0]).max()


def test_with_the_body_frame_at_the_centre_of_mass_mu_does_not_see_attitude() -> None:
    rng = np.random.default_rng(10)
    robot = bp.silo4()
    feet, _ = random_stance(rng, feet=3)
    turns = random_base(rng, 30)
    turns[:, :3] = [0.02, -0.01, 0.25]
    mu = tip_margins(feet, G, turns[:, :3]).mu
    assert np.ptp(mu, axis=0).max() == 0.0
    at = bp.solve.model(robot, crouching(robot), turns[0])
    psi = Objective("text", k2=0.0, k3=0.0).at(at, com="base")
    assert np.abs(psi.coordinates[3:]).max() == 0.0
    level = Objective("text", k2=2.0, k3=3.0).at(at, com="base")
    roll, pitch = at.coordinates[3:5]
    assert np.abs(level.coordinates[3:] - [-4.0 * roll, -6.0 * pitch, 0.0]).max() < 1e-15


def test_the_printed_objective_crouches() -> None:
    """With x and y commanded, all that is left to it of mu is to lower the body, down to and through the ground; a
    height held stops that, and the barrier does not see height at all."""
    stance = np.array([[0.3, 0.28, 0.0], [0.28, -0.31, 0.01], [-0.3, 0.02, -0.01]])
    com = np.array([0.03, 0.01, 0.207])
    for kind in ("printed", "text", "min_mu"):
        climb = Objective(kind, k2=0.0, k3=0.0)
        heights = [com[2]]
        for _ in range(400):
            at = climb(stance, [com[0], com[1], heights[-1]])
            if heights[-1] < 0.0:
                break
            assert at.com[2] < 0.0
            heights.append(heights[-1] + max(0.002 * at.com[2] / abs(at.com[2]), -0.002))
        assert heights[-1] < 0.0
        held = Objective(kind, k2=0.0, k3=0.0, height=0.2, k4=1000.0)
        assert held(stance, [0.03, 0.01, 0.19]).com[2] > 0.0
    assert Objective("barrier", k2=0.0, k3=0.0)(stance, com).com[2] == pytest.approx(0.0, abs=1e-15)


# --- from psi to rho ----------------------------------------------------------------------------------------


def test_centre_of_mass_and_its_slope() -> None:
    rng = np.random.default_rng(11)
    robot = bp.silo4(passive=True)
    q = crouching(robot, rng)
    center, slope = center_and_slope(robot, q)
    assert np.abs(center - center_of_mass(robot, q)).max() < 1e-15
    for k in range(robot.n):
        e = 1e-6 * np.eye(robot.n)[k]
        want = (center_of_mass(robot, q + e) - center_of_mass(robot, q - e)) / 2e-6
        assert np.abs(slope[:, k] - want).max() < 1e-10
    with pytest.raises(InputError, match="has no mass"):
        center_and_slope(random_robot(np.random.default_rng(0), 2), np.zeros(99))


@settings(max_examples=25)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(KINDS),
    st.sampled_from(["own", "world"]),
    st.sampled_from(["twist", "world", "coordinates"]),
    st.sampled_from(["mass", "base", "point"]),
)
def test_rates_raise_psi_as_rho_says(seed: int, kind: str, axes: str, body: str, com: str) -> None:
    """d psi / dt along any motion, feet sliding and legs swinging, by differences of positions alone."""
    rng = np.random.default_rng(seed)
    robot = bp.silo4(passive=True)
    q = crouching(robot, rng)
    base = bp.solve.pose_from_coordinates(rng.normal(size=6) * [1, 1, 0.02, 0.1, 0.1, 1] + [0, 0, 0.2, 0, 0, 0])
    at = bp.solve.model(robot, q, base)
    stance = list(rng.permutation(LEGS)[:3])
    point = np.array([0.02, -0.01, 0.03])
    objective = Objective(kind, k2=0.5, k3=0.8, height=0.18, k4=3.0, sharpness=9.0, relax=0.03)
    psi = objective.at(at, stance, com=point if com == "point" else com)
    known = ["fl.foot.vx", "hr.foot.wy", "hl.knee", *(["body.z"] if body == "coordinates" else ["body.vz"])]
    part = bp.solve.partition(at, known=known, axes=axes, body=body)
    rates = bp.solve.resolve(part, 0.1 * rng.normal(size=4), rho=0.2 * rng.normal(size=len(part.unknown)))

    def value(h: float) -> float:
        pose = bp.spatial.compose(base, bp.spatial.exp(h * rates.twist))
        moved = q + h * rates.qd
        poses = robot.forward(moved, pose)
        mass = {"mass": center_of_mass(robot, moved, pose), "base": pose[:3], "point": bp.spatial.apply(pose, point)}
        attitude = bp.solve.coordinates_from_pose(pose)[3:5]
        return float(objective(np.array([poses[leg][:3] for leg in stance]), mass[com], attitude).value)

    assert psi.value == pytest.approx(value(0.0), rel=1e-12)
    want = (value(1e-5) - value(-1e-5)) / 2e-5
    assert psi.rate(rates) == pytest.approx(want, rel=1e-5, abs=1e-6)
    assert psi.rho(part) @ rates.X == pytest.approx(
        float(psi.rate(rates)) - sum_of_known(psi, part, rates), rel=1e-12, abs=1e-12
    )


def sum_of_known(psi: Any, part: Any, rates: Any) -> float:
    """What the known rates contribute, by a partition in which they are unknown."""
    free = bp.solve.partition(part.model, known=[], axes=part.axes, body=part.body)
    by = dict(zip(free.unknown, psi.rho(free), strict=True))
    return float(sum(by[name] * rates[name] for name in part.known))


def test_the_null_space_buys_stability_and_level() -> None:
    """The paper's case: feet, x, y and yaw given; height, roll and pitch free."""
    robot = bp.silo4()
    base = bp.solve.pose_from_coordinates([0.0, 0.0, 0.2, 0.06, -0.08, 0.2])
    at = bp.solve.model(robot, crouching(robot, np.random.default_rng(12)), base)
    stance = ["fl", "fr", "hl"]
    part = bp.solve.partition(
        at, known=[*(f"{leg}.foot.v" for leg in LEGS), "body.x", "body.y", "body.yaw"], axes="world"
    )
    Y = {f"{leg}.foot.v": 0.0 for leg in LEGS} | {"body.x": 0.02, "body.y": 0.0, "body.yaw": 0.0}
    for kind in KINDS:
        psi = Objective(kind).at(at, stance)
        off = bp.solve.resolve(part, Y, method="weighted")
        on = bp.solve.resolve(part, Y, method="weighted", gradient=psi.rho(part), d=0.05)
        assert on.residual < 1e-14
        assert psi.rate(on) > psi.rate(off)
        assert np.abs(on["fl.foot.v"]).max() < 1e-15


def test_batches_of_objectives() -> None:
    rng = np.random.default_rng(13)
    robot = bp.silo4()
    q = crouching(robot) + rng.uniform(-0.2, 0.2, (2, 3, robot.n))
    base = bp.solve.pose_from_coordinates(0.1 * rng.normal(size=(3, 6)) + [0, 0, 0.2, 0, 0, 0])
    known = [f"{leg}.foot.v" for leg in LEGS]
    for com in (None, "base"):
        at = bp.solve.model(robot, q, base)
        psi = Objective("barrier").at(at, com=com)
        part = bp.solve.partition(at, known=known, body="coordinates")
        assert psi.value.shape == (2, 3)
        assert psi.coordinates.shape == (2, 3, 6)
        assert psi.joints.shape == (2, 3, 12)
        rho = psi.rho(part)
        for index in np.ndindex(2, 3):
            one = Objective("barrier").at(bp.solve.model(robot, q[index], base[index[1]]), com=com)
            assert psi.value[index] == pytest.approx(float(one.value), abs=1e-13)
            single = bp.solve.partition(one.model, known=known, body="coordinates")
            assert np.abs(rho[index] - one.rho(single)).max() < 1e-11


def test_refusals_of_objectives() -> None:
    robot = bp.silo4()
    at = bp.solve.model(robot, crouching(robot))
    with pytest.raises(InputError, match=r"Objective\.kind: must be one of printed, text, min_mu, barrier"):
        Objective("zmp")
    for field, value in (("k1", 0.0), ("k2", -1.0), ("k4", -1.0), ("sharpness", 0.0), ("relax", -1.0)):
        with pytest.raises(InputError, match=f"Objective.{field}"):
            Objective(**{field: value})
    with pytest.raises(InputError, match=r"Objective\.height"):
        Objective(height=np.inf)
    with pytest.raises(InputError, match="attitude: needed"):
        Objective()(np.eye(3), np.zeros(3))
    with pytest.raises(InputError, match="attitude: expected shape"):
        Objective()(np.eye(3), np.zeros(3), np.zeros((2, 2)))
    with pytest.raises(InputError, match="model: expected a Model"):
        Objective().at(robot)  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="stance"):
        Objective().at(at, ["fl", "fr", "tail"])
    with pytest.raises(InputError, match="the same foot twice"):
        Objective().at(at, ["fl", "fl.foot", "hr"])
    with pytest.raises(InputError, match="com: must be 'mass', 'base'"):
        Objective().at(at, com="zmp")
    psi = Objective().at(at)
    other = bp.solve.partition(robot, crouching(robot), known=["fl.foot.v"])
    with pytest.raises(InputError, match="another model"):
        psi.rho(other)


def test_the_face_has_it() -> None:
    assert bp.stability is bp.solve.stability
    assert bp.stability.tip_margins is tip_margins
