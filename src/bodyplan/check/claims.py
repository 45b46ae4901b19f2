"""One short test a kind of claim. Each takes the motion, its frames' poses and one claim, and returns lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from bodyplan import curves
from bodyplan.arrays import Array
from bodyplan.check.report import Line
from bodyplan.errors import UnknownNameError
from bodyplan.motion import Claim, Motion
from bodyplan.spatial import rotations

#: slack of time comparisons, s
SAME_TIME = 1e-9


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
    moved = motion.base[second, :3] - motion.base[first, :3] - np.asarray(data["advance"])
    # the base turns by ``turn`` about the world's z
    turned = rotations.multiply(rotations.quaternion_exp([0.0, 0.0, float(data["turn"])]), motion.base[first, 3:])
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


def _untested(claim: Claim, why: str) -> Line:
    return Line(claim.label, None, None, "", None, why, kind=claim.kind)


TESTS: dict[str, Callable[[Motion, Array, Claim], Line]] = {
    "at_rest": at_rest,
    "on_curve": on_curve,
    "periodic": periodic,
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
