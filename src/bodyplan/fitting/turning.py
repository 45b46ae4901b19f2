"""By how much a mechanism has turned at a place of its body (paper *acm*, eqs. (8), (9))."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.fitting.mechanism import Mechanism


def body_turning(made: Mechanism, q: Array, kink: Array, s: Array) -> Array:
    """(..., S, 2): kink plus the bends (pitch, yaw) rad up to body lengths s (S,), for q (..., n) and kink (..., 2).

    A hinge counts from its place on, an arc in proportion to what lies before s, a double joint by halves.
    """
    start, end = made.units[made.joint_place].T
    if made.kind == "arc":
        share = np.clip((s - start[:, None]) / (end - start)[:, None], 0.0, 1.0)
    elif made.kind == "double":
        first, second = made.hinges[made.joint_place].T
        share = 0.5 * (s >= first[:, None]) + 0.5 * (s >= second[:, None])
    else:
        share = (s >= start[:, None]).astype(np.float64)
    bends = q * made.gain
    out = np.empty((*q.shape[:-1], len(s), 2))
    for axis in range(2):
        mine = made.joint_axis == axis
        out[..., axis] = kink[..., None, axis] + bends[..., mine] @ share[mine]
    return out
