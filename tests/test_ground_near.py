"""Clearances up to a cap and of groups of points, on every kind of field: those of the points one by one."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest

from bodyplan.errors import InputError
from bodyplan.ground import HeightMap, Surface
from bodyplan.ground.field import Field
from bodyplan.ground.field_kernel import Room, top_over
from bodyplan.ground.near import clearance_up_to, segment_clearance_up_to
from bodyplan.ground.nearest_kernel import _smallest


def maps(rng: np.random.Generator, kind: str) -> HeightMap:
    ny, nx = rng.integers(2, 14, 2)
    z = rng.normal(size=(ny, nx)) * 10.0 ** rng.uniform(-2.0, 0.5)
    if kind == "steps":
        z = np.round(2.0 * z)
    if kind == "symmetric":  # ties
        z = z + z[::-1]
        z = z + z[:, ::-1]
    if kind == "spike":
        z = np.where(np.abs(z) == np.abs(z).max(), z, 0.0)
    if kind == "high":
        z = z + 100.0
    return HeightMap(z, tuple(10.0 ** rng.uniform(-1.0, 0.3, 2)), tuple(rng.normal(size=2)))


def points_over(ground: Field, rng: np.random.Generator, n: int) -> np.ndarray:
    """Points on both sides of the ground, on it, at its edges and corners, near and far."""
    low, high = np.clip(ground.field_box, -1.2, 1.2) if np.isinf(ground.field_box).any() else ground.field_box
    xy = rng.uniform(low, high, (n, 2))
    xy[:3, 0], xy[2:5, 1], xy[5] = low[0], high[1], high
    gap = rng.normal(size=n) * 10.0 ** rng.uniform(-3.0, 1.0, n)
    gap[6] = 0.0
    return np.concatenate([xy, (ground.height(xy) + gap)[:, None]], axis=1)


def sampled(ground: Field, p: np.ndarray) -> float:
    """A distance that is not less than that of the ground: the nearest of samples."""
    low, high = ground.field_box
    r = abs(p[2] - float(ground.height(p)))
    x, y = (
        np.clip(np.concatenate([np.linspace(c - r, c + r, 81), c + r * np.linspace(-0.1, 0.1, 41)]), a, b)
        for c, a, b in zip(p[:2], low, high, strict=True)
    )
    x, y = np.meshgrid(x, y)
    return float(np.sqrt((x - p[0]) ** 2 + (y - p[1]) ** 2 + (ground.height(x, y) - p[2]) ** 2).min())


def grounds(rng: np.random.Generator) -> list[Field]:
    a, b, c = 10.0 ** rng.uniform(-0.5, 0.8, 3)
    box = ((-1.2, 1.2), (-1.0, 1.1))
    return [
        *(maps(rng, kind) for kind in ("rough", "steps", "symmetric", "spike", "high")),
        Surface(f"0.2*sin({a}*x)*cos({b}*y)"),
        Surface(f"tanh({10.0 * a}*x)*{0.3 * b} + 0.1*y", bounds=box),
        Surface(f"max({a}*x, abs({b}*y - x)) - 0.2*abs(sin({c}*x))", bounds=box),
        Surface(f"sqrt(x**2 + {a}*y**2)*{b}"),
        Surface(f"sqrt(9 - x**2 - y**2)*{0.3 * a}", bounds=box),
    ]


@pytest.mark.parametrize("seed", range(4))
def test_caps_and_groups_are_those_of_single_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for ground in grounds(rng):
        p = points_over(ground, rng, 36)
        size = 1.0 + np.abs(p).max()
        clearance = ground.clearance(p)
        apart = np.abs(ground.gap(p)) > 1e-13 * size
        np.testing.assert_array_equal(clearance[apart] < 0.0, ground.gap(p)[apart] < 0.0)
        for q, c in zip(p[:8], clearance, strict=False):
            assert abs(c) <= sampled(ground, q) + 1e-11 * size
        cap = np.abs(rng.normal(size=36)) * 10.0 ** rng.uniform(-2.0, 1.0)
        cap[:4], cap[4] = (0.0, -0.1, 1e3, np.inf), 1e-12
        near = clearance_up_to(ground, p, cap)
        np.testing.assert_allclose(near, np.minimum(clearance, cap), rtol=0.0, atol=1e-11 * size)
        places, distance = ground.nearest_up_to(p.reshape(6, 6, 3), cap[:6])
        least = clearance.reshape(6, 6).min(axis=1)
        np.testing.assert_allclose(distance, np.minimum(least, cap[:6]), rtol=0.0, atol=1e-11 * size)
        found = ~np.isnan(places[:, 0])
        np.testing.assert_array_equal(found, distance < cap[:6])
        places = places[found]
        there = np.concatenate([places, ground.field_jet(*places.T)[0][:, None]], axis=1)
        apart = np.linalg.norm(there[:, None] - p.reshape(6, 6, 3)[found], axis=-1)
        np.testing.assert_allclose(np.abs(apart - np.abs(distance[found])[:, None]).min(axis=1), 0.0, atol=1e-11 * size)


def test_many_far_points_are_settled_together_as_if_one_by_one() -> None:
    rng = np.random.default_rng(5)
    for ground in grounds(rng):
        (x0, y0), (x1, y1) = np.clip(ground.field_box, -1.0, 1.0) if isinstance(ground, Surface) else ground.field_box
        x, y = np.meshgrid(np.linspace(x0, x1, 18), np.linspace(y0, y1, 15))
        z = ground.height(x, y)
        p = np.stack([x, y, np.where(x < 0.5 * (x0 + x1), z.max() + 2.0, z + 0.3)], axis=-1)
        want = np.array([float(clearance_up_to(ground, q, 0.5)) for q in p.reshape(-1, 3)]).reshape(x.shape)
        np.testing.assert_allclose(clearance_up_to(ground, p, 0.5), want, rtol=0.0, atol=1e-12)
        ends = np.stack([p[::3, :-1], p[::3, 1:]], axis=-2)
        want = np.minimum(ground.segment_clearance(ends), 0.5)
        np.testing.assert_allclose(segment_clearance_up_to(ground, ends, 0.5), want, rtol=0.0, atol=1e-11)


def test_a_point_without_ground_is_refused_however_far_and_among_however_many() -> None:
    p = np.tile([0.1, 0.2, 50.0], (700, 1))
    for ground, place in (
        (HeightMap(np.zeros((5, 5)), 0.2), (0.81, 0.1)),
        (Surface("x", bounds=((0.0, 1.0), (0.0, 1.0))), (0.1, -0.01)),
        (Surface("sqrt(1 - x)"), (1.01, 0.0)),
        (Surface("log(x + 1) + y"), (-1.5, 0.0)),
        (Surface("atan(1/(x - 0.7))"), (0.7, 0.0)),
        (Surface("max(asin(y), 0.1)"), (0.0, 1.2)),
        (Surface("(1 - y)**2.5"), (0.3, 1.1)),
        (Surface("0.1*tanh(exp(x))"), (800.0, 0.0)),
    ):
        assert np.all(clearance_up_to(ground, p, 1.0) == 1.0)
        among = p.copy()
        among[613, :2] = place
        with pytest.raises(InputError, match=r"outside|not finite"):
            clearance_up_to(ground, among, 1.0)
        with pytest.raises(InputError, match=r"outside|not finite"):
            segment_clearance_up_to(ground, among.reshape(-1, 2, 3), 1.0)
        with pytest.raises(InputError, match=r"outside|not finite"):
            ground.nearest(among[612:615] - [0.0, 0.0, 49.0])


def test_the_rounding_of_an_edge_is_forgiven() -> None:
    ground = HeightMap(np.random.default_rng(2).normal(size=(7, 4)) * 0.1, (0.1, 0.3), (0.7, -0.2))
    high = ground.field_box[1]
    p = np.array([*(high * (1.0 + 1e-15)), 0.4])
    np.testing.assert_allclose(ground.clearance(p), ground.clearance([*high, 0.4]), rtol=1e-12)


@pytest.mark.parametrize("formula", ["sqrt(1.3 - x)", "(x + 1)**1.5*y", "0.3*abs(x) - min(y, x)", "1/(x - 0.2)"])
def test_a_top_is_told_only_where_all_the_ground_is_defined(formula: str) -> None:
    ground, rng = Surface(formula), np.random.default_rng(3)
    arrays = ground.field_arrays
    room, told = Room.of(arrays, 4), 0
    for _ in range(300):
        low = rng.uniform(-2.0, 2.0, 2)
        high = low + rng.uniform(0.0, 1.0, 2)
        top = top_over(arrays, *low, *high, room)
        x, y = rng.uniform(low, high, (50, 2)).T
        heights = ground.field_jet(x, y)[0]
        if np.isfinite(top):
            told += 1
            assert np.all(heights <= top)
        else:
            assert formula != "0.3*abs(x) - min(y, x)"
    assert told > 20


def test_the_smallest_of_many_with_ties() -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        values = rng.integers(0, 9, rng.integers(1, 40)).astype(float)
        k = int(rng.integers(1, len(values) + 1))
        want = np.sort(values)[:k]
        assert _smallest(values.copy(), k) == (want[-1], np.count_nonzero(want == want[-1]))


def test_the_centre_of_a_bowl_ties_everywhere() -> None:
    bowl = Surface("-sqrt(1 - x**2 - y**2)")
    np.testing.assert_allclose(bowl.clearance([0.0, 0.0, 0.0]), 1.0, rtol=1e-9)
    np.testing.assert_allclose(clearance_up_to(bowl, [0.0, 0.0, 0.0], 0.999), 0.999)


def test_equal_maps_have_one_hash_in_every_process() -> None:
    z = np.random.default_rng(6).normal(size=(80, 90))
    one, two = HeightMap(z, 0.1), HeightMap(z.copy(), 0.1)
    assert one == two and hash(one) == hash(two)
    assert one != HeightMap(z + 1e-12, 0.1)
    assert one != HeightMap(z, 0.1, friction=0.5)
    assert one != HeightMap(z, 0.2)
    code = "import pickle, sys; g = pickle.load(sys.stdin.buffer); print(hash(g), hash(type(g)(g.z, g.cell)))"
    told = subprocess.run(
        [sys.executable, "-c", code], input=pickle.dumps(one), capture_output=True, check=True
    ).stdout.split()
    assert told == [str(hash(one)).encode()] * 2
