"""Rates of wheels: against differences, against the model's velocity equation, and rolling that really rolls."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.carry import pose, pose_of, wheel_rates
from bodyplan.gaits.carry import rates as wheel_motion
from bodyplan.gaits.carry.contact import TOUCHES, find
from bodyplan.gaits.carry.pose import planes_of
from bodyplan.gaits.carry.terrain import terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.spatial import compose, exp, rotate

ROBOT = bp.tri_wheel()
GROUNDS = {
    "hills": bp.Surface("0.1*sin(3*x)*cos(2*y)"),
    "plane": bp.Plane(slope=(0.1, -0.05)),
    "map": bp.HeightMap(0.02 * np.random.default_rng(0).normal(size=(21, 21)), 0.2, (-2.0, -2.0)),
    "ridge": bp.Surface("0.05-abs(0.3*(x+0.2*y)-0.15)"),
}
POSE = {"height": 0.17, "roll": 0.04, "pitch": -0.05, "heading": 0.4}
TWIST = np.array([0.3, -0.1, 0.07, 0.05, -0.08, 0.25])


def moved(base: np.ndarray, twist: np.ndarray, time: float) -> np.ndarray:
    """The base after ``time`` s of a constant body-fixed twist."""
    return compose(base, exp(twist * time))


@pytest.mark.parametrize("name", ["hills", "plane", "map"])
def test_rates_are_differences(name: str) -> None:
    ground = GROUNDS[name]
    at = pose(ROBOT, ground, (0.1, -0.2), **POSE)
    assert at.ok
    rates = wheel_rates(at, TWIST)
    h = 1e-6
    after, before = (pose_of(ROBOT, ground, moved(at.base, TWIST, s)) for s in (h, -h))
    for wheel in at:
        for field, value in (("radius", "radius"), ("q", "q"), ("angle", "angle")):
            difference = (getattr(after[wheel.name], value) - getattr(before[wheel.name], value)) / (2 * h)
            assert getattr(rates[wheel.name], field) == pytest.approx(float(difference), rel=1e-6, abs=1e-8)


def test_the_models_velocity_equation_gives_the_velocity_of_the_contact() -> None:
    """V = P twist + Q dq/dt: the contact runs along the ground with it; with the hubs in place of the contact angles it
    is the material of the rim, of which only the sideways slip is left."""
    ground = GROUNDS["hills"]
    at = pose(ROBOT, ground, (0.1, -0.2), **POSE)
    rates = wheel_rates(at, TWIST)
    P, Q = ROBOT.velocity_model(at.joints)
    poses = ROBOT.forward(at.joints, at.base)
    h = 1e-6
    after, before = (pose_of(ROBOT, ground, moved(at.base, TWIST, s)) for s in (h, -h))
    rolling = rates.joints.copy()
    ends = [chain.name for chain in ROBOT.chains]
    for wheel in at:
        rows = slice(6 * ends.index(wheel.name), 6 * ends.index(wheel.name) + 3)
        turn = poses[wheel.name][3:]
        point = rotate(turn, (P @ TWIST + Q @ rates.joints)[rows])
        difference = (after[wheel.name].point - before[wheel.name].point) / (2 * h)
        np.testing.assert_allclose(point, difference, atol=1e-8)
        assert abs(point @ wheel.normal) < 1e-13
        # the material turns with the hub: its angle grows downwards from ahead, the contact's the other way
        angle, spin = (ROBOT.joint_index(f"{wheel.name}.{what}") for what in ("contact", "spin"))
        rolling[angle] = -rates.joints[spin]
        material = rotate(turn, (P @ TWIST + Q @ rolling)[rows])
        assert abs(material @ wheel.normal) < 1e-13
        axle = rotate(turn, [0.0, 0.0, 1.0])
        ahead = np.cross(axle, rotate(turn, [1.0, 0.0, 0.0]))  # backwards along the rim
        assert abs(material @ ahead) < 1e-13
        left = np.cross(wheel.normal, -ahead)
        assert material @ left == pytest.approx(float(rates[wheel.name].slip), abs=1e-13)


def test_a_body_that_turns_in_place_and_one_that_moves_straight() -> None:
    at = pose(ROBOT, bp.Plane(), (0.0, 0.0), 0.2)
    ahead = wheel_rates(at, [0.5, 0, 0, 0, 0, 0])
    turning = wheel_rates(at, [0, 0, 0, 0, 0, 1.0])
    rising = wheel_rates(at, [0, 0, 0.1, 0, 0, 0])
    for wheel in at:
        assert ahead[wheel.name].spin == pytest.approx(0.5 / 0.2) and ahead[wheel.name].slip == 0.0
        assert rising[wheel.name].radius == pytest.approx(0.1) and rising[wheel.name].spin == pytest.approx(0.0)
        slope = -0.5 * 0.3 * np.cos(np.radians(30)) * np.sin(wheel.q / 2)
        assert rising[wheel.name].q == pytest.approx(0.1 / slope)
    assert [turning[name].slip for name in ("fl", "fr", "r")] == pytest.approx([0.6, 0.6, -0.6])
    assert [turning[name].spin for name in ("fl", "fr", "r")] == pytest.approx([-3.0, 3.0, 0.0])


def test_rates_on_an_edge_of_the_ground() -> None:
    """Across the ridge the contact stays on it, and slides along it as the wheel's plane moves."""
    ground = GROUNDS["ridge"]
    robot = bp.rover({"a": (0.0, 0.0)}, body=(0.1, 0.1))
    at = pose(robot, ground, (0.52, 0.0), 0.2, heading=0.3, roll=0.1)
    assert at["a"].corner and at.ok
    twist = np.array([0.02, 0.05, 0.03, 0.1, 0.0, 0.4])
    rates = wheel_rates(at, twist)
    h = 1e-6
    after, before = (pose_of(robot, ground, moved(at.base, twist, s))["a"] for s in (h, -h))
    for field in ("radius", "angle", "q"):
        difference = (getattr(after, field) - getattr(before, field)) / (2 * h)
        assert getattr(rates["a"], field) == pytest.approx(float(difference), rel=1e-5, abs=1e-7)


def test_batches_and_refusals() -> None:
    at = pose(ROBOT, bp.Plane(), (0.0, 0.0), [[0.1, 0.2]], heading=[[0.0], [1.0]])
    rates = wheel_rates(at, TWIST)
    assert rates["r"].spin.shape == (2, 2) and rates.joints.shape == (2, 2, 9)
    with pytest.raises(bp.InputError, match=r"\(..., 6\)"):
        wheel_rates(at, np.zeros(5))
    with pytest.raises(bp.InputError, match="broadcast"):
        wheel_rates(at, np.zeros((3, 6)))
    with pytest.raises(bp.InputError, match=r"'front'.*fl, fr, r"):
        rates["front"]


def test_guesses_save_steps_and_decide_nothing() -> None:
    """Contacts found from where they were a moment before are those found from nowhere."""
    wheels, land = Wheels.of(ROBOT), terrain(bp.Surface("0.04*sin(18*x)*cos(15*y)"))
    rng = np.random.default_rng(4)
    position = np.concatenate([rng.uniform(-1, 1, (40, 2)), np.full((40, 1), 0.2)], axis=1)
    planes = planes_of(wheels, position, np.tile(np.eye(3), (40, 1, 1)))
    cold = find(land, planes)
    for wrong in (cold.phi + 0.01, np.full(len(planes), 1.2), rng.uniform(-3, 3, len(planes))):
        np.testing.assert_allclose(find(land, planes, wrong).radius, cold.radius, rtol=1e-10)


@pytest.mark.parametrize("name", ["hills", "map", "ridge"])
def test_accelerations_of_a_motion_are_differences_of_its_rates(name: str) -> None:
    """Also where the body leans and turns, over a path that bends."""
    gait = bp.Carry(
        [(0.0, 0.0), (0.4, 0.1), (0.8, -0.1), (1.1, 0.2)],
        height="0.17+0.01*sin(3*t)",
        height_mode="vertical",
        roll="0.05*sin(t)",
        pitch="0.04*cos(2*t)",
        speed=0.3,
        ramp=0.5,
    )
    t = np.linspace(0.0, 2.0, 4001)
    motion = bp.plan(bp.tri_wheel(half_length=0.3, half_width=0.2), gait, GROUNDS[name], t)
    assert motion.ok, motion.notes
    h = t[1] - t[0]
    for values, rates in ((motion.q, motion.qd), (motion.qd, motion.qdd)):
        difference = (values[2:] - values[:-2]) / (2 * h)
        error = np.abs(difference - rates[1:-1]) / (1.0 + np.abs(rates).max(axis=0))
        if name == "hills":
            assert error.max() < 1e-5
        # a third derivative of the map jumps at every cell, a wheel meets an edge now and then
        assert np.quantile(error, 0.99) < 1e-4


def test_the_spin_alone_is_that_of_all_rates() -> None:
    wheels, land, rng = Wheels.of(ROBOT), terrain(GROUNDS["hills"]), np.random.default_rng(2)
    count, spots = 50, np.column_stack([rng.uniform(-1.0, 1.0, (50, 2)), np.full(50, 0.25)])
    found = find(land, planes_of(wheels, spots, np.tile(np.eye(3), (count, 1, 1))))
    assert (found.outcome == TOUCHES).any()
    turned = np.linalg.qr(rng.normal(size=(3 * count, 3, 3)))[0]
    carried = wheel_motion.Carried(*(rng.normal(size=(3 * count, 3)) for _ in range(5)), *np.moveaxis(turned, 1, 0))
    np.testing.assert_array_equal(
        wheel_motion.rolling(found, carried), wheel_motion.rates(land, found, carried).rolling
    )
