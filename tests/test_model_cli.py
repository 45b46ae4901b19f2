"""`bodyplan model`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.missions.robot_input import load_robot
from bodyplan.robot import Arc, Joint, Robot, Row, WheelRadius
from bodyplan.robot.drive_text import variable
from bodyplan.robot.summary import summary, variable_text
from c_cases import Compiled

SILO4 = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")


def model(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["model", *arguments])


def test_prints_chains_rows_joints_and_mass() -> None:
    result = model(str(SILO4))
    assert result.exit_code == 0
    lines = [line.split() for line in result.output.splitlines()]
    assert "4 chains, 29 frames, 24 joints (12 passive), 0 contacts, 14 kg; P (24, 6), Q (24, 24)" in result.output
    assert ["fl", "base", "fl.CT", "7"] in lines
    assert ["fl", "fl.SR", "fl.HP", "fl.shoulder", "0", "60", "mm", "90", "deg", "1.2", "kg"] in lines
    assert ["2", "fl.knee", "-150", "deg", "0", "90", "deg/s"] in lines
    assert ["3", "fl.ankle", "passive"] in lines
    assert not list(Path.cwd().iterdir())


def test_writes_formulas_and_c_that_compile() -> None:
    result = model(str(SILO4), "--symbolic", "--c", "out")
    assert result.exit_code == 0
    names = [f"silo4_legs.{suffix}" for suffix in ("c", "h", "py", "tex")]
    assert sorted(path.name for path in Path("out").iterdir()) == names
    for name in names:
        assert f"out/{name}" in result.output
    robot, q = Robot.from_table(SILO4), np.random.default_rng(0).uniform(-1, 1, 24)
    P, Q = robot.velocity_model(q)
    code = "import numpy as np, silo4_legs; np.savez('got.npz', *silo4_legs.velocity_model(np.load('q.npy')))"
    np.save("out/q.npy", q)
    subprocess.run([sys.executable, "-c", code], cwd="out", check=True)
    got = np.load("out/got.npz")
    assert np.abs(got["arr_0"] - P).max() < 1e-14
    assert np.abs(got["arr_1"] - Q).max() < 1e-14
    source = robot.symbolic().c_source("silo4_legs")
    assert Path("out/silo4_legs.c").read_text() == source.source
    assert Path("out/silo4_legs.h").read_text() == source.header
    folder = Path("compiled")
    folder.mkdir()
    assert np.abs(Compiled(source, folder).velocity_model(q, 4)[1] - Q).max() < 1e-14
    assert Path("out/silo4_legs.tex").read_text().startswith(r"\documentclass")


def test_where_files_go() -> None:
    assert model("silo4", "--symbolic").exit_code == 0
    assert sorted(path.name for path in Path("runs/model-silo4").iterdir()) == ["silo4.py", "silo4.tex"]
    assert model("silo4", "--symbolic", "--out", "a/b", "--c", "c").exit_code == 0
    assert sorted(path.name for path in Path("a/b").iterdir()) == ["silo4.py", "silo4.tex"]
    assert sorted(path.name for path in Path("c").iterdir()) == ["silo4.c", "silo4.h"]


def test_nothing_is_overwritten_without_force() -> None:
    Path("out").mkdir()
    Path("out/silo4.c").write_text("mine")
    result = model("silo4", "--symbolic", "--c", "out")
    assert result.exit_code == 2
    assert "silo4.c: exists already" in result.output
    assert [path.name for path in Path("out").iterdir()] == ["silo4.c"]
    assert Path("out/silo4.c").read_text() == "mine"
    assert model("silo4", "--symbolic", "--c", "out", "--force").exit_code == 0
    assert "silo4_velocity_model" in Path("out/silo4.c").read_text()


def test_options_of_a_named_robot() -> None:
    robot = load_robot("silo4", ["mass=12 kg", 'links=["50 mm", 0.2, 0.2]', "passive=true", "body=40 cm"])
    assert robot == bp.silo4(mass=12, links=(0.05, 0.2, 0.2), passive=True, body=0.4)
    assert load_robot("acm-l2") == bp.acm_l2()
    assert "12 kg" in model("silo4", "--set", "mass=12 kg").output


def test_toml_robots() -> None:
    bp.hexapod().to_toml("six.toml")
    assert load_robot("six.toml") == bp.hexapod()
    assert "18 joints" in model("six.toml").output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["silo"], "Did you mean 'silo4'"),
        (["nowhere.csv"], "no such file"),
        (["folder.csv"], "is a folder"),
        (["snake"], "needs links, link_length"),
        (["silo4", "--set", "mas=3"], "Did you mean 'mass'"),
        (["silo4", "--set", "mass=3 m"], "is not a mass"),
        (["silo4", "--set", "mass"], "field=value"),
        (["silo4", "--set", "mass=-1"], "mass: must be a finite number > 0"),
        (["here.csv", "--set", "mass=1"], "from a file has no options"),
        (["silo4", "--out", "x"], "--symbolic"),
        (["silo4", "--c", "here.csv"], "cannot be a folder"),
        (["bad.csv"], "line 2"),
    ],
)
def test_refusals(arguments: list[str], says: str) -> None:
    Path("folder.csv").mkdir()
    Path("here.csv").write_text(SILO4.read_text())
    Path("bad.csv").write_text("chain,from,to,theta,d,a,epsilon\nleg,base,foot,knee + + 3,0,0,0\n")
    before = sorted(Path.cwd().iterdir())
    result = model(*arguments)
    assert result.exit_code == 2
    assert says in result.output
    assert sorted(Path.cwd().iterdir()) == before


def test_load_robot_raises() -> None:
    with pytest.raises(UnknownNameError, match="silo4"):
        load_robot("silo")
    with pytest.raises(InputError, match="needs"):
        load_robot("snake", ["links=3"])


def test_help_mentions_model() -> None:
    assert "model" in CliRunner().invoke(app, ["--help"]).output
    assert "--symbolic" in CliRunner().invoke(app, ["model", "--help"], env={"TERM": "dumb"}).output


@pytest.mark.parametrize("angle", [True, False])
def test_variables_are_written_as_tables_read_them(angle: bool) -> None:
    rng = np.random.default_rng(1)
    for offset in (0.0, 0.3, -0.2):
        for scale in (1.0, -1.0, 0.5, -2.0):
            text = variable_text(Joint("fl.knee", offset, scale), angle)
            back = variable(text, "angle" if angle else "length", "test")
            assert isinstance(back, Joint)
            assert (back.name, back.scale) == ("fl.knee", scale)
            assert back.offset == pytest.approx(offset, rel=1e-5)
        value = rng.uniform(-1, 1)
        assert variable(variable_text(value, angle), "angle" if angle else "length", "test") == pytest.approx(
            value, rel=1e-5
        )


def test_summary_of_arcs_and_wheels() -> None:
    rows = [
        Arc(0.2, Joint("p"), 0.5),
        Row(d=WheelRadius(Joint("w"), 0.1, 0.01)),
        Row(a=Joint("s", limits=(-np.inf, 0.3))),
    ]
    head, tables = summary(Robot.from_rows({"arm": rows}, name="odd"))
    assert head.startswith("odd: 1 chain, 4 frames, 3 joints, 0 contacts, 0 kg")
    cells = {title: rows for title, _, rows in tables}
    assert cells["Rows"][0][3:6] == ["pitch p", "yaw 28.6479 deg", "arc of 200 mm"]
    assert cells["Rows"][1][4] == "100 mm*cos(30 deg)*cos(w/2) + 10 mm"
    assert cells["Joints"][2][:4] == ["2", "s", "", "300 mm"]
