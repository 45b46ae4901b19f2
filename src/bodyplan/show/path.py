"""The curve at rest that a motion says its body moves along, for the replay."""

from __future__ import annotations

import numpy as np

from bodyplan import curves
from bodyplan.arrays import Array
from bodyplan.errors import BodyplanError
from bodyplan.show.playback import Playback

#: points of the path, a body length and in all
DENSITY, MOST = 100, 3000


def planned_path(playback: Playback) -> Array | None:
    """Points (k, 3) m of the curve that the body passes over in all cycles of the playback; None for a motion that
    does not claim to follow a curve at rest."""
    motion = playback.motion
    claim = next((c for c in motion.claims if c.kind == "follows" and np.ndim(c.data["pose"]) == 1), None)
    if claim is None:
        return None
    places = np.asarray(claim.data["places"])
    length = float(np.ptp(places[0]))
    # beyond the planned times the body goes on at the same pace
    pace = (places[-1] - places[0]) / (motion.t[-1] - motion.t[0])
    more = max(float(playback.t[-1]) - float(motion.t[-1] - motion.t[0]), 0.0)
    reached = np.concatenate([places.ravel(), places[-1] + more * pace])
    low, high = float(reached.min()), float(reached.max())
    if not length > 0.0:
        return None
    count = int(min(MOST, 2 + DENSITY * (high - low) / length))
    try:
        curve = curves.from_dict(claim.data["curve"])
        points, _ = curve.frames(np.linspace(low, high, count), claim.data["pose"], tolerance=1e-6)
    except BodyplanError:  # a replay is worth having without it
        return None
    return points
