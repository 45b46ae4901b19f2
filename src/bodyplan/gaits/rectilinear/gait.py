"""Tail-middle-head inching of an orthogonal snake (paper *rectilinear*): anchors stand, one or several swing."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as Items
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, finite, number, whole
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.rectilinear.course import course_of
from bodyplan.gaits.rectilinear.demands import Demands
from bodyplan.gaits.rectilinear.motion import motion_of
from bodyplan.gaits.rectilinear.sequence import Sequence
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.steered import NOT_STRAIGHT, SteeredCourse, steered_course, steered_motion
from bodyplan.gaits.rectilinear.strides import SHARE
from bodyplan.gaits.rectilinear.swing import PATHS
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.ground.base import Ground
from bodyplan.ground.plane import Plane
from bodyplan.ground.profile import Profile
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot
from bodyplan.units import to_si

DRIVES = ("fastest", "periodic", "paper")
SCHEDULES = ("wave", "two-phase")
#: lift where the user names none, of the mean link
LIFT = 0.1
#: clearance where the user names none, of the mean link: feet that slip or servos that sag by less touch nothing
CLEARANCE = 0.03
MOST_ANCHORS = 101
MOST_TURNS = 100


class Rectilinear(Gait):
    """Inching along a straight line under a ceiling: N ``anchors`` stand on the floor, two links and an elbow between
    each pair of them; the tail link and the head link stay level.

    ``drive``: how far the anchors go in a cycle.

    * ``"fastest"`` (default): the highest speed that floor, ceiling, ``lift``, joint limits and rates allow, from legs
      at most ``spacing`` of straight. Over steps the landing spots are searched.
    * ``"periodic"``: equal strides of all anchors, which repeat, from legs of ``spacing``: the largest that floor,
      ceiling, lift and limits allow, but no more than ``share`` of the shortest leg.
    * ``"paper"``: the 60 % rule of Figs. 7-11: every anchor goes ``share`` of the way to the next one ahead, cycle
      after cycle; it repeats only where all spacings are equal. ``schedule`` must be "wave".
    * N numbers (m): each anchor's drive, the same in every cycle, until one cannot be made.

    ``spacing``: length of the legs as a share of straight, in (0, 1]: one number, or N - 1. The paper's configurations
    (tail 0.3, head 0.7) are ``(0.3, 0.7)``. ``schedule``: "wave" (tail, middle, head, one after the other) or
    "two-phase" (all odd anchors, then all even ones; N odd): such legs begin long, short, long, ..., ``spacing`` is
    that of the long ones.

    ``lift`` m of a swinging anchor over level ground (default a tenth of the mean link; 0: it slides); ``path``
    "cycloid". Over steps it is lifted higher where it must be. ``ceiling`` m: the most that the middle of any joint may
    be above the line of the standing anchors' joints; a ceiling of the ground counts beside it, with the body's own
    radius. ``clearance`` m that the body keeps from edges of steps and the ceiling above them (default 0.03 of the mean
    link, on ground with steps only).

    ``margin`` m: how far the centre of mass must stay from both ends of what stands, along the way (default: 0, and not
    asked for with three anchors, which cannot have more: moved one by one their margin is 0 at best). ``ceiling`` and
    ``margin`` bind all drives.

    ``move_time`` s of a move (default: as fast as the joints' rates allow, or 1 s where a pitch joint has no rate
    limit); a move takes longer where a joint would be too fast. ``dwell`` s of rest after each. ``cycles``: how many,
    then it stands; default: as long as there is time. ``heading`` rad of the way; the tail end starts at ``start``
    (x, y) m. ``joints``: names of the 2 N - 1 pitch joints to use, tail first (anchor, elbow, anchor, ...); default:
    evenly spread over all, the others stay straight.

    ``steer``: pairs (cycle, heading in rad): after so many cycles it turns to that heading, within as many cycles as it
    takes, on a level floor (ours: the paper goes straight on). Every link needs a yaw joint inside, and legs are at
    most 0.97 of straight. Yaw joints stay straight where nothing is steered.

    Joint rates and accelerations are exact and begin and end every move at 0. Samples from where a drive cannot be made
    on have its status: ``above_ceiling``, ``out_of_reach``, ``limit``, ``below_floor``, ``collapsed``,
    ``links_crossing``, ``tips_over``. Raises
    InputError for values out of range.
    """

    kind: ClassVar[str] = "rectilinear"
    UNITS: ClassVar[Mapping[str, str]] = {
        "lift": "length",
        "ceiling": "length",
        "clearance": "length",
        "move_time": "time",
        "dwell": "time",
        "heading": "angle",
        "start": "length",
        "margin": "length",
    }

    def __init__(
        self,
        anchors: int = 3,
        *,
        drive: Any = "fastest",
        spacing: float | Items[float] = 1.0,
        share: float = SHARE,
        schedule: str = "wave",
        lift: float | None = None,
        path: str = "cycloid",
        ceiling: float | None = None,
        clearance: float | None = None,
        move_time: float | None = None,
        dwell: float = 0.0,
        cycles: int | None = None,
        heading: float = 0.0,
        start: Items[float] = (0.0, 0.0),
        margin: float | None = None,
        steer: Items[tuple[int, float]] = (),
        joints: Items[str] | None = None,
    ) -> None:
        self.anchors = whole(anchors, "anchors", at_least=3, at_most=MOST_ANCHORS)
        if schedule not in SCHEDULES:
            raise UnknownNameError("schedule", schedule, SCHEDULES)
        self.schedule = schedule
        if schedule == "two-phase" and self.anchors % 2 == 0:
            raise InputError(f"anchors: must be odd for schedule='two-phase', got {anchors}.")
        self.drive: str | tuple[float, ...]
        if isinstance(drive, str):
            if drive not in DRIVES:
                raise UnknownNameError("drive", drive, DRIVES)
            if drive == "paper" and schedule != "wave":
                raise InputError(f"drive: the paper's rule moves anchors one after another; got schedule={schedule!r}.")
            self.drive = drive
        else:
            given = [to_si(v, "length", "drive") for v in drive] if isinstance(drive, Items) else drive
            values = finite(given, "drive", (self.anchors,))
            if np.any(values <= 0.0):
                raise InputError(f"drive: every drive must be > 0, got {float(values.min())}.")
            self.drive = tuple(float(v) for v in values)
        shares = finite(spacing, "spacing")
        if shares.ndim == 0:
            shares = np.full(self.anchors - 1, float(shares))
        if shares.shape != (self.anchors - 1,) or np.any(shares <= 0.0) or np.any(shares > 1.0):
            raise InputError(
                f"spacing: expected one share of a straight leg in (0, 1], or {self.anchors - 1}, got {spacing!r}."
            )
        self.spacing = tuple(float(v) for v in shares)
        self.share = number(share, "share", above=0.0, below=1.0)
        self.lift = None if lift is None else number(lift, "lift", at_least=0.0)
        if path not in PATHS:
            raise UnknownNameError("path", path, PATHS)
        self.path = path
        self.ceiling = None if ceiling is None else number(ceiling, "ceiling", above=0.0)
        self._clearance = None if clearance is None else number(clearance, "clearance", at_least=0.0)
        self.move_time = None if move_time is None else number(move_time, "move_time", above=0.0)
        self.dwell = number(dwell, "dwell", at_least=0.0)
        self.cycles = None if cycles is None else whole(cycles, "cycles", at_least=1, at_most=100_000)
        self.heading = number(heading, "heading")
        x, y = finite(start, "start", (2,))
        self.start = (float(x), float(y))
        self.margin = None if margin is None else number(margin, "margin")
        self.steer = _turns(steer)
        if self.steer and self.lift == 0.0:
            raise InputError("steer: anchors that are not lifted cannot land elsewhere; lift must be > 0.")
        self.joints: tuple[str, ...] | None = None
        if joints is not None:
            if isinstance(joints, str) or not all(isinstance(name, str) for name in joints):
                raise InputError(f"joints: expected names of joints, got {joints!r}.")
            if len(joints) != 2 * self.anchors - 1:
                raise InputError(
                    f"joints: {self.anchors} anchors use {2 * self.anchors - 1} pitch joints, got {len(joints)} names."
                )
            self.joints = tuple(joints)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {
            "kind": self.kind,
            "anchors": self.anchors,
            "drive": self.drive if isinstance(self.drive, str) else list(self.drive),
            "spacing": list(self.spacing),
            "share": self.share,
            "schedule": self.schedule,
            "lift": self.lift,
            "path": self.path,
            "ceiling": self.ceiling,
            "clearance": self._clearance,
            "move_time": self.move_time,
            "dwell": self.dwell,
            "cycles": self.cycles,
            "heading": self.heading,
            "start": list(self.start),
            "margin": self.margin,
            "steer": [list(turn) for turn in self.steer],
            "joints": None if self.joints is None else list(self.joints),
        }

    def spacings(self, demands: Demands) -> Array:
        """(N - 1,) m: lengths of the legs (where two phases move: of the long ones) as ``spacing`` says."""
        most = NOT_STRAIGHT if self.steer else 1.0
        return np.asarray(np.minimum(self.spacing, most) * demands.straight)

    @property
    def least_margin(self) -> float | None:
        """Support margin m that is asked for; None where there is none."""
        return (None if self.anchors == 3 else 0.0) if self.margin is None else self.margin

    def lift_of(self, demands: Demands) -> float:
        """Lift in m."""
        return LIFT * float(demands.links.mean()) if self.lift is None else self.lift

    def clearance_of(self, demands: Demands) -> float:
        """Clearance in m."""
        return CLEARANCE * float(demands.links.mean()) if self._clearance is None else self._clearance

    def period(self, robot: Robot, ground: Ground | None = None) -> float | None:
        """Time of one cycle on ``ground`` (a level floor where None), s; None where it does not repeat."""
        if self.steer:
            return None
        place = Plane() if ground is None else ground
        if not Track.of(place, self.start, self.heading).level:
            InchingSnake.of(robot, self.anchors, self.joints)  # or InputError
            return None
        sequence = self.sequence(robot, place, 0.0)
        return None if sequence.advance is None or self.cycles is not None else sequence.length

    def sequence(self, robot: Robot, ground: Ground, until: float) -> Sequence:
        """The moves in time; those that do not repeat last for ``until`` s where they can."""
        return _sequence(self._without_rest(ground), robot, ground, until)

    def _without_rest(self, ground: Ground) -> Rectilinear:
        """This gait without what its moves do not depend on."""
        rest: dict[str, Any] = {"share": SHARE} if self.drive == "fastest" else {}
        if isinstance(ground, Profile):
            rest["start"] = (self.start[0], 0.0)  # the same at every y
        options = self.to_dict() | rest
        del options["kind"]
        return type(self)(**options)

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. Raises InputError for a robot without enough pitch joints, and for ground
        that is neither level nor made of steps across the way."""
        from_zero(t)
        snake = InchingSnake.of(robot, self.anchors, self.joints)
        track = Track.of(ground, self.start, self.heading)
        if self.steer:
            return steered_motion(self, snake, track, _steered(self, robot, ground, float(t[-1])), t)
        return motion_of(self, snake, track, self.sequence(robot, ground, float(t[-1])), t)


@lru_cache(maxsize=16)
def _sequence(gait: Rectilinear, robot: Robot, ground: Ground, until: float) -> Sequence:
    snake = InchingSnake.of(robot, gait.anchors, gait.joints)
    return course_of(gait, snake, Track.of(ground, gait.start, gait.heading), until)


@lru_cache(maxsize=16)
def _steered(gait: Rectilinear, robot: Robot, ground: Ground, until: float) -> SteeredCourse:
    snake = InchingSnake.of(robot, gait.anchors, gait.joints)
    return steered_course(gait, snake, Track.of(ground, gait.start, gait.heading), until)


def _turns(steer: Any) -> tuple[tuple[int, float], ...]:
    """Pairs (cycle, heading rad) in order, or InputError."""
    wanted = "steer: expected pairs (cycle, heading), for example [(2, 0.5)]"
    if isinstance(steer, (str, bytes)) or not isinstance(steer, Items):
        raise InputError(f"{wanted}, got {steer!r}.")
    out: list[tuple[int, float]] = []
    for pair in steer:
        if isinstance(pair, (str, bytes)) or not isinstance(pair, Items) or len(pair) != 2:
            raise InputError(f"{wanted}, got {pair!r}.")
        cycle, heading = whole(pair[0], "steer: cycle"), to_si(pair[1], "angle", "steer: heading")
        if out and cycle <= out[-1][0]:
            raise InputError(f"steer: cycles must increase, got {out[-1][0]} and {cycle}.")
        out.append((cycle, heading))
    if len(out) > MOST_TURNS:
        raise InputError(f"steer: at most {MOST_TURNS} turns, got {len(out)}.")
    return tuple(out)
