"""Runs against mechanics that can be written down: inclines, lifts, scales; and the books of a Trial."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from bodyplan.errors import InputError, SolveError
from bodyplan.ground import Corridor, Plane, Surface
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion, times
from bodyplan.robot.elements import Body, Contact, Joint, Row
from bodyplan.robot.library import snake
from bodyplan.robot.model import Robot
from bodyplan.simulate import Friction, Trial, simulate
from bodyplan.simulate.loop import Timing
from bodyplan.simulate.measure import Records, progress_of, slips_of, turned_of
from bodyplan.simulate.reference import Reference, region
from bodyplan.spatial.rotations import multiply, quaternion_exp

G = 9.81


def motion_of(
    robot: Robot,
    ground: Ground,
    q: Any,
    t: Any,
    base: Any = None,
    claims: Sequence[Claim] = (),
    qd: Any = None,
) -> Motion:
    t, q = np.asarray(t, dtype=np.float64), np.asarray(q, dtype=np.float64).reshape(len(t), robot.n)
    pose = np.broadcast_to([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0] if base is None else base, (len(t), 7))
    qd = np.gradient(q, t, axis=0) if qd is None else np.reshape(qd, q.shape)
    return Motion(
        robot,
        ground,
        {},
        t,
        pose,
        q,
        qd,
        np.zeros_like(q),
        np.zeros(len(t)),
        np.full(len(t), "ok"),
        tuple(claims),
    )


def still(robot: Robot, ground: Ground, seconds: float, base: Any = None) -> Motion:
    return motion_of(robot, ground, np.zeros((2, robot.n)), [0.0, seconds], base)


def block(shape: str = "box") -> Robot:
    """One rigid body without joints."""
    if shape == "box":
        contact = Contact("block", "base", "box", half=(0.1, 0.1, 0.03))
    else:
        contact = Contact("block", "base", "capsule", 0.02, start=(-0.1, 0.0, 0.0), end=(0.1, 0.0, 0.0))
    return Robot.from_rows({"mark": [Row(a=0.1)]}, base_body=Body(mass=0.7), contacts=[contact])


def downhill(angle: float, heading: float) -> tuple[Plane, list[float]]:
    """A plane that falls towards +x, and a pose flat on it that points ``heading`` away from downhill."""
    turn = multiply(quaternion_exp([0.0, angle, 0.0]), quaternion_exp([0.0, 0.0, heading]))
    return Plane(slope=(-np.tan(angle), 0.0)), [0.0, 0.0, 0.1, *turn]


def slid(trial: Trial) -> float:
    return float(np.linalg.norm(trial.com[-1] - trial.com[0]))


def test_a_block_on_an_incline_slides_or_holds_by_its_friction() -> None:
    plane, pose = downhill(0.3, 0.4)
    run = still(block(), plane, 0.8, pose)
    held = simulate(run, friction=1.15 * np.tan(0.3), settle=0.0, ramp=0.0)
    assert slid(held) < 0.002
    mu = 0.5 * np.tan(0.3)
    sliding = simulate(run, friction=mu, settle=0.0, ramp=0.0)
    expected = 0.5 * G * (np.sin(0.3) - mu * np.cos(0.3)) * sliding.t[-1] ** 2
    assert slid(sliding) == pytest.approx(expected, rel=0.02)
    assert sliding.advance_ratio is None and sliding.tracking_rms is not None
    assert json.loads(json.dumps(sliding.metrics()))["advance_ratio"] is None


@pytest.mark.parametrize(("heading", "mu"), [(0.0, 0.1), (np.pi, 0.45), (0.5 * np.pi, 0.2)])
def test_scales_slide_forward_hold_backward_and_slip_sideways(heading: float, mu: float) -> None:
    angle = 0.3
    plane, pose = downhill(angle, heading)
    scales = Friction(forward=0.1, backward=0.45, sideways=0.2)
    moved = slid(simulate(still(block("capsule"), plane, 0.8, pose), friction=scales, settle=0.0, ramp=0.0))
    if mu > np.tan(angle):
        assert moved < 0.002
    elif heading == 0.0:
        assert moved == pytest.approx(0.5 * G * (np.sin(angle) - mu * np.cos(angle)) * 0.64, rel=0.02)
    else:
        # a capsule across the slope may roll, which no friction resists: it is no slower than sliding
        assert moved > 0.98 * 0.5 * G * (np.sin(angle) - mu * np.cos(angle)) * 0.64


@pytest.mark.parametrize("heading", [0.0, 0.4, -1.1, 2.9])
def test_the_slip_angle_is_that_between_axis_and_velocity(heading: float) -> None:
    angle = 0.3
    plane, pose = downhill(angle, heading)
    # two capsules side by side cannot roll
    pair = [
        Contact(f"runner{i}", "base", "capsule", 0.01, start=(-0.1, y, 0.0), end=(0.1, y, 0.0))
        for i, y in enumerate((-0.05, 0.05))
    ]
    sled = Robot.from_rows({"mark": [Row(a=0.1)]}, base_body=Body(mass=0.7, com=(0.0, 0.0, 0.0)), contacts=pair)
    trial = simulate(still(sled, plane, 0.8, pose), friction=0.1, settle=0.0, ramp=0.0)
    # both seen from above: downhill (cos angle, 0), the axis (cos heading cos angle, sin heading)
    want = np.arctan2(abs(np.sin(heading)), abs(np.cos(heading) * np.cos(angle)))
    assert trial.slip_angle == pytest.approx(want, abs=2e-3)
    assert trial.metrics()["slip_angle_rad"] == trial.slip_angle
    assert trial.turned is not None and abs(trial.turned[0]) < 1e-3
    assert trial.forward_ratio is None  # no advance is planned


def test_shapes_without_an_axis_have_no_slip_angle() -> None:
    plane, pose = downhill(0.3, 0.0)
    trial = simulate(still(block(), plane, 0.2, pose), friction=0.1, settle=0.0, ramp=0.0)
    assert trial.slip_angle is None and trial.metrics()["slip_angle_rad"] is None


def test_lifted_capsules_do_not_count_for_the_slip_angle() -> None:
    runner = Contact("runner", "base", "capsule", 0.01, start=(-0.1, 0.0, 0.0), end=(0.1, 0.0, 0.0))
    wide = [Contact(f"side{i}", "base", "sphere", 0.01, start=(0.0, y, 0.0)) for i, y in enumerate((-0.05, 0.05))]
    mast = Contact("mast", "base", "capsule", 0.01, start=(0.0, -0.03, 0.05), end=(0.0, 0.03, 0.05))
    plane, pose = downhill(0.3, 0.0)
    sled = Robot.from_rows({"mark": [Row(a=0.1)]}, base_body=Body(mass=0.7), contacts=[runner, *wide, mast])
    trial = simulate(still(sled, plane, 0.5, pose), friction=0.1, settle=0.0, ramp=0.0)
    assert trial.slip_angle == pytest.approx(0.0, abs=2e-3)


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.5])
def test_a_base_that_is_turned_from_the_plan(turn: float) -> None:
    t = np.linspace(0.0, 2.0, 41)
    base = np.tile([0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0], (41, 1))
    base[:, 0] = 0.1 * t
    base[:, 3:] = [
        multiply(quaternion_exp([0.0, 0.0, 0.3 * np.sin(np.pi * x)]), quaternion_exp([0.5, 0.0, 0.0])) for x in t
    ]
    robot = block()
    plan = motion_of(robot, Plane(), np.zeros((41, 0)), t, base, [Claim("periodic", "p", {"period": 2.0})])
    reference = Reference.of(plan)
    times_ = np.linspace(1.0, 5.0, 201)
    executed = np.array([reference.base(x - 1.0) for x in times_])
    executed[:, 3:] = multiply(quaternion_exp([0.0, 0.0, turn]), executed[:, 3:])
    executed[::2, 3:] *= -1.0  # the same rotations
    none = np.zeros((201, 0))
    records = Records(times_, executed, none, none, executed[:, :3])
    got = turned_of(records, reference, lambda x: x - 1.0, 1.0, 2.0, 2)
    assert np.abs(got - turn).max() < 1e-12


def lift(height: float = 0.1, **joint: Any) -> Motion:
    """A box that raises a mass above it along a vertical slide, smoothly, from rest to rest."""
    row = Row(
        d=Joint("lift", offset=0.1, **joint),
        body=Body(mass=0.5, com=(0.0, 0.0, 0.0), inertia=(1e-3,) * 3 + (0,) * 3),
    )
    robot = Robot.from_rows(
        {"mast": [row]},
        base_body=Body(mass=1.0),
        contacts=[Contact("foot", "base", "box", half=(0.1, 0.1, 0.03))],
    )
    t = times(0.0, 1.0, 0.01)
    return motion_of(robot, Plane(), height * t**3 * (10.0 - 15.0 * t + 6.0 * t**2), t)


def test_work_is_the_change_of_energy() -> None:
    trial = simulate(lift(), servo=(2000.0, 40.0), settle=0.5, ramp=0.0)
    assert trial.ok and trial.positive_work is not None and trial.absolute_work is not None
    start = int(np.searchsorted(trial.t, trial.start_time))
    risen = 1.5 * (trial.com[-1, 2] - trial.com[start, 2])
    # at rest before and after: positive - negative work, with |.| the sum of both
    net = 2.0 * trial.positive_work - trial.absolute_work
    assert net == pytest.approx(G * risen, rel=0.01)
    assert trial.torque[start, 0] == pytest.approx(0.5 * G, rel=1e-3)
    assert trial.torque_peak is not None and trial.torque_peak[0] >= np.abs(trial.torque[start:]).max() - 1e-12


def test_a_servo_at_its_effort_is_a_warning() -> None:
    weak = simulate(lift(effort=2.0), servo=(2000.0, 40.0), settle=0.1, ramp=0.0)
    assert any("'lift' is at its effort 2" in text for text in weak.warnings)
    assert np.abs(weak.torque).max() <= 2.0
    strong = simulate(lift(effort=200.0), servo=(2000.0, 40.0), settle=0.1, ramp=0.0)
    assert strong.warnings == ()


def test_a_joint_pushed_against_its_limit_is_a_warning() -> None:
    trial = simulate(lift(limits=(-0.1, 0.05)), servo=(2000.0, 40.0), settle=0.1, ramp=0.0)
    assert any("'lift' is pushed against its limit" in text for text in trial.warnings)
    assert trial.q[:, 0].max() < 0.06


def test_time_in_the_air_is_that_of_free_fall() -> None:
    """A body that jumps off a sliding foot: in the air its centre of mass falls with g."""
    foot = [Row(epsilon=np.pi), Row(d=Joint("push", limits=(-0.5, 0.5)), body=Body(mass=0.2))]
    hopper = Robot.from_rows(
        {"leg": foot},
        base_body=Body(mass=1.0),
        contacts=[Contact("foot", "leg.2", "box", half=(0.2, 0.2, 0.02))],
    )
    t = np.linspace(0.0, 1.5, 301)
    motion = motion_of(hopper, Plane(), np.where(t < 0.5, 0.05, 0.15), t, [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0])
    trial = simulate(motion, servo=(3000.0, 60.0), settle=0.2, ramp=0.0, record_dt=1e-3)
    (warning,) = trial.warnings
    told = re.fullmatch(r"in the air for (\S+) % of the time, for up to (\S+) s at a stretch", warning)
    assert told
    fall = np.diff(trial.com[:, 2], 2) / 1e-6
    falling = np.abs(fall + G) < 0.01 * G
    ends = np.flatnonzero(np.diff(np.concatenate([[0], falling, [0]])))
    flights = np.diff(ends.reshape(-1, 2), axis=1)  # ms
    assert flights.max() > 100 and float(told[2]) == pytest.approx(1e-3 * flights.max(), abs=0.005)
    real = flights[flights >= 30]
    blurred = 100.0 * 6.0 * len(real) / len(trial.t)  # ms: stiff contacts let go before they part
    assert float(told[1]) == pytest.approx(100.0 * real.sum() / len(trial.t), abs=blurred)
    # bodies that lie or slide are not, however their stiff contacts chatter
    plane, pose = downhill(0.3, 0.4)
    for shape, mu in (("box", 0.1), ("box", 1.0), ("capsule", 0.1), ("capsule", 1.0)):
        assert simulate(still(block(shape), plane, 0.8, pose), friction=mu, ramp=0.0).warnings == ()


def test_divergence_is_a_status_and_nothing_is_nan() -> None:
    trial = simulate(lift(), servo=(1e9, 0.0), dt=0.01, settle=0.1, ramp=0.0)
    assert trial.status == "diverged" and not trial.ok and "velocity of joint" in trial.reason
    for name in ("t", "base", "q", "torque", "com"):
        assert np.isfinite(getattr(trial, name)).all()
    metrics = json.loads(json.dumps(trial.metrics(), allow_nan=False))
    assert metrics["speed_m_s"] is None and metrics["peak_force_N"] is None and metrics["advance_ratio"] is None
    with pytest.raises(SolveError, match="diverged"):
        trial.raise_if_failed()


def wriggle(squeeze: float | None = None, cycles: float = 1.2) -> Motion:
    """A short snake that folds and unfolds; planned to be carried 0.05 m a cycle, which it will not be."""
    robot = snake(6, 0.1, radius=0.02, mass=0.1)
    t = times(0.0, cycles, 0.01)
    fold = 0.6 + 0.3 * np.sin(2.0 * np.pi * t)[:, None]
    q = fold * np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    qd = 0.6 * np.pi * np.cos(2.0 * np.pi * t)[:, None] * np.sign(q)
    base = np.zeros((len(t), 7))
    base[:, 0], base[:, 2] = 0.05 * t, 0.02
    base[:, 3:] = quaternion_exp(np.array([0.0, 0.0, -0.5]) * fold)
    width = 0.1 * np.sin(0.3) + 0.04
    ground: Ground = Plane() if squeeze is None else Corridor(width - squeeze, friction=0.1, wall_friction=0.8)
    claims = [
        Claim("periodic", "cycle", {"period": 1.0, "advance": [0.05, 0.0, 0.0], "turn": 0.0}),
        Claim("at_rest", "tail", {"frames": ["base"], "start": 0.25, "end": 0.75, "stage": "fold"}),
    ]
    return motion_of(robot, ground, q, t, base, claims, qd)


def test_the_same_inputs_give_the_same_trial_bit_for_bit() -> None:
    one, two = (simulate(wriggle(), cycles=2, settle=0.2, ramp=0.5) for _ in range(2))
    assert one == two and one.t.flags.writeable is False
    other = simulate(wriggle(), cycles=2, settle=0.2, ramp=0.5, friction=0.3)
    assert one != other and other.settings["friction"] == 0.3 and one.settings["friction"] is None


def test_cycles_are_measured_in_phase_and_at_full_speed() -> None:
    heard: list[float] = []
    trial = simulate(wriggle(), cycles=3, settle=0.2, ramp=0.5, progress=heard.append, servo=(20.0, 0.1))
    assert trial.start_time == pytest.approx(0.7) and trial.period == 1.0 and trial.cycles == 3
    assert trial.t[-1] == pytest.approx(3.7) and heard[-1] == 1.0 and heard == sorted(heard)
    assert trial.advance is not None and trial.advance.shape == (3, 3)
    np.testing.assert_allclose(trial.planned_advance, [[0.05, 0.0, 0.0]] * 3, atol=1e-12)
    # the executed joints follow the plan in phase
    after = trial.t >= trial.start_time
    phase = trial.t[after] - trial.start_time
    planned = Reference.of(wriggle()).joints(phase)
    assert np.abs(trial.q[after] - planned).max() < 0.05
    assert len(trial.slips) == 3 and [slip.cycle for slip in trial.slips] == [0, 1, 2]
    stage = trial.slip_by_stage()["fold"]
    assert stage["along"] == pytest.approx(np.mean([slip.along for slip in trial.slips]))
    assert trial.metrics()["slip_m.fold"] == stage["along"]
    assert trial.advance_ratio == pytest.approx(np.mean(trial.advance[:, 0]) / 0.05)


def test_walls_that_the_plan_presses_into_stand_back_and_close() -> None:
    trial = simulate(wriggle(squeeze=0.006), cycles=1, settle=0.5, ramp=0.2, servo=(20.0, 0.4))
    assert trial.ok and 0.002 < trial.settings["walls_stood_back_m"] < 0.02
    # nothing is thrown out: the robot stays where it was set
    assert np.abs(trial.com[trial.t < 0.5] - trial.com[0]).max() < 0.01


def test_a_ball_comes_to_rest_in_the_valley_of_a_height_field() -> None:
    ball = Robot.from_rows(
        {"mark": [Row(a=0.1)]}, base_body=Body(mass=0.3), contacts=[Contact("ball", "base", "sphere", 0.05)]
    )
    ground = Surface("0.4*x*x + 0.3*y*y")
    trial = simulate(still(ball, ground, 0.5, [0.0, 0.0, 0.4, 1.0, 0.0, 0.0, 0.0]), settle=0.0, ramp=0.0)
    clearance = float(ground.clearance(trial.base[-1, :3])) - 0.05
    assert abs(clearance) < 2e-4
    assert slid(trial) < 2e-3


def test_two_axes_that_share_a_joint_stay_in_step() -> None:
    half = Joint("bend").share(0.5)
    body = Body(mass=0.3)
    rows = [Row(theta=half, a=0.1, name="f1", body=body), Row(theta=half, a=0.1, name="f2", body=body)]
    feet = [Contact(f, f, "sphere", 0.02) for f in ("base", "f1", "f2")]
    robot = Robot.from_rows({"c": rows}, contacts=feet, base_body=Body(mass=0.5))
    t = times(0.0, 1.0, 0.02)
    trial = simulate(motion_of(robot, Plane(), 0.6 * np.sin(3.0 * t), t), settle=0.1, ramp=0.0, servo=(20.0, 0.4))
    assert trial.ok and trial.warnings == () and trial.tracking_max is not None and trial.tracking_max[0] < 0.1


# --- the reference and the measures, without physics ---


def test_the_reference_goes_through_the_samples_and_repeats() -> None:
    motion = wriggle()
    reference = Reference.of(motion)
    inside = motion.t < 1.0
    np.testing.assert_allclose(reference.joints(motion.t[inside]), motion.q[inside], atol=1e-12)
    phases = np.linspace(0.0, 1.0, 37)
    np.testing.assert_allclose(reference.joints(phases + 4.0), reference.joints(phases), atol=1e-12)
    np.testing.assert_allclose(reference.joints(phases - 2.0), reference.joints(phases), atol=1e-12)
    # Hermite: fourth order between samples 0.01 s apart
    exact = (0.6 + 0.3 * np.sin(2.0 * np.pi * phases))[:, None] * np.array([1.0, -1.0, 1.0, -1.0, 1.0])
    assert np.abs(reference.joints(phases) - exact).max() < 0.3 * (2.0 * np.pi * 0.01) ** 4 / 384.0 * 1.01


def test_the_planned_base_goes_on_cycle_after_cycle() -> None:
    motion = wriggle()
    reference = Reference.of(motion)
    for phase in (0.0, 0.3, 0.999):
        at = reference.base(phase)
        for k in (-3, -1, 1, 6):
            moved = reference.base(phase + k)
            np.testing.assert_allclose(moved - at, [0.05 * k, 0, 0, 0, 0, 0, 0], atol=1e-12)
    low, high = region(reference, 6)
    assert high[0] > 0.3 + 0.5 and low[0] < -0.5


def test_a_cycle_that_turns_is_composed_as_a_rigid_motion() -> None:
    robot, t = snake(2, 0.1), np.array([0.0, 0.5, 1.0])
    base = np.zeros((3, 7))
    base[:, :2] = [[0.2, 0.1], [0.3, 0.1], [0.5, 0.2]]
    base[:, 3:] = quaternion_exp(np.array([0.0, 0.0, 1.0]) * np.array([[0.1], [0.2], [0.6]]))
    claim = Claim("periodic", "turn", {"period": 1.0, "advance": [0.3, 0.1, 0.0], "turn": 0.5})
    reference = Reference.of(motion_of(robot, Plane(), np.zeros((3, 1)), t, base, [claim]))
    here = robot.forward([0.0], reference.base(3.25))["base"]
    angle, c = 0.5, np.array([base[0, 0] + 1j * base[0, 1], base[2, 0] + 1j * base[2, 1]])
    shift = c[1] - np.exp(1j * angle) * c[0]
    place = 0.25 + 1j * 0.1
    for _ in range(3):
        place = shift + np.exp(1j * angle) * place
    np.testing.assert_allclose(here[:2], [place.real, place.imag], atol=1e-12)
    np.testing.assert_allclose(2.0 * np.arctan2(here[6], here[3]), 0.15 + 3 * 0.5, atol=1e-12)


def test_a_motion_shorter_than_its_period_runs_once() -> None:
    reference = Reference.of(wriggle(cycles=0.5))
    assert reference.period is None and reference.duration == pytest.approx(0.5)
    trial = simulate(wriggle(cycles=0.5), cycles=5, settle=0.1, ramp=0.2)
    assert trial.cycles == 1 and trial.period == pytest.approx(0.6) and trial.start_time == pytest.approx(0.1)


def test_progress_and_slip_of_records_that_are_known() -> None:
    motion = wriggle()
    t = np.linspace(0.0, 3.0, 301)
    com = np.stack([0.04 * (t - 1.0), 0.01 * (t - 1.0), 0.0 * t], axis=1)
    base = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (301, 1))
    base[:, 0] = -0.002 * t
    records = Records(t, base, np.zeros((301, 5)), np.zeros((301, 5)), com)
    planned = np.array([[0.05, 0.0, 0.0], [0.0, 0.05, 0.0]])
    found = progress_of(records, planned, 1.0, 1.0)
    np.testing.assert_allclose(found["advance"], [[0.04, 0.01, 0.0]] * 2, atol=1e-15)
    np.testing.assert_allclose(found["advance_ratios"], [0.8, 0.2], atol=1e-12)
    np.testing.assert_allclose(found["sideways"], [0.01, -0.04], atol=1e-15)
    assert found["speed"] == pytest.approx(0.025)
    slips = slips_of(motion, records, planned, lambda phase: 1.0 + phase, 1.0)
    assert [(s.cycle, s.start, s.end) for s in slips] == [(0, 1.25, 1.75), (1, 2.25, 2.75)]
    assert slips[0].along == pytest.approx(-0.001) and slips[0].largest == pytest.approx(0.001)
    assert slips[1].along == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("periodic", [True, False])
def test_phase_and_time_are_inverse_to_each_other(periodic: bool) -> None:
    reference = Reference.of(wriggle(cycles=1.2 if periodic else 0.9))
    timing = Timing.of(reference, 2, dt=1e-3, settle=0.3, ramp=0.4, record_dt=0.02)
    assert timing.periodic is periodic
    for phase in (0.0, 0.1, 0.2, 0.55, 0.9):
        assert timing.phase(np.array(timing.time_of(phase))) == pytest.approx(phase, abs=1e-12)
    assert timing.time_of(0.0) == pytest.approx(timing.start_time)
    assert timing.time_of(reference.duration) == pytest.approx(timing.start_time + timing.span)


def test_misuse_is_refused_where_it_is_said() -> None:
    motion = wriggle()
    bare = Robot.from_rows({"a": [Row(theta=Joint("x"), a=0.1, body=Body(mass=1.0))]})
    for wrong, message in (
        ({"cycles": 0}, "cycles"),
        ({"dt": 0.0}, "dt"),
        ({"settle": -1.0}, "settle"),
        ({"record_dt": 1e-5}, "record_dt"),
        ({"dt": 1e-9, "record_dt": 1.0}, "time steps"),
        ({"friction": -0.1}, "friction"),
        ({"servo": (0.0, 0.1)}, "kp"),
    ):
        with pytest.raises(InputError, match=message):
            simulate(motion, **wrong)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no contacts"):
        simulate(still(bare, Plane(), 1.0))
    with pytest.raises(InputError, match="expected a Motion"):
        simulate("motion")  # type: ignore[arg-type]
