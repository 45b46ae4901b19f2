"""Paths, laws in time and headings: exact derivatives, the exact yaw, what is wrong with the paper's, refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.gaits.carry import Circle, Formula, Line, Samples, Through, heading, yaw
from bodyplan.gaits.carry.laws import Law
from bodyplan.gaits.carry.orientation import Function, matrix, turning
from bodyplan.gaits.carry.paths import path_of
from wheel_cases import rotation

angles = st.floats(-1.2, 1.2)
T = np.linspace(0.3, 1.7, 29)
WAY = "0.5*t + 0.1*sin(2*t)"
POINTS = [(0.0, 0.0), (0.4, 0.3), (0.9, 0.1), (1.2, -0.3), (0.8, -0.6), (0.2, -0.5)]
PATHS = {
    "line": Line(start=(0.1, 0.2), end=(1.0, -0.5)),
    "circle": Circle(0.7, (0.2, -0.1), 0.5),
    "clockwise": Circle(0.7, (0.2, -0.1), 0.5, clockwise=True),
    "spline": Through(POINTS),
    "few points": Through(POINTS[:3]),
    "closed": Through(POINTS, closed=True),
    "formula": Formula("sin(t)*exp(t/5)", "cos(2*t)"),
    "samples": Samples(np.linspace(0, 2, 21), np.stack([np.sin(np.linspace(0, 2, 21)), np.linspace(0, 2, 21)], 1)),
}


# --- headings -----------------------------------------------------------------------------------------------


@given(psi=st.floats(-3.1, 3.1), roll=angles, pitch=angles)
def test_the_yaw_puts_the_bodys_axis_where_the_heading_is(psi: float, roll: float, pitch: float) -> None:
    """Notes, correction 4: exact and closed; R = Ry Rx Rz written down as products."""
    a = float(yaw(psi, roll, pitch))
    R = rotation(roll, pitch, a)
    assert np.cos(np.arctan2(R[1, 0], R[0, 0]) - psi) == pytest.approx(1.0, abs=1e-13)
    np.testing.assert_allclose(matrix(np.array(a), np.array(roll), np.array(pitch)), R, atol=1e-14)
    assert np.cos(float(heading(a, roll, pitch)) - psi) == pytest.approx(1.0, abs=1e-13)


def test_without_tilt_the_yaw_is_the_heading() -> None:
    psi = np.linspace(-3.0, 3.0, 13)
    np.testing.assert_allclose(yaw(psi), psi, atol=1e-15)


def test_the_papers_integrated_yaw_drifts() -> None:
    """(20) to (22) at a constant tilt of 0.2, 0.2: the yaw rate is psi'/R33, and after a lap of the circle of mission
    1 the heading is 14.6 degrees off; the exact yaw comes back to where it was."""
    tilt = 0.2
    lap = 2.0 * np.pi / (np.cos(tilt) * np.cos(tilt))  # of a heading that starts at 0
    drift = np.degrees(heading(yaw(0.0, tilt, tilt) + lap, tilt, tilt))
    assert drift == pytest.approx(14.6, abs=0.05)
    assert yaw(2.0 * np.pi, tilt, tilt) == pytest.approx(float(yaw(0.0, tilt, tilt)), abs=1e-14)


def test_the_papers_other_heading_is_the_angle_of_the_position() -> None:
    """(18): y/x instead of dy/dx; on the circle of mission 1 it points a right angle off, all the time. And the rate
    in (19) is that of the position's angle too."""
    t = np.linspace(0.1, 6.0, 50)
    course = Formula("sin(t)", "cos(t)").at(t, Function(t, t, t))
    off = np.arctan2(course.place[:, 1], course.place[:, 0]) - course.direction.value
    np.testing.assert_allclose(np.cos(off), 0.0, atol=1e-14)
    np.testing.assert_allclose(course.direction.first, -1.0, atol=1e-13)
    line = Formula("1+t", "2").at(t, Function(t, t, t))
    position_rate = -2.0 / ((1 + t) ** 2 + 4.0)  # of atan2(y, x)
    assert np.abs(position_rate).min() > 0.03
    np.testing.assert_array_equal(line.direction.first, 0.0)


def test_angular_velocity_and_acceleration_are_those_of_the_matrix() -> None:
    t = np.linspace(0.0, 2.0, 41)
    h = 1e-5

    def at(times: np.ndarray) -> object:
        psi, roll, pitch = (
            Law(text, "x", "angle").at(times) for text in ("2*sin(t)+3", "0.4*cos(2*t)", "0.3*sin(3*t)-0.1")
        )
        return turning(psi, roll, pitch)

    here, after, before = at(t), at(t + h), at(t - h)
    rate = (after.matrix - before.matrix) / (2 * h)
    skew = rate @ np.swapaxes(here.matrix, 1, 2)
    np.testing.assert_allclose(np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1), here.spin, atol=1e-8)
    np.testing.assert_allclose((after.spin - before.spin) / (2 * h), here.gain, atol=1e-8)
    np.testing.assert_allclose((after.yaw.first - before.yaw.first) / (2 * h), here.yaw.second, atol=1e-7)
    np.testing.assert_allclose(heading(here.yaw.value, 0.4 * np.cos(2 * t), 0.3 * np.sin(3 * t) - 0.1),
                               np.angle(np.exp(1j * (2 * np.sin(t) + 3))), atol=1e-12)  # fmt: skip


# --- paths --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PATHS)
def test_derivatives_of_paths_are_exact(name: str) -> None:
    path, law, h = PATHS[name], Law(WAY, "distance", "length"), 1e-5
    here, after, before = (path.at(t, law.at(t)) for t in (T, T + h, T - h))
    np.testing.assert_allclose((after.place - before.place) / (2 * h), here.velocity, atol=1e-8)
    np.testing.assert_allclose((after.velocity - before.velocity) / (2 * h), here.acceleration, atol=2e-7)
    turned = np.angle(np.exp(1j * (after.direction.value - before.direction.value)))
    np.testing.assert_allclose(turned / (2 * h), here.direction.first, atol=2e-7)
    change = (after.direction.first - before.direction.first) / (2 * h)
    # splines of few points have a third derivative that jumps
    away = np.abs(change - here.direction.second) / (1.0 + np.abs(change))
    assert np.median(away) < 1e-7 and np.sort(away)[-4] < 1e-5
    along = np.stack([np.cos(here.direction.value), np.sin(here.direction.value)], axis=1)
    np.testing.assert_allclose(np.sum(along * here.velocity, axis=1), np.linalg.norm(here.velocity, axis=1), atol=1e-12)


@pytest.mark.parametrize("name", ["spline", "few points", "closed", "circle", "line"])
def test_curves_are_gone_along_by_arc_length(name: str) -> None:
    s = np.linspace(0.0, 1.0, 5)
    course = PATHS[name].at(s, Function(s, np.ones(5), np.zeros(5)))
    np.testing.assert_allclose(np.linalg.norm(course.velocity, axis=1), 1.0, atol=1e-12)
    fine = np.linspace(0.0, 1.0, 20001)
    places = PATHS[name].at(fine, Function(fine, fine, fine)).place
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).sum() == pytest.approx(1.0, abs=1e-8)


def test_splines_go_through_their_points() -> None:
    for closed in (False, True):
        curve = Through(POINTS, closed=closed)
        s = np.linspace(0.0, curve.length, 100_001)
        places = curve.at(s, Function(s, s, s)).place
        for point in POINTS:
            assert np.linalg.norm(places - point, axis=1).min() < 1e-4
    lap = Through(POINTS, closed=True)
    s = np.array([0.1, 0.1 + lap.length])
    around = lap.at(s, Function(s, s, s))
    np.testing.assert_allclose(around.place[1], around.place[0], atol=1e-12)
    assert not around.ended.any()


def test_open_curves_and_samples_end_and_formulas_may_stand_still() -> None:
    s = np.array([0.0, 0.5, 100.0])
    assert Through(POINTS).at(s, Function(s, s, s)).ended.tolist() == [False, False, True]
    t = np.array([-0.5, 1.0, 2.5])
    assert PATHS["samples"].at(t, Function(t, t, t)).ended.tolist() == [True, False, True]
    still = Formula("cos(t)", "0*t").at(np.array([0.0, 1.0]), Function(t, t, t))
    assert still.still.tolist() == [True, False]


def test_what_a_user_may_give_for_a_path() -> None:
    assert path_of(("sin(t)", "cos(t)")) == Formula("sin(t)", "cos(t)")
    assert path_of(["0.1*t", 0.5]) == Formula("0.1*t", 0.5)
    assert path_of(POINTS) == Through(POINTS) == path_of(np.array(POINTS))
    assert path_of({"kind": "circle", "radius": "500 mm", "start": "90 deg"}) == Circle(0.5, start=np.pi / 2)
    assert path_of({"kind": "line", "start": ["100 mm", 0.0], "end": [0.1, 2.0]}).heading == pytest.approx(np.pi / 2)
    assert path_of("line") == Line()
    for path in PATHS.values():
        assert path_of(path.to_dict()) == path
        gait = bp.Carry(path)
        assert bp.Carry(**{k: v for k, v in gait.to_dict().items() if k != "kind"}) == gait


# --- laws ---------------------------------------------------------------------------------------------------


def test_laws_are_numbers_quantities_and_formulas() -> None:
    t = np.array([0.2, 0.7])
    assert Law("150 mm", "height", "length").at(t).value.tolist() == [0.15, 0.15]
    assert Law("5 deg", "roll", "angle").constant == pytest.approx(np.radians(5))
    assert Law(2, "x", "length").plain == 2.0 and Law("0.25", "x", "length").at(t).value.tolist() == [0.25] * 2
    law = Law("t**3/6", "x", "length")
    made = law.at(t)
    np.testing.assert_allclose([made.value, made.first, made.second], [t**3 / 6, t**2 / 2, t])
    np.testing.assert_allclose(law.third(t), 1.0)


def test_tilts_must_stay_below_a_right_angle_at_all_times() -> None:
    with pytest.raises(bp.InputError, match=r"roll: must stay within .* at t = 1.6"):
        bp.plan(bp.tri_wheel(), bp.Carry("line", roll="t"), bp.Plane(), np.array([0.0, 1.0, 1.6, 2.0]))


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: bp.Carry(path="loop"), ["path", "circle, formula, line, samples, spline"]),
        (lambda: bp.Carry(path={"kind": "square"}), ["square", "circle"]),
        (lambda: bp.Carry(path={"kind": "circle", "radios": 1}), ["radios", "radius"]),
        (lambda: bp.Carry(path={"kind": "formula", "x": "t"}), ["y is missing"]),
        (lambda: bp.Carry(path=[(0, 0)]), ["at least 2"]),
        (lambda: bp.Carry(path=[(0, 0), (0, 0), (1, 1)]), ["one place"]),
        (lambda: bp.Carry(path=("sin(q)", "t")), ["path.x", "q"]),
        (lambda: bp.Carry(path={"kind": "samples", "times": [0, 1], "points": [[0, 0], [1, 1]]}), ["at least 4"]),
        (lambda: bp.Carry(path={"kind": "samples", "times": [0, 2, 1, 3], "points": np.eye(4)[:, :2]}), ["ascend"]),
        (lambda: bp.Carry(path={"kind": "line", "end": (0, 0)}), ["path.end"]),
        (lambda: bp.Carry(path={"kind": "circle", "radius": 0.0}), ["path.radius", "> 0"]),
        (lambda: bp.Carry(path="line", height="very high"), ["height", "very high", "formula"]),
        (lambda: bp.Carry(path="line", height="2 kg"), ["height", "2 kg"]),
        (lambda: bp.Carry(path="line", roll=2.0), ["roll", "pi/2"]),
        (lambda: bp.Carry(path="line", height_mode="above"), ["height_mode", "absolute, normal, vertical"]),
        (lambda: bp.Carry(path="line", speed=-1.0), ["speed", "> 0"]),
        (lambda: bp.Carry(path="line", speed=1.0, distance="t"), ["distance", "leave out"]),
        (lambda: bp.Carry(path=("t", "0*t"), speed=1.0), ["speed", "formula"]),
        (lambda: bp.Carry(path="line", reference="nose"), ["reference", "nose", "front_axle"]),
        (lambda: bp.Carry(path="line", stop=3.0), ["stop", "ramp"]),
    ],
)
def test_refusals(make, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(bp.InputError) as raised:
        make()
    for word in words:
        assert word in str(raised.value)


def test_parameters_of_arc_lengths() -> None:
    """Random curves, also with bends as sharp as chance has it: the length up to the parameter is the one asked for."""
    rng = np.random.default_rng(11)
    nodes, weights = np.polynomial.legendre.leggauss(10)
    for _ in range(40):
        curve = Through(rng.normal(size=(rng.integers(3, 12), 2)), closed=bool(rng.integers(2)))
        ends, sums, _ = curve._lengths
        s = np.concatenate([rng.uniform(0.0, sums[-1], 100), sums])
        u = curve._parameter(s)
        k = np.clip(np.searchsorted(sums, s, side="right") - 1, 0, len(ends) - 2)
        half = 0.5 * (u - ends[k])
        at = ends[k][:, None] + half[:, None] * (1.0 + nodes)
        made = sums[k] + (np.linalg.norm(curve._spline(at, 1), axis=-1) @ weights) * half
        np.testing.assert_allclose(made, s, atol=1e-11 * sums[-1])
        np.testing.assert_allclose(u[100:], ends, atol=1e-10 * ends[-1])
