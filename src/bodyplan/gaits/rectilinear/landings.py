"""Where the anchors of a phase can land from a stance: told one after the other, each found when it is asked for, and
once for all searches of a way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.rectilinear.offers import Offers
from bodyplan.gaits.rectilinear.walker import AT_ONCE, Walker

#: places along a move at which it is tried with the whole body
CLOSE = 121


@dataclass(eq=False, slots=True)
class Landing:
    """Anchors after a move: ``row`` (N, 4) with s and height m, lift m and how early they rise; ``far`` m is their mean
    s. ``sound``: whether the whole body makes that move, None where it has not been tried."""

    row: Array
    far: float
    sound: bool | None = None


@dataclass(eq=False, slots=True)
class Ahead:
    """The landings of anchors ``group`` from one stance, ``number`` of ``offers``, the farthest first: those ``told``
    so far, and whether there are ``more``."""

    group: IntArray
    offers: Offers
    number: int
    told: list[Landing]
    more: bool


@dataclass(eq=False)
class Landings:
    """Those from all stances that searches with one ``walker`` have come to, known by the first anchor that moves and
    by where all are."""

    walker: Walker
    known: dict[tuple[int, bytes], Ahead] = field(default_factory=dict)

    def ahead(self, stances: Sequence[Array], group: IntArray) -> list[Ahead]:
        """What lies ahead of ``stances`` (N, 4) for the anchors ``group`` (G,)."""
        keys = [(int(group[0]), row[:, :2].tobytes()) for row in stances]
        new = {key: row for key, row in zip(keys, stances, strict=True) if key not in self.known}
        if new:
            here = np.ascontiguousarray(np.array(list(new.values()))[..., :2])
            offers, rows, told = self.walker.offers(here, group)
            far = far_of(rows).tolist()
            for b, (key, count) in enumerate(zip(new, told.tolist(), strict=True)):
                some = [Landing(rows[b, k], far[b][k]) for k in range(count)]
                self.known[key] = Ahead(group, offers, b, some, count == AT_ONCE)
        return [self.known[key] for key in keys]

    def landing(self, ahead: Ahead, k: int) -> Landing | None:
        """The one of number ``k``, None behind the last; all before it have been asked for."""
        if k == len(ahead.told) and ahead.more:
            rows = self.walker.nearer(ahead.offers, ahead.number, ahead.group)
            ahead.told += [Landing(row, far) for row, far in zip(rows, far_of(rows).tolist(), strict=True)]
            ahead.more = len(rows) == AT_ONCE
        return ahead.told[k] if k < len(ahead.told) else None

    def try_all(self, moves: Sequence[tuple[Array, Landing]]) -> None:
        """Find out which of the landings, each with the stance (N, 4) before it, are sound."""
        new = [(before, landing) for before, landing in moves if landing.sound is None]
        if new:
            stances, rows = np.array([before for before, _ in new]), np.array([landing.row for _, landing in new])
            found = self.walker.sound(stances, rows, CLOSE)
            for (_, landing), sound in zip(new, found.tolist(), strict=True):
                landing.sound = sound


def far_of(rows: Array) -> Array:
    """(...,) m: mean s of anchors ``rows`` (..., N, 4)."""
    return np.asarray(np.add.reduce(rows[..., 0], axis=-1) / rows.shape[-2])
