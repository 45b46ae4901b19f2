"""What comes too near to anything in a step of a crawl, for one step or several at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import Status
from bodyplan.gaits.crawl.legs import Legs
from bodyplan.gaits.crawl.poses import base_of, seen_from
from bodyplan.gaits.crawl.shell import Shell
from bodyplan.gaits.crawl.steps import Step, blend, swing_path
from bodyplan.ground.base import Ground

#: where a step is looked at for what links and body could touch: of the body's move, and of the swing
MOVE, SWING = np.linspace(0.0, 1.0, 7), np.linspace(0.0, 1.0, 33)
_MOVED = blend(MOVE)[0]
#: m of distances that rounding may change, and by which it makes a difference of none
EXACT, TIE = 1e-9, 1e-12


@dataclass(frozen=True)
class Failure:
    """Why there is no step, and from which time s on. ``short`` m: by how much links or body come too near to anything,
    0 where that is not why; ``elsewhere``: whether another foothold may help, and ``raising``: whether a higher swing;
    ``made``: the step, where only later ones may not be."""

    status: Status = Status.OK
    reason: str = ""
    time: float = np.inf
    short: float = 0.0
    elsewhere: bool = False
    raising: bool = False
    made: Step | None = None


@dataclass(frozen=True, eq=False)
class Lookout:
    """Looks at steps of ``legs`` on ``ground`` for what the ``shell`` could touch. Joints come from ``guess`` (n,);
    parts keep ``needed`` (k,) m off the ground."""

    legs: Legs
    ground: Ground
    shell: Shell
    guess: Array
    needed: Array

    def verdicts(self, steps: Sequence[Step], before: Array, later: Array) -> list[Failure | None]:
        """What comes too near to the ground, or to what, in each of k steps after the body's poses ``before`` (k, 6)
        and, as far as its foot stands there, in the steps after it, where the body may be at ``later`` (k, l, 6)."""
        first, last = len(MOVE), len(MOVE) + len(SWING)
        rest = np.array([step.pose for step in steps])
        poses = np.empty((len(steps), last + later.shape[1], 6))
        poses[:, :first] = before[:, None] + _MOVED[:, None] * (rest - before)[:, None]
        poses[:, first:last] = rest[:, None]
        poses[:, last:] = later
        feet = np.empty((*poses.shape[:2], len(self.legs), 3))
        feet[:, :last] = np.array([step.before for step in steps])[:, None]
        feet[:, last:] = np.array([step.after for step in steps])[:, None]
        swinging, numbers = [step.leg for step in steps], np.arange(len(steps))
        lift, early = np.array([(step.lift, step.early) for step in steps]).T[..., None]
        ends = feet[numbers, 0, swinging][:, None], feet[numbers, last, swinging][:, None]
        feet[numbers, first:last, swinging] = swing_path(*ends, lift, early, SWING)[0]
        base = base_of(poses.reshape(-1, 6))
        q, placed = self.legs.place(seen_from(base, feet.reshape(-1, *feet.shape[2:])), self.guess)
        frames = self.legs.robot.forward(q, base).array
        # how a leg will stand is looked at for the one that swings
        wanted = np.ones((*poses.shape[:2], len(self.needed)), dtype=bool)
        wanted[:, last:] = (self.shell.owners == np.array(swinging)[:, None])[:, None]
        spare = self.shell.gaps(self.ground, frames, self.needed, wanted.reshape(-1, len(self.needed))) - self.needed
        spare[~placed.all(axis=1)] = np.inf
        spare, frames = spare.reshape(wanted.shape), frames.reshape(*poses.shape[:2], -1, 7)
        return [self._verdict(step, spare[k], frames[k, :last]) for k, step in enumerate(steps)]

    def _verdict(self, step: Step, spare: Array, frames: Array) -> Failure | None:
        """Of one step, from how much more than is needed the parts are off the ground, ``spare`` (s, k) m, and the
        poses of all frames until the foot has come down."""
        shell, name = self.shell, self.legs.names[step.leg]
        first, last = len(MOVE), len(MOVE) + len(SWING)
        mine = shell.owners == step.leg
        when = f"while {name} swings at {step.lift_off:.4g} s"
        # the first of those that only rounding tells apart
        worst = spare[:last] <= spare[:last].min() + TIE
        row, part = np.unravel_index(int(worst.argmax()), worst.shape)
        short = -float(spare[row, part])
        if short > EXACT:
            if row < first:
                when = f"at {step.begin + (step.lift_off - step.begin) * float(MOVE[row]):.4g} s, before {name} swings"
            what, wanted = shell.name(int(part)), float(self.needed[part])
            reason = f"{what} comes within {wanted - short:.3g} m of the ground {when}, clearance wants {wanted:.3g} m"
            raising = bool(mine[part] and first < row < last - 1)
            elsewhere = bool(mine[part] and row > first)
            return Failure(Status.BELOW_FLOOR, reason, step.begin, short, elsewhere, raising)
        gap, names = shell.overlap(frames, -EXACT)
        if gap < -EXACT:
            reason = f"{names[0]} and {names[1]} would be in each other {when}"
            return Failure(Status.LINKS_CROSSING, reason, step.begin, -gap, True)
        # how this leg will stand, as far as that can be guessed
        short = -float(spare[last:, mine].min(initial=np.inf))
        if short > EXACT:
            return Failure(Status.BELOW_FLOOR, "", step.begin, short, True, made=step)
        return None
