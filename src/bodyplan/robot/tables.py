"""A robot's chains as flat number tables: what the kernels read instead of Python objects.

Frame 0 is the base; frame e > 0 is the one that element e ends in, so that a parent always comes first.
Variables of an element are numbered 0..3: theta, d, a, epsilon of a row; pitch, yaw of an arc. A *drive* is
one variable of one element that follows a joint.

Kernels take all tables of a kind in one flat array with the sizes in front: every array that is passed to a
compiled function costs a call some 50 ns.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.robot.elements import COS_30, Arc, Chain, Joint, WheelRadius

# ints: F, V, n, C, S, K, M, then the tables element_i (F, 6), drive_i (V, 3), starts (C + 1),
#       offsets (C + 1), steps (S, 14)
# floats: element_f (F, 12), drive_f (V, 2)
HEAD = 7
# element_i: kind, parent frame, drive of variable 0..3 (-1: constant)
# element_f: constants 0..3 (an arc has its length in 2), then cosine and sine of theta and of epsilon, then
#            those of their halves
ELEMENT_I, ELEMENT_F = 6, 12
# drive_i: joint, law, kind of variable;  drive_f: value = f0 + f1 q (LINEAR) or f0 + f1 cos(q/2) (WHEEL)
DRIVE_I, DRIVE_F = 3, 2
# step: what to do, element; for the variables 0..3 their drives, their columns (both -1: constant), and 1
#       where this is the first use of the column
STEP = 14

ROW, ARC = 1, 2
LINEAR, WHEEL = 0, 1
ROW_ANGLE, OTHER = 1, 0
# what to do in a step: only constants; one revolute theta; any drives; an arc
FIXED, REVOLUTE, GENERAL, BEND = 0, 1, 2, 3


class Tables(NamedTuple):
    """All elements and drives: F frames, V drives, n joints."""

    ints: IntArray
    floats: Array


class Paths(NamedTuple):
    """The ways from C target frames back to the base in S steps, and the K joint columns that they need.

    Target c has the steps starts[c]:starts[c + 1] and the columns offsets[c]:offsets[c + 1], at most M.
    ``ints`` holds the tables as well. ``joints`` (K,): joint of every column, ascending within a target.
    ``names``: all joints. ``one``: (n,), the shape of one configuration. ``shapes``: those of its results,
    positions, rotations and twists.
    """

    ints: IntArray
    floats: Array
    offsets: IntArray
    joints: IntArray
    names: tuple[str, ...]
    one: tuple[int]
    shapes: tuple[tuple[int, ...], ...]


def build_tables(chains: tuple[Chain, ...], frames: tuple[str, ...], column: Mapping[str, int]) -> Tables:
    """Tables of validated chains; ``column`` is the index of every joint in q."""
    frame_of = {name: i for i, name in enumerate(frames)}
    element_i: list[list[int]] = [[0, -1, -1, -1, -1, -1]]
    element_f: list[list[float]] = [[0.0] * ELEMENT_F]
    drive_i: list[list[int]] = []
    drive_f: list[list[float]] = []
    for chain in chains:
        parent = frame_of[chain.parent]
        for element in chain.elements:
            ints = [ARC if isinstance(element, Arc) else ROW, parent, -1, -1, -1, -1]
            values = [0.0, 0.0, element.length, 0.0] if isinstance(element, Arc) else [0.0] * 4
            for k, field in enumerate(element.VARIABLES):
                value = getattr(element, field)
                if isinstance(value, Joint):
                    law, joint, numbers = LINEAR, value.name, [value.offset, value.scale]
                elif isinstance(value, WheelRadius):
                    law, joint, numbers = WHEEL, value.joint.name, [value.rubber, value.link * COS_30]
                else:
                    values[k] = value
                    continue
                ints[2 + k] = len(drive_i)
                turns = ROW_ANGLE if field in element.ANGLES and not isinstance(element, Arc) else OTHER
                drive_i.append([column[joint], law, turns])
                drive_f.append(numbers)
            theta, epsilon = (values[0], values[3]) if not isinstance(element, Arc) else (0.0, 0.0)
            trig = [f(h * x) for h in (1.0, 0.5) for x in (theta, epsilon) for f in (np.cos, np.sin)]
            element_i.append(ints)
            element_f.append([*values, *trig])
            parent = len(element_i) - 1
    return Tables(
        _joined([len(element_i), len(drive_i), len(column), 0, 0, 0, 0], element_i, drive_i),
        frozen(np.concatenate([np.ravel(element_f), np.ravel(drive_f)])),
    )


def build_paths(tables: Tables, targets: tuple[int, ...], joint_names: tuple[str, ...]) -> Paths:
    """Paths from ``targets`` (frame numbers) to the base; a joint that drives several variables on one path
    has one column there."""
    F, V = (int(i) for i in tables.ints[:2])
    element_i = tables.ints[HEAD : HEAD + F * ELEMENT_I].reshape(F, ELEMENT_I)
    drive_i = tables.ints[HEAD + F * ELEMENT_I :].reshape(V, DRIVE_I)
    starts, offsets = [0], [0]
    steps: list[list[int]] = []
    joints: list[int] = []
    for target in targets:
        elements = []
        frame = target
        while frame > 0:
            elements.append(frame)
            frame = int(element_i[frame, 1])
        drives = [int(v) for e in elements for v in element_i[e, 2:] if v >= 0]
        names = sorted({int(drive_i[v, 0]) for v in drives})
        columns = {joint: i for i, joint in enumerate(names)}
        met: set[int] = set()
        for e in elements:
            slots, firsts = [-1] * 4, [0] * 4
            # in the order in which the recursion meets them: from the far end of the element
            for k in (3, 2, 1, 0):
                v = int(element_i[e, 2 + k])
                if v >= 0:
                    slots[k] = columns[int(drive_i[v, 0])]
                    firsts[k] = int(slots[k] not in met)
                    met.add(slots[k])
            what = _what(element_i[e], drive_i, slots, firsts)
            steps.append([what, e, *element_i[e, 2:], *slots, *firsts])
        starts.append(len(steps))
        offsets.append(offsets[-1] + len(columns))
        joints.extend(names)
    most = int(max(np.diff(offsets), default=0))
    head = [*tables.ints[:3], len(targets), len(steps), len(joints), most]
    ints = _joined(head, tables.ints[HEAD:], starts, offsets, steps)
    C, K = len(targets), len(joints)
    shapes = (C, 3), (C, 3, 3), (K, 6)
    return Paths(
        ints,
        tables.floats,
        _frozen_int(offsets),
        _frozen_int(joints),
        joint_names,
        (len(joint_names),),
        shapes,
    )


def _what(element: IntArray, drive_i: IntArray, slots: list[int], firsts: list[int]) -> int:
    if element[0] == ARC:
        return BEND
    if max(slots) < 0:
        return FIXED
    only_theta = slots[0] >= 0 and max(slots[1:]) < 0
    return REVOLUTE if only_theta and firsts[0] and drive_i[element[2], 1] == LINEAR else GENERAL


def _joined(*parts: Any) -> IntArray:
    return _frozen_int(np.concatenate([np.ravel(np.array(part, dtype=np.int64)) for part in parts]))


def _frozen_int(values: Any) -> IntArray:
    out: IntArray = np.array(values, dtype=np.int64)
    out.flags.writeable = False
    return out
