"""Tail-middle-head inching of orthogonal snakes (paper *rectilinear*).

The kinematics by themselves: :func:`relative` and :func:`drive` (homogeneous transforms of anchors), :func:`pose`
(anchors -> joints), :func:`paper_drive` (the 60 % rule). The gait: :class:`Rectilinear`.
"""

from bodyplan.gaits.rectilinear.ceilings import UnderCeiling, under_ceilings
from bodyplan.gaits.rectilinear.gait import Rectilinear
from bodyplan.gaits.rectilinear.pose import Pose, pose
from bodyplan.gaits.rectilinear.strides import paper_drive
from bodyplan.gaits.rectilinear.transforms import Transform, drive, relative

__all__ = [
    "Pose",
    "Rectilinear",
    "Transform",
    "UnderCeiling",
    "drive",
    "paper_drive",
    "pose",
    "relative",
    "under_ceilings",
]
