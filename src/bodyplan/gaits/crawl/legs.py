"""Legs of a walking robot: feet on chains of the extended D-H table, and the joints that put them in place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray, frozen
from bodyplan.errors import InputError
from bodyplan.gaits.crawl import leg_kernel
from bodyplan.gaits.crawl.leg_kernel import SINGULAR, Postures, Tables
from bodyplan.robot.elements import Joint, Row
from bodyplan.robot.masses import mass_points
from bodyplan.robot.model import Robot
from bodyplan.spatial import rotate

#: values a joint that are tried for a first guess
GRID = 13


@dataclass(frozen=True)
class _Drive:
    """One use of a joint in a chain: it turns about, or moves along, an axis: z of the frame before element
    ``element`` (theta, d), or x of the frame after it (a, epsilon)."""

    column: int
    scale: float
    element: int
    turns: bool
    before: bool


@dataclass(frozen=True, eq=False)
class Leg:
    """A chain that ends in a foot. ``name`` of the chain, ``contact``: index of its ball, ``frame``: index of the frame
    that the ball is on, ``local`` (3,) m its centre there, ``radius`` m; ``columns`` (3,) of its actuated joints."""

    robot: Robot
    name: str
    contact: int
    frame: int
    local: Array
    radius: float
    columns: IntArray
    drives: tuple[_Drive, ...]
    frames: tuple[int, ...]  # the frame before the first element, then that after each

    @cached_property
    def length(self) -> float:
        """Sum of the lengths of its rows from the first actuated joint on, m; slides as long as they can be."""
        chain = next(c for c in self.robot.chains if c.name == self.name)
        first = next(d.element for d in self.drives if d.column in self.columns)
        rows = [row for row in chain.elements[first:] if isinstance(row, Row)]
        return sum(_longest(v, self.robot) for row in rows for v in (row.a, row.d))

    @cached_property
    def postures(self) -> tuple[Array, Array, IntArray, Array]:
        """A coarse grid over the ranges of the leg's joints: coordinates (g, 3), places (g, 3) of the foot in the base,
        the sides to which it is :func:`bent` there, and the heights (g,) of its highest joint."""
        turns = np.array([self.robot.kinds[column] == "angle" for column in self.columns])
        widest = np.where(turns, np.pi, max(self.length, 1e-3))[:, None]
        limits = np.clip(self.robot.limits[self.columns], -widest, widest)
        axes = [np.linspace(low, high, GRID) for low, high in limits]
        sets = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        tried = np.zeros((len(sets), self.robot.n))
        tried[:, self.columns] = sets
        _, places, feet, columns = self.jacobian(self.robot.forward(tried).array)
        return sets, feet, bent(self.square(columns)), places[..., 2].max(axis=1)

    def jacobian(self, poses: Array) -> tuple[Array, Array, Array, Array]:
        """(axes (T, k, 3), places (T, k, 3), foot (T, 3), columns (T, 3, k)) of the k drives at ``poses`` (T, F, 7)."""
        axes, places = [], []
        for drive in self.drives:
            at = poses[:, self.frames[drive.element if drive.before else drive.element + 1]]
            axes.append(direction(at[:, 3:], drive.before))
            places.append(at[:, :3])
        foot = poses[:, self.frame, :3] + rotate(poses[:, self.frame, 3:], self.local)
        axis, place = np.stack(axes, axis=1), np.stack(places, axis=1)
        turns = np.array([drive.turns for drive in self.drives])
        columns = np.where(turns[:, None], cross(axis, foot[:, None] - place), axis)
        return axis, place, foot, np.swapaxes(columns, -1, -2)

    def square(self, columns: Array) -> Array:
        """(T, 3, 3): how the foot moves with the three actuated joints, from the drives' ``columns`` (T, 3, k)."""
        out = np.zeros((*columns.shape[:-1], len(self.columns)))
        for k, drive in enumerate(self.drives):
            j = np.flatnonzero(self.columns == drive.column)
            if len(j):
                out[..., j[0]] += drive.scale * columns[..., k]
        return out


def _longest(length: Any, robot: Robot) -> float:
    if not isinstance(length, Joint):
        return abs(float(length))
    ends = length.offset + length.scale * robot.limits[robot.joint_index(length.name)]
    return float(np.abs(ends[np.isfinite(ends)]).max(initial=abs(length.offset)))


@dataclass(frozen=True, eq=False)
class Legs:
    """All legs of a robot, in the order of its chains."""

    robot: Robot
    legs: tuple[Leg, ...]

    def __len__(self) -> int:
        return len(self.legs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the chains."""
        return tuple(leg.name for leg in self.legs)

    @cached_property
    def radii(self) -> Array:
        """(m,) m: of the balls."""
        return np.array([leg.radius for leg in self.legs])

    @classmethod
    def of(cls, robot: Robot) -> Legs:
        """The legs of ``robot``: every chain must be rows from the base to a ball, with three actuated joints.
        InputError says which is not."""
        legs = []
        for chain in robot.chains:
            where = f"Crawl: chain {chain.name!r} of {robot.name!r}"
            if chain.parent != "base" or not all(isinstance(element, Row) for element in chain.elements):
                raise InputError(f"{where}: a leg is a chain of rows that begins at the base.")
            names = [chain.frame_name(i) for i in range(len(chain.elements))]
            balls = [(k, c) for k, c in enumerate(robot.contacts) if c.frame == names[-1] and c.shape == "sphere"]
            if len(balls) != 1:
                raise InputError(
                    f"{where}: needs one ball contact on its last frame, has {len(balls)}; contacts are given like "
                    f'Contact("foot", {names[-1]!r}, "sphere", 0.01).'
                )
            drives = []
            for i, element in enumerate(chain.elements):
                for field in Row.VARIABLES:
                    value = getattr(element, field)
                    if isinstance(value, Joint):
                        turns, before = field in Row.ANGLES, field in ("theta", "d")
                        drives.append(_Drive(robot.joint_index(value.name), value.scale, i, turns, before))
                    elif not isinstance(value, float):
                        raise InputError(f"{where}: a wheel radius is no joint of a leg.")
            columns = np.array(sorted({d.column for d in drives if robot.actuated[d.column]}), dtype=np.int64)
            if len(columns) != 3:
                raise InputError(f"{where}: needs three actuated joints, has {len(columns)}.")
            contact, ball = balls[0]
            frames = (0, *(robot.frame_index(name) for name in names))
            legs.append(
                Leg(robot, chain.name, contact, frames[-1], np.array(ball.start), ball.radius, columns, tuple(drives),
                    frames)
            )  # fmt: skip
        used = [column for leg in legs for column in {drive.column for drive in leg.drives}]
        twice = next((column for column in used if used.count(column) > 1), None)
        if twice is not None:
            raise InputError(f"Crawl: joint {robot.joints[twice]!r} of {robot.name!r} moves two legs at once.")
        if len(legs) < 3:
            raise InputError(f"Crawl: needs three legs at least, {robot.name!r} has {len(legs)}.")
        for leg in legs:
            if not leg.postures[2].any():
                raise InputError(f"Crawl: the joints of leg {leg.name!r} cannot move its foot in all directions.")
        return cls(robot, tuple(legs))

    @cached_property
    def roots(self) -> Array:
        """(m, 3) m: where the first actuated joint of every leg is, in the base, at q = 0."""
        poses = self.robot.forward(np.zeros(self.robot.n)).array[None]
        out = []
        for leg in self.legs:
            _, place, _, _ = leg.jacobian(poses)
            first = next(k for k, drive in enumerate(leg.drives) if drive.column in leg.columns)
            out.append(place[0, first])
        return np.array(out)

    def feet(self, q: Array) -> Array:
        """(T, m, 3) m: centres of the balls in the base frame."""
        poses = self.robot.forward(q).array
        return np.stack(
            [poses[:, leg.frame, :3] + rotate(poses[:, leg.frame, 3:], leg.local) for leg in self.legs], axis=1
        )

    def place(self, targets: Array, guess: Array) -> tuple[Array, BoolArray]:
        """Joint coordinates (T, n) that put the balls at ``targets`` (T, m, 3) in the base frame, from a ``guess``
        (n,); and which feet (T, m) came there, with legs that can still move in all directions and are bent to the
        same side as in the guess. What a sample gets does not depend on the others."""
        q, placed = np.empty((len(targets), self.robot.n)), np.empty(targets.shape[:2], dtype=bool)
        leg_kernel.place(self.tables, self.postures, np.ascontiguousarray(targets), guess, q, placed)
        return q, placed

    def rates(self, q: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Exact joint rates and accelerations (T, n) for feet that move with ``velocity`` and ``acceleration``
        (T, m, 3) in the base frame."""
        qd, qdd = np.zeros_like(q), np.zeros_like(q)
        at, speed, gain = (np.ascontiguousarray(v) for v in (q, velocity, acceleration))
        leg_kernel.rates(self.tables, at, speed, gain, qd, qdd)
        return qd, qdd

    @cached_property
    def tables(self) -> Tables:
        """What kernels read."""
        robot, legs = self.robot, self.legs
        frames, masses, centres = mass_points(robot)
        weight, middle = np.zeros(len(robot.frames)), np.zeros((len(robot.frames), 3))
        weight[frames], middle[frames] = masses, centres
        rows = [
            (leg, chain, i) for leg, chain in zip(legs, robot.chains, strict=True) for i in range(len(chain.elements))
        ]
        joints, slots = np.full((len(rows), 4), -1), np.full((len(rows), 4), -1)
        values, scales = np.zeros((len(rows), 4)), np.zeros((len(rows), 4))
        for k, (leg, chain, i) in enumerate(rows):
            for v, name in enumerate(Row.VARIABLES):
                value = getattr(chain.elements[i], name)
                if isinstance(value, Joint):
                    joints[k, v], values[k, v], scales[k, v] = robot.joint_index(value.name), value.offset, value.scale
                    mine = np.flatnonzero(leg.columns == joints[k, v])
                    slots[k, v] = mine[0] if len(mine) else -1
                else:
                    values[k, v] = float(value)
        after = np.array([leg.frames[i + 1] for leg, _, i in rows], dtype=np.int64)
        return Tables(
            _starts([len(leg.frames) - 1 for leg in legs]),
            joints.astype(np.int64),
            slots.astype(np.int64),
            values,
            scales,
            np.stack([turn(values[:, v]) for v in (0, 3) for turn in (np.cos, np.sin)], axis=1),
            weight[after],
            middle[after],
            np.stack([leg.columns for leg in legs]),
            np.stack([leg.local for leg in legs]),
            np.array([weight[0], *middle[0]]),
        )

    @cached_property
    def postures(self) -> Postures:
        """Those of all legs, for kernels."""
        parts = [leg.postures for leg in self.legs]
        starts = _starts([len(part[0]) for part in parts])
        sets, feet, sides = (np.concatenate([part[k] for part in parts]) for k in range(3))
        return Postures(starts, sets, feet, sides)


def _starts(counts: list[int]) -> IntArray:
    return np.array([0, *np.cumsum(counts)], dtype=np.int64)


@lru_cache(maxsize=16)
def legs_of(robot: Robot) -> Legs:
    """:meth:`Legs.of`, remembered."""
    return Legs.of(robot)


def cross(a: Array, b: Array) -> Array:
    """Cross products (..., 3), several times as fast as NumPy's for few of them."""
    a0, a1, a2 = a[..., 0], a[..., 1], a[..., 2]
    b0, b1, b2 = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def direction(quaternion: Array, upright: bool) -> Array:
    """The z axis (T, 3) of frames turned by ``quaternion`` (T, 4) wxyz, or else their x axis."""
    w, x, y, z = quaternion.T
    if upright:
        parts = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
    else:
        parts = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
    return np.stack(parts, axis=1)


def bent(square: Array) -> IntArray:
    """(T,) 1 or -1: to which side a leg is bent, the sign of the determinant of ``square`` (T, 3, 3); 0 where it is
    singular and the leg changes sides, as with its knee straight."""
    volume = np.einsum("ti,ti->t", square[..., 0], cross(square[..., 1], square[..., 2]))
    size = np.prod(np.linalg.norm(square, axis=1), axis=1)
    return np.where(np.abs(volume) > SINGULAR * size, np.sign(volume), 0.0).astype(np.int64)


def stance_guess(legs: Legs, targets: Array) -> Array:
    """Joint coordinates (n,) from which Newton finds legs with their knees up: the best of each leg's postures for its
    foot at ``targets`` (m, 3) m in the base."""
    q = np.zeros(legs.robot.n)
    for leg, target, root in zip(legs.legs, targets, legs.roots, strict=True):
        sets, feet, sides, tops = leg.postures
        off = np.linalg.norm(feet - target, axis=1)
        off[sides == 0] = np.inf
        # of the places near enough, the one whose joints are highest: knees up
        near = off <= off.min() + 0.08 * float(np.linalg.norm(target - root))
        q[leg.columns] = sets[int(np.where(near, tops, -np.inf).argmax())]
    return q


@lru_cache(maxsize=32)
def stance_of(legs: Legs, places: bytes) -> Array:
    """Joints (n,) of a stance with knees up and feet at ``places``, the bytes of (m, 3) m in the base, as near as can
    be; remembered."""
    targets = np.frombuffer(places).reshape(-1, 3).copy()
    q, _ = legs.place(targets[None], stance_guess(legs, targets))
    return frozen(q[0])
