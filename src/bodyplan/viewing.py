"""A mission in the live viewer: its gait can be changed, planned and executed anew."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bodyplan.check import Report
from bodyplan.errors import MissingExtraError
from bodyplan.gaits.base import Gait
from bodyplan.job import mission_times, plan_mission, simulate_mission
from bodyplan.missions import Mission, load_mission, parse_mission
from bodyplan.missions.files import saved_motion
from bodyplan.motion import Motion
from bodyplan.plan import plan
from bodyplan.robot.files import toml_value
from bodyplan.show.live.of_motion import fewer, source_of
from bodyplan.show.live.session import Source
from bodyplan.show.outcome import Outcome
from bodyplan.simulate.trial import Trial

if TYPE_CHECKING:
    from bodyplan.show.live import Viewer


def view(
    mission: Mission | str | Path, *, overrides: Iterable[str] = (), port: int | None = None, simulate: bool = False
) -> Viewer:
    """A running viewer of a mission, or of a motion saved as .npz or in the folder of a run; ``simulate``: execute it
    in physics at once.

    ``port``: see :func:`bodyplan.show.live.server.start`. Raises InputError for a bad mission or a busy port,
    MissingExtraError without viser, or without MuJoCo where it is to simulate.
    """
    if find_spec("viser") is None:
        raise MissingExtraError("viser", "view", "the live viewer")
    if simulate and find_spec("mujoco") is None:
        raise MissingExtraError("mujoco", "physics", "simulation (or view with --no-simulate)")
    if isinstance(mission, Mission):
        source = mission_source(mission)
    elif (saved := saved_motion(mission, overrides)) is not None:
        source = source_of(Motion.load(saved))
    else:
        source = mission_source(load_mission(mission, tuple(overrides)))
    from bodyplan.show.live import Viewer

    viewer = Viewer(source, port=port)
    if simulate:
        viewer.session.run_physics()
    return viewer


def mission_source(mission: Mission) -> Source:
    """What the viewer can do with a mission."""

    def again(gait: Gait, preview: bool) -> Motion:
        wanted = replace(mission, gait=gait)
        times = mission_times(wanted)
        return plan(wanted.robot, gait, wanted.ground, fewer(times) if preview else times)

    def outcome(gait: Gait | None, motion: Motion, report: Report, trial: Trial | None) -> Outcome:
        by_hand = () if gait is None else tuple(differences(mission.gait.to_dict(), gait.to_dict()))
        text = mission.text
        if by_hand:
            text = parse_mission(text, mission.name, f"mission {mission.name}", None, by_hand).text
        overrides = (*mission.overrides, *by_hand)
        return Outcome(mission.name, mission.title, mission.about.strip(), text, overrides, motion, report, trial)

    def execute(motion: Motion, progress: Callable[[float], None]) -> Trial:
        trial: Trial = simulate_mission(mission, motion, progress)
        return trial

    motion = plan_mission(mission)
    executable = mission.simulate is not None and bool(mission.robot.contacts)
    return Source(
        mission.title,
        mission.name,
        motion,
        mission.gait,
        again,
        execute if executable else None,
        outcome,
        previews=len(fewer(motion.t)) < len(motion.t),
    )


def differences(before: Mapping[str, Any], after: Mapping[str, Any], at: str = "gait") -> Iterator[str]:
    """What was changed, as texts "gait.omega=1.2" for --set; both are descriptions of a gait of one kind."""
    for name, value in after.items():
        old = before.get(name)
        if isinstance(value, Mapping) and isinstance(old, Mapping):
            yield from differences(old, value, f"{at}.{name}")
        elif value != old:
            yield f"{at}.{name}={toml_value(value)}"
