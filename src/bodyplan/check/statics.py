"""The judge's own look at statics: whether the planned forces of the ground on rims hold the robot, stay within their
friction cones, and ask of the motors what the plan says."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.check.report import Line
from bodyplan.check.rims import contact_of, lowest_points, none_left, on_the_map, samples_of
from bodyplan.ground.base import Ground
from bodyplan.ground.profile import Profile
from bodyplan.motion import Claim, Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.spatial import matrix_from_quaternion

GRAVITY = 9.81
#: m along a rim within which the ground's normal is looked at on both sides, and the sine between two that are an edge
BESIDE, EDGE = 1e-5, 0.01
#: m: a point so near to the edge of a step is on it
STEP = 1e-6
#: N: a force below this share of the weight is none
NONE = 1e-9


@on_the_map
def holds(motion: Motion, positions: Array, claim: Claim) -> Line:
    """How far the planned forces on the claimed rims, where they touch, and the weight are from a balance: the larger
    one of the force left over, a share of the weight, and the moment left over about the centre of mass, a share of the
    weight at the arm of the farthest wheel."""
    samples = samples_of(motion, claim)
    if not len(samples):
        return none_left(claim)
    if motion.forces is None:
        return Line(claim.label, None, None, "", False, "the motion has no forces", kind=claim.kind)
    poses = motion.robot.forward(motion.q[samples], motion.base[samples])
    center = center_from_poses(motion.robot, poses.array)
    weight = motion.robot.mass * GRAVITY
    left = np.tile([0.0, 0.0, -weight], (len(samples), 1))
    turning, reach = np.zeros_like(left), np.zeros(len(samples))
    for name in claim.data["contacts"]:
        k, contact = contact_of(motion, str(name))
        arm = lowest_points(motion, k, contact, samples) - center
        force = motion.forces[samples, k]
        left, turning = left + force, turning + np.cross(arm, force)
        reach = np.maximum(reach, np.linalg.norm(arm, axis=1))
    share = np.maximum(np.linalg.norm(left, axis=1), np.linalg.norm(turning, axis=1) / reach) / weight
    worst, limit = int(share.argmax()), float(claim.data["tolerance"])
    detail = f"share of the weight, {len(samples)} samples; worst at {motion.t[samples[worst]]:.4g} s"
    return Line(claim.label, float(share[worst]), limit, "", bool(share[worst] <= limit), detail, kind=claim.kind)


@on_the_map
def grips_ground(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Largest ratio of friction to load that the planned forces need, over the contact's coefficient and the claimed
    tolerance: 1 is the limit of sliding."""
    samples = samples_of(motion, claim)
    if not len(samples):
        return none_left(claim)
    if motion.forces is None:
        return Line(claim.label, None, None, "", False, "the motion has no forces", kind=claim.kind)
    weight, slack = motion.robot.mass * GRAVITY, float(claim.data["tolerance"])
    poses = motion.robot.forward(motion.q[samples], motion.base[samples])
    worst: tuple[float, str] | None = None
    for name, mu in zip(claim.data["contacts"], np.asarray(claim.data["friction"]), strict=True):
        k, contact = contact_of(motion, str(name))
        points = lowest_points(motion, k, contact, samples)
        ratio = _ratio(motion.ground, points, poses[contact.frame], motion.forces[samples, k], NONE * weight)
        i = int(ratio.argmax())
        used = float(ratio[i]) / (float(mu) + slack)
        if worst is None or used > worst[0]:
            told = f"{ratio[i]:.3g} of {mu:.3g}" if np.isfinite(ratio[i]) else "pulls"
            worst = used, f"{told}, {contact.name} at {motion.t[samples[i]]:.4g} s"
    if worst is None:
        return none_left(claim)
    used, detail = worst
    value = used if np.isfinite(used) else None
    return Line(claim.label, value, 1.0, "", used <= 1.0, detail, kind=claim.kind)


def _ratio(ground: Ground, points: Array, hub: Array, force: Array, none: float) -> Array:
    """Friction over load (s,) of forces at points of rims, infinite where the ground would have to pull; on an edge the
    normal is that of either side or, between them, the one towards the hub."""
    size = np.linalg.norm(force, axis=1)
    out = np.full(len(points), np.inf)
    for normal, holds in _normals(ground, points, hub):
        load = np.sum(force * normal, axis=1)
        across = np.linalg.norm(force - load[:, None] * normal, axis=1)
        with np.errstate(all="ignore"):
            out = np.where(holds & (load > 0.0), np.minimum(out, across / load), out)
    return np.where(size <= none, 0.0, out)


def _normals(ground: Ground, points: Array, hub: Array) -> list[tuple[Array, BoolArray]]:
    """Normals (s, 3) that the ground may have at points (s, 3), and where they may be so."""
    inward = hub[:, :3] - points
    inward /= np.linalg.norm(inward, axis=1, keepdims=True)
    axle = matrix_from_quaternion(hub[:, 3:])[:, :, 2]
    along = np.cross(axle, inward)
    if isinstance(ground, Profile):
        upward, always = np.tile([0.0, 0.0, 1.0], (len(points), 1)), np.ones(len(points), dtype=np.bool_)
        on_tread = np.abs(points[:, 2] - ground.height(points)) <= STEP
        way = np.sign(inward[:, :1]) * np.array([1.0, 0.0, 0.0])
        steps = [ground.height(points + s * STEP * np.array([1.0, 0.0, 0.0])) for s in (-1.0, 1.0)]
        at_step = np.abs(steps[1] - steps[0]) > STEP
        return [(upward, on_tread & always), (way, at_step), (inward, at_step)]
    sides = [ground.normal(points + s * BESIDE * along) for s in (-1.0, 1.0)]
    bend = np.linalg.norm(np.cross(sides[0], sides[1]), axis=1)
    edge = bend > EDGE
    return [(ground.normal(points), ~edge), (sides[0], edge), (sides[1], edge), (inward, edge)]


@on_the_map
def bears(motion: Motion, positions: Array, claim: Claim) -> Line:
    """How far planned torques of wheels are from those of virtual work under the planned forces, a share of the weight
    at a wheel's radius: of adjusting motors -R'(q) F . u, of hubs R F . t."""
    samples = samples_of(motion, claim)
    if not len(samples):
        return none_left(claim)
    if motion.forces is None or motion.torques is None:
        return Line(claim.label, None, None, "", False, "the motion has no torques", kind=claim.kind)
    robot, scale = motion.robot, 0.0
    poses = robot.forward(motion.q[samples], motion.base[samples])
    found: dict[int, Array] = {}
    for name, (adjust, spin, turn) in _columns(motion, [str(name) for name in claim.data["contacts"]]).items():
        k, contact = contact_of(motion, name)
        arm = lowest_points(motion, k, contact, samples) - poses[contact.frame][:, :3]
        scale = max(scale, robot.mass * GRAVITY * float(np.linalg.norm(arm, axis=1).max()))
        force = motion.forces[samples, k]
        axle = matrix_from_quaternion(poses[contact.frame][:, 3:])[:, :, 2]
        # the moment of the ground about the hub's axis turns it against its motor; wheels may share motors
        found[spin] = found.get(spin, 0.0) - turn * np.sum(np.cross(arm, force) * axle, axis=1)
        if adjust is not None and contact.drive is not None:
            u = arm / np.linalg.norm(arm, axis=1, keepdims=True)
            pull = contact.drive.slope(motion.q[samples, adjust]) * np.sum(force * u, axis=1)
            found[adjust] = found.get(adjust, 0.0) - pull
    off = {column: np.abs(motion.torques[samples, column] - torque) for column, torque in found.items()}
    column = max(off, key=lambda c: float(off[c].max()))
    value, limit = float(off[column].max()) / scale if scale > 0.0 else 0.0, float(claim.data["tolerance"])
    detail = f"{robot.joints[column]} at {motion.t[samples[off[column].argmax()]]:.4g} s"
    return Line(
        claim.label,
        value,
        limit,
        "",
        value <= limit,
        f"share of {scale:.4g} N m, the weight at a wheel; worst: {detail}",
        kind=claim.kind,
    )


def torques_within(motion: Motion) -> Line | None:
    """Largest planned torque over what its joint can give; None where no joint says or the plan gives no torques."""
    if motion.torques is None:
        return None
    efforts = motion.robot.efforts
    some = np.flatnonzero(np.isfinite(efforts))
    if not len(some):
        return None
    share = np.abs(motion.torques[:, some]) / efforts[some]
    at, column = np.unravel_index(int(share.argmax()), share.shape)
    value = float(share[at, column])
    detail = f"{motion.joints[some[column]]} at {motion.t[at]:.4g} s"
    return Line(
        "planned torques, share of what motors give", value, 1.0, "", value <= 1.0 + 1e-9, detail, kind="torques"
    )


def _columns(motion: Motion, names: list[str]) -> dict[str, tuple[int | None, int, float]]:
    """Columns of q of the adjusting joint and the hub's joint of rims, and by how much of it the hub turns."""
    robot = motion.robot
    out: dict[str, tuple[int | None, int, float]] = {}
    for name in names:
        _, contact = contact_of(motion, name)
        row = robot.elements[robot.frame_index(contact.frame) - 1]
        drive = contact.drive
        adjust = None if drive is None else robot.joint_index(drive.joint.name)
        out[name] = adjust, robot.joint_index(row.theta.name), row.theta.scale  # type: ignore[union-attr]
    return out


__all__ = ["bears", "grips_ground", "holds", "torques_within"]
