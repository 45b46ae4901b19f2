"""The body's pose, velocity and acceleration at any time, from its path, height, roll, pitch and heading; exact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import InputError
from bodyplan.gaits.carry.laws import Law
from bodyplan.gaits.carry.orientation import Function, Turning, turning
from bodyplan.gaits.carry.paths import Course
from bodyplan.gaits.carry.rates import Carried
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.gaits.carry.wheels import Wheels

if TYPE_CHECKING:
    from bodyplan.gaits.carry.gait import Carry


@dataclass(frozen=True)
class Carriage:
    """The base at T times: ``position``, ``velocity``, ``acceleration`` (T, 3) in the world, m and s; ``turn`` its
    orientation and how that changes; ``course`` the path; ``off_map`` (T,) True where there is no ground to stand
    over."""

    position: Array
    velocity: Array
    acceleration: Array
    turn: Turning
    course: Course
    off_map: BoolArray

    @property
    def base(self) -> Array:
        """Poses (T, 7) of the base."""
        return np.concatenate([self.position, self.turn.quaternion], axis=1)

    def carried(self, wheels: Wheels) -> Carried:
        """How the wheels are carried, wheel after wheel: (k T,)."""
        count, R = len(wheels), self.turn.matrix
        arm = np.einsum("tij,kj->kti", R, wheels.centres)
        w, g = self.turn.spin[None], self.turn.gain[None]
        turned = np.cross(w, arm)
        axes = [np.einsum("tij,kj->kti", R, wheels.axes[:, i]).reshape(-1, 3) for i in range(3)]
        return Carried(
            (self.position + arm).reshape(-1, 3),
            (self.velocity + turned).reshape(-1, 3),
            (self.acceleration + np.cross(g, arm) + np.cross(w, turned)).reshape(-1, 3),
            np.tile(self.turn.spin, (count, 1)),
            np.tile(self.turn.gain, (count, 1)),
            *axes,
        )


def direction(gait: Carry, course: Course, t: Array) -> Function:
    """The heading of the body."""
    return course.direction if gait.heading is None else gait.heading.at(t)


def _tilt(law: Law, name: str, t: Array) -> Function:
    """Roll or pitch; InputError where it is a right angle or more, at which a heading says nothing."""
    tilt = law.at(t)
    beyond = np.flatnonzero(np.abs(tilt.value) >= 0.5 * np.pi)
    if len(beyond):
        k = int(beyond[0])
        raise InputError(f"{name}: must stay within +-pi/2 rad, is {tilt.value[k]:.4g} at t = {t[k]:.4g} s.")
    return tilt


def carriage(gait: Carry, ground: Terrain, ahead: float, height: Callable[[Array], Function], t: Array) -> Carriage:
    """The base at times t (T,); ``ahead`` m is where on the body's x axis the point is that follows the path."""
    course = gait.course(t)
    roll, pitch = _tilt(gait.roll, "roll", t), _tilt(gait.pitch, "pitch", t)
    turn = turning(direction(gait, course, t), roll, pitch)
    offset = ahead * turn.matrix[:, :, 0]
    swing = np.cross(turn.spin, offset)
    place = course.place - offset[:, :2]
    velocity = course.velocity - swing[:, :2]
    acceleration = course.acceleration - (np.cross(turn.gain, offset) + np.cross(turn.spin, swing))[:, :2]
    h = height(t)
    if gait.height_mode == "absolute":
        stands = [np.concatenate([xy, z[:, None]], axis=1) for xy, z in
                  ((place, h.value), (velocity, h.first), (acceleration, h.second))]  # fmt: skip
        return Carriage(stands[0], stands[1], stands[2], turn, course, np.zeros(len(t), dtype=np.bool_))
    low, high = ground.field_box
    off_map = np.any((place < low) | (place > high), axis=1)
    foot, foot_1, foot_2, normals = _footing(ground, place, velocity, acceleration)
    if gait.height_mode == "vertical":
        normals = [np.tile([0.0, 0.0, 1.0], (len(t), 1)), np.zeros((len(t), 3)), np.zeros((len(t), 3))]
    n, n_1, n_2 = normals
    h0, h1, h2 = h.value[:, None], h.first[:, None], h.second[:, None]
    return Carriage(
        foot + h0 * n,
        foot_1 + h1 * n + h0 * n_1,
        foot_2 + h2 * n + 2.0 * h1 * n_1 + h0 * n_2,
        turn,
        course,
        off_map,
    )


def _footing(
    ground: Terrain, place: Array, velocity: Array, acceleration: Array
) -> tuple[Array, Array, Array, list[Array]]:
    """The ground point below (T, 3) with its derivatives by time, and the unit normal there with its own."""
    f, g, H = ground.field_jet(place[:, 0], place[:, 1])
    rate = ground.field_hessian_rate(*place.T, *velocity.T)
    g_1 = np.einsum("tij,tj->ti", H, velocity)
    g_2 = np.einsum("tij,tj->ti", rate, velocity) + np.einsum("tij,tj->ti", H, acceleration)
    z_1 = np.sum(g * velocity, axis=1)
    z_2 = np.sum(g_1 * velocity, axis=1) + np.sum(g * acceleration, axis=1)
    points = [np.concatenate([xy, z[:, None]], axis=1) for xy, z in
              ((place, f), (velocity, z_1), (acceleration, z_2))]  # fmt: skip
    N = np.concatenate([-g, np.ones((len(g), 1))], axis=1)
    N_1, N_2 = (np.concatenate([-d, np.zeros((len(g), 1))], axis=1) for d in (g_1, g_2))
    size = np.linalg.norm(N, axis=1, keepdims=True)
    n = N / size
    size_1 = np.sum(n * N_1, axis=1, keepdims=True)
    n_1 = (N_1 - size_1 * n) / size
    size_2 = (np.sum(N_1 * N_1 + N * N_2, axis=1, keepdims=True) - size_1**2) / size
    n_2 = (N_2 - 2.0 * size_1 * n_1 - size_2 * n) / size
    return points[0], points[1], points[2], [n, n_1, n_2]
