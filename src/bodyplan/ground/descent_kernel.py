"""Local minima of the distance from one point P = (x, y, z) to a ground z = f(u, v), as kernels.

Half the squared distance, phi = D^2 / 2, has with e = f - z

    gradient  (u - x, v - y) + e grad f
    Hessian   I + grad f grad f' + e Hess f.
"""

from __future__ import annotations

import math

from bodyplan.arrays import Array
from bodyplan.ground.field_kernel import GX, GY, HXX, HXY, HYY, JET, F, FieldArrays, Room, crease_at, jet_at
from bodyplan.kernels import lean

_STEPS, _HALVINGS, _CREASE_STEPS = 60, 30, 30


@lean
def half_square(p: Array, u: float, v: float, f: float) -> float:
    """phi at (u, v), where the ground has the height f."""
    a, b, e = u - p[0], v - p[1], f - p[2]
    return float(0.5 * (a * a + b * b + e * e))


@lean
def descend(
    field: FieldArrays,
    p: Array,
    u: float,
    v: float,
    low_x: float,
    low_y: float,
    high_x: float,
    high_y: float,
    room: Room,
) -> tuple[float, float, float, bool]:
    """A local minimum of phi in a box, from (u, v) in it: its place, the distance there, and whether it settled.

    Newton steps that lower phi, clipped to the box.
    """
    here, trial = room.here, room.trial
    jet_at(field, u, v, room, here)
    phi = half_square(p, u, v, here[F])
    size = max(abs(p[0]), abs(p[1]), abs(p[2]))
    for _ in range(_STEPS):
        e, gx, gy = here[F] - p[2], here[GX], here[GY]
        slope_x, slope_y = u - p[0] + e * gx, v - p[1] + e * gy
        # where phi is not convex, the convex part of its Hessian gives a direction of descent
        a, b, c = 1.0 + gx * gx, gx * gy, 1.0 + gy * gy
        full_a, full_b, full_c = a + e * here[HXX], b + e * here[HXY], c + e * here[HYY]
        if full_a > 0.0 and full_a * full_c > full_b * full_b:
            a, b, c = full_a, full_b, full_c
        # coordinates that are held at an end of their range do not move
        right, up = slope_x, slope_y
        if (u <= low_x and right > 0.0) or (u >= high_x and right < 0.0):
            right, a, b = 0.0, 1.0, 0.0
        if (v <= low_y and up > 0.0) or (v >= high_y and up < 0.0):
            up, b, c = 0.0, 0.0, 1.0
        determinant = a * c - b * b
        step_x, step_y = (b * up - c * right) / determinant, (b * right - a * up) / determinant
        if not (math.isfinite(step_x) and math.isfinite(step_y)):
            step_x = step_y = 0.0
        # the first half, quarter, ... of the step that lowers phi enough; near the minimum phi changes by less than its
        # rounding, and the full step is right
        noise = 2e-15 * (phi + math.sqrt(phi) * size)
        before, moved, share = phi, False, 1.0
        for _ in range(_HALVINGS):
            x = min(max(u + share * step_x, low_x), high_x)
            y = min(max(v + share * step_y, low_y), high_y)
            if x == u and y == v:
                break
            jet_at(field, x, y, room, trial)
            phi = half_square(p, x, y, trial[F])
            if phi <= before + 1e-4 * (slope_x * (x - u) + slope_y * (y - v)) + noise:
                moved = True
                break
            share *= 0.5
        if not moved:
            return u, v, math.sqrt(2.0 * before), True
        u, v = x, y
        for k in range(JET):
            here[k] = trial[k]
        if max(abs(step_x), abs(step_y)) <= max(1e-9 * math.sqrt(2.0 * before), 1e-14 * size):
            return u, v, math.sqrt(2.0 * phi), True
    return u, v, math.sqrt(2.0 * phi), False


@lean
def descend_crease(field: FieldArrays, k: int, p: Array, u: float, v: float, room: Room) -> tuple[float, float, float]:
    """A stationary point of D on the line s(u, v) = 0 along which the ground has its k-th crease, from (u, v), and D.

    Newton across and along the line: with t its direction, -s grad s/|grad s|^2 across and
    -(grad phi . t) / (t' (Hess phi + l Hess s) t) along, where l = -grad phi . grad s/|grad s|^2. It does
    not matter which side's derivatives f has: the sides differ by a multiple of s. May fail; the caller
    compares distances.
    """
    here, s, box = room.here, room.crease, field.box
    for _ in range(_CREASE_STEPS):
        jet_at(field, u, v, room, here)
        crease_at(field, k, u, v, room)
        e, gx, gy = here[F] - p[2], here[GX], here[GY]
        slope_x, slope_y = u - p[0] + e * gx, v - p[1] + e * gy
        square = s[GX] * s[GX] + s[GY] * s[GY]
        size = math.sqrt(square)
        t_x, t_y = -s[GY] / size, s[GX] / size
        pull = -(slope_x * s[GX] + slope_y * s[GY]) / square
        a = 1.0 + gx * gx + e * here[HXX] + pull * s[HXX]
        b = gx * gy + e * here[HXY] + pull * s[HXY]
        c = 1.0 + gy * gy + e * here[HYY] + pull * s[HYY]
        stiffness = t_x * (a * t_x + b * t_y) + t_y * (b * t_x + c * t_y)
        along = -(slope_x * t_x + slope_y * t_y) / abs(stiffness)
        step_x, step_y = -s[F] / square * s[GX] + along * t_x, -s[F] / square * s[GY] + along * t_y
        x = min(max(u + step_x, box[0, 0]), box[1, 0]) if math.isfinite(step_x) else u
        y = min(max(v + step_y, box[0, 1]), box[1, 1]) if math.isfinite(step_y) else v
        if x == u and y == v:
            break
        u, v = x, y
    jet_at(field, u, v, room, here)
    return u, v, math.sqrt(2.0 * half_square(p, u, v, here[F]))
