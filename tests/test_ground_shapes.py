"""Planes, corridors and profiles: closed forms, and distances to the boxes that they are made of."""

from __future__ import annotations

import json
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.ground import KINDS, Corridor, Ground, HeightMap, Plane, Profile, Solid, Surface, from_dict

STAIRS = Profile(
    floor=[(-np.inf, 0.0), (1.0, 0.5), (2.0, 0.2)],
    ceiling=[(None, None), (0.5, 1.4), (2.5, 0.9), (3.0, np.inf)],
)
_SEEDED = np.random.default_rng(3)
GROUNDS = [
    Plane(),
    Plane(0.3, slope=(0.2, -0.4), friction=0.7),
    Surface("sin(0.5*(x+y))/15", friction=0.5),
    Surface("x*y", bounds=((-2.0, 2.0), (-3.0, 3.0))),
    HeightMap(_SEEDED.normal(size=(6, 8)), (0.9, 1.1), (-3.0, -2.7), friction=0.2),
    HeightMap(_SEEDED.normal(size=(70, 80)), 0.1, (-3.95, -3.45)),
    Corridor(0.108, height=0.05, floor=-0.01, friction=0.05, wall_friction=1.0),
    STAIRS,
    Profile(-0.1, friction=0.4),
]


@pytest.fixture
def rng() -> np.random.Generator:
    """Fresh for every test, so that no test depends on those before it."""
    return np.random.default_rng(3)


def rotated_z(q: Sequence[float]) -> np.ndarray:
    """Third column of the rotation matrix of a quaternion wxyz."""
    w, x, y, z = q
    return np.array([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z])


def distance_to_solid(solid: Solid, p: np.ndarray) -> np.ndarray:
    """From points outside to an unturned box, or to a plane."""
    if solid.kind == "plane":
        return (p - np.array(solid.position)) @ rotated_z(solid.quaternion)
    assert solid.kind == "box"
    assert solid.quaternion == (1.0, 0.0, 0.0, 0.0)
    over = np.maximum(np.abs(p - np.array(solid.position)) - np.array(solid.half), 0.0)
    return np.asarray(np.linalg.norm(over, axis=-1))


@pytest.mark.parametrize("ground", GROUNDS, ids=lambda g: g.kind)
def test_descriptions_come_back_equal(ground: Ground) -> None:
    text = json.dumps(ground.to_dict(), allow_nan=False)
    again = from_dict(json.loads(text))
    assert again == ground
    assert hash(again) == hash(ground)
    assert type(again) is type(ground)
    x = np.linspace(-1.9, 1.9, 7)
    np.testing.assert_array_equal(again.height(x, -x), ground.height(x, -x))
    assert again != Plane(99.0)


@given(st.sampled_from(GROUNDS), st.sampled_from([(), (0,), (1,), (3,), (2, 1, 2), (0, 4)]))
@settings(max_examples=40, deadline=None)
def test_every_batch_shape(ground: Ground, shape: tuple[int, ...]) -> None:
    p = np.random.default_rng(5).uniform(-1.9, 1.9, (*shape, 3))
    expected = {"height": (), "gradient": (2,), "hessian": (2, 2), "normal": (3,), "curvature": (2,)}
    for name, tail in expected.items():
        method = getattr(ground, name)
        for result in (method(p), method(p[..., :2]), method(p[..., 0], p[..., 1])):
            assert result.shape == (*shape, *tail)
            assert isinstance(result, np.ndarray)
            np.testing.assert_array_equal(result, method(p))
    for result in (ground.gap(p), ground.clearance(p)):
        assert result.shape == shape
        assert isinstance(result, np.ndarray)
    for index in np.ndindex(shape):
        np.testing.assert_allclose(ground.clearance(p)[index], ground.clearance(p[index]), rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(ground.normal(p)[index], ground.normal(p[index]), rtol=1e-13, atol=1e-15)
    assert ground.height(np.zeros((2, 1)), np.zeros(3)).shape == (2, 3)


@pytest.mark.parametrize("ground", GROUNDS, ids=lambda g: g.kind)
def test_points_are_checked(ground: Ground) -> None:
    for bad in ([1.0], np.zeros((3, 4)), 1.0):
        with pytest.raises(InputError, match="shape"):
            ground.height(bad)
    with pytest.raises(InputError, match="shape"):
        ground.clearance([0.0, 0.0])
    with pytest.raises(InputError, match="finite"):
        ground.clearance([0.0, np.nan, 0.0])
    with pytest.raises(InputError, match="broadcast"):
        ground.height(np.zeros(2), np.zeros(3))
    with pytest.raises(InputError, match="low, high"):
        ground.solids([1.0, 0.0, 0.0], [0.0, 1.0, 1.0])
    with pytest.raises(AttributeError, match="cannot be changed"):
        ground.friction = 2.0  # type: ignore[attr-defined]


def test_registry_names_what_it_has() -> None:
    assert set(KINDS) == {"plane", "surface", "height_map", "corridor", "profile"}
    with pytest.raises(UnknownNameError, match="Did you mean 'plane'"):
        from_dict({"kind": "plain"})
    with pytest.raises(UnknownNameError, match=r"unknown field 'hight'.*Did you mean 'height'"):
        from_dict({"kind": "plane", "hight": 1.0})
    with pytest.raises(InputError, match="width is missing"):
        from_dict({"kind": "corridor"})
    with pytest.raises(InputError, match="kind"):
        from_dict({"height": 1.0})
    assert from_dict({"kind": "plane"}) == Plane()


def test_tilted_plane() -> None:
    plane = Plane(0.1, slope=(0.75, -1.0))
    n = np.array([-0.75, 1.0, 1.0]) / np.sqrt(0.75**2 + 2.0)
    np.testing.assert_allclose(plane.normal(2.0, 3.0), n, rtol=1e-15)
    np.testing.assert_allclose(plane.height(2.0, 3.0), 0.1 + 1.5 - 3.0, rtol=1e-15)
    foot = np.array([2.0, 3.0, 0.1 + 1.5 - 3.0])
    np.testing.assert_allclose(plane.clearance(foot + n * [[0.4], [0.0], [-0.3]]), [0.4, 0.0, -0.3], atol=1e-15)
    np.testing.assert_array_equal(plane.curvature(2.0, 3.0), [0.0, 0.0])
    np.testing.assert_allclose(plane.gap([0.0, 0.0, 1.0]), 0.9)
    (solid,) = plane.solids([-1.0, -2.0, 0.0], [3.0, 2.0, 1.0])
    np.testing.assert_allclose(rotated_z(solid.quaternion), n, rtol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(solid.quaternion), 1.0, rtol=1e-15)
    np.testing.assert_allclose(plane.clearance(solid.position), 0.0, atol=1e-15)
    for bad in ({"height": np.inf}, {"slope": (1.0,)}, {"friction": -0.1}, {"height": True}):
        with pytest.raises(InputError, match="Plane"):
            Plane(**bad)  # type: ignore[arg-type]


def test_corridor_distances() -> None:
    corridor = Corridor(0.4, height=0.1, floor=1.0)
    points = {
        (0.0, 0.0, 1.05): 0.05,  # above the floor
        (7.0, 0.17, 1.05): 0.03,  # beside a wall
        (7.0, -0.17, 1.05): 0.03,
        (0.0, 0.17, 1.14): np.hypot(0.03, 0.04),  # from the edge of the wall top
        (0.0, 0.25, 1.14): 0.04,  # over the wall
        (0.0, 0.21, 1.05): -0.01,  # inside it
        (0.0, -0.3, 1.08): -0.02,
        (0.0, 0.0, 0.9): -0.1,
        (0.0, 0.23, 0.96): -0.05,  # to the corner of wall and floor
        (0.0, 0.2, 1.05): 0.0,
        (0.0, 0.1, 1.0): 0.0,
    }
    np.testing.assert_allclose(corridor.clearance(list(points)), list(points.values()), atol=1e-15)
    np.testing.assert_array_equal(corridor.height([0.0] * 4, [0.0, 0.199, 0.2, -0.5]), [1.0, 1.0, 1.1, 1.1])
    np.testing.assert_array_equal(corridor.normal(0.0, 0.1), [0.0, 0.0, 1.0])
    for bad in ({"width": 0.0}, {"width": 1.0, "height": -1.0}, {"width": 1.0, "wall_friction": -1.0}):
        with pytest.raises(InputError, match="Corridor"):
            Corridor(**bad)


def test_profile_distances() -> None:
    points = {
        (0.7, 0.0, 0.9): np.hypot(0.3, 0.4),  # from the upper corner of the step at x = 1
        (0.9, 5.0, 0.2): 0.1,  # from its face
        (1.1, 0.0, 0.3): -0.1,  # inside it
        (1.05, 0.0, -0.4): -np.hypot(0.05, 0.4),  # to the lower corner, deep inside
        (1.5, 0.0, 0.8): 0.3,
        (1.5, 0.0, 1.2): 0.2,  # below the ceiling
        (2.3, 0.0, 1.1): 0.2,  # from the face of a ceiling step
        (2.6, 0.0, 0.85): 0.05,
        (2.7, 0.0, 1.0): -0.1,
        (3.1, 0.0, 1.0): 0.1,  # beyond the ceiling's end
        (3.3, 0.0, 0.5): 0.3,
        (0.2, 0.0, 1.8): np.hypot(0.3, 0.0),
        (1.0, 0.0, 0.3): 0.0,
        (-9.0, 0.0, 7.0): 7.0,
    }
    np.testing.assert_allclose(STAIRS.clearance(list(points)), list(points.values()), atol=1e-15)
    x = np.array([0.999, 1.0, 1.001, 1.999, 2.0, 2.001])
    np.testing.assert_array_equal(STAIRS.height(x, 0.0 * x), [0.0, 0.5, 0.5, 0.5, 0.5, 0.2])
    np.testing.assert_array_equal(
        STAIRS.ceiling_height([0.49, 0.5, 2.49, 2.5, 3.0, 3.01]), [np.inf, 1.4, 1.4, 0.9, 0.9, np.inf]
    )
    np.testing.assert_array_equal(STAIRS.breaks, [0.5, 1.0, 2.0, 2.5, 3.0])
    assert len(Profile(0.1).breaks) == 0


@pytest.mark.parametrize("ground", [Corridor(0.4, height=0.1, floor=1.0), STAIRS, Profile(0.0, 0.8), Plane(1.0)])
def test_clearance_is_the_distance_to_the_solids(ground: Ground, rng: np.random.Generator) -> None:
    low, high = np.array([-3.0, -2.0, -1.0]), np.array([6.0, 2.0, 3.0])
    solids = ground.solids(low, high)
    assert len({s.name for s in solids}) == len(solids)
    p = rng.uniform([-1.0, -0.8, -0.2], [4.0, 0.8, 1.8], (4000, 3))
    distance = np.min([distance_to_solid(s, p) for s in solids], axis=0)
    clearance = ground.clearance(p)
    assert np.count_nonzero(clearance > 0.0) > 1000
    np.testing.assert_allclose(clearance[clearance > 0.0], distance[clearance > 0.0], atol=1e-14)
    assert np.all(distance[clearance <= 0.0] <= 0.0)
    # inside, along the way to free space the clearance changes at most as fast as the point moves
    q = p + rng.normal(size=p.shape) * 0.05
    assert np.all(np.abs(ground.clearance(q) - clearance) <= np.linalg.norm(q - p, axis=1) + 1e-15)


def test_solids_have_roles_and_friction() -> None:
    corridor = Corridor(0.4, friction=0.1, wall_friction=0.9)
    found = [(s.role, s.friction) for s in corridor.solids([0, -1, 0], [1, 1, 1])]
    assert found == [("floor", 0.1), ("wall", 0.9), ("wall", 0.9)]
    stairs = STAIRS.solids([-1, -1, 0], [2.2, 1, 1])
    assert [s.role for s in stairs] == ["floor", "floor", "floor", "ceiling"]
    assert all(min(s.half) > 0.0 for s in stairs)


@pytest.mark.parametrize(
    ("floor", "ceiling"),
    [
        (0.0, 0.0),
        (0.0, -1.0),
        ([(0, 0.0), (1, 0.5)], 0.5),
        (0.0, [(0, 1.0), (2, -0.1), (3, 1.0)]),
        ([(0, 0.0), (1, 0.5)], [(0, 0.4), (1, 0.9)]),  # both rise at x = 1: the way is shut there
        ([(0, 0.0), (0, 1.0)], None),
        ([(1, 0.0), (0, 1.0)], None),
        ([(0, np.inf)], None),
        ([(0, None)], None),
        ([(0, 0.0), (-np.inf, 1.0)], None),
        ([(0, 0.0), (None, 1.0)], None),
        ([(np.nan, 0.0)], None),
        ([], None),
        ([(np.inf, 0.0)], None),
        ([1.0, 2.0], None),
        ("high", None),
        (0.0, [(0, -np.inf)]),
        (np.nan, None),
        (None, None),
        ([(0.0, 0.0)] * 20_000, None),
    ],
)
def test_profiles_that_cannot_be(floor: object, ceiling: object) -> None:
    with pytest.raises(InputError, match="Profile"):
        Profile(floor, ceiling)  # type: ignore[arg-type]


def test_a_step_of_no_height_is_no_step() -> None:
    assert Profile([(0.0, 0.1), (1.0, 0.1), (2.0, 0.3)]) == Profile([(None, 0.1), (2.0, 0.3)])
    assert Profile([(5.0, 0.1)]).to_dict()["floor"] == 0.1
