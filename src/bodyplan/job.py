"""A whole job: a mission planned, checked, simulated, compared, and written to a folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache, partial
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.check import check
from bodyplan.errors import BodyplanError, InputError, MissingExtraError
from bodyplan.files import refuse_existing, refuse_folder, replacing_folder
from bodyplan.gaits.base import Gait
from bodyplan.ground.base import Ground
from bodyplan.metrics import Metrics, metrics_of
from bodyplan.missions import Mission, load_mission
from bodyplan.missions.files import alone, model_section, ready_missions
from bodyplan.motion import Motion
from bodyplan.plan import MOST_SAMPLES, plan
from bodyplan.robot.model import Robot
from bodyplan.show.beside import Beside, beside, check_facts, check_units
from bodyplan.show.outcome import Comparison, Grid, GridPoint, Outcome, Variant, figures_of, no_slip_ratio

if TYPE_CHECKING:
    from bodyplan.show.fit_outcome import FitOutcome

#: fewest samples of a cycle: fewer would not show the motion, whatever dt says
LEAST_SAMPLES = 100
#: s: how long a gait is planned that cannot go, where nobody says
SHORT = 2.0
#: why a run in another process has no result: nothing but its end is known
LOST = (
    "the process that was to run it has ended (stopped by the system, for want of memory perhaps; a script that calls "
    'bodyplan needs if __name__ == "__main__")'
)
#: how a caller hears of progress: (what is being done, part done in [0, 1])
Progress = Callable[[str, float], None]


def _silent(step: str, part: float) -> None:
    pass


def mission_times(mission: Mission) -> Array:
    """Times of a mission (T,) s: whole steps a cycle, so that samples one cycle apart can be compared."""
    period = mission.gait.period(mission.robot, mission.ground)
    time = mission.time
    if period is None:
        if time.stop is None:
            short = np.linspace(0.0, SHORT, LEAST_SAMPLES + 1)
            if not plan(mission.robot, mission.gait, mission.ground, short).ok:
                return short  # a gait that cannot go has no cycle either: the plan says why
            raise InputError(
                'time.stop: this gait has no cycle; say how long, for example stop = "10 s" in place of cycles.'
            )
        _bounded(time.stop / time.dt)
        steps = max(LEAST_SAMPLES, int(np.ceil(time.stop / time.dt)))
        return np.linspace(0.0, time.stop, steps + 1)
    stop = time.stop if time.stop is not None else (2.0 if time.cycles is None else time.cycles) * period
    a_cycle = max(LEAST_SAMPLES, int(np.ceil(period / time.dt - 1e-9)))
    step = period / a_cycle
    _bounded(stop / step)
    return np.asarray(np.arange(int(np.floor(stop / step + 1e-9)) + 1) * step, dtype=np.float64)


def _bounded(samples: float) -> None:
    if samples > MOST_SAMPLES:
        raise InputError(f"time.dt: {samples:.3g} samples are more than the {MOST_SAMPLES} allowed.")


def plan_mission(mission: Mission) -> Motion:
    """The mission's motion."""
    _one_length(mission)
    return plan(mission.robot, mission.gait, mission.ground, mission_times(mission))


def _one_length(mission: Mission) -> None:
    if mission.time.stop is not None and mission.time.cycles is not None:
        raise InputError("time: give cycles or stop, not both.")


def simulate_mission(mission: Mission, motion: Motion, progress: Callable[[float], None] | None = None) -> Any:
    """The mission's trial, or None where it has no settings for the physics."""
    settings = mission.simulate
    if settings is None:
        return None
    from bodyplan.simulate import Friction, simulate

    friction: Any = settings.friction
    if friction is not None and not isinstance(friction, float):
        friction = Friction(friction.forward, friction.backward, friction.sideways)
    return simulate(
        motion,
        cycles=settings.cycles,
        friction=friction,
        servo=settings.servo,
        dt=settings.dt,
        settle=settings.settle,
        ramp=settings.ramp,
        progress=progress,
    )


def compare_mission(name: str) -> Comparison:
    """Plan and simulate a ready mission for its figures alone."""
    mission = load_mission(name)
    motion = plan_mission(mission)
    trial = simulate_mission(mission, motion)
    return Comparison.of(mission.name, mission.title, motion, trial)


def _variants(mission: Mission, t: Array) -> tuple[Variant, ...]:
    return tuple(
        Variant.of(label, plan(mission.robot, gait, mission.ground, mission_times_of(gait, mission, t)))
        for label, gait in mission.gait.variants().items()
    )


def mission_times_of(gait: Any, mission: Mission, t: Array) -> Array:
    """Even times of one cycle of a variant, as finely sampled as the mission."""
    period = gait.period(mission.robot, mission.ground) or float(t[-1])
    steps = max(8, round(period / float(t[1] - t[0])))
    return np.linspace(0.0, period, steps + 1)


def grid_point(text: str, name: str, key: str, value: float) -> GridPoint:
    """Plan and simulate the mission in ``text`` with the field ``key`` at ``value``. What goes wrong is its status."""
    try:
        mission = alone(text, name, (f"{key}={value!r}",))
        # a field of the physics leaves the plan as it is
        motion = _plan_of(mission) if model_section(key) == "simulate" else plan_mission(mission)
        if not motion.ok:
            first = int(np.flatnonzero(motion.status != "ok")[0])
            return GridPoint(name, value, str(motion.status[first]), f"the plan, at t = {motion.t[first]:.4g} s")
        trial = simulate_mission(mission, motion)
    except BodyplanError as error:
        return GridPoint(name, value, "refused", str(error))
    except Exception as error:  # one point that fails in a way of its own must not cost the others
        return GridPoint(name, value, "failed", f"{type(error).__name__}: {error}")
    if not trial.ok:
        return GridPoint(name, value, trial.status, trial.reason)
    row = Comparison.of(name, "", motion, trial)
    return GridPoint(
        name,
        value,
        row.status,
        "",
        row.ratio,
        row.speed,
        no_slip_ratio(motion, trial),
        row.peak_torque,
        row.cost_of_transport,
        row.slip_angle,
        row.forward_ratio,
    )


def _plan_of(mission: Mission) -> Motion:
    """:func:`plan_mission`, once for missions that differ in their physics alone: known by what is planned and not by
    the text, which may name files that have changed since."""
    _one_length(mission)
    return _plan_at(mission.robot, mission.gait, mission.ground, mission_times(mission).tobytes())


@lru_cache(maxsize=8)
def _plan_at(robot: Robot, gait: Gait, ground: Ground, t: bytes) -> Motion:
    return plan(robot, gait, ground, np.frombuffer(t))


def _begun(pool: ProcessPoolExecutor, job: tuple[Any, ...]) -> Callable[[], Any]:
    """The result of a call in ``pool``, asked for by a call; it raises BrokenProcessPool where a process has ended."""
    try:
        future: Future[Any] = pool.submit(*job)
    except BrokenProcessPool as error:  # the first process has ended before all calls were given out
        future = Future()
        future.set_exception(error)
    return future.result


@contextmanager
def _others(jobs: Sequence[tuple[Any, ...]]) -> Iterator[list[Callable[[], Any]]]:
    """Calls (function, arguments ...) under way in other processes where there is a second core; each result is
    asked for by a call."""
    cores = os.cpu_count() or 1
    if not jobs or cores == 1:
        yield [partial(job[0], *job[1:]) for job in jobs]
        return
    # the caller works too; in a long list it is done early
    workers = min(len(jobs), cores - 1 if len(jobs) < 2 * cores else cores)
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        try:
            yield [_begun(pool, job) for job in jobs]
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def work(mission: Mission, *, simulate: bool = True, compare: bool = True, progress: Progress = _silent) -> Outcome:
    """Plan, check, simulate and compare a mission; nothing is written. See :func:`run`."""
    progress("planning", 0.0)
    check_units(mission.paper)
    motion = plan_mission(mission)
    # a plan that fails has not all of its facts
    for row in mission.paper if motion.ok else ():
        check_facts(row.ours, motion.facts, mission.name, mission.gait.OPTIONAL_FACTS)
    progress("checking", 0.0)
    report = check(motion)
    variants = _variants(mission, motion.t)
    others: list[Comparison] = []
    points: list[GridPoint] = []
    trial = None
    if simulate and mission.simulate is not None:
        names = mission.compare if compare else ()
        cells = _cells(mission) if compare else []
        jobs = [(compare_mission, name) for name in names] + [(grid_point, *cell) for cell in cells]
        with _others(jobs) as results:
            trial = simulate_mission(mission, motion, lambda part: progress("simulating", part))
            for i, result in enumerate(results[: len(names)]):
                progress("comparing", i / len(names))
                try:
                    others.append(result())
                except BrokenProcessPool:
                    others.append(Comparison.lost(names[i], load_mission(names[i]).title, LOST))
            for i, result in enumerate(results[len(names) :]):
                progress("grid", i / len(cells))
                try:
                    points.append(result())
                except BrokenProcessPool:
                    points.append(GridPoint(cells[i][1], cells[i][3], "lost", LOST))
    return Outcome(
        mission.name,
        mission.title,
        mission.about.strip(),
        mission.text,
        mission.overrides,
        motion,
        report,
        trial,
        tuple(others),
        variants,
        _grid(mission, points),
        _paper(mission, motion, trial, others),
    )


def _cells(mission: Mission) -> list[tuple[str, str, str, float]]:
    """Arguments of :func:`grid_point` for every mission and value of the grid, this mission first."""
    grid = mission.grid
    if grid is None:
        return []
    ready = ready_missions()
    texts = {mission.name: mission.text, **{name: ready[name] for name in grid.missions}}
    return [(text, name, grid.key, value) for name, text in texts.items() for value in grid.values]


def _grid(mission: Mission, points: Sequence[GridPoint]) -> Grid | None:
    grid = mission.grid
    if grid is None or not points:
        return None
    names = tuple(dict.fromkeys(point.mission for point in points))
    return Grid(grid.key, grid.label or grid.key, tuple(grid.values), names, tuple(points))


def _paper(mission: Mission, motion: Motion, trial: Any, others: Sequence[Comparison]) -> tuple[Beside, ...]:
    mine = figures_of(motion, trial)
    return beside(mission.paper, {None: mine, mission.name: mine, **{other.name: other.figures for other in others}})


def run(
    mission: Mission | str | Path,
    out: str | os.PathLike[str] | None = None,
    *,
    overrides: Iterable[str] = (),
    force: bool = False,
    simulate: bool = True,
    compare: bool = True,
    progress: Progress = _silent,
) -> Result:
    """Run a mission end to end and write its folder.

    ``mission``: a ready mission's name, a TOML file, or a :class:`Mission`. ``out``: the folder (default
    ``runs/<name>``); an existing one is refused unless ``force``. ``overrides``: texts "gait.omega=1.2".
    The folder appears only when everything in it is written: report.html, figures/, motion.csv, motion.npz,
    robot.xml, metrics.json, mission.toml. Raises InputError for bad input.
    """
    if not isinstance(mission, Mission):
        mission = load_mission(mission, tuple(overrides))
    folder = Path(out) if out is not None else Path("runs") / mission.name
    refuse_folder(folder, force, WRITTEN)
    _needs(simulate and mission.simulate is not None)
    outcome = work(mission, simulate=simulate, compare=compare, progress=progress)
    metrics = metrics_of(outcome)
    progress("writing", 0.0)
    write_folder(outcome, metrics, folder, force)
    return Result(outcome, metrics, folder)


@dataclass(frozen=True)
class Result:
    """A finished run: its :class:`Outcome`, its metrics and its folder."""

    outcome: Outcome
    metrics: Metrics
    folder: Path
    report: Path = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "report", self.folder / "report.html")

    @property
    def ok(self) -> bool:
        """True where every check passed and the physics did not diverge."""
        return self.outcome.ok


#: everything that a fit writes into a folder
FIT_FILES = ("fit.html", "fit.png", "fit.svg", "angles.csv", "fit.json")
#: everything that a run writes
WRITTEN = ("report.html", "figures", "motion.csv", "motion.npz", "robot.xml", "metrics.json", "metrics.schema.json",
           "mission.toml")  # fmt: skip


def _needs(simulate: bool) -> None:
    """MissingExtraError for what a run would miss at its end."""
    if simulate and find_spec("mujoco") is None:
        raise MissingExtraError("mujoco", "physics", "simulation (or run with --no-simulate)")
    for library in ("matplotlib", "plotly"):
        if find_spec(library) is None:
            raise MissingExtraError(library, "report", "report.html")


def write_folder(outcome: Outcome, metrics: Metrics, folder: Path, force: bool) -> None:
    """Write every file of a run to a temporary folder beside ``folder``, then move it into place."""
    from bodyplan.show.report import write_report

    with replacing_folder(folder, force, WRITTEN) as scratch:
        motion = outcome.motion
        names = ("motion.csv", "motion.npz", "robot.xml")
        for name in names if find_spec("mujoco") is not None else names[:2]:
            motion.save(scratch / name)
        (scratch / "metrics.schema.json").write_text(
            json.dumps(Metrics.model_json_schema(), indent=2) + "\n", encoding="utf-8"
        )
        (scratch / "metrics.json").write_text(
            json.dumps(metrics.model_dump(), indent=2, allow_nan=False) + "\n", encoding="utf-8"
        )
        (scratch / "mission.toml").write_text(outcome.mission_text, encoding="utf-8")
        write_report(outcome, scratch)


#: suffixes of a fit that is one file
PICTURES = (".png", ".svg", ".pdf")


def fit_target(name: str, out: Path | None, force: bool) -> Path:
    """Where a fit is written: a page (.html), a picture, or a folder (default ``runs/fit-NAME``). InputError where it
    cannot be."""
    target = out if out is not None else Path("runs") / f"fit-{name}"
    suffix = target.suffix.lower()
    if suffix not in (".html", *PICTURES):
        if suffix and not target.is_dir():
            raise InputError(f"--out {target}: name a folder, or a file ending in .html, .png, .svg or .pdf.")
        refuse_folder(target, force, FIT_FILES)
    elif target.is_dir():
        raise InputError(f"{target}: is a folder; --out names a file here.")
    else:
        refuse_existing(target, force)
    for library, needed in (("plotly", suffix not in PICTURES), ("matplotlib", suffix != ".html")):
        if needed and find_spec(library) is None:
            raise MissingExtraError(library, "report", "drawing a fit")
    return target


def write_fit(outcome: FitOutcome, target: Path, force: bool) -> Path:
    """Write a fit to the place that :func:`fit_target` gave; returns the file to open."""
    from bodyplan.show.fit_page import write_fit_figure, write_fit_folder, write_fit_page

    if target.suffix.lower() == ".html":
        return write_fit_page(outcome, target)
    if target.suffix.lower() in PICTURES:
        return write_fit_figure(outcome, target)
    with replacing_folder(target, force, FIT_FILES) as scratch:
        page = write_fit_folder(outcome, scratch).name
    return target / page
