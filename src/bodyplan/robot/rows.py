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
from bodyplan.spatial.coefficients import coefficients, slopes
from bodyplan.spatial.rotations import rotation_exp
from bodyplan.spatial.twists import adjoint_inverse


def row_transform(theta: ArrayLike, d: ArrayLike, a: ArrayLike, epsilon: ArrayLike) -> tuple[Array, Array]:
    """(position (..., 3) m, rotation (..., 3, 3)) of the new frame in the previous one:
    ``Rz(theta) Tz(d) Tx(a) Rx(epsilon)``. Angles in rad, lengths in m; InputError where not finite."""
    theta, d, a, epsilon = _together(theta=theta, d=d, a=a, epsilon=epsilon)
    ct, st, ce, se = np.cos(theta), np.sin(theta), np.cos(epsilon), np.sin(epsilon)
    zero = np.zeros_like(theta)
    R = np.stack([ct, -st * ce, st * se, st, ct * ce, -ct * se, zero, se, ce], axis=-1)
    return np.stack([a * ct, a * st, d], axis=-1), R.reshape(*theta.shape, 3, 3)


def row_matrices(theta: ArrayLike, d: ArrayLike, a: ArrayLike, epsilon: ArrayLike) -> tuple[Array, Array]:
    """(D (..., 6, 6), E (..., 6, 4)) of a D-H row; columns of E: theta, d, a, epsilon.

    Paper *legs* eqs. (2)-(3), which are right for body-fixed twists.
    """
    position, R = row_transform(theta, d, a, epsilon)
    theta, d, a, epsilon = _together(theta=theta, d=d, a=a, epsilon=epsilon)
    ce, se = np.cos(epsilon), np.sin(epsilon)
    E = np.zeros((*theta.shape, 6, 4))
    # A, rows of v
    E[..., 0, 2] = 1.0
    E[..., 1, 0], E[..., 1, 1] = a * ce, se
    E[..., 2, 0], E[..., 2, 1] = -a * se, ce
    # B, rows of omega
    E[..., 3, 3] = 1.0
    E[..., 4, 0], E[..., 5, 0] = se, ce
    return adjoint_inverse(position, R), E


def arc_transform(length: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> tuple[Array, Array]:
    """(position (..., 3) m, rotation (..., 3, 3)) of the end frame of an arc in its start frame.

    The rotation vector is phi = (0, pitch, yaw) rad and the end point ``length`` times the integral of
    exp(u [phi]) e_x over u in [0, 1] (paper *acm* eq. (1) with constant kappa_p, kappa_y and tau = 0; eqs.
    (33), (34) in the form that is regular when straight).
    """
    length, pitch, yaw = _together(length=length, pitch=pitch, yaw=yaw)
    A, B, _ = coefficients(np.hypot(pitch, yaw))
    phi = np.stack([np.zeros_like(pitch), pitch, yaw], axis=-1)
    return length[..., None] * np.stack([A, B * yaw, -B * pitch], axis=-1), rotation_exp(phi)


def arc_matrices(length: ArrayLike, pitch: ArrayLike, yaw: ArrayLike) -> tuple[Array, Array]:
    """(D (..., 6, 6), E (..., 6, 2)) of an arc; columns of E: pitch, yaw. Regular when straight."""
    position, R = arc_transform(length, pitch, yaw)
    length, p, y = _together(length=length, pitch=pitch, yaw=yaw)
    angle = np.hypot(p, y)
    _, B, C = coefficients(angle)
    A1, B1 = slopes(angle)
    E = np.zeros((*p.shape, 6, 2))
    # v: d(end point)/d(pitch), d/d(yaw), turned into the end frame
    slope = np.stack([p * A1, y * A1, p * y * B1, B + y * y * B1, -B - p * p * B1, -p * y * B1], axis=-1)
    E[..., :3, :] = np.swapaxes(R, -1, -2) @ (length[..., None, None] * slope.reshape(*p.shape, 3, 2))
    # omega: columns 2 and 3 of the transposed left Jacobian I - B [phi] + C [phi]^2
    E[..., 3, 0], E[..., 3, 1] = B * y, -B * p
    E[..., 4, 0], E[..., 5, 1] = 1.0 - C * y * y, 1.0 - C * p * p
    E[..., 4, 1] = E[..., 5, 0] = C * p * y
    return adjoint_inverse(position, R), E


def _together(**values: ArrayLike) -> tuple[Array, ...]:
    try:
        return np.broadcast_arrays(*(finite(value, field) for field, value in values.items()))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        shapes = ", ".join(f"{field} {np.shape(value)}" for field, value in values.items())
        raise InputError(f"shapes do not broadcast: {shapes}.") from error
