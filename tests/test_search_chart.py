"""The example that searches many corridors, with few trials: it goes on, adds corridors, and draws its chart."""

import csv
import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from search_cases import MISSION, cluster_of_processes

pytest.importorskip("mujoco")
pytest.importorskip("distributed")
pytest.importorskip("optuna")
pytest.importorskip("matplotlib")

EXAMPLE = Path(__file__).parents[1] / "examples" / "corridor_chart.py"
SETTINGS = ["--frictions", "1", "--modules", "2", "--trials", "2", "--batch", "2", "--tried", "1"]


@pytest.fixture(scope="module")
def script():
    return runpy.run_path(str(EXAMPLE), run_name="corridor_chart")


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_corridors_are_searched_once_and_added(tmp_path, script, monkeypatch, capsys):
    mission = tmp_path / "m.toml"
    mission.write_text(MISSION)
    sets = ["--mission", str(mission), "--set", "gait.contraction=travelling", "--out", str(tmp_path / "out")]
    with cluster_of_processes(tmp_path, 1) as (address, _):

        def run(*widths, more=()):
            argv = [str(EXAMPLE), "--widths", *widths, *SETTINGS, *sets, "--scheduler", address, *more]
            monkeypatch.setattr(sys, "argv", argv)
            script["main"]()
            capsys.readouterr()
            return {path: path.read_bytes() for path in sorted((tmp_path / "out").rglob("points.jsonl"))}

        points = run("150")
        assert len(points) == 2 and all(content.count(b"\n") > 1 for content in points.values())
        assert run("150") == points
        more = run("20", "150")
        run("150", more=["--frictions", "0.9"])
    assert more == points
    slippery, narrow, found = rows_of(tmp_path / "out" / "corridors.csv")
    # the gait of the other friction is tried in this one
    gait = [word for word in found["sets"].split() if word.startswith("gait.")]
    executed = json.loads((tmp_path / "out" / "width-150-friction-0.9" / "executed.json").read_text())
    (figures,) = [figures for key, figures in executed.items() if key.endswith("friction=0.9 " + " ".join(gait))]
    assert slippery["friction"] == "0.9" and figures["planned_mm_s"] == pytest.approx(float(found["planned_mm_s"]))
    assert "fits" in narrow["note"] and (float(narrow["width_mm"]), float(found["width_mm"])) == (20.0, 150.0)
    assert int(found["trials"]) == 10 and (found["note"] or float(found["advance_ratio"]) >= 0.95)


def test_omega_makes_the_squeeze(script):
    """What the example interpolates is the squeeze that the plan says it has."""
    mission = bp.load_mission("concertina-tuned")
    omegas = script["omegas_for"](script["widths_of"](mission.robot, 8), 100.0)
    for omega, squeeze in zip(omegas, (2.0, 5.5, 8.5, 12.0), strict=True):
        body = bp.Concertina(8, omega=omega).body(mission.robot)
        assert 1e3 * body.width - 100.0 == pytest.approx(squeeze, abs=0.05)
    assert script["omegas_for"](script["widths_of"](mission.robot, 8), 40.0) is None


def test_the_chart_shows_the_table(tmp_path, script):
    rng = np.random.default_rng(0)
    names = ["speed_mm_s", *script["SHOWN"]]
    rows = [
        {"width_mm": w, "friction": f, **dict(zip(names, rng.uniform(1.0, 5.0, 8), strict=True))}
        for w in (100.0, 60.0)
        for f in (1.0, 0.5)
    ]
    rows.append({"width_mm": 80.0, "friction": 0.5, "note": "none"})
    path = tmp_path / "corridors.csv"
    script["write_table"](rows, path)
    assert [(r["friction"], r["width_mm"]) for r in rows_of(path)] == [
        ("0.5", "60"), ("0.5", "80"), ("0.5", "100"), ("1", "60"), ("1", "100")
    ]  # fmt: skip
    assert script["draw"](path) and (tmp_path / "corridors.png").stat().st_size > 10_000
    text = (tmp_path / "corridors.svg").read_text(encoding="utf-8")
    assert "friction 0.5" in text and "friction 1" in text
    path.unlink()
    script["write_table"](rows[-1:], path)
    assert not script["draw"](path)
