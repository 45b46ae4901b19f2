"""The curves that figures and plots share: chosen, thinned and named once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.motion import Motion
from bodyplan.simulate.trial import Trial

if TYPE_CHECKING:
    from bodyplan.show.playback import Playback

#: colours that stay apart for every kind of colour vision (Okabe and Ito), dark enough on white
PLANNED, EXECUTED, LIMIT = "#d98200", "#0072b2", "#b3261e"

#: for several lines that are neither plan nor execution
SERIES = (EXECUTED, PLANNED, "#009e73", "#cc79a7", "#56b4e9", "#5c4b8a")


@dataclass(frozen=True)
class JointGroup:
    """Joints of one kind: ``columns`` of q, ``names``, and the units of position, rate and load."""

    kind: str
    columns: IntArray
    names: tuple[str, ...]
    unit: str
    load: str

    @property
    def rate_unit(self) -> str:
        """Unit of their rates."""
        return f"{self.unit}/s"

    @property
    def load_name(self) -> str:
        """What their actuators give."""
        return f"{'torque' if self.kind == 'angle' else 'force'} ({self.load})"


def joint_groups(motion: Motion) -> list[JointGroup]:
    """The robot's joints by kind: angles (rad, N m), then lengths (m, N)."""
    groups = []
    for kind, unit, load in (("angle", "rad", "N m"), ("length", "m", "N")):
        columns = np.flatnonzero([k == kind for k in motion.robot.kinds])
        if len(columns):
            groups.append(JointGroup(kind, columns, tuple(motion.joints[i] for i in columns), unit, load))
    return groups


def one_cycle(playback: Playback, most: int = 360) -> IntArray:
    """Indices of samples of the motion in its first cycle (all of it where it runs once), thinned evenly."""
    t = playback.motion.t
    span = playback.period if playback.period is not None else np.inf
    count = int(np.searchsorted(t, t[0] + span * (1.0 + 1e-9), side="right"))
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def loads(motion: Motion, trial: Trial | None) -> tuple[Array, Array] | None:
    """Times (k,) s and actuator torques or forces (k, n): of the trial's measured part, else of the plan;
    None where neither knows."""
    if trial is not None and trial.ok and len(trial.t):
        measured = trial.t >= trial.start_time - 1e-9
        return trial.t[measured] - trial.start_time, trial.torque[measured]
    if motion.torques is not None:
        return motion.t - motion.t[0], motion.torques
    return None


def crest(t: Array, values: Array, most: int = 750) -> tuple[Array, Array]:
    """A curve of at most ``most`` points that keeps the peaks: the largest value of each stretch of
    samples."""
    step = max(1, int(np.ceil(len(t) / most)))
    starts = np.arange(0, len(t), step)
    return t[starts], np.maximum.reduceat(values, starts)


def compact(values: Any, digits: int = 5) -> list[Any]:
    """Numbers as nested lists for JSON, rounded to ``digits`` significant digits; None for what is not
    finite."""
    if isinstance(values, np.ndarray) and values.ndim > 1:
        return [compact(row, digits) for row in values]
    return [float(f"{x:.{digits}g}") if np.isfinite(x) else None for x in np.asarray(values, dtype=float)]
