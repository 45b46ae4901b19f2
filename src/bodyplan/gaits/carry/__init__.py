"""Carrying a body over rough ground on wheels of adjustable radius (paper *wheels*, and past it): see :class:`Carry`.

``pose`` solves the wheels at one pose of the body or many, ``reach`` says at which heights it can be, ``wheel_rates``
how the wheels move while it moves, ``forces`` what they carry and what their motors hold, ``maps`` all of that over
headings and heights.
"""

from bodyplan.gaits.carry.curve import Through
from bodyplan.gaits.carry.forces import Forces, WheelForce, forces
from bodyplan.gaits.carry.gait import Carry
from bodyplan.gaits.carry.maps import Maps, maps
from bodyplan.gaits.carry.orientation import heading, yaw
from bodyplan.gaits.carry.paths import Circle, Formula, Line, Path, Samples
from bodyplan.gaits.carry.pose import Pose, WheelContact, pose, pose_of
from bodyplan.gaits.carry.reach import Reach, reach
from bodyplan.gaits.carry.twists import WheelRate, WheelRates, wheel_rates
from bodyplan.gaits.carry.wheels import Wheel, Wheels

__all__ = [
    "Carry",
    "Circle",
    "Forces",
    "Formula",
    "Line",
    "Maps",
    "Path",
    "Pose",
    "Reach",
    "Samples",
    "Through",
    "Wheel",
    "WheelContact",
    "WheelForce",
    "WheelRate",
    "WheelRates",
    "Wheels",
    "forces",
    "heading",
    "maps",
    "pose",
    "pose_of",
    "reach",
    "wheel_rates",
    "yaw",
]
