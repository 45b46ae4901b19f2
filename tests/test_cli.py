"""The command line as a user meets it: help, exit codes, messages, files, and nothing left behind."""

import json
import os
import subprocess
import sys

import jsonschema
import numpy as np
import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.job import WRITTEN
from bodyplan.metrics import Metrics

SMALL = [
    "--set",
    "robot.links=12",
    "--set",
    "gait.body_modules=2",
    "--set",
    "gait.waves=1",
    "--set",
    "gait.omega=1.0",
    "--set",
    "ground.width=0.087",
    "--set",
    "simulate.cycles=1",
    "--set",
    "gait.extension=0.8",
    "--set",
    "gait.max_joint_rate=3.0",
]


def bodyplan(*arguments):
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """One whole small run."""
    out = tmp_path_factory.mktemp("cli") / "run"
    return bodyplan("run", "concertina", "--out", str(out), "--no-compare", *SMALL), out


def test_help_names_the_commands():
    result = bodyplan("--help")
    assert result.exit_code == 0
    assert all(
        name in result.output
        for name in ("run", "check", "export", "fit", "missions", "robots", "bodyplan run concertina")
    )
    for name in ("run", "check", "export", "fit", "missions", "robots"):
        assert bodyplan(name, "--help").exit_code == 0


def test_help_loads_nothing_heavy():
    code = (
        "import sys, bodyplan.cli; print([m for m in ('numpy', 'numba', 'mujoco', 'pydantic', 'pint', 'scipy') "
        "if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_import_loads_nothing_heavy():
    code = (
        "import sys, bodyplan as bp; bp.snake(3, 0.1); bp.Concertina(); bp.Plane(); bp.plan; bp.check; "
        "print([m for m in ('mujoco', 'sympy', 'matplotlib', 'plotly', 'viser', 'scipy.optimize') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


def test_run_writes_a_folder(finished):
    result, out = finished
    assert result.exit_code == 0, result.output
    assert str(out / "report.html") in result.output and "of the planned advance" in result.output
    names = {p.name for p in out.iterdir()}
    assert set(WRITTEN) == names
    assert not [p for p in out.parent.iterdir() if p.name.startswith(".")]
    assert "waves = 1\n" in (out / "mission.toml").read_text()


def test_metrics_follow_their_schema(finished):
    _, out = finished
    metrics = json.loads((out / "metrics.json").read_text())
    jsonschema.validate(metrics, Metrics.model_json_schema())
    assert metrics["verdict"] == "ok" and metrics["trial"]["advance_ratio"] > 0.1
    assert metrics["plan"]["advance_per_cycle"] > 0 and len(metrics["variants"]) == 2
    assert all(check["passed"] for check in metrics["checks"])


def test_robot_xml_loads_by_itself(finished):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(finished[1] / "robot.xml"))
    assert model.nu == 11


def test_existing_output_is_not_overwritten(finished, tmp_path):
    _, out = finished
    before = (out / "metrics.json").read_bytes()
    result = bodyplan("run", "concertina", "--out", str(out), "--no-simulate")
    assert result.exit_code == 2 and "--force" in result.output
    assert (out / "metrics.json").read_bytes() == before
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").write_text("precious")
    result = bodyplan("run", "concertina", "--out", str(tmp_path / "mine"), "--force", "--no-simulate")
    assert result.exit_code == 2 and (tmp_path / "mine" / "thesis.tex").exists()


def test_a_file_in_the_way_is_never_replaced(tmp_path):
    path = tmp_path / "thesis.tex"
    path.write_text("precious")
    for force in ([], ["--force"]):
        result = bodyplan("run", "concertina", "--out", str(path), "--no-simulate", *force)
        assert result.exit_code == 2 and "is a file" in result.output and path.read_text() == "precious"
    result = bodyplan("run", "concertina", "--out", str(path / "x"), "--no-simulate")
    assert result.exit_code == 2 and "cannot be written" in result.output


def test_files_beside_a_run_are_kept(finished):
    _, out = finished
    note = out / "notes.txt"
    note.write_text("precious")
    result = bodyplan("run", "concertina", "--out", str(out), "--no-simulate", "--force")
    note.unlink()
    assert result.exit_code == 2 and "notes.txt" in result.output and (out / "report.html").exists()


def test_the_mission_of_a_run_runs_again(finished):
    _, out = finished
    again = bodyplan("check", str(out / "mission.toml"))
    assert again.exit_code == 0, again.output
    assert "links = 12" in (out / "mission.toml").read_text()


def test_without_physics(tmp_path, monkeypatch):
    from importlib.util import find_spec

    missing = {"mujoco"}
    monkeypatch.setattr("bodyplan.job.find_spec", lambda name: None if name in missing else find_spec(name))
    out = tmp_path / "run"
    result = bodyplan("run", "concertina", "--out", str(out), "--no-simulate", *SMALL)
    assert result.exit_code == 0 and (out / "motion.csv").exists() and not (out / "robot.xml").exists()
    refused = bodyplan("run", "concertina", "--out", str(tmp_path / "other"))
    assert refused.exit_code == 2 and "bodyplan[physics]" in refused.output and "--no-simulate" in refused.output
    missing.add("plotly")
    refused = bodyplan("run", "concertina", "--out", str(tmp_path / "other"), "--no-simulate")
    assert refused.exit_code == 2 and "bodyplan[report]" in refused.output


def test_too_wide_a_corridor_is_a_warning(tmp_path):
    result = bodyplan(
        "run", "concertina", "--no-simulate", "--set", "ground.width=0.17", "--out", str(tmp_path / "run")
    )
    assert result.exit_code == 0 and "does not touch the walls" in result.output


def test_check_and_its_exit_codes(finished, tmp_path):
    _, out = finished
    good = bodyplan("check", str(out / "motion.npz"))
    assert good.exit_code == 0 and "all" in good.output and "passed" in good.output
    bad = bodyplan("check", "concertina", "--set", "robot.rate=0.5")
    assert bad.exit_code == 1 and "FAIL" in bad.output and "joint rates" in bad.output


@pytest.mark.parametrize(
    "arguments,words",
    [
        (["run", "concertin"], ["concertin", "concertina-paper"]),
        (["check", "concertina", "--set", "gait.omga=1"], ["omga", "omega"]),
        (["check", "none.npz"], ["none.npz"]),
        (["export", "concertina", "--to", "urdff"], ["urdff", "csv", "npz", "xml"]),
        (["missions", "concertin"], ["concertina"]),
        (["check", "concertina", "--set", "time.dt=1e-9"], ["time.dt", "samples"]),
        (["check", "concertina", "--set", "robot.mass=9**9**9**9 g"], ["robot.mass", "50 g"]),
        (["check", "concertina", "--set", "simulate.servo=[nan,1]"], ["simulate.servo"]),
        (["check", "concertina", "--set", "simulate.friction=-1"], ["simulate.friction =", "-1"]),
        (["check", "serpentine", "--set", "simulate.friction.sideways=-1"], ["friction.sideways = -1", "equal to 0"]),
        (["check", "serpantine"], ["neither a ready mission nor a file: unknown mission", "Did you mean 'serpentine'"]),
        (["check", "/"], ["folder"]),
        (["check", "x.npz", "--set", "a=1"], ["--set"]),
    ],
)
def test_bad_input_ends_with_two_and_one_message(arguments, words):
    result = bodyplan(*arguments)
    assert result.exit_code == 2 and "Traceback" not in result.output
    assert [w for w in words if w not in result.output] == []


@pytest.mark.parametrize("suffix", ["csv", "npz", "xml"])
def test_export(finished, tmp_path, suffix):
    if suffix == "xml":
        pytest.importorskip("mujoco")
    target = tmp_path / f"m.{suffix}"
    source = str(finished[1] / "motion.npz")
    assert bodyplan("export", source, "--to", suffix, "--out", str(target)).exit_code == 0
    assert target.stat().st_size > 1000
    again = bodyplan("export", source, "--to", suffix, "--out", str(target))
    assert again.exit_code == 2 and "--force" in again.output
    assert bodyplan("export", source, "--to", suffix, "--out", str(target), "--force").exit_code == 0
    assert bodyplan("export", source, "--to", suffix, "--out", str(tmp_path / "m.txt")).exit_code == 2


def test_a_plan_that_is_not_solved_is_exported_with_a_warning(finished, tmp_path):
    motion = bp.load(finished[1] / "motion.npz")
    status = np.array(motion.status)
    status[3:] = "limit"
    motion.replace(status=status).save(tmp_path / "bad.npz")
    made = bodyplan("export", str(tmp_path / "bad.npz"), "--to", "csv", "--out", str(tmp_path / "bad.csv"))
    assert made.exit_code == 0
    assert "warning: this plan is not solved" in made.stderr and "limit" in made.stderr
    assert f"{len(status) - 3} of {len(status)} samples" in made.stderr


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("run conc", {"concertina", "concertina-scales", "concertina-paper", "concertina-literal", "concertina-tuned"}),
        ("missions carry-d", {"carry-dem"}),
        ("export spiral --to m", {"mcap", "mjcf"}),
        ("papers w", {"wheels"}),
        ("doc", {"doctor"}),
    ],
)
def test_the_shell_completes_names(words, completed):
    """As bash asks, once --install-completion was run."""
    line = f"bodyplan {words}"
    asked = {"_BODYPLAN_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(line.split()) - 1)}
    code = "from bodyplan.cli import app; app(prog_name='bodyplan')"
    made = subprocess.run([sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True)
    assert set(made.stdout.split()) == completed


def test_missions_and_robots_are_listed():
    listed = bodyplan("missions")
    assert listed.exit_code == 0 and "concertina-scales" in listed.output and "sinus-lifting" in listed.output
    assert 'kind = "corridor"' in bodyplan("missions", "concertina").output
    assert json.loads(bodyplan("missions", "--schema").output)["kinds"]
    robots = bodyplan("robots")
    assert robots.exit_code == 0 and "snake" in robots.output and "link_length" in robots.output
    assert "acm_l2" in robots.output


def test_version():
    assert bodyplan("--version").output.startswith("bodyplan ")


def test_installed_command_runs():
    env = {**os.environ, "NO_COLOR": "1"}
    out = subprocess.run(
        [sys.executable, "-m", "bodyplan", "missions"], capture_output=True, text=True, env=env, check=True
    )
    assert "concertina" in out.stdout
