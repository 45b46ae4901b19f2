"""Robots: D-H rows, arcs and drives; forward kinematics, velocity equation, Jacobians."""

from bodyplan.robot.elements import Arc, Body, Chain, Contact, Joint, Row, WheelRadius
from bodyplan.robot.library import acm_l2, snake
from bodyplan.robot.model import Robot
from bodyplan.robot.poses import Poses
from bodyplan.robot.reach import Reach
from bodyplan.robot.rovers import rover, tri_wheel
from bodyplan.robot.walkers import hexapod, silo4, walker

__all__ = [
    "Arc",
    "Body",
    "Chain",
    "Contact",
    "Joint",
    "Poses",
    "Reach",
    "Robot",
    "Row",
    "WheelRadius",
    "acm_l2",
    "hexapod",
    "rover",
    "silo4",
    "snake",
    "tri_wheel",
    "walker",
]
