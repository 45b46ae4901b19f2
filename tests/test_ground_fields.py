"""Surfaces and height maps: derivatives, curvature and the spline against independent formulas."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.interpolate import RectBivariateSpline

from bodyplan.errors import InputError, MissingExtraError
from bodyplan.expressions import Expression
from bodyplan.ground import Ground, HeightMap, Plane, Surface, from_dict
from bodyplan.ground.heightfiles import MAX_SAMPLES


@pytest.fixture
def rng() -> np.random.Generator:
    """Fresh for every test, so that no test depends on those before it."""
    return np.random.default_rng(11)


def rough_map(rng: np.random.Generator, ny: int = 9, nx: int = 12) -> HeightMap:
    return HeightMap(rng.normal(size=(ny, nx)), (0.1, 0.13), (-0.5, 0.4))


def inside(ground: HeightMap, n: int, rng: np.random.Generator) -> np.ndarray:
    (x0, x1), (y0, y1) = ground.extent
    return rng.uniform([x0, y0], [x1, y1], (n, 2))


def test_the_waves_of_the_wheel_paper(rng: np.random.Generator) -> None:
    ground = Surface("sin(0.5*(x+y))/15")
    x, y = rng.uniform(-9.0, 9.0, (2, 50))
    s = 0.5 * (x + y)
    slope, bend = np.cos(s) / 30.0, -np.sin(s) / 60.0
    np.testing.assert_allclose(ground.height(x, y), np.sin(s) / 15.0, atol=1e-16)
    np.testing.assert_allclose(ground.gradient(x, y), np.stack([slope, slope], axis=-1), atol=1e-16)
    np.testing.assert_allclose(ground.hessian(x, y), bend[:, None, None] * np.ones((2, 2)), atol=1e-16)
    n = np.stack([-slope, -slope, np.ones(50)], axis=-1) / np.sqrt(1.0 + 2.0 * slope**2)[:, None]
    np.testing.assert_allclose(ground.normal(x, y), n, atol=1e-15)
    # a cylinder over a curve along the diagonal: one curvature is that of the curve
    kappa = 2.0 * bend / (1.0 + 2.0 * slope**2) ** 1.5
    expected = np.sort(np.stack([np.zeros(50), kappa], axis=-1), axis=-1)
    np.testing.assert_allclose(ground.curvature(x, y), expected, atol=1e-15)


def test_curvature_of_spheres_cylinders_and_paraboloids_off_the_apex(rng: np.random.Generator) -> None:
    x, y = rng.uniform(-1.0, 1.0, (2, 40))
    np.testing.assert_allclose(Surface("sqrt(4 - x**2 - y**2)").curvature(x, y), -0.5, rtol=1e-13)
    np.testing.assert_allclose(Surface("-sqrt(4 - x**2 - y**2)").curvature(x, y), 0.5, rtol=1e-13)
    cylinder = Surface("sqrt(4 - (0.6*x + 0.8*y)**2) + 0*x").curvature(x, y)
    np.testing.assert_allclose(cylinder, np.broadcast_to([-0.5, 0.0], (40, 2)), atol=1e-14)
    a, r2 = 1.7, x**2 + y**2
    w2 = 1.0 + 4.0 * a * a * r2
    meridian, parallel = 2.0 * a / w2**1.5, 2.0 * a / w2**0.5
    paraboloid = Surface("1.7*(x**2 + y**2)").curvature(x, y)
    np.testing.assert_allclose(paraboloid, np.stack([meridian, parallel], axis=-1), rtol=1e-13)


def test_curvature_has_the_mean_and_the_gauss_curvature_of_the_textbook(rng: np.random.Generator) -> None:
    ground = Surface("0.3*sin(2*x)*cos(3*y) + x*y - 0.2*x")
    x, y = rng.uniform(-1.0, 1.0, (2, 40))
    fx, fy = np.moveaxis(ground.gradient(x, y), -1, 0)
    h = ground.hessian(x, y)
    fxx, fxy, fyy = h[:, 0, 0], h[:, 0, 1], h[:, 1, 1]
    w2 = 1.0 + fx**2 + fy**2
    gauss = (fxx * fyy - fxy**2) / w2**2
    mean = ((1.0 + fx**2) * fyy - 2.0 * fx * fy * fxy + (1.0 + fy**2) * fxx) / (2.0 * w2**1.5)
    kappa = ground.curvature(x, y)
    assert np.all(kappa[:, 0] <= kappa[:, 1])
    np.testing.assert_allclose(kappa.prod(axis=1), gauss, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(kappa.mean(axis=1), mean, rtol=1e-12, atol=1e-13)


def test_surface_arguments() -> None:
    ground = Surface(Expression("x + y"), bounds=((0, 1), (0, 2)), friction=0.3)
    assert ground.extent == ((0.0, 1.0), (0.0, 2.0))
    assert ground.expression.text == "x + y"
    with pytest.raises(InputError, match=r"y = 2\.5 \(index \(1,\)\) is outside; it covers .* y from 0\.0 to 2\.0"):
        ground.height([0.5, 0.5], [1.0, 2.5])
    with pytest.raises(InputError, match="outside"):
        ground.clearance([1.5, 0.0, 0.0])
    for bad in (((1, 0), (0, 1)), (0, 1), ((0, 1), (0, np.inf))):
        with pytest.raises(InputError, match=r"Surface\.bounds"):
            Surface("x", bounds=bad)
    with pytest.raises(InputError, match="variables"):
        Surface(Expression("t", variables=("t",)))
    with pytest.raises(InputError, match="not allowed"):
        Surface("x.y")
    with pytest.raises(InputError, match=r"'log\(x\)'.*x = -1\.0, y = 0\.0"):
        Surface("log(x)").height(-1.0, 0.0)
    with pytest.raises(InputError, match="friction"):
        Surface("x", friction=-1.0)


def test_the_tip_of_a_cone_has_a_height_but_no_normal() -> None:
    cone = Surface("-sqrt(x**2 + y**2)")
    assert cone.height(0.0, 0.0) == 0.0
    assert cone.clearance([0.0, 0.0, 2.0]) == 2.0
    with pytest.raises(InputError, match="derivatives"):
        cone.normal(0.0, 0.0)


def test_spline_passes_through_the_samples(rng: np.random.Generator) -> None:
    z = rng.normal(size=(5, 7)) + 1000.0
    ground = HeightMap(z, (0.1, 0.2), (3.0, -1.0))
    x, y = 3.0 + 0.1 * np.arange(7), -1.0 + 0.2 * np.arange(5)
    np.testing.assert_allclose(ground.height(x[None, :], y[:, None]), z, rtol=1e-15)
    np.testing.assert_array_equal(ground.z, z)
    with pytest.raises(ValueError, match="read-only"):
        ground.z[0, 0] = 1.0
    assert ground.extent == ((3.0, pytest.approx(3.6)), (-1.0, pytest.approx(-0.2)))


@pytest.mark.parametrize(
    ("ny", "nx", "degree_y", "degree_x"),
    [(6, 5, 3, 3), (4, 9, 3, 3), (3, 4, 2, 3), (2, 3, 1, 2), (2, 2, 1, 1)],
)
def test_spline_is_exact_on_polynomials(
    ny: int, nx: int, degree_y: int, degree_x: int, rng: np.random.Generator
) -> None:
    c = rng.normal(size=(degree_y + 1, degree_x + 1))
    text = " + ".join(f"({float(c[j, i])!r})*x**{i}*y**{j}" for j in range(degree_y + 1) for i in range(degree_x + 1))
    exact = Surface(text)
    x, y = 0.2 + 0.3 * np.arange(nx), -0.7 + 0.25 * np.arange(ny)
    ground = HeightMap(exact.height(x[None, :], y[:, None]), (0.3, 0.25), (0.2, -0.7))
    p = inside(ground, 60, rng)
    np.testing.assert_allclose(ground.height(p), exact.height(p), atol=1e-13)
    np.testing.assert_allclose(ground.gradient(p), exact.gradient(p), atol=1e-12)
    np.testing.assert_allclose(ground.hessian(p), exact.hessian(p), atol=1e-10)


def test_spline_is_that_of_fitpack(rng: np.random.Generator) -> None:
    ground = rough_map(rng)
    x, y = -0.5 + 0.1 * np.arange(12), 0.4 + 0.13 * np.arange(9)
    other = RectBivariateSpline(y, x, ground.z, kx=3, ky=3, s=0)
    p = inside(ground, 200, rng)
    f, g, h = ground.height(p), ground.gradient(p), ground.hessian(p)
    orders = {
        (0, 0): f,
        (0, 1): g[:, 0],
        (1, 0): g[:, 1],
        (0, 2): h[:, 0, 0],
        (1, 1): h[:, 0, 1],
        (2, 0): h[:, 1, 1],
    }
    for (dy, dx), found in orders.items():
        expected = other.ev(p[:, 1], p[:, 0], dx=dy, dy=dx)
        np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_array_equal(h[:, 0, 1], h[:, 1, 0])


def test_spline_is_twice_continuously_differentiable_across_cells(rng: np.random.Generator) -> None:
    ground = rough_map(rng)
    for k in range(1, 11):
        y = np.linspace(0.41, 1.43, 23)
        left, right = (ground.hessian(-0.5 + 0.1 * k + side * 1e-11, y) for side in (-1.0, 1.0))
        np.testing.assert_allclose(left, right, atol=1e-6)
        left, right = (ground.gradient(-0.5 + 0.1 * k + side * 1e-11, y) for side in (-1.0, 1.0))
        np.testing.assert_allclose(left, right, atol=1e-7)


def test_derivatives_of_the_map_are_those_of_its_height(rng: np.random.Generator) -> None:
    ground, h = rough_map(rng), 1e-5
    p = 0.999 * (inside(ground, 100, rng) - [0.05, 0.92]) + [0.05, 0.92]
    for axis in range(2):
        step = h * np.eye(2)[axis]
        slope = (ground.height(p + step) - ground.height(p - step)) / (2 * h)
        np.testing.assert_allclose(ground.gradient(p)[:, axis], slope, atol=1e-5)
        bend = (ground.gradient(p + step) - ground.gradient(p - step)) / (2 * h)
        np.testing.assert_allclose(ground.hessian(p)[:, axis], bend, atol=2e-3)


def test_the_map_does_not_depend_on_origin_or_level(rng: np.random.Generator) -> None:
    z = rng.normal(size=(7, 8)) * 0.01
    near, far = HeightMap(z, 0.01), HeightMap(z + 4000.0, 0.01, (64.0, -32.0))
    p, shift = inside(near, 50, rng), np.array([64.0, -32.0])
    np.testing.assert_allclose(far.height(p + shift) - 4000.0, near.height(p), atol=1e-11)
    np.testing.assert_allclose(far.hessian(p + shift), near.hessian(p), rtol=1e-7, atol=1e-6)


def test_map_edges_and_refusals(rng: np.random.Generator) -> None:
    ground = rough_map(rng)
    (x0, x1), (y0, y1) = ground.extent
    assert ground.height([x0, x1, x1], [y0, y1, y0]).shape == (3,)
    with pytest.raises(
        InputError,
        match=r"point x = 9\.0, y = 1\.0 \(index \(1, 0\)\) is outside; it covers x from -0\.5",
    ):
        ground.height([[0.0], [9.0]], 1.0)
    for query in (ground.clearance, ground.gap, ground.nearest):
        with pytest.raises(InputError, match="outside"):
            query([0.0, y0 - 1e-6, 5.0])
    z = np.zeros((4, 5))
    z[2, 3] = np.nan
    with pytest.raises(InputError, match=r"HeightMap\.z.*nan at \(2, 3\)"):
        HeightMap(z, 0.1)
    zeros = np.zeros((2, 2))
    for arguments in (
        {"z": np.zeros(4)},
        {"z": np.zeros((1, 4))},
        {"z": "heights"},
        {"cell": 0.0},
        {"cell": (0.1, -0.1)},
        {"cell": (1, 2, 3)},
        {"origin": (0.0,)},
        {"scale": np.inf},
        {"friction": -2.0},
        {"z": np.broadcast_to(0.0, (2, MAX_SAMPLES))},
    ):
        with pytest.raises(InputError):
            HeightMap(**{"z": zeros, "cell": 0.1, **arguments})  # type: ignore[arg-type]


def test_scale_multiplies_heights_only(rng: np.random.Generator) -> None:
    z = rng.normal(size=(5, 5))
    a, b = HeightMap(z, 0.5, scale=3.0), HeightMap(3.0 * z, 0.5)
    assert a == b
    assert from_dict(json.loads(json.dumps(a.to_dict()))) == b
    large = HeightMap(rng.normal(size=(80, 70)), 0.1)
    assert isinstance(large.to_dict()["z"], dict)
    for bad in (
        {"float64": "AAAA", "shape": [80, 70]},
        {"float64": "??", "shape": [80, 70]},
        {"shape": [2, 2]},
        {"float64": "", "shape": [10**9, 10**9]},
        {"float64": "", "shape": 3},
    ):
        with pytest.raises(InputError, match=r"HeightMap\.z"):
            from_dict({**large.to_dict(), "z": bad})


def test_real_terrain() -> None:
    ground = HeightMap.jacksboro(scale=1e-4)
    assert ground.z.shape == (344, 403)
    assert ground.z.min() == 0.0
    # 1076 m - 236 m; 1/1200 degree of a meridian; the same of the parallel at 36.59 degrees north
    np.testing.assert_allclose(ground.z.max(), 0.084, rtol=1e-12)
    np.testing.assert_allclose(ground.cell[1], 1e-4 * 111_195.08 / 1200.0, rtol=1e-6)
    np.testing.assert_allclose(ground.cell[0] / ground.cell[1], np.cos(np.radians(36.589583)), rtol=1e-6)
    (x0, x1), (y0, y1) = ground.extent
    np.testing.assert_allclose([x0 + x1, y0 + y1], 0.0, atol=1e-12)
    part = HeightMap.jacksboro(scale=1e-4, size=0.5, relief=2.0, friction=0.6)
    assert part.extent[0][0] <= -0.25
    assert part.extent[1][1] >= 0.25
    assert part.z.size < 5000
    assert part.friction == 0.6
    k = part.z.shape
    rows, columns = (344 - k[0]) // 2, (403 - k[1]) // 2
    middle = ground.z[rows : rows + k[0], columns : columns + k[1]]
    np.testing.assert_allclose(part.z, 2.0 * (middle - middle.min()), atol=1e-15)
    with pytest.raises(InputError, match="scale"):
        HeightMap.jacksboro(scale=0.0)


def test_terrain_says_when_matplotlib_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.cbook", None)
    with pytest.raises(MissingExtraError, match=r"bodyplan\[report\]"):
        HeightMap.jacksboro()


@pytest.mark.parametrize("ground", [Surface("0.05*sin(9*x)*cos(7*y)", friction=0.4), HeightMap.jacksboro(size=0.6)])
def test_fields_for_physics_follow_the_ground(ground: Ground) -> None:
    (solid,) = ground.solids([-0.2, -0.25, -1.0], [0.25, 0.2, 1.0])
    assert (solid.kind, solid.role, solid.friction) == ("field", "floor", ground.friction)  # type: ignore[attr-defined]
    assert solid.z is not None
    ny, nx = solid.z.shape
    x = solid.position[0] + solid.cell[0] * np.arange(nx)
    y = solid.position[1] + solid.cell[1] * np.arange(ny)
    np.testing.assert_allclose([x[0], x[-1], y[0], y[-1]], [-0.2, 0.25, -0.25, 0.2], rtol=1e-12)
    np.testing.assert_allclose(solid.z, ground.height(x[None, :], y[:, None]), atol=1e-15)
    # in the middle of a cell flat facets are off most
    middle = ground.height(0.5 * (x[1:] + x[:-1])[None, :], 0.5 * (y[1:] + y[:-1])[:, None])
    for a, b in ((solid.z[1:, 1:], solid.z[:-1, :-1]), (solid.z[1:, :-1], solid.z[:-1, 1:])):
        assert np.abs(0.5 * (a + b) - middle).max() < 1.1e-4


def test_fields_are_cut_to_the_ground_and_bounded() -> None:
    ground = HeightMap.jacksboro(size=0.6)
    (x0, x1), (y0, _) = ground.extent
    (solid,) = ground.solids([-9.0, -9.0, 0.0], [9.0, 9.0, 1.0], cell=0.05)
    assert solid.z is not None
    assert solid.position[:2] == (x0, y0)
    assert max(solid.cell) <= 0.05
    np.testing.assert_allclose(solid.cell[0] * (solid.z.shape[1] - 1), x1 - x0)
    with pytest.raises(InputError, match="no ground"):
        ground.solids([2.0, 2.0, 0.0], [3.0, 3.0, 1.0])
    with pytest.raises(InputError, match="cell"):
        ground.solids([-9.0, -9.0, 0.0], [9.0, 9.0, 1.0], cell=1e-5)
    (wild,) = Surface("sin(1000*x)").solids([-1, -1, 0], [1, 1, 1])
    assert wild.z is not None
    assert wild.z.shape == (1024, 1024)
    assert Plane().solids([-1, -1, 0], [1, 1, 1])[0].kind == "plane"
