"""Statics: batches, units, contacts that do not touch, refusals, and what is said without the solver."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import InputError, MissingExtraError, UnknownNameError
from statics_cases import FLAT, UP, WHEELS, excess, left_over, on_slope, rough

forces, needs, interval = bp.solve.contact_forces, bp.solve.required_friction, bp.solve.torque_interval
COM = np.array([0.0, 0.0, 0.15])


def swaying(samples: int, k: int = 4) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A body whose contacts and centre of mass move smoothly; it slips at times."""
    points, normals, com = rough(5, k)
    t = np.linspace(0.0, 1.0, samples)
    phase = np.arange(3 * k).reshape(k, 3)
    points = points + 0.05 * np.sin(6.0 * t[:, None, None] + phase)
    normals = normals + 0.25 * np.sin(5.0 * t[:, None, None] + 2.0 * phase) * [1.0, 1.0, 0.0]
    return points, normals, com + np.outer(t, [0.9, 0.2, 0.0])


@pytest.mark.parametrize("objective", ["min_norm", "min_ratio"])
def test_a_batch_is_its_items(objective: str) -> None:
    points, normals, com = swaying(24)
    mu = 0.25
    touching = np.ones((24, 4), dtype=bool)
    touching[[4, 5, 10], [0, 1, 2]], touching[12, :3] = False, False
    batch = forces(points, normals, com, 7.0, mu, objective, touching=touching)
    assert set(batch.status.tolist()) == {"ok", "slips", "tips_over"}
    for i in range(24):
        one = forces(points[i], normals[i], com[i], 7.0, mu, objective, touching=touching[i])
        assert one.status == batch.status[i]
        assert one.reason() == batch.reason(i)
        assert np.allclose(one.forces, batch.forces[i], rtol=0.0, atol=1e-11, equal_nan=True)
        assert np.allclose(one.ratio, batch.ratio[i], rtol=0.0, atol=1e-11, equal_nan=True)
        assert one.needed == pytest.approx(batch.needed[i], rel=1e-11, nan_ok=True)
    assert np.array_equal(batch.ok, batch.status == "ok")
    assert np.all(batch.residual[batch.ok] < 1e-12)
    slips = batch.status == "slips"
    assert np.all(batch.needed[slips] > mu)
    needed = needs(points, normals, com, touching=touching)
    assert batch.needed[slips] == pytest.approx(needed.mu[slips], rel=1e-11)
    assert np.array_equal(batch.status == "tips_over", needed.status == "tips_over")


def test_shapes_broadcast() -> None:
    com = np.array([[[0.0, 0.0, 0.1]], [[0.1, 0.0, 0.1]]])  # (2, 1, 3)
    weight = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, -2.0], [0.1, 0.0, -2.0]])  # (3, 3)
    got = forces(WHEELS, FLAT, com, weight, np.array([0.5, 0.6, 0.7]))
    assert got.forces.shape == (2, 3, 3, 3)
    assert got.ratio.shape == (2, 3, 3)
    assert got.worst.shape == got.status.shape == got.needed.shape == (2, 3)
    assert got.forces.sum(axis=-2) == pytest.approx(-np.broadcast_to(weight, (2, 3, 3)), abs=1e-12)
    none = forces(np.zeros((0, 3, 3)), FLAT, COM, 1.0, 0.5)
    assert none.forces.shape == (0, 3, 3)
    assert none.ok.all()
    assert needs(WHEELS, FLAT, com).mu.shape == (2, 1)
    assert interval(WHEELS, FLAT, com, 1.0, 0.5, np.ones((5, 3, 3))).low.shape == (2, 1, 5)


@pytest.mark.parametrize(("length", "weight", "offset"), [(1e3, 1e5, 0.0), (1e-3, 1e-4, 0.0), (1.0, 1.0, 1e3)])
def test_units_and_place_do_not_matter(length: float, weight: float, offset: float) -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    moved = offset * np.array([1.0, -2.0, 0.4])
    for seed in range(4):
        points, normals, com = rough(seed, 3 + seed % 3)
        mu = 1.1 * float(needs(points, normals, com))
        levers = np.random.default_rng(seed).normal(size=(2, len(points), 3))
        down = -weight * turn @ UP
        there = (length * points @ turn.T + moved, 3.0 * normals @ turn.T, length * turn @ com + moved, down)
        for objective in ("min_norm", "min_ratio"):
            here = forces(points, normals, com, 1.0, mu, objective)
            got = forces(*there, mu, objective)
            assert here.status == got.status == "ok"
            assert np.abs(got.forces @ turn / weight - here.forces).max() < 1e-9
        low, high = interval(points, normals, com, 1.0, mu, levers)
        low_there, high_there = interval(*there, mu, levers @ turn.T)
        assert low_there / weight == pytest.approx(low, abs=1e-9)
        assert high_there / weight == pytest.approx(high, abs=1e-9)


def test_contacts_that_do_not_touch() -> None:
    points, normals, com = rough(2, 3)
    touching = np.array([True, False, True, True, False])
    more, out = np.full((5, 3), np.nan), np.full((5, 3), np.nan)
    more[touching], out[touching] = points, normals
    mu = 1.05 * float(needs(points, normals, com))
    for objective in ("min_norm", "min_ratio"):
        some = forces(more, out, com, 4.0, mu, objective, touching=touching)
        want = forces(points, normals, com, 4.0, mu, objective)
        assert np.abs(some.forces[touching] - want.forces).max() < 1e-11
        assert not some.forces[~touching].any()
        assert not some.ratio[~touching].any()
    assert needs(more, out, com, touching=touching).mu == pytest.approx(mu / 1.05, rel=1e-11)
    air = forces(WHEELS, FLAT, COM, 4.0, 0.5, touching=[False, False, False])
    assert air.status == "tips_over"
    assert "nothing touches" in air.reason()


def test_friction_of_each_contact() -> None:
    """A slippery contact carries along its normal; the others make up for it."""
    points, normals, com = on_slope(0.2)
    got = forces(points, normals, com, 10.0, [0.0, 1.0, 1.0])
    assert got.status == "ok"
    assert got.ratio[0] < 1e-13
    assert excess(got.forces, normals, np.array([0.0, 1.0, 1.0])) < 1e-11
    assert left_over(points, com, got.forces, 10.0) < 1e-12
    least = forces(points, normals, com, 10.0, [0.0, 1.0, 1.0], "min_ratio")
    assert least.ratio[0] < 1e-13
    assert 0.2 < least.worst <= got.worst + 1e-12
    assert forces(points, normals, com, 10.0, [0.0, 0.22, 0.22]).status == "slips"
    bound = forces(points, normals, com, 10.0, [0.3, 0.3, 0.1])
    assert bound.status == "slips"
    assert bound.needed == pytest.approx(0.2, rel=1e-12)
    assert "0.1 to 0.3" in bound.reason()


def test_contacts_in_one_place_or_one_line() -> None:
    two = forces([[0.0, 0.0, 0.0]] * 2, [[0.1, 0.0, 1.0], [-0.1, 0.0, 1.0]], [0.0, 0.0, 0.4], 6.0, 0.2)
    assert np.abs(two.forces - 3.0 * UP).max() < 1e-12
    line = np.array([[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    along = forces(line, FLAT, [0.5, 0.0, 0.4], 6.0, 0.0)
    # the smallest forces that are linear along the line: 2 (1 + 1.5 x / 2)
    assert np.abs(along.forces[:, 2] - [0.5, 2.0, 3.5]).max() < 1e-12
    aside = forces(line, FLAT, [0.5, 1e-6, 0.4], 6.0, 3.0)
    assert aside.status == "tips_over"


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"points": WHEELS[0]}, "points"),
        ({"points": WHEELS[:, :2]}, "points"),
        ({"points": np.zeros((0, 3)), "normals": np.zeros((0, 3))}, "points"),
        ({"points": "feet"}, "points"),
        ({"points": WHEELS + np.inf}, "points"),
        ({"normals": FLAT[:2]}, "normals"),
        ({"normals": FLAT * [[1.0], [0.0], [1.0]]}, r"normals: .* \(1,\) is zero"),
        ({"normals": FLAT * [[1.0], [np.nan], [1.0]]}, "normals"),
        ({"com": [0.0, 0.0]}, "com"),
        ({"com": np.zeros((4, 3)), "points": np.tile(WHEELS, (3, 1, 1))}, "com"),
        ({"weight": -1.0}, "weight"),
        ({"weight": [1.0, 2.0]}, "weight"),
        ({"weight": np.nan}, "weight"),
        ({"mu": -0.1}, "mu"),
        ({"mu": [0.1, 0.2]}, "mu"),
        ({"mu": np.inf}, "mu"),
        ({"wrench": [0.0, 0.0, 1.0]}, "wrench"),
        ({"touching": [1, 1, 1]}, "touching"),
        ({"touching": [True, True]}, "touching|points"),
        ({"touching": True}, "touching"),
    ],
)
def test_refusals(change: dict[str, Any], field: str) -> None:
    good: dict[str, Any] = {"points": WHEELS, "normals": FLAT, "com": COM, "weight": 10.0, "mu": 0.5}
    with pytest.raises(InputError, match=f"^{field}"):
        forces(**good | change)
    if "mu" not in change:
        given = good | change
        del given["mu"]
        with pytest.raises(InputError, match=f"^{field}"):
            needs(**given)


def test_refusals_of_objective_and_levers() -> None:
    with pytest.raises(UnknownNameError, match="min_norm"):
        forces(WHEELS, FLAT, COM, 1.0, 0.5, "min_nrm")
    with pytest.raises(InputError, match=r"^levers"):
        interval(WHEELS, FLAT, COM, 1.0, 0.5, np.ones((3, 3)))
    with pytest.raises(InputError, match=r"^levers: 3 contacts"):
        interval(WHEELS, FLAT, COM, 1.0, 0.5, np.ones((1, 2, 3)))
    with pytest.raises(InputError, match=r"^levers"):
        interval(WHEELS, FLAT, np.zeros((2, 3)), 1.0, 0.5, np.ones((3, 1, 3, 3)))


def test_without_clarabel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where friction holds nothing back it is not needed; else the error says how to get it."""
    monkeypatch.setitem(sys.modules, "clarabel", None)
    assert forces(WHEELS, FLAT, COM, 1.0, 0.5).status == "ok"
    points, normals, com = rough(1)
    with pytest.raises(MissingExtraError, match=r"bodyplan\[solve\]"):
        forces(points, normals, com, 1.0, 0.9 * float(forces(points, normals, com, 1.0, 9.0).worst))


def test_importing_the_face_loads_no_solver() -> None:
    code = (
        "import sys, bodyplan as bp; bp.solve.contact_forces; print({'clarabel', 'scipy.optimize'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"
