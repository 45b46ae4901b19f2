"""Known and unknown rates by name: G and H against matrices built by hand from another kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.solve import coordinate_jacobian, coordinates_from_pose, pose_from_coordinates
from robot_cases import STEP, body_twist, random_robot
from solve_cases import LEGS, coordinate_matrix, crouching, random_base, random_case


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_random_robots_and_random_known_rates(seed: int) -> None:
    case = random_case(seed)
    part = case.partition()
    G, H, X, Y = case.want.split(case.known)
    assert part.unknown == tuple(X)
    assert part.known == tuple(Y)
    assert part.rows == tuple(case.want.feet)
    scale = 1.0 + np.abs(case.want.P).max() + np.abs(case.want.Q).max()
    assert np.abs(part.G - G).max(initial=0.0) < 1e-12 * scale
    assert np.abs(part.H - H).max(initial=0.0) < 1e-12 * scale


def test_by_default_rows_and_columns_of_the_velocity_model() -> None:
    robot = bp.silo4(passive=True)
    q = crouching(robot, np.random.default_rng(1))
    P, Q = robot.velocity_model(q)
    known = ["fl.foot.vx", "fl.foot.vy", "hr.foot.wz", "body.vx", "fr.knee"]
    part = bp.solve.partition(robot, q, known=known)
    feet, knee = [0, 1, 6 * 3 + 5], robot.joint_index("fr.knee")
    others = np.setdiff1d(np.arange(24), feet)
    G = np.hstack([np.delete(Q, knee, axis=1), -np.eye(24)[:, others], P[:, 1:]])
    H = np.hstack([np.eye(24)[:, feet], -P[:, :1], -Q[:, [knee]]])
    assert np.array_equal(part.G, G)
    assert np.array_equal(part.H, H)
    assert part.known == ("fl.foot.vx", "fl.foot.vy", "hr.foot.wz", "body.vx", "fr.knee")
    assert part.known_units == ("m/s", "m/s", "rad/s", "m/s", "rad/s")
    assert part.unknown[:2] == ("fl.shoulder", "fl.hip")
    assert part.unknown[-1] == "body.wz"


def test_units_of_sliding_joints() -> None:
    rows = [bp.Row(theta=bp.Joint("turn"), a=0.2), bp.Row(d=bp.Joint("slide"), a=0.1)]
    part = bp.solve.partition(bp.Robot.from_rows({"leg": rows}), [0.1, 0.2], known=["leg.vx", "slide"])
    assert dict(zip(part.unknown, part.unknown_units, strict=True))["turn"] == "rad/s"
    assert part.known_units == ("m/s", "m/s")


# --- names --------------------------------------------------------------------------------------------------


def test_a_foot_has_several_names() -> None:
    table = {
        "l": [bp.Row(theta=bp.Joint("l.hip"), a=0.2, name="l.knee"), bp.Row(theta=bp.Joint("l.k"), a=0.2, name="toe")],
        "r": [bp.Row(theta=bp.Joint("r.hip"), a=0.2, name="r.foot"), bp.Row(theta=bp.Joint("r.k"), a=0.2, name="tip")],
    }
    ball = bp.Contact("ball", "toe", "sphere", 0.01)
    robot = bp.Robot.from_rows(table, contacts=[ball])
    q = [0.1, 0.2, 0.3, 0.4]
    wanted = bp.solve.partition(robot, q, known=["l.foot.vx"])
    for name in ("l.vx", "toe.vx", "ball.vx"):
        part = bp.solve.partition(robot, q, known=[name])
        assert part.known == ("l.foot.vx",)
        assert np.array_equal(part.G, wanted.G)
    # "r.foot" is a frame of its own here, so the end of the chain goes by the name of its frame
    assert bp.solve.model(robot, q).feet == ("l.foot", "tip")
    part = bp.solve.partition(robot, q, known=["r.foot.vx", "r.vy"])
    assert part.model.feet == ("l.foot", "tip", "r.foot")
    assert part.known == ("tip.vy", "r.foot.vx")
    J = robot.jacobian(q, "r.foot")
    assert np.array_equal(part.G[12:, :4], J)


def test_groups_stand_for_their_components() -> None:
    robot = bp.silo4()
    q = crouching(robot)
    part = bp.solve.partition(robot, q, known=["hl.foot", "fl.v", "fr.foot.w", "body"])
    assert part.known == (
        *(f"fl.foot.{p}" for p in ("vx", "vy", "vz")),
        *(f"fr.foot.{p}" for p in ("wx", "wy", "wz")),
        *(f"hl.foot.{p}" for p in ("vx", "vy", "vz", "wx", "wy", "wz")),
        *(f"body.{p}" for p in ("vx", "vy", "vz", "wx", "wy", "wz")),
    )
    values = part.values({"hl.foot": np.arange(6.0), "fl.v": 7.0, "fr.foot.w": [[1.0, 2.0, 3.0]] * 2, "body": 0.0})
    assert values.shape == (2, 18)
    assert values[1].tolist() == [7.0] * 3 + [1.0, 2.0, 3.0] + list(range(6)) + [0.0] * 6


def test_any_frame_and_any_point_of_a_contact() -> None:
    rng = np.random.default_rng(2)
    plain = random_robot(rng, 3)
    frame = plain.frames[2]
    contact = bp.Contact("knob", frame, "sphere", 0.02, start=(0.1, -0.2, 0.3))
    robot = bp.Robot(plain.name, plain.chains, (contact,))
    q, base = rng.uniform(-1, 1, robot.n), random_base(rng)
    at = bp.solve.model(robot, q, base, feet=["knob", frame])
    pose = robot.forward(q, base)[frame]
    R = bp.spatial.matrix_from_quaternion(pose[3:])
    assert np.abs(at.positions[0] - (pose[:3] + R @ contact.start)).max() < 1e-14
    twist, qd = rng.normal(size=6), rng.normal(size=robot.n)
    knob, own = (at.P @ twist + at.Q @ qd).reshape(2, 6)
    assert np.abs(knob[3:] - own[3:]).max() < 1e-14
    assert np.abs(knob[:3] - (own[:3] + np.cross(own[3:], contact.start))).max() < 1e-13


def test_feet_may_be_chosen() -> None:
    robot = bp.silo4()
    part = bp.solve.partition(robot, crouching(robot), feet=["hr", "fl.knee"], known=["fl.knee.vx"])
    assert part.model.feet == ("hr.foot", "fl.knee")
    assert part.G.shape == (12, 12 + 11 + 6)
    # a frame and a joint are called "fl.knee": bare, it is the joint
    assert bp.solve.partition(robot, crouching(robot), known=["fl.knee"]).known == ("fl.knee",)


# --- axes and coordinates -----------------------------------------------------------------------------------


def test_a_foot_at_rest_is_at_rest_in_all_axes() -> None:
    rng = np.random.default_rng(3)
    robot = bp.silo4(passive=True)
    q, base = crouching(robot, rng), random_base(rng)
    known = [f"{leg}.foot.v" for leg in LEGS] + ["body.x", "body.y", "body.yaw"]
    found = []
    for axes in ("own", "world"):
        part = bp.solve.partition(bp.solve.model(robot, q, base), known=known, axes=axes)
        still = {f"{leg}.foot.v": 0.0 for leg in LEGS} | {"body.x": 0.02, "body.y": 0.01, "body.yaw": 0.1}
        found.append(bp.solve.resolve(part, still, method="weighted"))
    assert np.abs(found[0].qd - found[1].qd).max() < 1e-13
    assert np.abs(found[0].twist - found[1].twist).max() < 1e-13


def test_a_swing_velocity_must_be_turned_into_the_axes_of_the_foot() -> None:
    rng = np.random.default_rng(4)
    robot = bp.silo4()
    q, base = crouching(robot, rng), random_base(rng)
    at = bp.solve.model(robot, q, base)
    swing = np.array([0.1, -0.05, 0.07])
    rates = {}
    for axes in ("own", "world"):
        part = bp.solve.partition(at, known=["fl.foot.v", "body"], axes=axes, body="twist")
        own = at.rotations[0].T @ swing if axes == "own" else swing
        rates[axes] = bp.solve.resolve(part, {"fl.foot.v": own, "body": 0.0})
    assert np.abs(rates["own"].qd - rates["world"].qd).max() < 1e-13
    h = 1e-6
    ends = [robot.forward(q + s * h * rates["world"].qd, base)["fl"][:3] for s in (-1, 1)]
    assert np.abs((ends[1] - ends[0]) / (2 * h) - swing).max() < 1e-9


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_coordinates_of_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pose = random_base(rng, 4)
    c = coordinates_from_pose(pose)
    assert np.all(np.abs(c[:, 4]) <= np.pi / 2)
    back = pose_from_coordinates(c)
    assert np.abs(back - np.concatenate([pose[:, :3], bp.spatial.canonical(pose[:, 3:])], axis=1)).max() < 1e-13
    scipy = Rotation.from_euler("ZYX", c[:, 5:2:-1]).as_matrix()
    assert np.abs(bp.spatial.matrix_from_quaternion(pose[:, 3:]) - scipy).max() < 1e-13
    J = coordinate_jacobian(c)
    for i in range(4):
        for k in range(6):
            dT = coordinate_matrix(c[i] + 1j * STEP * np.eye(6)[k]).imag / STEP
            assert np.abs(J[i, :, k] - body_twist(coordinate_matrix(c[i]).real, dT)).max() < 1e-13


def test_coordinates_where_roll_and_yaw_are_one() -> None:
    for pitch, roll in ((np.pi / 2, 0.3), (-np.pi / 2, -0.4)):
        half = pose_from_coordinates([0.0, 0.0, 0.0, roll, pitch, 0.0])
        c = coordinates_from_pose(half)
        assert c[4] == pytest.approx(pitch, abs=1e-15)
        assert np.abs(pose_from_coordinates(c) - half).max() < 1e-15
    assert np.linalg.matrix_rank(coordinate_jacobian([0, 0, 0, 0.3, np.pi / 2, 0.1])[3:, 3:], tol=1e-9) == 2


def test_rates_of_roll_pitch_yaw_are_not_the_angular_velocity() -> None:
    """The largest relative difference within +-0.5 rad is at the corner; the paper takes both for the same."""
    angles = np.linspace(-0.5, 0.5, 21)
    roll, pitch = np.meshgrid(angles, angles)
    c = np.zeros((21, 21, 6))
    c[..., 3], c[..., 4], c[..., 5] = roll, pitch, 0.2
    worst = np.linalg.norm(coordinate_jacobian(c)[..., 3:, 3:] - np.eye(3), 2, axis=(-2, -1))
    assert worst.max() == pytest.approx(worst[0, 0])
    assert 0.68 < worst.max() < 0.69
    assert worst[10, 10] == 0.0


def test_gravity_of_the_paper_is_that_of_the_coordinates() -> None:
    """(20): g in body axes is (sin b, -sin a cos b, -cos a cos b), with R = Rz Ry Rx and z up."""
    rng = np.random.default_rng(5)
    c = rng.uniform(-1.2, 1.2, (50, 6))
    R = bp.spatial.matrix_from_quaternion(pose_from_coordinates(c)[:, 3:])
    a, b = c[:, 3], c[:, 4]
    printed = np.stack([np.sin(b), -np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)], axis=-1)
    assert np.abs(np.swapaxes(R, -1, -2) @ [0.0, 0.0, -1.0] - printed).max() < 1e-14


# --- batches ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 3), (0,)])
def test_batches(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(6)
    robot = bp.silo4()
    q, base = rng.uniform(-1, 1, (*shape, robot.n)), random_base(rng, *shape)
    known = ["fl.foot.v", "body.yaw", "hr.knee"]
    part = bp.solve.partition(bp.solve.model(robot, q, base), known=known, axes="world")
    assert part.G.shape == (*shape, 24, 11 + 21 + 5)
    assert part.H.shape == (*shape, 24, 5)
    for index in np.ndindex(shape):
        one = bp.solve.partition(bp.solve.model(robot, q[index], base[index]), known=known, axes="world")
        assert np.abs(part.G[index] - one.G).max() < 1e-14
        assert np.abs(part.H[index] - one.H).max() < 1e-14


def test_one_base_for_many_configurations_and_the_other_way_round() -> None:
    rng = np.random.default_rng(7)
    robot = bp.silo4()
    q, base = rng.uniform(-1, 1, (4, robot.n)), random_base(rng, 3, 1)
    part = bp.solve.partition(robot, q, base, known=["fl.foot.v", "body.pitch"], axes="world")
    assert part.shape == (3, 4)
    one = bp.solve.partition(robot, q[2], base[1, 0], known=["fl.foot.v", "body.pitch"], axes="world")
    assert np.abs(part.G[1, 2] - one.G).max() < 1e-14
    moved = one.at(q, base)
    assert moved.known == part.known
    assert np.array_equal(moved.G, part.G)
    assert np.array_equal(moved.H, part.H)
    assert one.shape == ()


# --- refusals -----------------------------------------------------------------------------------------------


def test_refusals() -> None:
    robot = bp.silo4()
    q = crouching(robot)
    at = bp.solve.model(robot, q)
    with pytest.raises(UnknownNameError, match=r"fl.foot.vu.*fl.foot.vx"):
        bp.solve.partition(at, known=["fl.foot.vu"])
    with pytest.raises(UnknownNameError, match="component"):
        bp.solve.partition(at, known=["body.height"])
    with pytest.raises(UnknownNameError):
        bp.solve.partition(at, known=[3])  # type: ignore[list-item]
    with pytest.raises(InputError, match=r"'fl.foot.vx' is named twice"):
        bp.solve.partition(at, known=["fl.foot.v", "fl.vx"])
    with pytest.raises(InputError, match=r"twist or coordinates, got body.vx and body.yaw"):
        bp.solve.partition(at, known=["body.vx", "body.yaw"])
    with pytest.raises(UnknownNameError):
        bp.solve.partition(at, known=["body.yaw"], body="world")
    with pytest.raises(InputError, match="axes: must be one of own, world"):
        bp.solve.partition(at, known=[], axes="foot")
    with pytest.raises(InputError, match="body: must be one of twist, world, coordinates"):
        bp.solve.partition(at, known=[], body="rpy")
    with pytest.raises(InputError, match="sequence of names"):
        bp.solve.partition(at, known="fl.foot.vx")
    with pytest.raises(InputError, match="belong to the model"):
        bp.solve.partition(at, q, known=[])
    with pytest.raises(InputError, match="needs joint coordinates"):
        bp.solve.partition(robot, known=[])
    with pytest.raises(InputError, match="expected a Model or a Robot"):
        bp.solve.partition("silo4", q, known=[])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="does not broadcast"):
        bp.solve.model(robot, np.zeros((2, 12)), np.tile([0, 0, 0, 1.0, 0, 0, 0], (3, 1)))
    with pytest.raises(UnknownNameError, match="foot"):
        bp.solve.model(robot, q, feet=["fl", "tail"])
    with pytest.raises(InputError, match="the same foot twice"):
        bp.solve.model(robot, q, feet=["fl", "fl.foot"])
    with pytest.raises(InputError, match="at least one"):
        bp.solve.model(robot, q, feet=[])


def test_refusals_of_known_rates() -> None:
    robot = bp.silo4()
    part = bp.solve.partition(robot, crouching(robot), known=["fl.foot.v", "body.x"])
    with pytest.raises(InputError, match=r"no rate for fl.foot.vz, body.x"):
        part.values({"fl.foot.vx": 0.0, "fl.foot.vy": 0.0})
    with pytest.raises(InputError, match=r"'fl.foot.vx' is given twice"):
        part.values({"fl.foot.v": 0.0, "fl.foot.vx": 0.0, "body.x": 0.0})
    with pytest.raises(InputError, match=r"'body.y' is not known"):
        part.values({"fl.foot.v": 0.0, "body.x": 0.0, "body.y": 0.0})
    with pytest.raises(InputError, match=r"expected shape \(..., 4\)"):
        part.values([0.0, 1.0])
    with pytest.raises(InputError, match=r"expected shape \(..., 3\)"):
        part.values({"fl.foot.v": [0.0, 1.0], "body.x": 0.0})
    with pytest.raises(InputError, match="finite"):
        part.values([0.0, 1.0, np.nan, 0.0])
    with pytest.raises(InputError, match="do not broadcast"):
        part.values({"fl.foot.v": np.zeros((2, 3)), "body.x": np.zeros(3)})


def test_arrays_are_read_only() -> None:
    robot = bp.silo4()
    part = bp.solve.partition(robot, crouching(robot), known=["fl.foot.v"])
    for array in (part.G, part.H, part.model.P, part.model.positions):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
