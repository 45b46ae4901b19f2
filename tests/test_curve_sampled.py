"""Curves through points: known curves come back, frames and shape agree, files, refusals."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import bodyplan as bp
from bodyplan import curves as bc
from bodyplan.spatial import matrix_from_quaternion
from curve_cases import followed

SERPENOID = bp.Serpenoid(1.2)
HELIX = bp.Spiral(6.0, 3.0)


def samples(curve: bp.BodyCurve, count: int) -> np.ndarray:
    return curve.frames(np.linspace(0.0, 1.0, count), [0.3, -0.2, 0.5, 0.6, 0.0, 0.8, 0.0])[0]


def plus_noise(seed: int, count: int = 9, dimension: int = 3) -> np.ndarray:
    """Points of a smooth but shapeless curve, steps of about 0.1."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(count, dimension)) * 0.03
    steps[:, 0] += 0.1
    return np.cumsum(steps, axis=0)


@pytest.mark.parametrize("curve", [SERPENOID, HELIX])
def test_points_of_a_known_curve(curve: bp.BodyCurve) -> None:
    errors, bends = [], []
    for count in (20, 40, 80):
        sampled = bp.Sampled(samples(curve, count))
        s = np.linspace(0.0, 1.0, 201)
        true = curve.frames(s, [0.3, -0.2, 0.5, 0.6, 0.0, 0.8, 0.0])[0]
        errors.append(np.abs(sampled.frames(s)[0] - true).max())
        inside = np.linspace(0.2, 0.8, 301)
        ours, theirs = sampled.shape(inside), curve.shape(inside)
        size = np.hypot(ours.kappa_p, ours.kappa_y) - np.hypot(theirs.kappa_p, theirs.kappa_y)
        bends.append(np.abs(size).max())
    # points of order 4, curvature of order 2 in the distance of the samples
    assert errors[2] < 1e-6
    assert 11.0 < errors[1] / errors[2] < 25.0
    assert 3.3 < bends[1] / bends[2] < 4.8
    assert bends[2] < 0.03


def test_a_planar_curve_keeps_its_sign() -> None:
    points = SERPENOID.frames(np.linspace(0.0, 1.0, 60))[0][:, :2]
    sampled = bp.Sampled(points)
    s = np.linspace(0.05, 0.95, 50)
    shape = sampled.shape(s)
    assert np.abs(shape.kappa_p).max() < 1e-13
    assert np.abs(shape.kappa_y - SERPENOID.shape(s).kappa_y).max() < 0.05
    assert np.abs(sampled.frames(s)[1][:, :, 2] - [0.0, 0.0, 1.0]).max() < 1e-14


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), count=st.integers(4, 12), scale=st.sampled_from([1e-6, 1.0, 1e5]))
def test_passes_through_the_points_at_the_stations(seed: int, count: int, scale: float) -> None:
    points = scale * plus_noise(seed, count)
    curve = bp.Sampled(points)
    there, frames = curve.frames(curve.stations)
    assert np.abs(there - points).max() < 1e-14 * scale * count
    assert np.abs(np.swapaxes(frames, 1, 2) @ frames - np.eye(3)).max() < 1e-14
    assert curve.stations[0] == 0.0
    assert curve.stations[-1] == curve.length
    assert np.array_equal(curve.stations, curve.breaks)
    # s is the arc length: steps of the points are as long as those of s, from cell to cell by quadrature
    for a, b in zip(curve.stations[:-1], curve.stations[1:], strict=True):
        x = np.linspace(a, b, 5)
        chords = np.linalg.norm(np.diff(curve.frames(x)[0], axis=0), axis=1)
        assert np.all(chords <= (b - a) / 4 * (1.0 + 1e-12))
        tangents = curve.frames(x)[1][:, :, 0]
        h = 1e-4 * (b - a)
        middle = x[1:-1]
        ahead, behind = curve.frames(middle + h)[0], curve.frames(middle - h)[0]
        assert np.abs((ahead - behind) / (2 * h) - tangents[1:-1]).max() < 1e-6
    # another size, the same shape
    other = bp.Sampled(plus_noise(seed, count))
    assert curve.length == pytest.approx(scale * other.length, rel=1e-13)


def test_tangents_add_up_to_chords() -> None:
    # s is the arc length and e_r the tangent: the integral of e_r is the chord
    curve = bp.Sampled(plus_noise(3))
    for i in range(8):
        a, b = curve.stations[i : i + 2]
        chord = [quad(lambda s, k=k: curve.frames([s])[1][0, k, 0], a, b, epsabs=1e-13)[0] for k in range(3)]
        assert np.abs(chord - (curve.points[i + 1] - curve.points[i])).max() < 1e-13


@pytest.mark.parametrize("seed", [1, 2])
def test_the_shape_alone_gives_the_points_back(seed: int) -> None:
    curve = bp.Sampled(plus_noise(seed))
    turn = matrix_from_quaternion(curve.start[3:])
    for i in (1, 4, 8):
        point, frame = followed(curve, float(curve.stations[i]))
        assert np.abs(curve.start[:3] + turn @ point - curve.points[i]).max() < 1e-10
        assert np.abs(turn @ frame - curve.frames([curve.stations[i]])[1][0]).max() < 1e-10


def test_no_roll() -> None:
    curve = bp.Sampled(plus_noise(5))
    assert not curve.twisted
    h = 1e-4
    s = np.linspace(0.01, curve.length - 0.01, 200)
    s = s[np.all(np.abs(s[:, None] - curve.stations) > 3 * h, axis=1)]
    e = [curve.frames(s + k * h)[1] for k in (-2, -1, 0, 1, 2)]
    change = (e[0] - 8 * e[1] + 8 * e[3] - e[4]) / (12 * h)
    # tau = e_p' . e_y
    assert np.abs(np.sum(change[:, :, 1] * e[2][:, :, 2], axis=1)).max() < 1e-7
    # while the frame does turn
    assert np.abs(change).max() > 1.0


@pytest.mark.parametrize(
    ("direction", "up"),
    [
        ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ((1.0, 1.0, 1.0), (-1.0, -1.0, 2.0)),
        ((-1.0, 0.0, -3.0), (-3.0, 0.0, 1.0)),
        ((0.0, 0.0, 1.0), (-1.0, 0.0, 0.0)),
        ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0)),
    ],
)
def test_start_is_upright(direction: tuple, up: tuple) -> None:
    curve = bp.Sampled(np.arange(5)[:, None] * np.array(direction) + [3.0, 2.0, 1.0])
    R = matrix_from_quaternion(curve.start[3:])
    assert np.abs(R[:, 0] - np.array(direction) / np.linalg.norm(direction)).max() < 1e-15
    assert np.abs(R[:, 2] - np.array(up) / np.linalg.norm(up)).max() < 1e-14
    assert np.array_equal(curve.start[:3], [3.0, 2.0, 1.0])
    # straight on beyond both ends
    ends = curve.frames([-2.0, curve.length + 2.0])[0]
    assert np.abs(ends[0] - (curve.points[0] - 2.0 * R[:, 0])).max() < 1e-14
    assert np.abs(ends[1] - (curve.points[-1] + 2.0 * R[:, 0])).max() < 1e-14


def test_far_from_the_origin() -> None:
    near = plus_noise(7)
    far = bp.Sampled(near + 2.0**20)
    exact = bp.Sampled(far.points - 2.0**20)
    s = np.linspace(0.0, exact.length, 50)
    assert np.abs(np.stack(far.shape(s)) - np.stack(exact.shape(s))).max() < 1e-10


def helix(t: np.ndarray) -> np.ndarray:
    return np.stack([np.cos(t), np.sin(t), 0.3 * t], axis=1)


def test_long_curves_end() -> None:
    # parameters far from 0 have few digits left: cells were halved without end where they were counted from there
    points = helix(np.linspace(0.0, 300.0, 3000))
    sampled = bp.Sampled(points)
    # the speed of a cubic spline is off by about h^4 / 720 in the mean
    assert sampled.length == pytest.approx(300.0 * np.hypot(1.0, 0.3), rel=0.1**4 / 500.0)
    assert np.abs(sampled.frames(sampled.stations)[0] - points).max() < 1e-12
    inside = sampled.stations[10:-10]
    assert np.hypot(*sampled.shape(inside)[1:]) == pytest.approx(1.0 / 1.09, rel=1e-3)
    rough = plus_noise(3, 400)
    at = bp.Sampled(rough)
    assert np.abs(at.frames(at.stations)[0] - rough).max() < 1e-12


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7])
def test_points_that_crowd(gap: float) -> None:
    places = np.sort(np.append(np.linspace(0.0, 3.0, 15), 1.51 + gap * np.arange(4)))
    sampled = bp.Sampled(helix(places))
    assert sampled.length == pytest.approx(3.0 * np.hypot(1.0, 0.3), rel=1e-5)
    assert np.abs(sampled.frames(sampled.stations)[0] - helix(places)).max() < 1e-13
    inside = np.linspace(0.5, 2.5, 101)
    assert np.hypot(*sampled.shape(inside)[1:]) == pytest.approx(1.0 / 1.09, rel=1e-2)


@pytest.mark.parametrize("seed", [4, 10, 18])
def test_slow_spans_do_not_halve_to_rounding(seed: int) -> None:
    # in a tight turn the speed falls to a hundredth, and with it the digits of the tangent: no cusp, but a hairpin
    noise = np.random.default_rng(seed).normal(scale=0.02, size=(100, 2))
    with pytest.raises(bp.InputError, match=r"turns by [45]\.\d+ rad"):
        bp.Sampled(np.column_stack([np.linspace(0.0, 1.0, 100), noise]))


def test_places_that_overflow() -> None:
    with pytest.raises(bp.InputError, match="points: must be within"):
        bp.Sampled(1e200 * helix(np.linspace(0.0, 3.0, 10)))


def test_files(tmp_path: Path) -> None:
    points = plus_noise(11)
    np.save(tmp_path / "points.npy", points)
    with (tmp_path / "points.csv").open("w") as text:
        text.write("t, Z ,x,y\n")
        text.writelines(f"{i},{float(z)!r},{float(x)!r},{float(y)!r}\n" for i, (x, y, z) in enumerate(points))
        text.write("\n")
    np.savetxt(tmp_path / "flat.csv", points[:, :2], delimiter=",", fmt="%.17g")
    assert bp.Sampled.from_file(tmp_path / "points.npy") == bp.Sampled(points)
    assert bp.Sampled.from_file(str(tmp_path / "points.csv")) == bp.Sampled(points)
    assert bp.Sampled.from_file(tmp_path / "flat.csv") == bp.Sampled(points[:, :2])


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.txt", "", "kind of file"),
        ("a.csv", "", "no points"),
        ("a.csv", "x,z\n1,2\n", "columns x, y"),
        ("a.csv", "0\n1\n2\n3\n", "2 or 3 columns"),
        ("a.csv", "0,0\n1,0\n2,zero\n3,0\n", "line 3"),
        ("a.csv", "0,0\n1,0\n2\n3,0\n", "line 3"),
        ("a.csv", "0,0\n1,0\nnan,0\n3,0\n", "finite"),
        ("a.csv", "0,0\n1,0\n", "4 <= M"),
        ("a.npy", "not an array", "cannot be read"),
    ],
)
def test_bad_files(tmp_path: Path, name: str, content: str, text: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(bp.InputError, match=text):
        bp.Sampled.from_file(tmp_path / name)
    with pytest.raises(bp.InputError, match="no such file"):
        bp.Sampled.from_file(tmp_path / "missing.csv")


@pytest.mark.parametrize(
    ("points", "text"),
    [
        (np.eye(3), "4 <= M"),
        (np.zeros((5, 4)), r"\(M, 3\)"),
        (np.zeros(12), r"\(M, 3\)"),
        ([[0, 0], [1, 0], [1, 0], [2, 0]], "1 and 2 are the same"),
        ([[0, 0], [1, 0], [2, 0], [np.inf, 0]], "finite"),
        ([[0, 0], [1, 0], [0.5, 0], [2, 0]], "cusp"),
        ([[0, 0], [1, 0], [2, 0], [1, 0], [0, 0]], "cusp"),
        ([[0.9, 0.3], [0.6, 0.8], [0.7, 0.9], [0.9, 0.9], [0.0, 0.4]], "turns by 3.39 rad between points 3 and 4"),
        ("points", "expected numbers"),
    ],
)
def test_refusals(points: object, text: str) -> None:
    with pytest.raises(bp.InputError, match=text):
        bp.Sampled(points)  # type: ignore[arg-type]


def test_a_table_takes_points_with_units_and_files_of_points(tmp_path: Path) -> None:
    points = [[0.0, 0.0], [0.1, 0.02], [0.2, 0.0], [0.3, -0.05]]
    plain = bp.Sampled(points)
    texts = [["0 mm", 0.0], ["10 cm", "20 mm"], ["0.2 m", 0], [0.3, "-50 mm"]]
    assert bc.from_dict({"kind": "sampled", "points": texts}).to_dict() == plain.to_dict()
    file = tmp_path / "way.csv"
    file.write_text("x,y\n" + "\n".join(f"{x},{y}" for x, y in points), encoding="utf-8")
    assert bc.from_dict({"kind": "sampled", "points": str(file)}) == plain
    with pytest.raises(bp.InputError, match="no such file"):
        bc.from_dict({"kind": "sampled", "points": str(tmp_path / "none.csv")})
    with pytest.raises(bp.InputError, match=r"points\[1\]\[0\]"):
        bc.from_dict({"kind": "sampled", "points": [[0, 0], ["3 kg", 1], [2, 2], [3, 3]]})
