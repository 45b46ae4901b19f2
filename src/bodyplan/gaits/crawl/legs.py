"""Legs of a walking robot: feet on chains of the extended D-H table, and the joints that put them in place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.errors import InputError
from bodyplan.robot.elements import Joint, Row
from bodyplan.robot.model import Robot
from bodyplan.spatial import rotate

#: most steps of Newton, the error in m at which a foot is in place, and the longest step of a joint (rad, or m)
STEPS, PLACED, STRIDE = 60, 1e-13, 0.3
#: smallest share of a Jacobian's largest singular value at which a leg can still be told its joints
SINGULAR = 1e-6


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

    def jacobian(self, poses: Array) -> tuple[Array, Array, Array, Array]:
        """(axes (T, k, 3), places (T, k, 3), foot (T, 3), columns (T, 3, k)) of the k drives at ``poses`` (T, F, 7)."""
        axes, places = [], []
        for drive in self.drives:
            at = poses[:, self.frames[drive.element if drive.before else drive.element + 1]]
            axes.append(rotate(at[:, 3:], np.array([0.0, 0.0, 1.0] if drive.before else [1.0, 0.0, 0.0])))
            places.append(at[:, :3])
        foot = poses[:, self.frame, :3] + rotate(poses[:, self.frame, 3:], self.local)
        axis, place = np.stack(axes, axis=1), np.stack(places, axis=1)
        turns = np.array([drive.turns for drive in self.drives])
        columns = np.where(turns[:, None], np.cross(axis, foot[:, None] - place), axis)
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
            speed += rates[:, k, None] * (np.cross(axis[:, k], foot - place[:, k]) if turning else axis[:, k])
        for k, turning in enumerate(turns):
            axis_rate = np.cross(spin, axis[:, k])
            if turning:
                # the joint's own place, carried by the joints before it
                carried = np.zeros_like(foot)
                for j in range(k):
                    part = np.cross(axis[:, j], place[:, k] - place[:, j]) if turns[j] else axis[:, j]
                    carried += rates[:, j, None] * part
                change = np.cross(axis_rate, foot - place[:, k]) + np.cross(axis[:, k], speed - carried)
                spin = spin + rates[:, k, None] * axis[:, k]
            else:
                change = axis_rate
            out += rates[:, k, None] * change
        return out

    def drive_rates(self, qd: Array) -> Array:
        """(T, k) rates of the drives for joint rates ``qd`` (T, n)."""
        return np.stack([drive.scale * qd[:, drive.column] for drive in self.drives], axis=1)


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
                raise InputError(f"{where}: needs one ball contact on its last frame, has {len(balls)}.")
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
        if len(legs) < 3:
            raise InputError(f"Crawl: needs three legs at least, {robot.name!r} has {len(legs)}.")
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
        """Joint coordinates (T, n) that put the balls at ``targets`` (T, m, 3) in the base frame, from a ``guess`` (n,)
        or (T, n); and which feet (T, m) came there."""
        q = np.array(np.broadcast_to(guess, (len(targets), self.robot.n)))
        best, found = np.full(targets.shape[:2], np.inf), q.copy()
        for _ in range(STEPS):
            poses = self.robot.forward(q).array
            worst = 0.0
            for j, leg in enumerate(self.legs):
                _, _, foot, columns = leg.jacobian(poses)
                off = targets[:, j] - foot
                size = np.linalg.norm(off, axis=1)
                better = size < best[:, j]
                found[np.ix_(better, leg.columns)] = q[np.ix_(better, leg.columns)]
                best[:, j] = np.minimum(best[:, j], size)
                worst = max(worst, float(size[better].max(initial=0.0)))
                step = np.einsum("tij,tj->ti", np.linalg.pinv(leg.square(columns), rcond=SINGULAR), off)
                longest = np.abs(step).max(axis=1, keepdims=True)
                q[:, leg.columns] += step * np.minimum(1.0, STRIDE / np.maximum(longest, 1e-300))
            if worst <= PLACED:
                break
        scale = float(np.abs(targets).max(initial=1e-3))
        return found, best <= 1e-11 * scale + PLACED

    def rates(self, q: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Exact joint rates and accelerations (T, n) for feet that move with ``velocity`` and ``acceleration``
        (T, m, 3) in the base frame."""
        poses = self.robot.forward(q).array
        qd, qdd = np.zeros_like(q), np.zeros_like(q)
        for j, leg in enumerate(self.legs):
            axis, place, foot, columns = leg.jacobian(poses)
            square = leg.square(columns)
            qd[:, leg.columns] = np.linalg.solve(square, velocity[:, j, :, None])[..., 0]
            drift = leg.drift(axis, place, foot, leg.drive_rates(qd))
            qdd[:, leg.columns] = np.linalg.solve(square, (acceleration[:, j] - drift)[..., None])[..., 0]
        return qd, qdd


def stance_guess(legs: Legs, reach: Sequence[float]) -> Array:
    """Joint coordinates (n,) from which Newton finds legs with their knees up: the best of a coarse grid of each leg's
    joints for a foot at ``reach`` (outward, up) m from its root."""
    robot = legs.robot
    q = np.zeros(robot.n)
    for j, leg in enumerate(legs.legs):
        out = legs.roots[j].copy()
        out[2] = 0.0
        size = float(np.linalg.norm(out))
        way = out / size if size > 0.0 else np.array([1.0, 0.0, 0.0])
        wanted = legs.roots[j] + reach[0] * way + [0.0, 0.0, reach[1]]
        limits = np.clip(robot.limits[leg.columns], -np.pi, np.pi)
        axes = [np.linspace(low, high, 13) for low, high in limits]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        tried = np.zeros((len(grid), robot.n))
        tried[:, leg.columns] = grid
        poses = robot.forward(tried).array
        _, places, foot, _ = leg.jacobian(poses)
        off = np.linalg.norm(foot - wanted, axis=1)
        # of the places near enough, the one whose joints are highest: knees up
        near = off <= off.min() + 0.08 * float(np.linalg.norm(reach))
        height = np.where(near, places[..., 2].max(axis=1), -np.inf)
        q[leg.columns] = grid[int(height.argmax())]
    return q
