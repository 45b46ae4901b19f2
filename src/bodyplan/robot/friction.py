"""Coulomb friction of a robot's contacts on a ground, where nobody says otherwise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bodyplan.arrays import Array
from bodyplan.ground.base import Ground
from bodyplan.robot.elements import Contact

#: coefficient where neither the ground, nor the contact, nor the caller names one
DEFAULT = 0.5


def floor_friction(ground: Ground, contacts: Sequence[Contact]) -> Array:
    """Coefficients (c,) of contacts on the floor: that of the ground, or else of the contact, or else 0.5."""
    mine = getattr(ground, "friction", None)
    found = ((mine if mine is not None else contact.friction) for contact in contacts)
    return np.array([DEFAULT if mu is None else float(mu) for mu in found], dtype=np.float64)
