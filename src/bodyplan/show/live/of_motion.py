"""A session about a motion that somebody has: its gait is read off it and can be changed on the same ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from bodyplan import gaits
from bodyplan.arrays import Array
from bodyplan.check import Report
from bodyplan.errors import BodyplanError, InputError
from bodyplan.gaits.base import Gait
from bodyplan.motion import Motion
from bodyplan.plan import plan
from bodyplan.show.live.session import Source
from bodyplan.show.outcome import Outcome
from bodyplan.show.text import words
from bodyplan.simulate import Friction, simulate
from bodyplan.simulate.trial import Trial

#: times of a plan that is only looked at while its gait is being changed
PREVIEW = 300


def source_of(motion: Motion, trial: Trial | None = None) -> Source:
    """What the viewer can do with a motion: plan it anew, at the same times, where bodyplan knows its gait; physics
    with the settings of ``trial``, or those that ``simulate`` takes by itself."""
    kind = str(motion.gait.get("kind", "motion"))
    title = f"{words(kind).capitalize()} of {motion.robot.name}"
    gait = gait_of(motion)

    def again(wanted: Gait, preview: bool) -> Motion:
        return plan(motion.robot, wanted, motion.ground, fewer(motion.t) if preview else motion.t)

    def outcome(wanted: Gait | None, now: Motion, report: Report, execution: Trial | None) -> Outcome:
        return Outcome(kind, title, "", "", (), now, report, execution)

    executable = bool(motion.robot.contacts)
    return Source(
        title,
        kind,
        motion,
        gait,
        again if gait is not None else None,
        _physics(trial) if executable else None,
        outcome,
        trial,
        previews=len(fewer(motion.t)) < len(motion.t),
    )


def gait_of(motion: Motion) -> Gait | None:
    """The gait that a motion was planned with; None for one that bodyplan does not know."""
    kind = motion.gait.get("kind")
    planner = gaits.KINDS.get(kind) if isinstance(kind, str) else None
    if planner is None:
        return None
    try:
        return planner(**{name: value for name, value in motion.gait.items() if name != "kind"})
    except (BodyplanError, TypeError):
        return None


def fewer(t: Array) -> Array:
    """At most :data:`PREVIEW` even times from the first to the last of ``t``."""
    return t if len(t) <= PREVIEW else np.linspace(t[0], t[-1], PREVIEW)


def _physics(trial: Trial | None) -> Callable[[Motion, Callable[[float], None]], Trial]:
    """Execute a motion as ``trial`` was."""
    given: dict[str, Any] = {}
    if trial is not None:
        known = ("dt", "settle", "ramp", "record_dt", "armature", "arc_joints", "self_collision")
        given = {name: trial.settings[name] for name in known if name in trial.settings}
        given["cycles"] = trial.cycles
        friction, servo = trial.settings.get("friction"), trial.settings.get("servo")
        given["friction"] = Friction(**friction) if isinstance(friction, Mapping) else friction
        given["servo"] = (
            {k: tuple(v) for k, v in servo.items()} if isinstance(servo, Mapping) else servo and tuple(servo)
        )

    def run(motion: Motion, progress: Callable[[float], None]) -> Trial:
        return simulate(motion, progress=progress, **given)

    return run


def checked(motion: object, trial: object) -> None:
    """InputError where there is nothing to show: no motion, or a trial of another robot."""
    if not isinstance(motion, Motion):
        raise InputError(f"motion: expected a Motion, got {motion!r}.")
    if trial is not None and not isinstance(trial, Trial):
        raise InputError(f"trial: expected a Trial or None, got {trial!r}.")
    if trial is not None and trial.joints != motion.joints:
        raise InputError(f"trial: its {len(trial.joints)} joints are not those of the motion ({len(motion.joints)}).")
