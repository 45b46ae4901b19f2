"""Carrying a body: the paper's missions and the notes' facts, reach, planned heights, references, statuses, notes."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.carry import pose, reach
from bodyplan.job import plan_mission
from bodyplan.missions import load_mission

ROBOT = bp.tri_wheel()
HILLS = bp.Surface("sin(0.5*(x+y))/15")
CIRCLE = bp.Carry(("sin(t)", "cos(t)"), height=0.15)


@pytest.fixture(scope="module")
def mission_1() -> bp.Motion:
    return bp.plan(ROBOT, CIRCLE, HILLS, bp.times(0, 5, dt=0.01))


# --- facts of the notes -------------------------------------------------------------------------------------


def test_angles_and_torques_of_mission_1(mission_1: bp.Motion) -> None:
    """Absolute height, half lengths, right normal: q from 84.5 to 149.8 degrees, (35) from 2.86 to 4.10 N m."""
    facts = mission_1.facts
    assert np.degrees(facts["smallest_adjust_angle"]) == pytest.approx(84.5, abs=0.05)
    assert np.degrees(facts["largest_adjust_angle"]) == pytest.approx(149.8, abs=0.05)
    assert facts["smallest_paper_torque"] == pytest.approx(2.86, abs=0.005)
    assert facts["largest_paper_torque"] == pytest.approx(4.10, abs=0.005)
    q = mission_1.q[:, [mission_1.joints.index(f"{name}.adjust") for name in ("fl", "fr", "r")]]
    assert np.degrees(q.min()) == pytest.approx(84.489, abs=1e-3)
    assert np.degrees(q.max()) == pytest.approx(149.808, abs=1e-3)
    assert mission_1.ok and mission_1.residual.max() < 1e-12 and bp.check(mission_1).ok


def test_turning_scrubs(mission_1: bp.Motion) -> None:
    """Three parallel axles slip sideways at about 0.6 m/s per 1 m/s on the circle of mission 1, and the plan says
    so."""
    assert mission_1.facts["peak_slip_share"] == pytest.approx(0.6, abs=0.01)
    assert any("cannot turn" in note.lower() and "0.607 m/s" in note for note in mission_1.notes)
    straight = bp.plan(ROBOT, bp.Carry("line"), HILLS, bp.times(0, 1, dt=0.02))
    assert straight.facts["peak_slip_speed"] < 0.01 and not any("Cannot turn" in note for note in straight.notes)


def headings_out_of_reach(slope: float) -> float:
    """The share of headings for which no height keeps a level body in reach."""
    psi = np.linspace(-np.pi, np.pi, 3601)[:-1]
    return float(1.0 - reach(ROBOT, bp.Plane(slope=(slope, 0.0)), (0.0, 0.0), heading=psi).possible.mean())


def test_headings_in_reach_on_a_slope() -> None:
    """At slope 0.2 a level body is out of reach for 23 % of headings; the limit for all headings is 0.1966."""
    assert headings_out_of_reach(0.2) == pytest.approx(0.23, abs=0.005)
    assert headings_out_of_reach(0.1965) == 0.0 and headings_out_of_reach(0.1967) > 0.0


def test_mission_2_is_not_the_papers() -> None:
    """Its printed angles are 55, 160 and 115 degrees; slope x width = 0.24 m makes others, 0.185 m would make them."""
    motion = plan_mission(load_mission("carry-ramp"))
    ours = [np.degrees(motion.facts[f"{name}_largest_angle"]) for name in ("fl", "fr", "r")]
    gap = 0.3 * np.cos(np.radians(30))
    rise = np.array([0.27, 0.03, 0.15])
    np.testing.assert_allclose(ours, np.degrees(2 * np.arccos((rise - 0.02) / gap)), rtol=1e-9)
    printed = 0.02 + gap * np.cos(np.radians([55.0, 160.0]) / 2)
    assert printed[0] - printed[1] == pytest.approx(0.185, abs=0.001)


def test_a_body_at_a_constant_height_over_the_paraboloid() -> None:
    """z = x^2/2r along the centre line: the rear wheel's radius has a closed form where it is straight above the
    vertex."""
    motion = bp.plan(ROBOT, bp.Carry(("0.6+0*t", "0.1*t"), heading=0.0), bp.Surface("0.05*x**2"), np.array([0.0, 0.5]))
    assert motion.ok
    r = motion.robot.joint_index("r.adjust")
    radius = 0.3 * np.cos(np.radians(30)) * np.cos(motion.q[:, r] / 2) + 0.02
    np.testing.assert_allclose(radius, 0.15, rtol=1e-12)


# --- reach and planned heights ------------------------------------------------------------------------------


def test_every_wheel_just_reaches_at_the_ends_of_its_heights() -> None:
    ground = bp.Surface("0.05*sin(4*x)*cos(3*y)")
    place, roll, pitch, psi = (0.3, -0.2), 0.05, -0.03, 0.8
    for mode in ("absolute", "vertical", "normal"):
        heights = reach(ROBOT, ground, place, mode, roll, pitch, psi)
        for name in ("fl", "fr", "r"):
            for ends, radius in ((heights.low, 0.02), (heights.high, 0.3 * np.cos(np.radians(30)) + 0.02)):
                at = pose(ROBOT, ground, place, float(ends[name]), mode, roll, pitch, psi)
                assert at[name].radius == pytest.approx(radius, abs=1e-10)
        assert heights.possible and pose(ROBOT, ground, place, float(heights.best), mode, roll, pitch, psi).ok


def test_reach_on_level_ground_and_off_the_map() -> None:
    level = reach(ROBOT, bp.Plane(0.1), np.zeros((4, 2)), "vertical")
    np.testing.assert_allclose(level.lowest, 0.02, atol=1e-12)
    np.testing.assert_allclose(level.highest, 0.3 * np.cos(np.radians(30)) + 0.02, atol=1e-12)
    assert level.low["r"].shape == (4,)
    with pytest.raises(bp.InputError, match="height_mode"):
        reach(ROBOT, bp.Plane(), (0, 0), "up")
    with pytest.raises(bp.InputError, match="position"):
        reach(ROBOT, bp.Plane(), (0, 0, 0))


def test_a_planned_height_is_smooth_and_in_the_middle_of_what_is_in_reach() -> None:
    ground = bp.Surface("0.08*sin(2*x)*cos(1.5*y)")
    gait = bp.Carry([(0, 0), (1.0, 0.2), (2.0, -0.2), (3.0, 0.1)], height="auto", speed=0.5)
    t = bp.times(0, 6, dt=0.02)
    motion = bp.plan(ROBOT, gait, ground, t)
    assert motion.ok and bp.check(motion).ok
    # no constant height has as large a margin
    course = motion.base[:, :2]
    ends = reach(
        ROBOT, ground, course, heading=np.array([np.arctan2(*np.flip(v)) for v in np.gradient(course, axis=0)])
    )
    z = motion.base[:, 2]
    margin = np.minimum(z - ends.lowest, ends.highest - z).min()
    constant = 0.5 * (ends.highest.min() - ends.lowest.max())
    assert margin > constant and margin > 0.02
    assert np.abs(np.diff(z, 2)).max() / 0.02**2 < 1.0  # m/s^2
    level = bp.plan(ROBOT, gait, bp.Plane(), t)
    assert np.ptp(level.base[:, 2]) < 1e-6


def test_a_planned_height_clears_the_hull() -> None:
    mound = load_mission("carry-bump")
    raised = plan_mission(mound)
    assert raised.ok and raised.facts["hull_clearance"] > 0.03
    flat = plan_mission(load_mission("carry-bump", ["gait.height=0.15"]))
    assert "below_floor" in flat.status and any("the hull touches the ground" in note for note in flat.notes)
    assert not bp.check(flat).ok


def test_what_cannot_be_reached_at_any_height_is_said() -> None:
    steep = bp.Plane(slope=(0.23, 0.0))
    motion = bp.plan(ROBOT, bp.Carry("line", height="auto"), steep, bp.times(0, 1, dt=0.02))
    assert (motion.status == "out_of_reach").all() and "needs a radius" in motion.notes[0]


# --- what is asked for --------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["absolute", "vertical", "normal"])
def test_height_modes_and_references(mode: str) -> None:
    gait = bp.Carry(
        {"kind": "circle", "radius": 1.0}, height=0.16, height_mode=mode, roll=0.03, pitch=-0.02, reference="front_axle"
    )
    t = bp.times(0, 1, dt=0.1)
    motion = bp.plan(ROBOT, gait, HILLS, t)
    poses = motion.poses()
    # eq. (6): over the ground point p the base is p + h n
    foot = motion.base[:, :3]
    if mode == "absolute":
        np.testing.assert_allclose(foot[:, 2], 0.16, atol=1e-15)
    elif mode == "vertical":
        np.testing.assert_allclose(HILLS.gap(foot), 0.16, atol=1e-14)
    else:
        for _ in range(60):  # the ground point by fixed point
            below = motion.base[:, :2] - 0.16 * HILLS.normal(foot)[:, :2]
            foot = np.concatenate([below, np.zeros((len(t), 1))], axis=1)
        np.testing.assert_allclose(HILLS.height(foot) + 0.16 * HILLS.normal(foot)[:, 2], motion.base[:, 2], atol=1e-12)
    front = 0.5 * (poses["fl.axle"][:, :2] + poses["fr.axle"][:, :2])
    base = foot[:, :2] - motion.base[:, :2]
    np.testing.assert_allclose(np.linalg.norm(front + base, axis=1), 1.0, atol=1e-12)
    ahead = poses.rotations[:, 0, :2, 0]
    along = np.stack([-(front + base)[:, 1], (front + base)[:, 0]], axis=1)
    np.testing.assert_allclose(ahead[:, 0] * along[:, 1] - ahead[:, 1] * along[:, 0], 0.0, atol=1e-12)
    up = [np.sin(-0.02) * np.cos(0.03), -np.sin(0.03), np.cos(-0.02) * np.cos(0.03)]  # Ry Rx z
    np.testing.assert_allclose(poses.rotations[:, 0, :, 2], np.tile(up, (len(t), 1)), atol=1e-14)


def test_hubs_turn_as_far_as_they_roll() -> None:
    """Straight over ripples: the way along the ground of a wheel is the integral of spin times radius."""
    ground, t = bp.Surface("0.03*sin(4*x)"), np.linspace(0.0, 4.0, 161)
    motion = bp.plan(ROBOT, bp.Carry("line", speed=0.3, ramp=1.0), ground, t)
    fine = bp.plan(ROBOT, bp.Carry("line", speed=0.3, ramp=1.0), ground, np.linspace(0.0, 4.0, 16001))
    for name in ("fl", "fr", "r"):
        k = motion.robot.joint_index(f"{name}.spin")
        rate = fine.qd[:, k]
        turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine.t))])
        np.testing.assert_allclose(motion.q[:, k], turned[::100], atol=1e-6)
        np.testing.assert_allclose(motion.q[:, k], fine.q[::100, k], atol=1e-9)
    late = bp.plan(ROBOT, bp.Carry("line", speed=0.3, ramp=1.0), ground, np.array([3.0, 4.0]))
    np.testing.assert_allclose(late.q[-1], motion.q[-1], atol=1e-9)  # also from the beginning that was not asked for


def test_whirling_hubs_turn_at_a_constant_speed() -> None:
    motion = plan_mission(load_mission("whirl"))
    spins = motion.qd[:, [motion.robot.joint_index(f"{name}.spin") for name in ("fl", "fr", "r")]]
    np.testing.assert_allclose(spins, 2.0, atol=1e-12)
    radii = motion.facts["largest_radius"], motion.facts["smallest_radius"]
    assert radii[0] > 5 * radii[1]
    # the front wheels slip by millimetres a second, where the bank changes; the rear one has another axle
    P, Q = motion.robot.velocity_model(motion.q[100])
    assert motion.facts["peak_slip_speed"] > 0.3 and P.shape == (36, 6) and Q.shape == (36, 9)


def test_four_and_six_wheels_and_fixed_ones() -> None:
    four = bp.rover({"fl": (0.3, 0.25), "fr": (0.3, -0.25), "rl": (-0.3, 0.25), "rr": (-0.3, -0.25)}, link=0.2)
    six = bp.rover({f"{s}{i}": (0.4 - 0.4 * i, 0.25 * y, 0.02) for s, y in (("l", 1), ("r", -1)) for i in range(3)})
    for robot in (four, six):
        motion = bp.plan(robot, bp.Carry("line", height=0.13), bp.Surface("0.02*sin(5*x+2*y)"), bp.times(0, 2, dt=0.02))
        assert motion.ok and bp.check(motion).ok
    cart = bp.rover({"a": (0.2, 0.2), "b": (0.2, -0.2), "c": (-0.2, 0.0)}, radius=0.1)
    rolling = bp.plan(
        cart, bp.Carry("line", height=0.1, height_mode="vertical", speed=0.2), bp.Plane(0.3), bp.times(0, 1, dt=0.01)
    )
    assert rolling.ok and bp.check(rolling).ok
    np.testing.assert_allclose(rolling.q[-1, cart.joint_index("a.spin")], 0.2 / 0.1, atol=1e-12)
    hanging = bp.plan(cart, bp.Carry("line", height=0.11), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert (hanging.status == "no_contact").all() and "hangs 10 mm" in hanging.notes[0]


# --- statuses -----------------------------------------------------------------------------------------------


def first_note(gait: bp.Carry, ground: object = None, robot: bp.Robot = ROBOT, stop: float = 2.0) -> tuple[str, str]:
    motion = bp.plan(robot, gait, HILLS if ground is None else ground, bp.times(0, stop, dt=0.05))
    bad = motion.status[motion.status != "ok"]
    with pytest.raises(bp.SolveError):
        motion.raise_if_failed()
    assert not bp.check(motion).ok
    return str(bad[0]), motion.notes[0]


def test_statuses_name_the_wheel_and_the_time() -> None:
    assert first_note(bp.Carry("line", height="0.15+0.1*t"), bp.Plane()) == (
        "out_of_reach",
        "At 1.3 s wheel 'fl' needs a radius of 0.28 m; 0.02 to 0.2798 m are in its reach "
        "(out_of_reach, 15 of 41 samples).",
    )
    status, note = first_note(bp.Carry("line", height="0.15-0.1*t"), bp.Plane())
    assert status == "out_of_reach" and "At 1.35 s wheel 'fl' needs a radius of 0.015 m" in note
    status, note = first_note(bp.Carry(("cos(t-1)", "0*t")), bp.Plane())
    assert status == "stands_still" and "At 1 s the path stands still" in note
    status, note = first_note(bp.Carry([(0, 0), (0.1, 0), (0.2, 0.01)], speed=0.2), bp.Plane())
    assert status == "curve_ended" and "end" in note
    field = bp.HeightMap(np.zeros((9, 9)), 0.25)
    status, note = first_note(bp.Carry({"kind": "line", "start": (0.8, 1.0)}, speed=0.5), field)
    assert status == "no_contact" and "wheel 'fl' touches beyond the edge of the ground" in note
    slow = bp.tri_wheel(rate=0.05)
    status, note = first_note(bp.Carry("line", height="0.15+0.05*sin(3*t)"), bp.Plane(), slow)
    assert status == "limit" and "fl.adjust is faster" in note
    top = bp.Carry(("0.1*t", "0*t"), height=f"{ROBOT.contacts[0].radius!r}-0.05*abs(t-1)")
    status, note = first_note(top, bp.Plane())
    assert status == "limit" and "largest radius" in note


def test_a_contact_that_jumps_is_said() -> None:
    """The parabola x^2/2r bends like a rim of radius r at its bottom."""
    valley = bp.Surface("(x-0.6)**2/(2*0.2)")
    gait = bp.Carry(("0.1*(t-1)", "0*t"), height=0.2, heading=0.0)
    motion = bp.plan(
        bp.rover({"a": (0.6, 0.0), "b": (0.6, 0.3)}, thickness=0.0), gait, valley, np.array([0.5, 1.0, 1.5])
    )
    assert motion.status.tolist() == ["ok", "jumps", "ok"]
    assert "At 1 s the contact of wheel 'a' jumps" in motion.notes[0]
    over = bp.plan(
        motion.robot, bp.Carry(("0.1*(t-1)", "0*t"), height=0.25, heading=0.0), valley, np.linspace(0.5, 1.5, 100)
    )
    assert over.ok and any("leaps 1 times" in note for note in over.notes)


def test_plans_refuse_what_is_no_robot_or_ground_for_them() -> None:
    t = bp.times(0, 1, dt=0.1)
    with pytest.raises(bp.InputError, match="no wheels"):
        bp.plan(bp.snake(3, 0.1), bp.Carry("line"), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="corridor"):
        bp.plan(ROBOT, bp.Carry("line"), bp.Corridor(2.0), t)
    with pytest.raises(bp.InputError, match="t = 0"):
        bp.plan(ROBOT, bp.Carry("line"), bp.Plane(), t - 0.5)


def test_motions_are_saved_and_loaded(mission_1: bp.Motion, tmp_path) -> None:  # type: ignore[no-untyped-def]
    path = mission_1.save(tmp_path / "m.npz")
    assert bp.Motion.load(path) == mission_1
