"""What a user may ask of a search, and what is refused before any point is tried."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.missions.files import alone as mission_alone
from bodyplan.search.fields import unit_of, whole_fields
from bodyplan.search.measures import Measure, bound_of, measure_of
from bodyplan.search.parameters import axes_of, ranges_of
from bodyplan.search.payload import key_of, payload_of
from bodyplan.search.point import Row, evaluate
from bodyplan.search.store import store_at
from bodyplan.search.studies import Objective, feasible, sampler_named, violations
from bodyplan.search.table import table_of, write_csv, write_parquet
from search_cases import MISSION, alone, mission


def shown(text):
    (axis,) = axes_of([text])
    return [value.shown for value in axis.values]


# --- values and ranges


@pytest.mark.parametrize(
    "text,expected",
    [
        ("gait.overlap=0:0.8:5", [0.0, 0.2, 0.4, 0.6000000000000001, 0.8]),
        ("gait.waves=1:4:4", [1, 2, 3, 4]),
        ("gait.waves=4:1:4", [4, 3, 2, 1]),
        ('ground.width="120 mm":"160 mm":5', [0.12, 0.13, 0.14, 0.15, 0.16]),
        ("ground.width=12 cm:160 mm:2", [0.12, 0.16]),
        ("gait.contraction=mirror, literal", ["mirror", "literal"]),
        ("gait.alpha=30 deg,1", [np.pi / 6, 1]),
        ("gait.warp=true,false", ["true", "false"]),
        ("gait.velocity=[[0.01, 0.0], [0.02, 0.0]]", ["[0.01, 0.0]", "[0.02, 0.0]"]),
        ("gait.omega=2", [2]),
    ],
)
def test_values_as_they_are_written(text, expected):
    found = shown(text)
    assert [type(v) for v in found] == [type(v) for v in expected]
    for a, b in zip(found, expected, strict=True):
        assert a == b if isinstance(b, (str, int)) else a == pytest.approx(b, rel=1e-15)


def test_a_value_sets_what_it_shows():
    """The mission with the override has the value of the table, in SI."""
    for text in ('ground.width="120 mm":"160 mm":5', "gait.gamma_max=0.3:0.9:7", "gait.contraction=mirror,literal"):
        (axis,) = axes_of([text])
        for value in axis.values:
            made = mission_alone(MISSION, "m", (value.override(axis.key),))
            thing = made.ground.width if axis.key == "ground.width" else getattr(made.gait, axis.key[5:])
            assert thing == value.shown


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.integers(2, 50))
def test_even_values_are_those_of_linspace(low, high, count):
    if low == high:
        with pytest.raises(bp.InputError, match="twice"):
            axes_of([f"gait.omega={low!r}:{high!r}:{count}"])
        return
    expected = np.linspace(low, high, count)
    if len(set(expected.tolist())) == count:
        np.testing.assert_array_equal(shown(f"gait.omega={low!r}:{high!r}:{count}"), expected)


@pytest.mark.parametrize(
    "text,words",
    [
        ("gait.overlap", ["--over gait.overlap", "FIELD=VALUES"]),
        ("gait.overlap=0:0.8", ["FROM:TO:COUNT"]),
        ("gait.overlap=0:0.8:1", ["2 to 10000"]),
        ("gait.overlap=0:0.8:99999999", ["2 to 10000"]),
        ("gait.overlap=0:x:3", ["'x'", "not a number"]),
        ("ground.width=120 mm:0.16:3", ["both ends a unit"]),
        ("ground.width=120 mm:2 s:3", ["different kinds"]),
        ("overlap=1,2", ["section"]),
        ("gait.overlap=1,1", ["twice"]),
        ("gait.overlap=1,,2", ["empty"]),
        ("gait.velocity=[1, ", ["not a list"]),
    ],
)
def test_values_that_are_none(text, words):
    with pytest.raises(bp.InputError) as caught:
        axes_of([text])
    assert [w for w in words if w not in str(caught.value)] == []


def test_ranges():
    even, log, whole, unit, words = ranges_of(
        {
            "gait.overlap": (0, 0.8),
            "gait.omega": "0.5:4:log",
            "gait.waves": "1:3",
            "ground.width": "12 cm:160 mm",
            "gait.blend": ["linear", "smooth"],
        },
        whole=["gait.waves"],
    )
    assert (even.low, even.high, even.log, even.whole) == (0.0, 0.8, False, False)
    assert log.log and log.high == 4.0
    assert whole.whole and whole.value(2).setting == 2
    assert unit.unit == "cm" and unit.high == pytest.approx(16.0) and unit.value(13.0).shown == pytest.approx(0.13)
    assert [v.shown for v in words.choices] == ["linear", "smooth"] and words.value("smooth").setting == "smooth"
    for text, said in (
        ("gait.omega=2:1", "must go up"),
        ("gait.omega=0:1:log", "above 0"),
        ("gait.omega=1", "choices"),
        ("gait.omega=1:2:3:4", "FROM:TO"),
    ):
        with pytest.raises(bp.InputError, match=said):
            ranges_of([text])
    with pytest.raises(bp.InputError, match="whole numbers"):
        ranges_of(["gait.waves=1.5:3"], whole=["gait.waves"])


def test_fields_know_their_units_and_types():
    data = {"robot": {"kind": "snake"}, "gait": {"kind": "concertina"}, "ground": {"kind": "corridor"}}
    assert whole_fields(data, ["gait.waves", "gait.omega", "robot.links", "simulate.cycles"]) == (
        "gait.waves",
        "robot.links",
        "simulate.cycles",
    )
    assert [unit_of(data, key) for key in ("ground.width", "gait.omega", "robot.mass", "time.dt")] == [
        "m",
        "",
        "kg",
        "s",
    ]


# --- what is refused before it begins


@pytest.mark.parametrize(
    "over,more,words",
    [
        ({"gait.omga": [1, 2]}, {}, ["omga", "omega"]),
        ({"gate.omega": [1, 2]}, {}, ["gate", "gait"]),
        ({"grid.values": [1, 2]}, {}, ["grid", "robot"]),
        ({"ground.width": ["1 kg", "2 kg"]}, {}, ["no value of it can be taken", "1 kg"]),
        ({"gait.gamma_max": [2, 3]}, {}, ["no value of it can be taken", "gamma_max"]),
        ({"simulate.friction": [0.1, 0.2]}, {"simulate": False}, ["changes nothing"]),
        ({"ground.path": ["a", "b"]}, {}, ["names a file"]),
        ({"gait.omega": "0:1:1000", "gait.overlap": "0:1:1000"}, {}, ["1000 x 1000", "100000"]),
        ({"gait.omega": [1, 2]}, {"metrics": ["trial.sped"]}, ["sped", "speed_m_s"]),
        ({"gait.omega": [1, 2]}, {"metrics": ["plan.sped"]}, ["sped", "speed"]),
        ({"gait.omega": [1, 2]}, {"metrics": ["trial.speed"], "simulate": False}, ["not simulated"]),
        ({"gait.omega": [1, 2]}, {"workers": 0}, ["workers", "512"]),
        ({"gait.omega": [1, 2]}, {"workers": 1, "scheduler": "tcp://h:1"}, ["one of the two"]),
        ({}, {}, ["at least one field"]),
    ],
)
def test_sweeps_that_are_refused(tmp_path, over, more, words):
    pytest.importorskip("distributed")
    with pytest.raises(bp.InputError) as caught:
        bp.sweep(mission(), over, tmp_path / "s", **more)
    assert [w for w in words if w not in str(caught.value)] == []
    assert not (tmp_path / "s" / "table.csv").exists()


@pytest.mark.parametrize(
    "more,words",
    [
        ({}, ["0 figures to optimise"]),
        ({"maximise": "trial.speed", "minimise": "trial.speed_m_s"}, ["both largest and smallest"]),
        ({"maximise": "trial.speed", "subject_to": "trial.peak_torque=1"}, ["FIGURE<=NUMBER"]),
        ({"maximise": "trial.speed", "subject_to": "trial.peak_torque<=1 m"}, ["N*m", "not in m"]),
        ({"maximise": "trial.speed", "trials": 0}, ["trials", "1 to"]),
        ({"maximise": "trial.speed", "sampler": "cma"}, ["cma", "cmaes"]),
        ({"maximise": ["trial.speed", "trial.advance_ratio"], "sampler": "cmaes"}, ["one objective"]),
        ({"maximise": "trial.speed", "storage": "nosuch://x"}, ["storage", "nosuch"]),
    ],
)
def test_optimisations_that_are_refused(tmp_path, more, words):
    pytest.importorskip("optuna")
    with pytest.raises(bp.InputError) as caught:
        bp.optimise(mission(), ["gait.omega=1:2"], out=tmp_path / "s", **more)
    assert [w for w in words if w not in str(caught.value)] == []


def test_the_command_line_says_what_is_wrong(tmp_path):
    pytest.importorskip("distributed")
    (tmp_path / "m.toml").write_text(MISSION)
    run = CliRunner().invoke(app, ["sweep", str(tmp_path / "m.toml"), "--over", "gait.omga=1,2"])
    assert run.exit_code == 2 and "omega" in run.output
    run = CliRunner().invoke(app, ["optimise", "concertino", "--vary", "gait.omega=1:2"])
    assert run.exit_code == 2 and "concertina" in run.output


def test_ctrl_c_ends_a_search_with_a_word(monkeypatch):
    def stopped(*arguments, progress, **options):
        progress(1, 2)
        raise KeyboardInterrupt

    for name, option in (("sweep", "--over"), ("optimise", "--vary")):
        monkeypatch.setattr(f"bodyplan.search.{name}", stopped)
        run = CliRunner().invoke(app, [name, "concertina", option, "gait.omega=1:2"])
        assert run.exit_code == 130 and "the same command goes on" in run.output


# --- measures, bounds, rows


def test_measures_by_short_names():
    facts = ("speed", "period")
    assert measure_of("trial.speed", facts, 1, True, "").names == ("trial.speed_m_s",)
    assert measure_of("trial.peak_torque", facts, 1, True, "").unit == "N*m"
    ratio = measure_of("trial.speed / plan.speed", facts, 1, True, "")
    assert ratio.of({"trial.speed_m_s": 1.0, "plan.speed": 4.0}) == 0.25
    assert ratio.of({"trial.speed_m_s": 1.0, "plan.speed": 0.0}) is None and ratio.of({}) is None
    with pytest.raises(bp.InputError, match="tracking_rms_rad or "):
        measure_of("trial.tracking_rms", facts, 1, True, "")


def test_bounds_and_what_misses_them():
    bound = bound_of("trial.speed >= 20 mm/s", (), 1, True)
    assert (bound.limit, bound.at_least) == (0.02, True)
    assert bound.excess({"trial.speed_m_s": 0.01}) == pytest.approx(0.5)
    assert bound.excess({"trial.speed_m_s": 0.03}) < 0.0
    well = Row("ok", "", {"trial.speed_m_s": 0.02})
    assert feasible(well, [bound]) and not feasible(Row("ok"), [bound])
    assert violations(Row("check_failed", "", {"check.failed": 2.0}), [])["well"] == 2.0
    assert not feasible(Row("refused"), [])


def test_the_sampler_follows_the_objectives():
    pytest.importorskip("optuna")
    one, two = (Objective(Measure((name,)), True) for name in ("trial.a", "trial.b"))
    numbers, words = ranges_of(["gait.omega=1:2"]), ranges_of(["gait.blend=linear,smooth"])
    assert sampler_named(None, [one], numbers) == "tpe" and sampler_named(None, [one, two], numbers) == "nsga2"
    with pytest.raises(bp.InputError, match="choices"):
        sampler_named("cmaes", [one], words)


@pytest.mark.parametrize(
    "change,status",
    [
        ("gait.length_unit=0.02", "too_tight"),
        ("robot.rate=1.0", "check_failed"),
        ("gait.gamma_max=5", "refused"),
        ("gait.gamma_max=0.7", "ok"),
    ],
)
def test_what_becomes_of_a_point(change, status):
    row = evaluate(payload_of(mission()), (change,), simulate=False)
    assert row.status == status and (row.ok or row.reason)
    if status in ("ok", "check_failed"):
        assert row.figures["check.failed"] == float(status != "ok") and row.figures["plan.speed"] > 0.0


def test_what_the_plan_misses_already_is_not_executed(monkeypatch):
    """Bounds on the plan and checks come before physics, in an optimisation; a sweep executes what it can."""
    payload, done = payload_of(mission()), []

    def executed(mission, motion):
        done.append(motion)

    monkeypatch.setattr("bodyplan.search.point.simulate_mission", executed)
    monkeypatch.setattr("bodyplan.search.point.figures_of", lambda motion, trial: {"trial.speed_m_s": 1.0})
    facts = evaluate(payload, (), simulate=False).figures
    speed = facts["plan.speed"]
    wanted = [bound_of(text, ("speed",), 1, True) for text in (f"plan.speed >= {1.1 * speed}", "trial.speed >= 2")]
    assert [bound.of_plan for bound in wanted] == [True, False]
    row = evaluate(payload, (), True, wanted)
    assert row.status == "out_of_bounds" and not done and "plan.speed >= " in row.reason and row.figures == facts
    assert violations(row, wanted)[wanted[0].text] == pytest.approx(0.1 / 1.1)
    assert evaluate(payload, (), True, wanted[1:]).ok and len(done) == 1
    slow = ("robot.rate=1.0",)
    assert evaluate(payload, slow, True, ()).status == "check_failed" and len(done) == 1
    assert evaluate(payload, slow, True).status == "check_failed" and len(done) == 2


def test_a_point_that_fails_in_a_way_of_its_own(monkeypatch):
    def broken(mission):
        raise ZeroDivisionError("of its own")

    monkeypatch.setattr("bodyplan.search.point.plan_mission", broken)
    row = evaluate(payload_of(mission()), ("gait.gamma_max=0.71",), simulate=False)
    assert (row.status, row.reason) == ("failed", "ZeroDivisionError: of its own")


# --- keys, store, table


def test_what_a_point_is_known_by(tmp_path):
    """The mission's content and what is changed: not its title, its layout or where its files lie."""
    mine = payload_of(mission())
    same = payload_of(mission(MISSION.replace('title = "t"', 'title = "another"\nabout = "words"'), name="other"))
    other = payload_of(mission(MISSION.replace("links = 8", "links = 9")))
    assert mine.content == same.content != other.content
    keys = {key_of(p, o, {"simulate": s}) for p in (mine, other) for o in (["a=1"], ["a=2"]) for s in (True, False)}
    assert len(keys) == 8
    assert key_of(mine, ["a=1", "b=2"], {}) == key_of(mine, ["b=2", "a=1"], {})
    contents = []
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        bp.snake(8, 0.1).to_toml(tmp_path / name / "r.toml")
        text = MISSION.replace('kind = "snake"\nlinks = 8\nlink_length = "100 mm"', 'kind = "file"\npath = "r.toml"')
        payload = payload_of(mission(text, folder=tmp_path / name))
        contents.append(payload.content)
        assert str(tmp_path) not in payload.text and payload.mission().robot == bp.snake(8, 0.1)
    assert contents[0] == contents[1]


def test_points_of_sampled_curves_travel(tmp_path):
    s = np.linspace(0.0, 3.0, 60)
    np.savetxt(tmp_path / "p.csv", np.stack([s, 0.1 * np.sin(2 * s), 0 * s], axis=1), delimiter=",")
    text = (
        'title = "t"\n[robot]\nkind = "snake"\nlinks = 6\nlink_length = 0.1\n[gait]\nkind = "serpentine"\nspeed = 0.1\n'
        f'curve = {{ kind = "sampled", points = "{(tmp_path / "p.csv").as_posix()}" }}\n[ground]\nkind = "plane"\n'
        '[time]\nstop = "1 s"\n'
    )
    payload = payload_of(mission(text))
    (tmp_path / "p.csv").unlink()
    assert len(payload.files) == 1 and evaluate(payload, (), simulate=False).status == "ok"


def test_a_store_keeps_whole_lines(tmp_path):
    path = tmp_path / "points.jsonl"
    rows = {f"k{i}": Row("ok", "", {"a": i / 3, "b": None}, 0.5) for i in range(3)}
    with store_at(path) as store:
        for key, row in rows.items():
            store.add(key, row, {"x": 1})
        store.add("k0", Row("failed"), {})  # what is there stays
        store.add("gone", Row("lost", "why"), {})  # tried again the next time
    whole = path.read_bytes()
    for cut in (1, 7, len(whole.splitlines()[-1]) - 1):
        path.write_bytes(whole[:-cut])
        with store_at(path) as store:
            assert [store.get(key) for key in (*rows, "gone")] == [rows["k0"], rows["k1"], None, None]
            store.add("k2", rows["k2"], {"x": 1})
        assert path.read_bytes() == whole
    path.write_text('{"format": "something else"}\n')
    with pytest.raises(bp.InputError, match="line 1"), store_at(path):
        pass


def test_tables_come_back(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    rows = [Row("ok", "", {"a": 0.1, "b": None}), Row("failed", 'why, "so"', {"c": 1e-30})]
    table = table_of([{"x": 1, "w": "p"}, {"x": 2.5, "w": "q"}], rows)
    assert list(table) == ["x", "w", "status", "reason", "a", "b", "c"]
    write_parquet(table, tmp_path / "t.parquet", {"mission": "m"})
    write_csv(table, tmp_path / "t.csv")
    back = parquet.read_table(tmp_path / "t.parquet")
    assert back.to_pydict() == {**table, "x": [1.0, 2.5]}
    assert json.loads(back.schema.metadata[b"bodyplan"]) == {"mission": "m"}
    text = (tmp_path / "t.csv").read_text().splitlines()
    assert text == ["x,w,status,reason,a,b,c", "1,p,ok,,0.1,,", '2.5,q,failed,"why, ""so""",,,1e-30']


def test_another_search_in_the_folder_is_refused(tmp_path):
    from bodyplan.search.folder import opened

    with opened(tmp_path / "s", {"kind": "sweep", "over": 1}, False):
        pass
    with opened(tmp_path / "s", {"kind": "sweep", "over": 1}, False):
        pass
    with (
        pytest.raises(bp.InputError, match=r"another search \(its over differ\)"),
        opened(tmp_path / "s", {"kind": "sweep", "over": 2}, False),
    ):
        pass
    with opened(tmp_path / "s", {"kind": "sweep", "over": 2}, True):
        pass
    (tmp_path / "s" / "mine.txt").touch()
    with pytest.raises(bp.InputError, match="did not write"), opened(tmp_path / "s", {}, True):
        pass


def test_status_of_the_small_mission():
    from bodyplan.search.sweeps import _points

    (point,) = _points(axes_of({"gait.omega": [1.0]}))
    assert alone(point, simulate=False)[0] == "ok"
