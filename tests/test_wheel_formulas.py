"""Contacts of wheels on formulas, in kernels: the nearest ground there is, by samples and by the search on arrays."""

from __future__ import annotations

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.carry import orientation, search
from bodyplan.gaits.carry.contact import AXLE_BELOW, NO_GROUND, TOUCHES, UNPROVED, find
from bodyplan.gaits.carry.planes import Planes
from bodyplan.gaits.carry.pose import planes_of
from bodyplan.gaits.carry.wheels import Wheels

ROBOT = bp.tri_wheel()
SMOOTH = ["0.15*exp(-((x-0.2)**2 + y**2)/0.1)", "0.03*sin(20*x)*cos(17*y)", "0.3*x*y", "0.05*sin(30*x)", "0.3"]
CREASED = ["0.05-abs(0.3*(x+0.2*y)-0.15)", "0.1*max(sin(5*x),0.3*y)", "min(0.1*x**2,0.02)"]


def wheels_over(ground: bp.Surface, count: int, lean: float) -> Planes:
    """Planes of wheels at random places over the ground, upright or leaning."""
    rng = np.random.default_rng(3)
    xy = rng.uniform(-1.0, 1.0, (count, 2))
    z = ground.height(xy) + rng.uniform(0.1, 0.3, count)
    roll, pitch, heading = (
        lean * rng.uniform(-1.0, 1.0, count),
        rng.uniform(-0.4, 0.4, count),
        rng.uniform(-3, 3, count),
    )
    if lean == 0.0:
        pitch[:] = 0.0
    return planes_of(Wheels.of(ROBOT), np.column_stack([xy, z]), orientation.matrix(heading, roll, pitch))


@pytest.mark.parametrize("lean", [0.0, 0.4])
@pytest.mark.parametrize("formula", [*SMOOTH, *CREASED])
def test_no_point_of_the_ground_in_the_plane_is_nearer(formula: str, lean: float) -> None:
    ground = bp.Surface(formula)
    planes = wheels_over(ground, 60, lean)
    found = find(ground, planes)
    touch = np.flatnonzero(found.outcome == TOUCHES)
    assert len(touch) > 60
    assert set(np.unique(found.outcome)) <= {TOUCHES, AXLE_BELOW, UNPROVED}
    assert np.sum(found.outcome == UNPROVED) <= 4
    some = planes.take(touch)
    # every point of a disc in the plane that is nearer than the contact is above the ground
    angle, share = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 181), np.linspace(0.02, 1.0 - 1e-6, 60))
    s, w = (share * f(angle) for f in (np.sin, np.cos))
    radius = found.radius[touch, None, None, None]
    at = some.centre[:, None, None] + radius * (
        s[..., None] * some.ahead[:, None, None] + w[..., None] * some.up[:, None, None]
    )
    assert np.all(at[..., 2] > ground.height(at[..., 0], at[..., 1]))
    np.testing.assert_allclose(ground.height(found.point[touch]), found.point[touch, 2], rtol=0, atol=1e-12)


@pytest.mark.parametrize("formula", [*SMOOTH, *CREASED])
def test_the_search_is_that_on_arrays(formula: str) -> None:
    ground = bp.Surface(formula)
    planes = wheels_over(ground, 40, 0.3)
    found = find(ground, planes)
    touch = np.flatnonzero(found.outcome == TOUCHES)
    wanted = search.nearest(ground, planes.take(touch), np.zeros(len(touch)))
    good = wanted.certified
    assert good.sum() > 30
    np.testing.assert_allclose(found.radius[touch][good], wanted.distance[good], rtol=1e-11)


def test_a_start_decides_nothing() -> None:
    ground = bp.Surface(SMOOTH[1])
    planes = wheels_over(ground, 60, 0.3)
    plain, other = find(ground, planes), find(ground, planes, np.linspace(-1.0, 1.0, len(planes)))
    np.testing.assert_array_equal(plain.outcome, other.outcome)
    touch = plain.outcome == TOUCHES
    np.testing.assert_allclose(plain.radius[touch], other.radius[touch], rtol=1e-12)


def test_a_cell_whose_ends_are_not_found_is_not_given_up() -> None:
    """Newton along this wheel's plane fails at places next to the contact."""
    ground = bp.Surface("0.05*sin(30*x)")
    ahead = np.array([-0.56165929, -0.82736862, 0.0])
    up = np.array([-0.50416989, 0.3422558, 0.79288946])
    up /= np.linalg.norm(up)
    ahead /= np.linalg.norm(ahead)
    turn = np.linspace(0.0, 1e-3, 200)
    centre = np.array([-0.99781245, -0.41738096, 0.76045058]) + turn[:, None] * [1.0, 0.0, 0.0]
    planes = Planes.of(centre, np.tile(ahead, (200, 1)), np.tile(np.cross(up, ahead), (200, 1)))
    found = find(ground, planes)
    assert np.mean(found.outcome == TOUCHES) > 0.95
    radius = found.radius[found.outcome == TOUCHES]
    assert np.abs(np.diff(radius, 2)).max() < 1e-6


def test_ground_that_is_not_everywhere() -> None:
    """Where a formula is undefined there is no ground; a wheel that leans over its edge is judged, not refused."""
    ground = bp.Surface("0.2*sqrt(1 - x*x - y*y)")
    rng = np.random.default_rng(1)
    xy = rng.uniform(-1.0, 1.0, (80, 2))
    turn = orientation.matrix(rng.uniform(-3, 3, 80), rng.uniform(-0.4, 0.4, 80), rng.uniform(-0.4, 0.4, 80))
    planes = planes_of(Wheels.of(ROBOT), np.column_stack([xy, np.full(80, 0.4)]), turn)
    found = find(ground, planes)
    inside = np.hypot(*planes.centre[:, :2].T) < 1.0
    upright = planes.upright
    assert np.all(found.outcome[~inside & upright] == NO_GROUND)
    touch = found.outcome == TOUCHES
    assert touch.any()
    np.testing.assert_allclose(ground.height(found.point[touch]), found.point[touch, 2], rtol=0, atol=1e-12)
