"""Rotations, poses, twists, and frames along a curve."""

from bodyplan.spatial.frames import GAUSS_NODES, curve_frames, frames_from_nodes
from bodyplan.spatial.poses import apply, compose, inverse, matrix_from_pose, pose_from_matrix, relative
from bodyplan.spatial.resampling import NodeSampling
from bodyplan.spatial.rotations import (
    canonical,
    conjugate,
    hat,
    left_jacobian,
    matrix_from_quaternion,
    multiply,
    quaternion_exp,
    quaternion_from_matrix,
    quaternion_log,
    rotate,
    rotation_exp,
    rotation_log,
)
from bodyplan.spatial.twists import adjoint, adjoint_inverse, bracket, exp, log

__all__ = [
    "GAUSS_NODES",
    "NodeSampling",
    "adjoint",
    "adjoint_inverse",
    "apply",
    "bracket",
    "canonical",
    "compose",
    "conjugate",
    "curve_frames",
    "exp",
    "frames_from_nodes",
    "hat",
    "inverse",
    "left_jacobian",
    "log",
    "matrix_from_pose",
    "matrix_from_quaternion",
    "multiply",
    "pose_from_matrix",
    "quaternion_exp",
    "quaternion_from_matrix",
    "quaternion_log",
    "relative",
    "rotate",
    "rotation_exp",
    "rotation_log",
]
