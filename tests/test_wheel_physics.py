"""Wheels of adjustable and of fixed radius in physics: holding, lifting, rolling; motions written by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid, trapezoid
from scipy.optimize import brentq

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.export.mjcf import text
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.elements import Body, Contact, Joint, Row, WheelRadius
from bodyplan.robot.masses import center_of_mass
from bodyplan.simulate import build, default_servo
from bodyplan.simulate.rims import rims_of, ring_of

BOX = ([-3.0] * 3, [3.0] * 3)
LAW = WheelRadius(Joint("q"), 0.3, 0.02)
WEIGHT = 10.0 * 9.81
PLACES = {"fl": (0.6, 0.6), "fr": (0.6, -0.6), "r": (-0.6, 0.0)}
DEGREE = np.pi / 180.0


def angle_for(radius: Any) -> Any:
    """q of a radius, by eq. (1) of paper wheels."""
    return 2.0 * np.arccos((np.asarray(radius) - 0.02) / (0.3 * np.cos(np.pi / 6.0)))


def made(robot: bp.Robot, ground: Ground, t: Any, x: Any, z: Any, joints: dict[str, Any]) -> Motion:
    """A level body above (x, 0, z) with joints (T,) by name; those not named are 0."""
    t = np.asarray(t, dtype=float)
    q = np.zeros((len(t), robot.n))
    for name, values in joints.items():
        q[:, robot.joints.index(name)] = values
    base = np.zeros((len(t), 7))
    base[:, 0], base[:, 2], base[:, 3] = x, z, 1.0
    qd = np.gradient(q, t, axis=0)
    none = np.zeros(len(t))
    return Motion(robot, ground, {}, t, base, q, qd, np.zeros_like(q), none, np.full(len(t), "ok"))


def every(**values: Any) -> dict[str, Any]:
    """The same values for all three wheels."""
    return {f"{wheel}.{joint}": value for wheel in PLACES for joint, value in values.items()}


def column(trial: bp.Trial, name: str, of: str = "q") -> Any:
    return getattr(trial, of)[:, trial.joints.index(name)]


# --- holding --------------------------------------------------------------------------------------------------


def on_a_plane(slope: tuple[float, float], z: float) -> tuple[dict[str, float], dict[str, float]]:
    """Joints of a level body at height z on a plane, and the loads along its normal that hold it, by wheel."""
    sx, sy = slope
    normal = np.array([-sx, -sy, 1.0]) / np.sqrt(1.0 + sx * sx + sy * sy)
    joints, arms = {}, []
    for wheel, (x, y) in PLACES.items():
        # in the plane of the wheel the ground is a line of slope sx
        radius = (z - sx * x - sy * y) / np.hypot(1.0, sx)
        u = np.array([sx, 0.0, -1.0]) / np.hypot(1.0, sx)
        joints |= {f"{wheel}.contact": np.arctan(sx), f"{wheel}.adjust": float(angle_for(radius))}
        arms.append(np.array([x, y, 0.0]) + radius * u)
    # friction acts in the plane, at one distance from the centre of mass: its sum says its moments along the plane
    weight = np.array([0.0, 0.0, -WEIGHT])
    friction = -(weight - (weight @ normal) * normal)
    foot = (np.array(arms) @ normal).mean() * normal
    along = np.array([[1.0, 0.0, sx], [0.0, 1.0, sy]])
    equations = np.array([[1.0, *along @ np.cross(arm, normal)] for arm in arms]).T
    loads = np.linalg.solve(equations, [-weight @ normal, *-along @ np.cross(foot, friction)])
    return joints, dict(zip(PLACES, loads, strict=True))


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.1, 0.0), (-0.06, 0.05)])
def test_standing_on_a_plane_the_body_is_level_and_torques_are_those_of_virtual_work(
    slope: tuple[float, float],
) -> None:
    robot, z = bp.tri_wheel(), 0.17
    joints, loads = on_a_plane(slope, z)
    if slope == (0.0, 0.0):
        assert loads == pytest.approx({"fl": WEIGHT / 4, "fr": WEIGHT / 4, "r": WEIGHT / 2})
    motion = made(robot, bp.Plane(slope=slope), [0.0, 0.5], 0.0, z, joints)
    trial = bp.simulate(motion, settle=0.7, ramp=0.0)
    assert trial.ok and trial.warnings == ()
    assert trial.tilt is not None and trial.tilt <= 0.1 * DEGREE
    assert trial.height_max is not None and trial.height_max <= 3e-3
    assert np.abs(trial.base[-1] - trial.base[-10]).max() < 1e-4
    later = trial.t >= trial.start_time
    for wheel, load in loads.items():
        expected = LAW.slope(joints[f"{wheel}.adjust"]) * load
        torque = column(trial, f"{wheel}.adjust", "torque")[later]
        np.testing.assert_allclose(torque, expected, rtol=0.04)
        assert trial.torque_peak is not None
        peak = trial.torque_peak[trial.joints.index(f"{wheel}.adjust")]
        assert peak == pytest.approx(abs(expected), rel=0.04)
        # the contact angle is measured: that of the slope along the wheel, as seen from the body that leans a little
        angle = column(trial, f"{wheel}.contact")[later]
        np.testing.assert_allclose(angle, np.arctan(slope[0]), atol=0.1 * DEGREE)


def test_fewer_balls_and_longer_time_steps_hold_as_well() -> None:
    joints, _ = on_a_plane((0.1, 0.0), 0.17)
    motion = made(bp.tri_wheel(), bp.Plane(slope=(0.1, 0.0)), [0.0, 0.5], 0.0, 0.17, joints)
    for options in ({"rim_tips": 24}, {"dt": 2e-3}):
        trial = bp.simulate(motion, settle=0.7, ramp=0.0, **options)
        assert trial.ok and trial.warnings == ()
        assert trial.tilt is not None and trial.tilt <= 0.1 * DEGREE
        assert trial.height_max is not None and trial.height_max <= 3e-3


# --- lifting and rolling ----------------------------------------------------------------------------------------


def test_the_body_rises_with_the_radius_and_motors_do_the_work_of_lifting() -> None:
    t = np.linspace(0.0, 2.0, 101)
    q = 2.4 - 0.8 * (0.5 - 0.5 * np.cos(np.pi * t / 2.0))
    motion = made(bp.tri_wheel(), bp.Plane(), t, 0.0, LAW.radius(q), every(adjust=q))
    trial = bp.simulate(motion, settle=0.5, ramp=0.0)
    assert trial.ok and trial.warnings == ()
    assert trial.height_max is not None and trial.height_max <= 3e-3
    later = trial.t >= trial.start_time
    error = trial.base[later, 2] - np.interp(trial.t[later] - trial.start_time, t, LAW.radius(q))
    assert trial.height_max == pytest.approx(np.abs(error).max(), abs=2e-5)
    assert trial.height_rms == pytest.approx(np.sqrt(np.mean(error**2)), abs=2e-5)
    assert trial.metrics()["height_rms_m"] == trial.height_rms
    assert trial.tilt is not None and trial.tilt <= 0.1 * DEGREE
    # the advance of this plan is upwards
    assert trial.advance_ratio is not None and trial.advance_ratio == pytest.approx(1.0, abs=0.01)
    lifted = WEIGHT * float(np.ptp(trial.com[later, 2]))
    assert lifted == pytest.approx(WEIGHT * float(LAW.radius(1.6) - LAW.radius(2.4)), rel=0.02)
    work = sum(
        trapezoid(column(trial, f"{w}.adjust", "torque")[later], column(trial, f"{w}.adjust")[later]) for w in PLACES
    )
    assert work == pytest.approx(lifted, rel=0.02)
    assert trial.settings["rim_law_error_m"] < 1e-5
    low, high = trial.settings["rim_law_range"]["r.adjust"]
    assert low < 1.6 and high > 2.4


def test_rolling_straight_on_a_plane() -> None:
    t, radius, speed = np.linspace(0.0, 3.0, 61), 0.2, 0.3
    q = float(angle_for(radius))
    joints = every(adjust=q, spin=speed * t / radius)
    trial = bp.simulate(made(bp.tri_wheel(), bp.Plane(), t, speed * t, radius, joints), settle=0.5, ramp=0.5)
    assert trial.ok and trial.warnings == ()
    assert trial.advance_ratio is not None and trial.advance_ratio == pytest.approx(1.0, abs=0.03)
    assert trial.height_max is not None and trial.height_max <= 5e-3
    assert trial.tilt is not None and trial.tilt <= 0.3 * DEGREE
    assert trial.sideways is not None and abs(trial.sideways[0]) < 1e-3
    assert trial.yaw_ratio is None
    rolling = trial.t > trial.start_time + 0.6
    for wheel, share in (("fl", 0.25), ("fr", 0.25), ("r", 0.5)):
        torque = column(trial, f"{wheel}.adjust", "torque")[rolling]
        static = float(LAW.slope(q)) * share * WEIGHT
        assert torque.mean() == pytest.approx(static, rel=0.04)
        assert np.abs(torque).max() < 1.7 * abs(static)
        # whichever ball touches, the ground is below
        assert np.abs(column(trial, f"{wheel}.contact")[rolling]).max() < 0.2 * DEGREE


def touching(at: Any, z: float, ground: bp.Surface) -> tuple[Any, Any]:
    """Radius and contact angle of wheels with their centres above x = at (T,), at height z, on a ground along x."""

    def height(x: float) -> float:
        return float(ground.height(x, 0.0))

    def slope(x: float) -> float:
        return float(ground.gradient([x, 0.0])[0])

    found = []
    for x in at:
        # ripples wider than the wheel: the distance has one least value near the centre
        s = brentq(lambda s, x=x: s - x + (height(s) - z) * slope(s), x - 0.15, x + 0.15)
        found.append((np.hypot(s - x, height(s) - z), np.arctan2(s - x, z - height(s))))
    radius, angle = np.array(found).T
    return radius, angle


def test_wheels_keep_the_body_level_over_ripples() -> None:
    t, speed, z = np.linspace(0.0, 4.0, 81), 0.3, 0.17
    ground = bp.Surface("0.03*sin(3.2*x)")
    joints: dict[str, Any] = {}
    for wheel, (x, _) in PLACES.items():
        radius, angle = touching(speed * t + x, z, ground)
        spin = cumulative_trapezoid(speed * np.cos(angle) / radius, t, initial=0.0)
        joints |= {f"{wheel}.adjust": angle_for(radius), f"{wheel}.contact": angle, f"{wheel}.spin": spin}
    trial = bp.simulate(made(bp.tri_wheel(), ground, t, speed * t, z, joints), settle=0.5, ramp=0.5, record_dt=0.01)
    assert trial.ok and trial.warnings == ()
    assert trial.advance_ratio is not None and trial.advance_ratio == pytest.approx(1.0, abs=0.03)
    assert trial.tilt is not None and trial.tilt <= 0.3 * DEGREE
    assert trial.height_max is not None and trial.height_max <= 5e-3
    rolling = trial.t > trial.start_time + 0.6
    for wheel, share in (("fl", 0.25), ("fr", 0.25), ("r", 0.5)):
        torque, angle = column(trial, f"{wheel}.adjust", "torque"), column(trial, f"{wheel}.contact")
        static = LAW.slope(column(trial, f"{wheel}.adjust")) * share * WEIGHT * np.cos(angle)
        assert np.abs(torque[rolling]).max() <= 1.7 * np.abs(static[rolling]).max()
        mean, expected = (np.convolve(v[rolling], np.full(10, 0.1), "valid") for v in (torque, static))
        np.testing.assert_allclose(mean, expected, rtol=0.12)
        planned = np.interp(trial.t - trial.start_time - 0.25, t, joints[f"{wheel}.contact"])
        # the angle is measured by one or two balls on the facets of a height field, to some degrees but without bias
        off = (angle - planned)[rolling]
        assert np.abs(planned[rolling]).max() > 4.0 * DEGREE
        assert abs(off.mean()) < 0.5 * DEGREE and off.std() < 1.5 * DEGREE


def circling(robot: bp.Robot, turn_radius: float, speed: float, seconds: float, ahead: float) -> Motion:
    """Along a circle to the left, each wheel as it rolls there; the point ``ahead`` m of the base is on the circle."""
    t, radius = np.linspace(0.0, seconds, 41), 0.2
    rate = speed / turn_radius
    yaw = rate * t
    joints = every(adjust=float(angle_for(radius)))
    joints |= {f"{wheel}.spin": (speed - rate * y) * t / radius for wheel, (_, y) in PLACES.items()}
    motion = made(robot, bp.Plane(), t, 0.0, radius, joints)
    base = motion.base.copy()
    base[:, 0] = turn_radius * np.sin(yaw) - ahead * np.cos(yaw)
    base[:, 1] = turn_radius * (1.0 - np.cos(yaw)) - ahead * np.sin(yaw)
    base[:, 3], base[:, 6] = np.cos(0.5 * yaw), np.sin(0.5 * yaw)
    return motion.replace(base=base)


def yaw_of(trial: bp.Trial) -> Any:
    return np.unwrap(2.0 * np.arctan2(trial.base[:, 6], trial.base[:, 3]))


@pytest.mark.parametrize(("friction", "turn_radius"), [(1.0, 1.0), (0.5, 2.0)])
def test_three_parallel_axles_of_equal_friction_make_a_fifth_of_a_turn(friction: float, turn_radius: float) -> None:
    # least power of friction: the rear wheel, which has half of the load, sticks; the front wheels slip by
    # (1 - s) L_y along and 2 s L_x across (times the yaw rate), which is least at this share s
    share = 0.6**2 / (0.6**2 + (2.0 * 0.6) ** 2)
    motion = circling(bp.tri_wheel(), turn_radius, 0.2, 4.0, ahead=0.0)
    trial = bp.simulate(motion, friction=friction, settle=0.5, ramp=0.5)
    (warning,) = trial.warnings
    assert warning.startswith("cannot turn: 2") and "parallel" in warning
    assert trial.yaw_ratio is not None and trial.yaw_ratio == pytest.approx(share, rel=0.1)
    some = trial.t > 2.0
    rate = np.polyfit(trial.t[some], yaw_of(trial)[some], 1)[0]
    assert rate * turn_radius / 0.2 == pytest.approx(share, rel=0.05)


def test_with_a_slippery_rear_wheel_the_front_axle_follows_a_circle() -> None:
    robot = bp.tri_wheel()
    slippery = [replace(c, friction=0.1) if c.name == "r.rim" else c for c in robot.contacts]
    robot = replace(robot, contacts=tuple(slippery))
    motion = circling(robot, 1.0, 0.2, 4.0, ahead=0.6)
    trial = bp.simulate(motion, settle=0.5, ramp=0.5)
    assert trial.ok and trial.warnings == ()
    assert trial.turned is not None and abs(trial.turned[-1]) < 4.0 * DEGREE
    assert abs(yaw_of(trial)[-1] - 0.8) < 4.0 * DEGREE
    assert trial.yaw_ratio == pytest.approx(1.0, abs=4.0 * DEGREE / 0.8)
    executed, planned = (
        b[:2] + 0.6 * np.array([b[3] ** 2 - b[6] ** 2, 2.0 * b[3] * b[6]]) for b in (trial.base[-1], motion.base[-1])
    )
    assert np.linalg.norm(executed - planned) < 0.05
    assert trial.tilt is not None and trial.tilt <= 0.3 * DEGREE


def test_rims_of_fixed_radius_roll() -> None:
    t, speed = np.linspace(0.0, 2.0, 41), 0.3
    robot = bp.rover({"a": (0.3, 0.3), "b": (0.3, -0.3), "c": (-0.3, 0.3), "d": (-0.3, -0.3)}, radius=0.15, mass=4.0)
    spins = {f"{wheel}.spin": speed * t / 0.15 for wheel in "abcd"}
    trial = bp.simulate(made(robot, bp.Plane(), t, speed * t, 0.15, spins), settle=0.3, ramp=0.3)
    assert trial.ok and trial.warnings == ()
    assert trial.advance_ratio is not None and trial.advance_ratio == pytest.approx(1.0, abs=0.03)
    assert trial.height_max is not None and trial.height_max <= 1e-3
    assert trial.tilt is not None and trial.tilt <= 0.1 * DEGREE
    assert "rim_tips" not in trial.settings
    for wheel in "abcd":
        assert np.abs(column(trial, f"{wheel}.contact")).max() < 0.1 * DEGREE


def test_a_wheel_that_carries_nothing_keeps_its_planned_contact_angle() -> None:
    # the middle wheel is smaller than the others and hangs in the air
    places = {"a": (0.4, 0.3), "b": (0.4, -0.3), "c": (-0.4, 0.3), "d": (-0.4, -0.3), "m": (0.0, 0.0)}
    robot = bp.rover(places, radius={"m": 0.1, **dict.fromkeys("abcd", 0.15)})
    trial = bp.simulate(made(robot, bp.Plane(), [0.0, 0.3], 0.0, 0.15, {"m.contact": 0.4}), settle=0.2, ramp=0.0)
    np.testing.assert_allclose(column(trial, "m.contact"), 0.4, atol=1e-12)
    assert np.abs(column(trial, "a.contact")[trial.t > 0.1]).max() < 0.1 * DEGREE


# --- the model --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wheel_mass", [0.0, 0.3])
def test_mass_and_its_centre_are_those_of_the_robot_at_any_radius(wheel_mass: float) -> None:
    robot = bp.tri_wheel(com=(0.05, 0.02, 0.03), wheel_mass=wheel_mass)
    physics = build(robot, bp.Plane(), *BOX)
    rng = np.random.default_rng(5)
    data = mujoco.MjData(physics.model)
    base = np.array([0.1, 0.2, 0.3, 0.8, 0.0, 0.6, 0.0])
    for _ in range(5):
        q = rng.uniform(0.0, np.pi, robot.n)
        data.qpos[:] = physics.qpos(q, base)
        mujoco.mj_forward(physics.model, data)
        np.testing.assert_allclose(data.subtree_com[1], center_of_mass(robot, q, base), atol=1e-9)
        measured = np.array([not name.endswith(".contact") for name in robot.joints])
        np.testing.assert_allclose(physics.q(data.qpos)[measured], q[measured], atol=1e-12)
        assert physics.coupling_error(data.qpos) < 1e-12
        # every ball is at the radius of the law, to the error of the polynomial
        for wheel in PLACES:
            hub = data.body(f"{wheel}.hub").xpos
            away = [np.linalg.norm(data.geom(f"{wheel}.rim~{k + 1}").xpos - hub) for k in range(32)]
            radius = float(LAW.radius(q[robot.joints.index(f"{wheel}.adjust")]))
            np.testing.assert_allclose(np.array(away) + 0.02, radius, atol=3.3e-5)
    assert physics.model.body_mass.sum() == pytest.approx(10.0, rel=1e-9)


@pytest.mark.parametrize(("low", "high", "share"), [(0.0, np.pi, 1.1e-4), (0.5, 2.6, 1.5e-5), (2.0, 2.2, 1e-9)])
def test_the_polynomial_of_a_ring_is_the_law_to_the_error_it_says(low: float, high: float, share: float) -> None:
    robot = bp.tri_wheel()
    ring = ring_of(rims_of(robot)[0], LAW, low, high, 0.12)
    q = np.linspace(low, high, 1001)
    made_by = np.polynomial.polynomial.polyval(q, ring.law) + ring.rest + ring.tip
    worst = float(np.abs(made_by - LAW.radius(q)).max())
    assert worst <= share * 0.3 and worst == pytest.approx(ring.error, rel=1e-2, abs=1e-14)


def test_contact_angles_have_no_joint_and_servos_fit_the_wheels() -> None:
    robot = bp.tri_wheel()
    physics = build(robot, bp.Plane(), *BOX)
    names = {physics.model.joint(i).name for i in range(physics.model.njnt)}
    assert {"fl.adjust", "fl.spin", "r.adjust", "r.spin", "fl.rim~1", "r.rim~32"} <= names
    assert not any(name.startswith("fl.contact") for name in names)
    servo = default_servo(robot)
    assert set(servo) == {f"{w}.{j}" for w in PLACES for j in ("adjust", "spin")}
    assert servo["r.adjust"][0] == pytest.approx(1000.0, rel=0.02)
    assert servo["r.spin"][0] == pytest.approx(300.0, rel=0.02)
    assert mujoco.MjModel.from_xml_string(text(robot)).nv == physics.model.nv


def test_what_wheels_physics_cannot_make() -> None:
    hub, pointer = Row(theta=Joint("spin"), body=Body(mass=1.0)), Row(theta=Joint("at", actuated=False), a=LAW)
    contacts, trunk = (Contact("rim", "w.1", "rim", drive=LAW),), Body(mass=2.0)

    def robot(*, base: Body | None = trunk, **chains: Row) -> bp.Robot:
        rows = {"w": hub, "p": pointer} | chains
        return bp.Robot.from_rows({name: [row] for name, row in rows.items()}, contacts=contacts, base_body=base)

    assert build(robot(), bp.Plane(), *BOX).model.nv == 6 + 1 + 1 + 32
    assert build(robot(base=None), bp.Plane(), *BOX).model.nv == 6 + 1 + 1 + 32
    with pytest.raises(InputError, match=r"'q'.*also moves"):
        build(robot(m=Row(theta=Joint("q"))), bp.Plane(), *BOX)
    for wrong in (
        Row(theta=Joint("at", actuated=False), a=LAW, body=Body(mass=0.1)),
        Row(theta=Joint("at"), a=LAW),
        Row(theta=0.3, d=LAW),
    ):
        with pytest.raises(InputError, match=r"'q'.*wheel-radius.*'p.1'"):
            build(robot(p=wrong), bp.Plane(), *BOX)
    with pytest.raises(InputError, match="no mass to spare"):
        build(robot(base=None, w=Row(theta=Joint("spin")), x=Row(a=0.1, body=Body(mass=1.0))), bp.Plane(), *BOX)
    with pytest.raises(InputError, match="rim_tips"):
        build(bp.tri_wheel(), bp.Plane(), *BOX, rim_tips=4)
    bare = bp.tri_wheel(rubber=0.0)
    with pytest.raises(InputError, match=r"fl\.rim.*no radius left"):
        build(bare, bp.Plane(), *BOX)
    assert build(bare, bp.Plane(), *BOX, ranges=dict.fromkeys(("fl.adjust", "fr.adjust", "r.adjust"), (0.5, 2.5)))
