"""What ROS 2 wants of times: whole seconds and nanoseconds."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import InputError

NANO = 1_000_000_000
#: builtin_interfaces/Time and Duration count seconds in 32 bits
MOST_SECONDS = 2**31


def nanoseconds(t: Array) -> IntArray:
    """Times (T,) s as whole nanoseconds, each the nearest one. Raises InputError for times that ROS 2 has no number
    for, and for samples less than a nanosecond apart."""
    if np.abs(t).max() >= MOST_SECONDS:
        raise InputError(f"Motion.t: ROS 2 counts to {MOST_SECONDS - 1} s, got {t[np.abs(t).argmax()]!r}.")
    seconds = np.floor(t)
    out = seconds.astype(np.int64) * NANO + np.rint((t - seconds) * NANO).astype(np.int64)
    close = np.flatnonzero(np.diff(out) <= 0)
    if len(close):
        raise InputError(f"Motion.t: samples {close[0]} and {close[0] + 1} are less than a nanosecond apart.")
    return out


def split(stamp: int) -> tuple[int, int]:
    """Nanoseconds as (sec, nanosec), 0 <= nanosec < 10^9."""
    return divmod(int(stamp), NANO)
