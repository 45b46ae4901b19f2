"""Tests of wheels and hulls, by dense sampling of forward kinematics against the ground's height alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from weakref import ref

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.check.report import Line
from bodyplan.errors import InputError
from bodyplan.ground import Profile
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim, Motion
from bodyplan.robot.elements import Contact
from bodyplan.robot.rims import contact_radii
from bodyplan.spatial import apply, matrix_from_quaternion, rotation_log

Test = Callable[[Motion, Array, Claim], Line]

#: points of a rim, and how many of its places that are lowest over the ground are looked at more closely, to see
#: whether it touches; and to see where it rolls
TOUCHING, ROLLING = (512, 4), (96, 1)
#: points of each closer look, and how many looks
CLOSER, LOOKS = 33, 4
#: places handled at once
CHUNK = 400_000
#: share of the samples of a wheel that must roll as claimed
MOST = 0.95
#: rad that a hub may turn between two samples, for its spin to be told from them
COARSE = 1.5


def on_the_map(test: Test) -> Test:
    """A test that fails, and says so, where points that it looks at lie beyond the edge of the ground."""

    @wraps(test)
    def tested(motion: Motion, positions: Array, claim: Claim) -> Line:
        try:
            return test(motion, positions, claim)
        except InputError as error:
            return Line(claim.label, None, None, "", False, str(error), kind=claim.kind)

    return tested


@on_the_map
def rim_touches(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest distance of a claimed rim's lowest point over the ground from it, above or below, at the claimed samples:
    the rim touches and is nowhere below the ground where that is small. 512 points of a rim, and its four lowest places
    looked at more closely."""
    samples = samples_of(motion, claim)
    if not len(samples):
        return none_left(claim)
    worst, when, which = 0.0, int(samples[0]), ""
    for name in claim.data["contacts"]:
        k, contact = contact_of(motion, str(name))
        gaps = _touching(motion, k, contact, samples)[0]
        i = int(np.abs(gaps).argmax())
        if not which or abs(gaps[i]) > abs(worst):
            worst, when, which = float(gaps[i]), int(samples[i]), contact.name
    value, limit = abs(worst), float(claim.data["tolerance"])
    where = "below the ground" if worst < 0.0 else "above it"
    detail = f"{len(samples)} samples; worst: {which} at {motion.t[when]:.4g} s, {where}"
    return Line(claim.label, value, limit, "m", value <= limit, detail, kind=claim.kind)


@on_the_map
def rolls(motion: Motion, positions: Array, claim: Claim) -> Line:
    """How fast the material of the claimed rims slips along their way where they touch, root mean square, a share of
    the speed of their hubs; velocities are central differences of forward kinematics."""
    t = motion.t
    inner = np.arange(1, len(t) - 1)
    if not len(inner):
        return none_left(claim)
    span = (t[2:] - t[:-2])[:, None]
    slips, speeds, coarse = [], [], 0.0
    poses = motion.robot.forward(motion.q, motion.base)
    radii = contact_radii(motion.robot, motion.q)
    for name in claim.data["contacts"]:
        k, contact = contact_of(motion, str(name))
        pose = poses[contact.frame]
        rotation = matrix_from_quaternion(pose[:, 3:])
        turn = np.einsum("tij,tkj->tik", rotation[2:], rotation[:-2])
        spin = rotation_log(turn) / span
        velocity = (pose[2:, :3] - pose[:-2, :3]) / span
        # how far a hub that rolls would turn from sample to sample: beyond half a turn in two nobody can tell
        coarse = max(coarse, float((np.linalg.norm(velocity, axis=1) * 0.5 * span[:, 0] / radii[1:-1, k]).max()))
        arm = _lowest(motion, k, contact, inner, *ROLLING)[1] - pose[1:-1, :3]
        growth = (radii[2:, k] - radii[:-2, k])[:, None] / span
        material = velocity + np.cross(spin, arm) + growth * arm / radii[1:-1, k, None]
        along = np.cross(rotation[1:-1, :, 2], arm)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        slips.append(np.sum(material * along, axis=1))
        speeds.append(np.linalg.norm(velocity, axis=1))
    if coarse > COARSE:
        return Line(
            claim.label, None, None, "", None, "too few samples: a hub turns too far between two", kind=claim.kind
        )
    typical = float(np.sqrt(np.mean(np.square(speeds))))
    if not typical > 0.0:
        return Line(claim.label, None, None, "", None, "nothing moves", kind=claim.kind)
    share = np.quantile(np.abs(slips), MOST, axis=1) / typical
    k, limit = int(share.argmax()), float(claim.data["tolerance"])
    value = float(share[k])
    detail = f"share of {typical:.3g} m/s, all but 5 % of the samples; worst: {claim.data['contacts'][k]}"
    return Line(claim.label, value, limit, "", value <= limit, detail, kind=claim.kind)


def _lowest(
    motion: Motion, k: int, contact: Contact, samples: IntArray, around: int, places: int
) -> tuple[Array, Array]:
    """The smallest gap (s,) m of a rim's points to the ground at ``samples``, and that point (s, 3)."""
    pose = motion.robot.forward(motion.q[samples], motion.base[samples])[contact.frame]
    radius = contact_radii(motion.robot, motion.q[samples])[:, k]
    gaps, points = np.empty(len(samples)), np.empty((len(samples), 3))
    step = max(1, CHUNK // around)
    for first in range(0, len(samples), step):
        part = slice(first, first + step)
        gaps[part], points[part] = _lowest_of(motion.ground, contact, pose[part], radius[part], around, places)
    return gaps * motion.ground.normal(points)[:, 2], points


def _lowest_of(
    ground: Ground, contact: Contact, pose: Array, radius: Array, around: int, places: int
) -> tuple[Array, Array]:
    """The least height (s,) m of rims over the ground and the points (s, 3) where it is."""

    def over(angles: Array) -> tuple[Array, Array]:
        circle = np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
        points = apply(pose[:, None], np.asarray(contact.start) + radius[:, None, None] * circle)
        return _over(ground, points), points

    width = 2.0 * np.pi / around
    angles = np.broadcast_to(np.arange(around) * width, (len(pose), around))
    gap, points = over(angles)
    dips = (gap <= np.roll(gap, 1, axis=1)) & (gap <= np.roll(gap, -1, axis=1))
    order = np.argsort(np.where(dips, gap, np.inf), axis=1)[:, :places]
    rows = np.arange(len(pose))
    best, where = gap.min(axis=1), points[rows, gap.argmin(axis=1)]
    for place in range(places):
        middle, reach = angles[rows, order[:, place]], width
        for _ in range(LOOKS):
            closer = middle[:, None] + np.linspace(-reach, reach, CLOSER)
            gap, points = over(closer)
            least = gap.argmin(axis=1)
            middle, reach = closer[rows, least], 2.0 * reach / (CLOSER - 1)
            found = gap[rows, least]
            better = found < best
            best, where = np.where(better, found, best), np.where(better[:, None], points[rows, least], where)
    return best, where


def _over(ground: Ground, points: Array) -> Array:
    """Height (...,) m of points (..., 3) over the ground; over a profile their distance from it: beside an upright face
    height says nothing."""
    if isinstance(ground, Profile):
        return ground.clearance(points)
    return np.asarray(points[..., 2] - ground.height(points))


def lowest_points(motion: Motion, k: int, contact: Contact, samples: IntArray) -> Array:
    """Where a rim is lowest over the ground (s, 3) m, at ``samples``."""
    return _touching(motion, k, contact, samples)[1]


#: what is known of the rims of motions that are still there, by id: several claims ask for the same
_known: dict[int, tuple[ref[Motion], dict[tuple[int, bytes], tuple[Array, Array]]]] = {}


def _touching(motion: Motion, k: int, contact: Contact, samples: IntArray) -> tuple[Array, Array]:
    """Gaps (s,) m and lowest points (s, 3), each looked for once a motion."""
    key, asked = id(motion), (k, samples.tobytes())
    mine = _known.get(key)
    if mine is None or mine[0]() is not motion:
        mine = _known[key] = ref(motion, lambda _: _known.pop(key, None)), {}
    if asked not in mine[1]:
        mine[1][asked] = _lowest(motion, k, contact, samples, *TOUCHING)
    return mine[1][asked]


def samples_of(motion: Motion, claim: Claim) -> IntArray:
    """The samples (s,) that a claim is about."""
    given = claim.data.get("samples")
    return np.arange(len(motion.t)) if given is None else np.asarray(given).astype(np.int64)


def contact_of(motion: Motion, name: str) -> tuple[int, Contact]:
    """The number and the shape of a contact."""
    k = [contact.name for contact in motion.robot.contacts].index(name)
    return k, motion.robot.contacts[k]


def none_left(claim: Claim) -> Line:
    """The line of a claim without samples."""
    return Line(claim.label, None, None, "", None, "no sample falls into it", kind=claim.kind)
