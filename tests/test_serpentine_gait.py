"""Bodies that slide along a curve: exact in time, without slip, level, steered and changed without a jump."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.special import j0

import bodyplan as bp
from bodyplan import curves
from bodyplan.gaits.chassis import mean_frames, mean_rotation, part_of
from bodyplan.gaits.pace import Pace
from bodyplan.gaits.touching import lowest_points
from bodyplan.spatial import compose, inverse, matrix_from_quaternion, rotation_exp, rotation_log

ALPHA = np.radians(75.0)
WAVE = curves.from_dict({"kind": "serpenoid", "alpha": ALPHA, "wavelength": 0.64})
LIFT = {"alpha": ALPHA, "lift": 0.3, "wavelength": 0.64}
LIFTED = curves.from_dict({"kind": "sinus-lift", **LIFT})
SPIRAL = curves.from_dict({"kind": "spiral", "curvature": 4.0, "twist": 6.0})
ACM = bp.acm_l2()
ROBOTS = {
    "ACM-L2": ACM,
    "yaw": bp.snake(20, 0.05),
    "alternating": bp.snake(24, 0.035, axes="alternating"),
    "universal": bp.snake(14, 0.05, axes="universal"),
    "arc": bp.snake(11, 0.07, "arc", axes="universal"),
    "double": bp.snake(12, 0.06, "double", axes="universal", end_link=0.1),
}
GAITS = {
    "serpentine": lambda: bp.Serpentine(WAVE, 0.16),
    "backward": lambda: bp.Serpentine(WAVE, 0.16, -1),
    "steered": lambda: bp.Serpentine(WAVE, 0.16, steer=0.3),
    "chassis": lambda: bp.Serpentine(WAVE, 0.16, base="chassis", start=0.1),
    "smooth": lambda: bp.Serpentine(WAVE, 0.16, ramp=1.0, stop=6.0, steer=[(1.0, 0.5), (3.0, -0.2)]),
    "lifted": lambda: bp.SinusLifting(**LIFT, speed=0.16, p=0.789),
    "lifted and steered": lambda: bp.SinusLifting(**LIFT, speed=0.16, steer=-0.4, direction=-1),
    "lifted chassis": lambda: bp.SinusLifting(**LIFT, speed=0.16, steer=0.3, base="chassis"),
    "spiral": lambda: bp.Serpentine(SPIRAL, 0.16),
    "changed": lambda: bp.Serpentine(WAVE, 0.16, ramp=1.0, changes=[(2.0, LIFTED), (5.0, SPIRAL)]),
    "changed backward": lambda: bp.Serpentine(
        WAVE, 0.16, -1, changes=[(1.0, LIFTED), (3.0, SPIRAL)], steer=[(0.5, 0.5), (2.0, -0.5)], change_length=0.3
    ),
}
FLAT = ("serpentine", "backward", "steered", "chassis", "smooth")


def planned(gait, robot=ACM, samples=100, cycles=1):
    period = gait.period(robot)
    t = np.linspace(0.0, 8.0, 401) if period is None else np.arange(cycles * samples + 1) * (period / samples)
    return bp.plan(robot, gait, bp.Plane(), t)


@pytest.mark.parametrize("name", list(GAITS))
@pytest.mark.parametrize("robot", list(ROBOTS))
def test_passes_its_checks(robot, name):
    gait = GAITS[name]()
    if robot == "yaw" and name not in FLAT:
        with pytest.raises(bp.InputError, match=r"bends in pitch, and 'snake' has no pitch joints"):
            planned(gait, ROBOTS[robot])
        return
    motion = planned(gait, ROBOTS[robot])
    report = bp.check(motion)
    assert report.ok, str(report)
    kinds = {line.kind for line in report if line.passed}
    assert "follows" in kinds and ("no_slip" in kinds) == ("chassis" not in name)
    assert ("periodic" in kinds) == (gait.period(ROBOTS[robot]) is not None)
    assert motion.ok and motion.residual.max() < 1e-10


@pytest.mark.parametrize("name", list(GAITS))
def test_rates_and_accelerations_are_those_of_the_positions(name):
    gait = GAITS[name]()
    h, t = 1e-3, np.array([0.13, 0.9, 1.7, 2.3, 3.9, 5.4, 5.9, 7.7])
    stencil = np.sort((t[:, None] + h * np.arange(-2, 3)).ravel())
    motion = bp.plan(ACM, gait, bp.Plane(), stencil)
    q, qd, qdd = (x.reshape(len(t), 5, -1) for x in (motion.q, motion.qd, motion.qdd))
    first, second = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * h), np.array([-1.0, 16, -30, 16, -1]) / (12 * h * h)
    np.testing.assert_allclose(np.einsum("k,tkn->tn", first, q), qd[:, 2], atol=2e-8)
    np.testing.assert_allclose(np.einsum("k,tkn->tn", first, qd), qdd[:, 2], atol=2e-7)
    np.testing.assert_allclose(np.einsum("k,tkn->tn", second, q), qdd[:, 2], atol=2e-5)


SHIFTED = [name for name in GAITS if name != "spiral"]


@pytest.mark.parametrize("name", SHIFTED)
@pytest.mark.parametrize("robot", ["ACM-L2", "arc", "double"])
@pytest.mark.parametrize("shift", [(0.0, 0.03, 0.0), (0.0, 0.0, 0.01)], ids=["sideways", "up"])
def test_a_shifted_base_is_refused(robot, name, shift):
    motion = planned(GAITS[name](), ROBOTS[robot], samples=50)
    base = motion.base.copy()
    base[:, :3] += shift
    report = bp.check(motion.replace(base=base))
    assert "follows" in {line.kind for line in report.failures}, str(report)


def test_tolerance_is_twice_what_a_fit_leaves():
    for name in ("serpentine", "lifted", "changed"):
        gait = GAITS[name]()
        motion = planned(gait)
        data = next(claim.data for claim in motion.claims if claim.kind == "follows")
        distances = [gait.fit_at(ACM, t).max_distance for t in np.linspace(0.0, motion.t[-1], 101)]
        assert data["tolerance"] == pytest.approx(2.0 * max(distances), rel=0.05)
        assert data["tolerance"] < 0.25 * 0.5 * 0.078  # of half a unit
    # a mechanism as coarse as this leaves its curve by more than half a unit: no tolerance is made for that
    coarse = bp.snake(12, 0.1, axes="universal")
    steep = planned(bp.Serpentine({"kind": "serpenoid", "alpha": 1.6, "wavelength": 0.25}, 0.1), coarse)
    data = next(claim.data for claim in steep.claims if claim.kind == "follows")
    assert data["tolerance"] == pytest.approx(0.5 * 1.2 / 11, rel=1e-12)
    assert "follows" in {line.kind for line in bp.check(steep).failures}


def test_wave_runs_tailward_and_the_body_forward():
    """The joints at (s, t) bend as those a wavelength share further ahead did before: q(s, t) = f(s + v t)."""
    robot = bp.snake(64, 0.02, axes="yaw")
    for direction in (1, -1):
        gait = bp.Serpentine(WAVE, 0.16, direction)
        late = 0.02 / 0.16  # the wave runs one link on
        motion = bp.plan(robot, gait, bp.Plane(), np.array([0.0, late]))
        here, ahead = (motion.q[1, :-1], motion.q[0, 1:]) if direction > 0 else (motion.q[1, 1:], motion.q[0, :-1])
        np.testing.assert_allclose(here, ahead, atol=1e-13)
        assert np.sign(motion.base[1, 0]) == direction
        assert motion.facts["speed"] == pytest.approx(direction * 0.16 * j0(ALPHA), rel=1e-10)
        assert motion.facts["no_slip_speed"] == pytest.approx(0.16 * j0(ALPHA), rel=1e-10)


def test_repeats_after_a_period():
    motion = planned(bp.Serpentine(WAVE, 0.16), cycles=2)
    assert motion.facts["period"] == pytest.approx(4.0, rel=1e-14)
    np.testing.assert_allclose(motion.q[100], motion.q[0], atol=1e-12)
    moved = motion.base[100] - motion.base[0]
    np.testing.assert_allclose(moved, [motion.facts["advance_per_cycle"], 0, 0, 0, 0, 0, 0], atol=1e-11)
    assert motion.facts["advance_per_cycle"] == pytest.approx(0.64 * j0(ALPHA), rel=1e-10)
    np.testing.assert_allclose(motion.base[0, :2], 0.0, atol=1e-15)


@pytest.mark.parametrize("curve", [WAVE, LIFTED], ids=["flat", "lifted"])
def test_fine_body_moves_along_itself(curve):
    """Every frame's velocity is along its e_r, with the speed along the body; the error is that of the fit."""
    slips = []
    for n in (20, 40):
        robot = bp.snake(n, 0.8 / n, "arc", axes="universal")
        gait = bp.Serpentine(curve, 0.16)
        t = np.arange(1, 12) * 0.317
        h = 1e-5
        motion = bp.plan(robot, gait, bp.Plane(), np.sort(np.concatenate([t - h, t, t + h])))
        poses = motion.poses()
        velocity = (poses.positions[2::3] - poses.positions[::3]) / (2 * h)
        along = poses.rotations[1::3][..., 0]
        slips.append(np.linalg.norm(velocity - 0.16 * along, axis=-1).max() / 0.16)
    assert slips[1] < 0.03 and slips[0] / slips[1] > 3.5  # second order at least


@pytest.mark.parametrize("steer", [0.5, -0.5, 1e-3, 6.0])
def test_steering_turns_by_steer_times_wavelength(steer):
    motion = planned(bp.Serpentine(WAVE, 0.16, steer=steer))
    assert motion.facts["turn_per_cycle"] == pytest.approx(steer * 0.64, rel=1e-9)
    turned = rotation_log(motion.poses().rotations[-1, 0] @ motion.poses().rotations[0, 0].T)
    np.testing.assert_allclose(turned, [0, 0, (steer * 0.64 + np.pi) % (2 * np.pi) - np.pi], atol=1e-10)
    assert motion.facts["advance_per_cycle"] > 0 and abs(motion.facts["sideways_per_cycle"]) < 1e-12
    # after k cycles the tail is on the circle through its first places
    ring = planned(bp.Serpentine(WAVE, 0.16, steer=0.5), samples=4, cycles=6).base[::4, :2]
    chords = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    np.testing.assert_allclose(chords, chords[0], rtol=1e-9)


@pytest.mark.parametrize("robot", ["ACM-L2", "yaw"])
@pytest.mark.parametrize("base", ["follow", "chassis"])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("steer", [0.0, 0.5, -2.0])
def test_facts_are_what_is_planned(robot, base, direction, steer):
    robot = ROBOTS[robot]
    motion = planned(bp.Serpentine(WAVE, 0.16, direction, steer, base=base, start=0.13), robot, cycles=2)
    facts = motion.facts
    moved = motion.base[100, :3] - motion.base[0, :3]
    expected = [facts["advance_per_cycle"], facts["sideways_per_cycle"], 0.0]
    np.testing.assert_allclose(moved, expected, atol=1e-10)
    assert facts["advance_per_body_length"] == pytest.approx(moved[0] / facts["body_length"], rel=1e-9)
    turned = rotation_log(motion.poses().rotations[100, 0] @ motion.poses().rotations[0, 0].T)
    np.testing.assert_allclose(turned, [0, 0, facts["turn_per_cycle"]], atol=1e-10)
    assert facts["turn_per_cycle"] == pytest.approx(direction * steer * 0.64, abs=1e-9)
    # the centre of mass, as far as it goes in a cycle; every body of these robots weighs
    poses, bodies = motion.poses(), [robot.base_body, *(element.body for element in robot.elements)]
    centres = [
        sum(b.mass * (poses.positions[k, i] + poses.rotations[k, i] @ b.com) for i, b in enumerate(bodies) if b)
        / sum(b.mass for b in bodies if b)
        for k in (0, 100)
    ]
    size = np.linalg.norm(centres[1] - centres[0])
    assert facts["no_slip_speed"] == pytest.approx(size / facts["period"], rel=1e-9)
    assert facts["speed"] == pytest.approx(direction * size / facts["period"], rel=1e-9)
    assert bp.check(motion)["the cycle closes"].passed


def test_backward_cycle_is_the_inverse_of_the_forward_one():
    there, back = (planned(bp.Serpentine(WAVE, 0.16, direction, 0.8)) for direction in (1, -1))
    cycle, inverse_cycle = (next(c.data for c in m.claims if c.kind == "periodic") for m in (there, back))
    both = [compose(np.append(d["advance"], [1, 0, 0, 0.0]), _turned(d["turn"])) for d in (cycle, inverse_cycle)]
    np.testing.assert_allclose(compose(*both), [0, 0, 0, 1, 0, 0, 0], atol=1e-12)
    # the same curve in the same place, and the way back begins where the way there does
    assert abs(back.facts["sideways_per_cycle"]) > 0.1 and abs(there.facts["sideways_per_cycle"]) < 1e-12


def _turned(vector):
    angle = np.linalg.norm(vector)
    return np.concatenate([np.zeros(3), [np.cos(0.5 * angle)], np.sin(0.5 * angle) / angle * np.asarray(vector)])


def test_smooth_start_and_stop():
    gait = bp.Serpentine(WAVE, 0.16, ramp=1.0, stop=5.0)
    t = np.linspace(0.0, 6.0, 6001)
    motion = bp.plan(ACM, gait, bp.Plane(), t)
    assert np.abs(motion.qd[0]).max() == 0.0 and np.abs(motion.qdd[0]).max() == 0.0
    assert np.abs(motion.qd[5000:]).max() < 1e-12 and np.abs(motion.qdd[5000:]).max() < 1e-12
    assert np.abs(np.diff(motion.qdd, axis=0)).max() < 0.03  # of a peak of 3 rad/s^2: continuous
    assert np.abs(motion.qdd).max() > 2.0
    assert gait.period(ACM) is None
    # half the ramps are lost
    assert gait.pace.at(np.array(6.0))[0] == pytest.approx(0.16 * 4.0, rel=1e-14)


@settings(max_examples=30, deadline=None)
@given(
    ramp=st.just(0.0) | st.floats(0.2, 3.0),
    more=st.floats(0.0, 4.0),
    direction=st.sampled_from([1, -1]),
    start=st.floats(-1, 1),
)
def test_pace_is_the_integral_of_its_speed(ramp, more, direction, start):
    pace = Pace.of(0.3, direction, start, ramp, 2 * ramp + more if ramp > 0 and more > 0.1 else None)
    t = np.linspace(0.0, 8.0, 4001)
    sigma, speed, acceleration = pace.at(t)
    assert sigma[0] == start and speed[0] == (0.0 if ramp else direction * 0.3)
    step, h, rise = np.diff(sigma), 0.002, ramp or 1.0
    # the error of the trapezoidal rule, h^3/12 times the second derivative
    np.testing.assert_allclose(step, 0.5 * (speed[1:] + speed[:-1]) * h, rtol=0, atol=h**3 / 12 * 1.74 / rise**2)
    mean = 0.5 * (acceleration[1:] + acceleration[:-1])
    np.testing.assert_allclose(np.diff(speed), mean * h, rtol=0, atol=h**3 / 12 * 18.1 / rise**3 + 1e-15)
    assert np.all(direction * step >= -1e-15)


@pytest.mark.parametrize("name", ["changed", "changed backward"])
def test_changes_do_not_jump(name):
    gait = GAITS[name]()
    biggest = []
    for samples in (1001, 4001):
        t = np.linspace(0.5, 7.5, samples)
        motion = bp.plan(ACM, gait, bp.Plane(), t)
        biggest.append(
            [np.abs(np.diff(x, axis=0)).max() for x in (motion.q, motion.qd, motion.qdd, motion.base[:, :3])]
        )
    coarse, fine = np.array(biggest)
    assert np.all(coarse / fine > 3.0)  # steps shrink with the time step: nothing jumps
    # before the change the body is on the first curve, long after it on the last
    first = bp.plan(
        ACM, bp.Serpentine(WAVE, 0.16, gait.pace.direction, ramp=gait.pace.ramp), bp.Plane(), np.array([0.0, 0.4])
    )
    np.testing.assert_allclose(bp.plan(ACM, gait, bp.Plane(), np.array([0.0, 0.4])).q, first.q, atol=1e-12)


BEFORE_THE_BODY = {
    "steer": {"steer": [(0.0, 2.0), (0.6, -1.0)]},
    "lift": {"changes": [(0.0, bp.SinusLift(1.2, 0.2, 0.6))]},
    "spiral": {"changes": [(0.5, SPIRAL)], "steer": 0.4, "change_length": 0.2},
    "all": {"changes": [(0.2, LIFTED), (0.5, SPIRAL)], "steer": [(0.1, 0.5)], "ramp": 0.4},
}


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("start", [-3.0, -0.4, 0.0, 0.5, 3.0])
@pytest.mark.parametrize("name", list(BEFORE_THE_BODY))
def test_begins_level_at_the_origin_whatever_the_curve_does_elsewhere(name, start, direction):
    """The body begins where it would without the changes to come, which may lie between it and s = 0."""
    options = dict(BEFORE_THE_BODY[name])
    gait = bp.Serpentine(bp.Serpenoid(1.0, 0.6), 0.2, direction, start=start, **options)
    steer = options.get("steer", [])
    plain = bp.Serpentine(
        bp.Serpenoid(1.0, 0.6), 0.2, direction, steer if isinstance(steer, float) else 0.0, start=start
    )
    t = np.linspace(0.0, 2.0, 41)
    motion, other = bp.plan(ACM, gait, bp.Plane(), t), bp.plan(ACM, plain, bp.Plane(), t)
    np.testing.assert_allclose(motion.q[0], other.q[0], atol=1e-11)
    np.testing.assert_allclose(motion.base[0, :2], 0.0, atol=1e-11)
    np.testing.assert_allclose(motion.base[0, 3:], other.base[0, 3:], atol=1e-11)
    assert bp.check(motion).ok
    # the stretch under the body at the start goes along +x, level
    pose = np.asarray(next(claim for claim in motion.claims if claim.kind == "follows").data["pose"])
    points, frames = gait.course(ACM).frames(np.array([start, start + 0.6]), pose)
    np.testing.assert_allclose(points[0, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose((points[1] - points[0])[1:], 0.0, atol=1e-9)
    np.testing.assert_allclose(frames[:, :, 2], [[0, 0, 1], [0, 0, 1]], atol=1e-9)
    assert points[1, 0] - points[0, 0] == pytest.approx(
        0.6 * j0(1.0), rel=1e-9 if not isinstance(steer, float) else 0.1
    )


def test_after_a_change_the_body_is_on_the_next_curve():
    gait = bp.Serpentine(WAVE, 0.16, changes=[(1.0, LIFTED)])
    t = np.array([0.0, 12.0, 13.0])  # the head went over within a wavelength, the tail 0.7 m later
    late = bp.plan(ACM, gait, bp.Plane(), t)
    direct = bp.plan(ACM, bp.Serpentine(LIFTED, 0.16), bp.Plane(), t)
    np.testing.assert_allclose(late.q[1:], direct.q[1:], atol=1e-12)
    assert np.abs(late.q[0] - direct.q[0]).max() > 0.05


@pytest.mark.parametrize("name", ["chassis", "lifted chassis"])
def test_mean_frame_moves_evenly(name):
    gait = GAITS[name]()
    motion = planned(gait, samples=40, cycles=2)
    mean = compose(motion.base, mean_frames(ACM, motion.q))
    steps = [compose(mean[k + 1], inverse(mean[k])) for k in range(80)]
    np.testing.assert_allclose(steps, np.broadcast_to(steps[0], (80, 7)), atol=1e-10)
    # the same joints as the body that follows the curve
    options = {k: v for k, v in gait.to_dict().items() if k not in ("kind", "base")}
    other = planned(type(gait)(**options), samples=40, cycles=2)
    np.testing.assert_array_equal(other.q, motion.q)
    swing = rotation_log(other.poses().rotations[:40, 0])[:, 2]
    assert np.ptp(swing) > 1.0 and np.abs(other.base[-1, :2] - motion.base[-1, :2]).max() < 0.2


@pytest.mark.parametrize("robot", list(ROBOTS))
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("steer", [0.0, 0.8])
def test_a_flat_chassis_stays_flat(robot, direction, steer):
    """Whichever way frames lie in their bodies: those of two-axis double joints lie on their side."""
    gait = bp.Serpentine(bp.Serpenoid(1.0, 0.6), 0.2, direction, steer, base="chassis", start=0.1)
    motion = planned(gait, ROBOTS[robot], samples=60)
    assert np.ptp(motion.base[:, 2]) < 1e-12
    np.testing.assert_allclose(motion.poses().rotations[:, 0, 2], np.broadcast_to([0, 0, 1], (61, 3)), atol=1e-12)
    report = bp.check(motion)
    assert report.ok, str(report)


def test_the_mean_frame_of_a_straight_body_is_that_of_its_base():
    rng = np.random.default_rng(5)
    for robot in ROBOTS.values():
        rest, turned = mean_frames(robot, np.array([np.zeros(robot.n), rng.normal(size=robot.n)]))
        np.testing.assert_allclose(rest[3:], [1, 0, 0, 0], atol=1e-14)
        assert np.abs(turned[3:] - rest[3:]).max() > 1e-3


def test_mean_rotation_and_parts_of_a_screw():
    rng = np.random.default_rng(3)
    R = rotation_exp(rng.normal(size=(7, 3)))
    np.testing.assert_allclose(matrix_from_quaternion(mean_rotation(R)), R, atol=1e-14)
    total = R.sum(axis=0)
    best = matrix_from_quaternion(mean_rotation(total))
    for k in range(50):
        assert np.sum(best * total) >= np.sum((best @ rotation_exp(0.1 * rng.normal(size=3))) * total) - 1e-12, k
    advance, turn = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 4.0])
    whole = part_of(advance, turn, np.array(1.0))
    np.testing.assert_allclose(whole[:3], advance, atol=1e-14)
    half = part_of(advance, turn, np.array(0.5))
    np.testing.assert_allclose(compose(half, half), whole, atol=1e-14)


def test_level_sinus_lifting_stands_on_the_floor():
    fine = bp.snake(60, 0.02, "arc", axes="universal", radius=0.005)
    motion = planned(bp.SinusLifting(**LIFT, speed=0.16), fine, samples=64)
    heights = lowest_points(fine, motion.q, motion.base)
    assert heights.min() == pytest.approx(0.0, abs=1e-12)
    # every part comes down to the floor and goes up to the same height: level along x, and not tilted to a side
    np.testing.assert_allclose(heights.min(axis=0), 0.0, atol=2e-4)
    np.testing.assert_allclose(heights.max(axis=0), motion.facts["lift"], atol=1e-3)
    assert 0.015 < motion.facts["lift"] < 0.025
    moved = motion.base[-1, :3] - motion.base[0, :3]
    np.testing.assert_allclose(moved[1:], 0.0, atol=1e-11)


def test_links_that_touch_are_those_that_bend_least():
    motion = planned(bp.SinusLifting(**LIFT, speed=0.16), samples=64)
    sigma = 0.16 * motion.t
    at = {c.name: x for c, x in zip(ACM.contacts, _stations(ACM), strict=True)}
    inner = [k for k, name in enumerate(at) if name not in ("tail", "link9")]
    s = sigma[:, None] + np.array(list(at.values()))[inner]
    bend = np.abs(LIFTED.shape(s).kappa_y) / (ALPHA * 2 * np.pi / 0.64)
    touches = motion.contacts[:, inner] > 0.5
    assert 0.2 < touches.mean() < 0.6
    assert bend[touches].max() < 0.75 and bend[touches].mean() < 0.35
    assert bend[~touches].mean() > 0.75 and not touches[bend > 0.95].any()
    # the other sign of c0 stands on the bends
    wrong = planned(bp.SinusLifting(ALPHA, -0.3, 0.64, speed=0.16), samples=64)
    assert bend[wrong.contacts[:, inner] > 0.5].mean() > 0.75


def _stations(robot):
    rest = robot.forward(np.zeros(robot.n))
    return [rest[c.frame][0] + float(c.points()[:, 0].mean()) for c in robot.contacts]


def test_no_lift_is_plain_serpentine_movement():
    lifted, plain = planned(bp.SinusLifting(ALPHA, 0.0, 0.64, speed=0.16)), planned(bp.Serpentine(WAVE, 0.16))
    np.testing.assert_allclose(lifted.q, plain.q, atol=1e-13)
    np.testing.assert_allclose(lifted.base, plain.base, atol=1e-12)
    assert plain.contacts is None and lifted.contacts is None
    paper = planned(bp.SinusLifting(**LIFT, c1="paper", speed=0.16))
    assert abs(paper.facts["turn_per_cycle"]) < 1e-9  # it climbs or dives, it does not turn to a side
    assert any("leaves the level" in note for note in paper.notes)


def test_spiral_goes_along_its_axis():
    motion = planned(bp.Serpentine(SPIRAL, 0.16))
    assert motion.facts["sideways_per_cycle"] != 0.0
    axis = next(c for c in motion.claims if c.kind == "periodic").data["turn"]
    np.testing.assert_allclose(np.abs(axis / np.linalg.norm(axis)), [1, 0, 0], atol=1e-12)
    # sections of a helix of torsion t, curvature k advance along the axis by t / sqrt(k^2 + t^2)
    assert motion.facts["speed"] == pytest.approx(0.16 * 6 / np.hypot(4, 6), rel=1e-9)


def test_fit_at_is_the_fit_of_the_curve_under_way():
    gait = GAITS["changed"]()
    motion = bp.plan(ACM, gait, bp.Plane(), np.array([0.0, 3.3]))
    fit = gait.fit_at(ACM, 3.3)
    np.testing.assert_allclose(np.asarray(fit.q), motion.q[1], atol=1e-13)
    assert motion.facts["fit_error"] == pytest.approx(gait.fit_at(ACM, 0.0).error, rel=1e-12)
    assert gait.course(ACM).kind == "transition"


@pytest.mark.parametrize("name", list(GAITS))
def test_round_trip(name):
    gait = GAITS[name]()
    data = gait.to_dict()
    again = bp.gaits.KINDS[data.pop("kind")](**data)
    assert again == gait and again.to_dict() == gait.to_dict() and hash(again) == hash(gait)


def test_texts_with_units_inside_the_options():
    table = {"kind": "serpenoid", "alpha": "75 deg", "wavelength": "640 mm"}
    gait = bp.Serpentine(table, 0.16, steer=[["1 s", "0.5 1/m"]], changes=[["2 s", table]])
    assert gait.curve == WAVE and gait.steer == ((1.0, 0.5),) and gait.changes == ((2.0, WAVE),)


def test_constant_and_aperiodic_curves():
    arc = bp.Serpentine({"kind": "constant", "kappa_y": 1.0}, 0.1)
    motion = planned(arc)
    assert np.abs(np.diff(motion.q, axis=0)).max() < 1e-13 and bp.check(motion).ok
    assert motion.facts["turn_per_cycle"] == pytest.approx(motion.facts["wavelength"], rel=1e-12)
    path = bp.Serpentine({"kind": "segments", "pieces": [[1.0, 0, 0, 0], [0.5, 0, 0, 2.0], [1.0, 0, 0, 0]]}, 0.2)
    assert path.period(ACM) is None
    motion = planned(path)
    assert bp.check(motion).ok and "period" not in motion.facts
    np.testing.assert_allclose(motion.q[0], 0.0, atol=1e-14)


@pytest.mark.parametrize("direction", [1, -1])
def test_steering_before_the_body_moves_takes_the_later_value(direction):
    """1e-5 s into the ramp the body has moved by less than rounding."""
    options = {"direction": direction, "ramp": 1.0, "stop": 4.0}
    t = np.linspace(0.0, 5.0, 51)
    twice, once = (
        bp.plan(ACM, bp.Serpentine(WAVE, 0.16, steer=steer, **options), bp.Plane(), t)
        for steer in (
            [(0.0, 3.0), (1e-5, 0.5), (3.0, 0.2), (4.0 - 1e-5, 2.0), (4.0 - 1e-6, 1.0)],
            [(0.0, 0.5), (3.0, 0.2)],
        )
    )
    np.testing.assert_allclose(twice.q, once.q, atol=1e-11)
    np.testing.assert_allclose(twice.base, once.base, atol=1e-11)


def test_beyond_a_joint_limit_is_a_status():
    robot = bp.snake(12, 0.06, "arc", axes="universal", limits=(-0.4, 0.4))
    motion = planned(bp.Serpentine(WAVE, 0.16), robot)
    assert not motion.ok and set(motion.status) == {"limit"}
    beyond = np.abs(motion.q).max(axis=1) > 0.4
    np.testing.assert_array_equal(motion.status == "limit", beyond)


REFUSED = {
    "curve: expected": lambda: bp.Serpentine(3.0),
    "curve: .*kind": lambda: bp.Serpentine({"kind": "serpentoid"}),
    "speed: .*> 0": lambda: bp.Serpentine(WAVE, 0.0),
    "direction: must be 1": lambda: bp.Serpentine(WAVE, 0.1, 2),
    "base": lambda: bp.Serpentine(WAVE, base="head"),
    "stop: a smooth stop": lambda: bp.Serpentine(WAVE, stop=3.0),
    "ramp: ": lambda: bp.Serpentine(WAVE, ramp=-1.0),
    "steer: times must increase": lambda: bp.Serpentine(WAVE, steer=[(2.0, 0.1), (1.0, 0.2)]),
    "steer: expected pairs": lambda: bp.Serpentine(WAVE, steer=[1.0, 2.0]),
    "steer: times must be < stop": lambda: bp.Serpentine(WAVE, ramp=1.0, stop=4.0, steer=[(1.0, 0.1), (5.0, 0.2)]),
    "changes: times must be < stop": lambda: bp.Serpentine(WAVE, ramp=1.0, stop=4.0, changes=[(4.0, LIFTED)]),
    "changes: times must be >= 0": lambda: bp.Serpentine(WAVE, changes=[(-1.0, WAVE)]),
    "changes: at most 10": lambda: bp.Serpentine(WAVE, changes=[(k, WAVE) for k in range(11)]),
    "base: 'chassis' needs": lambda: bp.Serpentine(WAVE, base="chassis", changes=[(1.0, LIFTED)]),
    "p: ": lambda: bp.Serpentine(WAVE, p=0.4),
    "change_length: ": lambda: bp.Serpentine(WAVE, change_length=0.0),
    "alpha": lambda: bp.SinusLifting("75 deg", 0.3, 0.64),
    "wavelength": lambda: bp.SinusLifting(1.0, 0.3, 0.0),
    "c1: no value that keeps .* is connected with c1 = 0": lambda: bp.SinusLifting(2.4048, 0.3, 0.64),
}


@pytest.mark.parametrize("message", list(REFUSED))
def test_refuses(message):
    with pytest.raises(bp.InputError, match=message):
        REFUSED[message]()


def test_refuses_ground_and_times():
    gait = bp.Serpentine(WAVE)
    with pytest.raises(bp.InputError, match="level floor"):
        bp.plan(ACM, gait, bp.Surface("0.1*x"), np.linspace(0, 1, 11))
    with pytest.raises(bp.InputError, match="starts at t = 0"):
        bp.plan(ACM, gait, bp.Plane(), np.linspace(-1, 1, 11))
    raised = bp.plan(ACM, gait, bp.Plane(0.3), np.linspace(0, 1, 11))
    np.testing.assert_allclose(raised.base[:, 2], 0.3 + 0.025, atol=1e-12)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    n=st.integers(3, 20),
    joint=st.sampled_from(["straight", "arc", "double"]),
    end=st.floats(0.05, 0.45),
    alpha=st.floats(0.1, 1.5),
    waves=st.floats(0.5, 1.5),
)
def test_any_snake_closes_its_cycle_and_stays_near(n, joint, end, alpha, waves):
    options = {"end_link": end} if joint == "double" else {}
    robot = bp.snake(n, 1.0 / n, joint, axes="yaw", **options)
    gait = bp.Serpentine({"kind": "serpenoid", "alpha": alpha, "wavelength": 1.0 / waves}, 0.2)
    motion = planned(gait, robot, samples=30)
    np.testing.assert_allclose(motion.q[-1], motion.q[0], atol=1e-11)
    np.testing.assert_allclose(motion.base[-1, :2], [j0(alpha) / waves, 0.0], atol=1e-9)
    assert bp.check(motion)["the cycle closes"].passed


def test_no_steering_is_straight_on():
    assert bp.Serpentine(bp.Serpenoid(1.0, 0.6), 0.2, steer=[]) == bp.Serpentine(bp.Serpenoid(1.0, 0.6), 0.2)
