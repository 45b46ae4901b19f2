"""The nearest point of a smooth ground z = f(u, v) to a point P, proved to be the global one.

The nearest point lies within the vertical gap of P, and Newton (:mod:`bodyplan.ground.descent_kernel`) starts at
the foot of the vertical. Let it end at a distance D, and let M bound the norm of Hess f on the disc of
radius D about (x, y). Where D M < sqrt(3) - 1 no other point is nearer: phi = D^2/2 is convex wherever f is
within 1/M of z, and leaving that band and coming back takes a way of 2 sqrt(2 (1 - D M)) / M in the plane,
more than the 2 D that the disc offers. Elsewhere branch and bound decides: boxes that bounds of f rule out
are dropped, boxes on which phi is convex are left to Newton, the others are cut into four.

All of it runs in kernels, point by point (:mod:`bodyplan.ground.nearest_kernel`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array

if TYPE_CHECKING:
    from bodyplan.ground.field_kernel import FieldArrays

#: (x, y) (n,) -> value (n,), gradient (n, 2) and Hessian (n, 2, 2); value nan where it is undefined
JetFunction = Callable[[Array, Array], tuple[Array, Array, Array]]


@dataclass(frozen=True)
class Bounds:
    """What is known of f over n boxes: (lowest, highest) of f in ``z`` (2, n) and of its second derivatives
    in ``hessian`` (2, n, 2, 2); ``change`` (n,) bounds the norm of its third derivatives (inf: unknown). ``gradient``
    (2, n, 2): of its first derivatives, or None."""

    z: Array
    hessian: Array
    change: Array
    gradient: Array | None = None


def nearest(field: FieldArrays, points: Array, caps: Array) -> tuple[Array, Array, int]:
    """Of groups of ``points`` (n, k, 3), where the ground is nearest (n, 2), and its signed distance (n,) m.

    Of a group, the smallest one counts, and only what is less than ``caps`` (n,) m: where nothing is, the place is nan
    and the distance the cap. The last number is -1, or that of the first of all points that is beyond the edge or has
    no ground below it; then nothing holds.
    """
    from bodyplan.ground.field_kernel import Room
    from bodyplan.ground.nearest_kernel import MAX_BOXES, clearances

    found, out = np.full((len(points), 2), np.nan), np.array(caps, dtype=np.float64)
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    refused = clearances(field, flat, points.shape[1], Room.of(field, 4 * MAX_BOXES), found, out)
    return found, out, refused
