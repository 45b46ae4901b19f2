"""Statics of a snake on its anchors: what each of them carries, and the torque that holds every pitch joint."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bodyplan.arrays import Array, BoolArray, IntArray
from bodyplan.fitting.mechanism import PITCH, mechanism
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.robot.masses import center_from_poses, mass_points
from bodyplan.spatial import rotate

GRAVITY = 9.81
#: singular values below this share of the largest are rounding
SINGULAR = 1e-15


@dataclass(frozen=True, eq=False)
class Holding:
    """``loads`` (T, N) N, upright, of the anchors, negative where the ground would have to pull; ``torques`` (T, n)
    N m of the joint coordinates; ``center`` (T,) m: centre of mass along the way; ``margin`` (T,) m: from there to the
    nearer of the rearmost and the foremost standing anchor, negative where the snake tips."""

    loads: Array
    torques: Array
    center: Array
    margin: Array


def holding(snake: InchingSnake, poses: Array, along: Array, anchors: Array, standing: BoolArray) -> Holding | None:
    """Statics at ``poses`` (T, F, 7) of the robot's frames, on level treads and without friction.

    ``along`` (3,): the way forward; ``anchors`` (T, N) m: their places in the world along it; ``standing`` (T, N). Two
    standing anchors leave no choice. With more, the loads are those that hold with the least sum of squared torques,
    none of them pulling: what equally stiff servos settle at. None for a robot without masses.
    """
    robot, lever = snake.robot, _levers(snake)
    if lever is None:
        return None
    places = (poses[:, lever.frames, :3] + rotate(poses[:, lever.frames, 3:], lever.centres)) @ along
    center = center_from_poses(robot, poses) @ along
    joints = poses[:, lever.joints, :3] @ along
    # torque that a joint must give, nose-up, to carry what is ahead of it
    weight = np.einsum("jb,tjb->tj", lever.ahead, places[:, None, :] - joints[:, :, None])
    arms = np.where(lever.loaded, anchors[:, None, :] - joints[:, :, None], 0.0)
    loads = np.zeros(anchors.shape)
    for pattern in np.unique(standing, axis=0):
        rows = np.flatnonzero((standing == pattern).all(axis=1))
        feet = np.flatnonzero(pattern)
        if len(feet):
            loads[np.ix_(rows, feet)] = _loads(
                anchors[rows][:, feet], center[rows], lever.total, weight[rows], arms[rows][:, :, feet]
            )
    torque = weight - np.einsum("tjk,tk->tj", arms, loads)
    torques = np.zeros((len(center), robot.n))
    torques[:, lever.pitch] = -lever.gain * torque
    return Holding(loads, torques, center, support_margin(anchors, center, standing))


@dataclass(frozen=True, eq=False)
class _Levers:
    """What pulls at which of the J pitch joints, whatever the pose: bodies with their ``centres`` (B, 3) m in their
    ``frames`` (B,); frames of the ``joints`` (J,); ``ahead`` (J, B) N, the weight of those ahead of a joint; ``loaded``
    (J, N): anchors that are; columns ``pitch`` (J,) of q with their ``gain``; the ``total`` N."""

    frames: IntArray
    centres: Array
    joints: IntArray
    ahead: Array
    loaded: BoolArray
    pitch: IntArray
    gain: Array
    total: float


@lru_cache(maxsize=16)
def _levers(snake: InchingSnake) -> _Levers | None:
    """Once for all plans with a snake; None where it has no masses."""
    robot = snake.robot
    frames, masses, centres = mass_points(robot)
    if not len(frames) or not masses.sum() > 0.0:
        return None
    made = mechanism(robot)
    pitch = made.joints_of(PITCH)
    at_rest = made.places[made.joint_place[pitch]]
    rest = robot.forward(np.zeros(robot.n))
    joints = np.array([int(np.argmin(np.abs(rest.positions[:, 0] - x))) for x in at_rest])
    body_rest = rest.positions[frames, 0] + rotate(rest.array[frames, 3:], centres)[:, 0]
    anchor_rest = made.places[made.joint_place[snake.columns[0::2]]]
    # an anchor's load acts on the link behind its joint
    loaded = anchor_rest[None, :] > at_rest[:, None] + 1e-12 * made.length
    weights = masses * GRAVITY
    ahead = (body_rest[None, :] > at_rest[:, None]) * weights
    gain = np.asarray(made.gain[pitch])
    return _Levers(np.asarray(frames), centres, joints, ahead, loaded, pitch, gain, float(weights.sum()))


def support_margin(anchors: Array, center: Array, standing: BoolArray) -> Array:
    """(T,) m: from the ``center`` (T,) of mass to the nearer end of the standing anchors (T, N) along the way, negative
    beyond them; minus infinity where none stands."""
    rear = np.where(standing, anchors, np.inf).min(axis=-1)
    front = np.where(standing, anchors, -np.inf).max(axis=-1)
    return np.asarray(np.minimum(center - rear, front - center))


def _loads(feet: Array, center: Array, total: float, weight: Array, arms: Array) -> Array:
    """Loads (R, k) of anchors at ``feet`` (R, k) for torques weight - arms @ loads (R, j)."""
    k = feet.shape[1]
    if k == 1:
        return np.full(feet.shape, total)
    away = feet - center[:, None]
    # sum of loads = total and no moment about the centre of mass, scaled to like sizes
    size = np.maximum(np.abs(away).max(axis=1), 1e-300)
    balance = np.stack([np.ones_like(away), away / size[:, None]], axis=1)
    wanted = np.zeros((len(feet), 2))
    wanted[:, 0] = total
    out = _least(balance, wanted, weight, arms)
    for row in np.flatnonzero((out.min(axis=1) < -1e-12 * total) & (k > 2)):
        keep, one = np.arange(k), slice(row, row + 1)
        part = out[row]
        while len(keep) > 2 and part.min() < -1e-12 * total:
            keep = np.delete(keep, int(part.argmin()))
            part = _least(balance[one][:, :, keep], wanted[one], weight[one], arms[one][:, :, keep])[0]
        out[row] = 0.0
        out[row, keep] = part
    return out


def _least(balance: Array, wanted: Array, weight: Array, arms: Array) -> Array:
    """Loads (R, k) with ``balance`` (R, 2, k) loads = ``wanted`` and the least |weight - arms loads|."""
    k = balance.shape[2]
    if k == 2:
        return np.asarray(np.einsum("rki,ri->rk", np.linalg.pinv(balance), wanted))
    turn, sizes, basis = np.linalg.svd(balance)
    shares = np.where(sizes > SINGULAR * sizes[:, :1], 1.0 / np.maximum(sizes, 1e-300), 0.0)  # as in a pseudoinverse
    some = np.einsum("rik,ri->rk", basis[:, :2], np.einsum("rij,ri->rj", turn, wanted) * shares)
    free = np.swapaxes(basis[:, 2:], -1, -2)  # (R, k, k - 2): what changes neither sum nor moment
    left = weight - np.einsum("rjk,rk->rj", arms, some)
    mix = np.einsum("rki,ri->rk", np.linalg.pinv(arms @ free), left)
    return np.asarray(some + np.einsum("rki,ri->rk", free, mix))
