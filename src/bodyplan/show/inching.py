"""A snake that inches on its anchors, as a report shows it: from forward kinematics and the contacts of the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.check.claims import support_of
from bodyplan.errors import BodyplanError, InputError
from bodyplan.gaits.rectilinear import Rectilinear, UnderCeiling, under_ceilings
from bodyplan.gaits.rectilinear.course import room_above
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.ground import Plane, Profile
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion, times
from bodyplan.plan import plan
from bodyplan.robot.library import snake as ready_snake
from bodyplan.robot.masses import center_from_poses
from bodyplan.robot.model import Robot
from bodyplan.show.stages import Stage, cycle_number
from bodyplan.spatial import apply

#: heights in the table of speeds, as shares of the shortest link, and how few where rate limits make each a search
LOWEST, HEIGHTS, FEW_HEIGHTS = 0.25, 11, 4
#: most anchors for which the whole table is made
MANY_ANCHORS = 7
#: m: a margin this far below 0 is rounding
EXACT = 1e-9


@dataclass(frozen=True, eq=False)
class Levels:
    """Heights ``z`` (k + 1,) m along the way with steps at ``breaks`` (k,) m; inf where it is open."""

    breaks: Array
    z: Array

    def between(self, low: float, high: float) -> list[tuple[float, float, float]]:
        """(start, end, z) of every level from ``low`` to ``high`` m."""
        starts, ends = np.append(low, self.breaks), np.append(self.breaks, high)
        found = zip(np.clip(starts, low, high), np.clip(ends, low, high), self.z, strict=True)
        return [(float(a), float(b), float(z)) for a, b, z in found if b > a]


@dataclass(frozen=True)
class NotShown:
    """Why there is nothing to show of a motion that inches."""

    problem: str


@dataclass(frozen=True, eq=False)
class Inching:
    """``points`` (T, 2 N + 1, 2) m along the way and up at times ``t`` (T,) s from the beginning: tail end, the 2 N - 1
    pitch joints in use (anchor, elbow, anchor, ...), head end; ``places`` (T, N, 3) m of the anchors in the world;
    ``standing`` (T, N); ``centre`` (T, 2) m of mass with the ends ``rear``, ``front`` (T,) m of what carries it, None
    where nobody can tell. ``way`` (T, 3): the direction along which all of this is seen. ``floor``, ``ceiling``:
    see :class:`Levels`. ``moves``: those of one cycle, or all where it does not repeat (not ``cyclic``)."""

    motion: Motion
    gait: Rectilinear
    snake: InchingSnake
    track: Track
    t: Array
    way: Array
    points: Array
    places: Array
    standing: BoolArray
    centre: Array | None
    rear: Array
    front: Array
    floor: Levels
    ceiling: Levels
    moves: tuple[Stage, ...]
    cyclic: bool

    @classmethod
    def of(cls, motion: Motion, span: float, cyclic: bool) -> Inching | NotShown | None:
        """Of ``span`` s from the motion's beginning (``cyclic``: a cycle); None for another gait."""
        if motion.gait.get("kind") != Rectilinear.kind:
            return None
        robot = motion.robot
        try:
            gait = Rectilinear(**{k: v for k, v in motion.gait.items() if k != "kind"})
            snake = InchingSnake.of(robot, gait.anchors, gait.joints)
            track = Track.of(motion.ground, gait.start, gait.heading)
        except (BodyplanError, TypeError) as error:  # a report is worth having without this part
            return NotShown(str(error))
        t = motion.t - motion.t[0]
        t = t[t <= span * (1.0 + 1e-9)]
        size = len(t)
        poses = robot.forward(motion.q[:size], motion.base[:size])
        way = _ways(motion, track.along)[:size]
        frames = [0, *(robot.frame_index(name) for name in snake.frames), len(robot.frames) - 1]
        world = poses.positions[:, frames]
        points = np.stack([np.einsum("tpk,tk->tp", world, way), world[..., 2]], axis=-1)
        floor, ceiling = _levels(motion.ground, track)
        centre, rear, front = None, np.zeros(size), np.zeros(size)
        if motion.contacts is not None and robot.mass > 0.0 and any(snake.contacts[0::2]):
            centre = np.zeros((size, 2))
            centre[:, 1] = center_from_poses(robot, poses.array)[:, 2]
            for along in np.unique(way, axis=0):
                mine = np.flatnonzero((way == along).all(axis=1))
                rear[mine], centre[mine, 0], front[mine] = support_of(motion, along, mine)
        first = motion.t[0]
        moves = [(name, a - first, b - first) for name, a, b in motion.stages if a - first < span * (1.0 - 1e-9)]
        return cls(
            motion,
            gait,
            snake,
            track,
            t,
            way,
            points,
            world[:, 1:-1:2],
            _standing(motion, snake, points, floor),
            centre,
            rear,
            front,
            floor,
            ceiling,
            tuple(sorted(moves, key=lambda move: move[1])),
            cyclic,
        )

    @property
    def anchors(self) -> Array:
        """(T, N, 2) m."""
        return self.points[:, 1:-1:2]

    @property
    def elbows(self) -> Array:
        """(T, N - 1, 2) m."""
        return self.points[:, 2:-2:2]

    @cached_property
    def margin(self) -> Array | None:
        """(T,) m from the centre of mass to the nearer end of what carries it; negative where the snake tips."""
        if self.centre is None:
            return None
        return np.asarray(np.minimum(self.centre[:, 0] - self.rear, self.front - self.centre[:, 0]))

    def tips(self, k: int) -> str:
        """ "forward" or "backward" where the centre of mass is beyond the standing anchors at sample k, else ""."""
        if self.margin is None or self.centre is None or self.margin[k] >= -EXACT:
            return ""
        return "forward" if self.front[k] - self.centre[k, 0] < self.centre[k, 0] - self.rear[k] else "backward"

    def inside(self, move: Stage) -> IntArray:
        """Samples of a move, its ends included."""
        slack = 1e-9
        return np.flatnonzero((self.t >= move[1] - slack) & (self.t <= move[2] + slack))

    def sample(self, t: float) -> int:
        """The sample nearest to t s."""
        return int(np.abs(self.t - t).argmin())

    def move_at(self, t: float) -> str:
        """Name of the move at t s."""
        return next((name for name, a, b in self.moves if a - 1e-9 <= t < b - 1e-9), "")

    @cached_property
    def drives(self) -> Array:
        """(cycles, N) m: how far each anchor goes in every whole cycle, along the way at its beginning."""
        groups: dict[int, list[Stage]] = {}
        for move in self.moves:
            groups.setdefault(cycle_number(move[0]), []).append(move)
        size = max((len(group) for group in groups.values()), default=0)
        ends = [(self.sample(g[0][1]), self.sample(g[-1][2]), g) for g in groups.values()]
        last = max(groups, default=0)
        out = [
            (self.places[b] - self.places[a]) @ self.way[a]
            for (a, b, group), number in zip(ends, groups, strict=True)
            if group[-1][2] <= self.t[-1] + 1e-9 and (number != last or len(group) == size)
        ]
        return np.array(out).reshape(len(out), self.gait.anchors)

    @property
    def room(self) -> float:
        """m above the line of the anchors' axes that gait and level ground leave for the elbows; inf: open."""
        return float(room_above(self.gait, self.snake, self.track))

    @cached_property
    def even_gait(self) -> Rectilinear:
        """The gait of the table of speeds: this one, with straight legs where its own differ in length."""
        options = {k: v for k, v in self.gait.to_dict().items() if k not in ("kind", "steer")}
        if np.ptp(self.gait.spacing) > 0.0:
            options["spacing"] = 1.0
        return Rectilinear(**options)

    @cached_property
    def under(self) -> list[UnderCeiling]:
        """Speeds over level ground under lower and higher ceilings."""
        limited = bool(np.isfinite(self.motion.robot.rates[self.snake.columns]).any())
        count = FEW_HEIGHTS if limited or self.gait.anchors > MANY_ANCHORS else HEIGHTS
        heights = np.linspace(LOWEST, 1.0, count) * float(self.snake.links.min())
        return _under(self.motion.robot, self.even_gait, tuple(heights.tolist()))

    @cached_property
    def five(self) -> FiveAnchors | None:
        """What five anchors in two phases give on such links."""
        return FiveAnchors.like(self)

    def ceiling_gap(self, poses: Array) -> Array | None:
        """(k,) m from the body, whose frames have ``poses`` (k, f, 7), up to the ceiling of the ground; None where it
        is open."""
        above = _ceiling_alone(self.motion.ground)
        if above is None:
            return None
        robot, gap = self.motion.robot, np.full(len(poses), np.inf)
        for contact in robot.contacts:
            at = apply(poses[:, robot.frame_index(contact.frame), None], contact.points())
            ends = at[:, [0, -1]] if contact.shape in ("capsule", "sphere") else np.stack([at, at], axis=2)
            near = above.segment_clearance(ends) - contact.radius
            gap = np.minimum(gap, near.reshape(len(poses), -1).min(axis=1))
        return gap


@dataclass(frozen=True)
class FiveAnchors:
    """Five anchors in two phases on links as long and as heavy: the support ``margin`` m with legs of ``spacing`` m at
    most and strides of ``stride`` m."""

    margin: float
    spacing: float
    stride: float

    @classmethod
    def like(cls, found: Inching) -> FiveAnchors | None:
        """With the longest leg of ``found`` and its mean drive, or what such legs allow; None where they do not go."""
        robot, link = found.motion.robot, float(found.snake.links.mean())
        drives = found.drives
        if robot.mass <= 0.0 or not len(drives):
            return None
        chords = np.diff(found.anchors[..., 0], axis=1)
        spacing, stride = float(chords.max()), float(drives.mean())
        length = found.snake.tail + float(found.snake.links.sum()) + found.snake.head
        half, foot = 0.5 * link, 0.01 * link
        made = ready_snake(
            18, half, axes="alternating", first="pitch", foot_radius=foot, mass=robot.mass / length * half
        )
        lift = found.gait.lift_of(found.snake.demands(np.inf))
        for drive in ([stride] * 5, "fastest"):
            try:
                gait = Rectilinear(
                    5, schedule="two-phase", drive=drive, spacing=min(0.5 * spacing / link, 1.0), lift=lift
                )
                period = gait.period(made)
                if period is None:
                    continue
                motion = plan(made, gait, Plane(), times(0.0, period, period / 200))
            except InputError:
                continue
            if motion.ok:
                facts = motion.facts
                return cls(facts["support_margin"], facts["spacing_1_length"], facts["advance_per_cycle"])
        return None


@lru_cache(maxsize=4)
def _under(robot: Robot, gait: Rectilinear, heights: tuple[float, ...]) -> list[UnderCeiling]:
    """Speeds under ceilings, a search each; kept for the report of another motion of the same robot and gait."""
    return under_ceilings(robot, gait, heights)


def _ways(motion: Motion, along: Array) -> Array:
    """(T, 3) unit vectors: along which the claims of support look, else ``along``."""
    out = np.tile(along, (len(motion.t), 1))
    for claim in motion.claims:
        if claim.kind == "supported":
            start, end = float(claim.data.get("start", -np.inf)), float(claim.data.get("end", np.inf))
            out[(motion.t >= start) & (motion.t <= end)] = claim.data["along"]
    return out


def _standing(motion: Motion, snake: InchingSnake, points: Array, floor: Levels) -> BoolArray:
    """(T, N) True for the anchors that carry."""
    mine: Sequence[tuple[int, ...]] = snake.contacts[0::2]
    if motion.contacts is not None and all(mine):
        return np.stack([motion.contacts[: len(points), list(k)].max(axis=1) > 0.5 for k in mine], axis=1)
    anchors = points[:, 1:-1:2]
    z = floor.z[np.searchsorted(floor.breaks, anchors[..., 0])]
    return np.asarray(anchors[..., 1] <= z + snake.rest + 1e-6 * float(snake.links.max()))


def _levels(ground: Ground, track: Track) -> tuple[Levels, Levels]:
    """Floor and ceiling along the way."""
    if track.level:
        return Levels(np.zeros(0), np.array([track.floor])), Levels(np.zeros(0), np.array([track.ceiling]))
    breaks = track.breaks + track.origin[0]
    middles = 0.5 * (np.append(breaks[0] - 1.0, breaks) + np.append(breaks, breaks[-1] + 1.0))
    floor = ground.height(middles, 0.0 * middles)
    ceiling = ground.ceiling_height(middles) if isinstance(ground, Profile) else np.full(len(middles), np.inf)
    return Levels(breaks, floor), Levels(breaks, ceiling)


def _ceiling_alone(ground: Ground) -> Profile | None:
    """The ceiling of a profile over a floor that nothing comes near; None where there is none."""
    levels = ground.to_dict().get("ceiling") if isinstance(ground, Profile) else None
    if levels is None:
        return None
    heights = [levels] if isinstance(levels, (int, float)) else [z for _, z in levels if z is not None]
    return Profile(min(heights) - 1e3, levels) if heights else None
