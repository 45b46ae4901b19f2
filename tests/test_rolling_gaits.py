"""Sidewinding on a level wave, rolling over the floor and round a pole: exact in time, at rest where they touch."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import j0

import bodyplan as bp
from bodyplan.gaits.touching import lowest_points, pole_gaps
from bodyplan.spatial import rotation_log

FINE = bp.snake(48, 0.02, "arc", axes="universal", radius=0.01)
ALTERNATING = bp.snake(16, 0.06, axes="alternating", radius=0.02)
ROBOTS = {
    "fine arcs": FINE,
    "arcs": bp.snake(16, 0.06, "arc", axes="universal", radius=0.02),
    "doubles": bp.snake(16, 0.06, "double", axes="universal", radius=0.02),
    "alternating": ALTERNATING,
    "universal": bp.snake(16, 0.06, axes="universal", radius=0.02),
}
SIDE = {
    "ready": lambda: bp.Sidewinding(0.6, 0.2, 0.64, speed=0.16),
    "backward": lambda: bp.Sidewinding(0.6, 0.2, 0.64, speed=0.16, direction=-1, start=0.2),
    "other hand": lambda: bp.Sidewinding(0.5, -0.15, 0.64, speed=0.1, phase=1.2),
}
ROLL = {
    "arc": lambda: bp.Rolling(1.0, 2.0),
    "arc the other way": lambda: bp.Rolling(-1.5, -2.0, phase=0.7),
    "helix": lambda: bp.Rolling(2.0, 2.0, 3.0),
    "left-handed helix": lambda: bp.Rolling(-2.0, 1.5, -4.0, phase=0.4, p=0.789),
}
POLE = {
    "along x": lambda: bp.Rolling(3.0, 2.0, 5.0, around="pole"),
    "up": lambda: bp.Rolling(3.0, -2.0, 5.0, around="pole", axis="z"),
    "left-handed": lambda: bp.Rolling(3.0, 2.0, -5.0, around="pole", axis="z", phase=1.0),
    "other sign": lambda: bp.Rolling(-3.0, 2.0, 5.0, around="pole", axis="z", phase=1.0),
    "ring": lambda: bp.Rolling(4.0, 2.0, 0.0, around="pole", axis="z"),
}
ALL = {**SIDE, **ROLL, **{f"pole {name}": gait for name, gait in POLE.items()}}


def planned(gait, robot=FINE, samples=120, cycles=1):
    return bp.plan(robot, gait, bp.Plane(), np.arange(cycles * samples + 1) * (gait.period(robot) / samples))


@pytest.mark.parametrize("name", [*SIDE, *ROLL])
@pytest.mark.parametrize("robot", list(ROBOTS))
def test_passes_its_checks(robot, name):
    motion = planned(ALL[name](), ROBOTS[robot])
    report = bp.check(motion)
    assert report.ok, str(report)
    assert {"follows", "periodic", "grips"} <= {line.kind for line in report if line.passed}


@pytest.mark.parametrize("name", [*SIDE, *ROLL])
@pytest.mark.parametrize("robot", ["fine arcs", "arcs", "doubles"])
@pytest.mark.parametrize("shift", [(0.0, 0.03, 0.0), (0.0, 0.0, 0.01)], ids=["sideways", "up"])
def test_a_shifted_base_is_refused(robot, name, shift):
    motion = planned(ALL[name](), ROBOTS[robot], samples=40)
    base = motion.base.copy()
    base[:, :3] += shift
    report = bp.check(motion.replace(base=base))
    assert "follows" in {line.kind for line in report.failures}, str(report)


@pytest.mark.parametrize("name", list(POLE))
def test_climbs_without_slip(name):
    gait = POLE[name]()
    motion = planned(gait)
    report = bp.check(motion)
    assert report.ok, str(report)
    assert report["what touches is at rest"].value < 0.01
    facts, k, twist, r = motion.facts, gait.curvature, gait.twist, 0.01
    assert facts["helix_radius"] == pytest.approx(abs(k) / (k * k + twist * twist), rel=1e-14)
    assert facts["pole_radius"] == pytest.approx(facts["helix_radius"] - r, rel=1e-13)
    assert facts["helix_pitch"] == pytest.approx(2 * np.pi * abs(twist) / (k * k + twist * twist), rel=1e-14)
    climb = abs(gait.rate) * r * abs(k) / np.hypot(k, twist)
    assert abs(facts["climbing_speed"]) == pytest.approx(climb, rel=1e-9)
    up = gait.rate > 0.0 if twist >= 0.0 else gait.rate < 0.0
    assert (facts["climbing_speed"] > 0.0) == up
    # every part touches the pole all the time
    axis = np.eye(3)[0 if gait.axis == "x" else 2]
    data = next(c.data for c in motion.claims if c.kind == "grips")["pole"]
    np.testing.assert_allclose(data["direction"], axis, atol=1e-12)
    gaps = pole_gaps(FINE, motion.q, motion.base, np.asarray(data["point"]), axis, facts["pole_radius"])
    assert np.abs(gaps).max() < 3e-4
    # the head is ahead along the pole, and moves along it by the climb
    positions = motion.poses().positions
    ends = positions[:, [0, -1]] @ axis
    assert np.all(ends[:, 1] >= ends[:, 0] - 1e-3)
    moved = positions[-1, 24] - positions[0, 24]
    assert moved @ axis == pytest.approx(facts["climbing_speed"] * facts["period"], abs=1e-9)


@pytest.mark.parametrize("name", list(ALL))
@pytest.mark.parametrize("robot", ["doubles", "alternating"])
def test_rates_and_accelerations_are_those_of_the_positions(robot, name):
    gait = ALL[name]()
    h, t = 1e-3, np.array([0.13, 0.9, 1.7, 2.3])
    motion = bp.plan(ROBOTS[robot], gait, bp.Plane(), np.sort((t[:, None] + h * np.arange(-2, 3)).ravel()))
    q, qd, qdd = (x.reshape(len(t), 5, -1) for x in (motion.q, motion.qd, motion.qdd))
    first = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * h)
    np.testing.assert_allclose(np.einsum("k,tkn->tn", first, q), qd[:, 2], atol=1e-9)
    np.testing.assert_allclose(np.einsum("k,tkn->tn", first, qd), qdd[:, 2], atol=1e-9)


# --- sidewinding --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(SIDE))
def test_wave_is_level(name):
    gait = SIDE[name]()
    curve = gait.curve()
    points, frames = curve.frames(np.arange(5) * 0.64)
    np.testing.assert_allclose(frames, np.broadcast_to(np.eye(3), (5, 3, 3)), atol=2e-10)
    np.testing.assert_allclose(points, np.arange(5)[:, None] * points[1], atol=1e-9)
    first = -np.pi * gait.alpha_yaw * gait.alpha_pitch * np.sin(gait.phase) / 0.64
    assert abs(gait.torsion) == pytest.approx(abs(first), rel=0.25)
    small = bp.Sidewinding(1e-2, 1e-2, 0.64, phase=0.8)
    assert abs(small.torsion) == pytest.approx(np.pi * 1e-4 * np.sin(0.8) / 0.64, rel=1e-3)
    assert abs(bp.Sidewinding(0.5, 0.2, 0.64, phase=0.0).torsion) < 1e-9


def test_joints_are_those_of_the_wave_seen_from_the_middle():
    gait = SIDE["backward"]()
    for robot in (ALTERNATING, ROBOTS["doubles"]):
        t = np.array([0.0, 0.7, 3.1, 9.0])
        motion = bp.plan(robot, gait, bp.Plane(), t)
        for k in range(len(t)):
            fit = gait.fit_at(robot, float(t[k]))
            np.testing.assert_allclose(np.asarray(fit.q), motion.q[k], atol=1e-10)


def test_displacement_is_the_step_less_the_wavelength_along_the_lowest_tangent():
    gait = SIDE["ready"]()
    curve, wave = gait.curve(), 0.64
    s = np.linspace(0, wave, 20001)
    points, frames = curve.frames(s)
    x = points[-1] / np.linalg.norm(points[-1])
    up = frames[:-1, :, 2].mean(axis=0)
    up -= (up @ x) * x
    up /= np.linalg.norm(up)
    lowest = frames[int((points @ up).argmin()), :, 0]
    expected = points[-1] - wave * lowest
    motion = planned(gait, cycles=2)
    moved = motion.base[240, :3] - motion.base[120, :3]
    np.testing.assert_allclose(moved, [np.linalg.norm(expected), 0, 0], atol=1e-4 * wave)
    assert motion.facts["advance_per_cycle"] == pytest.approx(moved[0], rel=1e-12)
    left = np.cross(up, x)
    assert motion.facts["direction_angle"] == pytest.approx(np.arctan2(expected @ left, expected @ x), abs=1e-3)
    # a small lift: J0(alpha) - cos(alpha) along the body, sin(alpha) to its right
    flat = bp.Sidewinding(0.6, 1e-4, wave).plan(FINE, bp.Plane(), np.linspace(0, 1, 3)).facts
    assert flat["advance_per_cycle"] == pytest.approx(wave * np.hypot(j0(0.6) - np.cos(0.6), np.sin(0.6)), rel=1e-4)
    assert flat["direction_angle"] == pytest.approx(np.arctan2(-np.sin(0.6), j0(0.6) - np.cos(0.6)), abs=1e-3)
    back = planned(SIDE["backward"]()).facts
    assert back["advance_per_cycle"] == pytest.approx(motion.facts["advance_per_cycle"], rel=1e-9)


def test_lowest_parts_of_a_fine_body_are_at_rest():
    gait = SIDE["ready"]()
    h, t = 1e-5, np.linspace(0.1, 4.0, 14)
    motion = bp.plan(FINE, gait, bp.Plane(), np.sort(np.concatenate([t - h, t, t + h])))
    positions = motion.poses().positions
    speed = np.linalg.norm((positions[2::3] - positions[::3]) / (2 * h), axis=-1) / 0.16
    height = positions[1::3, :, 2]
    inner = height[:, 2:-2]
    low = (inner < height[:, 1:-3]) & (inner < height[:, 3:-1])  # lowest of their neighbours
    assert low.sum() >= 14
    assert speed[:, 2:-2][low].max() < 0.16  # half a unit away from the lowest point the tangent has turned that far
    assert speed.max() > 1.0  # what is lifted moves faster than the body runs
    heights = lowest_points(FINE, motion.q, motion.base)
    assert heights.min() == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(heights.min(axis=1), 0.0, atol=2e-3)  # at every time something stands


@settings(max_examples=20, deadline=None)
@given(yaw=st.floats(0.1, 1.0), pitch=st.floats(0.02, 0.35), phase=st.floats(-3.1, 3.1), sign=st.sampled_from([-1, 1]))
def test_any_sidewinding_closes_and_goes_along_x(yaw, pitch, phase, sign):
    gait = bp.Sidewinding(yaw, sign * pitch, 0.5, phase=phase, speed=0.1)
    motion = planned(gait, ROBOTS["arcs"], samples=24)
    np.testing.assert_allclose(motion.q[-1], motion.q[0], atol=1e-9)
    np.testing.assert_allclose(motion.base[-1, 1:3], motion.base[0, 1:3], atol=1e-9)
    np.testing.assert_allclose(motion.base[0, :2], 0.0, atol=1e-12)
    assert motion.base[-1, 0] == pytest.approx(motion.facts["advance_per_cycle"], abs=1e-9)


# --- rolling ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [2.0, -2.0])
@pytest.mark.parametrize("curvature", [1.0, -1.0])
@pytest.mark.parametrize("phase", [0.0, 0.7])
def test_arc_rolls_sideways(rate, curvature, phase):
    motion = planned(bp.Rolling(curvature, rate, phase=phase))
    moved = motion.base[-1, :3] - motion.base[0, :3]
    np.testing.assert_allclose(moved, [0, np.sign(rate) * 2 * np.pi * 0.01, 0], atol=1e-12)
    poses = motion.poses()
    # flat, at rest but for the drift, its middle along x
    drift = np.multiply.outer(motion.t, [0, rate * 0.01, 0])[:, None]
    np.testing.assert_allclose(
        poses.positions - drift, np.broadcast_to(poses.positions[0], poses.positions.shape), atol=1e-9
    )
    np.testing.assert_allclose(poses.positions[..., 2], 0.01, atol=1e-9)
    np.testing.assert_allclose(poses.rotations[:, 24, :, 0], np.broadcast_to([1, 0, 0], (121, 3)), atol=1e-9)
    bow = poses.positions[0, 24, 1] - 0.5 * (poses.positions[0, 0, 1] + poses.positions[0, -1, 1])
    assert np.sign(bow) == -np.sign(curvature)
    # the sections turn by -rate about the direction to the head
    step = rotation_log(poses.rotations[1, 24] @ poses.rotations[0, 24].T) / (motion.t[1] - motion.t[0])
    np.testing.assert_allclose(step, [-rate, 0, 0], atol=1e-8)


@pytest.mark.parametrize("name", ["helix", "left-handed helix"])
def test_helix_rolls_without_slip_at_all_its_lowest_points(name):
    gait = ROLL[name]()
    robot = bp.snake(120, 0.03, "arc", axes="universal", radius=0.01)
    motion = planned(gait, robot)
    assert bp.check(motion)["what touches is at rest"].value < 0.03
    assert motion.facts["turns_of_helix"] == pytest.approx(3.6 * np.hypot(gait.curvature, gait.twist) / 2 / np.pi)
    positions = motion.poses().positions
    drift = positions - positions[:1]
    np.testing.assert_allclose(drift, np.broadcast_to(drift[:, :1], drift.shape), atol=2e-4)  # the shape stays
    assert np.linalg.norm(drift[-1, 0]) == pytest.approx(2 * np.pi * 0.01, rel=1e-9)  # one turn, one girth
    extent = np.ptp(positions[0], axis=0)
    radius = motion.facts["helix_radius"]
    np.testing.assert_allclose(extent[1:], 2 * radius, rtol=0.01)
    heights = lowest_points(robot, motion.q, motion.base)
    assert heights.min() == pytest.approx(0.0, abs=1e-12) and heights.max() == pytest.approx(2 * radius, rel=0.01)


def test_period_is_a_turn_of_the_sections():
    for name in ROLL:
        gait = ROLL[name]()
        motion = planned(gait, ROBOTS["doubles"], samples=24)
        assert gait.period(FINE) == pytest.approx(2 * np.pi / abs(gait.rate), rel=1e-15)
        np.testing.assert_allclose(motion.q[-1], motion.q[0], atol=1e-12)
        np.testing.assert_allclose(motion.q[12], -motion.q[0], atol=1e-12)  # half a turn bends the other way
        fit = gait.fit_at(ROBOTS["doubles"], float(motion.t[5]))
        np.testing.assert_allclose(np.asarray(fit.q), motion.q[5], atol=1e-12)


@pytest.mark.parametrize("name", list(ALL))
def test_round_trip(name):
    gait = ALL[name]()
    data = gait.to_dict()
    again = bp.gaits.KINDS[data.pop("kind")](**data)
    assert again == gait and hash(again) == hash(gait)


REFUSED = {
    "alpha_pitch: must not be 0": lambda: bp.Sidewinding(0.5, 0.0, 0.5),
    "alpha_yaw: must not be 0": lambda: bp.Sidewinding(0.0, 0.5, 0.5),
    "alpha_yaw: must be within half a turn": lambda: bp.Sidewinding(1e300, 0.5, 0.5),
    "alpha_pitch: must be within half a turn": lambda: bp.Sidewinding(0.5, -3.2, 0.5),
    "curvature: must be at most": lambda: bp.Rolling(-1e300, 1.0),
    "rate: must be at most": lambda: bp.Rolling(1.0, 1e300),
    "twist: must be at most": lambda: bp.Rolling(1.0, 1.0, 1e300),
    "wavelength: ": lambda: bp.Sidewinding(0.5, 0.1, -0.5),
    "direction: must be 1": lambda: bp.Sidewinding(0.5, 0.1, 0.5, direction=0),
    "curvature: must not be 0": lambda: bp.Rolling(0.0, 1.0),
    "rate: must not be 0": lambda: bp.Rolling(1.0, 0.0),
    "around": lambda: bp.Rolling(1.0, 1.0, around="tree"),
    "axis": lambda: bp.Rolling(1.0, 1.0, around="pole", axis="y"),
    "axis: on the floor": lambda: bp.Rolling(1.0, 1.0, axis="z"),
    "no pole fits in": lambda: planned(bp.Rolling(200.0, 1.0, 20.0, around="pole")),
    "no pitch joints": lambda: planned(bp.Rolling(1.0, 1.0), bp.snake(8, 0.05)),
    "Sidewinding: .* no yaw joints": lambda: planned(SIDE["ready"](), bp.snake(8, 0.05, axes="pitch")),
    "choose smaller": lambda: planned(bp.Sidewinding(2.4, 1.6, 0.5)),
}


@pytest.mark.parametrize("message", list(REFUSED))
def test_refuses(message):
    with pytest.raises(bp.InputError, match=message):
        REFUSED[message]()
