"""Mission files: ready ones load, options follow the signatures, mistakes are named with file, line and valid names."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.job import mission_times, plan_mission
from bodyplan.missions import load_mission, parse_mission, ready_missions
from bodyplan.missions.schema import GROUNDS, json_schema

MINIMAL = """title = "t"
[robot]
kind = "snake"
links = 12
link_length = "50 mm"
[gait]
kind = "concertina"
body_modules = 2
[ground]
kind = "plane"
"""


def parse(text, *overrides):
    return parse_mission(text, "m", "m.toml", None, overrides)


#: missions that show what does not work, with the checks that they must fail
FAILING = {"inching-paper": ["the centre of mass is over the standing anchors"]}


@pytest.mark.parametrize("name", sorted(ready_missions()))
def test_ready_missions_plan_and_pass(name):
    mission = load_mission(name)
    assert mission.title and mission.about.strip()
    report = bp.check(plan_mission(mission))
    assert [line.what for line in report.failures] == FAILING.get(name, []), str(report)
    assert set(mission.compare) <= set(ready_missions()) - {name}


def test_units_and_defaults():
    mission = parse(
        MINIMAL.replace("body_modules = 2", 'body_modules = 2\nstretch_time = "4000 ms"\nmax_joint_rate = "90 deg/s"')
    )
    assert mission.gait == bp.Concertina(2, stretch_time=4.0, max_joint_rate=np.pi / 2)
    assert mission.robot == bp.snake(12, 0.05) and mission.ground == bp.Plane()
    assert mission.simulate.cycles == 3 and mission.time.dt == 0.02
    limited = parse(MINIMAL.replace("links = 12", 'links = 12\nlimits = ["-90 deg", "90 deg"]'))
    np.testing.assert_allclose(limited.robot.limits, np.tile([-np.pi / 2, np.pi / 2], (11, 1)))


def test_overrides_change_fields():
    mission = load_mission(
        "concertina", ["gait.body_modules=6", "ground.width=120 mm", "simulate.friction=0.3", "title=other"]
    )
    assert mission.gait.body_modules == 6 and mission.ground.width == 0.12
    assert mission.simulate.friction == 0.3 and mission.title == "other"
    triple = load_mission(
        "concertina", ["simulate.friction={forward=0.1, backward=0.4, sideways=0.2}"]
    ).simulate.friction
    assert (triple.forward, triple.backward, triple.sideways) == (0.1, 0.4, 0.2)


def test_times_divide_the_cycle():
    mission = load_mission("concertina-paper", ["time.dt=0.03"])
    t = mission_times(mission)
    period = mission.gait.period(mission.robot)
    assert np.diff(t).max() <= 0.03 and np.abs(t - period).min() < 1e-12 and t[-1] == pytest.approx(2 * period)
    stopped = mission_times(parse(MINIMAL, "time.stop=5 s"))
    assert stopped[-1] == pytest.approx(5.0, abs=0.02)
    with pytest.raises(bp.InputError, match="not both"):
        plan_mission(parse(MINIMAL + "[time]\ncycles = 2\nstop = 5.0\n"))


def test_an_override_of_how_long_takes_the_place_of_the_file():
    stopped = load_mission("concertina-paper", ["time.stop=5 s"])
    assert stopped.time.cycles is None and mission_times(stopped)[-1] == pytest.approx(5.0, abs=0.02)
    assert "cycles" not in stopped.text.partition("[time]")[2].partition("[")[0]
    cycles = parse(MINIMAL + "[time]\nstop = 5.0\n", "time.cycles=3")
    assert cycles.time.stop is None and cycles.time.cycles == 3
    with pytest.raises(bp.InputError, match="not both"):
        plan_mission(load_mission("concertina-paper", ["time.stop=5 s", "time.cycles=3"]))


@pytest.mark.parametrize(
    "change,line,words",
    [
        (("body_modules", "body_moduls"), 8, ["gait", "body_moduls", "body_modules", "omega", "waves"]),
        (("links = 12", "links = 12.5"), 4, ["robot.links", "12.5"]),
        (('"50 mm"', '"50 s"'), 5, ["robot.link_length", "50 s", "length"]),
        (('"50 mm"', '"fifty"'), 5, ["robot.link_length", "fifty"]),
        (('"50 mm"', "-0.05"), 5, ["link_length", "-0.05"]),
        (
            ('kind = "plane"', 'kind = "plain"'),
            10,
            ["plain", "plane", "corridor", "height_map", "jacksboro", "profile", "surface"],
        ),
        (('kind = "plane"', ""), 9, ["ground", "kind", "corridor"]),
        (("body_modules = 2", "body_modules = 3"), 8, ["body_modules", "even", "3"]),
        (("body_modules = 2", 'contraction = "mirrored"'), 8, ["contraction", "mirrored", "literal", "travelling"]),
        (("links = 12", ""), 2, ["robot.links", "missing"]),
        (("[gait]", "[gate]"), 6, ["gate", "gait", "ground", "robot"]),
        (('title = "t"', 'title = "t"\ncompare = ["concertino"]'), 2, ["concertino", "concertina-paper"]),
    ],
)
def test_mistakes_are_named(change, line, words):
    text = MINIMAL.replace(*change)
    assert text != MINIMAL
    with pytest.raises(bp.InputError) as caught:
        parse(text)
    message = str(caught.value)
    assert f"m.toml, line {line}" in message
    assert [w for w in words if w not in message] == []


@pytest.mark.parametrize(
    "override,words",
    [
        ("gait.omga=2", ["--set gait.omga=2", "omega"]),
        ("gait.omega", ["section.field=value"]),
        ("gait.omega=", ["gait.omega"]),
        ("simulate.friction={forward=1}", ["backward"]),
        ("simulate.friction={forward=1,backward=1,sidways=1}", ["sideways"]),
        ("time.dt=0", ["time.dt", "greater than 0"]),
        ("title.x=1", ["title"]),
        ("ground.width=1", ["width", "slope"]),
    ],
)
def test_wrong_overrides_are_named(override, words):
    with pytest.raises(bp.InputError) as caught:
        parse(MINIMAL, override)
    assert [w for w in words if w not in str(caught.value)] == []


def test_files(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(MINIMAL)
    assert load_mission(path).name == "my"
    bp.snake(12, 0.05).to_toml(tmp_path / "robot.toml")
    path.write_text(
        MINIMAL.replace('kind = "snake"\nlinks = 12\nlink_length = "50 mm"', 'kind = "file"\npath = "robot.toml"')
    )
    assert load_mission(path).robot == bp.snake(12, 0.05)
    path.write_text(MINIMAL.replace('kind = "plane"', 'kind = "surface"\nformula = "0*x"'))
    assert load_mission(path).ground.height(1.0, 2.0) == 0.0
    path.write_text("title = \n")
    with pytest.raises(bp.InputError, match=r"my\.toml.*line 1"):
        load_mission(path)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(bp.InputError, match="UTF-8"):
        load_mission(path)
    path.write_text("#" * 1_000_001)
    with pytest.raises(bp.InputError, match="bytes"):
        load_mission(path)
    with pytest.raises(bp.UnknownNameError, match="concertina"):
        load_mission("concertin")
    with pytest.raises(bp.InputError, match="no such file"):
        load_mission(tmp_path / "none.toml")


def test_formula_in_a_mission_is_never_code():
    with pytest.raises(bp.InputError):
        parse(MINIMAL.replace('kind = "plane"', "kind = \"surface\"\nformula = \"__import__('os').system('true')\""))


def test_schema_lists_every_kind():
    schema = json_schema()
    assert (
        set(schema["kinds"]["ground"]) == set(GROUNDS)
        and "waves" in schema["kinds"]["gait"]["concertina"]["properties"]
    )
