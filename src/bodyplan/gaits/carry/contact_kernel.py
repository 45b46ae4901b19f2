"""The kernels of :mod:`bodyplan.gaits.carry.contact` for height maps and formulas: a contact found, proved and
measured, wheel by wheel.

The columns of ``planes`` (n, 9) are centre, ahead and up, those of ``feet`` (n, COLUMNS) the sections at s = 0.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry.newton import BEST_CHI, BEST_RADIUS, CHI, GOES_ON, MERIT, MOST_STEPS, RADIUS, SETTLED, tried
from bodyplan.gaits.carry.search_kernel import bent, nearest_on
from bodyplan.gaits.carry.section_kernel import FIRST, FOUND, Room, W, farthest, foot_at
from bodyplan.ground.field_kernel import GX, GY, HXX, HXY, HYY, FieldArrays, jet_at
from bodyplan.kernels import lean

#: outcomes
TOUCHES, LIES_FLAT, NO_GROUND, AXLE_BELOW, UNPROVED, OFF_THE_MAP = range(6)


@lean
def _guess(foot: Array, tilt: float, start: float) -> tuple[float, float]:
    """Where the tangent of the section below the centre is nearest; or where the ground is in a given direction, at
    the contact angle ``start`` (nan: none)."""
    w, first = foot[W], foot[FIRST]
    chi = start + tilt if math.isfinite(start) else math.atan(first)
    # distance of that tangent in the direction chi
    radius = -w / (math.cos(chi) + first * math.sin(chi))
    if not (math.isfinite(radius) and 0.0 < radius < -10.0 * w):
        chi = math.atan(first)
        radius = abs(w) * math.cos(chi)
    return chi, radius


@lean
def _settled(land: FieldArrays, plane: Array, chi: float, radius: float, room: Room, state: Array) -> bool:
    """Newton's method of :mod:`bodyplan.gaits.carry.newton` for one wheel, into ``state`` (8,)."""
    for k in range(len(state)):
        state[k] = 0.0
    state[CHI], state[RADIUS], state[BEST_CHI], state[BEST_RADIUS], state[MERIT] = chi, radius, chi, radius, np.inf
    at = room.here
    for _ in range(MOST_STEPS):
        s, w = state[RADIUS] * math.sin(state[CHI]), -state[RADIUS] * math.cos(state[CHI])
        x, y = plane[0] + s * plane[3] + w * plane[6], plane[1] + s * plane[4] + w * plane[7]
        jet_at(land, x, y, room, at)
        outcome = tried(state, plane, at)
        if outcome != GOES_ON:
            return bool(outcome == SETTLED)
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def settle(
    land: FieldArrays,
    planes: Array,
    tilt: Array,
    flat: BoolArray,
    start: Array,
    same: float,
    room: Room,
    feet: Array,
    chi: Array,
    radius: Array,
    settled: BoolArray,
    outcome: IntArray,
) -> None:
    """Of n wheels that lean by ``tilt`` (n,) and may lie ``flat`` (n,) the sections below their centres, and Newton's
    contacts from there or from the contact angles ``start`` (n,); ``settled`` (n,): there is one, no farther than the
    ground below, to a share ``same``."""
    state = np.empty(8)
    for k in range(len(planes)):
        foot = feet[k]
        foot_at(land, planes[k], 0.0, room, foot)
        outcome[k] = LIES_FLAT if flat[k] else NO_GROUND if foot[FOUND] == 0.0 else TOUCHES
        if outcome[k] == TOUCHES and foot[W] >= 0.0:
            outcome[k] = AXLE_BELOW
        chi[k], radius[k] = _guess(foot, tilt[k], start[k])
        settled[k] = False
        if outcome[k] == TOUCHES:
            done = _settled(land, planes[k], chi[k], radius[k], room, state)
            chi[k], radius[k] = state[BEST_CHI], state[BEST_RADIUS]
            settled[k] = done and radius[k] <= abs(foot[W]) * (1.0 + same)


@njit(cache=True, nogil=True, error_model="numpy")
def follow(land: FieldArrays, planes: Array, room: Room, chi: Array, radius: Array, outcome: IntArray) -> None:
    """Newton's contacts of n wheels from ``chi`` rad, ``radius`` m (n,) on, into these."""
    state = np.empty(8)
    for k in range(len(planes)):
        done = _settled(land, planes[k], chi[k], radius[k], room, state)
        chi[k], radius[k] = state[BEST_CHI], state[BEST_RADIUS]
        outcome[k] = TOUCHES if done else UNPROVED


@njit(cache=True, nogil=True, error_model="numpy")
def prove(
    land: FieldArrays,
    planes: Array,
    tilt: Array,
    feet: Array,
    sure: BoolArray,
    settled: BoolArray,
    edged: bool,
    same: float,
    certain: float,
    limits: Array,
    room: Room,
    chi: Array,
    radius: Array,
    second: Array,
    corner: BoolArray,
    outcome: IntArray,
) -> None:
    """The nearest contacts of n wheels into ``chi``, ``radius``, ``second``, ``corner``, ``outcome`` (n,), by a look at
    the bounds or by a search, unless they are ``sure`` (n,). ``edged``: the ground has edges; ``certain`` and
    ``limits``: numbers of :mod:`bodyplan.gaits.carry.search`."""
    state = np.empty(8)
    for k in range(len(planes)):
        if outcome[k] != TOUCHES or sure[k]:
            continue
        plane = planes[k]
        if settled[k]:
            reach = radius[k] * (1.0 + limits[1])
            low, high, rise = bent(land, plane, feet[k], 0.0, reach, room)
            if math.isfinite(rise) and max(abs(low), abs(high)) * reach < certain:
                continue
        guess = radius[k] * math.sin(chi[k]) if settled[k] else 0.0
        s, w, distance, other, certified = nearest_on(land, plane, feet[k], guess, limits, room)
        fine = settled[k] and s == guess and abs(radius[k] - distance) <= same * distance
        if not fine:
            angle = math.atan2(s, -w)
            # Newton improves a contact with a tangent; on an edge it goes elsewhere
            fine = _settled(land, plane, angle, distance, room, state)
            fine = fine and abs(state[BEST_RADIUS] - distance) <= same * distance
            fine = fine and abs(state[BEST_RADIUS] * math.sin(state[BEST_CHI]) - s) <= limits[2] * distance
            chi[k], radius[k] = (state[BEST_CHI], state[BEST_RADIUS]) if fine else (angle, distance)
        # only ground with edges has contacts without a tangent
        corner[k] = edged and not fine
        if math.isfinite(other):
            foot_at(land, plane, other, room, room.here)
            second[k] = math.atan2(other, -room.here[W]) - tilt[k]
        if not (certified and (fine or edged)):
            outcome[k] = UNPROVED


@njit(cache=True, nogil=True, error_model="numpy")
def measure(
    land: FieldArrays,
    planes: Array,
    tilt: Array,
    chi: Array,
    radius: Array,
    corner: BoolArray,
    tolerance: float,
    room: Room,
    phi: Array,
    point: Array,
    normal: Array,
    curvature: Array,
    residual: Array,
    hessian: Array,
    outcome: IntArray,
) -> None:
    """What there is to know of contacts at ``chi``, ``radius`` (n,), into arrays of
    :class:`bodyplan.gaits.carry.contact.Contacts`; ``tolerance`` m of their residuals, at the origin."""
    at = room.here
    for k in range(len(planes)):
        plane = planes[k]
        sine, cosine = math.sin(chi[k]), math.cos(chi[k])
        phi[k] = chi[k] - tilt[k]
        for i in range(3):
            point[k, i] = plane[i] + radius[k] * (sine * plane[3 + i] - cosine * plane[6 + i])
        x, y = point[k, 0], point[k, 1]
        jet_at(land, x, y, room, at)
        hessian[k, 0, 0], hessian[k, 1, 1] = at[HXX], at[HYY]
        hessian[k, 0, 1] = hessian[k, 1, 0] = at[HXY]
        height = abs(point[k, 2] - at[0])
        ahead = plane[5] - at[GX] * plane[3] - at[GY] * plane[4]
        up = plane[8] - at[GX] * plane[6] - at[GY] * plane[7]
        if corner[k]:
            curvature[k], residual[k] = -np.inf, height
            for i in range(3):
                normal[k, i] = cosine * plane[6 + i] - sine * plane[3 + i]
        else:
            tx, ty = cosine * plane[3] + sine * plane[6], cosine * plane[4] + sine * plane[7]
            bend = tx * (at[HXX] * tx + at[HXY] * ty) + ty * (at[HXY] * tx + at[HYY] * ty)
            curvature[k] = -bend / (sine * ahead - cosine * up)
            residual[k] = max(height, radius[k] * abs(cosine * ahead + sine * up))
            size = math.sqrt(at[GX] ** 2 + at[GY] ** 2 + 1.0)
            normal[k, 0], normal[k, 1], normal[k, 2] = -at[GX] / size, -at[GY] / size, 1.0 / size
        if outcome[k] == TOUCHES:
            if not (land.box[0, 0] <= x <= land.box[1, 0] and land.box[0, 1] <= y <= land.box[1, 1]):
                outcome[k] = OFF_THE_MAP
            elif not residual[k] <= tolerance * (1.0 + farthest(plane)):
                outcome[k] = UNPROVED
