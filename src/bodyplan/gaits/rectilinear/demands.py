"""What a snake allows of a gait: links, room for joints, limits and rates; and how far moves stay within it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.moves import Moves, State, bends
from bodyplan.gaits.rectilinear.parts import Parts

#: places along a move that are tried at first, and in each of the rounds that close in on the worst of them
COARSE, FINE, ROUNDS = 65, 17, 3
#: relative slack of a demand that is met exactly
MET = 1e-13
#: places along a move at which rates are taken, and what their largest may be above those (the square of a step)
RATE_PLACES, RATE_SLACK = 1001, 2e-5


@dataclass(frozen=True, eq=False)
class Balance:
    """Where the centre of mass is along the way: ``weights`` (2 N - 1,) of the joints, tail first, sum 1, and a
    ``shift`` m by what lies beyond them."""

    weights: Array
    shift: float

    def center(self, anchors: Array, elbows: Array) -> Array:
        """(...,) m for anchors (..., N) and elbows (..., N - 1) m along the way."""
        return np.asarray(anchors @ self.weights[0::2] + elbows @ self.weights[1::2] + self.shift)


@dataclass(frozen=True, eq=False)
class Demands:
    """``links`` (2 N - 2,) m; ``ceiling`` m above the lower anchor of its leg for every joint; ``limits`` (2 N - 1, 2)
    rad and ``rates`` (2 N - 1,) rad/s of the joints, nose-up, closing one last; ``nearest`` m between two neighbouring
    anchors; ``parts`` that must be clear of each other behind and ahead of joints, the first of them ``tail`` m from
    the tail end (None: they are thin); ``balance`` with the least support ``margin`` m along the way (None: not asked
    for)."""

    links: Array
    ceiling: float = np.inf
    limits: Array = field(default_factory=lambda: np.zeros((0, 2)))
    rates: Array = field(default_factory=lambda: np.zeros(0))
    nearest: float = 0.0
    parts: Parts | None = None
    tail: float = 0.0
    balance: Balance | None = None
    margin: float | None = None

    @property
    def anchors(self) -> int:
        """N."""
        return len(self.links) // 2 + 1

    @property
    def straight(self) -> Array:
        """(N - 1,) m: reach of every leg."""
        return np.asarray(self.links[0::2] + self.links[1::2])

    @property
    def least(self) -> Array:
        """(N - 1,) m: smallest spacing of standing anchors, from links, ``nearest`` and the ceiling:
        sqrt(a^2 - c^2) + sqrt(b^2 - c^2) under a ceiling c below both links."""
        a, b = self.links[0::2], self.links[1::2]
        c = np.minimum(self.ceiling, np.minimum(a, b))
        under = np.sqrt((a - c) * (a + c)) + np.sqrt((b - c) * (b + c))
        folded = np.where(self.ceiling < np.minimum(a, b), under, np.abs(a - b))
        return np.asarray(np.maximum(folded, self.nearest))

    def excess(self, state: State, swinging: BoolArray) -> dict[Status, Array]:
        """How far a state is beyond every demand, relative to links or as a share of pi, (..., k) a status; not
        positive where it is met. ``swinging`` (..., N): the anchors that do not carry."""
        size = float(self.links.max())
        square, folded = self.straight**2, (self.links[0::2] - self.links[1::2]) ** 2
        out = {
            Status.OUT_OF_REACH: -state.legs.short / square,
            Status.COLLAPSED: (np.maximum(self.nearest**2, folded + 1e-12 * square) - _square(state)) / square,
        }
        elbows = state.elbows(self.links)
        if np.isfinite(self.ceiling):
            # a lifted anchor may be higher than the elbows beside it
            rear, front = state.anchors[..., :-1, 1], state.anchors[..., 1:, 1]
            high = np.concatenate([elbows[..., 1], np.maximum(rear, front)], axis=-1)
            low = np.minimum(rear, front)
            out[Status.ABOVE_CEILING] = (high - np.concatenate([low, low], axis=-1) - self.ceiling) / size
        if len(self.limits):
            q = bends(state.angles)
            beyond = np.concatenate([self.limits[:, 0] - q, q - self.limits[:, 1]], axis=-1) / np.pi
            out[Status.LIMIT] = beyond[..., np.isfinite(self.limits.T.ravel())]
        if self.parts is not None:
            into = self.parts.overlaps(state.points(self.links), state.angles, self.tail) / size
            out[Status.COLLAPSED] = np.concatenate([out[Status.COLLAPSED], into[..., :1]], axis=-1)
            out[Status.LINKS_CROSSING] = into[..., 1:]
        if self.margin is not None and self.balance is not None:
            center = self.balance.center(state.anchors[..., 0], elbows[..., 0])
            rear = np.where(swinging, np.inf, state.anchors[..., 0]).min(axis=-1)
            front = np.where(swinging, -np.inf, state.anchors[..., 0]).max(axis=-1)
            out[Status.TIPS_OVER] = (self.margin - np.stack([center - rear, front - center], axis=-1)) / size
        return out

    def met(self, moves: Moves) -> list[Status]:
        """The first demand that each move breaks, or ok."""
        found = self.worst(moves)
        return [next((status for status, most in found.items() if most[m] > MET), Status.OK) for m in range(len(moves))]

    def worst(self, moves: Moves) -> dict[Status, Array]:
        """The largest excess (M,) of every move over each demand, see :meth:`excess`; between the places tried, too, by
        closing in on the worst of them."""
        count = len(moves)
        tau = np.broadcast_to(np.linspace(0.0, 1.0, COARSE), (count, COARSE))
        which = np.arange(count)
        swinging = moves.swinging[:, None]
        step = 1.0 / (COARSE - 1)
        found: dict[Status, Array] = {}
        for _ in range(ROUNDS + 1):
            state = moves.state(self.links, np.broadcast_to(which[:, None], tau.shape), tau)
            beyond = self.excess(state, swinging)
            places = []
            for status, values in beyond.items():
                filled = np.where(np.isfinite(values), values, -np.inf)  # a leg out of reach has no elbow
                # elbows and lifted anchors are highest at different places
                for part in np.split(filled, 2, axis=-1) if status == Status.ABOVE_CEILING else [filled]:
                    along = part.max(axis=-1, initial=-np.inf)
                    found[status] = np.maximum(found.get(status, -np.inf), along.max(axis=1))
                    places.append(np.take_along_axis(tau, along.argmax(axis=1)[:, None], axis=1))
            around = np.concatenate(places, axis=1)
            offsets = step * np.linspace(-1.0, 1.0, FINE)
            tau = np.clip((around[..., None] + offsets).reshape(count, -1), 0.0, 1.0)
            step *= 2.0 / (FINE - 1)
        return found

    def durations(self, moves: Moves, least: float, places: int = RATE_PLACES) -> Array:
        """(M,) s: ``least``, or longer where a joint would turn faster than its rate, taken at ``places`` of a move."""
        if not len(self.rates) or not np.isfinite(self.rates).any():
            return np.full(len(moves), least)
        tau = np.linspace(0.0, 1.0, places)
        which = np.broadcast_to(np.arange(len(moves))[:, None], (len(moves), places))
        fastest = np.abs(bends(moves.state(self.links, which, np.broadcast_to(tau, which.shape)).first)) / self.rates
        return np.asarray(np.maximum(least, fastest.max(axis=(1, 2)) * (1.0 + RATE_SLACK)))


def phases(anchors: int, schedule: str) -> list[IntArray]:
    """Which anchors move at once, move after move of a cycle."""
    if schedule == "wave":
        return [np.array([i]) for i in range(anchors)]
    return [np.arange(0, anchors, 2), np.arange(1, anchors, 2)]


def move_names(anchors: int, schedule: str) -> list[str]:
    """What the moves of a cycle are called."""
    if schedule == "two-phase":
        return ["odd anchors move", "even anchors move"]
    if anchors == 3:
        return ["tail moves", "middle moves", "head moves"]
    return [f"anchor {i + 1} moves" for i in range(anchors)]


def _square(state: State) -> Array:
    chord = np.diff(state.anchors, axis=-2)
    return np.asarray(np.sum(chord * chord, axis=-1))
