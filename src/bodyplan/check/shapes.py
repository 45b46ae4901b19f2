"""The body against itself, and the shapes of a robot as the judge's tests of clearance see them."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.check.report import Line
from bodyplan.ground.base import Ground
from bodyplan.ground.field import Field
from bodyplan.motion import Motion
from bodyplan.robot.elements import Contact
from bodyplan.robot.model import Robot
from bodyplan.robot.neighbours import separate_contacts
from bodyplan.robot.poses import Poses
from bodyplan.spatial.segments import segment_box_clearance, segment_distance

#: slack of a distance, m
EXACT = 1e-9
#: samples times pairs of shapes, and places on the faces of boxes, handled at once
CHUNK = 400_000
#: points along each side of a face of a box over curved ground
SIDE = 21


def skeletons(motion: Motion) -> tuple[Array, Array, list[int]]:
    """End points (T, c, 2, 3) of every capsule and sphere, radii (c,), and their indices among the contacts."""
    poses = motion.robot.forward(motion.q, motion.base)
    ends, radii, which = [], [], []
    for k, contact in enumerate(motion.robot.contacts):
        if contact.shape in ("capsule", "sphere"):
            ends.append(skeleton(contact, motion.robot, poses))
            radii.append(contact.radius)
            which.append(k)
    size = len(motion.t)
    return (np.stack(ends, axis=1) if ends else np.zeros((size, 0, 2, 3))), np.array(radii), which


def skeleton(contact: Contact, robot: Robot, poses: Poses) -> Array:
    """End points (T, 2, 3) of a capsule or sphere at ``poses`` of all frames."""
    i = robot.frame_index(contact.frame)
    local = np.array([contact.start, contact.end if contact.shape == "capsule" else contact.start])
    return np.asarray(np.einsum("tij,pj->tpi", poses.rotations[:, i], local) + poses.positions[:, None, i])


def self_clearance(motion: Motion) -> Line | None:
    """Smallest gap between two capsules, spheres or boxes that are no neighbours (``robot/neighbours.py``)."""
    robot = motion.robot
    pairs = [pair for pair in separate_contacts(robot) if all(robot.contacts[k].shape != "rim" for k in pair)]
    if not pairs:
        return None
    ends, radii, which = skeletons(motion)
    place = {contact: i for i, contact in enumerate(which)}
    slim = np.array([(place[a], place[b]) for a, b in pairs if a in place and b in place], dtype=np.int64)
    best, when, pair = np.inf, 0, pairs[0]
    step = max(1, CHUNK // max(1, len(slim)))
    for k in range(0, len(motion.t) if len(slim) else 0, step):
        first, second = slim.T
        gap = segment_distance(ends[k : k + step, first], ends[k : k + step, second]) - radii[first] - radii[second]
        at = np.unravel_index(int(gap.argmin()), gap.shape)
        if gap[at] < best:
            best, when, pair = float(gap[at]), k + int(at[0]), (which[first[at[1]]], which[second[at[1]]])
    poses = robot.forward(motion.q, motion.base)
    for a, b in pairs:
        if a in place and b in place:
            continue
        found = _gap_to_box(robot, a, b, poses)
        if found.min() < best:
            best, when, pair = float(found.min()), int(found.argmin()), (a, b)
    names = [robot.contacts[k].name for k in pair]
    return Line(
        "links clear of each other",
        best,
        0.0,
        "m",
        best >= -EXACT,
        f"closest: {names[0]} and {names[1]} at {motion.t[when]:.4g} s",
        at_least=True,
        kind="self",
    )


def _gap_to_box(robot: Robot, a: int, b: int, poses: Poses) -> Array:
    """Gap (T,) m of two contacts of which one is a box, or both are; negative by how deep a skeleton or an edge is in
    the box."""
    one, other = robot.contacts[a], robot.contacts[b]
    if one.shape == other.shape == "box":
        ways = ((box_edges(robot, one, poses), other), (box_edges(robot, other, poses), one))
        first, second = (_within(ends, box, robot, poses).min(axis=1) for ends, box in ways)
        return np.asarray(np.minimum(first, second))
    box, slim = (one, other) if one.shape == "box" else (other, one)
    return _within(skeleton(slim, robot, poses)[:, None], box, robot, poses)[:, 0] - slim.radius


def _within(ends: Array, box: Contact, robot: Robot, poses: Poses) -> Array:
    """Signed distance (T, k) m of segments (T, k, 2, 3) from a box."""
    i = robot.frame_index(box.frame)
    away = ends - poses.positions[:, None, None, i]
    local = np.einsum("tji,tkpj->tkpi", poses.rotations[:, i], away) - np.array(box.start)
    return segment_box_clearance(local, np.array(box.half))


def box_edges(robot: Robot, box: Contact, poses: Poses) -> Array:
    """End points (T, 12, 2, 3) of the edges of a box."""
    corners = box.points()
    i = robot.frame_index(box.frame)
    places = np.einsum("tij,pj->tpi", poses.rotations[:, i], corners) + poses.positions[:, None, i]
    # two corners share an edge where they differ in one coordinate
    differ = (np.abs(corners[:, None] - corners) > 0.0).sum(axis=-1)
    first, second = np.nonzero(np.triu(differ == 1))
    return np.asarray(np.stack([places[:, first], places[:, second]], axis=2))


def box_gaps(ground: Ground, robot: Robot, box: Contact, poses: Poses) -> Array:
    """Gap (T,) m between a box and the ground, negative below it.

    Over ground of planes that of its edges, which is exact: such ground cannot reach into a face and not into an edge.
    Over curved ground the distance to the tangent plane below the lowest of 21 points along each side of every face.
    """
    i = robot.frame_index(box.frame)
    if not isinstance(ground, Field):
        return np.asarray(ground.segment_clearance(box_edges(robot, box, poses)).min(axis=1))
    pose, back = np.unique(poses.array[:, i], axis=0, return_inverse=True)  # a body often rests
    turns, local = poses.rotations[:, i], face_points(box)
    first = np.zeros(len(pose), dtype=np.int64)
    first[back.ravel()] = np.arange(len(back.ravel()))
    out = np.empty(len(pose))
    step = max(1, CHUNK // len(local))
    for k in range(0, len(pose), step):
        rows = first[k : k + step]
        points = np.einsum("tij,pj->tpi", turns[rows], local) + poses.positions[rows, None, i]
        over = points[..., 2] - ground.height(points)
        lowest = over.argmin(axis=1)
        below = points[np.arange(len(rows)), lowest]
        out[k : k + step] = over[np.arange(len(rows)), lowest] * ground.normal(below)[:, 2]
    return out[back.ravel()]


def face_points(box: Contact) -> Array:
    """Points (p, 3) of the faces of a box in its frame."""
    a, b = (v.ravel() for v in np.meshgrid(*(np.linspace(-1.0, 1.0, SIDE) for _ in range(2))))
    one = np.ones_like(a)
    faces = [np.stack([sign * one if i == axis else (a if i == (axis + 1) % 3 else b) for i in range(3)], axis=1)
             for axis in range(3) for sign in (-1.0, 1.0)]  # fmt: skip
    return np.asarray(np.array(box.start) + np.concatenate(faces) * np.array(box.half))
