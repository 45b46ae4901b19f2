"""What a robot is: names, order, properties, equality, plain data, refusals, and the ready snakes."""

from __future__ import annotations

import copy
import json
import pickle

import numpy as np
import pytest

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot import Arc, Body, Chain, Contact, Joint, Robot, Row, WheelRadius, snake


@pytest.fixture
def cart() -> Robot:
    """Two chains, the second on the first; every kind of drive, contact and body."""
    shared = Joint("lean", offset=0.1, limits=(-1.0, 0.5), rate=2.0)
    return Robot.from_rows(
        {
            "mast": [
                Row(theta=Joint("turn", effort=3.0), d=Joint("lift"), a=0.2, name="top", body=Body(mass=2.0)),
                Arc(0.3, pitch=shared, yaw=Joint("sway", actuated=False)),
            ],
            "wheel": [Row(theta=Joint("lean").share(0.5)), Row(d=WheelRadius(Joint("open"), 0.2, 0.01), epsilon=0.3)],
        },
        parents={"wheel": "top"},
        contacts=(
            Contact("rim", "wheel.2", "rim", 0.1, friction=0.7),
            Contact("box", "base", "box", half=(0.1, 0.2, 0.3)),
        ),
        base_body=Body(mass=1.0, com=(0, 0, 0.1), inertia=(1, 1, 1, 0, 0, 0)),
        name="cart",
    )


def test_names_and_order(cart: Robot) -> None:
    assert cart.joints == ("turn", "lift", "lean", "sway", "open")
    assert cart.kinds == ("angle", "length", "angle", "angle", "angle")
    assert cart.frames == ("base", "top", "mast.2", "wheel.1", "wheel.2")
    assert cart.ends == (2, 4)
    assert cart.n == 5
    assert cart.frame_index("top") == 1
    assert cart.frame_index("mast") == 2
    assert cart.frame_index("wheel") == cart.frame_index("wheel.2") == 4
    assert cart.joint_index("sway") == 3
    assert cart.mass == 3.0


def test_properties(cart: Robot) -> None:
    inf = np.inf
    assert np.array_equal(cart.limits, [[-inf, inf], [-inf, inf], [-1.0, 0.5], [-inf, inf], [0.0, np.pi]])
    assert np.array_equal(cart.rates, [inf, inf, 2.0, inf, inf])
    assert np.array_equal(cart.efforts, [3.0, inf, inf, inf, inf])
    assert np.array_equal(cart.actuated, [True, True, True, False, True])
    assert cart.joint_info[2] == Joint("lean", limits=(-1.0, 0.5), rate=2.0)
    for array in (cart.limits, cart.rates, cart.efforts, cart.actuated, cart.forward(np.zeros(5)).array):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        cart.name = "other"


def test_theta_d_a_epsilon_is_the_order_of_joints() -> None:
    robot = Robot.from_rows({"a": [Row(epsilon=Joint("e"), a=Joint("a"), d=Joint("d"), theta=Joint("t"))]})
    assert robot.joints == ("t", "d", "a", "e")
    assert robot.kinds == ("angle", "length", "length", "angle")


def test_vector(cart: Robot) -> None:
    values = {"turn": 1.0, "lift": [0.1, 0.2], "lean": [[0.3], [0.4], [0.5]], "sway": 0.0, "open": 1.0}
    q = cart.vector(values)
    assert q.shape == (3, 2, 5)
    assert np.array_equal(q[2, 1], [1.0, 0.2, 0.5, 0.0, 1.0])
    assert np.array_equal(cart.vector([1, 2, 3, 4, 5]), [1.0, 2.0, 3.0, 4.0, 5.0])
    assert np.array_equal(cart.forward(values).array, cart.forward(q).array)
    with pytest.raises(InputError, match="no value for joint lean, open"):
        cart.vector({"turn": 1.0, "lift": 0.0, "sway": 0.0})
    with pytest.raises(UnknownNameError, match="Did you mean 'turn'"):
        cart.vector({**values, "turm": 0.0})
    with pytest.raises(InputError, match=r"q\['lean'\]"):
        cart.vector({**values, "lean": np.nan})
    with pytest.raises(InputError, match="broadcast"):
        cart.vector({**values, "lift": np.zeros(4), "sway": np.zeros(3)})


def test_poses(cart: Robot) -> None:
    poses = cart.forward(np.zeros((3, 5)))
    assert np.array_equal(poses["wheel"], poses.array[:, 4])
    assert np.array_equal(poses[..., 4, :3], poses.positions[:, 4])
    assert np.array_equal(np.asarray(poses), poses.array)
    assert np.array(poses, dtype=np.float32).dtype == np.float32
    assert poses.names == cart.frames
    assert len(poses) == 3
    with pytest.raises(UnknownNameError, match="wheel"):
        poses["wheels"]


def test_equality_is_by_value(cart: Robot) -> None:
    same = Robot.from_dict(cart.to_dict())
    assert same == cart
    assert hash(same) == hash(cart)
    assert same is not cart
    assert cart != Robot(cart.name, cart.chains, cart.contacts)
    for twin in (pickle.loads(pickle.dumps(cart)), copy.deepcopy(cart)):
        assert twin == cart
        assert np.array_equal(twin.forward(np.ones(5)).array, cart.forward(np.ones(5)).array)
    # wherever a property of a joint is said, the robot is the same
    there = Robot.from_rows({"a": [Row(theta=Joint("j", rate=1.0)), Row(theta=Joint("j"))]})
    here = Robot.from_rows({"a": [Row(theta=Joint("j")), Row(theta=Joint("j"))]}, joints=[Joint("j", rate=1.0)])
    assert there == here


def test_data_goes_through_json(cart: Robot) -> None:
    half_open = Robot.from_rows({"a": [Row(theta=Joint("j", limits=(0.1, np.inf)))]})
    for robot in (cart, half_open, snake(3, 0.1, "arc", axes="universal", friction=0.2)):
        text = json.dumps(robot.to_dict(), allow_nan=False)
        assert Robot.from_dict(json.loads(text)) == robot


def test_repr(cart: Robot) -> None:
    assert repr(cart) == "Robot('cart': 2 chains, 5 frames, 5 joints (1 passive), 2 contacts, 3 kg)"


def test_a_robot_without_joints() -> None:
    robot = Robot.from_rows({"a": [Row(a=0.5)]})
    assert robot.forward(np.zeros((4, 0)))["a"].shape == (4, 7)
    P, Q = robot.velocity_model([])
    assert (P.shape, Q.shape) == ((6, 6), (6, 0))
    assert robot.vector({}).shape == (0,)
    assert robot.limits.shape == (0, 2)


ROW = Row(a=0.1)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Robot("r", ()), InputError, "at least one chain"),
        (lambda: Robot("", (Chain("a", (ROW,)),)), InputError, "Robot.name"),
        (lambda: Robot("r", (Chain("a", (ROW,)), Chain("a", (ROW,)))), InputError, "two chains are named 'a'"),
        (lambda: Robot("r", (Chain("base", (ROW,)),)), InputError, "reserved"),
        (lambda: Robot.from_rows({"a": [Row(name="world")]}), InputError, "reserved"),
        (lambda: Robot.from_rows({"a": [Row(name="f"), Row(name="f")]}), InputError, "'f' exists already"),
        (lambda: Robot.from_rows({"a": [Row(name="b"), ROW], "b": [ROW]}), InputError, "not its end"),
        (lambda: Robot.from_rows({"a": [ROW]}, parents={"a": "b.1"}), UnknownNameError, "earlier chain"),
        (
            lambda: Robot.from_rows({"a": [ROW], "b": [ROW]}, parents={"a": "b.1"}),
            UnknownNameError,
            "unknown frame 'b.1'",
        ),
        (lambda: Robot.from_rows({"a": [ROW]}, parents={"c": "base"}), UnknownNameError, "unknown chain 'c'"),
        (lambda: Robot.from_rows({"a": []}), InputError, "no rows"),
        (lambda: Robot.from_rows({"a": [1]}), InputError, "element 1"),
        (lambda: Robot.from_rows({"a": ROW}), InputError, "sequence"),
        (lambda: Robot.from_rows([ROW]), InputError, "mapping"),
        (
            lambda: Robot.from_rows({"a": [ROW]}, contacts=[Contact("c", "b", "sphere", 0.1)]),
            UnknownNameError,
            "unknown frame 'b'",
        ),
        (
            lambda: Robot.from_rows({"a": [ROW]}, contacts=[Contact("c", "a.1", "sphere", 0.1)] * 2),
            InputError,
            "two contacts",
        ),
        (lambda: Robot.from_rows({"a": [Row(theta=Joint("j"), d=Joint("j"))]}), InputError, "angle"),
        (
            lambda: Robot.from_rows({"a": [Row(theta=Joint("j", rate=1.0)), Row(theta=Joint("j", rate=2.0))]}),
            InputError,
            "rate",
        ),
        (lambda: Robot.from_rows({"a": [Row(theta=Joint("j"))]}, joints=["k"]), UnknownNameError, "unknown joint 'j'"),
        (
            lambda: Robot.from_rows({"a": [Row(theta=Joint("j"))]}, joints=["j", "k"]),
            InputError,
            "'k' drives nothing",
        ),
        (lambda: Robot.from_rows({"a": [Row(theta=Joint("j"))]}, joints=["j", "j"]), InputError, "twice"),
        (
            lambda: Robot.from_rows({"a": [Row(theta=Joint("j", rate=1.0))]}, joints=[Joint("j", rate=2.0)]),
            InputError,
            "rate",
        ),
        (lambda: Row(theta=np.nan), InputError, "theta"),
        (lambda: Arc(-1.0), InputError, "length"),
        (lambda: Row(theta=WheelRadius(Joint("j"), 0.1)), InputError, "wheel radius"),
        (lambda: Joint("j", limits=(1.0, -1.0)), InputError, "low < high"),
        (lambda: Joint("j", limits=("a", "b")), InputError, "low < high"),
        (lambda: Joint("j", scale=0.0), InputError, "drive nothing"),
        (lambda: Robot.from_rows({"a": [ROW]}, base_body=3.0), InputError, "base_body"),
        (lambda: Robot.from_dict({"name": "r"}), InputError, "chains: expected a list"),
        (lambda: Robot.from_dict({"chain": []}), UnknownNameError, "unknown field 'chain'"),
        (
            lambda: Robot.from_dict({"chains": [{"name": "a", "elements": [{"thetta": 1.0}]}]}),
            UnknownNameError,
            r"chains\[0\].elements\[0\]: unknown field 'thetta'",
        ),
    ],
)
def test_refusals(make, error, message) -> None:
    with pytest.raises(error, match=message):
        make()


def test_declared_wheel_limits_replace_the_default() -> None:
    rows = {"a": [Row(d=WheelRadius(Joint("q"), 0.2))]}
    assert np.array_equal(Robot.from_rows(rows).limits, [[0.0, np.pi]])
    robot = Robot.from_rows(rows, joints=[Joint("q", limits=(0.5, 2.5))])
    assert np.array_equal(robot.limits, [[0.5, 2.5]])
    assert Robot.from_dict(robot.to_dict()) == robot


# --- snakes -------------------------------------------------------------------------------------------------


def test_straight_snake() -> None:
    robot = snake(4, 0.1)
    assert robot.joints == ("yaw1", "yaw2", "yaw3")
    assert robot.frames == ("base", "link1", "link2", "link3", "link4")
    angles = np.array([0.3, -0.5, 0.9])
    heading = np.concatenate([[0.0], np.cumsum(angles)])
    tips = np.cumsum(0.1 * np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=1), axis=0)
    assert np.abs(robot.forward(angles).positions[1:] - tips).max() < 1e-15
    assert [c.name for c in robot.contacts] == ["link1", "link2", "link3", "link4"]
    assert np.array_equal(robot.contacts[1].points(), [[-0.1, 0, 0], [0, 0, 0]])
    # 26 links of 50 mm and radius 15 mm at the density of water
    assert snake(26, 0.05).mass == pytest.approx(26 * 1000 * np.pi * 0.015**2 * (0.05 + 0.02), rel=1e-12)
    assert snake(26, 0.05, mass=0.05).mass == pytest.approx(1.3, rel=1e-12)


def test_unequal_links() -> None:
    robot = snake(3, [0.1, 0.2, 0.3])
    assert np.allclose(robot.forward(np.zeros(2)).positions[:, 0], [0, 0.1, 0.3, 0.6], rtol=0, atol=1e-15)
    assert robot.contacts[0].radius == pytest.approx(0.06)


@pytest.mark.parametrize("axes", ["yaw", "pitch", "alternating", "universal"])
@pytest.mark.parametrize("joint", ["straight", "arc"])
def test_axes(joint: str, axes: str) -> None:
    robot = snake(5, 0.1, joint, axes=axes, limits=(-1, 1), rate=3.0, effort=1.0)
    bends = 5 if joint == "arc" else 4
    want = {
        "yaw": [f"yaw{i}" for i in range(1, bends + 1)],
        "pitch": [f"pitch{i}" for i in range(1, bends + 1)],
        "alternating": [("yaw" if i % 2 else "pitch") + str(i) for i in range(1, bends + 1)],
        "universal": [f"{a}{i}" for i in range(1, bends + 1) for a in ("yaw", "pitch")],
    }[axes]
    assert sorted(robot.joints) == sorted(want)
    if joint == "straight":
        assert list(robot.joints) == want
    assert np.array_equal(robot.limits, np.tile([-1.0, 1.0], (robot.n, 1)))
    # upright and straight at rest
    rest = robot.forward(np.zeros(robot.n))
    for i in range(1, 6):
        frame = robot.frame_index(f"link{i}")
        assert np.abs(rest.rotations[frame] - np.eye(3)).max() < 1e-15
        assert np.abs(rest.positions[frame] - [0.1 * i, 0, 0]).max() < 1e-15
    # a positive yaw turns the head left, a positive pitch takes it down
    for name in robot.joints:
        q = np.zeros(robot.n)
        q[robot.joint_index(name)] = 0.2
        head = robot.forward(q)["link5"][:3]
        assert head[1] > 1e-3 if name.startswith("yaw") else head[2] < -1e-3
        assert abs(head[2] if name.startswith("yaw") else head[1]) < 1e-15


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"links": 0}, "links"),
        ({"links": 2.5}, "links"),
        ({"link_length": -0.1}, "link_length"),
        ({"link_length": [0.1, 0.2]}, "link_length"),
        ({"joint": "triple"}, "Valid names: arc, double, straight"),
        ({"axes": "roll"}, "alternating, pitch, universal, yaw"),
        ({"radius": 0.0}, "radius"),
        ({"mass": -1.0}, "mass"),
        ({"rate": np.nan}, "rate"),
        ({"friction": -0.1}, "friction"),
    ],
)
def test_snake_refuses(arguments, message) -> None:
    with pytest.raises(InputError, match=message):
        snake(**{"links": 3, "link_length": 0.1, **arguments})
