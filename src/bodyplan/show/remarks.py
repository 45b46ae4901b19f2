"""Warnings of a plan and of a trial as a reader wants them: those of many joints on one line."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np

from bodyplan.motion import Motion
from bodyplan.robot.model import Robot
from bodyplan.show.text import counted, degrees, figure, listed, percent
from bodyplan.simulate.trial import Trial

#: joints that are named where there are many
NAMED = 3
_EFFORT = re.compile(
    r"servo of joint '(?P<joint>[^']*)' is at its effort (?P<effort>\S+) for (?P<part>\S+) % of the time"
)
_LIMIT = re.compile(r"joint '(?P<joint>[^']*)' is pushed against its limit")


#: how notes of a plan begin that nobody may miss; the first of them is left out where they are told
WARNING, STOPS = "Warning: ", "Stops at "


def plan_warnings(motion: Motion) -> list[str]:
    """Notes of a plan that nobody may miss: warnings, and why it stops before its time."""
    return [note.removeprefix(WARNING) for note in motion.notes if note.startswith((WARNING, STOPS))]


def went_back(trial: Trial) -> bool:
    """Whether the body went the other way than its plan, over all cycles together."""
    return trial.advance_ratio is not None and trial.advance_ratio < 0.0


def advance_in_words(
    trial: Trial, size: Callable[[float], str] = lambda m: figure(m, "m", 3), share: Callable[[float], str] = percent
) -> str:
    """What physics made of the advance that is planned: a share of it, or how far it went the other way. ``size`` and
    ``share`` write lengths in m and ratios. For trials that have measures."""
    if trial.advance_ratio is None:
        return "no advance planned"
    if not went_back(trial):
        return f"{share(trial.advance_ratio)} of the planned advance"
    planned = float(np.linalg.norm(trial.planned_advance, axis=1).mean())
    each = " a cycle" if trial.cycles > 1 else ""
    return f"{size(-trial.advance_ratio * planned)}{each} the other way than the planned {size(planned)}"


def gathered(trial: Trial, robot: Robot) -> list[str]:
    """The warnings of a trial of ``robot``, one line where several joints have the same trouble: how many they are,
    and the worst of them."""
    efforts = [found for text in trial.warnings if (found := _EFFORT.fullmatch(text))]
    limits = [found for text in trial.warnings if (found := _LIMIT.fullmatch(text))]
    out: list[str] = []
    for text in trial.warnings:
        mine = next((group for group in (efforts, limits) if text in {found.string for found in group}), [])
        if len(mine) < 2:
            out.append(text)
        elif text == mine[0].string:
            out.append(_at_effort(mine) if mine is efforts else _at_limits(mine, trial, robot))
    return out


def _at_effort(found: Sequence[re.Match[str]]) -> str:
    worst = sorted(found, key=lambda one: -float(one["part"]))
    named = [f"{one['joint']} ({one['part']} % of the time)" for one in worst]
    efforts = sorted({one["effort"] for one in found}, key=float)
    effort = f"effort {efforts[0]}" if len(efforts) == 1 else f"efforts {efforts[0]} to {efforts[-1]}"
    return f"{counted(len(found), 'servo')} are at their {effort}, {_named(named)}"


def _at_limits(found: Sequence[re.Match[str]], trial: Trial, robot: Robot) -> str:
    low, high = robot.limits.T
    farthest = np.maximum(trial.q - high, low - trial.q).max(axis=0, initial=0.0)
    excess = {one["joint"]: float(farthest[robot.joints.index(one["joint"])]) for one in found}
    kinds = dict(zip(robot.joints, robot.kinds, strict=True))
    named = [
        f"{name} (by {figure(by, 'm', 3) if kinds[name] == 'length' else degrees(by)})"
        for name, by in sorted(excess.items(), key=lambda item: -item[1])
    ]
    return f"{counted(len(found), 'joint')} are pushed against their limits, {_named(named)}"


def _named(joints: Sequence[str]) -> str:
    return ("most: " if len(joints) > NAMED else "") + listed(joints[:NAMED])
