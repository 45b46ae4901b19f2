"""A snake as anchors and elbows: which of its pitch joints stand, and what lies between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.fitting.mechanism import PITCH, YAW, mechanism
from bodyplan.gaits.planar import resting_radius
from bodyplan.gaits.rectilinear.demands import Balance, Demands
from bodyplan.gaits.rectilinear.parts import Parts
from bodyplan.robot.elements import Contact
from bodyplan.robot.masses import mass_points
from bodyplan.robot.model import Robot
from bodyplan.spatial import rotate

#: share by which feet and links keep more apart than their radii
APART = 1e-3


@dataclass(frozen=True, eq=False)
class InchingSnake:
    """The pitch joints of a snake that N anchors use, 2 N - 1 of them, tail first, and the body between them.

    ``columns`` (2 N - 1,) of q; ``gain`` (2 N - 1,): nose-up angle per unit of q. ``links`` (2 N - 2,), ``tail`` and
    ``head`` m: lengths between them and beyond. ``frames`` (2 N - 1,) names of frames at the joints. ``contacts``:
    indices among ``robot.contacts`` of those at each joint. ``rest`` m: height of an anchor's axis above the floor;
    ``top`` m: radius of the body at an elbow; ``body`` m: largest radius of the links. ``nearest`` m: spacing
    below which feet or links of a leg are not clear of each other (above it, too, they may not be: see ``parts``).
    """

    robot: Robot
    columns: IntArray
    gain: Array
    links: Array
    tail: float
    head: float
    frames: tuple[str, ...]
    contacts: tuple[tuple[int, ...], ...]
    rest: float
    top: float
    body: float
    nearest: float

    @property
    def anchors(self) -> int:
        """N."""
        return (len(self.columns) + 1) // 2

    @classmethod
    def of(cls, robot: Robot, anchors: int, joints: Sequence[str] | None) -> InchingSnake:
        """The snake in ``robot``: its pitch joints named by ``joints``, or 2 N - 1 of them spread evenly from the first
        to the last. InputError where there are too few, or for a robot that is no straight snake."""
        return _snake(robot, anchors, None if joints is None else tuple(joints))

    @classmethod
    def _of(cls, robot: Robot, anchors: int, joints: tuple[str, ...] | None) -> InchingSnake:
        made = mechanism(robot)
        if made.kind != "straight":
            raise InputError(f"Rectilinear: needs rigid links; {robot.name!r} bends by {made.kind} joints.")
        pitch = made.joints_of(PITCH)
        names = [made.joints[int(j)] for j in pitch]
        need = 2 * anchors - 1
        if joints is not None:
            for name in joints:
                if name not in names:
                    raise UnknownNameError("pitch joint", name, names, where="Rectilinear: joints")
            order = [names.index(name) for name in joints]
            if order != sorted(set(order)):
                raise InputError(f"Rectilinear: joints must run from tail to head, got {list(joints)!r}.")
            chosen = pitch[order]
        else:
            if len(pitch) < need:
                raise InputError(
                    f"Rectilinear: {anchors} anchors need {need} pitch joints, {robot.name!r} has {len(pitch)}; for "
                    f'example bp.snake({2 * need}, 0.1, axes="alternating", first="pitch") or fewer anchors.'
                )
            chosen = pitch[np.round(np.linspace(0, len(pitch) - 1, need)).astype(np.int64)]
        places = made.places[made.joint_place[chosen]]
        stations = np.concatenate([[0.0], places, [made.length]])
        lengths = np.diff(stations)
        if np.any(lengths[1:-1] <= 0.0):
            raise InputError(f"Rectilinear: two pitch joints of {robot.name!r} are in one place.")
        rest = robot.forward(np.zeros(robot.n)).positions[:, 0]
        frames = tuple(robot.frames[int(np.argmin(np.abs(rest - x)))] for x in places)
        at = tuple(_at(robot, frame) for frame in frames)
        radii = [max((robot.contacts[k].radius for k in some), default=0.0) for some in at]
        body = max((c.radius for c in robot.contacts if c.shape == "capsule"), default=0.0)
        return cls(
            robot,
            chosen,
            -made.gain[chosen],
            lengths[1:-1],
            float(lengths[0]),
            float(lengths[-1]),
            frames,
            at,
            resting_radius(robot),
            max([body, *radii[1::2]]),
            body,
            _nearest(rest, places, max(radii[0::2], default=0.0), body),
        )

    def demands(self, ceiling: float, margin: float | None = None) -> Demands:
        """What this snake allows under a ceiling (m above the line of the anchors' axes), with a support margin of at
        least ``margin`` m (None: not asked for)."""
        robot = self.robot
        low, high = (robot.limits[self.columns, side] * self.gain for side in (0, 1))
        return Demands(
            self.links,
            ceiling,
            np.stack([np.minimum(low, high), np.maximum(low, high)], axis=-1),
            robot.rates[self.columns] * np.abs(self.gain),
            self.nearest,
            self.parts,
            self.tail,
            self.balance,
            margin,
        )

    @cached_property
    def parts(self) -> Parts | None:
        """Capsules and feet that must be clear of each other."""
        return Parts.of(self.robot, self.columns, self.stations, APART)

    @property
    def stations(self) -> Array:
        """(2 N - 1,) m: the joints' places from the tail end."""
        return np.asarray(self.tail + np.concatenate([[0.0], np.cumsum(self.links)]))

    @cached_property
    def balance(self) -> Balance | None:
        """Masses shared out among the joints; None for a robot without."""
        frames, masses, centres = mass_points(self.robot)
        if not masses.sum() > 0.0:
            return None
        rest = self.robot.forward(np.zeros(self.robot.n)).array[frames]
        at = rest[:, 0] + rotate(rest[:, 3:], centres)[:, 0]
        stations = self.stations
        inside = np.clip(at, stations[0], stations[-1])
        k = np.clip(np.searchsorted(stations, inside, side="right") - 1, 0, len(self.links) - 1)
        part = (inside - stations[k]) / self.links[k]
        weights = np.zeros(len(stations))
        np.add.at(weights, k, masses * (1.0 - part))
        np.add.at(weights, k + 1, masses * part)
        total = float(masses.sum())
        return Balance(weights / total, float(masses @ (at - inside)) / total)

    def sideways(self) -> tuple[IntArray, Array, Array]:
        """Yaw joints inside the links, the one nearest to each link's middle: ``columns`` (2 N - 2,) of q, ``gain``
        (2 N - 2,) rad to the left per unit of q, and how far from the rear end of its link each is, m. InputError where
        a link has none: such a snake cannot steer."""
        made = mechanism(self.robot)
        yaw = made.joints_of(YAW)
        at = made.places[made.joint_place[yaw]]
        stations = made.places[made.joint_place[self.columns]]
        columns, offsets = [], []
        for start, end in pairwise(stations):
            inside = np.flatnonzero((at > start + 1e-9 * made.length) & (at < end - 1e-9 * made.length))
            if not len(inside):
                raise InputError(
                    f"Rectilinear: steer needs a yaw joint inside every link between pitch joints; {self.robot.name!r} "
                    f"has none between {start:.4g} and {end:.4g} m."
                )
            k = int(inside[np.argmin(np.abs(at[inside] - 0.5 * (start + end)))])
            columns.append(yaw[k])
            offsets.append(at[k] - start)
        chosen = np.array(columns)
        return chosen, np.asarray(made.gain[chosen]), np.array(offsets)

    def q(self, bends: Array) -> Array:
        """Joint coordinates (..., n) from nose-up angles (..., 2 N - 1), or their derivatives; other joints are 0."""
        out = np.zeros((*bends.shape[:-1], self.robot.n))
        out[..., self.columns] = bends / self.gain
        return out


@lru_cache(maxsize=16)
def _snake(robot: Robot, anchors: int, joints: tuple[str, ...] | None) -> InchingSnake:
    """One for all plans with a robot, and so the parts and masses that it finds."""
    return InchingSnake._of(robot, anchors, joints)


def _at(robot: Robot, frame: str) -> tuple[int, ...]:
    """Contacts at the origin of a frame: its feet, or else the end of a capsule there."""
    mine = [(k, c) for k, c in enumerate(robot.contacts) if c.frame == frame]
    feet = [k for k, c in mine if c.shape == "sphere" and _ahead(c) == 0.0]
    return tuple(feet) or tuple(k for k, c in mine if c.shape == "capsule" and _ahead(c) == 0.0)


def _ahead(contact: Contact) -> float:
    """How far the nearest end of a contact is from its frame's origin along x, m."""
    ends: Any = [contact.start[0], contact.end[0]] if contact.shape == "capsule" else [contact.start[0]]
    return float(min(abs(x) for x in ends))


def _nearest(rest: Array, places: Array, foot: float, body: float) -> float:
    """Spacing of anchors below which their feet, or the links of the leg between them, are not clear of each other.

    The two pieces that meet at an elbow may touch there; a piece beyond the next frame, s away from the elbow, is
    spacing * s / link * cos(half the angle there) from the other link, where the links are equal.
    """
    need = 2.0 * max(foot, body)
    for elbow in range(1, len(places), 2):
        for side in (-1, 1):
            between = [abs(x - places[elbow]) for x in rest if (x - places[elbow]) * side > 1e-9 * places[-1]]
            link = abs(places[elbow + side] - places[elbow])
            need = max(need, 2.0 * body * link / min(min(between), link))
    return need * (1.0 + APART)
