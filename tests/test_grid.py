"""A mission at several values of a field, and its figures beside a paper's: what is run, said, written and refused."""

import dataclasses
import json
import os
import re
import signal

import numpy as np
import pytest

import bodyplan as bp
from bodyplan import job
from bodyplan.metrics import Metrics, metrics_of
from bodyplan.missions import load_mission, parse_mission
from bodyplan.missions.files import alone
from bodyplan.show.beside import Beside, beside, check_unit, metrics_in, scale_of, trial_names
from bodyplan.show.dimensions import si_unit
from bodyplan.show.grids import grid_plot, grid_section, in_words
from bodyplan.show.outcome import Grid, GridPoint
from bodyplan.show.sections import comparison
from mission_cases import MISSION

GRID = """[grid]
key = "simulate.friction"
values = [0.05, 0.3]
label = "friction"
"""
PAPER = """[[paper]]
what = "speed"
printed = 55
unit = "mm/s"
ours = "trial.speed_m_s"
source = "page 7"
[[paper]]
what = "gain"
printed = 1.36
ours = "trial.speed_m_s / plan.speed"
"""


def parse(text, *overrides):
    return parse_mission(text, "m", "m.toml", None, overrides)


@pytest.fixture(scope="module")
def worked():
    """The small mission with its grid and its table, and what was said of the progress."""
    pytest.importorskip("mujoco")
    said = []
    outcome = job.work(parse(MISSION + GRID + PAPER), progress=lambda step, part: said.append((step, part)))
    return outcome, said


# --- the grid


def test_points_of_the_physics_share_a_plan_until_a_file_of_the_mission_changes(tmp_path):
    """The text says the same, what is planned does not."""
    file = tmp_path / "robot.toml"
    snake = 'kind = "snake"\nlinks = 8\nlink_length = "100 mm"'
    assert snake in MISSION
    text = MISSION.replace(snake, f'kind = "file"\npath = "{file.as_posix()}"')
    for links in (8, 10):
        bp.snake(links, 0.1).to_toml(file)
        one, other = (job._plan_of(alone(text, "m", (f"simulate.friction={mu}",))) for mu in (0.1, 0.2))
        assert one is other and one.robot.n == links - 1
        assert one == job.plan_mission(alone(text, "m"))


def test_every_point_is_what_the_mission_gives_alone(worked):
    outcome, said = worked
    assert [(p.mission, p.value, p.status) for p in outcome.grid.points] == [("m", 0.05, "ok"), ("m", 0.3, "ok")]
    for point in outcome.grid.points:
        mission = parse(MISSION, f"simulate.friction={point.value}")
        motion = job.plan_mission(mission)
        trial = job.simulate_mission(mission, motion)
        assert point.advance_ratio == trial.advance_ratio and point.speed == trial.speed
        assert point.peak_torque == trial.peak_torque and point.cost_of_transport == trial.cost_of_transport
    assert outcome.grid.points[0].advance_ratio != outcome.grid.points[1].advance_ratio
    assert [part for step, part in said if step == "grid"] == [0.0, 0.5]


def test_metrics_and_page_have_the_grid(worked):
    outcome, _ = worked
    metrics = json.loads(json.dumps(metrics_of(outcome).model_dump(), allow_nan=False))
    assert metrics["grid"]["key"] == "simulate.friction" and metrics["grid"]["values"] == [0.05, 0.3]
    assert metrics["grid"]["points"][1]["speed"] == outcome.grid.points[1].speed
    Metrics.model_validate(metrics)
    text = grid_section(outcome.grid, "m").replace("\u00a0", " ")
    for point in outcome.grid.points:
        assert f"{100 * point.advance_ratio:#.3g} %" in text and f"{point.peak_torque:.3g} N m" in text
    assert "Over friction" in text
    (line,) = grid_plot(outcome.grid)["data"]
    np.testing.assert_allclose(line["x"], [0.05, 0.3])
    np.testing.assert_allclose(line["y"], [p.advance_ratio for p in outcome.grid.points], rtol=1e-4)


def test_no_compare_skips_the_grid():
    outcome = job.work(parse(MISSION + GRID), simulate=False)
    assert outcome.grid is None and grid_section(outcome.grid, "m") == ""
    pytest.importorskip("mujoco")
    assert job.work(parse(MISSION + GRID), compare=False).grid is None


def test_a_point_that_fails_is_a_row_with_its_reason():
    pytest.importorskip("mujoco")
    # half waves much shorter than a link: nothing can follow, but nothing is raised
    tight = job.grid_point(MISSION, "m", "gait.omega", 40.0)
    assert tight.status != "ok" and tight.reason and tight.advance_ratio is None
    refused = job.grid_point(MISSION, "m", "gait.gamma_max", 5.0)
    assert refused.status == "refused" and "gamma_max" in refused.reason
    grid = Grid("gait.omega", "omega", (1.2, 40.0), ("m",), (GridPoint("m", 1.2, "ok", "", 0.5), tight))
    assert "1 of 2 runs have no figures" in " ".join(in_words(grid, "m"))
    text = grid_section(grid, "m")
    assert tight.status in text and not re.search(r"\b(nan|None)\b", text)


def killed(*arguments):
    """What a worker does that the system stops."""
    os.kill(os.getpid(), signal.SIGKILL)


def test_workers_that_the_system_stops_are_rows_with_their_reason(monkeypatch):
    """Their processes are killed: what this process works out itself is there, the rest says why it is not."""
    pytest.importorskip("mujoco")
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setattr(job, "compare_mission", killed)
    monkeypatch.setattr(job, "grid_point", killed)
    text = MISSION.replace('title = "t"', 'title = "t"\ncompare = ["concertina-paper"]')
    outcome = job.work(parse(text + GRID + PAPER.replace("/ plan.speed", "/ concertina-paper:trial.speed_m_s")))
    assert outcome.trial.ok
    (other,) = outcome.others
    assert (other.name, other.status, other.ratio) == ("concertina-paper", "lost", None) and "memory" in other.reason
    assert other.title == load_mission("concertina-paper").title
    assert [(p.value, p.status) for p in outcome.grid.points] == [(0.05, "lost"), (0.3, "lost")]
    assert outcome.paper[0].value is not None and outcome.paper[1].value is None
    assert "memory" in comparison(outcome) and "memory" in grid_section(outcome.grid, "m")
    Metrics.model_validate(json.loads(json.dumps(metrics_of(outcome).model_dump(), allow_nan=False)))


def test_other_missions_run_beside_this_one():
    text = MISSION + GRID + 'missions = ["concertina-scales"]\n'
    scaly = MISSION + "friction = { forward = 0.1, backward = 0.1, sideways = 0.3 }\n"
    sideways = GRID.replace('"simulate.friction"', '"simulate.friction.sideways"')
    assert parse(scaly + sideways).grid.key == "simulate.friction.sideways"
    # the skin of the other mission is not scaly, or this one's is not
    lacks = (
        r"m\.toml, line \d+: grid\.key = 'simulate\.friction\.sideways': mission {} has no table simulate\.friction "
    )
    with pytest.raises(
        bp.InputError,
        match=lacks.format("concertina") + r"in which sideways could vary \(simulate\.friction\.forward is m",
    ):
        parse(scaly + sideways + 'missions = ["concertina"]\n')
    with pytest.raises(
        bp.InputError, match=lacks.format("m") + r"in which sideways could vary: simulate\.friction is 0\.2"
    ):
        parse(MISSION + "friction = 0.2\n" + sideways)
    with pytest.raises(bp.InputError, match=lacks.format("m") + r"in which sideways could vary \(simulate"):
        parse(MISSION + sideways)
    cells = job._cells(parse(text))
    assert [(name, value) for _, name, _, value in cells] == [
        ("m", 0.05),
        ("m", 0.3),
        ("concertina-scales", 0.05),
        ("concertina-scales", 0.3),
    ]


def test_words_say_where_it_is_ahead_and_where_not():
    def row(mission, *ratios):
        return [GridPoint(mission, v, "ok", "", r) for v, r in zip((0.2, 0.3, 0.4), ratios, strict=True)]

    points = (*row("lifted", 0.7, 0.8, 0.82), *row("flat", -0.05, 0.799, 0.92))
    grid = Grid("k", "friction sideways", (0.2, 0.3, 0.4), ("lifted", "flat"), points)
    (said,) = in_words(grid, "lifted")
    assert "beside flat and by friction sideways" in said
    assert "more at 0.2 (by 75 points); as much at 0.3; less at 0.4 (by 10 points)" in said
    (alone_said,) = in_words(Grid("k", "mu", (0.2, 0.3, 0.4), ("flat",), tuple(row("flat", -0.05, 0.8, 0.9))), "flat")
    assert "the most of its planned advance, 90.0\u00a0%, at mu = 0.4" in alone_said and "at 0.2" in alone_said


def test_a_mission_alone_has_no_comparisons():
    mission = alone(MISSION + GRID + PAPER, "m", ("gait.omega=1.5",))
    assert mission.grid is None and mission.paper == () and mission.compare == ()
    assert mission.gait.omega == 1.5 and mission.robot == bp.snake(8, 0.1)


@pytest.mark.parametrize(
    "old,new,words",
    [
        ("simulate.friction", "simulate.frction", ["frction", "friction", "servo"]),
        ("simulate.friction", "gait.omga", ["omga", "omega"]),
        ("simulate.friction", "title", ["title", "nothing to vary"]),
        ("0.3]", "-0.3]", ["-0.3", "greater than or equal to 0"]),
        ("0.3]", "nan]", ["finite"]),
        ("[0.05, 0.3]", "[]", ["grid.values", "at least 1"]),
        ("[0.05, 0.3]", str([0.01 * i for i in range(21)]), ["grid.values", "20"]),
        ('label = "friction"', 'missions = ["concertino"]', ["concertino", "concertina-paper"]),
        ('label = "friction"', 'missions = ["a", "b", "c", "d", "e"]', ["grid.missions", "4"]),
        ('label = "friction"', 'labl = "friction"', ["labl", "label", "missions", "values"]),
    ],
)
def test_wrong_grids_are_named_with_their_line(old, new, words):
    text = MISSION + GRID.replace(old, new)
    first = text.splitlines().index("[grid]") + 1
    with pytest.raises(bp.InputError) as caught:
        parse(text)
    line = re.search(r"m\.toml, line (\d+)", str(caught.value))
    assert line and int(line[1]) >= first
    assert [w for w in words if w not in str(caught.value)] == []


def test_the_mission_of_a_run_keeps_its_grid_and_table():
    mission = parse(MISSION + GRID + PAPER, "gait.omega=1.5")
    again = parse(mission.text)
    assert (again.grid, again.paper, again.gait) == (mission.grid, mission.paper, mission.gait)
    assert load_mission("concertina").grid is None


# --- beside the paper


def test_our_figures_stand_beside_the_papers(worked):
    outcome, _ = worked
    speed, planned = outcome.trial.speed, outcome.motion.facts["speed"]
    one, two = outcome.paper
    assert (one.what, one.printed, one.unit, one.source) == ("speed", 55.0, "mm/s", "page 7")
    assert one.value == pytest.approx(1e3 * speed, rel=1e-12)
    assert two.value == pytest.approx(speed / planned, rel=1e-12)
    assert metrics_of(outcome).paper == [one, two]


def test_ratios_units_and_other_missions():
    from types import SimpleNamespace as Row

    figures = {None: {"trial.a_m": 3.0, "plan.zero": 0.0, "trial.n": None}, "other": {"trial.a_m": 4.0}}

    def value(ours, unit=""):
        (row,) = beside([Row(what="w", printed=1.0, unit=unit, ours=ours, source="")], figures)
        assert isinstance(row, Beside)
        return row.value, row.problem

    assert value("trial.a_m") == (3.0, "")
    assert value("trial.a_m", "mm") == (3000.0, "")
    assert value("trial.a_m / other:trial.a_m", "%") == (pytest.approx(75.0), "")
    assert value("trial.a_m / other:trial.a_m") == (0.75, "")
    assert value("trial.a_m / plan.zero") == (None, "divided by zero")
    assert value("trial.n")[0] is None and "no value" in value("trial.n")[1]
    assert value("other:trial.b_m") == (None, "no trial.b_m there, but trial.a_m")
    assert value("third:trial.a_m") == (None, "third was not run")
    with pytest.raises(bp.InputError, match=r"paper, row 'w': unit = 'deg'.*in m; write a unit of m"):
        value("trial.a_m", "deg")


@pytest.mark.parametrize(
    "ours,unit,scale",
    [
        ("trial.speed_m_s", "mm/s", 1e-3),
        ("trial.speed_m_s", "km/h", 1.0 / 3.6),
        ("trial.slip_angle_rad", "deg", np.pi / 180.0),
        ("trial.peak_torque_Nm", "mN*m", 1e-3),
        ("trial.positive_work_J", "kJ", 1e3),
        ("trial.period_s", "ms", 1e-3),
        ("trial.tracking_max_m", "um", 1e-6),
        ("trial.advance_ratio", "%", 0.01),
        ("trial.cost_of_transport", "", 1.0),
        ("plan.period", "min", 60.0),
        ("plan.no_slip_speed", "cm/s", 0.01),
        ("plan.speed_along_body", "cm/s", 0.01),
        ("plan.advance_per_cycle", "mm", 1e-3),
        ("plan.advance_per_body_length", "%", 0.01),
        ("plan.largest_joint_angle", "deg", np.pi / 180.0),
        ("plan.peak_joint_rate", "rpm", np.pi / 30.0),
        ("plan.peak_joint_acceleration", "rad/s^2", 1.0),
        ("plan.helix_pitch", "mm", 1e-3),
        ("plan.torsion", "deg/m", np.pi / 180.0),
        ("trial.speed_m_s / plan.speed", "%", 0.01),
        ("plan.advance_per_cycle / plan.period", "mm/s", 1e-3),
        ("plan.turn_per_cycle / plan.advance_per_cycle", "deg/m", np.pi / 180.0),
        ("trial.positive_work_J / plan.period", "mW", 1e-3),
        ("trial.peak_torque_Nm / trial.slip_angle_rad", "N*m/deg", 180.0 / np.pi),
    ],
)
def test_units_fit_their_metrics(ours, unit, scale):
    check_unit(ours, unit)
    assert scale_of(unit) == pytest.approx(scale, rel=1e-12)


@pytest.mark.parametrize(
    "ours,unit",
    [
        ("trial.speed_m_s", "deg"),
        ("trial.speed_m_s", "furlong"),
        ("trial.speed_m_s", "%"),
        ("trial.slip_angle_rad", "%"),
        ("trial.advance_ratio", "deg"),
        ("trial.advance_ratio", "mm"),
        ("trial.peak_force_N", "N*m"),
        ("plan.period", "Hz"),
        ("plan.peak_joint_rate", "Hz"),
        ("plan.speed", "m"),
        ("plan.fit_error", "mm"),
        ("trial.speed_m_s / plan.speed", "mm/s"),
        ("plan.advance_per_cycle / plan.period", "mm"),
    ],
)
def test_units_of_another_dimension_are_refused(ours, unit):
    with pytest.raises(bp.InputError, match="unit = ") as caught:
        check_unit(ours, unit)
    assert repr(unit) in str(caught.value) and repr(ours) in str(caught.value)


def test_every_number_of_a_run_has_the_unit_that_its_name_says():
    """A name that says nothing is a number without unit: these are all of them."""
    names = {("trial", name) for name in trial_names(1)}
    for mission in ("concertina", "concertina-paper", "serpentine", "sidewinding", "sinus-lifting", "spiral"):
        names |= {("plan", name) for name in job.plan_mission(load_mission(mission)).facts}
    assert {name for group, name in names if not si_unit(group, name)} == {
        "advance_per_body_length",
        "turns_of_helix",
        "fit_error",
        "warnings",
        "cycles",
        "advance_ratio",
        "advance_ratio_cycle_1",
        "forward_ratio",
        "lift_ratio",
        "yaw_ratio",
        "cost_of_transport",
    }


def test_a_mission_made_by_hand_is_checked_before_it_is_planned():
    mission = parse(MISSION + PAPER)
    row = mission.paper[0].model_copy(update={"unit": "deg"})
    said = []
    with pytest.raises(bp.InputError, match=r"paper, row 'speed': unit = 'deg'"):
        job.work(dataclasses.replace(mission, paper=(row,)), progress=lambda step, part: said.append(step))
    assert said == ["planning"]


def test_units_are_those_of_the_house():
    assert [scale_of(u) for u in ("", "mm/s", "%", "N*m", "kg")] == pytest.approx([1.0, 1e-3, 0.01, 1.0, 1.0])
    with pytest.raises(bp.InputError, match="furlong2"):
        scale_of("furlong2")
    assert [m.key for m in metrics_in("a-b:plan.x/trial.y")] == ["plan.x", "trial.y"]
    assert metrics_in("a-b:plan.x")[0].mission == "a-b"


@pytest.mark.parametrize(
    "old,new,words",
    [
        ('unit = "mm/s"', 'unit = "mmm/s"', ["mmm/s", "mm/s"]),
        (
            'unit = "mm/s"',
            'unit = "deg"',
            [f"line {len(MISSION.splitlines()) + 4}:", "row 'speed'", "'deg'", "trial.speed_m_s", "m/s"],
        ),
        ('unit = "mm/s"', 'unit = "furlong"', ["row 'speed'", "'furlong'", "m/s"]),
        ('ours = "trial.speed_m_s"\n', 'ours = "trial.sped"\n', ["sped", "Did you mean 'speed_m_s'", "advance_ratio"]),
        ('ours = "trial.speed_m_s"\n', 'ours = "speed"\n', ["speed", "plan.NAME", "A / B"]),
        ('ours = "trial.speed_m_s"\n', 'ours = "trial.a / trial.b / trial.c"\n', ["A / B"]),
        ('ours = "trial.speed_m_s"\n', 'ours = "trail.speed_m_s"\n', ["trail", "trial"]),
        (
            'ours = "trial.speed_m_s"\n',
            'ours = "concertina:trial.speed_m_s"\n',
            ["not in compare: unknown mission 'concertina'"],
        ),
        ('what = "gain"', 'wat = "gain"', ["wat", "what"]),
        ("printed = 1.36", "printed = nan", ["printed", "finite"]),
        ("printed = 1.36\n", "", ["printed", "missing"]),
    ],
)
def test_wrong_rows_are_named_with_their_line(old, new, words):
    text = MISSION + PAPER.replace(old, new)
    assert new in text
    with pytest.raises(bp.InputError) as caught:
        parse(text)
    assert "m.toml, line" in str(caught.value)
    assert [w for w in words if w not in str(caught.value)] == []


def test_the_line_is_that_of_the_right_table():
    text = MISSION + PAPER.replace("printed = 1.36", 'printed = "x"')
    with pytest.raises(bp.InputError) as caught:
        parse(text)
    line = 1 + text.splitlines().index('printed = "x"')
    assert f"m.toml, line {line}:" in str(caught.value)


def test_a_fact_that_the_plan_does_not_give_stops_before_the_physics():
    said = []
    mission = parse(MISSION + PAPER.replace("plan.speed", "plan.sped"))
    with pytest.raises(bp.UnknownNameError, match=r"plan 'sped'.*Did you mean 'speed'"):
        job.work(mission, progress=lambda step, part: said.append(step))
    assert said == ["planning"]


def test_without_physics_there_is_a_dash():
    outcome = job.work(parse(MISSION + PAPER), simulate=False)
    assert [row.value for row in outcome.paper] == [None, None]
    assert all(row.problem for row in outcome.paper)
