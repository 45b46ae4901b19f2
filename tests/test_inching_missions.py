"""The ready missions of inching: the paper's table to its last digit, what physics makes of five anchors, and what a
user sees who asks for what does not fit."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.job import mission_times, plan_mission, simulate_mission
from bodyplan.missions import load_mission
from bodyplan.show import inching as shown
from bodyplan.show.beside import beside
from bodyplan.show.outcome import figures_of
from bodyplan.show.sections import beside_the_paper
from bodyplan.show.text import figure
from report_cases import outcome

NAMES = ("inching", "inching-stairs")


@lru_cache
def planned(name: str) -> bp.Motion:
    return plan_mission(load_mission(name))


@lru_cache
def executed(name: str) -> bp.Trial:
    return simulate_mission(load_mission(name), planned(name))


# --- the paper


def test_the_table_of_the_paper_is_met_to_its_last_digit() -> None:
    mission = load_mission("inching-paper")
    rows = beside(mission.paper, {None: figures_of(planned("inching-paper"), None)})
    assert len(rows) == 21 and {row.unit for row in rows} == {"mm", "deg"}
    for row in rows:
        digits = len(f"{row.printed:.15g}".partition(".")[2])
        assert row.value is not None and abs(row.value - row.printed) <= 0.5001 * 10.0**-digits, row


def test_the_paper_is_printed_as_it_prints() -> None:
    mission = load_mission("inching-paper")
    rows = beside(mission.paper, {None: figures_of(planned("inching-paper"), None)})
    text = beside_the_paper(outcome(None, planned("inching-paper"), paper=rows))
    for row in mission.paper:
        shown_row = f'<td class="n">{figure(row.printed, row.unit, 9)}</td>'
        assert text.count(shown_row) >= 2  # the paper's and ours
    assert "83.107897" in text and "1680" in text and "10³" not in text


def test_the_papers_gait_tips_and_nothing_else_is_wrong() -> None:
    report = bp.check(planned("inching-paper"))
    assert [line.what for line in report.failures] == ["the centre of mass is over the standing anchors"]
    assert report.failures[0].value == pytest.approx(-0.192, abs=1e-6)


# --- five anchors in physics


@pytest.mark.parametrize("name", NAMES)
def test_five_anchors_do_in_physics_what_they_are_planned_to(name: str) -> None:
    motion, trial = planned(name), executed(name)
    assert motion.ok and bp.check(motion).ok, str(bp.check(motion))
    assert trial.ok and trial.warnings == ()
    assert trial.advance_ratio is not None and 0.97 <= trial.advance_ratio <= 1.03
    assert trial.lift_ratio is not None and trial.lift_ratio >= 0.8
    stroke = motion.facts["advance_per_cycle"]
    assert max(abs(slip.along) for slip in trial.slips) <= 0.05 * stroke
    assert motion.facts["support_margin"] > 0.05


def test_the_stairs_are_climbed() -> None:
    motion = planned("inching-stairs")
    ends = motion.robot.forward(motion.q[[0, -1]], motion.base[[0, -1]]).positions
    steps = np.asarray(motion.ground.breaks)
    # the head comes over every step of floor and ceiling
    assert ends[0, -1, 0] < steps.min() and ends[1, -1, 0] > steps.max()
    feet = [i for i, c in enumerate(motion.robot.contacts) if c.shape == "sphere"]
    carries = np.asarray(motion.contacts)[:, feet].any(axis=1)
    assert carries.all()
    z = motion.robot.forward(motion.q, motion.base).positions[..., 2]
    # the level of the foot that stands on each tread: floor and radius of a foot
    for level in (0.0, 0.04, 0.08):
        assert np.abs(z - level - 0.003).min() < 1e-9


# --- what a user asks for


def test_inching_repeats_and_begins_at_rest() -> None:
    mission = load_mission("inching")
    assert mission.simulate is not None and mission.simulate.ramp is None
    assert mission_times(mission)[-1] == pytest.approx(4.0)
    assert executed("inching").settings["ramp"] == 0.0


def test_a_lower_ceiling_makes_shorter_strides() -> None:
    low = plan_mission(load_mission("inching", ["gait.ceiling=120 mm"]))
    assert low.ok and bp.check(low).ok
    assert low.facts["advance_per_cycle"] < 0.5 * planned("inching").facts["advance_per_cycle"]
    # as high as the ceiling allows, at some time
    assert 0.1199 < low.facts["peak_elbow_height"] <= 0.12 + 1e-12


@pytest.mark.parametrize(
    ("item", "words"),
    [
        ("gait.drive=fastst", ["drive", "fastst", "fastest", "periodic", "paper"]),
        ("gait.schedule=twophase", ["schedule", "two-phase"]),
        ("gait.lft=3 mm", ["lft", "lift"]),
        ("gait.anchors=4", ["anchors", "odd"]),
        ("gait.spacing=[0.3, 0.7]", ["spacing", "4"]),
        ("gait.lift=-1 mm", ["lift"]),
        ("gait.ceiling=2 s", ["ceiling", "2 s", "m"]),
        ("robot.foot_radius=3 kg", ["foot_radius", "3 kg"]),
    ],
)
def test_mistakes_are_named(item: str, words: list[str]) -> None:
    with pytest.raises((InputError, UnknownNameError)) as caught:
        load_mission("inching", [item])
    assert all(word in str(caught.value) for word in words) and "--set" in str(caught.value)


def test_too_many_anchors_are_named_with_a_snake_that_would_do() -> None:
    with pytest.raises(InputError, match=r"7 anchors need 13 pitch joints.*bp\.snake\(26"):
        plan_mission(load_mission("inching", ["gait.anchors=7"]))


def test_what_does_not_fit_says_why_on_one_screen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "HEIGHTS", 2)
    where = ["--out", str(tmp_path / "low"), "--no-simulate"]
    ran = CliRunner().invoke(app, ["run", "inching", *where, "--set", "ground.ceiling=30 mm"])
    assert ran.exit_code == 1
    assert "above_ceiling" in ran.output and "Stops at 0 s" in ran.output
    text = (tmp_path / "low" / "report.html").read_text(encoding="utf-8")
    assert "Stops at 0 s" in text[: text.index('id="motion"')]


def test_a_drive_that_does_not_repeat_needs_a_time() -> None:
    uneven = ["gait.schedule=wave", "gait.drive=[0.05, 0.05, 0.05, 0.05, 0.051]", "gait.spacing=0.9"]
    with pytest.raises(InputError, match=r"time\.stop"):
        plan_mission(load_mission("inching", uneven))
    motion = plan_mission(load_mission("inching", [*uneven, "time.stop=6 s"]))
    assert motion.t[-1] == pytest.approx(6.0) and len(motion.stages) >= 6


def test_the_summary_tells_of_tipping_and_lifting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "HEIGHTS", 2)
    ran = CliRunner().invoke(app, ["run", "inching-paper", "--out", str(tmp_path / "paper"), "--no-compare"])
    assert ran.exit_code == 1
    assert "tips forward at 8.98 s" in ran.output and "lifted parts rise to" in ran.output
    assert "m in all" in ran.output
