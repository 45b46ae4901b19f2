"""Robots in files: TOML round trips, CSV tables of the extended D-H parameters, and errors that say where."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot import Arc, Body, Contact, Joint, Robot, Row, WheelRadius, snake
from bodyplan.robot.drive_text import variable

SILO4 = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"
HEAD = "chain,from,to,theta [deg],d [mm],a [mm],epsilon [deg]\n"


def test_silo4_table() -> None:
    robot = Robot.from_table(SILO4)
    assert robot.name == "silo4_legs"
    assert [chain.name for chain in robot.chains] == ["fl", "hl", "hr", "fr"]
    assert (robot.n, int(robot.actuated.sum()), len(robot.frames)) == (24, 12, 29)
    assert robot.joints[:6] == ("fl.shoulder", "fl.hip", "fl.knee", "fl.ankle", "fl.heel", "fl.sole")
    row = robot.chains[0].elements[1]
    assert (row.a, row.epsilon, row.theta.name) == (0.06, np.pi / 2, "fl.shoulder")
    assert np.allclose(robot.limits[0], np.radians([-80, 80]), rtol=1e-15)
    assert robot.rates[0] == pytest.approx(np.pi / 2)
    # shoulders on a 310 mm square, all legs stretched out along its diagonals at rest
    shoulders = robot.forward(np.zeros(24)).positions[[1, 8, 15, 22], :2]
    assert np.abs(shoulders - 0.155 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])).max() < 1e-15
    ends = robot.forward(np.zeros(24)).positions[list(robot.ends), :2]
    out = 0.155 * np.sqrt(2) + 0.06 + 0.24 + 0.24 + 0.02
    assert np.abs(np.linalg.norm(ends, axis=1) - out).max() < 1e-15


def test_table_equals_rows(tmp_path: Path) -> None:
    table = tmp_path / "arm.csv"
    table.write_text(
        "# a comment, then a line without cells\n,,,,,,\n"
        + HEAD
        + "arm,BY,one,j1,100,0,90\n"
        + 'arm,one,two,0.5*j2 - 30 deg,slide + 5,"0.2 m",\n'
        + "hand,one,grip,90 deg - j2,,,-1.5 rad\n"
    )
    want = Robot.from_rows(
        {
            "arm": [
                Row(theta=Joint("j1"), d=0.1, epsilon=np.pi / 2, name="one"),
                Row(theta=Joint("j2", -np.pi / 6, 0.5), d=Joint("slide", 0.005), a=0.2, name="two"),
            ],
            "hand": [Row(theta=Joint("j2", np.pi / 2, -1.0), epsilon=-1.5, name="grip")],
        },
        parents={"hand": "one"},
        name="arm",
    )
    robot = Robot.from_csv(table)
    assert robot.joints == want.joints
    q = np.array([0.3, 0.4, 0.5])
    assert np.abs(robot.forward(q).array - want.forward(q).array).max() < 1e-15


@pytest.mark.parametrize(
    ("lines", "error", "message"),
    [
        ("arm,base,one,j1,0,0,0\narm,two,three,0,0,0,0\n", InputError, r"line 3.*'one'.*'two'"),
        ("arm,elbow,one,j1,0,0,0\n", UnknownNameError, "line 2, column from: unknown frame 'elbow'"),
        ("arm,base,one,j1,0,0\n", InputError, "line 2: 6 cells"),
        ("arm,base,one,j1,0,0,ninety deg\n", InputError, "line 2, column epsilon"),
        ("arm,base,one,j1,0,3 kg,0\n", InputError, "line 2, column a"),
        ("arm,base,one,j1,0,j1,0\n", InputError, "joint 'j1' drives a length here and a angle elsewhere"),
        ("arm,base,one,j1 + j2,0,0,0\n", InputError, "line 2, column theta"),
        ("arm,base,one,0*j1,0,0,0\n", InputError, "line 2, column theta.*scale"),
        ("arm,base,,j1,0,0,0\n", InputError, "line 2, column to"),
        ("arm,base,one,j1,0,0,0\narm,one,one,0,0,0,0\n", InputError, "line 3, column to"),
        ("arm,base,one,nan,0,0,1e999\n", InputError, "line 2, column epsilon"),
        ("", InputError, "no rows"),
        ("arm,base,one,__import__('os'),0,0,0\n", InputError, "line 2, column theta"),
        ("arm,base,one,9**9**9,0,0,0\n", InputError, "line 2, column theta"),
        ('arm,base,"one,j1,0,0,0\n', InputError, "line 2"),
    ],
)
def test_table_errors_say_where(tmp_path: Path, lines: str, error: type, message: str) -> None:
    table = tmp_path / "bad.csv"
    table.write_text(HEAD + lines)
    with pytest.raises(error, match=message) as caught:
        Robot.from_table(table)
    assert str(table) in str(caught.value)


@pytest.mark.parametrize(
    ("header", "cells", "message"),
    [
        ("limit_low,limit_high", "0.5,0.1", "limits"),
        ("passive", "perhaps", "column passive"),
        ("mass", "-1", "mass"),
        ("rate [mm]", "3", "column rate"),
        ("colour", "red", "unknown column 'colour'"),
        ("chain", "x", "two columns"),
    ],
)
def test_optional_columns(tmp_path: Path, header: str, cells: str, message: str) -> None:
    table = tmp_path / "bad.csv"
    table.write_text(f"{HEAD.strip()},{header}\narm,base,one,j1,0,0,0,{cells}\n")
    with pytest.raises(InputError, match=message):
        Robot.from_table(table)
    table.write_text(f"{HEAD.strip()},rate\narm,base,one,0,0,0,0,3\n")
    with pytest.raises(InputError, match="one joint"):
        Robot.from_table(table)
    table.write_text("chain,from,to,theta,d,a\n")
    with pytest.raises(InputError, match="no column epsilon"):
        Robot.from_table(table)


def test_toml_round_trip(tmp_path: Path) -> None:
    odd = Robot.from_rows(
        {
            "leg one": [
                Row(theta=Joint("µ.j-1", 0.1 + 0.2, -1 / 3, limits=(-np.inf, 1e-7)), a=1e22, name="fußspitze"),
                Arc(1 / 3, pitch=Joint("p", rate=0.1, effort=2.5), body=Body(mass=0.1, com=(0.1, 0, 0))),
                Row(d=WheelRadius(Joint("w", actuated=False), 0.3, 0.01)),
            ]
        },
        contacts=[Contact("c", "leg one.3", "capsule", 0.01, end=(0, 0, 1 / 7), friction=0.3)],
        base_body=Body(mass=1 / 3),
        name='quo"te \\ and ü',
    )
    for robot in (odd, Robot.from_table(SILO4), snake(3, 0.1, axes="universal")):
        robot.to_toml(tmp_path / "robot.toml")
        assert Robot.from_toml(tmp_path / "robot.toml") == robot
    assert [p.name for p in tmp_path.iterdir()] == ["robot.toml"]


def test_toml_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "arm.toml"
    file.write_text(
        """
        name = "arm"
        joints = ["j1", { name = "slide", limits = ["0 mm", "80 mm"], rate = "5 mm/s" }]
        [[chains]]
        name = "arm"
        elements = [
            { theta = "j1 + 90 deg", a = "240 mm", body = { mass = "50 g" } },
            { d = { joint = "slide" }, epsilon = "-90 deg" },
            { kind = "arc", length = "3 cm", yaw = "0.5*j1" },
        ]
        [[contacts]]
        name = "tip"
        frame = "arm.3"
        shape = "sphere"
        radius = "5 mm"
        """
    )
    robot = Robot.from_toml(file)
    assert robot.joints == ("j1", "slide")
    assert np.allclose(robot.limits[1], [0.0, 0.08], rtol=1e-15)
    assert robot.rates[1] == pytest.approx(0.005)
    assert robot.elements[0].theta.offset == np.pi / 2
    assert robot.elements[2].yaw.scale == 0.5
    assert robot.mass == 0.05
    assert robot.contacts[0].radius == 0.005


@pytest.mark.parametrize(
    ("text", "error", "message"),
    [
        ("name = 3", InputError, "chains"),
        ("name = \n", InputError, "line 1"),
        ("[[chains]]\nname = 'a'\nelements = [{ theta = 'x y' }]", InputError, r"chains\[0\].elements\[0\].theta"),
        ("[[chains]]\nname = 'a'\nelements = [{ a = '3 s' }]", InputError, r"chains\[0\].elements\[0\].a"),
        ("[[chains]]\nname = 'a'\nelements = [{ kind = 'arc' }]", InputError, "needs its length"),
        ("[[chains]]\nname = 'a'\nelements = [{ kind = 'ark' }]", UnknownNameError, "arc"),
        (
            "[[chains]]\nname = 'a'\nelements = [{}]\n[[contacts]]\nname = 'c'",
            InputError,
            r"contacts\[0\].*frame, shape",
        ),
        ("[[chains]]\nname = 'a'\nelements = [{ a = { joint = 'j', scal = 2 } }]", UnknownNameError, "scale"),
        ("joints = [{ name = 'k' }]\n[[chains]]\nname = 'a'\nelements = [{ a = 'j' }]", UnknownNameError, "'j'"),
        ("[[chains]]\nname = 'a'\nparent = 'b'\nelements = [{}]", UnknownNameError, "unknown frame 'b'"),
    ],
)
def test_toml_errors_say_where(tmp_path: Path, text: str, error: type, message: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(error, match=message) as caught:
        Robot.from_toml(file)
    assert str(file) in str(caught.value)


def test_files_that_are_not_there_or_too_large(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        Robot.from_toml(tmp_path / "none.toml")
    with pytest.raises(InputError, match="cannot be written"):
        snake(2, 0.1).to_toml(tmp_path / "none" / "robot.toml")
    large = tmp_path / "large.csv"
    large.write_bytes(b"#" * 4_000_001)
    with pytest.raises(InputError, match="4 MB"):
        Robot.from_table(large)
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        Robot.from_table(tmp_path / "bytes.csv")


@pytest.mark.parametrize(
    ("text", "offset", "scale"),
    [
        ("knee", 0.0, 1.0),
        ("-knee", 0.0, -1.0),
        ("2*knee", 0.0, 2.0),
        ("knee*0.5 + 1", 1.0, 0.5),
        ("knee/4", 0.0, 0.25),
        ("1 - 2 * knee - 0.25", 0.75, -2.0),
        ("90 deg - fl.knee-1", np.pi / 2, -1.0),
        ("-0.5*knee + -1e-3", -0.001, -0.5),
    ],
)
def test_drives_as_text(text: str, offset: float, scale: float) -> None:
    drive = variable(text, "angle", "here")
    assert isinstance(drive, Joint)
    assert drive.name in ("knee", "fl.knee-1")
    assert (drive.offset, drive.scale) == (pytest.approx(offset, abs=1e-15), scale)


def test_constants_as_text() -> None:
    assert variable("0.25", "length", "here") == 0.25
    assert variable("25 mm", "length", "here") == 0.025
    assert variable("25", "length", "here", "mm") == 0.025
    assert variable("10 mm + 1 cm - 0.005", "length", "here") == pytest.approx(0.015, rel=1e-15)
    for bad in ("", "knee/0", "knee knee", "2 knee", "knee**2", "sin(knee)", "3 kg", "x" * 300, True, None, [1]):
        with pytest.raises(InputError, match="here"):
            variable(bad, "length", "here")
