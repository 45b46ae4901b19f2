"""Ready walking robots: where the legs are, which way their joints turn, their masses and options."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.missions.schema import ROBOTS, options_model
from bodyplan.robot.masses import center_of_mass

SILO4 = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"
LEGS = ("fl", "fr", "hl", "hr")


def spread(robot: bp.Robot, shoulder: float, hip: float, knee: float) -> np.ndarray:
    """The same angles, deg, for every leg; passive joints 0."""
    values = {"shoulder": shoulder, "hip": hip, "knee": knee}
    return np.radians([values.get(name.split(".")[-1], 0.0) for name in robot.joints])


def test_silo4_is_a_square_of_four_legs() -> None:
    robot = bp.silo4()
    assert [chain.name for chain in robot.chains] == list(LEGS)
    assert robot.joints == tuple(f"{leg}.{joint}" for leg in LEGS for joint in ("shoulder", "hip", "knee"))
    poses = robot.forward(np.zeros(12))
    for leg, sx, sy in zip(LEGS, (1, 1, -1, -1), (1, -1, 1, -1), strict=True):
        shoulder, foot = poses[f"{leg}.shoulder"][:3], poses[f"{leg}.foot"][:3]
        assert np.abs(shoulder - [0.155 * sx, 0.155 * sy, 0.0]).max() < 1e-16
        # stretched out level along the diagonal: 60 + 240 + 240 mm
        assert np.abs(foot - shoulder - 0.54 / np.sqrt(2) * np.array([sx, sy, 0.0])).max() < 1e-15
        assert np.array_equal(poses[leg], poses[f"{leg}.foot"])
    assert [(c.name, c.frame, c.shape, c.radius) for c in robot.contacts] == [
        (f"{leg}.foot", f"{leg}.foot", "sphere", 0.01) for leg in LEGS
    ]


def test_joints_turn_the_way_they_say() -> None:
    robot = bp.silo4()
    rest = robot.forward(np.zeros(12))
    for leg in LEGS:
        out = rest[f"{leg}.foot"][:2] - rest[f"{leg}.shoulder"][:2]
        left = np.array([-out[1], out[0]])
        k = robot.joint_index(f"{leg}.shoulder")
        turned, raised, bent = (robot.forward(q)[f"{leg}.foot"][:3] for q in 0.2 * np.eye(12)[k : k + 3])
        assert (turned[:2] - rest[f"{leg}.foot"][:2]) @ left > 0.0
        assert raised[2] > 0.05
        assert bent[2] > 0.04
        assert robot.forward(-0.2 * np.eye(12)[k + 2])[f"{leg}.foot"][2] < -0.04


@pytest.mark.parametrize(("hip", "knee", "out", "below"), [(0, -120, 0.18, 0.208), (-14, -130, 0.10, 0.20)])
@pytest.mark.parametrize("make", [bp.silo4, bp.hexapod])
def test_stances_of_the_docstring(make, hip: float, knee: float, out: float, below: float) -> None:
    robot = make()
    q = spread(robot, 0.0, hip, knee)
    assert np.all((robot.limits[:, 0] < q) & (q < robot.limits[:, 1]))
    poses = robot.forward(q)
    for chain in robot.chains:
        reach = poses[f"{chain.name}.foot"][:3] - poses[f"{chain.name}.shoulder"][:3]
        assert np.hypot(*reach[:2]) == pytest.approx(out, abs=2e-3)
        assert -reach[2] == pytest.approx(below, abs=2e-3)


def test_with_passive_feet_it_is_the_table_of_the_paper() -> None:
    """The same robot as examples/silo4_legs.csv, whose rows are those of Table 1."""
    robot, table = bp.silo4(passive=True), bp.Robot.from_table(SILO4)
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 24))
    mine = np.stack([q[:, table.joint_index(name)] for name in robot.joints], axis=-1)
    ours, theirs = robot.forward(mine), table.forward(q)
    for leg in LEGS:
        for name, short in zip(
            ("shoulder", "hip", "knee", "ankle", "heel", "sole", "foot"),
            ("SR", "HP", "KE", "AE", "HL", "SE", "CT"),
            strict=True,
        ):
            assert np.abs(ours[f"{leg}.{name}"] - theirs[f"{leg}.{short}"]).max() < 1e-14
    assert robot.actuated.sum() == 12
    assert all(robot.actuated[i] == (name.split(".")[1] in ("shoulder", "hip", "knee"))
               for i, name in enumerate(robot.joints))  # fmt: skip
    # z of the sole points back up the shank: with d_6 < 0 the contact is below the ankle
    poses = robot.forward(spread(robot, 0, 0, -90))
    assert np.abs(poses["fl.foot"][:3] - poses["fl.ankle"][:3] - [0.0, 0.0, -0.02]).max() < 1e-15
    assert np.abs(poses.rotations[robot.frame_index("fl.sole")][:, 2] - [0.0, 0.0, 1.0]).max() < 1e-15


def test_hexapod() -> None:
    robot = bp.hexapod(body=(0.6, 0.3), waist=0.4, splay=np.radians(20))
    assert [chain.name for chain in robot.chains] == ["l1", "l2", "l3", "r1", "r2", "r3"]
    poses = robot.forward(np.zeros(18))
    for i, (x, y, turn) in enumerate([(0.3, 0.15, 20), (0.0, 0.2, 0), (-0.3, 0.15, -20)], start=1):
        for side, sign in (("l", 1), ("r", -1)):
            shoulder, foot = poses[f"{side}{i}.shoulder"][:3], poses[f"{side}{i}.foot"][:3]
            assert np.abs(shoulder - [x, sign * y, 0.0]).max() < 1e-15
            aim = np.radians(turn)
            assert np.abs(foot - shoulder - 0.54 * np.array([np.sin(aim), sign * np.cos(aim), 0.0])).max() < 1e-15


@pytest.mark.parametrize("count", [3, 5])
def test_any_number_of_legs_at_any_heading(count: int) -> None:
    rng = np.random.default_rng(count)
    mounts = {f"leg{i}": rng.uniform(-3, 3, 3) for i in range(count)}
    robot = bp.walker(mounts, links=(0.05, 0.1, 0.15))
    poses = robot.forward(np.zeros(robot.n))
    for leg, (x, y, heading) in mounts.items():
        foot = np.array([x + 0.3 * np.cos(heading), y + 0.3 * np.sin(heading), 0.0])
        assert np.abs(poses[f"{leg}.shoulder"][:3] - [x, y, 0.0]).max() < 1e-14
        assert np.abs(poses[f"{leg}.foot"][:3] - foot).max() < 1e-14


@pytest.mark.parametrize("passive", [False, True])
@pytest.mark.parametrize("make", [bp.silo4, bp.hexapod])
def test_masses(make, passive: bool) -> None:
    robot = make(passive=passive)
    assert robot.mass == pytest.approx(30.0, rel=1e-14)
    assert make(passive=passive, mass=7.0).mass == pytest.approx(7.0, rel=1e-14)
    assert robot.base_body is not None
    assert robot.base_body.mass == pytest.approx(0.68 * 30)
    # a symmetric robot has its centre of mass above the middle of its body
    centre = center_of_mass(robot, spread(robot, 0.0, 0.0, -120.0))
    assert np.abs(centre[:2]).max() < 1e-15
    assert -0.1 < centre[2] < 0.0


def test_options_reach_the_joints() -> None:
    robot = bp.silo4(rate=(1.0, 2.0, 3.0), effort=50.0, limits=((-1, 1), (-0.5, 1.5), (-2, 0)), friction=0.8)
    assert robot.rates.tolist() == [1.0, 2.0, 3.0] * 4
    assert robot.efforts.tolist() == [50.0] * 12
    assert robot.limits[:3].tolist() == [[-1, 1], [-0.5, 1.5], [-2, 0]]
    assert {contact.friction for contact in robot.contacts} == {0.8}
    assert np.isinf(bp.silo4(rate=None).rates).all()
    assert bp.silo4(limits=(-1, 1)).limits.tolist() == [[-1, 1]] * 12


@pytest.mark.parametrize("passive", [False, True])
def test_shell(passive: bool) -> None:
    """Body and links as shapes; the ball of a foot stays the lowest point of its leg in every stance."""
    robot = bp.silo4(shell=True, passive=passive)
    assert len(robot.contacts) == 4 + 1 + 12
    assert robot.mass == pytest.approx(30.0)
    rng = np.random.default_rng(3)
    for _ in range(30):
        q = spread(robot, 0, rng.uniform(-30, 40), rng.uniform(-150, -60))
        poses = robot.forward(q)
        lowest = {
            c.name: min((poses.rotations[robot.frame_index(c.frame)] @ p + poses[c.frame][:3])[2] for p in c.points())
            - c.radius
            for c in robot.contacts
        }
        if poses["fl.foot"][2] < poses["fl.knee"][2] - 0.05:
            assert lowest["fl.foot"] < min(lowest["fl.shin"], lowest["fl.thigh"]) - 0.5e-3


@pytest.mark.parametrize("kind", ["silo4", "hexapod", "walker"])
def test_missions_can_name_them(kind: str) -> None:
    builder, units = ROBOTS[kind]
    options = {"links": ["50 mm", 0.2, "20 cm"], "rate": "45 deg/s", "limits": ["-80 deg", "80 deg"], "mass": "12 kg"}
    if kind == "walker":
        options["mounts"] = {"a": [0.1, 0.1, 0.8], "b": [-0.1, 0.1, 2.4], "c": [0.0, -0.1, -1.6]}
    robot = builder(**options_model(kind, builder, units).model_validate(options).model_dump())
    assert robot.mass == pytest.approx(12.0)
    assert robot.rates[0] == pytest.approx(np.pi / 4)
    assert robot.chains[0].elements[2].a == 0.2
    assert robot.from_dict(robot.to_dict()) == robot


@pytest.mark.parametrize(
    ("make", "options", "says"),
    [
        (bp.silo4, {"links": (0.1, 0.2)}, r"links.*\(3\)"),
        (bp.silo4, {"links": (0.1, 0.2, 0.0)}, "links.*> 0"),
        (bp.silo4, {"body": -1.0}, "body"),
        (bp.silo4, {"body": (1.0, 2.0, 3.0)}, "body"),
        (bp.silo4, {"mass": 0.0}, "mass"),
        (bp.silo4, {"foot_radius": 0.0}, "foot_radius"),
        (bp.silo4, {"sole": 0.02}, "sole.*passive"),
        (bp.silo4, {"sole": -0.02, "passive": True}, "sole"),
        (bp.silo4, {"limits": (1.0, 2.0, 3.0)}, "limits"),
        (bp.silo4, {"limits": (1.0, -1.0)}, "limits.*low < high"),
        (bp.silo4, {"rate": (1.0, 2.0)}, "rate.*shoulder, hip, knee"),
        (bp.silo4, {"effort": -1.0}, "effort"),
        (bp.silo4, {"friction": -0.1}, "friction"),
        (bp.hexapod, {"waist": 0.0}, "waist"),
        (bp.hexapod, {"splay": 2.0}, "splay"),
        (bp.walker, {"mounts": {}}, "mounts"),
        (bp.walker, {"mounts": {"a": (0.1, 0.2)}}, r"mounts\['a'\]"),
        (bp.walker, {"mounts": {"a": (0.1, 0.2, 0.0)}}, "body.*rectangle"),
        (bp.walker, {"mounts": {"base": (0, 0, 0), "b": (1, 1, 0)}}, "reserved"),
    ],
)
def test_refusals(make, options: dict, says: str) -> None:
    with pytest.raises(bp.InputError, match=says):
        make(**options)
