"""What a report shows of a body that is carried on wheels: their angles, radii, forces, torques, spins and slips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.errors import BodyplanError
from bodyplan.gaits.carry import Carry, Forces, Maps, Pose, forces, maps, pose_of, wheel_rates
from bodyplan.gaits.carry.hull import boxes, lower_face
from bodyplan.gaits.carry.loads import paper_torque
from bodyplan.motion import Motion
from bodyplan.spatial import conjugate, matrix_from_quaternion, multiply, quaternion_log, rotate

#: samples of a long motion that are drawn, and at which cone programs are solved
SAMPLES, FEW = 600, 60
#: and around how many leaps of the friction used, and what share of the most of it a leap is
LEAPS, LEAP = 8, 0.2
#: headings and heights of a map
HEADINGS, HEIGHTS = 37, 21


@dataclass(frozen=True, eq=False)
class Carrying:
    """A carried motion at s samples, k wheels.

    ``chosen`` (s,) samples; ``t`` (s,) s; ``names`` (k,); ``adjusted`` (k,) whether a wheel changes its radius;
    ``angle`` (s, k) rad adjusting angles; ``radius`` (s, k) m and ``reach`` (k, 2) its range; ``torque``, ``paper``,
    ``hub`` (s, k) N m by eq. (34), eq. (35) and of the hubs; ``spin`` (s, k) rad/s; ``slip`` (s, k) m/s sideways;
    ``used`` (s, k) ratio of friction to load; ``clearance`` (s,) m of the hull, or None without one. ``points`` (s, k,
    3) m contacts. nan where a sample was not solved. ``statics`` at the samples ``few`` (f,), None with ``problem``
    where there are none.
    """

    motion: Motion
    chosen: IntArray
    t: Array
    names: tuple[str, ...]
    adjusted: tuple[bool, ...]
    angle: Array
    radius: Array
    reach: Array
    torque: Array
    paper: Array
    hub: Array
    spin: Array
    slip: Array
    used: Array
    clearance: Array | None
    points: Array
    few: IntArray
    statics: Forces | None
    problem: str

    @staticmethod
    def of(motion: Motion) -> Carrying | None:
        """What is to be shown; None for the plans of other gaits."""
        if motion.gait.get("kind") != Carry.kind:
            return None
        chosen = _even(len(motion.t), SAMPLES)
        at = pose_of(motion.robot, motion.ground, motion.base[chosen])
        bad = motion.status[chosen] != "ok"
        rates = wheel_rates(at, _twists(motion)[chosen])
        wheels = [one.wheel for one in at]
        mass, size = motion.robot.mass, len(wheels)

        def columns(values: list[Array]) -> Array:
            out = np.stack(values, axis=1).astype(np.float64)
            out[bad] = np.nan
            return out

        torque = hub = used = np.full((len(chosen), size), np.nan)
        if motion.torques is not None and motion.forces is not None:
            none = np.zeros(len(chosen))
            torque = columns([none if w.adjust is None else motion.torques[chosen, w.adjust] for w in wheels])
            hub = columns([motion.torques[chosen, w.spin] / w.turn for w in wheels])
            used = columns(
                [_ratio(motion.forces[chosen, w.rim], one.normal) for w, one in zip(wheels, at, strict=True)]
            )
        few = np.union1d(_even(len(motion.t), FEW), chosen[_leaps(used)])
        statics, problem = _statics(motion, few)
        return Carrying(
            motion,
            chosen,
            motion.t[chosen] - motion.t[0],
            tuple(w.name for w in wheels),
            tuple(w.adjust is not None for w in wheels),
            columns([one.q for one in at]),
            columns([one.radius for one in at]),
            np.array([w.range for w in wheels]),
            torque,
            columns([paper_torque(mass, w, one.q, size) for w, one in zip(wheels, at, strict=True)]),
            hub,
            columns([motion.qd[chosen, w.spin] * w.turn for w in wheels]),
            columns([one.slip for one in rates]),
            used,
            _clearance(motion, chosen, bad),
            np.stack([one.point for one in at], axis=1),
            few,
            statics,
            problem,
        )

    def maps(self) -> Maps | str:
        """The maps over heading and height at the place in the middle of the way; or why there are none."""
        motion = self.motion
        middle = len(motion.t) // 2
        try:
            place = motion.base[middle, :2]
            return maps(motion.robot, motion.ground, place, headings=HEADINGS, heights=HEIGHTS)
        except BodyplanError as error:
            return str(error)

    @property
    def place(self) -> tuple[Array, float, float]:
        """Where the maps are: x, y m; the heading rad and the height m that the plan has there."""
        base = self.motion.base[len(self.motion.t) // 2]
        ahead = rotate(base[3:], np.array([1.0, 0.0, 0.0]))
        return base[:2], float(np.arctan2(ahead[1], ahead[0])), float(base[2])


def _even(count: int, most: int) -> IntArray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _leaps(used: Array) -> IntArray:
    """Rows of ``used`` (s, k) before and after the greatest changes from row to row, where they stand out."""
    known = np.nan_to_num(used)
    change = np.abs(np.diff(known, axis=0)).max(axis=1, initial=0.0)
    most = np.sort(np.argsort(-change, kind="stable")[:LEAPS])
    most = most[change[most] > LEAP * known.max(initial=0.0)]
    return np.union1d(most, most + 1)


def _ratio(force: Array, normal: Array) -> Array:
    """Friction over load (s,) of forces (s, 3); nan without force."""
    load = np.sum(force * normal, axis=1)
    across = np.linalg.norm(force - load[:, None] * normal, axis=1)
    some = load > 0.0
    return np.where(some, across / np.where(some, load, 1.0), np.nan)


def _twists(motion: Motion) -> Array:
    """Body-fixed twists (T, 6) of the base, by differences of the samples: good enough for a picture of slip."""
    t, base = motion.t, motion.base
    middle, span = 0.5 * (t[1:] + t[:-1]), np.diff(t)[:, None]
    moved = np.diff(base[:, :3], axis=0) / span
    # between two samples the body turns about an axis that both see alike
    turned = quaternion_log(multiply(conjugate(base[:-1, 3:]), base[1:, 3:])) / span
    velocity, spin = (np.stack([_between(t, middle, v) for v in rates.T], axis=1) for rates in (moved, turned))
    return np.concatenate([rotate(conjugate(base[:, 3:]), velocity), spin], axis=1)


def _between(t: Array, middle: Array, values: Array) -> Array:
    """Values at ``middle`` (T - 1,) at times t (T,): linear, also beyond the ends."""
    out = np.interp(t, middle, values)
    if len(middle) > 1:
        for end, one, other in ((0, 0, 1), (-1, -1, -2)):
            slope = (values[other] - values[one]) / (middle[other] - middle[one])
            out[end] = values[one] + slope * (t[end] - middle[one])
    return np.asarray(out)


def _statics(motion: Motion, few: IntArray) -> tuple[Forces | None, str]:
    """Forces with their intervals where they are drawn."""
    if motion.forces is None:
        return None, ""
    try:
        at: Pose = pose_of(motion.robot, motion.ground, motion.base[few])
        return forces(at), ""
    except BodyplanError as error:
        return None, str(error)


def _clearance(motion: Motion, chosen: IntArray, bad: Array) -> Array | None:
    """Smallest height (s,) m of points of the hull's lower faces over the ground; None without a hull or off a map."""
    out = np.full(len(chosen), np.inf)
    rotation = matrix_from_quaternion(motion.base[chosen, 3:])
    for box in boxes(motion.robot):
        at = motion.base[chosen, None, :3] + np.einsum("tij,pj->tpi", rotation, lower_face(box))
        try:
            out = np.minimum(out, motion.ground.gap(at).min(axis=1))
        except BodyplanError:
            return None
    if not np.isfinite(out).any():
        return None
    out[bad] = np.nan
    return out
