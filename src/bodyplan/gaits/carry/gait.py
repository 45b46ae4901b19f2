"""Carrying a body over rough ground on wheels that change their radius: see :class:`Carry`."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from bodyplan.arrays import Array, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.gaits.base import Gait, from_zero
from bodyplan.gaits.carry.laws import Law
from bodyplan.gaits.carry.orientation import Function
from bodyplan.gaits.carry.paths import Course, Path, path_of
from bodyplan.gaits.carry.pose import MODES
from bodyplan.gaits.pace import Pace
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot

#: m/s along a curve, where nobody says
SPEED = 0.2
REFERENCES = ("center", "front_axle", "rear_axle")


class Carry(Gait):
    """Wheels change their radius so that the body keeps a height, a roll and a pitch while it follows a path (paper
    *wheels*, with the corrections of its equations named below).

    ``path`` seen from above: a table or a :class:`~bodyplan.gaits.carry.paths.Path`,

    * ``{"kind": "line", "start": (x, y), "end": (x, y)}`` (or ``heading`` rad for ``end``),
    * ``{"kind": "circle", "radius": r, "center": (x, y), "start": angle, "clockwise": False}``,
    * ``{"kind": "spline", "points": [(x, y), ...], "closed": False}``, or just the points,
    * ``{"kind": "formula", "x": "sin(t)", "y": "cos(t)"}``, or just the two texts: formulas in t (s),
    * ``{"kind": "samples", "times": [...], "points": [...]}``.

    The first three are curves: the body goes along at ``speed`` m/s (default 0.2) that rises from 0 within ``ramp`` s
    and falls to 0 at ``stop`` s, or as far as ``distance`` says, a formula in t (m). The last two say themselves when
    they are where. ``reference``: what of the body follows the path, "center" (its frame), "front_axle", "rear_axle",
    or a length m ahead of its frame.

    ``height`` m: a number, a formula in t, or "auto": a smooth height that keeps every wheel in reach with the largest
    margin. ``height_mode``: "absolute", above z = 0 as in the paper's missions; "vertical", above the ground below; or
    along its "normal" (eq. (6); the path is then that of the ground point, eq. (5)). ``roll``, ``pitch`` rad: turns
    about the world's x and y axes, numbers or formulas in t; R = Ry(pitch) Rx(roll) Rz(yaw) (eq. (4), with T_y
    mended). ``heading``: "path", or the direction of the body's x axis seen from above in rad, a number or a formula.
    The yaw is exact: eqs. (18) and (19) take the position's angle for the heading, (23) flips a sign, (20) to (22)
    drift; see :mod:`bodyplan.gaits.carry.orientation`.

    Each wheel touches the ground nearest to its axle in its plane, proved so (:mod:`bodyplan.gaits.carry.search`);
    eqs. (12) and (14), with the normal (-f_x, -f_y, 1) in place of the printed (3). Hubs roll without slip ahead; what
    they slip sideways is a fact of the motion, not assumed away. Statuses, a sample: ``out_of_reach`` (a radius that
    no q makes), ``no_contact``, ``below_floor`` (an axle or the hull in the ground), ``limit`` (an adjusting joint too
    fast), ``jumps`` (the ground bends like the rim), ``stands_still`` (a path without a direction), ``curve_ended``,
    ``not_converged``, ``slips`` and ``tips_over`` (no forces of the ground hold the body at rest); ``motion.notes``
    name the wheel and the time.

    ``motion.forces`` and ``motion.torques`` are the statics of every sample: of all forces within the friction cones
    that balance the weight those of least square, and by virtual work what they ask of the motors (eq. (34) with its
    sign mended); see :func:`bodyplan.gaits.carry.forces`. Robots of fewer than three wheels have none.

    Raises InputError for values out of range and options that do not go together, UnknownNameError for names.
    """

    kind: ClassVar[str] = "carry"
    UNITS: ClassVar[dict[str, str]] = {"speed": "speed", "ramp": "time", "stop": "time"}
    OPTIONAL_FACTS: ClassVar[tuple[str, ...]] = ("*_torque", "friction*", "required_friction")

    def __init__(
        self,
        path: Any,
        *,
        height: Any = 0.15,
        height_mode: str = "absolute",
        roll: Any = 0.0,
        pitch: Any = 0.0,
        heading: Any = "path",
        speed: float | None = None,
        ramp: float = 0.0,
        stop: float | None = None,
        distance: Any = None,
        reference: Any = "center",
    ) -> None:
        self.path: Path = path_of(path)
        self.height = None if isinstance(height, str) and height == "auto" else Law(height, "height", "length")
        if height_mode not in MODES:
            raise UnknownNameError("height_mode", height_mode, MODES)
        self.height_mode = height_mode
        self.roll, self.pitch = Law(roll, "roll", "angle"), Law(pitch, "pitch", "angle")
        for name, law in (("roll", self.roll), ("pitch", self.pitch)):
            if abs(law.constant) >= 0.5 * np.pi:
                raise InputError(f"{name}: must be within +-pi/2 rad, got {law.constant}.")
        self.heading = None if isinstance(heading, str) and heading == "path" else Law(heading, "heading", "angle")
        if not self.path.curve and (speed is not None or ramp != 0.0 or stop is not None or distance is not None):
            raise InputError(
                f"speed, ramp, stop, distance: a path of {self.path.kind} says itself when it is where; leave them out."
            )
        if distance is not None and (speed is not None or ramp != 0.0 or stop is not None):
            raise InputError("distance: says it all; leave out speed, ramp and stop.")
        self.distance = None if distance is None else Law(distance, "distance", "length")
        self.pace = Pace.of(SPEED if speed is None else speed, 1, 0.0, ramp, stop)
        self.speed = speed
        if isinstance(reference, str):
            if reference not in REFERENCES:
                raise UnknownNameError("reference", reference, REFERENCES)
            self.reference: str | float = reference
        else:
            self.reference = number(reference, "reference")

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {
            "kind": self.kind,
            "path": self.path.to_dict(),
            "height": "auto" if self.height is None else self.height.plain,
            "height_mode": self.height_mode,
            "roll": self.roll.plain,
            "pitch": self.pitch.plain,
            "heading": "path" if self.heading is None else self.heading.plain,
            "speed": self.speed,
            "ramp": self.pace.ramp,
            "stop": self.pace.stop,
            "distance": None if self.distance is None else self.distance.plain,
            "reference": self.reference,
        }

    def way(self, t: Array) -> Function:
        """How far along a curve, m, at t (T,) s, with its derivatives."""
        return Function(*self.pace.at(t)) if self.distance is None else self.distance.at(t)

    def course(self, t: Array) -> Course:
        """The path at t (T,) s."""
        return self.path.at(t, self.way(t))

    def plan(self, robot: Robot, ground: Ground, t: Array) -> Motion:
        """The motion at times t (T,) >= 0 s. InputError for a ground that is none of plane, surface, height map, and
        for a robot without wheels."""
        from bodyplan.gaits.carry.motion import motion_of

        from_zero(t)
        return motion_of(self, robot, ground, t)
