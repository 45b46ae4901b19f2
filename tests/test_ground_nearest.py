"""Clearance over surfaces and maps: closed forms, and brute force over everything in reach."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.ground import HeightMap, Surface
from bodyplan.ground.field import Field


@pytest.fixture
def rng() -> np.random.Generator:
    """Fresh for every test, so that no test depends on those before it."""
    return np.random.default_rng(17)


def brute_force(ground: Field, points: np.ndarray, first: int = 601) -> np.ndarray:
    """Distances (n,) from samples of the whole disc in reach, refined ten times around the best one."""
    (x0, x1), (y0, y1) = ground.extent
    out = []
    for p in points:
        centre, r, best = p[:2], abs(p[2] - float(ground.height(p))) + 1e-9, np.inf
        for k in range(11):
            n = first if k == 0 else 61
            xs = np.linspace(max(centre[0] - r, x0), min(centre[0] + r, x1), n)
            ys = np.linspace(max(centre[1] - r, y0), min(centre[1] + r, y1), n)
            x, y = np.meshgrid(xs, ys)
            d = np.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + (ground.height(x, y) - p[2]) ** 2)
            i = np.unravel_index(d.argmin(), d.shape)
            centre, r, best = np.array([x[i], y[i]]), r / 6.0, min(best, float(d[i]))
        out.append(best)
    return np.array(out)


@pytest.mark.parametrize(
    "text",
    [
        "sin(0.5*(x+y))/15",
        "0.02*sin(6*x)*cos(5*y)",
        "0.3*sin(20*x)*cos(15*y) + 0.1*x",
        "tanh(10*x)/3 + y/10",
        "x**3 - 3*x*y**2",
        "exp(-8*(x**2 + y**2))",
    ],
)
def test_nothing_in_reach_is_nearer(text: str, rng: np.random.Generator) -> None:
    ground = Surface(text)
    p = rng.uniform([-1.0, -1.0, -0.6], [1.0, 1.0, 1.0], (8, 3))
    clearance, brute = ground.clearance(p), brute_force(ground, p)
    np.testing.assert_array_equal(np.sign(clearance), np.sign(p[:, 2] - ground.height(p)))
    assert np.all(np.abs(clearance) <= brute + 1e-12)
    assert np.all(np.abs(clearance) >= brute - 1e-9)


@pytest.mark.parametrize(
    "text",
    ["-abs(x) + 0.3*max(y, x - 1) + 0.1*x*y", "min(abs(x - 0.3), abs(y), 0.2)"],
)
def test_nothing_in_reach_is_nearer_on_creased_ground(text: str, rng: np.random.Generator) -> None:
    ground = Surface(text)
    p = rng.uniform([-1.0, -1.0, -0.6], [1.0, 1.0, 1.0], (8, 3))
    clearance, brute = np.abs(ground.clearance(p)), brute_force(ground, p)
    assert np.all(clearance <= brute + 1e-12)
    # the refined grid loses its way along a crease that runs askew: it knows the distance there to 1e-6 only
    assert np.all(clearance >= brute - 1e-6)


def test_nearest_points_on_a_curved_crease(rng: np.random.Generator) -> None:
    ground = Surface("0.3*max(sin(5*x), 0.2*y)")
    p = rng.uniform([-0.5, -2.0, -0.6], [0.5, 2.0, -0.35], (40, 3))
    foot = ground.nearest(p)
    on_crease = np.abs(np.sin(5.0 * foot[:, 0]) - 0.2 * foot[:, 1]) < 1e-9
    assert np.count_nonzero(on_crease) >= 5
    centre, r = np.zeros((40, 1)), 1.0
    for _ in range(5):  # the crease is the curve y = 5 sin(5x): a search along one line
        x = centre + np.linspace(-r, r, 20_001)
        d = np.sqrt(
            (x - p[:, :1]) ** 2 + (5.0 * np.sin(5.0 * x) - p[:, 1:2]) ** 2 + (0.3 * np.sin(5.0 * x) - p[:, 2:]) ** 2
        )
        centre, r = np.take_along_axis(x, d.argmin(axis=1)[:, None], axis=1), r / 100.0
    along = d.min(axis=1)
    clearance = np.abs(ground.clearance(p))
    assert np.all(clearance <= along * (1.0 + 1e-11))
    np.testing.assert_allclose(clearance[on_crease], along[on_crease], rtol=1e-11)
    np.testing.assert_allclose(clearance, np.minimum(along, brute_force(ground, p, 301)), atol=1e-9)


def test_nothing_in_reach_is_nearer_on_rough_maps(rng: np.random.Generator) -> None:
    rough = HeightMap(rng.normal(size=(9, 12)) * 0.1, (0.1, 0.13), (-0.5, -0.5))
    (x0, x1), (y0, y1) = rough.extent
    p = rng.uniform([x0, y0, -0.5], [x1, y1, 0.5], (25, 3))
    brute = brute_force(rough, p, 301)
    np.testing.assert_allclose(np.abs(rough.clearance(p)), brute, atol=1e-8)
    assert np.all(np.abs(rough.clearance(p)) <= brute + 1e-12)
    terrain = HeightMap.jacksboro()
    p = rng.uniform([-1.0, -1.0, 0.0], [1.0, 1.0, 0.3], (8, 3))
    np.testing.assert_allclose(np.abs(terrain.clearance(p)), brute_force(terrain, p, 401), atol=1e-8)


def test_the_nearest_point_lies_on_the_ground_along_the_normal(rng: np.random.Generator) -> None:
    ground = Surface("0.3*sin(4*x)*cos(3*y)")
    p = rng.uniform([-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], (3, 20, 3))
    foot = ground.nearest(p)
    assert foot.shape == p.shape
    np.testing.assert_allclose(foot[..., 2], ground.height(foot), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(p - foot, axis=-1), np.abs(ground.clearance(p)), atol=1e-15)
    np.testing.assert_allclose(p - foot, ground.clearance(p)[..., None] * ground.normal(foot), atol=1e-8)


def test_spheres(rng: np.random.Generator) -> None:
    hill = Surface("sqrt(1 - x**2 - y**2)")
    direction = rng.normal(size=(40, 3))
    direction[:, 2] = np.abs(direction[:, 2]) + 0.5
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    # inside, the ray of the direction stays above the rim of the cap only for points high enough
    radius = rng.uniform(0.5, 1.0 / np.abs(direction[:, :2]).sum(axis=1).max(), 40)
    p = radius[:, None] * direction
    p = p[np.hypot(p[:, 0], p[:, 1]) < 0.99]
    np.testing.assert_allclose(hill.clearance(p), np.linalg.norm(p, axis=1) - 1.0, atol=1e-12)
    # below its centre plane the rim of the cap is nearest, where the formula ends
    below = np.array([0.3, 0.4, -0.7])
    np.testing.assert_allclose(hill.clearance(below), -np.hypot(0.5, 0.7), rtol=1e-9)
    bowl = Surface("1 - sqrt(1 - x**2 - y**2)")
    p = np.array([0.0, 0.0, 1.0]) - 0.7 * direction * [1.0, 1.0, 1.0]
    np.testing.assert_allclose(bowl.clearance(p), 0.3, atol=1e-12)
    # at the centre all of the bowl ties
    np.testing.assert_allclose(bowl.clearance([0.0, 0.0, 1.0]), 1.0, rtol=1e-12)


def test_paraboloid_on_its_axis() -> None:
    bowl = Surface("x**2 + y**2")
    z = np.array([0.05, 0.3, 0.5, 0.6, 1.0, 4.0])
    p = np.stack([0.0 * z, 0.0 * z, z], axis=1)
    # below the focus of curvature the vertex is nearest, above it a circle of ties
    expected = np.where(z <= 0.5, z, np.sqrt(np.maximum(z - 0.25, 0.0)))
    np.testing.assert_allclose(bowl.clearance(p), expected, rtol=1e-9)
    np.testing.assert_allclose(bowl.clearance(-p), -z, rtol=1e-12)


def test_tilted_plane_and_points_on_the_ground(rng: np.random.Generator) -> None:
    ground = Surface("0.75*x - y + 0.1")
    p = rng.normal(size=(50, 3))
    expected = (p[:, 2] - ground.height(p)) / np.sqrt(1.0 + 0.75**2 + 1.0)
    np.testing.assert_allclose(ground.clearance(p), expected, atol=1e-14)
    waves = Surface("0.2*sin(7*x)*cos(y)")
    p[:, 2] = waves.height(p)
    np.testing.assert_array_equal(waves.clearance(p), 0.0)


def test_ridges_and_tips() -> None:
    roof = Surface("-2*abs(x)")
    # P over the ridge, in the wedge between the normals of its sides, is nearest to the ridge itself
    p = np.array([[0.3, 0.7, 0.5], [-0.1, 0.0, 0.4], [1.0, 0.2, 0.1]])
    side = 2.1 / np.sqrt(5.0)
    np.testing.assert_allclose(roof.clearance(p), [np.hypot(0.3, 0.5), np.hypot(0.1, 0.4), side], rtol=1e-11)
    pyramid = Surface("-abs(x) - abs(y)")
    np.testing.assert_allclose(pyramid.clearance([0.1, -0.2, 0.8]), np.sqrt(0.69), rtol=1e-10)
    cone = Surface("-sqrt(x**2 + y**2)")
    np.testing.assert_allclose(cone.clearance([0.1, -0.2, 0.8]), np.sqrt(0.69), rtol=1e-10)
    np.testing.assert_allclose(cone.clearance([1.0, 0.0, 0.0]), np.sqrt(0.5), rtol=1e-10)
    # a curved ridge: the circle of radius 1, seen from inside it and above
    rim = Surface("-abs(x**2 + y**2 - 1)")
    np.testing.assert_allclose(rim.clearance([0.9, 0.0, 0.3]), np.hypot(0.1, 0.3), rtol=1e-10)


def test_the_edge_of_the_ground_is_nearest_where_the_foot_lies_beyond() -> None:
    ground = Surface("x", bounds=((0.0, 1.0), (-1.0, 1.0)))
    # over the upper edge the perpendicular foot would be at x > 1
    np.testing.assert_allclose(ground.clearance([0.9, 0.2, 2.0]), np.hypot(0.1, 1.0), rtol=1e-12)
    np.testing.assert_allclose(ground.clearance([0.5, 0.2, 1.0]), 0.5 / np.sqrt(2.0), rtol=1e-12)
    ramp = HeightMap([[0.0, 1.0], [0.0, 1.0]], 1.0)
    np.testing.assert_allclose(ramp.clearance([0.9, 0.2, 2.0]), np.hypot(0.1, 1.0), rtol=1e-12)


@given(st.integers(0, 10_000), st.floats(1.0, 30.0), st.floats(0.01, 0.5))
@settings(max_examples=25, deadline=None)
def test_clearance_moves_no_faster_than_the_point(seed: int, waves: float, height: float) -> None:
    rng = np.random.default_rng(seed)
    ground = Surface(f"{height!r}*sin({waves!r}*x + 0.3)*cos({0.7 * waves!r}*y)")
    a = rng.uniform(-0.5, 0.5, (30, 3))
    b = a + 0.1 * rng.normal(size=a.shape)
    moved = np.abs(ground.clearance(a) - ground.clearance(b))
    assert np.all(moved <= np.linalg.norm(a - b, axis=1) * (1.0 + 1e-9))
    assert np.all(np.abs(ground.clearance(a)) <= np.abs(ground.gap(a)) * (1.0 + 1e-12))
