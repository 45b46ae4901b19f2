"""Tests that hold for every motion: solved, rates, limits, rigid links, the body against the ground."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.check.claims import allowance
from bodyplan.check.report import Line
from bodyplan.check.shapes import box_gaps, skeletons
from bodyplan.errors import Status
from bodyplan.ground import Profile
from bodyplan.ground.base import Ground
from bodyplan.ground.field import Field
from bodyplan.ground.near import clearance_up_to
from bodyplan.motion import Motion
from bodyplan.robot.elements import Row

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


def ground_clearance(motion: Motion) -> list[Line]:
    """Gap between the shapes of the body and the floor, and all ground; walls may be pressed as claimed.

    At five points along each capsule, and along the whole of it where the ground is a profile; of boxes as in
    :func:`bodyplan.check.shapes.box_gaps`. Those that a claim "clears" is about are tested with it."""
    contacts, ground = motion.robot.contacts, motion.ground
    claimed = _cleared(motion)
    ends, radii, which = skeletons(motion)
    kept = [i for i, k in enumerate(which) if contacts[k].name not in claimed]
    ends, radii, which = ends[:, kept], radii[kept], [which[i] for i in kept]
    boxes = [k for k, contact in enumerate(contacts) if contact.shape == "box" and contact.name not in claimed]
    if not which and not boxes:
        return []
    mix = np.array([0.0, 0.25, 0.5, 0.75, 1.0])[:, None]
    if all(contacts[k].shape == "sphere" for k in which):
        mix = mix[:1]
    points = ends[:, :, None, 0] * (1.0 - mix) + ends[:, :, None, 1] * mix
    surface = radii[None, :, None]
    normal_z = ground.normal(points[..., 0], points[..., 1])[..., 2]
    above = (points[..., 2] - ground.height(points[..., 0], points[..., 1])) * normal_z - surface
    floor = gap = above.min(axis=-1)
    if isinstance(ground, Profile):  # a corner of a step may reach through a link between two of the points
        floor = ground.floor_alone().segment_clearance(ends) - radii
        gap = ground.segment_clearance(ends) - radii
    elif isinstance(ground, Field):  # curved: the tangent plane below a point is not the ground
        floor = gap = _nearest(ground, points, surface)
    elif which:
        gap = (ground.clearance(points) - surface).min(axis=-1)
    if boxes:
        alone = ground.floor_alone() if isinstance(ground, Profile) else ground
        floor, gap = (
            np.concatenate([found, _boxes(motion, boxes, under)], axis=1)
            for found, under in ((floor, alone), (gap, ground))
        )
    every = [*which, *boxes]
    lines = [_worst_gap(motion, every, floor, "clear of the floor", EXACT)]
    lies = allowance(motion, "on_floor")
    if lies is not None and which:
        lines.append(_lies(motion, which, above, float(lies["tolerance"])))
    presses = allowance(motion, "presses", {})
    depth = float(presses.get("depth", 0.0))
    if depth > 0.0 and which:
        line = _worst_gap(motion, every, gap, f"presses on the {presses['role']} no deeper than planned", depth + EXACT)
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
        lines.append(_worst_gap(motion, every, gap, "clear of walls and ceiling", EXACT))
    return lines


def _cleared(motion: Motion) -> set[str]:
    """Names of the shapes that a claim wants to be clear of the ground at all samples."""
    claims = [claim.data for claim in motion.claims if claim.kind == "clears"]
    whole = [data for data in claims if data.get("samples") is None and float(data["required"]) >= 0.0]
    return {str(name) for data in whole for name in data["contacts"]}


def _nearest(ground: Field, points: Array, radii: Array) -> Array:
    """Gaps (T, c) m of balls around ``points`` (T, c, p, 3): those that are no smaller than that of the ball least high
    above the ground are not told apart from it."""
    if not points.size:
        return np.zeros(points.shape[:2])
    over = points[..., 2] - ground.height(points) - radii
    at = np.unravel_index(int(over.argmin()), over.shape)
    most = float(ground.clearance(points[at])) - np.broadcast_to(radii, over.shape)[at]
    return np.asarray((clearance_up_to(ground, points, most + radii + EXACT) - radii).min(axis=-1))


def _boxes(motion: Motion, which: list[int], ground: Ground) -> Array:
    """Gaps (T, k) m of boxes, indices ``which`` among the contacts, to a ground."""
    robot, poses = motion.robot, motion.robot.forward(motion.q, motion.base)
    return np.stack([box_gaps(ground, robot, robot.contacts[k], poses) for k in which], axis=1)


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
