"""Legs of a walking robot: feet on chains of the extended D-H table, and the joints that put them in place."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import InputError
from bodyplan.robot.elements import Joint, Row
from bodyplan.robot.model import Robot
from bodyplan.spatial import rotate

#: most steps of Newton, and after how many that do not halve the error it gives up; the error in m at which a foot is
#: in place; the longest step of a joint (rad, or m)
STEPS, PATIENCE, PLACED, STRIDE = 60, 15, 1e-13, 0.3
#: smallest volume that the directions of a leg's joints span at which it can still be told its joints
SINGULAR = 1e-6
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

    def nearest(self, targets: Array, among: IntArray) -> IntArray:
        """(T,) which of the postures ``among`` has its foot nearest to ``targets`` (T, 3)."""
        _, places, _, _ = self.postures
        feet = places[among]
        far = np.sum(feet * feet, axis=1) - 2.0 * targets @ feet.T  # squared, less what all have in common
        return np.asarray(far.argmin(axis=1))

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

    def drift(self, axis: Array, place: Array, foot: Array, rates: Array) -> Array:
        """Acceleration (T, 3) of the foot where the drives change with ``rates`` (T, k) and nothing accelerates."""
        spin, out = np.zeros_like(foot), np.zeros_like(foot)
        speed = np.zeros_like(foot)  # of the foot
        turns = [drive.turns for drive in self.drives]
        for k, turning in enumerate(turns):
            speed += rates[:, k, None] * (cross(axis[:, k], foot - place[:, k]) if turning else axis[:, k])
        for k, turning in enumerate(turns):
            axis_rate = cross(spin, axis[:, k])
            if turning:
                # the joint's own place, carried by the joints before it
                carried = np.zeros_like(foot)
                for j in range(k):
                    part = cross(axis[:, j], place[:, k] - place[:, j]) if turns[j] else axis[:, j]
                    carried += rates[:, j, None] * part
                change = cross(axis_rate, foot - place[:, k]) + cross(axis[:, k], speed - carried)
                spin = spin + rates[:, k, None] * axis[:, k]
            else:
                change = axis_rate
            out += rates[:, k, None] * change
        return out

    def drive_rates(self, qd: Array) -> Array:
        """(T, k) rates of the drives for joint rates ``qd`` (T, n)."""
        return np.stack([drive.scale * qd[:, drive.column] for drive in self.drives], axis=1)


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
        q = np.repeat(guess[None], len(targets), axis=0)
        placed = np.zeros(targets.shape[:2], dtype=bool)
        for j, leg in enumerate(self.legs):
            sets, _, sides, _ = leg.postures
            side = self._side(leg, guess)
            q[:, leg.columns], placed[:, j] = self._newton(leg, targets[:, j], q, side)
            lost = np.flatnonzero(~placed[:, j])
            mine = np.flatnonzero(sides == side)
            if len(lost) and len(mine):
                again = q[lost]
                again[:, leg.columns] = sets[mine[leg.nearest(targets[lost, j], mine)]]
                found, came = self._newton(leg, targets[lost, j], again, side)
                q[np.ix_(lost[came], leg.columns)] = found[came]
                placed[lost[came], j] = True
        return q, placed

    def _side(self, leg: Leg, q: Array) -> int:
        _, _, _, columns = leg.jacobian(self.robot.forward(q[None]).array)
        return int(bent(leg.square(columns))[0])

    def _newton(self, leg: Leg, targets: Array, start: Array, side: int) -> tuple[Array, BoolArray]:
        """The joints (T, 3) of one leg for its foot at ``targets`` (T, 3), from the coordinates ``start`` (T, n); and
        whether they put it there, bent to ``side``."""
        q, found = start.copy(), start[:, leg.columns]
        best, sides = np.full(len(targets), np.inf), np.zeros(len(targets), dtype=np.int64)
        scale = max(1.0, float(np.abs(targets).max(initial=0.0)))
        rows, idle = np.arange(len(q)), np.zeros(len(q), dtype=np.int64)
        for _ in range(STEPS):
            _, _, foot, columns = leg.jacobian(self.robot.forward(q[rows]).array)
            off, square = targets[rows] - foot, leg.square(columns)
            size = np.linalg.norm(off, axis=1)
            better = size < best[rows]
            idle[rows] = np.where(size < 0.5 * best[rows], 0, idle[rows] + 1)
            kept = rows[better]
            found[kept], best[kept], sides[kept] = q[np.ix_(kept, leg.columns)], size[better], bent(square)[better]
            rest = (best[rows] > PLACED * scale) & (idle[rows] < PATIENCE)
            rows = rows[rest]
            if not len(rows):
                break
            step, _ = solved(square[rest], off[rest])
            longest = np.abs(step).max(axis=1, keepdims=True)
            q[np.ix_(rows, leg.columns)] += step * np.minimum(1.0, STRIDE / np.maximum(longest, 1e-300))
        return found, (best <= 100.0 * PLACED * scale) & (sides == side) & (sides != 0)

    def rates(self, q: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Exact joint rates and accelerations (T, n) for feet that move with ``velocity`` and ``acceleration``
        (T, m, 3) in the base frame."""
        poses = self.robot.forward(q).array
        qd, qdd = np.zeros_like(q), np.zeros_like(q)
        for j, leg in enumerate(self.legs):
            axis, place, foot, columns = leg.jacobian(poses)
            square = leg.square(columns)
            qd[:, leg.columns], _ = solved(square, velocity[:, j])
            drift = leg.drift(axis, place, foot, leg.drive_rates(qd))
            qdd[:, leg.columns], _ = solved(square, acceleration[:, j] - drift)
        return qd, qdd


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


def solved(square: Array, wanted: Array) -> tuple[Array, BoolArray]:
    """(x (T, 3), regular (T,)) of ``square`` (T, 3, 3) x = ``wanted`` (T, 3): by Cramer's rule, or the least x of least
    error where the columns are all but in a plane and ``regular`` is False."""
    one, two, three = (square[..., k] for k in range(3))
    normals = np.stack([cross(two, three), cross(three, one), cross(one, two)], axis=1)
    volume = np.sum(one * normals[:, 0], axis=1)
    regular = bent(square) != 0
    x = np.einsum("tij,tj->ti", normals, wanted) / np.where(regular, volume, 1.0)[:, None]
    flat = np.flatnonzero(~regular)
    if len(flat):
        x[flat] = np.einsum("tij,tj->ti", np.linalg.pinv(square[flat], rcond=SINGULAR), wanted[flat])
    return x, np.asarray(regular)


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
