"""What the viewer is about, without its window: a gait whose options change, its plan, verdict and trial.

Plans, checks and physics run in threads of their own; the latest wish wins. Listeners are told that something changed
and read :attr:`Session.state`.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np

from bodyplan.check import Report, check
from bodyplan.errors import BodyplanError
from bodyplan.gaits.base import Gait
from bodyplan.motion import Motion
from bodyplan.show.live.parameters import (
    Choice,
    Key,
    Parameter,
    Scale,
    Value,
    changed,
    choices_of,
    parameters_of,
)
from bodyplan.show.live.worker import Latest
from bodyplan.show.outcome import Outcome
from bodyplan.show.remarks import plan_warnings
from bodyplan.simulate.trial import Trial

#: s: a plan that takes longer is first made for fewer times; one that still does waits until the hand rests so long
FLUENT, SLOW, REST = 0.06, 0.25, 0.25
#: s without a new wish until the plan at hand is made for all times and checked
SETTLED = 0.35


@dataclass(frozen=True)
class Source:
    """What a session can do, given by whoever opens it.

    ``plan(gait, preview)``: the motion of a gait, for few times where ``preview``; None where there is no gait to
    change. ``previews``: whether few times are fewer. ``simulate(motion, progress)``: its trial; None where there is no
    physics. ``outcome``: what a report of a motion, its checks and its trial is written from.
    """

    title: str
    name: str
    motion: Motion
    gait: Gait | None = None
    plan: Callable[[Gait, bool], Motion] | None = None
    simulate: Callable[[Motion, Callable[[float], None]], Trial] | None = None
    outcome: Callable[[Gait | None, Motion, Report, Trial | None], Outcome] | None = None
    trial: Trial | None = None
    previews: bool = True


@dataclass(frozen=True)
class State:
    """What there is to see. ``number`` counts motions and ``trial`` belongs to the ``motion``; ``report``: None while
    it is being checked; ``problem``: why the latest wish has no motion; ``plan_time`` s; ``physics``: part done in [0,
    1], None where none runs; ``physics_waits``: it runs as soon as the plan in hand is whole; ``physics_problem``: why
    there is no trial."""

    motion: Motion
    number: int = 0
    preview: bool = False
    report: Report | None = None
    trial: Trial | None = None
    planning: bool = False
    checking: bool = False
    problem: str = ""
    plan_time: float | None = None
    physics: float | None = None
    physics_waits: bool = False
    physics_problem: str = ""


class CancelledError(Exception):
    """A run of the physics that nobody waits for any more."""


@dataclass(frozen=True)
class _Wish:
    gait: Gait
    number: int
    preview: bool
    #: after a preview, of which the planner may remember much
    again: bool = False


@dataclass
class Session:
    """A :class:`Source` at work; close it with :meth:`stop`."""

    source: Source
    parameters: tuple[Parameter, ...] = ()
    choices: tuple[Choice, ...] = ()
    listeners: list[Callable[[State], None]] = field(default_factory=list)

    def __post_init__(self) -> None:
        source = self.source
        if source.gait is not None and source.plan is not None:
            self.parameters = parameters_of(source.gait, Scale.of(source.motion))
            self.choices = choices_of(source.gait)
        self._lock = threading.RLock()
        self._wish = 0
        self._shown_gait = source.gait
        self._good: tuple[Gait | None, Motion] = (source.gait, source.motion)
        self._cost: dict[bool, float] = {False: math.inf, True: 0.0}
        self._stop_physics = threading.Event()
        self._state = State(source.motion, trial=source.trial, problem=trouble(source.motion), checking=True)
        self._planner: Latest[_Wish] = Latest(self._plan, "plan")
        self._judge: Latest[tuple[Motion, int]] = Latest(self._check, "check")
        self._physics: Latest[tuple[Motion, int]] = Latest(self._simulate, "physics")
        self._judge.ask((source.motion, 0))

    @property
    def state(self) -> State:
        """What there is to see now."""
        with self._lock:
            return self._state

    @property
    def gait(self) -> Gait | None:
        """The gait of the motion that is shown."""
        with self._lock:
            return self._shown_gait

    # --- wishes

    def change(self, values: Mapping[Key, Value]) -> None:
        """Plan with options changed from those that the session began with; all of them are given each time."""
        gait, plan = self.source.gait, self.source.plan
        if gait is None or plan is None:
            return
        try:
            wanted = changed(gait, values)
        except BodyplanError as error:
            with self._lock:
                self._wish += 1
                self._planner.forget()
                self._refuse(str(error), None)
            return
        with self._lock:
            self._wish += 1
            preview = self.source.previews and self._cost[False] > FLUENT
            wait = REST if self._cost[preview] > SLOW else 0.0
            self._judge.forget()
            self._planner.ask(_Wish(wanted, self._wish, preview), wait)
            self._update(planning=True)

    def run_physics(self) -> None:
        """Execute the motion at hand in MuJoCo; while one is being planned, that one, as soon as it is whole."""
        with self._lock:
            state = self._state
            if self.source.simulate is None:
                return
            if state.planning or state.preview:
                self._update(physics_waits=True, physics_problem="")
            elif state.physics is None:
                self._stop_physics = threading.Event()
                self._update(physics=0.0, physics_waits=False, physics_problem="", trial=None)
                self._physics.ask((state.motion, state.number))

    def cancel_physics(self) -> None:
        """Stop a run of the physics, and wait for none."""
        with self._lock:
            self._stop_physics.set()
            if self._state.physics_waits:
                self._update(physics_waits=False)

    def idle(self, timeout: float) -> bool:
        """Wait until plans, checks and physics are done; False where that takes longer than ``timeout`` s."""
        end = perf_counter() + timeout
        workers = (self._planner, self._judge, self._physics)
        while perf_counter() < end:
            idle = all(worker.idle(max(0.0, end - perf_counter())) for worker in workers)
            if idle and not any(worker.waiting for worker in workers):  # one may have asked another
                return True
        return False

    def stop(self) -> None:
        """End all threads; what they have in hand is forgotten."""
        with self._lock:
            self._wish += 1
            self.listeners.clear()
        self._stop_physics.set()
        for worker in (self._planner, self._judge, self._physics):
            worker.stop()

    def outcome(self) -> Outcome:
        """What a report is written from: the motion at hand, checked."""
        state, gait = self.state, self.gait
        if self.source.outcome is None:
            raise BodyplanError("this motion has no report.")
        report = state.report if state.report is not None else check(state.motion)
        return self.source.outcome(gait, state.motion, report, state.trial)

    # --- work, each in its thread

    def _plan(self, wish: _Wish) -> None:
        plan = self.source.plan
        assert plan is not None
        begin = perf_counter()
        try:
            motion = plan(wish.gait, wish.preview)
            problem = trouble(motion)
        except BodyplanError as error:
            motion, problem = None, str(error)
        except Exception as error:  # a planner that fails in a way of its own must not end the session
            motion, problem = None, f"{type(error).__name__}: {error}"
        took = perf_counter() - begin
        with self._lock:
            if motion is not None and not wish.again:
                self._cost[wish.preview] = took
            elif motion is not None and (self._cost[True] + took <= FLUENT or self._cost[False] == math.inf):
                # a whole plan at once takes no longer than both
                self._cost[False] = took
            latest = wish.number == self._wish
            if motion is None or problem:
                if latest:
                    self._refuse(problem, took)
                return
            if not latest and (not self._planner.waiting or self._cost[wish.preview] > SLOW):
                return  # nobody waits for it: the latest wish was refused, or comes soon
            self._stop_physics.set()
            self._shown_gait = wish.gait
            if not wish.preview:
                self._good = (wish.gait, motion)
            self._update(
                motion=motion,
                number=self._state.number + 1,
                preview=wish.preview,
                report=None,
                trial=None,
                planning=not latest,
                checking=latest,
                problem="",
                plan_time=took,
                physics=None,
                physics_problem="",
            )
            if not latest:
                return
            if wish.preview:
                self._planner.ask(replace(wish, preview=False, again=True), SETTLED)
            else:
                self._judge.ask((motion, self._state.number), SETTLED)
                if self._state.physics_waits:
                    self.run_physics()

    def _refuse(self, problem: str, took: float | None) -> None:
        """Say why there is no plan, and keep the last good one."""
        gait, motion = self._good
        if self._state.motion is not motion:
            self._shown_gait = gait
            self._update(motion=motion, number=self._state.number + 1, preview=False, report=None, trial=None)
        again = self._state.report is None
        self._update(planning=False, checking=again, problem=problem, plan_time=took, **self._unplanned())
        if again:
            self._judge.ask((motion, self._state.number), SETTLED)

    def _unplanned(self) -> dict[str, Any]:
        """What is to be said of physics that waited for a plan which there is not."""
        if not self._state.physics_waits:
            return {}
        return {"physics_waits": False, "physics_problem": "not run: there is no such plan"}

    def _check(self, job: tuple[Motion, int]) -> None:
        motion, number = job
        try:
            report: Report | None = check(motion)
        except Exception:  # what cannot be judged has no verdict
            report = None
        with self._lock:
            if number == self._state.number:
                self._update(report=report, checking=False)

    def _simulate(self, job: tuple[Motion, int]) -> None:
        motion, number = job
        stop, simulate = self._stop_physics, self.source.simulate
        assert simulate is not None

        def progress(part: float) -> None:
            if stop.is_set():
                raise CancelledError
            with self._lock:
                if number == self._state.number and part - (self._state.physics or 0.0) >= 0.01:
                    self._update(physics=part)

        trial, problem = None, ""
        try:
            progress(0.0)
            trial = simulate(motion, progress)
            if not trial.ok:
                problem = f"{trial.status}: {trial.reason}"
        except CancelledError:
            problem = "stopped"
        except Exception as error:  # a missing library, a robot that cannot be simulated
            problem = str(error) if isinstance(error, BodyplanError) else f"{type(error).__name__}: {error}"
        with self._lock:
            if number == self._state.number:
                self._update(trial=trial, physics=None, physics_problem=problem)

    def _update(self, **changes: Any) -> None:
        with self._lock:
            self._state = replace(self._state, **changes)
            state, listeners = self._state, tuple(self.listeners)
        for listener in listeners:
            listener(state)


def trouble(motion: Motion) -> str:
    """Why a motion is not one, "" where all its samples are solved."""
    if motion.ok:
        return ""
    bad = np.flatnonzero(motion.status != "ok")
    reasons = "; ".join(plan_warnings(motion)[:2])
    count = f"{len(bad)} of {len(motion.t)} samples"
    said = f"{motion.status[bad[0]]} at t = {motion.t[bad[0]]:.4g} s ({count}){motion.beyond_limits(bad)}"
    return f"{said}: {reasons}" if reasons else said
