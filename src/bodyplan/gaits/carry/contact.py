"""Where wheels touch the ground: the certified globally nearest contact of every wheel at every pose, in one batch."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry import newton, search, steps
from bodyplan.gaits.carry.planes import Planes, Section, section
from bodyplan.gaits.carry.terrain import Steps, Terrain
from bodyplan.ground.field import Field
from bodyplan.threads import shared

if TYPE_CHECKING:
    from bodyplan.gaits.carry.section_kernel import Room
    from bodyplan.ground.field_kernel import FieldArrays

#: outcomes, as in :mod:`bodyplan.gaits.carry.contact_kernel`
TOUCHES, LIES_FLAT, NO_GROUND, AXLE_BELOW, UNPROVED, OFF_THE_MAP = range(6)
#: relative difference up to which Newton's contact is the one that the search found
SAME = 1e-10
#: largest residual of a contact with a tangent, m
RESIDUAL = 1e-11
#: wheels looked at in one go
CHUNK = 8192
#: wheels on a height map from which on threads share the kernels' work
THREADED = 320


@dataclass(frozen=True)
class Contacts:
    """Contacts of n wheels; where ``outcome`` (n,) is not TOUCHES the other values mean nothing.

    ``phi`` (n,) rad contact angles, ``radius`` (n,) m, ``point`` (n, 3) m, ``normal`` (n, 3) of the ground,
    ``curvature`` (n,) 1/m of its section by the wheel's plane, positive in a valley. ``residual`` (n,): the larger one
    of eqs. (12) in m and (14), times the radius. ``second`` (n,) rad: contact angle of another contact as near, nan
    where there is none. ``corner`` (n,): the wheel stands on an edge of the ground; then ``normal`` points to the
    wheel's centre, (14) says nothing and ``curvature`` is minus infinity. ``hessian`` (n, 2, 2) 1/m of the ground at
    the contact.
    """

    phi: Array
    radius: Array
    point: Array
    normal: Array
    curvature: Array
    residual: Array
    second: Array
    corner: BoolArray
    hessian: Array
    outcome: IntArray

    @property
    def slack(self) -> Array:
        """1 - kappa R (n,): 0 where the ground is as curved as the rim and the contact angle may jump."""
        return np.asarray(1.0 - self.curvature * self.radius)


def find(ground: Terrain, planes: Planes, start: Array | None = None) -> Contacts:
    """The contacts of all wheels; ``start`` (n,) rad: contact angles to start from, for example those of a moment
    before. They save steps and decide nothing: every contact is proved to be the nearest one."""
    parts: dict[int, Contacts] = {}

    def part(first: int, last: int) -> int:
        for k in range(first, max(last, first + 1), CHUNK):
            index = np.arange(k, min(k + CHUNK, last))
            parts[k] = _find(ground, planes.take(index), None if start is None else start[index])
        return 0

    shared(part, len(planes), threaded_from=THREADED if isinstance(ground, Field) else 2 * CHUNK)
    found = [parts[k] for k in sorted(parts)]
    return Contacts(*(np.concatenate([getattr(one, f.name) for one in found]) for f in fields(Contacts)))


def follow(ground: Field, planes: Planes, phi: Array, radius: Array) -> Contacts:
    """The contacts that Newton's method comes to from angles ``phi`` and radii ``radius`` (n,): the nearest ones or
    not. UNPROVED where it comes to none."""
    from bodyplan.gaits.carry import contact_kernel
    from bodyplan.gaits.carry.section_kernel import Room

    land, rows = ground.field_arrays, planes.rows
    room = Room.of(land, 1)
    chi, away = phi + planes.lean, np.array(radius)
    outcome = np.empty(len(planes), dtype=np.int64)
    contact_kernel.follow(land, rows, room, chi, away, outcome)
    none = np.full(len(planes), np.nan)
    return _measured_in_kernel(
        land, rows, planes.lean, chi, away, none, np.zeros(len(planes), dtype=np.bool_), room, outcome
    )


def _find(ground: Terrain, planes: Planes, start: Array | None) -> Contacts:
    if isinstance(ground, Steps):
        return _on_steps(ground, planes)
    if isinstance(ground, Field):
        return _in_kernels(ground, planes, start)
    return _at_once(ground, planes, start)


def _at_once(ground: Terrain, planes: Planes, start: Array | None) -> Contacts:
    """Of all wheels by arrays, on any smooth ground."""
    foot = section(ground, planes, np.zeros(len(planes)))
    outcome = np.full(len(planes), TOUCHES)
    outcome[foot.w >= 0.0] = AXLE_BELOW
    outcome[~foot.found] = NO_GROUND
    outcome[planes.flat] = LIES_FLAT
    chi, radius = _guess(foot, planes, start)
    second, corner = np.full(len(planes), np.nan), np.zeros(len(planes), dtype=np.bool_)
    good = np.flatnonzero(outcome == TOUCHES)
    some = planes if len(good) == len(planes) else planes.take(good)
    chi[good], radius[good], settled = newton.solve(ground, some, chi[good], radius[good])
    settled &= radius[good] <= np.abs(foot.w[good]) * (1.0 + SAME)
    sure = settled & search.certain(ground, some, _part(foot, good), radius[good])
    unsure = good[~sure]
    if len(unsure):
        _search(ground, planes, unsure, settled[~sure], chi, radius, second, corner, outcome)
    return _measured(ground, planes, chi, radius, second, corner, outcome)


def _on_steps(ground: Steps, planes: Planes) -> Contacts:
    """Contacts with a floor in steps."""
    outcome = np.full(len(planes), TOUCHES)
    outcome[ground.field_jet(planes.centre[:, 0], planes.centre[:, 1])[0] >= planes.centre[:, 2]] = AXLE_BELOW
    outcome[planes.flat] = LIES_FLAT
    found = steps.nearest(ground, planes)
    radius = np.hypot(found.s, found.w)
    second = np.arctan2(found.other_s, -found.other_w) - planes.lean
    point = planes.points(found.s, found.w)
    with np.errstate(all="ignore"):
        u = (point - planes.centre) / radius[:, None]
        normal = np.where(found.edge[:, None], -u, found.normal)
        # eq. (14): no part of the normal along the rim
        off = np.abs(np.sum(normal * np.cross(u, np.cross(planes.ahead, planes.up)), axis=1))
    level = np.abs(point[:, 2] - ground.field_jet(point[:, 0], point[:, 1])[0])
    away = np.abs(point[:, :1] - ground.xs).min(axis=1, initial=np.inf)
    residual = np.maximum(np.minimum(level, away), np.where(found.edge, 0.0, radius * off))
    curvature = np.where(found.edge, -np.inf, 0.0)
    none = np.zeros((len(planes), 2, 2))
    phi = np.arctan2(found.s, -found.w) - planes.lean
    return Contacts(phi, radius, point, normal, curvature, residual, second, found.edge, none, outcome)


def _in_kernels(ground: Field, planes: Planes, start: Array | None) -> Contacts:
    """The same on a height map or a formula, wheel by wheel."""
    from bodyplan.gaits.carry import contact_kernel
    from bodyplan.gaits.carry.section_kernel import COLUMNS, Room

    count, land = len(planes), ground.field_arrays
    room = Room.of(land, search.MOST_CELLS)
    rows, limits = planes.rows, search.limits()
    first = np.full(count, np.nan) if start is None else np.ascontiguousarray(start, dtype=np.float64)
    feet, chi, radius = np.empty((count, COLUMNS)), np.empty(count), np.empty(count)
    settled, outcome = np.empty(count, dtype=np.bool_), np.empty(count, dtype=np.int64)
    contact_kernel.settle(land, rows, planes.lean, planes.flat, first, SAME, room, feet, chi, radius, settled, outcome)
    some = np.flatnonzero(settled)
    sure = np.zeros(count, dtype=np.bool_)
    sure[some] = search.certain_in_region(ground, planes.take(some), radius[some])
    second, corner = np.full(count, np.nan), np.zeros(count, dtype=np.bool_)
    edged = bool(ground.field_creases())
    contact_kernel.prove(
        land, rows, planes.lean, feet, sure, settled, edged, SAME, search.CERTAIN, limits, room,
        chi, radius, second, corner, outcome,
    )  # fmt: skip
    return _measured_in_kernel(land, rows, planes.lean, chi, radius, second, corner, room, outcome)


def _measured_in_kernel(
    land: FieldArrays,
    rows: Array,
    lean: Array,
    chi: Array,
    radius: Array,
    second: Array,
    corner: BoolArray,
    room: Room,
    outcome: IntArray,
) -> Contacts:
    """Everything about the contacts at ``chi``, ``radius``, of planes ``rows`` (n, 9) that ``lean`` (n,), as
    :func:`_measured`."""
    from bodyplan.gaits.carry import contact_kernel

    count = len(rows)
    phi, curvature, residual = np.empty(count), np.empty(count), np.empty(count)
    point, normal, hessian = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 2, 2))
    contact_kernel.measure(
        land, rows, lean, chi, radius, corner, RESIDUAL, room,
        phi, point, normal, curvature, residual, hessian, outcome,
    )  # fmt: skip
    return Contacts(phi, radius, point, normal, curvature, residual, second, corner, hessian, outcome)


def _guess(foot: Section, planes: Planes, start: Array | None) -> tuple[Array, Array]:
    """Where the tangent of the section below the centre is nearest; or where the ground is in a given direction."""
    with np.errstate(all="ignore"):
        chi = np.arctan(foot.first) if start is None else start + planes.lean
        # distance of that tangent in the direction chi
        radius = -foot.w / (np.cos(chi) + foot.first * np.sin(chi))
        wrong = ~(np.isfinite(radius) & (radius > 0.0) & (radius < -10.0 * foot.w))
        chi = np.where(wrong, np.arctan(foot.first), chi)
        radius = np.where(wrong, np.abs(foot.w) * np.cos(np.arctan(foot.first)), radius)
    return chi, radius


def _search(
    ground: Terrain,
    planes: Planes,
    unsure: IntArray,
    settled: BoolArray,
    chi: Array,
    radius: Array,
    second: Array,
    corner: BoolArray,
    outcome: IntArray,
) -> None:
    """Contacts that one look does not prove, into the arrays of all."""
    some = planes.take(unsure)
    guess = np.where(settled, radius[unsure] * np.sin(chi[unsure]), 0.0)
    found = search.nearest(ground, some, guess)
    at = section(ground, some, found.s)
    angle = np.arctan2(found.s, -at.w)
    fine_chi, fine_radius, fine = newton.solve(ground, some, angle, found.distance)
    # Newton improves a contact with a tangent; on an edge it goes elsewhere
    fine &= np.abs(fine_radius - found.distance) <= SAME * found.distance
    fine &= np.abs(fine_radius * np.sin(fine_chi) - found.s) <= search.APART * found.distance
    chi[unsure], radius[unsure] = np.where(fine, fine_chi, angle), np.where(fine, fine_radius, found.distance)
    # only ground with edges has contacts without a tangent
    edged = bool(ground.field_creases())
    corner[unsure] = ~fine & edged
    other = section(ground, some, np.where(np.isnan(found.second), 0.0, found.second))
    second[unsure] = np.where(np.isnan(found.second), np.nan, np.arctan2(found.second, -other.w) - some.lean)
    outcome[unsure[~(found.certified & (fine | edged))]] = UNPROVED


def _measured(
    ground: Terrain, planes: Planes, chi: Array, radius: Array, second: Array, corner: BoolArray, outcome: IntArray
) -> Contacts:
    """Everything about the contacts at ``chi``, ``radius``."""
    sine, cosine = np.sin(chi)[:, None], np.cos(chi)[:, None]
    u, t = sine * planes.ahead - cosine * planes.up, cosine * planes.ahead + sine * planes.up
    point = planes.centre + radius[:, None] * u
    with np.errstate(all="ignore"):
        f, g, hessian = ground.field_jet(point[:, 0], point[:, 1])
        upward = np.concatenate([-g, np.ones((len(g), 1))], axis=1)
        along = np.sum(upward * u, axis=1)
        curvature = -np.einsum("ni,nij,nj->n", t[:, :2], hessian, t[:, :2]) / along
        height = np.abs(point[:, 2] - f)
        residual = np.maximum(height, radius * np.abs(np.sum(upward * t, axis=1)))
        normal = upward / np.linalg.norm(upward, axis=1, keepdims=True)
    normal = np.where(corner[:, None], -u, normal)
    curvature = np.where(corner, -np.inf, curvature)
    residual = np.where(corner, height, residual)
    low, high = ground.field_box
    inside = np.all((point[:, :2] >= low) & (point[:, :2] <= high), axis=1)
    outcome = np.where((outcome == TOUCHES) & ~inside, OFF_THE_MAP, outcome)
    wrong = ~(residual <= RESIDUAL * (1.0 + np.abs(planes.centre).max(axis=1, initial=0.0)))
    outcome = np.where((outcome == TOUCHES) & wrong, UNPROVED, outcome)
    return Contacts(chi - planes.lean, radius, point, normal, curvature, residual, second, corner, hessian, outcome)


def _part(at: Section, index: IntArray) -> Section:
    return Section(*(getattr(at, f.name)[index] for f in fields(Section)))
