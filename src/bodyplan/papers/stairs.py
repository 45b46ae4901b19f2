"""A stance of paper *rectilinear* on stairs with unequal links: its angles as printed, and by plane geometry."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array

#: a2, a3 of the left leg, a4, a5 of the right one, m
LINKS = np.array([2.0, 1.8, 1.7, 2.1])
#: x, z of tail, middle and head, m: a step up, a larger one down
ANCHORS = np.array([[0.0, 0.0], [2.5, 0.4], [4.7, -0.2]])
CHORDS = np.diff(ANCHORS, axis=0)
LENGTHS = np.hypot(CHORDS[:, 0], CHORDS[:, 1])
#: alpha_L, alpha_R, signed
SLOPES = np.arctan2(CHORDS[:, 1], CHORDS[:, 0])


class Angle(NamedTuple):
    """``value`` rad as printed, of ``what`` in :func:`on_stairs`."""

    what: str
    value: Array


def on_stairs() -> dict[str, Array]:
    """Angles (rad) between lines through the anchors and the elbows, found where circles meet: no law of cosines."""
    elbows = []
    for k in range(2):
        a, b, length = LINKS[2 * k], LINKS[2 * k + 1], LENGTHS[k]
        along = CHORDS[k] / length
        foot = (a**2 - b**2 + length**2) / (2.0 * length)
        up = np.array([-along[1], along[0]])
        elbows.append(ANCHORS[k] + foot * along + np.sqrt(a**2 - foot**2) * up)
    points = np.array([ANCHORS[0], elbows[0], ANCHORS[1], elbows[1], ANCHORS[2]])
    steps = np.diff(points, axis=0)
    link = np.arctan2(steps[:, 1], steps[:, 0])
    return {
        "alpha": SLOPES,
        "beta": np.array([link[0] - SLOPES[0], SLOPES[1] - link[3]]),
        "phi": np.pi - np.array([link[0] - link[1], link[2] - link[3]]),
        "psi": np.array([SLOPES[0] - link[1], link[2] - SLOPES[1]]),
        "first": link[0],
        "elbows": np.array([link[1] - link[0], link[3] - link[2]]),
        "middle": link[2] - link[1],
        "closing": -link[3],
        "front left": link[1],
    }


def as_printed(place: str) -> Angle:
    """The equations of that place as printed; those that build on others with the others right."""
    a2, a3, a4, a5 = LINKS
    left, right = LENGTHS
    truth = on_stairs()
    (beta_l, beta_r), (psi_l, psi_r), (alpha_l, alpha_r) = truth["beta"], truth["psi"], SLOPES
    delta_l, delta_r = 0.5 * np.pi - alpha_l, 0.5 * np.pi - alpha_r

    def cosine(value: float) -> float:
        """acos as the paper writes it, atan2(sqrt(1 - c^2), c); nan beyond 1."""
        with np.errstate(invalid="ignore"):
            return float(np.arctan2(np.sqrt(1.0 - value**2), value))

    psi_as_right = cosine((a4**2 - a5**2 + left**2) / (2.0 * a4 * left))
    values = {
        "(35)-(38)": ("alpha", np.arctan2(CHORDS[:, 1] / CHORDS[:, 0], CHORDS[:, 0] / LENGTHS)),
        "(43)-(46)": (
            "beta",
            [
                cosine((a2**2 + left**2 - a3**2) / (2.0 * a2 * left)),
                cosine((a5**2 + right**2 - a4**2) / (2.0 * a5 * right)),
            ],
        ),
        "(47)-(50)": (
            "phi",
            [
                cosine((a2**2 - left**2 + a3**2) / (2.0 * a2 * left)),
                cosine((a4**2 - right**2 + a5**2) / (2.0 * a4 * right)),
            ],
        ),
        "(51), (53)": ("psi", [psi_as_right, psi_r]),
        "(52), (54)": ("psi", [psi_l, cosine((a4**2 - a5**2 + right**2) / (2.0 * a4 * right))]),
        "(55), (56), (62)": ("first", beta_l + alpha_l),
        "(63)": ("first", beta_l - alpha_l),
        # bends are magnitudes in the paper: an elbow turns nose-down
        "(57), (59), (64), (67)": ("elbows", -(np.pi - truth["phi"])),
        "(39)-(42), (58), (61)": ("middle", psi_r + psi_l + delta_r + delta_l - np.pi),
        "(60)": ("closing", beta_r + alpha_r),
        "(65)": ("middle", psi_r + psi_l + alpha_r + alpha_l),
        "(66)": ("front left", -(psi_l + alpha_l)),
    }
    what, value = values[place]
    return Angle(what, np.asarray(value, dtype=float))
