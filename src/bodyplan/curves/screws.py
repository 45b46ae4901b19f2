"""Pieces of constant curvature and torsion seen in a frame that turns about the curve: lines, arcs, helices."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.spatial import compose, exp
from bodyplan.spatial.coefficients import sinc

#: a number or an array that broadcasts with the places
Value = float | Array


def turning_bends(kappa_p: Value, kappa_y: Value, turn: Value, s: Array) -> tuple[Array, Array]:
    """(kappa_p, kappa_y) at s of a bend whose direction turns by ``turn`` rad/m from its value at s = 0.

    kappa_y = k cos(d + turn s), kappa_p = -k sin(d + turn s): eq. (5) with a direction d.
    """
    c, n = np.cos(turn * s), np.sin(turn * s)
    return kappa_p * c - kappa_y * n, kappa_y * c + kappa_p * n


def turning_bend_integrals(kappa_p: Value, kappa_y: Value, turn: Value, a: Array, b: Array) -> tuple[Array, Array]:
    """Integrals of :func:`turning_bends` from a to b, rad: the value half way times the length times sinc, so that
    nothing cancels and ``turn`` = 0 is no exception."""
    middle = turning_bends(kappa_p, kappa_y, turn, 0.5 * (a + b))
    length = (b - a) * sinc(np.asarray(0.5 * turn * (b - a)))
    return length * middle[0], length * middle[1]


def turning_bend_poses(tau: Value, kappa_p: Value, kappa_y: Value, turn: Value, s: Array) -> Array:
    """Poses (..., 7) at s of the frame with tau and :func:`turning_bends`, identity at s = 0; arguments broadcast.

    A frame rolled so that it keeps pace with the bend has the constant shape (tau + turn, kappa_p, kappa_y): a
    screw. Its torsion as a curve is tau + turn.
    """
    zero = np.zeros(np.shape(s))
    screw = exp(np.stack(np.broadcast_arrays(s, zero, zero, (tau + turn) * s, kappa_p * s, kappa_y * s), axis=-1))
    back = np.zeros(screw.shape)
    back[..., 3], back[..., 4] = np.cos(0.5 * turn * s), -np.sin(0.5 * turn * s)
    return compose(screw, back)
