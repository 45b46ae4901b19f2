"""What following gaits claim, and that the judge refuses each claim for a corrupted motion."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.check import claims
from bodyplan.motion import Claim
from bodyplan.spatial import compose, inverse, rotations

ACM = bp.acm_l2()
WAVE = {"kind": "serpenoid", "alpha": 1.2, "wavelength": 0.64}


def planned(gait, robot=ACM, cycles=2):
    return bp.plan(robot, gait, bp.Plane(), np.arange(cycles * 100 + 1) * (gait.period(robot) / 100))


@pytest.fixture(scope="module")
def serpentine():
    return planned(bp.Serpentine(WAVE, 0.16, steer=0.4))


@pytest.fixture(scope="module")
def sidewinding():
    return planned(bp.Sidewinding(0.6, 0.2, 0.64, speed=0.16), bp.snake(16, 0.06, "arc", axes="universal"))


@pytest.fixture(scope="module")
def climbing():
    robot = bp.snake(24, 0.04, "arc", axes="universal", radius=0.01)
    return planned(bp.Rolling(3.0, 2.0, 5.0, around="pole"), robot)


def failed(motion):
    return {line.kind for line in bp.check(motion).failures}


def value(motion, kind):
    return next(line for line in bp.check(motion) if line.kind == kind)


def test_honest_motions_pass(serpentine, sidewinding, climbing):
    for motion in (serpentine, sidewinding, climbing):
        assert not failed(motion), str(bp.check(motion))


def spoil(motion, field, change):
    out = np.array(getattr(motion, field))
    change(out)
    return motion.replace(**{field: out})


def test_shifted_joints_are_refused(serpentine):
    rolled = serpentine.replace(q=np.roll(serpentine.q, 2, axis=1), qd=np.roll(serpentine.qd, 2, axis=1))
    assert {"follows", "no_slip"} <= failed(rolled)
    one = spoil(serpentine, "q", lambda q: np.add(q[:, 6], 0.2, out=q[:, 6]))
    assert "follows" in failed(one)


def test_time_run_backwards_is_refused(serpentine):
    back = serpentine.replace(
        q=serpentine.q[::-1], qd=-serpentine.qd[::-1], qdd=serpentine.qdd[::-1], base=serpentine.base[::-1]
    )
    assert {"follows", "no_slip", "periodic"} <= failed(back)
    assert value(back, "no_slip").value == pytest.approx(2.0, abs=0.1)
    # a planner that claims the places of the reversed motion still slips
    said = [
        Claim(c.kind, c.label, {**c.data, "places": np.asarray(c.data["places"])[::-1]}) if c.kind == "follows" else c
        for c in serpentine.claims
    ]
    assert "no_slip" in failed(back.replace(claims=tuple(said)))


def with_claim(motion, kind, **data):
    said = [Claim(c.kind, c.label, {**c.data, **data}) if c.kind == kind else c for c in motion.claims]
    return motion.replace(claims=tuple(said))


def claim_of(motion, kind):
    return next(c for c in motion.claims if c.kind == kind)


def test_wrong_places_curves_and_poses_are_refused(serpentine):
    data = claim_of(serpentine, "follows").data
    assert "follows" in failed(with_claim(serpentine, "follows", places=np.asarray(data["places"]) + 0.05))
    assert "follows" in failed(with_claim(serpentine, "follows", places=np.asarray(data["places"])[:, ::-1]))
    assert "follows" in failed(with_claim(serpentine, "follows", curve={**WAVE, "alpha": 0.8}))
    pose = np.array(data["pose"])
    pose[1] += 0.05
    assert "follows" in failed(with_claim(serpentine, "follows", pose=pose))
    assert "follows" in failed(with_claim(serpentine, "follows", places=np.zeros((3, 2))))
    assert "no_slip" in failed(with_claim(serpentine, "no_slip", speed=np.full(201, 0.3)))
    assert "no_slip" in failed(with_claim(serpentine, "no_slip", speed=np.full(5, 0.16)))
    assert "no_slip" in failed(with_claim(serpentine, "no_slip", frames=["base", "base"]))


def test_the_value_is_the_distance_from_the_curve(serpentine):
    """Lifted by 5 mm, the frames are 5 mm off (they lie in the plane of the curve to begin with, to 1 mm)."""
    data = claim_of(serpentine, "follows").data
    pose = np.array(data["pose"])
    pose[2] += 0.005
    before = value(serpentine, "follows").value
    after = value(with_claim(serpentine, "follows", pose=pose), "follows").value
    assert after == pytest.approx(np.hypot(before, 0.005), rel=1e-9)
    moving = np.repeat(np.array(data["pose"])[None], len(serpentine.t), axis=0)
    assert value(with_claim(serpentine, "follows", pose=moving), "follows").value == pytest.approx(before, rel=1e-12)


def test_sliding_is_refused(serpentine, sidewinding):
    drift = np.linspace(0.0, 0.6, 201)
    aside = spoil(serpentine, "base", lambda b: np.add(b[:, 1], drift, out=b[:, 1]))
    assert {"follows", "no_slip", "periodic"} <= failed(aside)
    creeping = spoil(sidewinding, "base", lambda b: np.add(b[:, 0], drift, out=b[:, 0]))
    assert {"grips", "follows", "periodic"} <= failed(creeping)
    floating = spoil(sidewinding, "base", lambda b: np.add(b[:, 2], 0.5, out=b[:, 2]))
    assert "grips" in failed(floating)


def test_a_body_that_does_not_climb_is_refused(climbing):
    data = claim_of(climbing, "grips").data
    assert value(climbing, "grips").value < 0.05
    assert "grips" in failed(with_claim(climbing, "grips", pole={**data["pole"], "radius": 0.02}))
    # rolling in one place, without the climb: the surface slips by the climbing speed
    still = np.array(climbing.base)
    still[:, 0] -= climbing.facts["climbing_speed"] * climbing.t
    slipping = value(climbing.replace(base=still), "grips")
    assert slipping.passed is False
    share = climbing.facts["climbing_speed"] / climbing.facts["surface_speed"]
    assert slipping.value == pytest.approx(abs(share), rel=0.05)


def test_periodic_with_a_turn(serpentine):
    data = claim_of(serpentine, "periodic").data
    turn = np.asarray(data["turn"])
    np.testing.assert_allclose(turn, [0, 0, 0.4 * 0.64], atol=1e-9)
    assert value(serpentine, "periodic").value < 1e-11
    # the number and the vector are one claim; the motion over a period is p -> R p + advance for every point
    assert value(with_claim(serpentine, "periodic", turn=float(turn[2])), "periodic").passed
    step = compose(serpentine.base[150], inverse(serpentine.base[50]))
    np.testing.assert_allclose(step[:3], data["advance"], atol=1e-10)
    np.testing.assert_allclose(rotations.quaternion_log(step[3:]), turn, atol=1e-10)
    assert "periodic" in failed(with_claim(serpentine, "periodic", turn=0.0))
    assert "periodic" in failed(with_claim(serpentine, "periodic", turn=[0.0, 0.4 * 0.64, 0.0]))
    moved = serpentine.base[110, :3] - serpentine.base[10, :3]
    assert value(with_claim(serpentine, "periodic", advance=moved), "periodic").passed is False  # true of one pair only


def test_what_cannot_be_tested_says_so():
    coarse = bp.plan(ACM, bp.Serpentine(WAVE, 0.16), bp.Plane(), np.linspace(0.0, 4.0, 6))
    line = value(coarse, "no_slip")
    assert line.passed is None and "too few samples" in line.detail
    two = bp.plan(ACM, bp.Rolling(1.0, 2.0), bp.Plane(), np.array([0.0, 0.1]))
    assert value(two, "grips").passed is None


def test_many_places_are_thinned_out_and_said_so():
    robot = bp.snake(120, 0.01, "arc", axes="yaw", radius=0.001)
    motion = bp.plan(robot, bp.Serpentine({**WAVE, "alpha": 0.5}, 0.16), bp.Plane(), np.linspace(0.0, 4.0, 2001))
    line = claims.follows(motion, motion.poses().positions, claim_of(motion, "follows"))
    assert line.passed and line.detail.startswith("1001 samples")
