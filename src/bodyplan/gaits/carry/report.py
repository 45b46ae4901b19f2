"""What a planned carry claims, its numbers, and what its reader should know."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.gaits.carry import hull
from bodyplan.gaits.carry.carriage import Carriage
from bodyplan.gaits.carry.loads import paper_torque
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.motion import Claim
from bodyplan.robot.masses import center_of_mass
from bodyplan.spatial.hulls import edge_distances

if TYPE_CHECKING:
    from bodyplan.gaits.carry.gait import Carry
    from bodyplan.gaits.carry.motion import Rolled

#: m between a rim and the ground that the judge may find
TOUCH = 1e-6
#: share of the speed that a rim may slip ahead between two samples, as the judge sees it
ROLLS = 0.02
#: rad: two axles that differ by less are parallel
PARALLEL = 1e-6
#: rad/s of turning and m/s of scrubbing that are worth a remark
TURNING, SCRUBBING = 1e-3, 1e-3
#: rad: a contact angle that changes by more than its rates say, from sample to sample, has leapt
LEAP = 0.05
#: samples whose hull is measured at once
_TOGETHER = 16


def claims(wheels: Wheels, ok: BoolArray) -> Iterator[Claim]:
    """What the judge is to test, at the samples that were solved."""
    if not ok.any():
        return
    names = [wheels.robot.contacts[wheel.rim].name for wheel in wheels]
    some = {} if ok.all() else {"samples": np.flatnonzero(ok).astype(np.float64)}
    yield Claim(
        "rim_touches", "rims touch the ground and are nowhere below it", {"contacts": names, "tolerance": TOUCH, **some}
    )
    if len(ok) > 2 and ok.all():
        yield Claim("rolls", "wheels roll ahead without slip", {"contacts": names, "tolerance": ROLLS})
    boxes = [box.name for box in hull.boxes(wheels.robot)]
    if boxes:
        yield Claim("clears", "the hull is clear of the ground", {"contacts": boxes, "required": 0.0, **some})


def facts(
    gait: Carry, wheels: Wheels, land: Terrain, body: Carriage, rolled: Rolled, ok: BoolArray, t: Array
) -> dict[str, float]:
    """Numbers of the plan, SI; of the samples that were solved."""
    robot = wheels.robot
    speed = np.linalg.norm(body.course.velocity, axis=1)
    way = float(np.sum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t)))
    out = {"speed": way / float(t[-1] - t[0]), "distance": way, "solved_samples": float(ok.sum())}
    if not ok.any():
        return out
    adjusted = [(k, wheel) for k, wheel in enumerate(wheels) if wheel.adjust is not None]
    angles = {wheel.name: rolled.q[ok, wheel.adjust] for _, wheel in adjusted}
    for name, q in angles.items():
        out[f"{name}_smallest_angle"], out[f"{name}_largest_angle"] = float(q.min()), float(q.max())
    if angles:
        out["smallest_adjust_angle"] = min(float(q.min()) for q in angles.values())
        out["largest_adjust_angle"] = max(float(q.max()) for q in angles.values())
        out["peak_adjust_rate"] = max(float(np.abs(rolled.qd[ok, wheel.adjust]).max()) for _, wheel in adjusted)
        estimates = {wheel.name: np.abs(paper_torque(robot.mass, wheel, angles[wheel.name], len(wheels)))
                     for _, wheel in adjusted}  # fmt: skip
        out |= {f"{name}_paper_torque": float(torque.max()) for name, torque in estimates.items()}
        out["smallest_paper_torque"] = min(float(torque.min()) for torque in estimates.values())
        out["largest_paper_torque"] = max(float(torque.max()) for torque in estimates.values())
        radii = [rolled.wheels[k].radius[ok] for k, _ in adjusted]
        out["smallest_radius"], out["largest_radius"] = min(r.min() for r in radii), max(r.max() for r in radii)
        out["reach_margin"] = min(
            float(np.minimum(r - wheel.range[0], wheel.range[1] - r).min())
            for r, (_, wheel) in zip(radii, adjusted, strict=True)
        )
    slip = np.abs(np.array([rolled.of(rolled.rates.slip, k)[ok] for k in range(len(wheels))]))
    out["peak_slip_speed"] = float(slip.max())
    if out["speed"] > 0.0:
        out["peak_slip_share"] = out["peak_slip_speed"] / out["speed"]
    spins = np.abs(np.array([rolled.qd[ok, wheel.spin] for wheel in wheels]))
    out["smallest_spin_rate"], out["peak_spin_rate"] = float(spins.min()), float(spins.max())
    out["smallest_contact_slack"] = min(float(one.slack[ok].min()) for one in rolled.wheels)
    lowest, highest = float(body.position[ok, 2].min()), float(body.position[ok, 2].max())
    out["smallest_body_height"], out["largest_body_height"] = lowest, highest
    clearance = _clearance(wheels, land, body, ok)
    if clearance is not None:
        out["hull_clearance"] = clearance
    if len(wheels) > 2:
        centre = center_of_mass(robot, np.nan_to_num(rolled.q[ok]), body.base[ok])[:, :2]
        feet = np.stack([one.point[ok, :2] for one in rolled.wheels], axis=1)
        out["support_margin"] = float(edge_distances(feet, centre).min())
    return out


def _clearance(wheels: Wheels, land: Terrain, body: Carriage, ok: BoolArray) -> float | None:
    """Smallest height (m) of points of the hull's lower faces over the ground; None where there is none. Samples at
    which bounds of the ground say that no point is as low as one that is known are left out."""
    least, rows, edges = np.inf, np.flatnonzero(ok), land.field_box
    for box in hull.boxes(wheels.robot):
        local, turn = hull.lower_face(box), body.turn.matrix[rows]
        centre = body.position[rows] + turn @ (np.array(box.start) - [0.0, 0.0, box.half[2]])
        size = np.abs(turn[:, :, :2]) @ np.array(box.half[:2])
        low, high = centre - size, centre + size
        with np.errstate(invalid="ignore"):
            bound = low[:, 2] - land.field_bounds(low[:, :2], high[:, :2]).z[1]
        # nothing bounds the ground beyond its edges
        inside = np.all((low[:, :2] >= edges[0]) & (high[:, :2] <= edges[1]), axis=1)
        bound = np.where(inside & ~np.isnan(bound), bound, -np.inf)
        order = np.argsort(bound, kind="stable")
        for some in np.array_split(order, max(1, len(order) // _TOGETHER)):
            if len(some) and bound[some[0]] > least:
                break
            at = (body.position[rows[some], None] + local @ np.swapaxes(turn[some], 1, 2)).reshape(-1, 3)
            gap = at[:, 2] - land.field_height(at[:, 0], at[:, 1])
            least = float(np.fmin.reduce(gap, initial=least))
    return least if np.isfinite(least) else None


def notes(
    gait: Carry, wheels: Wheels, body: Carriage, rolled: Rolled, ok: BoolArray, t: Array, reasons: Sequence[str]
) -> Iterator[str]:
    """Remarks for the reader."""
    yield from reasons
    yield (
        "Each wheel touches the ground that is proved to be nearest to its axle in its plane; eqs. (12) and (14) alone "
        "hold at any stationary point, mirror images included."
    )
    yield {
        "absolute": "The height is absolute, as in the paper's missions; eq. (6) would lay it along a normal.",
        "vertical": "The height is that above the ground straight below.",
        "normal": "The height is along the ground's normal (-f_x, -f_y, 1), eq. (6); (3) as printed is not it.",
    }[gait.height_mode]
    yield from _scrubbing(wheels, body, rolled, ok)
    for k, one in enumerate(rolled.wheels):
        twice = np.flatnonzero(one.double & ok)
        if len(twice):
            yield f"Wheel {one.name!r} touches at two places at {t[twice[0]]:.4g} s ({len(twice)} samples)."
        edges = np.flatnonzero(one.corner & ok)
        if len(edges):
            yield (
                f"Wheel {one.name!r} stands on an edge of the ground at {t[edges[0]]:.4g} s ({len(edges)} samples): "
                "the normal there is taken towards its axle."
            )
        leaps = _leaps(rolled.of(rolled.found.phi, k), rolled.of(rolled.rates.angle, k), ok, t)
        if len(leaps):
            yield (
                f"The contact of wheel {one.name!r} leaps {len(leaps)} times, first near {t[leaps[0]]:.4g} s: its rim "
                "rolls from one place of the ground on to another, and what its joints do has a kink."
            )


def _scrubbing(wheels: Wheels, body: Carriage, rolled: Rolled, ok: BoolArray) -> Iterator[str]:
    """Parallel axles that are not in line cannot turn."""
    if not ok.any():
        return
    axles = wheels.axes[:, 2]
    parallel = bool(np.linalg.norm(np.cross(axles, axles[0]), axis=1).max() < PARALLEL)
    offsets = (wheels.centres - wheels.centres.mean(axis=0)) @ np.cross(axles[0], [0.0, 0.0, 1.0])
    slip = np.abs(np.array([rolled.of(rolled.rates.slip, k) for k in range(len(wheels))]))[:, ok]
    turning = float(np.abs(body.turn.spin[ok, 2]).max())
    if parallel and np.ptp(offsets) > 0.0 and turning > TURNING and slip.max() > SCRUBBING:
        k, _ = np.unravel_index(int(slip.argmax()), slip.shape)
        speed = float(np.linalg.norm(body.velocity[ok, :2], axis=1).max())
        yield (
            f"Cannot turn without scrubbing: {len(wheels)} parallel axles are not in one line, so that wheel "
            f"{rolled.wheels[int(k)].name!r} slips sideways at up to {slip.max():.3g} m/s while the body moves at "
            f"{speed:.3g} m/s. No steering commands it away; on ground of equal friction the robot turns far less than "
            "planned. A wheel that slides easily sideways, and a path that the other axle follows, mend it."
        )
    elif slip.max() > SCRUBBING:
        yield f"Wheels slip sideways at up to {slip.max():.3g} m/s: their planes do not contain the way that they go."


def _leaps(phi: Array, rate: Array, ok: BoolArray, t: Array) -> IntArray:
    """Samples after which a contact angle changes otherwise than its rates say."""
    change = np.remainder(np.diff(phi) + np.pi, 2.0 * np.pi) - np.pi
    planned = 0.5 * (rate[1:] + rate[:-1]) * np.diff(t)
    with np.errstate(invalid="ignore"):
        off = np.abs(change - planned) > LEAP + 2.0 * np.abs(planned)
    return np.asarray(np.flatnonzero(off & ok[1:] & ok[:-1]))
