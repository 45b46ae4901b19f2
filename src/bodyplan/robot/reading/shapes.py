"""Primitive shapes of a model as contacts. Meshes are none."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.elements import Contact

#: how far a turn may be off one by right angles (of a box) or about z (of a disc)
ALIGNED = 1e-12
#: how far a ball may be off the end of a cylinder, m
SAME = 1e-6


@dataclass(frozen=True)
class Shape:
    """``kind``: "sphere" (radius), "capsule", "cylinder" (radius, length m along z without the caps) or "box" (three
    half sizes); ``place`` (4, 4) in the frame of its link."""

    name: str
    kind: str
    sizes: tuple[float, ...]
    place: Array
    friction: float | None = None


def contact_of(shape: Shape, frame: str) -> tuple[Contact, Array | None]:
    """(contact, turned): the shape as a contact on ``frame``, or, where it is turned in a way that a contact cannot
    be, in a frame at ``turned`` (4, 4) from there.

    A cylinder longer than thick becomes the capsule that fits into it; a disc becomes a rim, the circle around its
    middle.
    """
    R, at, kind = shape.place[:3, :3], shape.place[:3, 3], shape.kind
    if kind == "sphere" or (kind != "box" and shape.sizes[1] == 2.0 * shape.sizes[0] * (kind == "cylinder")):
        return Contact(shape.name, frame, "sphere", shape.sizes[0], _point(at), friction=shape.friction), None
    if kind == "box":
        swap = np.abs(R).round()
        # an exact turn by right angles swaps the sides
        half = swap @ np.array(shape.sizes)
        if np.abs(np.abs(R) - swap).max() <= ALIGNED:
            return Contact(shape.name, frame, "box", 0.0, _point(at), half=_point(half), friction=shape.friction), None
        size = _point(np.array(shape.sizes))
        return Contact(shape.name, frame, "box", half=size, friction=shape.friction), shape.place
    radius, length = shape.sizes
    if kind == "cylinder" and length < 2.0 * radius:
        if np.abs(R[:2, 2]).max() <= ALIGNED:
            return Contact(shape.name, frame, "rim", radius, _point(at), friction=shape.friction), None
        return Contact(shape.name, frame, "rim", radius, friction=shape.friction), shape.place
    reach = 0.5 * length - radius * (kind == "cylinder")
    ends = _point(at - reach * R[:, 2]), _point(at + reach * R[:, 2])
    return Contact(shape.name, frame, "capsule", radius, *ends, friction=shape.friction), None


def rounded(shapes: tuple[Shape, ...]) -> tuple[Shape, ...]:
    """The shapes of a link, a cylinder with a ball of its radius on either end as the capsule that URDF cannot say."""
    out = list(shapes)
    for tube in shapes:
        if tube.kind == "cylinder":
            ends = (tube.place[:3, 3] + 0.5 * side * tube.sizes[1] * tube.place[:3, 2] for side in (-1.0, 1.0))
            balls = [next((s for s in out if _is_ball(s, tube.sizes[0], end)), None) for end in ends]
            if balls[0] is not None and balls[1] is not None:
                out = [s for s in out if s is not balls[0] and s is not balls[1]]
                out[next(i for i, s in enumerate(out) if s is tube)] = replace(tube, kind="capsule")
    return tuple(out)


def _is_ball(shape: Shape, radius: float, at: Array) -> bool:
    off = (shape.sizes[0] - radius, *(shape.place[:3, 3] - at))
    return shape.kind == "sphere" and bool(np.abs(off).max() <= SAME)


def _point(values: Array) -> tuple[float, float, float]:
    x, y, z = (0.0 + values).tolist()
    return x, y, z
