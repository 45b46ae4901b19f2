"""robot + gait + ground + times -> Motion."""

from __future__ import annotations

from numpy.typing import ArrayLike

from bodyplan.arrays import finite
from bodyplan.errors import InputError
from bodyplan.gaits.base import Gait
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot

#: most samples in one plan: a mistyped dt should not eat the machine
MOST_SAMPLES = 1_000_000


def plan(robot: Robot, gait: Gait, ground: Ground, t: ArrayLike) -> Motion:
    """Plan ``gait`` for ``robot`` on ``ground`` at times ``t`` (T,) s, strictly increasing (see :func:`times`).

    Returns a :class:`Motion`; samples that cannot be solved have a status (``motion.raise_if_failed()``).
    Raises InputError for arguments of the wrong kind, and where robot and gait do not go together.
    """
    for value, kind, field in ((robot, Robot, "robot"), (gait, Gait, "gait"), (ground, Ground, "ground")):
        if not isinstance(value, kind):
            raise InputError(f"{field}: expected a {kind.__name__}, got {value!r}.")
    at = finite(t, "t", (None,))
    if len(at) < 2 or (at[1:] <= at[:-1]).any():
        raise InputError("t: needs at least two times, strictly increasing.")
    if len(at) > MOST_SAMPLES:
        raise InputError(f"t: {len(at)} samples are more than the {MOST_SAMPLES} allowed.")
    return gait.plan(robot, ground, at)
