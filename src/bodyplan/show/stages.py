"""Stage by stage: when each runs, what slipped in it, and how much of the planned advance was lost
meanwhile."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array
from bodyplan.simulate.measure import at
from bodyplan.simulate.trial import Slip, Trial

if TYPE_CHECKING:
    from bodyplan.show.playback import Playback

Stage = tuple[str, float, float]
#: stages times cycles that can be told apart in a picture
MOST_BARS = 600
#: rows of stages from which those of one name are taken together
MANY_ROWS = 24
_CYCLE = re.compile(r", cycle (\d+)$")


@dataclass(frozen=True)
class StageRow:
    """One stage: ``start`` and ``end`` in s of the cycle; per cycle, mean over cycles, in m: ``along``, how
    far the parts meant to rest moved along the planned advance (negative: slipped back), and ``lag``, how
    much the executed advance gained on the planned one; ``largest`` m: the farthest that a resting part
    strayed. None: not measured."""

    name: str
    start: float
    end: float
    along: float | None
    largest: float | None
    lag: float | None


def stages_of(playback: Playback) -> list[Stage]:
    """The stages of one cycle (or of the motion), times counted from its beginning, in order of time."""
    first = playback.motion.t[0]
    rows = [(name, start - first, end - first) for name, start, end in playback.motion.stages]
    return sorted((row for row in rows if row[1] < playback.span), key=lambda row: (row[1], row[2]))


def plain_name(name: str) -> str:
    """The name of a stage without the number of its cycle: "tail moves" for "tail moves, cycle 3"."""
    return _CYCLE.sub("", name)


def cycle_number(name: str) -> int:
    """The number of the cycle in the name of a stage, 1 where there is none."""
    found = _CYCLE.search(name)
    return int(found[1]) if found else 1


def few(stages: Sequence[Stage], cycles: int) -> bool:
    """True where there are stages, and few enough to draw each of them in every cycle."""
    return 0 < len(stages) * cycles <= MOST_BARS


def lanes(stages: Sequence[Stage]) -> list[int]:
    """For each stage the first line that is free when it starts, so that overlapping stages can be drawn."""
    free: list[float] = []
    out = []
    for _, start, end in stages:
        lane = next((i for i, until in enumerate(free) if until <= start + 1e-9), len(free))
        free[lane : lane + 1] = [end]
        out.append(lane)
    return out


def shades(stages: Sequence[Stage]) -> list[int]:
    """0 or 1 for each stage, in turns along its line, so that neighbours look different."""
    count: dict[int, int] = {}
    out = []
    for lane in lanes(stages):
        count[lane] = count.get(lane, -1) + 1
        out.append(count[lane] % 2)
    return out


def lag_by_phase(playback: Playback) -> tuple[Array, Array] | None:
    """Phase (p,) s and executed minus planned advance (cycles, p) m gained since each cycle's beginning; None
    unless whole cycles were executed."""
    lag = playback.lag()
    if lag is None or playback.t[len(lag) - 1] < playback.cycles * playback.span - 1e-6 * playback.span:
        return None
    phase = np.linspace(0.0, playback.span, 401)
    times = np.arange(playback.cycles)[:, None] * playback.span + phase
    gained = at(playback.t[: len(lag)], lag, times.ravel()).reshape(times.shape)
    return phase, gained - gained[:, :1]


def stage_rows(playback: Playback, trial: Trial | None) -> list[StageRow]:
    """Every stage in order of time, with what the trial says of it."""
    stages = stages_of(playback)
    slips: dict[int, list[Slip]] = {}
    for slip in () if trial is None else trial.slips:
        assert trial is not None
        start, end = (x - trial.start_time - slip.cycle * playback.span for x in (slip.start, slip.end))
        index = _stage_of(stages, slip.stage, start, end)
        if index is None:
            stages.append((slip.stage, start, end))
            index = len(stages) - 1
        slips.setdefault(index, []).append(slip)
    gained = None if trial is None else lag_by_phase(playback)
    rows = []
    for i, (name, start, end) in enumerate(stages):
        along = largest = lag = None
        if i in slips:
            along = sum(s.along for s in slips[i]) / len({s.cycle for s in slips[i]})
            largest = max(s.largest for s in slips[i])
        if gained is not None:
            mean = np.interp([start, end], gained[0], gained[1].mean(axis=0))
            lag = float(mean[1] - mean[0])
        rows.append(StageRow(name, start, end, along, largest, lag))
    rows.sort(key=lambda row: (row.start, row.end))
    return gathered_rows(rows) if len(rows) > MANY_ROWS else rows


def gathered_rows(rows: Sequence[StageRow]) -> list[StageRow]:
    """One row for all stages that have one name but for the number of their cycle, in the order of the first of each:
    from the first to the last, sums of ``along`` and ``lag``, the largest ``largest``."""
    groups: dict[str, list[StageRow]] = {}
    for row in rows:
        groups.setdefault(plain_name(row.name), []).append(row)
    out = []
    for name, group in groups.items():
        along, lag = ([v for row in group if (v := getattr(row, key)) is not None] for key in ("along", "lag"))
        far = [row.largest for row in group if row.largest is not None]
        out.append(
            StageRow(
                f"{name} ({len(group)} times)" if len(group) > 1 else group[0].name,
                group[0].start,
                max(row.end for row in group),
                sum(along) if along else None,
                max(far) if far else None,
                sum(lag) if lag else None,
            )
        )
    return out


def _stage_of(stages: Sequence[Stage], name: str, start: float, end: float) -> int | None:
    """The stage of that name (or one that begins with it, as "fold (wave 2)") that shares most time with an
    interval."""
    best, shared = None, 0.0
    for i, (other, a, b) in enumerate(stages):
        common = min(b, end) - max(a, start)
        if (other == name or other.startswith(name + " ")) and common > shared:
            best, shared = i, common
    return best


def worst(rows: Sequence[StageRow], count: int = 3) -> list[StageRow]:
    """The stages in which most advance is lost, worst first: those with at least a tenth of the worst one's
    loss."""
    losing = sorted((row for row in rows if row.lag is not None and row.lag < 0.0), key=lambda row: row.lag or 0.0)
    return [row for row in losing[:count] if (row.lag or 0.0) <= 0.1 * (losing[0].lag or 0.0)]
