"""From poses and compact Jacobians to the matrices P and Q of the velocity equation (paper *legs*, eq. (9))."""

from __future__ import annotations

from numba import njit

from bodyplan.arrays import Array, IntArray
from bodyplan.spatial.lanes import strip


@njit(cache=True, nogil=True, error_model="numpy")
def spread_kernel(
    batch: int,
    n: int,
    position: Array,
    rotation: Array,
    twist: Array,
    offsets: IntArray,
    joints: IntArray,
    P: Array,
    Q: Array,
) -> None:
    """Fill P (B, 6 C, 6) and Q (B, 6 C, n), either of them empty where it is not wanted, from ``position`` (B, C, 3),
    ``rotation`` (B, C, 3, 3) seen from the base and ``twist`` (B, K, 6); ``offsets`` and ``joints`` as in
    :class:`bodyplan.robot.reach.Reach`. Contiguous arrays of any shape of that size."""
    C, K = len(offsets) - 1, len(joints)
    p, R = strip(position, 0, batch * C * 3), strip(rotation, 0, batch * C * 9)
    T = strip(twist, 0, batch * K * 6)
    carried, columns = strip(P, 0, P.size), strip(Q, 0, Q.size)
    for i in range(columns.size):
        columns[i] = 0.0
    for b in range(batch):
        for c in range(C):
            at = b * C + c
            if carried.size > 0:
                px, py, pz = p[3 * at], p[3 * at + 1], p[3 * at + 2]
                for k in range(3):
                    # row k: axis k of the frame, and its moment about the base
                    x, y, z = R[9 * at + k], R[9 * at + 3 + k], R[9 * at + 6 + k]
                    v, w = 36 * at + 6 * k, 36 * at + 18 + 6 * k
                    carried[v], carried[v + 1], carried[v + 2] = x, y, z
                    carried[v + 3], carried[v + 4], carried[v + 5] = py * z - pz * y, pz * x - px * z, px * y - py * x
                    carried[w], carried[w + 1], carried[w + 2] = 0.0, 0.0, 0.0
                    carried[w + 3], carried[w + 4], carried[w + 5] = x, y, z
            if columns.size > 0:
                for k in range(offsets[c], offsets[c + 1]):
                    for row in range(6):
                        columns[(6 * at + row) * n + joints[k]] = T[6 * (b * K + k) + row]
