"""Kinematics of one element: its transform, and its velocity matrices D and E (paper *legs* eqs. (1)-(4)).

    V_i = D_i V_(i-1) + E_i d(variables)/dt

for body-fixed twists V = (v, omega) in m/s and rad/s, both in the axes of their own frame (in the paper
"phi-dot" is this omega, not the rates of roll, pitch and yaw). NumPy, any leading batch shape. The composite
of a chain is ``P = D_n ... D_1`` and ``Q = [D_n ... D_2 E_1 | ... | E_n]``; the paper prints the products in
the opposite order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError
from bodyplan.robot.formulas import Scalar, arc_pose, arc_velocity, row_pose, row_velocity
from bodyplan.spatial.coefficients import coefficients


def row_transform(theta: ArrayLike, d: ArrayLike, a: ArrayLike, epsilon: ArrayLike) -> tuple[Array, Array]:
    """(position (..., 3) m, rotation (..., 3, 3)) of the new frame in the previous one:
    ``Rz(theta) Tz(d) Tx(a) Rx(epsilon)``. Angles in rad, lengths in m; InputError where not finite."""
    theta, d, a, epsilon = _together(theta=theta, d=d, a=a, epsilon=epsilon)
    position, rotation = row_pose(np.cos(theta), np.sin(theta), d, a, np.cos(epsilon), np.sin(epsilon))
    return _filled(position, theta.shape), _filled(rotation, theta.shape)


def row_matrices(theta: ArrayLike, d: ArrayLike, a: ArrayLike, epsilon: ArrayLike) -> tuple[Array, Array]:
    """(D (..., 6, 6), E (..., 6, 4)) of a D-H row; columns of E: theta, d, a, epsilon.

    Paper *legs* eqs. (2)-(3), which are right for body-fixed twists.
    """
    theta, d, a, epsilon = _together(theta=theta, d=d, a=a, epsilon=epsilon)
    D, E = row_velocity(np.cos(theta), np.sin(theta), d, a, np.cos(epsilon), np.sin(epsilon))
    return _filled(D, theta.shape), _filled(E, theta.shape)


def arc_transform(length: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> tuple[Array, Array]:
    """(position (..., 3) m, rotation (..., 3, 3)) of the end frame of an arc in its start frame.

    The rotation vector is phi = (0, pitch, yaw) rad and the end point ``length`` times the integral of
    exp(u [phi]) e_x over u in [0, 1] (paper *acm* eq. (1) with constant kappa_p, kappa_y and tau = 0; eqs.
    (33), (34) in the form that is regular when straight).
    """
    length, pitch, yaw = _together(length=length, pitch=pitch, yaw=yaw)
    A, B, _ = coefficients(np.hypot(pitch, yaw))
    position, rotation = arc_pose(length, pitch, yaw, A, B)
    return _filled(position, pitch.shape), _filled(rotation, pitch.shape)


def arc_matrices(length: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> tuple[Array, Array]:
    """(D (..., 6, 6), E (..., 6, 2)) of an arc; columns of E: pitch, yaw. Regular when straight."""
    length, pitch, yaw = _together(length=length, pitch=pitch, yaw=yaw)
    D, E = arc_velocity(length, pitch, yaw, *coefficients(np.hypot(pitch, yaw)))
    return _filled(D, pitch.shape), _filled(E, pitch.shape)


def _filled(entries: list[Scalar], shape: tuple[int, ...]) -> Array:
    """Nested lists of scalars and arrays (...,) as one array (..., *sizes of the lists)."""
    rows = entries if isinstance(entries[0], list) else [[entry] for entry in entries]
    out = np.empty((*shape, len(rows), len(rows[0])))
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            out[..., i, j] = value
    return out if isinstance(entries[0], list) else out[..., 0]


def _together(**values: ArrayLike) -> tuple[Array, ...]:
    try:
        return np.broadcast_arrays(*(finite(value, field) for field, value in values.items()))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        shapes = ", ".join(f"{field} {np.shape(value)}" for field, value in values.items())
        raise InputError(f"shapes do not broadcast: {shapes}.") from error
