"""Robots on wheels of adjustable radius: places, radius law, joints, contacts, refusals."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.robot.rims import contact_radii, contacts_at

COS_30 = math.cos(math.radians(30))


def at(robot: bp.Robot, **values: float) -> dict[str, float]:
    """Joint values by the last word of their names, 0 where not given."""
    return {name: values.get(name.rpartition(".")[2], 0.0) for name in robot.joints}


def test_the_wheels_of_the_paper_are_at_its_half_lengths() -> None:
    """Eq. (8): (L_x, L_y, 0), (L_x, -L_y, 0), (-L_x, 0, 0); the hull is 2 L_x by 2 L_y."""
    robot = bp.tri_wheel(half_length=0.5, half_width=0.4)
    assert [chain.name for chain in robot.chains] == ["fl", "fr", "r", "fl.wheel", "fr.wheel", "r.wheel"]
    poses = robot.forward(at(robot))
    for wheel, place in {"fl": (0.5, 0.4, 0.0), "fr": (0.5, -0.4, 0.0), "r": (-0.5, 0.0, 0.0)}.items():
        np.testing.assert_allclose(poses[f"{wheel}.axle"][:3], place, atol=1e-15)
        np.testing.assert_allclose(poses[f"{wheel}.hub"][:3], place, atol=1e-15)
    hull = next(contact for contact in robot.contacts if contact.name == "body")
    assert hull.half == pytest.approx((0.5, 0.4, 0.01))


@given(phi=st.floats(-math.pi, math.pi), q=st.floats(0.0, math.pi), spin=st.floats(-30.0, 30.0))
def test_the_contact_point_is_a_radius_from_the_axle_at_its_angle(phi: float, q: float, spin: float) -> None:
    """u = sin(phi) x - cos(phi) z and eq. (1), whatever the wheel has turned."""
    robot = bp.tri_wheel(link=0.25, rubber=0.03)
    poses = robot.forward(at(robot, contact=phi, adjust=q, spin=spin))
    radius = 0.25 * math.cos(q / 2.0) * COS_30 + 0.03
    u = np.array([math.sin(phi), 0.0, -math.cos(phi)])
    for wheel in ("fl", "fr", "r"):
        np.testing.assert_allclose(poses[wheel][:3] - poses[f"{wheel}.axle"][:3], radius * u, atol=1e-14)


def test_positive_spin_rolls_forward() -> None:
    robot = bp.tri_wheel()
    lowest = robot.forward(at(robot))["fl.hub"]
    J = robot.jacobian(at(robot), "fl.hub", reference="world")[:, robot.joint_index("fl.spin")]
    below = np.array([0.0, 0.0, -0.2])
    np.testing.assert_allclose(J[:3] + np.cross(J[3:], below), [-0.2, 0.0, 0.0], atol=1e-15)  # back under the hub
    assert lowest[2] == 0.0


def test_rims_follow_their_joints() -> None:
    robot = bp.tri_wheel()
    q = robot.vector(at(robot))
    q[robot.joint_index("fr.adjust")] = math.pi
    radii = dict(zip([c.name for c in robot.contacts], contact_radii(robot, q), strict=True))
    assert radii["fl.rim"] == pytest.approx(0.3 * COS_30 + 0.02, abs=1e-15)
    assert radii["fr.rim"] == pytest.approx(0.02, abs=1e-15)
    sized = {contact.name: contact for contact in contacts_at(robot, q)}
    assert sized["fr.rim"].radius == pytest.approx(0.02, abs=1e-15) and sized["fr.rim"].drive is None
    assert {c.name: c.radius for c in robot.contacts if c.shape == "rim"} == pytest.approx(
        dict.fromkeys(("fl.rim", "fr.rim", "r.rim"), 0.3 * COS_30 + 0.02)
    )


@given(q=st.floats(0.0, math.pi))
def test_slope_of_the_radius_law(q: float) -> None:
    law = bp.WheelRadius(bp.Joint("q"), 0.3, 0.02)
    h = 1e-6
    assert law.slope(q) == pytest.approx((law.radius(q + h) - law.radius(q - h)) / (2 * h), abs=1e-9)


def test_mass_and_limits() -> None:
    robot = bp.tri_wheel(wheel_mass=0.5, com=(0.1, 0.0, 0.05), rate=2.0, effort=8.0, spin_effort=3.0)
    assert robot.mass == pytest.approx(10.0)
    assert robot.base_body is not None and robot.base_body.mass == pytest.approx(8.5)
    for wheel in ("fl", "fr", "r"):
        adjust, spin = robot.joint_index(f"{wheel}.adjust"), robot.joint_index(f"{wheel}.spin")
        assert robot.limits[adjust] == pytest.approx((0.0, math.pi))
        assert robot.rates[adjust] == 2.0 and robot.efforts[adjust] == 8.0 and robot.efforts[spin] == 3.0
        assert np.isinf(robot.limits[spin]).all()
        assert not robot.actuated[robot.joint_index(f"{wheel}.contact")]
    lumped = bp.tri_wheel()
    assert lumped.base_body == bp.Body(
        mass=10.0, com=(0.0, 0.0, 0.0), inertia=lumped.base_body.inertia if lumped.base_body else None
    )


def test_any_number_of_wheels_some_of_fixed_radius() -> None:
    places = {f"w{i}": (0.5 - 0.4 * (i // 2), 0.3 * (1 - 2 * (i % 2)), 0.05) for i in range(6)}
    robot = bp.rover(places, radius={"w4": 0.12, "w5": 0.12}, link=dict.fromkeys(places, 0.2), thickness=0.0)
    assert [contact.name for contact in robot.contacts] == [f"{name}.rim" for name in places]
    assert "w4.adjust" not in robot.joints and "w3.adjust" in robot.joints
    poses = robot.forward(at(robot))
    np.testing.assert_allclose(poses["w5"][:3], [-0.3, -0.3, 0.05 - 0.12], atol=1e-15)
    np.testing.assert_allclose(poses["w0"][:3], [0.5, 0.3, 0.05 - 0.2 * COS_30 - 0.02], atol=1e-15)


def test_a_wheel_may_point_elsewhere() -> None:
    robot = bp.rover({"a": (0.3, 0.0, 0.0, 0.5), "b": (-0.3, 0.1)})
    poses = robot.forward(at(robot, contact=0.5 * math.pi, adjust=math.pi))
    np.testing.assert_allclose(poses["a"][:3], [0.3 + 0.02 * math.cos(0.5), 0.02 * math.sin(0.5), 0.0], atol=1e-15)


def test_round_trips(tmp_path) -> None:  # type: ignore[no-untyped-def]
    for robot in (bp.tri_wheel(limits=(0.1, 3.0)), bp.rover({"a": (1, 1), "b": (-1, 0)}, radius={"a": 0.2})):
        assert bp.Robot.from_dict(robot.to_dict()) == robot
        robot.to_toml(tmp_path / "robot.toml")
        assert bp.Robot.from_toml(tmp_path / "robot.toml") == robot


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: bp.tri_wheel(half_length=0.0), ["half_length", "> 0"]),
        (lambda: bp.tri_wheel(link=-0.3), ["link", "-0.3"]),
        (lambda: bp.tri_wheel(rubber=-0.1), ["rubber", ">= 0"]),
        (lambda: bp.tri_wheel(limits=(0.0, 4.0)), ["limits", "pi"]),
        (lambda: bp.tri_wheel(wheel_mass=4.0), ["wheel_mass", "4.0"]),
        (lambda: bp.tri_wheel(radius={"rear": 0.1}), ["radius", "rear", "fl, fr, r"]),
        (lambda: bp.tri_wheel(link={"fl": 0.3}), ["link", "'fr'"]),
        (lambda: bp.rover({}), ["wheels"]),
        (lambda: bp.rover({"a": (0.0, 0.0)}), ["body"]),
        (lambda: bp.rover({"a": (1.0,)}), ["wheels['a']"]),
        (lambda: bp.rover({"a": (1.0, 0.0), "b": (0, 1)}, body=(0.0, 1.0)), ["body"]),
        (
            lambda: bp.Contact("c", "f", "sphere", 0.1, drive=bp.WheelRadius(bp.Joint("q"), 0.3)),
            ["drive", "rim"],
        ),
        (lambda: bp.Contact("c", "f", "rim", 0.1, drive=bp.WheelRadius(bp.Joint("q"), 0.3)), ["radius", "0.1"]),
        (
            lambda: bp.Robot.from_rows(
                {"f": [bp.Row(a=1.0)]},
                contacts=[bp.Contact("c", "f.1", "rim", drive=bp.WheelRadius(bp.Joint("q"), 0.3))],
            ),
            ["joint", "'q'"],
        ),
    ],
)
def test_refusals(make, words) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(bp.InputError) as raised:
        make()
    for word in words:
        assert word in str(raised.value)
