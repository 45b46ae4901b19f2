"""Tests that hold for every motion: solved, rates, limits, rigid links, the body against itself and the ground."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.check.claims import allowance
from bodyplan.check.report import Line
from bodyplan.errors import Status
from bodyplan.ground import HeightMap, Profile, Surface
from bodyplan.motion import Motion
from bodyplan.robot.elements import Row
from bodyplan.robot.neighbours import separate_contacts

#: share of a joint's samples whose rate, or acceleration, may disagree with what is around them
RATE_SLACK, ACCELERATION_SLACK = 0.15, 0.25
#: how many times the largest difference quotient a rate may be: rates may peak between two samples
PEAK = 20.0
#: quotients run smoothly where their second differences are below this share of them; then rates may be off by FINE
SMOOTH, FINE = 0.05, 0.01
#: fewer samples than this cannot tell a wrong rate from one that changes between them
FEW = 50
#: slack of lengths and limits
EXACT = 1e-9
#: samples times pairs of shapes handled at once
CHUNK = 400_000


def solved(motion: Motion) -> Line:
    """Samples that the planner could not solve."""
    bad = np.flatnonzero(motion.status != Status.OK.value)
    detail = "" if not len(bad) else f"{motion.status[bad[0]]} at {motion.t[bad[0]]:.4g} s"
    return Line("every sample solved", float(len(bad)), 0.0, "samples", not len(bad), detail, kind="solved")


def plan_residual(motion: Motion) -> Line:
    """The planner's own equations, as it reports them."""
    value = float(motion.residual.max())
    limit = 1e-6
    return Line("residual of the plan", value, limit, "m", value <= limit, kind="residual")


def rates_agree(motion: Motion) -> list[Line]:
    """Rates against the positions, and accelerations against the rates, joint by joint.

    A derivative at a sample must lie between the difference quotients on both sides of it, give or take how much those
    change nearby and a tenth. Jumps are honest, so single samples may lie outside: the value is the share of a joint's
    moving samples that do, of the worst joint; and no derivative may be PEAK times the largest quotient. Where even
    samples run smoothly it must also agree with the five-point formula, see :func:`_off_where_smooth`.
    """
    out = []
    pairs = (("rates agree with positions", motion.q, motion.qd, RATE_SLACK, PEAK),
             ("accelerations agree with rates", motion.qd, motion.qdd, ACCELERATION_SLACK, np.inf))  # fmt: skip
    for name, values, claimed, slack, peak in pairs:
        what = f"{name}, share of samples that do not"
        quotient = np.diff(values, axis=0) / np.diff(motion.t)[:, None]
        if len(quotient) < FEW or not quotient.size:
            out.append(Line(what, None, slack, "", None, "too few samples to tell", kind="rates"))
            continue
        change = np.abs(np.diff(quotient, axis=0))
        change = np.concatenate([change[:1], change, change[-1:]])  # at every sample
        nearby = np.maximum(change, np.maximum(np.roll(change, 1, axis=0), np.roll(change, -1, axis=0)))
        before, after = np.concatenate([quotient[:1], quotient]), np.concatenate([quotient, quotient[-1:]])
        size = np.maximum(np.abs(before), np.abs(after))
        room = nearby + 0.1 * size
        off = (claimed < np.minimum(before, after) - room) | (claimed > np.maximum(before, after) + room)
        largest = float(size.max(initial=0.0))
        off |= _off_where_smooth(motion.t, quotient, claimed)
        moving = (size > 1e-3 * largest) | (np.abs(claimed) > 1e-3 * largest + EXACT)
        share = (off & moving).sum(axis=0) / np.maximum(moving.sum(axis=0), 20)
        joint = int(share.argmax())
        value, wild = float(share[joint]), float(np.abs(claimed).max()) > peak * largest + EXACT
        detail = "a rate is far beyond all others" if wild else f"worst: {motion.joints[joint]}"
        out.append(Line(what, value, slack, "", value <= slack and not wild, detail, kind="rates"))
    return out


def _off_where_smooth(t: Array, quotient: Array, claimed: Array) -> BoolArray:
    """(T, n) True where the difference quotients (T - 1, n) of even samples run smoothly around a sample and the
    derivative claimed there misses the five-point formula by more than FINE and three times what that differs from the
    three-point one."""
    off = np.zeros(claimed.shape, dtype=bool)
    if np.ptp(np.diff(t)) > 1e-6 * float(np.diff(t).mean()):
        return off
    before, after = quotient[1:-2], quotient[2:-1]
    three = 0.5 * (before + after)
    five = (7.0 * (before + after) - (quotient[:-3] + quotient[3:])) / 12.0
    size = np.maximum(np.abs(before), np.abs(after))
    bend = np.abs(np.diff(quotient, 2, axis=0))
    smooth = np.maximum(bend[:-1], bend[1:]) <= SMOOTH * size
    missed = np.abs(claimed[2:-2] - five) > FINE * size + 3.0 * np.abs(five - three)
    off[2:-2] = smooth & missed
    return off


def joint_limits(motion: Motion) -> list[Line]:
    """Distance to the nearest joint limit, and the largest share of a joint's rate limit."""
    lines = []
    limits = motion.robot.limits
    if np.isfinite(limits).any():
        room = np.minimum(motion.q - limits[:, 0], limits[:, 1] - motion.q)
        at = np.unravel_index(int(room.argmin()), room.shape)
        value = float(room[at])
        lines.append(
            Line(
                "joint limits",
                value,
                0.0,
                "rad",
                value >= -EXACT,
                f"closest: {motion.joints[at[1]]} at {motion.t[at[0]]:.4g} s",
                at_least=True,
                kind="limits",
            )
        )
    rates = motion.robot.rates
    if np.isfinite(rates).any():
        moved = np.abs(np.diff(motion.q, axis=0)) / np.diff(motion.t)[:, None]
        share = np.maximum(np.abs(motion.qd), np.concatenate([moved, moved[-1:]])) / rates
        at = np.unravel_index(int(share.argmax()), share.shape)
        value = float(share[at])
        lines.append(
            Line(
                "joint rates, share of the limit",
                value,
                1.0,
                "",
                value <= 1.0 + EXACT,
                f"fastest: {motion.joints[at[1]]} at {motion.t[at[0]]:.4g} s",
                kind="limits",
            )
        )
    return lines


def link_lengths(motion: Motion, positions: Array) -> Line | None:
    """Rows of constant length must keep it: distances between consecutive frames in forward kinematics."""
    worst, count = 0.0, 0
    for chain in motion.robot.chains:
        before = motion.robot.frame_index(chain.parent)
        for i, element in enumerate(chain.elements):
            here = motion.robot.frame_index(chain.frame_name(i))
            if isinstance(element, Row) and isinstance(element.a, float) and isinstance(element.d, float):
                length = float(np.hypot(element.a, element.d))
                made = np.linalg.norm(positions[:, here] - positions[:, before], axis=-1)
                worst, count = max(worst, float(np.abs(made - length).max())), count + 1
            before = here
    if not count:
        return None
    return Line("link lengths kept", worst, EXACT, "m", worst <= EXACT, f"{count} links", kind="lengths")


def _skeletons(motion: Motion) -> tuple[Array, Array, list[int]]:
    """End points (T, c, 2, 3) of every capsule and sphere, radii (c,), and their indices among the contacts."""
    poses = motion.robot.forward(motion.q, motion.base)
    ends, radii, which = [], [], []
    for k, contact in enumerate(motion.robot.contacts):
        if contact.shape not in ("capsule", "sphere"):
            continue
        i = motion.robot.frame_index(contact.frame)
        last = contact.end if contact.shape == "capsule" else contact.start
        local = np.array([contact.start, last])
        ends.append(np.einsum("tij,pj->tpi", poses.rotations[:, i], local) + poses.positions[:, None, i])
        radii.append(contact.radius)
        which.append(k)
    size = len(motion.t)
    return (np.stack(ends, axis=1) if ends else np.zeros((size, 0, 2, 3))), np.array(radii), which


def segment_distance(p: Array, q: Array) -> Array:
    """Smallest distance (...,) between segments p and q (..., 2, 3), exact also where they cross or degenerate."""
    d1, d2, r = p[..., 1, :] - p[..., 0, :], q[..., 1, :] - q[..., 0, :], p[..., 0, :] - q[..., 0, :]
    a, e, b = (d1 * d1).sum(-1), (d2 * d2).sum(-1), (d1 * d2).sum(-1)
    c, f = (d1 * r).sum(-1), (d2 * r).sum(-1)
    # the closest pair of two segments is at their crossing (if any) or has an end point in it
    det = a * e - b * b
    crossing = det > 1e-14 * np.maximum(a * e, 1e-300)
    safe = np.where(crossing, det, 1.0)
    s, u = (b * f - c * e) / safe, (a * f - b * c) / safe
    inside = crossing & (s >= 0) & (s <= 1) & (u >= 0) & (u <= 1)
    gap = r + s[..., None] * d1 - u[..., None] * d2
    best = np.where(inside, (gap * gap).sum(-1), np.inf)
    for point, seg in ((p[..., 0, :], q), (p[..., 1, :], q), (q[..., 0, :], p), (q[..., 1, :], p)):
        along = seg[..., 1, :] - seg[..., 0, :]
        square = (along * along).sum(-1)
        x = ((point - seg[..., 0, :]) * along).sum(-1) / np.where(square > 0, square, 1.0)
        off = point - seg[..., 0, :] - np.clip(x, 0.0, 1.0)[..., None] * along
        best = np.minimum(best, (off * off).sum(-1))
    return np.asarray(np.sqrt(best))


def self_clearance(motion: Motion) -> Line | None:
    """Smallest gap between two capsules or spheres that are no neighbours (``robot/neighbours.py``)."""
    ends, radii, which = _skeletons(motion)
    apart = _separate_pairs(motion, which)
    if not len(apart):
        return None
    best, when, pair = np.inf, 0, apart[0]
    step = max(1, CHUNK // len(apart))
    first, second = apart[:, 0], apart[:, 1]
    for k in range(0, len(motion.t), step):
        gap = segment_distance(ends[k : k + step, first], ends[k : k + step, second]) - radii[first] - radii[second]
        at = np.unravel_index(int(gap.argmin()), gap.shape)
        if gap[at] < best:
            best, when, pair = float(gap[at]), k + int(at[0]), apart[at[1]]
    names = [motion.robot.contacts[which[i]].name for i in pair]
    return Line(
        "links clear of each other",
        best,
        0.0,
        "m",
        best >= -EXACT,
        f"closest: {names[0]} and {names[1]} at {motion.t[when]:.4g} s",
        at_least=True,
        kind="self",
    )


def _separate_pairs(motion: Motion, which: list[int]) -> IntArray:
    """Pairs of capsules and spheres that are no neighbours."""
    place = {contact: i for i, contact in enumerate(which)}
    pairs = [(place[a], place[b]) for a, b in separate_contacts(motion.robot) if a in place and b in place]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def ground_clearance(motion: Motion) -> list[Line]:
    """Gap between the capsules and spheres and the floor, and all ground; walls may be pressed as claimed.

    At five points along each capsule, and along the whole of it where the ground is a profile."""
    ends, radii, which = _skeletons(motion)
    if not len(which):
        return []
    mix = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None]
    points = ends[:, :, None, 0] * (1.0 - mix) + ends[:, :, None, 1] * mix
    surface = radii[None, :, None]
    normal_z = motion.ground.normal(points[..., 0], points[..., 1])[..., 2]
    above = (points[..., 2] - motion.ground.height(points[..., 0], points[..., 1])) * normal_z - surface
    gap = motion.ground.clearance(points) - surface
    floor = above
    if isinstance(motion.ground, Profile):  # a corner of a step may reach through a link between two of the points
        floor = motion.ground.floor_alone().segment_clearance(ends) - radii
        gap = motion.ground.segment_clearance(ends) - radii
    elif isinstance(motion.ground, (Surface, HeightMap)):  # curved: the tangent plane below a point is not the ground
        floor = gap
    lines = [_worst_gap(motion, which, floor, "clear of the floor", EXACT)]
    lies = allowance(motion, "on_floor")
    if lies is not None:
        lines.append(_lies(motion, which, above, float(lies["tolerance"])))
    presses = allowance(motion, "presses", {})
    depth = float(presses.get("depth", 0.0))
    if depth > 0.0:
        line = _worst_gap(motion, which, gap, f"presses on the {presses['role']} no deeper than planned", depth + EXACT)
        deepest = float(radii.min())
        shallow = depth < deepest
        lines.append(
            Line(
                line.what,
                line.value,
                -depth,
                "m",
                bool(line.passed and shallow),
                line.detail if shallow else f"deeper than the radius of the body, {deepest:.3g} m",
                at_least=True,
                kind="presses",
            )
        )
    elif np.any(np.abs(gap - floor) > EXACT):
        lines.append(_worst_gap(motion, which, gap, "clear of walls and ceiling", EXACT))
    return lines


def _lies(motion: Motion, which: list[int], above: Array, tolerance: float) -> Line:
    off = np.abs(above)
    at = np.unravel_index(int(off.argmax()), off.shape)
    value = float(off[at])
    detail = f"farthest: {motion.robot.contacts[which[int(at[1])]].name} at {motion.t[at[0]]:.4g} s"
    return Line("lies on the floor", value, tolerance, "m", value <= tolerance, detail, kind="on_floor")


def _worst_gap(motion: Motion, which: list[int], gap: Array, what: str, allowed: float) -> Line:
    at = np.unravel_index(int(gap.argmin()), gap.shape)
    value = float(gap[at])
    name = motion.robot.contacts[which[int(at[1])]].name
    return Line(
        what,
        value,
        0.0,
        "m",
        value >= -allowed,
        f"closest: {name} at {motion.t[at[0]]:.4g} s",
        at_least=True,
        kind="ground",
    )
