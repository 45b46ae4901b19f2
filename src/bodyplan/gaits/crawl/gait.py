"""A statically stable crawl on uneven ground: one leg swings, the others stand around the centre of mass."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError, Status, UnknownNameError
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.crawl.legs import Legs, legs_of
from bodyplan.gaits.crawl.motion import motion_of, paces
from bodyplan.gaits.crawl.planner import Plan, Planner
from bodyplan.gaits.crawl.steps import Course
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot

STABILITIES = ("margin", "barrier", "most")
FOOTHOLDS = ("nearest", "search")
BODIES = ("level", "follow")
#: s of a step, sway and swing, where the user names no cycle time; longest stride as a share of a leg, and of the
#: distance of two feet, which should not get into each other's way
STEP_TIME, STRIDE, APART = 3.0, 0.35, 0.7
#: share of the time in which some leg swings, if joints are fast enough: they have ROOM below their limits on level
#: ground; and what the share may be where they are not
SWINGING, ROOM, BOUNDS = 0.6, 0.85, (0.4, 0.85)
#: share of a foot's radius that links and body keep off the ground
KEEP = 0.5
#: shares of a leg: height of the body and outward reach of the feet; height of a step, support margin and radius of a
#: search for footholds (50, 20 and 50 mm for SILO4's 540 mm)
HEIGHT, REACH, STEP_HEIGHT, MARGIN, SEARCH = 0.385, 0.333, 5.0 / 54.0, 2.0 / 54.0, 5.0 / 54.0


class Crawl(Gait):
    """A crawl: leg after leg swings while the body rests, and the body moves while all feet stand. Feet that stand do
    not move at all; rates and accelerations of the joints are exact and vanish between the phases.

    ``velocity`` (ahead, to the left) m/s in the body's heading and ``yaw_rate`` rad/s: of the steady motion (a third
    number, up, must be 0: the ground says it). ``cycle_time`` s in which every leg swings once (default: 3 s a leg, or
    less where the stride would be longer than 0.35 of a leg or 0.7 of the distance of two feet). ``duty``: share of
    the cycle that a foot stands, above 1 - 1/m for m legs (default 1 - 0.6/m: the body moves in 40 % of the time;
    between 1 - 0.4/m and 1 - 0.85/m where joints would else be too fast on level ground). ``sequence``: names of the
    legs in the order in which they swing (default: from the rear to the front on the left, then on the right, as seen
    in the direction of travel).

    ``sway``: "auto", or the share (0: none) of the way from where the body would be to the centroid of the feet that
    stand. ``stability``: how much sway "auto" takes: "margin", the least that keeps the centre of mass ``margin`` m
    (default 0.037 of a leg) inside the support all the time of a swing; "barrier", the most of the sum of logarithms of
    the distances from the edges less a cost of sway; "most", the largest margin.

    ``step_height`` m of a swing over its straight line (default 0.093 of a leg); more where the ground demands it.
    ``clearance`` m that links and body keep off the ground where the robot has shapes for them (``shell``; default half
    of a foot's radius; at most 3/4 of what they have on level ground: nothing for a shin that ends in its foot). Swings
    are raised for it, other footholds within the search chosen, and the body raised.
    ``foothold``: "nearest", where the foot should be, or "search" within ``search_radius`` m (default 0.093 of a leg)
    for ground no steeper than ``max_slope`` rad, if it can be with neither riser nor edge within the foot's radius.
    ``height`` m of the body's frame over the feet's plane (default 0.385 of a leg), ``reach`` m of the feet outward
    from their legs' roots (default 0.333). ``body``: "level", or "follow" the plane of the feet. ``start`` (x, y) m and
    ``heading`` rad at time 0.

    The centre of mass is that of the whole robot, swinging leg included. Statuses, from the time on when a step cannot
    be made: ``tips_over`` (no sway gives the margin), ``out_of_reach``, ``no_contact`` (no foothold), ``below_floor``
    (no way over the ground for a foot, a link or the body), ``links_crossing`` (two of them would be in each other),
    and ``limit`` where a joint is beyond its limits or too fast; ``motion.notes`` say which
    leg. Raises InputError for values out of range and for robots whose chains are not legs with three actuated joints.
    """

    kind: ClassVar[str] = "crawl"
    UNITS: ClassVar[Mapping[str, str]] = {
        "velocity": "speed",
        "yaw_rate": "angular_rate",
        "step_height": "length",
        "cycle_time": "time",
        "margin": "length",
        "clearance": "length",
        "max_slope": "angle",
        "search_radius": "length",
        "height": "length",
        "reach": "length",
        "start": "length",
        "heading": "angle",
    }

    def __init__(
        self,
        velocity: Sequence[float] = (0.01, 0.0),
        yaw_rate: float = 0.0,
        *,
        step_height: float | None = None,
        cycle_time: float | None = None,
        duty: float | None = None,
        sequence: Sequence[str] | None = None,
        sway: Any = "auto",
        stability: str = "margin",
        margin: float | None = None,
        clearance: float | None = None,
        foothold: str = "nearest",
        search_radius: float | None = None,
        max_slope: float = 0.6,
        height: float | None = None,
        reach: float | None = None,
        body: str = "level",
        start: Sequence[float] = (0.0, 0.0),
        heading: float = 0.0,
    ) -> None:
        given = finite(velocity, "velocity")
        if given.shape not in ((2,), (3,)) or (given.shape == (3,) and given[2] != 0.0):
            raise InputError(f"velocity: expected (ahead, left) in m/s, and 0 if there is a third, got {velocity!r}.")
        self.velocity = (float(given[0]), float(given[1]))
        self.yaw_rate = number(yaw_rate, "yaw_rate")
        self.step_height = None if step_height is None else number(step_height, "step_height", above=0.0)
        self.cycle_time = None if cycle_time is None else number(cycle_time, "cycle_time", above=0.0)
        self.duty = None if duty is None else number(duty, "duty", above=0.0, below=1.0)
        self.sequence: tuple[str, ...] | None = None
        if sequence is not None:
            listed = isinstance(sequence, Sequence) and not isinstance(sequence, str)
            if not listed or not all(isinstance(name, str) for name in sequence):
                raise InputError(f"sequence: expected names of legs, got {sequence!r}.")
            self.sequence = tuple(sequence)
        self.sway: str | float = "auto"
        if isinstance(sway, str):
            if sway != "auto":
                raise UnknownNameError("sway", sway, ("auto",))
        else:
            self.sway = number(sway, "sway", at_least=0.0, at_most=1.0)
        for name, value, valid in (
            ("stability", stability, STABILITIES),
            ("foothold", foothold, FOOTHOLDS),
            ("body", body, BODIES),
        ):
            if value not in valid:
                raise UnknownNameError(name, value, valid)
        self.stability, self.foothold, self.body = stability, foothold, body
        self.margin = None if margin is None else number(margin, "margin")
        self.clearance = None if clearance is None else number(clearance, "clearance", at_least=0.0)
        self.search_radius = None if search_radius is None else number(search_radius, "search_radius", above=0.0)
        self.max_slope = number(max_slope, "max_slope", above=0.0, below=0.5 * np.pi)
        self.height = None if height is None else number(height, "height", above=0.0)
        self.reach = None if reach is None else number(reach, "reach")
        x, y = finite(start, "start", (2,))
        self.start = (float(x), float(y))
        self.heading = number(heading, "heading")

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {
            "kind": self.kind,
            "velocity": list(self.velocity),
            "yaw_rate": self.yaw_rate,
            "step_height": self.step_height,
            "cycle_time": self.cycle_time,
            "duty": self.duty,
            "sequence": None if self.sequence is None else list(self.sequence),
            "sway": self.sway,
            "stability": self.stability,
            "margin": self.margin,
            "clearance": self.clearance,
            "foothold": self.foothold,
            "search_radius": self.search_radius,
            "max_slope": self.max_slope,
            "height": self.height,
            "reach": self.reach,
            "body": self.body,
            "start": list(self.start),
            "heading": self.heading,
        }

    def planner(self, robot: Robot, ground: Ground) -> Planner:
        """The planner for one robot and ground."""
        duty = _paced(self._on_level(), robot) if self.duty is None else self.duty
        return self._planner(robot, ground, duty)

    def _planner(self, robot: Robot, ground: Ground, duty: float) -> Planner:
        legs = legs_of(robot)
        size = self._size(legs)
        height = HEIGHT * size if self.height is None else self.height
        reach = REACH * size if self.reach is None else self.reach
        offsets = legs.roots.copy()
        out = np.linalg.norm(offsets[:, :2], axis=1)
        middle = int(out.argmin())
        if out[middle] <= 1e-9 * size:
            raise InputError(f"Crawl: leg {legs.names[middle]!r} begins in the middle of the body.")
        if out[middle] + reach <= 0.0:
            raise InputError(
                f"reach: leg {legs.names[middle]!r} begins {out[middle]:.4g} m from the middle of the body, its foot "
                f"must stay on its side of it: more than {-out[middle]:.4g}, got {reach:.4g}."
            )
        offsets[:, :2] *= ((out + reach) / out)[:, None]
        offsets[:, 2] = 0.0
        cycle = self._cycle(size, offsets[:, :2])
        swing = (1.0 - duty) * cycle
        sway = cycle / len(legs) - swing
        if sway <= 1e-9 * cycle:
            raise InputError(
                f"duty: {len(legs)} legs that swing one by one need more than {1.0 - 1.0 / len(legs):.4g}, got {duty}."
            )
        course = Course(self.velocity, self.yaw_rate, self.start, self.heading)
        search = SEARCH * size if self.search_radius is None else self.search_radius
        return Planner(
            self,
            legs,
            ground,
            course,
            order=self._order(legs),
            sway_time=sway,
            swing_time=swing,
            height=height,
            lift=STEP_HEIGHT * size if self.step_height is None else self.step_height,
            margin=MARGIN * size if self.margin is None else self.margin,
            search=search if self.foothold == "search" else 0.0,
            offsets=offsets,
            clearance=KEEP * min(leg.radius for leg in legs.legs) if self.clearance is None else self.clearance,
        )

    def _on_level(self) -> Crawl:
        """The same gait with those options that make no difference on level ground left out."""
        options = self.to_dict()
        for name in ("kind", "start", "heading", "max_slope"):
            del options[name]
        return Crawl(**options)

    def _order(self, legs: Legs) -> tuple[int, ...]:
        """Numbers of the legs in the order in which they swing: as ``sequence`` says, or from the rear to the front on
        the left, then on the right, as seen in the direction of travel. InputError where ``sequence`` is not all."""
        if self.sequence is not None:
            for name in self.sequence:
                if name not in legs.names:
                    raise UnknownNameError("leg", name, legs.names, where="Crawl: sequence")
            if sorted(self.sequence) != sorted(legs.names):
                raise InputError(f"Crawl: sequence must name every leg once, got {list(self.sequence)!r}.")
            return tuple(legs.names.index(name) for name in self.sequence)
        vx, vy = self.velocity
        x, y, _ = legs.roots.T
        if abs(vy) > abs(vx):
            along, left = np.sign(vy) * y, -np.sign(vy) * x
        else:
            sign = -1.0 if vx < 0.0 else 1.0
            along, left = sign * x, sign * y
        slack = 1e-9 * float(np.abs(legs.roots).max())
        return tuple(int(j) for j in np.lexsort((along, left < -slack)))

    def _size(self, legs: Legs) -> float:
        """Mean length of the legs, m."""
        size = float(np.mean([leg.length for leg in legs.legs]))
        if size > 0.0:
            return size
        if self.height is None or self.reach is None:
            raise InputError(f"Crawl: the legs of {legs.robot.name!r} have no length; name height and reach.")
        return float(np.hypot(self.height, self.reach))

    def _cycle(self, size: float, feet: Array) -> float:
        """s a cycle, of legs ``size`` m long with feet (m, 2) m around the middle of the body."""
        if self.cycle_time is not None:
            return self.cycle_time
        count = len(feet)
        apart = np.linalg.norm(feet[:, None] - feet + 1e9 * np.eye(count)[..., None], axis=-1).min()
        stride = min(STRIDE * size, APART * float(apart))
        speed = float(np.hypot(*self.velocity)) + abs(self.yaw_rate) * float(np.linalg.norm(feet, axis=1).max())
        longest = count * STEP_TIME
        return longest if speed * longest <= stride else stride / speed

    def period(self, robot: Robot, ground: Ground | None = None) -> float | None:
        """Time in which every leg swings once, s, on a level floor; None on other ground."""
        from bodyplan.ground.plane import Plane

        on = Plane() if ground is None else ground
        if not (isinstance(on, Plane) and not any(on.slope)):
            return None
        planner = self.planner(robot, on)
        return planner.step_time * len(planner.legs)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s."""
        from_zero(t)
        planner, plan = _planned(self, robot, ground, float(t[-1]))
        return motion_of(self, planner, plan, t, self.period(robot, ground))


@lru_cache(maxsize=8)
def _planned(gait: Crawl, robot: Robot, ground: Ground, until: float) -> tuple[Planner, Plan]:
    planner = gait.planner(robot, ground)
    return planner, planner.made(until)


@lru_cache(maxsize=32)
def _paced(gait: Crawl, robot: Robot) -> float:
    """The duty that leaves joints time for swings and the body's moves alike, found on level ground."""
    from bodyplan.ground.plane import Plane

    planner = gait._planner(robot, Plane(), 1.0 - SWINGING / len(robot.chains))
    count, usual = len(planner.legs), SWINGING
    if not np.isfinite(robot.rates).any():
        return 1.0 - usual / count
    plan = planner.made((count - 0.5) * planner.step_time)
    if plan.status == Status.OK and not planner.repeats(plan):
        plan = planner.made((2 * count - 0.5) * planner.step_time)
    swing, sway = paces(planner, plan)
    least, most = usual * swing / ROOM, 1.0 - (1.0 - usual) * sway / ROOM
    share = float(np.clip(usual, least, most))
    if least > most:
        share = usual * swing / (usual * swing + (1.0 - usual) * sway)
    return 1.0 - float(np.clip(share, *BOUNDS)) / count
