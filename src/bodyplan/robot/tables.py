"""A robot's chains as flat number tables: what the kernels read instead of Python objects.

Frame 0 is the base; frame e > 0 is the one that element e ends in, so that a parent always comes first.
Variables of an element are numbered 0..3: theta, d, a, epsilon of a row; pitch, yaw of an arc.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.robot.elements import Arc, Chain, Joint, WheelRadius

ROW, ARC = 1, 2
LINEAR, WHEEL = 0, 1
COS_30 = float(np.sqrt(0.75))


class Tables(NamedTuple):
    """Number tables of all elements and drives; see the comments for the columns."""

    element_i: IntArray  # (F, 6): kind, parent frame, drive of variable 0..3 (-1: constant)
    element_f: Array  # (F, 4): constant value of variable 0..3; an arc has its length in column 2
    drive_i: IntArray  # (V, 4): joint, law, element, variable
    drive_f: Array  # (V, 2): value = f0 + f1 q (LINEAR) or f0 + f1 cos(q/2) (WHEEL)


class Paths(NamedTuple):
    """The ways from some target frames back to the base, and which joint columns they need."""

    starts: IntArray  # (C + 1,): steps of target c are starts[c]:starts[c + 1]
    steps: (
        IntArray  # (S, 9): element, column of variable 0..3 (-1: constant), 1 where it is the column's first
    )
    offsets: IntArray  # (C + 1,): columns of target c are offsets[c]:offsets[c + 1]
    joints: IntArray  # (K,): joint of every column, ascending within a target


def _frozen_int(values: Any, shape: tuple[int, ...]) -> IntArray:
    out: NDArray[np.int64] = np.array(values, dtype=np.int64).reshape(shape)
    out.flags.writeable = False
    return out


def build_tables(chains: tuple[Chain, ...], frames: tuple[str, ...], column: Mapping[str, int]) -> Tables:
    """Tables of validated chains; ``column`` is the index of every joint in q."""
    frame_of = {name: i for i, name in enumerate(frames)}
    element_i: list[list[int]] = [[0, -1, -1, -1, -1, -1]]
    element_f: list[list[float]] = [[0.0] * 4]
    drive_i: list[list[int]] = []
    drive_f: list[list[float]] = []
    for chain in chains:
        parent = frame_of[chain.parent]
        for element in chain.elements:
            e = len(element_i)
            ints = [ARC if isinstance(element, Arc) else ROW, parent, -1, -1, -1, -1]
            floats = [0.0, 0.0, element.length, 0.0] if isinstance(element, Arc) else [0.0] * 4
            for k, field in enumerate(element.VARIABLES):
                value = getattr(element, field)
                if isinstance(value, Joint):
                    law, joint, numbers = LINEAR, value.name, [value.offset, value.scale]
                elif isinstance(value, WheelRadius):
                    law, joint, numbers = WHEEL, value.joint.name, [value.rubber, value.link * COS_30]
                else:
                    floats[k] = value
                    continue
                ints[2 + k] = len(drive_i)
                drive_i.append([column[joint], law, e, k])
                drive_f.append(numbers)
            element_i.append(ints)
            element_f.append(floats)
            parent = e
    return Tables(
        _frozen_int(element_i, (-1, 6)),
        frozen(element_f),
        _frozen_int(drive_i, (-1, 4)),
        frozen(np.reshape(drive_f, (-1, 2))),
    )


def build_paths(tables: Tables, targets: tuple[int, ...]) -> Paths:
    """Paths from ``targets`` (frame numbers) to the base; a joint that drives several variables on one path
    has one column there."""
    starts, offsets = [0], [0]
    steps: list[list[int]] = []
    joints: list[int] = []
    for target in targets:
        elements = []
        frame = target
        while frame > 0:
            elements.append(frame)
            frame = int(tables.element_i[frame, 1])
        drives = [int(v) for e in elements for v in tables.element_i[e, 2:] if v >= 0]
        columns = {
            j: offsets[-1] + i for i, j in enumerate(sorted({int(tables.drive_i[v, 0]) for v in drives}))
        }
        met: set[int] = set()
        for e in elements:
            slots, firsts = [-1] * 4, [0] * 4
            # the order in which the backward recursion writes them
            for k in (3, 2, 1, 0):
                v = int(tables.element_i[e, 2 + k])
                if v >= 0:
                    slots[k] = columns[int(tables.drive_i[v, 0])]
                    firsts[k] = int(slots[k] not in met)
                    met.add(slots[k])
            steps.append([e, *slots, *firsts])
        starts.append(len(steps))
        offsets.append(offsets[-1] + len(columns))
        joints.extend(columns)
    return Paths(
        _frozen_int(starts, (-1,)),
        _frozen_int(steps, (-1, 9)),
        _frozen_int(offsets, (-1,)),
        _frozen_int(joints, (-1,)),
    )
