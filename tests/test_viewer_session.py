"""The live viewer's logic: sliders found by themselves, plans where the latest wish wins, refusals that keep the last
good plan, verdict, physics, downloads."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from time import sleep
from typing import Any, ClassVar

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import BodyplanError, InputError
from bodyplan.gaits.base import Gait
from bodyplan.missions import load_mission, ready_missions
from bodyplan.show.live import Session, Source, session, telling
from bodyplan.show.live.of_motion import fewer, gait_of, source_of
from bodyplan.show.live.panel import REPORT, export
from bodyplan.show.live.parameters import Scale, changed, choices_of, nice, options_of, parameters_of
from bodyplan.show.live.worker import Latest
from bodyplan.viewing import differences, mission_source
from report_cases import cart, snake_motion, snake_trial, stick

LONG = 60.0


@pytest.fixture(scope="module")
def motion() -> bp.Motion:
    return bp.plan(bp.acm_l2(), bp.Sidewinding(0.5, 0.2, wavelength=0.64, speed=0.16), bp.Plane(), bp.times(0, 2, 0.1))


# --- what can be changed


@pytest.mark.parametrize("name", sorted(ready_missions()))
def test_every_ready_mission_has_sliders_within_what_its_gait_allows(name: str) -> None:
    gait = load_mission(name).gait
    assert changed(gait, {}) == gait
    found = parameters_of(gait)
    assert len(found) >= 3 and len({p.label for p in found}) == len(found)
    for parameter in found:
        assert parameter.low <= parameter.value <= parameter.high and parameter.low < parameter.high
        assert 0.0 < parameter.step <= parameter.high - parameter.low
        # the present value is that of the gait, and the slider's steps lead from it to both ends
        value: Any = options_of(gait)
        for part in parameter.key:
            value = value[part]
        assert abs(parameter.si(parameter.value) - value) <= 0.051 * parameter.step * parameter.scale
        for end in (parameter.low, parameter.high):
            steps = (end - parameter.value) / parameter.step
            assert abs(steps - round(steps)) < 0.11
            made = changed(gait, {parameter.key: parameter.si(end)})
            assert made != gait or end == parameter.value
    for choice in choices_of(gait):
        for option in choice.options or (not choice.value,):
            try:
                changed(gait, {choice.key: option})
            except BodyplanError as error:  # one that needs other options beside it says so
                assert choice.key[0] in str(error) or str(option) in str(error)


def test_ranges_end_where_the_gait_refuses() -> None:
    by_label = {p.label: p for p in parameters_of(bp.Crawl(max_slope=1.4, sway=0.7, duty=0.8))}
    assert 80.0 < by_label["max slope (deg)"].high < 90.0  # below a right angle
    assert by_label["sway"].high == 1.0 and 0.99 < by_label["duty"].high < 1.0
    modules = {c: parameters_of(bp.Concertina(body_modules=2, contraction=c))[0] for c in ("mirror", "travelling")}
    assert [(p.label, p.low, p.step, p.whole) for p in modules.values()] == [
        ("body modules", 1, 1, True),
        ("body modules", 2, 2, True),  # even numbers only
    ]
    assert isinstance(modules["mirror"].si(3.0), int)
    # what a gait chooses by itself has no number to slide
    assert not any("cycle" in p.label or "reach" in p.label for p in parameters_of(bp.Crawl()))


def test_names_units_and_nested_options() -> None:
    gait = bp.Serpentine(bp.Serpenoid(alpha=np.radians(60.0), wavelength=0.64), speed=0.16)
    by_label = {p.label: p for p in parameters_of(gait)}
    alpha = by_label["alpha (deg)"]
    assert alpha.key == ("curve", "alpha") and alpha.value == 60.0
    assert np.isclose(changed(gait, {alpha.key: alpha.si(90.0)}).to_dict()["curve"]["alpha"], 0.5 * np.pi)
    assert by_label["wavelength (mm)"].value == 640.0 and by_label["length (m)"].value == 1.0
    crawl = {p.label: p for p in parameters_of(bp.Crawl(velocity=(0.01, 0.0)))}
    assert crawl["velocity left (mm/s)"].key == ("velocity", 1)
    assert changed(bp.Crawl(), {("velocity", 1): 0.004}).velocity == (0.01, 0.004)
    assert {c.label: c.options for c in choices_of(bp.Crawl())}["foothold"] == ("nearest", "search")


class Nod(Gait):
    """A gait of somebody's own."""

    kind = "nod"
    UNITS: ClassVar[dict[str, str]] = {"amplitude": "angle", "lag": "angle"}

    def __init__(self, amplitude: float, lag: float = 0.0, mirrored: bool = False) -> None:
        if not 0.0 < amplitude < 0.5:
            raise InputError(f"amplitude: must lie in (0, 0.5), got {amplitude}.")
        self.amplitude, self.lag, self.mirrored = amplitude, lag, mirrored

    def to_dict(self) -> dict[str, Any]:
        return {"kind": "nod", "amplitude": self.amplitude, "lag": self.lag, "mirrored": self.mirrored}

    def plan(self, robot: Any, ground: Any, t: Any) -> bp.Motion:
        raise NotImplementedError


def test_gaits_of_ones_own_have_sliders_too() -> None:
    amplitude, lag = parameters_of(Nod(0.4), Scale(length=1.0, speed=1.0, time=1.0))
    assert np.degrees(0.5) - 2 * amplitude.step < amplitude.high < np.degrees(0.5)
    assert (lag.low, lag.value, lag.high) == (-90.0, 0.0, 90.0)
    (switch,) = choices_of(Nod(0.4))
    assert switch.value is False and switch.options == ()


@pytest.mark.parametrize(("size", "round_one"), [(0.37, 0.2), (1.0, 1.0), (49.9, 20.0), (5e-4, 5e-4), (99.0, 50.0)])
def test_steps_are_round(size: float, round_one: float) -> None:
    assert nice(size) == pytest.approx(round_one, rel=1e-12)


def test_a_scale_is_that_of_the_motion(motion: bp.Motion) -> None:
    scale = Scale.of(motion)
    assert scale.time == 2.0 and 0.2 < scale.length < 1.0 and scale.speed > 0.0
    assert Scale.of(stick()).speed == Scale().speed  # it stands


# --- the latest wish wins


def test_requests_that_have_not_begun_are_forgotten() -> None:
    begun, go = threading.Event(), threading.Event()
    done: list[int] = []

    def work(request: int) -> None:
        begun.set()
        assert go.wait(LONG)
        done.append(request)

    latest = Latest(work, "test")
    latest.ask(1)
    assert begun.wait(LONG)
    for request in (2, 3, 4):
        latest.ask(request)
    assert latest.waiting
    go.set()
    assert latest.idle(LONG) and done == [1, 4]
    latest.ask(5, quiet=3600.0)
    latest.forget()
    assert latest.idle(LONG) and done == [1, 4]
    latest.stop()


class Bench:
    """A session over a planner that tests hold in their hands."""

    def __init__(self, motion: bp.Motion, **more: Any) -> None:
        self.calls: list[tuple[float, bool]] = []
        self.answer: Callable[[float], bp.Motion] = lambda speed: motion.replace(facts={"speed": speed})
        gait = gait_of(motion)
        assert gait is not None
        self.session = Session(Source("test", "test", motion, gait, self._plan, **more))
        self.idle()

    def _plan(self, gait: Gait, preview: bool) -> bp.Motion:
        speed = float(gait.to_dict()["speed"])
        self.calls.append((speed, preview))
        return self.answer(speed)

    def idle(self) -> session.State:
        assert self.session.idle(LONG)
        return self.session.state

    def ask(self, speed: float) -> None:
        self.session.change({("speed",): speed})


@pytest.fixture
def bench(motion: bp.Motion) -> Iterator[Bench]:
    made = Bench(motion)
    yield made
    made.session.stop()


def test_a_slider_plans_anew_and_the_judge_follows(bench: Bench, motion: bp.Motion) -> None:
    first = bench.session.state
    assert first.motion is motion and first.report is not None and first.number == 0
    bench.ask(0.2)
    state = bench.idle()
    assert state.motion.facts["speed"] == 0.2 and not state.problem
    # nobody knows yet what a plan takes: few times first
    assert bench.calls == [(0.2, True), (0.2, False)] and state.number == 2
    assert state.report is not None and state.report.to_dict() == bp.check(state.motion).to_dict()
    assert bench.session.gait == changed(bench.session.source.gait, {("speed",): 0.2})  # type: ignore[arg-type]


def test_stale_wishes_are_dropped(bench: Bench, motion: bp.Motion) -> None:
    begun, go = threading.Event(), threading.Event()

    def slow(speed: float) -> bp.Motion:
        begun.set()
        assert go.wait(LONG)
        return motion.replace(facts={"speed": speed})

    bench.answer = slow
    bench.ask(0.11)
    assert begun.wait(LONG)
    for speed in (0.12, 0.13, 0.14):
        bench.ask(speed)
    assert bench.session.state.planning
    go.set()
    assert bench.idle().motion.facts["speed"] == 0.14
    assert [speed for speed, preview in bench.calls if not preview or speed == 0.11][:1] == [0.11]
    assert {speed for speed, _ in bench.calls} == {0.11, 0.14}


def test_a_refused_plan_says_why_and_keeps_the_last_good_one(bench: Bench, motion: bp.Motion) -> None:
    bench.ask(0.2)
    good = bench.idle().motion
    # refused by the gait itself
    bench.ask(-1.0)
    state = bench.idle()
    assert "speed" in state.problem and state.motion is good and state.report is not None

    # by the planner
    def refuse(speed: float) -> bp.Motion:
        raise InputError("ground: too steep.")

    bench.answer = refuse
    bench.ask(0.3)
    state = bench.idle()
    assert state.problem == "ground: too steep." and state.motion is good and not state.planning

    # a planner that breaks
    def broken(speed: float) -> bp.Motion:
        raise ZeroDivisionError("by hand")

    bench.answer = broken
    bench.ask(0.31)
    assert bench.idle().problem == "ZeroDivisionError: by hand"
    # samples that are not solved
    status = np.array(motion.status)
    status[7:] = "out_of_reach"
    bench.answer = lambda speed: motion.replace(status=status, notes=("Stops at 0.7 s: a leg is short.",))
    bench.ask(0.32)
    state = bench.idle()
    assert state.problem.startswith("out_of_reach at t = 0.7 s (14 of 21 samples)")
    assert "a leg is short" in state.problem
    assert state.motion is good and state.report is not None
    # and back
    bench.answer = lambda speed: motion.replace(facts={"speed": speed})
    bench.ask(0.25)
    state = bench.idle()
    assert not state.problem and state.motion.facts["speed"] == 0.25


def test_plans_that_have_no_fewer_times_are_made_once(motion: bp.Motion) -> None:
    bench = Bench(motion, previews=False)
    bench.ask(0.2)
    bench.idle()
    bench.ask(0.3)
    assert bench.idle().number == 2
    assert bench.calls == [(0.2, False), (0.3, False)]
    bench.session.stop()


def test_heavy_plans_are_first_made_for_few_times(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench.ask(0.2)
    bench.idle()
    monkeypatch.setattr(session, "FLUENT", -1.0)
    bench.calls.clear()
    bench.ask(0.3)
    state = bench.idle()
    assert bench.calls == [(0.3, True), (0.3, False)]
    assert not state.preview and state.report is not None and state.motion.facts["speed"] == 0.3


def test_a_value_that_is_refused_after_a_preview_ends_it(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """What waits for the whole plan waits no longer; the last good plan is back, and judged."""
    monkeypatch.setattr(session, "SETTLED", 2.0)
    good = bench.session.state.motion
    bench.session.change({("speed",): 0.3})
    while not bench.session.state.preview:
        sleep(0.001)
    bench.session.change({("speed",): -1.0})
    state = bench.idle()
    assert state.motion is good and state.problem and not state.preview
    assert not state.planning and not state.checking and state.report is not None


def test_a_value_that_is_refused_while_a_plan_is_made(bench: Bench, motion: bp.Motion) -> None:
    begun, go = threading.Event(), threading.Event()

    def slow(speed: float) -> bp.Motion:
        begun.set()
        assert go.wait(LONG)
        return motion.replace(facts={"speed": speed})

    bench.answer = slow
    bench.session.change({("speed",): 0.3})
    assert begun.wait(LONG)
    bench.session.change({("speed",): -1.0})
    go.set()
    state = bench.idle()
    assert state.motion is motion and state.problem and not state.planning and state.report is not None


def test_a_plan_after_its_preview_is_no_measure_of_the_next(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """Planners remember: what the preview found makes the whole plan fast, and the next one begins from nothing."""
    monkeypatch.setattr(session, "FLUENT", 0.3)
    seen: set[float] = set()

    def remembers(speed: float) -> bp.Motion:
        if speed not in seen:
            sleep(0.4)
        seen.add(speed)
        return bench.session.source.motion.replace(facts={"speed": speed})

    bench.answer = remembers
    for speed in (0.2, 0.3, 0.4, 0.5):
        bench.ask(speed)
        bench.idle()
    few, whole = True, False
    assert bench.calls == [(0.2, few), (0.2, whole), (0.3, whole), *((v, f) for v in (0.4, 0.5) for f in (few, whole))]


def test_a_preview_that_fails_in_full_goes_back(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    bench.ask(0.2)
    good = bench.idle().motion
    monkeypatch.setattr(session, "FLUENT", -1.0)

    def only_few(speed: float) -> bp.Motion:
        if not bench.calls[-1][1]:
            raise InputError("t: not at all of these.")
        return good.replace(facts={"speed": speed})

    bench.answer = only_few
    bench.ask(0.3)
    state = bench.idle()
    assert state.motion is good and "not at all" in state.problem and state.report is not None


def test_listeners_hear_of_everything(bench: Bench) -> None:
    heard: list[session.State] = []
    bench.session.listeners.append(heard.append)
    bench.ask(0.2)
    bench.idle()
    assert heard[0].planning and heard[-1] is bench.session.state and heard[-1].report is not None
    bench.session.stop()
    count = len(heard)
    bench.ask(0.3)
    assert len(heard) == count and not bench.session.listeners


# --- physics


def test_physics_on_demand_and_stopped(motion: bp.Motion) -> None:
    moved: list[float] = []

    def endless(what: bp.Motion, progress: Callable[[float], None]) -> Any:
        running.set()
        for k in range(10**9):
            progress(min(0.5, 0.01 * k))
            moved.append(k)

    running = threading.Event()
    bench = Bench(motion, simulate=endless)
    bench.session.run_physics()
    assert running.wait(LONG) and bench.session.state.physics is not None
    bench.session.cancel_physics()
    state = bench.idle()
    assert state.physics is None and state.trial is None and state.physics_problem == "stopped"
    # another plan stops it, too, and nobody hears of it
    running.clear()
    bench.session.run_physics()
    assert running.wait(LONG)
    bench.ask(0.2)
    state = bench.idle()
    assert state.physics is None and state.physics_problem == "" and state.motion.facts["speed"] == 0.2
    bench.session.stop()


def test_a_trial_belongs_to_its_motion() -> None:
    trial = snake_trial()
    source = source_of(snake_motion())
    made = Session(Source("s", "s", source.motion, source.gait, source.plan, lambda motion, progress: trial))
    assert made.idle(LONG) and made.state.trial is None
    made.run_physics()
    assert made.idle(LONG) and made.state.trial is trial and not made.state.physics_problem
    assert "executed" in telling.physics(made.state)
    key = next(p for p in made.parameters if p.label == "omega")
    made.change({key.key: key.si(key.low)})
    assert made.idle(LONG) and made.state.trial is None
    made.stop()


def test_physics_that_cannot_be_says_why(motion: bp.Motion) -> None:
    def refuse(what: bp.Motion, progress: Callable[[float], None]) -> Any:
        raise InputError("robot: has no contacts.")

    bench = Bench(motion, simulate=refuse)
    bench.session.run_physics()
    assert bench.idle().physics_problem == "robot: has no contacts."
    bench.session.stop()


def test_physics_waits_for_the_plan_in_hand(motion: bp.Motion, monkeypatch: pytest.MonkeyPatch) -> None:
    executed: list[bp.Motion] = []
    trial = snake_trial()

    def execute(what: bp.Motion, progress: Callable[[float], None]) -> Any:
        executed.append(what)
        return trial

    begun, go = threading.Event(), threading.Event()

    def slow(speed: float) -> bp.Motion:
        begun.set()
        assert go.wait(LONG)
        return motion.replace(facts={"speed": speed})

    bench = Bench(motion, simulate=execute)
    bench.ask(0.1)
    bench.idle()
    bench.calls.clear()
    bench.answer = slow
    monkeypatch.setattr(session, "FLUENT", -1.0)  # few times first, then all of them
    bench.ask(0.2)
    assert begun.wait(LONG)
    bench.session.run_physics()
    state = bench.session.state
    assert state.physics_waits and state.physics is None and state.planning
    assert "waits for the plan" in telling.physics(state) and "planning" in telling.verdict(state)
    go.set()
    state = bench.idle()
    assert bench.calls == [(0.2, True), (0.2, False)]  # never the preview
    assert executed == [state.motion] and state.motion.facts["speed"] == 0.2
    assert state.trial is trial and not state.physics_waits and not state.preview
    bench.session.stop()


def test_physics_that_waits_can_be_stopped_and_has_no_plan_where_there_is_none(motion: bp.Motion) -> None:
    executed: list[bp.Motion] = []
    begun, go = threading.Event(), threading.Event()

    def slow(speed: float) -> bp.Motion:
        begun.set()
        assert go.wait(LONG)
        if speed == 0.3:
            raise InputError("ground: too steep.")
        return motion.replace(facts={"speed": speed})

    bench = Bench(motion, simulate=lambda what, progress: executed.append(what))
    bench.answer = slow
    for speed in (0.2, 0.3):
        begun.clear()
        go.clear()
        bench.ask(speed)
        assert begun.wait(LONG)
        bench.session.run_physics()
        assert bench.session.state.physics_waits
        if speed == 0.2:
            bench.session.cancel_physics()
            assert not bench.session.state.physics_waits and not bench.session.state.physics_problem
        go.set()
        state = bench.idle()
        assert executed == [] and not state.physics_waits and state.trial is None
    assert state.physics_problem == "not run: there is no such plan" and state.problem == "ground: too steep."
    # refused by the gait itself
    go.clear()
    begun.clear()
    bench.ask(0.21)
    assert begun.wait(LONG)
    bench.session.run_physics()
    bench.ask(-1.0)
    assert not bench.session.state.physics_waits and bench.session.state.physics_problem
    go.set()
    bench.idle()
    assert executed == []
    bench.session.stop()


# --- sources


def test_a_mission_is_planned_anew_with_times_of_its_own() -> None:
    mission = load_mission("inching")
    source = mission_source(mission)
    assert source.gait == mission.gait and source.plan is not None and source.simulate is not None
    slower = changed(mission.gait, {("move_time",): 2.0})
    again = source.plan(slower, False)
    assert again.t[-1] == pytest.approx(2.0 * source.motion.t[-1]) and again.ok
    few = mission_source(load_mission("inching-paper"))
    assert few.plan is not None and few.gait is not None and len(few.motion.t) > 300
    preview = few.plan(few.gait, True)
    assert len(preview.t) == 300 and preview.t[-1] == few.motion.t[-1]


def test_what_was_changed_by_hand_is_what_set_takes() -> None:
    mission = load_mission("serpentine")
    wanted = changed(mission.gait, {("curve", "alpha"): 1.0, ("speed",): 0.2})
    texts = tuple(differences(mission.gait.to_dict(), wanted.to_dict()))
    assert texts == ("gait.curve.alpha=1.0", "gait.speed=0.2")
    assert load_mission("serpentine", texts).gait == wanted
    walk = load_mission("crawl-flat")
    left = changed(walk.gait, {("velocity", 1): 0.002})
    assert load_mission("crawl-flat", tuple(differences(walk.gait.to_dict(), left.to_dict()))).gait == left
    source = mission_source(mission)
    assert source.outcome is not None
    made = source.outcome(wanted, source.motion, bp.check(source.motion), None)
    assert made.overrides == texts and "alpha = 1.0" in made.mission_text


def test_a_motion_knows_its_gait(motion: bp.Motion) -> None:
    gait = gait_of(motion)
    assert isinstance(gait, bp.Sidewinding) and gait_of(stick()) is None
    source = source_of(motion)
    assert source.plan is not None
    assert source.plan(gait, False) == motion
    assert source_of(cart()).plan is None and source_of(stick()).simulate is None
    assert np.array_equal(fewer(motion.t), motion.t)


# --- downloads and words


def test_downloads_are_what_export_writes(bench: Bench, tmp_path: Any) -> None:
    name, content = export(bench.session, "csv")
    motion = bench.session.state.motion
    assert name == "test.csv" and content == motion.save(tmp_path / "m.csv").read_bytes()
    name, content = export(bench.session, "npz")
    (tmp_path / name).write_bytes(content)
    assert bp.Motion.load(tmp_path / name) == motion
    with pytest.raises(InputError, match="unknown format"):
        export(bench.session, "doc")
    with pytest.raises(BodyplanError, match="no report"):
        export(bench.session, REPORT)


def test_the_report_is_of_the_motion_at_hand(motion: bp.Motion) -> None:
    made = Session(source_of(motion))
    assert made.idle(LONG)
    key = next(p for p in made.parameters if p.label == "speed (mm/s)")
    made.change({key.key: 0.08})
    assert made.idle(LONG)
    name, content = export(made, REPORT)
    made.stop()
    page = content.decode("utf-8")
    assert name == "sidewinding.html" and "Sidewinding of" in page and "80 mm/s" in page.replace("\xa0", " ")


def test_words_are_escaped_and_say_the_verdict(motion: bp.Motion) -> None:
    state = session.State(motion.replace(notes=("Warning: <b>hot</b>",)), problem="<script>", planning=True)
    text = telling.verdict(state)
    assert "<script>" not in text and "&lt;script&gt;" in text and "&lt;b&gt;hot" not in text and "planning" in text
    checked = session.State(motion, report=bp.check(motion))
    assert f"all {len(bp.check(motion).lines)} checks passed" in telling.verdict(checked)
    failing = bp.check(motion.replace(q=motion.q + np.linspace(0.0, 0.5, len(motion.t))[:, None]))
    assert not failing.ok and "failed" in telling.verdict(session.State(motion, report=failing))
    assert "&lt;a&gt;" in telling.moment(1.0, 2.0, ["<a>"])
    assert "could not" in telling.verdict(session.State(motion)) and "not executed" in telling.physics(checked)
