"""What else of a walking robot could touch: its links and its body, against the ground and against each other."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError
from bodyplan.gaits.crawl.legs import Legs
from bodyplan.ground.base import Ground
from bodyplan.ground.field import Field
from bodyplan.ground.near import clearance_up_to, segment_clearance_up_to
from bodyplan.ground.plane import Plane
from bodyplan.robot.elements import Contact
from bodyplan.robot.neighbours import separate_contacts
from bodyplan.spatial import conjugate, rotate
from bodyplan.spatial.segments import segment_box_clearance, segment_distance

#: share of its distance from level ground that a part must keep at most
USUAL = 0.75
#: points along each side of a face of a box over curved ground
SIDE = 11
#: m of distances that rounding may change
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Shell:
    """The shapes of a robot that are no feet. ``slim``, ``boxes``: indices among its contacts of capsules and spheres,
    and of boxes; ``keep`` m: how far they are to stay off the ground."""

    legs: Legs
    slim: tuple[int, ...]
    boxes: tuple[int, ...]
    keep: float

    @classmethod
    def of(cls, legs: Legs, keep: float) -> Shell | None:
        """The shell of a robot; None for one that has feet alone."""
        feet = {leg.contact for leg in legs.legs}
        others = [(k, c.shape) for k, c in enumerate(legs.robot.contacts) if k not in feet]
        slim = tuple(k for k, shape in others if shape in ("capsule", "sphere"))
        boxes = tuple(k for k, shape in others if shape == "box")
        return cls(legs, slim, boxes, keep) if slim or boxes else None

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

    def needed(self, stance: Array) -> Array:
        """(k,) m that every part is to stay off the ground: ``keep``, or USUAL of what it has where the robot stands on
        level ground with joints ``stance`` (n,), if that is less: a shin that ends in its foot cannot keep off."""
        feet = self.legs.feet(stance[None])[0]
        radii = np.array([leg.radius for leg in self.legs.legs])
        level = Plane(float((feet[:, 2] - radii).min()))
        usual = self.gaps(level, self.legs.robot.forward(stance[None]).array, np.full(len(self.parts), np.inf))[0]
        return np.asarray(np.minimum(self.keep, np.maximum(USUAL * usual - EXACT, 0.0)))

    def gaps(self, ground: Ground, poses: Array, most: Array) -> Array:
        """Gaps (S, k) m of all parts to the ground at poses (S, F, 7) of all frames, up to ``most`` (k,) m; minus
        infinity beyond the edge of the ground."""
        out = np.full((len(poses), len(self.parts)), -np.inf)
        if self.slim:
            radii = np.array([self._contact(k).radius for k in self.slim])
            ends = np.stack([self._placed(k, poses, _skeleton(self._contact(k))) for k in self.slim], axis=1)
            for rows in _on(ground, ends):
                out[rows, : len(radii)] = (
                    segment_clearance_up_to(ground, ends[rows], most[: len(radii)] + radii + EXACT) - radii
                )
        for j, k in enumerate(self.boxes, start=len(self.slim)):
            frame = self.legs.robot.frame_index(self._contact(k).frame)
            _, first, back = np.unique(poses[:, frame], axis=0, return_index=True, return_inverse=True)
            out[:, j] = self._box_gaps(ground, k, poses[first], float(most[j]))[back.ravel()]
        return out

    def nearest_pair(self, poses: Array) -> tuple[float, int, tuple[str, str]]:
        """The smallest gap m between two shapes of the robot that are no neighbours, feet included, at which of the
        poses (S, F, 7), and their names; infinite for a robot without such."""
        best, when, names = np.inf, 0, ("", "")
        slim, boxed = self._pairs
        if len(slim):
            used = np.unique(slim)
            ends = {k: self._placed(k, poses, _skeleton(self._contact(k))) for k in used.tolist()}
            radii = np.array([self._contact(a).radius + self._contact(b).radius for a, b in slim])
            first, second = (np.stack([ends[k] for k in column]) for column in slim.T.tolist())
            gaps = segment_distance(first, second) - radii[:, None]
            pair, sample = np.unravel_index(gaps.argmin(), gaps.shape)
            best, when = float(gaps[pair, sample]), int(sample)
            names = self._contact(int(slim[pair, 0])).name, self._contact(int(slim[pair, 1])).name
        for a, b in boxed:
            gap = self._to_box(a, b, poses)
            if gap.min() < best:
                best, when = float(gap.min()), int(gap.argmin())
                names = self._contact(a).name, self._contact(b).name
        return best, when, names

    @cached_property
    def _pairs(self) -> tuple[IntArray, list[tuple[int, int]]]:
        """Pairs (n, 2) of capsules and spheres that are no neighbours, and (box, other) pairs."""
        slim, boxed = [], []
        for a, b in separate_contacts(self.legs.robot):
            shapes = self._contact(a).shape, self._contact(b).shape
            if "rim" in shapes or shapes == ("box", "box"):
                continue
            if "box" in shapes:
                boxed.append((a, b) if shapes[0] == "box" else (b, a))
            else:
                slim.append((a, b))
        return np.array(slim, dtype=np.int64).reshape(-1, 2), boxed

    def _contact(self, k: int) -> Contact:
        return self.legs.robot.contacts[k]

    def _placed(self, k: int, poses: Array, local: Array) -> Array:
        """World points (S, p, 3) of points (p, 3) of a contact's frame."""
        at = poses[:, self.legs.robot.frame_index(self._contact(k).frame)]
        return np.asarray(at[:, None, :3] + rotate(at[:, None, 3:], local))

    def _box_gaps(self, ground: Ground, k: int, poses: Array, most: float) -> Array:
        box = self._contact(k)
        curved = isinstance(ground, Field)
        local = _faces(box) if curved else box.points()[_edges(box)].reshape(-1, 3)
        places, out = self._placed(k, poses, local), np.full(len(poses), -np.inf)
        for rows in _on(ground, places):
            if curved:
                out[rows] = clearance_up_to(ground, places[rows], most + EXACT).min(axis=1)
            else:
                out[rows] = segment_clearance_up_to(ground, places[rows].reshape(len(rows), -1, 2, 3), most).min(axis=1)
        return out

    def _to_box(self, box: int, slim: int, poses: Array) -> Array:
        shape, other = self._contact(box), self._contact(slim)
        at = poses[:, self.legs.robot.frame_index(shape.frame)]
        ends = self._placed(slim, poses, _skeleton(other))
        local = rotate(conjugate(at[:, None, 3:]), ends - at[:, None, :3]) - np.array(shape.start)
        return segment_box_clearance(local, np.array(shape.half)) - other.radius


def _skeleton(contact: Contact) -> Array:
    return np.array([contact.start, contact.end if contact.shape == "capsule" else contact.start])


def _edges(box: Contact) -> IntArray:
    """(12, 2) pairs of corners of a box that share an edge: they differ in one coordinate."""
    corners = box.points()
    differ = (np.abs(corners[:, None] - corners) > 0.0).sum(axis=-1)
    return np.asarray(np.argwhere(np.triu(differ == 1)), dtype=np.int64)


def _faces(box: Contact) -> Array:
    """Points (p, 3) of the faces of a box."""
    grid = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, SIDE)] * 3), axis=-1).reshape(-1, 3)
    return np.asarray(np.array(box.start) + grid[np.abs(grid).max(axis=1) == 1.0] * np.array(box.half))


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
