"""What else of a walking robot could touch: its links and its body, against the ground and against each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray, frozen
from bodyplan.errors import InputError
from bodyplan.gaits.crawl.legs import Legs
from bodyplan.gaits.crawl.shell_kernel import around, last_moved, nearest_slim, nearest_to_box, placed
from bodyplan.ground.base import Ground
from bodyplan.ground.field import Field
from bodyplan.ground.near import segment_clearance_up_to
from bodyplan.ground.plane import Plane
from bodyplan.robot.elements import Contact
from bodyplan.robot.neighbours import separate_contacts

#: share of its distance from level ground that a part must keep at most
USUAL = 0.75
#: points along each side of a face of a box over curved ground
SIDE = 11
#: m of distances that rounding may change
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Shell:
    """The shapes of a robot that are no feet. ``slim``, ``boxes``: indices among its contacts of capsules and spheres,
    and of boxes."""

    legs: Legs
    slim: tuple[int, ...]
    boxes: tuple[int, ...]

    @classmethod
    def of(cls, legs: Legs) -> Shell | None:
        """The shell of a robot; None for one that has feet alone."""
        feet = {leg.contact for leg in legs.legs}
        others = [(k, c.shape) for k, c in enumerate(legs.robot.contacts) if k not in feet]
        slim = tuple(k for k, shape in others if shape in ("capsule", "sphere"))
        boxes = tuple(k for k, shape in others if shape == "box")
        return cls(legs, slim, boxes) if slim or boxes else None

    @property
    def parts(self) -> tuple[int, ...]:
        """Indices among the contacts, in the order of :meth:`gaps`."""
        return (*self.slim, *self.boxes)

    @cached_property
    def owners(self) -> IntArray:
        """(k,) which leg a part is of; -1 for parts of the body."""
        frames = {frame: j for j, leg in enumerate(self.legs.legs) for frame in leg.frames[1:]}
        robot = self.legs.robot
        return np.array(
            [frames.get(robot.frame_index(robot.contacts[k].frame), -1) for k in self.parts], dtype=np.int64
        )

    def name(self, part: int) -> str:
        """Name of a part's contact."""
        return self.legs.robot.contacts[self.parts[part]].name

    def needed(self, stance: Array, keep: float) -> Array:
        """(k,) m that every part is to stay off the ground: ``keep`` m, or USUAL of what it has where the robot stands
        on level ground with joints ``stance`` (n,), if that is less: a shin that ends in its foot cannot keep off."""
        feet = self.legs.feet(stance[None])[0]
        radii = np.array([leg.radius for leg in self.legs.legs])
        level = Plane(float((feet[:, 2] - radii).min()))
        usual = self.gaps(level, self.legs.robot.forward(stance[None]).array, np.full(len(self.parts), np.inf))[0]
        return np.asarray(np.minimum(keep, np.maximum(USUAL * usual - EXACT, 0.0)))

    def gaps(self, ground: Ground, poses: Array, most: Array, wanted: BoolArray | None = None) -> Array:
        """Gaps (S, k) m of all parts to the ground at poses (S, F, 7) of all frames, up to ``most`` (k,) m; minus
        infinity beyond the edge of the ground. With ``wanted`` (S, k), only these; others are infinite or right."""
        out = np.full((len(poses), len(self.parts)), np.inf)
        if self.slim:
            count = len(self.slim)
            _, radii = self._skeletons
            radii = radii[list(self.slim)]
            ends = self._ends(poses, self.slim)
            since, fresh = _moves(ends.reshape(len(poses), count, 6), None if wanted is None else wanted[:, :count])
            off = _beyond(ground, ends[since == np.arange(len(poses))[:, None]], ends)
            if off.any():  # what a part has is not what it had where another was off
                since, fresh = np.broadcast_to(np.arange(len(poses))[:, None], since.shape), np.ones_like(fresh)
            rows, parts = np.nonzero(fresh & ~off[:, None])
            caps = (most[:count] + radii + EXACT)[parts]
            out[rows, parts] = segment_clearance_up_to(ground, ends[rows, parts], caps) - radii[parts]
            out[:, :count] = np.take_along_axis(out[:, :count], since, axis=0)
            out[off, :count] = -np.inf
        for j, k in enumerate(self.boxes, start=len(self.slim)):
            frame = int(self._frames[k])
            since, fresh = _moves(poses[:, [frame]], None if wanted is None else wanted[:, [j]])
            rows = np.flatnonzero(fresh[:, 0])
            out[rows, j] = self._box_gaps(ground, k, poses[rows], float(most[j]))
            out[:, j] = out[since[:, 0], j]
        return out

    def overlap(self, poses: Array, most: float) -> tuple[float, tuple[str, str]]:
        """The smallest gap m below ``most`` m between two shapes of the robot that are no neighbours, feet included, at
        poses (S, F, 7), and their names; ``most`` where none is smaller."""
        slim, boxed = self._pairs
        every = tuple(range(len(self.legs.robot.contacts)))
        ends, (_, radii) = self._ends(poses, every), self._skeletons
        balls = np.empty((*ends.shape[:2], 4))
        around(ends, radii, balls)
        best, pair, _ = nearest_slim(ends, radii, balls, slim, most)
        names = (self._contact(slim[pair, 0]).name, self._contact(slim[pair, 1]).name) if best < most else ("", "")
        for box, others in boxed:
            shape = self._contact(box)
            at = np.ascontiguousarray(poses[:, self._frames[box]])
            middle, half = np.array(shape.start), np.array(shape.half)
            gap, other, _ = nearest_to_box(at, middle, half, ends, radii, balls, others, best)
            if gap < best:
                best, names = gap, (shape.name, self._contact(others[other]).name)
        return float(best), names

    @cached_property
    def _pairs(self) -> tuple[IntArray, list[tuple[int, IntArray]]]:
        """Pairs (n, 2) of capsules and spheres that are no neighbours, and boxes with the others (k,) that are none of
        theirs."""
        slim: list[tuple[int, int]] = []
        boxed: dict[int, list[int]] = {}
        for a, b in separate_contacts(self.legs.robot):
            shapes = self._contact(a).shape, self._contact(b).shape
            if "rim" in shapes or shapes == ("box", "box"):
                continue
            if "box" in shapes:
                box, other = (a, b) if shapes[0] == "box" else (b, a)
                boxed.setdefault(box, []).append(other)
            else:
                slim.append((a, b))
        others = [(box, np.array(rest, dtype=np.int64)) for box, rest in boxed.items()]
        return np.array(slim, dtype=np.int64).reshape(-1, 2), others

    @cached_property
    def _frames(self) -> IntArray:
        """(c,) of all contacts: indices of the frames that they are on."""
        robot = self.legs.robot
        return np.array([robot.frame_index(contact.frame) for contact in robot.contacts], dtype=np.int64)

    @cached_property
    def _skeletons(self) -> tuple[Array, Array]:
        """Of all contacts: the ends (c, 2, 3) m of their middle lines in their frames, and the radii (c,) m."""
        contacts = self.legs.robot.contacts
        ends = [(c.start, c.end if c.shape == "capsule" else c.start) for c in contacts]
        return np.array(ends).reshape(-1, 2, 3), np.array([c.radius for c in contacts])

    def _ends(self, poses: Array, which: tuple[int, ...]) -> Array:
        """World ends (S, k, 2, 3) m of the middle lines of contacts."""
        local, _ = self._skeletons
        return self._placed(poses, which, local[list(which)])

    def _contact(self, k: int) -> Contact:
        return self.legs.robot.contacts[k]

    def _placed(self, poses: Array, which: tuple[int, ...], local: Array) -> Array:
        """World points (S, k, p, 3) of points (k, p, 3) in the frames of contacts."""
        frames = self._frames[list(which)]
        out = np.empty((len(poses), *local.shape))
        placed(poses, frames, local, out)
        return out

    def _box_gaps(self, ground: Ground, k: int, poses: Array, most: float) -> Array:
        box = self._contact(k)
        local = _faces(box) if isinstance(ground, Field) else box.points()[_edges(box)].reshape(-1, 3)
        places, out = self._placed(poses, (k,), local[None])[:, 0], np.full(len(poses), -np.inf)
        for rows in _on(ground, places):
            if isinstance(ground, Field):
                _, out[rows] = ground.nearest_up_to(places[rows], np.full(len(rows), most + EXACT))
            else:
                out[rows] = segment_clearance_up_to(ground, places[rows].reshape(len(rows), -1, 2, 3), most).min(axis=1)
        return out


@lru_cache(maxsize=16)
def shell_of(legs: Legs) -> Shell | None:
    """:meth:`Shell.of`, remembered."""
    return Shell.of(legs)


def _moves(points: Array, wanted: BoolArray | None) -> tuple[IntArray, BoolArray]:
    """Since which sample (S, k) parts with ``points`` (S, k, d) have been where they are, and where (S, k) that is of
    samples that are ``wanted``."""
    since: IntArray = np.empty(points.shape[:2], dtype=np.int64)
    last_moved(points, since)
    fresh = np.zeros(since.shape, dtype=bool)
    rows, parts = np.nonzero(np.ones_like(fresh) if wanted is None else wanted)
    fresh[since[rows, parts], parts] = True
    return since, fresh


@lru_cache(maxsize=32)
def needed_by(shell: Shell, stance: bytes, keep: float) -> Array:
    """:meth:`Shell.needed` of a ``stance``, the bytes of (n,), remembered."""
    return frozen(shell.needed(np.frombuffer(stance).copy(), keep))


def _edges(box: Contact) -> IntArray:
    """(12, 2) pairs of corners of a box that share an edge: they differ in one coordinate."""
    corners = box.points()
    differ = (np.abs(corners[:, None] - corners) > 0.0).sum(axis=-1)
    return np.asarray(np.argwhere(np.triu(differ == 1)), dtype=np.int64)


def _faces(box: Contact) -> Array:
    """Points (p, 3) of the faces of a box."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, SIDE)] * 3), axis=-1).reshape(-1, 3)
    return np.asarray(np.array(box.start) + grid[np.abs(grid).max(axis=1) == 1.0] * np.array(box.half))


def _beyond(ground: Ground, moved: Array, ends: Array) -> BoolArray:
    """Samples (S,) of points ``ends`` (S, k, 2, 3) some of which have no ground below them; ``moved`` (n, 2, 3) are all
    of these once."""
    out = np.zeros(len(ends), dtype=bool)
    if not _has_ground(ground, moved):
        out[:] = True
        for rows in _on(ground, ends):
            out[rows] = False
    return out


def _on(ground: Ground, points: Array) -> list[IntArray]:
    """Rows of ``points`` (S, ..., 3) that have ground below all of them, as one array, or none."""
    flat = points.reshape(len(points), -1, 3)
    try:
        ground.height(flat)
    except InputError:
        rows = [k for k, row in enumerate(flat) if _has_ground(ground, row)]
        return [np.array(rows, dtype=np.int64)] if rows else []
    return [np.arange(len(points))]


def _has_ground(ground: Ground, points: Array) -> bool:
    try:
        ground.height(points)
    except InputError:
        return False
    return True
