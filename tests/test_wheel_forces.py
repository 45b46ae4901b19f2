"""Forces and torques of carried bodies: balance, virtual work, power, what slips and tips over; maps; the judge."""

import sys
from dataclasses import replace

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.carry import forces, maps, pose, pose_of, reach, wheel_rates
from bodyplan.robot.masses import center_of_mass
from bodyplan.spatial import matrix_from_quaternion

ROBOT = bp.tri_wheel()
HILLS = bp.Surface("sin(0.5*(x+y))/15")
RIPPLES = bp.Surface("0.05*sin(3*x)*cos(2*y)")
WEIGHT = 98.1
COS_30 = np.sqrt(0.75)
NAMES = ("fl", "fr", "r")


def mission_1(step: float = 0.01) -> bp.Motion:
    return bp.plan(ROBOT, bp.Carry(("sin(t)", "cos(t)"), height=0.15), HILLS, bp.times(0, 5, dt=step))


# --- what the paper and the notes say --------------------------------------------------------------------------


def test_level_ground_and_the_paper_s_estimate() -> None:
    """Loads mg/4, mg/4, mg/2; the rear torque is 1.5 times (35), the front ones 0.75 times, by either objective."""
    at = pose(ROBOT, bp.Plane(), (0.3, 0.1), 0.15, heading=0.4)
    for objective in ("min_norm", "min_ratio"):
        found = forces(at, objective=objective)
        np.testing.assert_allclose([found[name].load for name in NAMES], [WEIGHT / 4, WEIGHT / 4, WEIGHT / 2])
        np.testing.assert_allclose(
            [found[name].adjust / found[name].paper for name in NAMES], [0.75, 0.75, 1.5], rtol=1e-9
        )
        paper = -0.5 * WEIGHT / 3 * 0.3 * COS_30 * np.sin(at["r"].q / 2)
        assert found["r"].paper == pytest.approx(paper, rel=1e-12) and paper < 0.0
        assert found.required == pytest.approx(0.0, abs=1e-9) and found.status == "ok"
        np.testing.assert_allclose([found[name].hub for name in NAMES], 0.0, atol=1e-9)


def test_torques_of_mission_1() -> None:
    """By (34) with minimum-norm forces: front 2.15 to 3.07 N m, rear 4.64 to 6.03."""
    motion = mission_1()
    facts = motion.facts
    front = (
        min(facts[f"{n}_smallest_torque"] for n in ("fl", "fr")),
        max(facts[f"{n}_largest_torque"] for n in ("fl", "fr")),
    )
    np.testing.assert_allclose(front, (2.15, 3.07), atol=0.005)
    np.testing.assert_allclose((facts["r_smallest_torque"], facts["r_largest_torque"]), (4.64, 6.03), atol=0.005)
    assert facts["required_friction"] < facts["friction_used"] < facts["friction"] == 1.0
    assert motion.forces is not None and motion.torques is not None
    np.testing.assert_allclose(motion.forces.sum(axis=1), np.tile([0.0, 0.0, WEIGHT], (501, 1)), atol=1e-9)
    few = pose_of(ROBOT, HILLS, motion.base[::25])
    found = forces(few)
    for name in NAMES:
        column = ROBOT.joint_index(f"{name}.adjust")
        np.testing.assert_allclose(motion.torques[::25, column], found[name].adjust, rtol=1e-9)
        assert np.all(found[name].lowest <= found[name].adjust + 1e-7)
        assert np.all(found[name].adjust <= found[name].highest + 1e-7)
    np.testing.assert_allclose(motion.torques[::25], found.joints, atol=1e-9)
    # the least friction of the whole way, looked for at some samples only, is that of all near its largest value
    most = 25 * int(found.required.argmax())
    near = forces(pose_of(ROBOT, HILLS, motion.base[most - 25 : most + 26]), interval=False)
    assert facts["required_friction"] == pytest.approx(near.required.max(), rel=1e-4)


@pytest.mark.parametrize("heading", [0.0, 0.7, -2.0])
def test_on_a_plane_the_friction_needed_is_the_slope(heading: float) -> None:
    slope = np.array([0.11, -0.07])
    size = float(np.hypot(*slope))
    ground = bp.Plane(slope=slope)
    at = pose(ROBOT, ground, (0.0, 0.0), 0.16, "vertical", heading=heading).raise_if_failed()
    assert forces(at, interval=False).required == pytest.approx(size, rel=1e-9)
    below, above = (forces(at, mu=size * share, interval=False) for share in (0.99, 1.01))
    assert below.status == "slips" and above.status == "ok"
    assert "need a friction of 0.1304, and have 0.1291" in below.reason()
    with pytest.raises(bp.SolveError, match="slips"):
        below.raise_if_failed()
    assert np.isnan(below["r"].force).all() and np.isnan(below.joints).all()
    # all contacts at the limit, the same way: uphill
    ratio = forces(at, objective="min_ratio", interval=False)
    np.testing.assert_allclose([ratio[name].ratio for name in NAMES], size, rtol=1e-6)


# --- virtual work ----------------------------------------------------------------------------------------------


def cases(count: int = 40) -> tuple[bp.Robot, object]:
    robot = bp.tri_wheel(com=(0.05, -0.03, 0.1), wheel_mass=0.3)
    rng = np.random.default_rng(3)
    tilt = rng.uniform(-0.05, 0.05, (2, count))
    return robot, pose(
        robot,
        RIPPLES,
        rng.uniform(-1, 1, (count, 2)),
        0.15,
        roll=tilt[0],
        pitch=tilt[1],
        heading=rng.uniform(-np.pi, np.pi, count),
    ).raise_if_failed()


@pytest.mark.parametrize("objective", ["min_norm", "min_ratio"])
def test_power_balance(objective: str) -> None:
    """m g z' of the centre of mass = sum(tau q' + hub torque x spin + F . slip), for any motion of the body."""
    robot, at = cases(12)
    found = forces(at, objective=objective, interval=False).raise_if_failed()
    twist = np.random.default_rng(4).normal(size=(12, 6))
    rates = wheel_rates(at, twist)
    R = matrix_from_quaternion(at.base[:, 3:])
    v, w = (np.einsum("nij,nj->ni", R, part) for part in (twist[:, :3], twist[:, 3:]))
    com = center_of_mass(robot, at.joints, at.base)
    lifted = WEIGHT * (v + np.cross(w, com - at.base[:, :3]))[:, 2]
    given, size = np.zeros(12), np.zeros(12)
    for one, rate, contact in zip(found, rates, at, strict=True):
        t = np.cross(R @ contact.wheel.axle, contact.point - (at.base[:, :3] + R @ contact.wheel.centre))
        left = np.cross(contact.normal, -t)
        left /= np.linalg.norm(left, axis=1)[:, None]
        for part in (one.adjust * rate.q, one.hub * rate.spin, np.sum(one.force * left, axis=1) * rate.slip):
            given, size = given + part, size + np.abs(part)
    assert np.max(np.abs(given - lifted) / size) < 2e-13 * (1 if objective == "min_norm" else 50)
    np.testing.assert_allclose(
        np.sum(found.joints * rates.joints, axis=1),
        sum(one.adjust * rate.q + one.hub * rate.spin for one, rate in zip(found, rates, strict=True)),
        atol=1e-9,
    )


def test_torques_are_those_of_the_model_s_jacobian() -> None:
    """-dp/dq . F for the rim's material, by central differences of forward kinematics; and eq. (34) as printed."""
    robot, at = cases(10)
    found = forces(at, interval=False)
    step = 1e-6
    for name in NAMES:
        one, contact = found[name], at[name]
        column = robot.joint_index(f"{name}.adjust")
        moved = []
        for sign in (-1.0, 1.0):
            q = at.joints.copy()
            q[:, column] += sign * step
            moved.append(robot.forward(q, at.base)[name + ".contact"][:, :3])
        slope = (moved[1] - moved[0]) / (2 * step)
        np.testing.assert_allclose(one.adjust, -np.sum(slope * one.force, axis=1), rtol=1e-7)
        axle = robot.forward(at.joints, at.base)[f"{name}.axle"]
        u = (contact.point - axle[:, :3]) / contact.radius[:, None]
        printed = 0.5 * 0.3 * np.sin(contact.q / 2) * COS_30 * np.sum(one.force * u, axis=1)
        np.testing.assert_allclose(one.adjust, printed, rtol=1e-12)
        # the ground turns the wheel about its axle against its motor
        moment = np.sum(
            np.cross(contact.radius[:, None] * u, one.force) * matrix_from_quaternion(axle[:, 3:])[:, :, 2], 1
        )
        np.testing.assert_allclose(one.hub, -moment, atol=1e-10)


def test_forces_balance_the_weight_within_their_cones() -> None:
    robot, at = cases()
    for objective in ("min_norm", "min_ratio"):
        found = forces(at, mu=0.6, objective=objective, interval=False).raise_if_failed()
        points, given = (
            np.stack([getattr(one, what) for one in of], axis=1) for of, what in ((at, "point"), (found, "force"))
        )
        com = center_of_mass(robot, at.joints, at.base)
        np.testing.assert_allclose(given.sum(axis=1), np.tile([0, 0, WEIGHT], (len(com), 1)), atol=1e-7)
        np.testing.assert_allclose(np.cross(points - com[:, None], given).sum(axis=1), 0.0, atol=1e-7)
        for one in found:
            assert np.all(one.load > 0.0) and np.all(one.ratio <= 0.6 + 1e-9)
    assert np.all(np.max([one.ratio for one in found], axis=0) == pytest.approx(found.required, rel=1e-5))


# --- friction, wheels, refusals --------------------------------------------------------------------------------


def test_friction_comes_from_the_ground_or_the_rims_or_the_caller() -> None:
    place = ((0.0, 0.0), 0.15)
    assert forces(pose(ROBOT, bp.Plane(friction=0.3), *place), interval=False).friction.tolist() == [0.3] * 3
    slippery = bp.tri_wheel(friction={"r": 0.1})
    assert forces(pose(slippery, bp.Plane(), *place), interval=False).friction.tolist() == [1.0, 1.0, 0.1]
    bare = bp.tri_wheel(friction=None)
    at = pose(bare, bp.Plane(), *place)
    assert forces(at, interval=False).friction.tolist() == [0.5] * 3
    assert forces(at, mu={"fl": 0.2}, interval=False).friction.tolist() == [0.2, 0.5, 0.5]
    assert forces(at, mu=[0.1, 0.2, 0.3], interval=False).friction.tolist() == [0.1, 0.2, 0.3]
    for mu, text in ((-1, "mu"), ([0.1, 0.2], "mu"), ({"x": 1}, "wheel"), ({"r": -1}, "mu")):
        with pytest.raises(bp.InputError, match=text):
            forces(at, mu=mu)
    with pytest.raises(bp.UnknownNameError, match="min_norm"):
        forces(at, objective="least")
    with pytest.raises(bp.InputError, match="three wheels"):
        forces(pose(bp.rover({"a": (0.0, 0.3), "b": (0.0, -0.3)}, thickness=0.0), bp.Plane(), *place))
    with pytest.raises(bp.UnknownNameError, match="'rr'"):
        forces(at)["rr"]


def test_a_wheel_that_gives_way_leaves_the_slope_to_the_others() -> None:
    """Across a slope a rear wheel without friction carries its load along the normal only."""
    at = pose(bp.tri_wheel(friction={"r": 0.0}), bp.Plane(slope=(0.1, 0.0)), (0.0, 0.0), 0.15, "vertical")
    found = forces(at, interval=False)
    assert found.status == "ok" and found["r"].ratio == pytest.approx(0.0, abs=1e-9)
    assert found["fl"].ratio > 0.1


def test_poses_that_are_not_reached_have_no_forces() -> None:
    at = pose(ROBOT, bp.Plane(), (0.0, 0.0), [0.15, 0.5])
    found = forces(at)
    assert found.status.tolist() == ["ok", "out_of_reach"] and np.isnan(found["fl"].force[1]).all()
    assert "needs a radius" in found.reason(1) and found.reason(0) == ""
    assert np.isfinite(found["fl"].lowest[0]) and np.isnan(found["fl"].lowest[1])


def test_fixed_wheels_have_no_adjusting_torque() -> None:
    cart = bp.rover({"a": (0.2, 0.2), "b": (0.2, -0.2), "c": (-0.2, 0.0)}, radius=0.1)
    found = forces(pose(cart, bp.Plane(), (0.0, 0.0), 0.1))
    assert all(one.adjust == 0.0 and one.paper == 0.0 and one.load > 0.0 for one in found)
    motion = bp.plan(cart, bp.Carry("line", height=0.1), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert motion.forces is not None and "largest_adjust_torque" not in motion.facts and bp.check(motion).ok


# --- plans -----------------------------------------------------------------------------------------------------


def test_plans_say_what_slips_and_what_tips_over() -> None:
    t = bp.times(0, 1, dt=0.1)
    slope = bp.Plane(slope=(0.0, 0.19), friction=0.15)
    motion = bp.plan(ROBOT, bp.Carry("line", height_mode="vertical"), slope, t)
    assert (motion.status == "slips").all() and "friction of 0.15, 0.19 would (slips, 11 of 11" in motion.notes[0]
    assert not bp.check(motion).ok and motion.forces is not None and not motion.forces.any()
    ahead = bp.plan(bp.tri_wheel(com=(0.7, 0.0, 0.0)), bp.Carry("line"), bp.Plane(), t)
    assert (ahead.status == "tips_over").all() and "At 0 s the body tips over" in ahead.notes[0]
    # over a steeper and steeper hill: only where it is too steep
    hill = bp.plan(
        ROBOT,
        bp.Carry("line", height="auto", speed=0.4),
        bp.Surface("0.03*x**2", friction=0.04),
        bp.times(0, 4, dt=0.1),
    )
    assert set(hill.status) == {"ok", "slips"} and hill.status[0] == "ok" and hill.status[-1] == "slips"
    assert np.flatnonzero(hill.forces.any(axis=(1, 2))).tolist() == np.flatnonzero(hill.status == "ok").tolist()
    (line,) = bp.check(hill).failures
    assert line.kind == "solved"


def test_two_wheels_hold_nothing_and_say_so() -> None:
    robot = bp.rover({"a": (0.6, 0.0), "b": (0.6, 0.3)}, thickness=0.0)
    motion = bp.plan(robot, bp.Carry("line"), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert motion.ok and motion.forces is None and any("2 wheels hold nothing up" in note for note in motion.notes)


def test_plans_do_without_clarabel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "clarabel", None)
    motion = mission_1(0.25)
    assert motion.ok and bp.check(motion).ok
    assert any("clarabel" in note and "bodyplan[solve]" in note for note in motion.notes)


def test_over_a_step_of_20_mm() -> None:
    """On the edge the normal points to the axle; the judge, who knows nothing of it, finds the same."""
    step = bp.Profile([(-9.0, 0.0), (1.0, 0.02)])
    motion = bp.plan(ROBOT, bp.Carry("line", height=0.15, speed=0.3), step, bp.times(0, 2, dt=0.02))
    assert motion.ok and bp.check(motion).ok
    assert any("stands on an edge" in note for note in motion.notes)
    # an edge seen under an angle a from below asks the front wheels for the friction that statics of the whole allow
    on_edge = pose_of(ROBOT, step, motion.base)["fl"].corner
    assert on_edge.any() and 0.2 < motion.facts["required_friction"] < 0.4
    slick = bp.plan(
        ROBOT, bp.Carry("line", height=0.15, speed=0.3), bp.Profile([(-9.0, 0.0), (1.0, 0.02)], friction=0.2), motion.t
    )
    assert set(slick.status[on_edge]) == {"ok", "slips"} and set(slick.status[~on_edge]) == {"ok"}


# --- the judge -------------------------------------------------------------------------------------------------


def failed(motion: bp.Motion) -> list[str]:
    return [line.kind for line in bp.check(motion).failures]


def test_the_judge_finds_forces_that_do_not_hold() -> None:
    motion = mission_1(0.05)
    assert failed(motion) == []
    assert motion.forces is not None and motion.torques is not None
    assert failed(motion.replace(forces=1.001 * motion.forces)) == ["holds", "bears"]
    shifted = motion.forces.copy()
    shifted[:, 0, 2] += 1.0
    shifted[:, 1, 2] -= 1.0
    assert failed(motion.replace(forces=shifted)) == ["holds", "bears"]
    torques = motion.torques.copy()
    torques[40, ROBOT.joint_index("r.adjust")] *= 1.001
    assert failed(motion.replace(torques=torques)) == ["bears"]
    (claim,) = (claim for claim in motion.claims if claim.kind == "grips_ground")
    slick = replace(claim, data={**claim.data, "friction": np.full(3, 0.05)})
    others = [c for c in motion.claims if c.kind != "grips_ground"]
    report = bp.check(motion.replace(claims=[*others, slick]))
    assert [line.kind for line in report.failures] == ["grips_ground"]
    assert report.failures[0].value == pytest.approx(motion.facts["friction_used"] / 0.05, rel=1e-3)
    squeezed = (
        motion.forces.copy()
    )  # a pair of forces along the line between two contacts: balanced, but out of the cone
    poses = motion.poses()
    along = poses["fr.contact"][:, :3] - poses["fl.contact"][:, :3]
    squeezed[:, 0] += 40.0 * along
    squeezed[:, 1] -= 40.0 * along
    assert failed(motion.replace(forces=squeezed)) == ["grips_ground", "bears"]
    pulled = -motion.forces
    assert "grips_ground" in failed(motion.replace(forces=pulled))
    assert failed(motion.replace(forces=None)) == ["holds", "grips_ground", "bears"]


def test_the_judge_holds_torques_against_motors() -> None:
    for effort, passes in ((7.0, True), (5.0, False)):
        motion = bp.plan(bp.tri_wheel(effort=effort), bp.Carry("line"), HILLS, bp.times(0, 1, dt=0.1))
        line = bp.check(motion)["planned torques"]
        assert line.passed is passes and line.value == pytest.approx(motion.facts["largest_adjust_torque"] / effort)
        assert any("would have to hold" in note for note in motion.notes) is not passes


# --- maps ------------------------------------------------------------------------------------------------------


def test_maps_over_heading_and_height() -> None:
    ground = bp.Plane(slope=(0.15, 0.05))
    made = maps(ROBOT, ground, (0.2, 0.1), headings=9, heights=7)
    assert made.status.shape == (7, 9) and made.headings[0] == -np.pi and made.headings[-1] == np.pi
    ok = made.status == "ok"
    assert ok.any() and not ok.all() and np.array_equal(ok, made.reached)
    np.testing.assert_allclose(made.required[ok], np.hypot(0.15, 0.05), rtol=1e-8)
    inside = (made.heights[:, None] >= made.reach.lowest) & (made.heights[:, None] <= made.reach.highest)
    assert np.array_equal(inside & (made.status != "below_floor"), ok)
    ends = reach(ROBOT, ground, (0.2, 0.1), heading=made.headings)
    np.testing.assert_allclose(made.reach.highest, ends.highest)
    at = pose(ROBOT, ground, (0.2, 0.1), made.heights[:, None], heading=made.headings)
    points = np.stack([one.point[ok] for one in at], axis=1)
    np.testing.assert_allclose(made.margin[ok][0], 0.26, atol=0.03)
    assert np.isfinite(points).all()
    slick = maps(ROBOT, ground, (0.2, 0.1), headings=9, heights=7, mu=0.1)
    assert (slick.status[ok] == "slips").all()
    mixed = maps(ROBOT, ground, (0.2, 0.1), headings=9, heights=7, mu={"r": 0.0})
    assert set(mixed.status[ok]) <= {"ok", "slips"}


def test_maps_of_what_tips_over_and_refusals() -> None:
    tipping = maps(bp.tri_wheel(com=(0.7, 0.0, 0.0)), bp.Plane(), (0.0, 0.0), headings=[0.0], heights=[0.1, 0.15])
    assert (tipping.status == "tips_over").all() and np.isinf(tipping.required).all()
    np.testing.assert_allclose(tipping.margin, -0.1, atol=1e-12)
    with pytest.raises(bp.InputError, match="none is in reach"):
        maps(ROBOT, bp.Plane(slope=(0.23, 0.0)), (0.0, 0.0), headings=[0.0])
    with pytest.raises(bp.InputError, match="ascending"):
        maps(ROBOT, bp.Plane(), (0.0, 0.0), headings=[1.0, 0.0])
    with pytest.raises(bp.InputError, match="heights"):
        maps(ROBOT, bp.Plane(), (0.0, 0.0), heights=1)


def test_the_judge_allows_a_wheel_without_friction() -> None:
    motion = bp.plan(bp.tri_wheel(friction={"r": 0.0}), bp.Carry("line"), HILLS, bp.times(0, 1, dt=0.1))
    assert motion.ok and failed(motion) == []
