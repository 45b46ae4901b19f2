"""Whether a hull touches the ground: against dense samples, and with little room where it hovers over a rough map."""

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.gaits.carry import hull

ROBOT = bp.tri_wheel()
GROUNDS = {
    "map": lambda rng: bp.HeightMap(rng.normal(0.0, 0.05, (12, 12)), cell=0.1),
    "ripples": lambda rng: bp.Surface("0.03*sin(25*x)*cos(19*y)"),
    "roof": lambda rng: bp.Surface("0.05-abs(0.3*x)"),
    "cliff": lambda rng: bp.Surface("0.04*tanh(80*(x+0.2*y))"),
}


def poses(ground, count, rng):
    low, high = np.maximum(ground.field_box[0], -0.5), np.minimum(ground.field_box[1], 0.5)
    xy = rng.uniform(low - 0.3, high + 0.3, (count, 2))
    turn = Rotation.from_rotvec(rng.normal(0.0, 0.2, (count, 3))).as_matrix()
    return np.column_stack([xy, rng.uniform(0.0, 0.35, count)]), turn


def lowest_gap(ground, position, turn):
    """m: of dense samples of all faces of a body's boxes, the least height over the ground that there is."""
    gaps = [np.inf]
    a, b = (v.ravel() for v in np.meshgrid(*(np.linspace(-1.0, 1.0, 201) for _ in range(2))))
    faces = [np.roll(np.stack([a, b, np.full_like(a, end)], axis=1), k, axis=1) for k in range(3) for end in (-1, 1)]
    for box, face in itertools.product(hull.boxes(ROBOT), faces):
        points = np.array(box.start) + face * np.array(box.half)
        x, y, z = (position + points @ turn.T).T
        low, high = ground.field_box
        on = (x >= low[0]) & (x <= high[0]) & (y >= low[1]) & (y <= high[1])
        if on.any():
            gaps.append(float((z[on] - ground.height(x[on], y[on])).min()))
    return min(gaps)


@pytest.mark.parametrize("name", GROUNDS)
def test_touches_where_samples_are_in_the_ground(name, monkeypatch):
    """Also beyond the edge of a map. Never more than some thousand parts of faces at a time: bounds of a map's heights
    are those of whole cells, and a face within them must not be cut down to its smallest parts."""
    rng = np.random.default_rng(5)
    ground = GROUNDS[name](rng)
    position, turn = poses(ground, 60, rng)
    most = 0
    whole = type(ground).field_bounds

    def watched(self, low, high):
        nonlocal most
        most = max(most, len(low))
        return whole(self, low, high)

    monkeypatch.setattr(type(ground), "field_bounds", watched)
    found = hull.touches(ROBOT, ground, position, turn)
    gaps = np.array([lowest_gap(ground, p, r) for p, r in zip(position, turn, strict=True)])
    # samples are some mm apart, the smallest parts 0.1 mm
    assert found[gaps < -2e-4].all() and not found[gaps > 3e-3].any()
    assert 10 < found.sum() < 55 and most < 60_000
