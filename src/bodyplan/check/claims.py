"""One short test a kind of claim. Each takes the motion, its frames' poses and one claim, and returns lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bodyplan import curves
from bodyplan.arrays import Array
from bodyplan.check.clears import clears
from bodyplan.check.report import Line
from bodyplan.check.rims import rim_touches, rolls
from bodyplan.check.statics import bears, grips_ground, holds
from bodyplan.check.support import polygon_margin
from bodyplan.errors import UnknownNameError
from bodyplan.motion import Claim, Motion
from bodyplan.robot.elements import Contact
from bodyplan.robot.masses import center_from_poses
from bodyplan.spatial import apply, rotations
from bodyplan.spatial.poses import IDENTITY

#: slack of time comparisons, s
SAME_TIME = 1e-9
#: rad between samples: a body that turns more has no velocity to be told from them
COARSE = 0.3
#: slack of a margin, m
EXACT = 1e-9
#: points so much higher than the lowest one of a shape, m, are lowest too; a rim so little inclined lies flat
FLAT = 1e-6
#: places on a curve that one claim is tested at
MOST_PLACES = 200_000


def at_rest(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest move of the claimed frames away from where they stand at the start of the interval, every cycle."""
    data = claim.data
    frames = [motion.robot.frame_index(name) for name in data["frames"]]
    every = data.get("every") or np.inf
    worst, when = 0.0, float(data["start"])
    start, end = float(data["start"]), float(data["end"])
    seen = False
    while start <= motion.t[-1]:
        inside = np.flatnonzero((motion.t >= start - SAME_TIME) & (motion.t <= end + SAME_TIME))
        if len(inside) > 1:
            seen = True
            held = positions[inside][:, frames]
            drift = np.linalg.norm(held - held[0], axis=-1).max(axis=1)
            k = int(drift.argmax())
            if drift[k] > worst:
                worst, when = float(drift[k]), float(motion.t[inside[k]])
        if not np.isfinite(every):
            break
        start, end = start + every, end + every
    limit = float(data["tolerance"])
    detail = f"{data['stage']}, {len(frames)} joints" + (f", at {when:.3g} s" if worst > 0.0 else "")
    return Line(
        claim.label,
        worst if seen else None,
        limit,
        "m",
        worst <= limit if seen else None,
        detail if seen else "no two samples fall into it",
        kind=claim.kind,
    )


def on_curve(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest distance of the claimed frames from the body curve of their sample."""
    data = claim.data
    samples = np.asarray(data["samples"]).astype(np.int64)
    frames = [motion.robot.frame_index(name) for name in data["frames"]]
    pose = np.asarray(data["pose"])
    away = positions[samples][:, frames, :2] - pose[:, None, :2]
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    x = c[:, None] * away[..., 0] + s[:, None] * away[..., 1]
    y = (-s[:, None] * away[..., 0] + c[:, None] * away[..., 1]) * float(data.get("flip", 1.0))
    unit = float(data["unit"])
    curve = curves.from_parameters(str(data["curve"]), data["parameters"])
    off = np.abs(curve.offset(x / unit, y / unit)) * unit
    worst = np.unravel_index(int(off.argmax()), off.shape)
    limit = float(data["tolerance"])
    value = float(off[worst])
    return Line(
        claim.label,
        value,
        limit,
        "m",
        value <= limit,
        f"{len(samples)} samples; worst at {motion.t[samples[worst[0]]]:.3g} s, joint {worst[1]}",
        kind=claim.kind,
    )


def periodic(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest difference of joints (rad, m) and of the base (m) between samples one period apart."""
    data = claim.data
    period = float(data["period"])
    later = motion.t + period
    inside = later <= motion.t[-1] + SAME_TIME
    if not inside.any():
        return _untested(claim, f"the motion is shorter than one cycle of {period:.4g} s")
    nearest = np.minimum(np.searchsorted(motion.t, later[inside] - SAME_TIME), len(motion.t) - 1)
    exact = np.abs(motion.t[nearest] - later[inside]) <= SAME_TIME
    if not exact.any():
        why = f"no two samples are one cycle ({period:.6g} s) apart: choose dt so that it divides the cycle"
        return _untested(claim, why)
    first, second = np.flatnonzero(inside)[exact], nearest[exact]
    joints = float(np.abs(motion.q[second] - motion.q[first]).max(initial=0.0))
    vector = np.asarray(data["turn"], dtype=np.float64)
    turn = rotations.quaternion_exp(vector if vector.ndim else vector * np.array([0.0, 0.0, 1.0]))
    moved = motion.base[second, :3] - rotations.rotate(turn, motion.base[first, :3]) - np.asarray(data["advance"])
    turned = rotations.multiply(turn, motion.base[first, 3:])
    left = rotations.quaternion_log(rotations.multiply(rotations.conjugate(turned), motion.base[second, 3:]))
    value = max(joints, float(np.abs(moved).max()), float(np.linalg.norm(left, axis=-1).max()))
    limit = float(data["tolerance"])
    return Line(
        claim.label,
        value,
        limit,
        "rad, m",
        value <= limit,
        f"{len(first)} pairs of samples one cycle of {period:.4g} s apart",
        kind=claim.kind,
    )


def follows(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest distance of the claimed frames' origins from their places on a curve in space."""
    data = claim.data
    frames = [motion.robot.frame_index(name) for name in data["frames"]]
    places, pose = np.asarray(data["places"]), np.asarray(data["pose"])
    if places.shape != (len(motion.t), len(frames)) or pose.shape not in ((7,), (len(motion.t), 7)):
        return _failed(claim, f"places {places.shape}, pose {pose.shape} do not belong to the motion's samples")
    chosen = slice(None, None, -(-places.size // MOST_PLACES))
    at = places[chosen]
    points, _ = curves.from_dict(data["curve"]).frames(at.ravel(), IDENTITY)
    planned = apply(pose if pose.ndim == 1 else pose[chosen, None], points.reshape(*at.shape, 3))
    off = np.linalg.norm(positions[chosen][:, frames] - planned, axis=-1)
    worst = np.unravel_index(int(off.argmax()), off.shape)
    value, limit = float(off[worst]), float(data["tolerance"])
    detail = f"{len(at)} samples; worst at {motion.t[chosen][worst[0]]:.3g} s, {data['frames'][worst[1]]}"
    return Line(claim.label, value, limit, "m", value <= limit, detail, kind=claim.kind)


def no_slip(motion: Motion, positions: Array, claim: Claim) -> Line:
    """How the claimed frames' origins move otherwise than along the body at the planned speed, a share of it.

    Velocities are central differences of forward kinematics, the direction of the body at a frame is the chord from the
    frame behind it to the one ahead; the value is the root mean square over frames and samples.
    """
    data = claim.data
    points = positions[:, [motion.robot.frame_index(name) for name in data["frames"]]]
    speed = np.asarray(data["speed"])
    if speed.shape != motion.t.shape or points.shape[1] < 2:
        return _failed(claim, f"needs a speed a sample and two frames, got {speed.shape} and {points.shape[1]}")
    chords = np.concatenate([points[:, 1:2] - points[:, :1], points[:, 2:] - points[:, :-2],
                             points[:, -1:] - points[:, -2:-1]], axis=1)  # fmt: skip
    sizes = np.linalg.norm(chords, axis=-1)
    if not sizes.min() > 0.0:
        return _failed(claim, "two of the frames are in one place")
    typical = float(np.sqrt(np.mean(np.square(speed))))
    ahead = chords / sizes[..., None]
    turn = np.arccos(np.clip(np.sum(ahead[1:] * ahead[:-1], axis=-1), -1.0, 1.0))
    if len(motion.t) < 3 or not typical > 0.0 or float(np.median(turn)) > COARSE:
        return _untested(claim, "too few samples: the body turns too far between two of them")
    velocity = (points[2:] - points[:-2]) / (motion.t[2:] - motion.t[:-2])[:, None, None]
    planned = speed[1:-1, None, None] * ahead[1:-1]
    slip = np.linalg.norm(velocity - planned, axis=-1)
    value, limit = float(np.sqrt(np.mean(np.square(slip)))) / typical, float(data["tolerance"])
    worst = int(np.mean(np.square(slip), axis=0).argmax())
    detail = f"root mean square, share of {typical:.3g} m/s; worst frame: {data['frames'][worst]}"
    return Line(claim.label, value, limit, "", value <= limit, detail, kind=claim.kind)


def grips(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Mean speed of the points of the robot's surface that touch the floor or a pole, a share of a given speed.

    Points: at both ends and the middle of every claimed capsule, and of spheres, where they are nearest to what they
    touch. Their velocities are central differences of forward kinematics.
    """
    data, t = claim.data, motion.t
    if len(t) < 3:
        return _untested(claim, "fewer than three samples")
    pole = data.get("pole")
    names = data.get("contacts") or [c.name for c in motion.robot.contacts]
    poses = motion.robot.forward(motion.q, motion.base)
    total, count = 0.0, 0
    for contact in motion.robot.contacts:
        if contact.name not in names or contact.shape not in ("capsule", "sphere"):
            continue
        last = contact.end if contact.shape == "capsule" else contact.start
        pose = poses[contact.frame]
        for local in np.linspace(contact.start, last, 3 if contact.shape == "capsule" else 1):
            centre = apply(pose, local)
            if pole is None:
                normal = motion.ground.normal(centre)
                gap = (centre[:, 2] - motion.ground.height(centre)) * normal[:, 2] - contact.radius
            else:
                axis = np.asarray(pole["direction"])
                away = centre - np.asarray(pole["point"])
                away = away - (away @ axis)[:, None] * axis
                distance = np.linalg.norm(away, axis=-1)
                normal, gap = away / distance[:, None], distance - contact.radius - float(pole["radius"])
            touches = np.flatnonzero(gap[1:-1] <= float(data["height"])) + 1
            # the same point of the surface a sample before and after
            here = rotations.rotate(rotations.conjugate(pose[:, 3:]), -contact.radius * normal)[touches] + local
            after, before = apply(pose[touches + 1], here), apply(pose[touches - 1], here)
            speeds = np.linalg.norm(after - before, axis=-1) / (t[touches + 1] - t[touches - 1])
            total, count = total + float(speeds.sum()), count + len(touches)
    if not count:
        return _failed(claim, f"nothing comes within {float(data['height']):.3g} m")
    value, limit = total / count / float(data["speed"]), float(data["tolerance"])
    detail = f"mean of {count} touching points, share of {float(data['speed']):.3g} m/s"
    return Line(claim.label, value, limit, "", value <= limit, detail, kind=claim.kind)


def lifted(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Smallest rise of the claimed frames over the higher of their heights at the start and the end of the interval, in
    every interval that lies inside the motion."""
    data, t = claim.data, motion.t
    height = positions[:, [motion.robot.frame_index(name) for name in data["frames"]], 2]
    start, end, every = float(data["start"]), float(data["end"]), float(data.get("every") or np.inf)
    found: tuple[float, int, float] | None = None
    count = 0
    while end <= t[-1] + SAME_TIME:
        inside = np.flatnonzero((t > start + SAME_TIME) & (t < end - SAME_TIME))
        if len(inside) and start >= t[0] - SAME_TIME:
            stood = np.array([np.interp([start, end], t, z).max() for z in height.T])
            rise = height[inside].max(axis=0) - stood
            k, count = int(rise.argmin()), count + 1
            if found is None or rise[k] < found[0]:
                found = float(rise[k]), k, start
        if not np.isfinite(every):
            break
        start, end = start + every, end + every
    if found is None:
        return _untested(claim, "no sample falls into it")
    value, k, when = found
    limit = float(data["height"]) - float(data["tolerance"])
    detail = f"{data['stage']}, {count} times; least: {data['frames'][k]} from {when:.3g} s on"
    return Line(claim.label, value, limit, "m", value >= limit, detail, at_least=True, kind=claim.kind)


def supported(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Smallest distance of the centre of mass from the edges of the support polygon or, along a claimed direction, from
    the rear and the front end of what carries the robot; negative where it tips."""
    robot, t = motion.robot, motion.t
    required = float(claim.data["required"])
    if motion.contacts is None or not robot.contacts:
        return _untested(claim, "the motion does not say which contacts carry load")
    if robot.mass <= 0.0:
        return _untested(claim, f"robot {robot.name!r} has no mass")
    start, end = (float(claim.data.get(key, limit)) for key, limit in (("start", -np.inf), ("end", np.inf)))
    inside = np.flatnonzero((t >= start - SAME_TIME) & (t <= end + SAME_TIME))
    if not len(inside):
        return _untested(claim, "no sample falls into it")
    t = t[inside]
    if "along" not in claim.data:
        margin = polygon_margin(motion, inside)
        k = int(margin.argmin())
        value = float(margin[k])
        if not np.isfinite(value):
            return _failed(claim, f"at {t[k]:.4g} s fewer than three points carry the robot")
        detail = f"{'tips' if value < 0.0 else 'least'} at {t[k]:.4g} s"
        return Line(
            claim.label, value, required, "m", value >= required - EXACT, detail, at_least=True, kind=claim.kind
        )
    along = np.asarray(claim.data["along"], dtype=np.float64)
    rear, centre, front = support_of(motion, along, inside)
    bare = np.flatnonzero(~np.isfinite(rear))
    if len(bare):
        return _failed(claim, f"at {t[bare[0]]:.4g} s nothing carries the robot ({len(bare)} samples)")
    margin = np.minimum(centre - rear, front - centre)
    k = int(margin.argmin())
    value = float(margin[k])
    ahead = front[k] - centre[k] < centre[k] - rear[k]
    detail = f"least at {t[k]:.4g} s, to the {'front' if ahead else 'rear'}"
    if value < 0.0:
        detail = f"tips {'forward' if ahead else 'backward'} at {t[k]:.4g} s"
    return Line(claim.label, value, required, "m", value >= required - EXACT, detail, at_least=True, kind=claim.kind)


def support_of(motion: Motion, along: Array, samples: Any = slice(None)) -> tuple[Array, Array, Array]:
    """Rear end of what carries the robot, its centre of mass, and the front end, each (k,) m along a horizontal unit
    vector (3,) at ``samples`` of the motion; infinite ends where nothing carries. For motions that name their contacts,
    of robots with mass."""
    robot = motion.robot
    poses = robot.forward(motion.q[samples], motion.base[samples])
    loaded = np.asarray(motion.contacts)[samples] > 0.5
    rear, front = np.full(len(loaded), np.inf), np.full(len(loaded), -np.inf)
    for contact, carries in zip(robot.contacts, loaded.T, strict=True):
        low, high = footing(contact, poses[contact.frame], along)
        rear, front = np.where(carries, np.minimum(rear, low), rear), np.where(carries, np.maximum(front, high), front)
    return rear, center_from_poses(robot, poses.array) @ along, front


def footing(contact: Contact, pose: Array, along: Array) -> tuple[Array, Array]:
    """Smallest and largest coordinate (T,) m, along a horizontal unit vector (3,), of the lowest points of a contact
    shape on a frame with poses (T, 7)."""
    if contact.shape == "rim":
        axis = rotations.rotate(pose[:, 3:], np.array([0.0, 0.0, 1.0]))
        down = axis[:, 2:] * axis - np.array([0.0, 0.0, 1.0])
        steep = np.linalg.norm(down, axis=1)
        lies = steep < FLAT  # then all of the circle is lowest
        to_lowest = contact.radius * (down @ along) / np.where(lies, 1.0, steep)
        centre, half = apply(pose, contact.start) @ along, np.where(lies, contact.radius, 0.0)
        middle = centre + np.where(lies, 0.0, to_lowest)
        return middle - half, middle + half
    places = apply(pose[:, None], contact.points())
    lowest = places[..., 2] <= places[..., 2].min(axis=1, keepdims=True) + FLAT
    coordinate = places @ along
    return np.where(lowest, coordinate, np.inf).min(axis=1), np.where(lowest, coordinate, -np.inf).max(axis=1)


def _failed(claim: Claim, why: str) -> Line:
    return Line(claim.label, None, None, "", False, why, kind=claim.kind)


def _untested(claim: Claim, why: str) -> Line:
    return Line(claim.label, None, None, "", None, why, kind=claim.kind)


TESTS: dict[str, Callable[[Motion, Array, Claim], Line]] = {
    "at_rest": at_rest,
    "on_curve": on_curve,
    "periodic": periodic,
    "follows": follows,
    "no_slip": no_slip,
    "grips": grips,
    "lifted": lifted,
    "supported": supported,
    "rim_touches": rim_touches,
    "rolls": rolls,
    "clears": clears,
    "holds": holds,
    "grips_ground": grips_ground,
    "bears": bears,
}

#: claims that a general test looks up
ALLOWANCES = ("presses", "on_floor")


def test_claim(motion: Motion, positions: Array, claim: Claim) -> Line | None:
    """The line of one claim; None for a claim that is an allowance of a general test."""
    if claim.kind in ALLOWANCES:
        return None
    if claim.kind not in TESTS:
        raise UnknownNameError("kind of claim", claim.kind, [*TESTS, *ALLOWANCES])
    return TESTS[claim.kind](motion, positions, claim)


def allowance(motion: Motion, kind: str, default: Any = None) -> Any:
    """The data of the first claim of a kind, or ``default``."""
    return next((claim.data for claim in motion.claims if claim.kind == kind), default)
