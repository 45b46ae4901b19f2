"""E_nm of eq. (6) as a function of joint angles and kink, with its exact gradient."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.fitting.distance import CELL_TOLERANCE, integrate
from bodyplan.fitting.following import Following, body_points
from bodyplan.fitting.rules import kink_quaternion
from bodyplan.robot.elements import Arc, Joint
from bodyplan.spatial import GAUSS_NODES, compose, left_jacobian, matrix_from_quaternion

#: weights of the three-point rule at GAUSS_NODES
GAUSS_WEIGHTS = (5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0)
#: rad: step of the differences in :meth:`Objective.metric`
STEP = 1e-6


class Objective:
    """E_nm of fit number ``index`` of a :class:`Following` as a function of x (n + k,): the joint coordinates, then the
    kink about the ``axes`` that the mechanism has.

    The integral is that of the accurate error, adaptive cells and all. Its gradient is that of the integrand: unit
    vectors from the curve to the body pull at the frames, and the robot's Jacobians turn that into joint space.
    """

    def __init__(self, following: Following, index: int, axes: tuple[int, ...]) -> None:
        one = slice(index, index + 1)
        self._robot, self._made, self._dense = following.robot, following.made, following.dense
        self._start = float(following.starts[index])
        count = int(following.counts[index])
        self._stops = np.ascontiguousarray(following.stops[index, : count + 1])
        self._owners = np.ascontiguousarray(following.owners[index, :count])
        self._segments = following.segments
        self._tail = self._dense.pose(following.starts[one])
        self._axes = list(axes)
        self.n = self._robot.n
        segments = self._made.segments
        self._first = np.array([s.first for s in segments])
        self._arc = np.array([s.arc for s in segments])
        # the frames at the ends of segments; the base, which is none of them, counts as the last one
        self._frames = np.unique(np.concatenate([self._first, self._first + 1]))
        self._frames = self._frames[self._frames > 0]
        self._names = tuple(self._robot.frames[f] for f in self._frames)
        self._from = np.where(self._first > 0, np.searchsorted(self._frames, self._first), len(self._frames))
        self._to = np.searchsorted(self._frames, self._first + 1)
        column = {name: i for i, name in enumerate(self._robot.joints)}
        self._data = np.zeros((len(segments), 17))
        bends = []  # segment, column of pitch or yaw, joint, scale
        for i, s in enumerate(segments):
            element = self._robot.elements[s.first]
            if isinstance(element, Arc):
                for k, bend in enumerate((element.pitch, element.yaw)):
                    if isinstance(bend, Joint):
                        bends.append((i, k, column[bend.name], bend.scale))
        table = np.array(bends).reshape(-1, 4)
        self._bent, self._axis, self._joint = table[:, :3].astype(np.int64).T
        self._scale = table[:, 3]

    def full_kink(self, x: Array) -> Array:
        """(pitch, yaw) rad."""
        kink = np.zeros(2)
        kink[self._axes] = x[self.n :]
        return kink

    def __call__(self, x: Array) -> tuple[float, Array]:
        """(E_nm, its gradient (n + k,))."""
        q, kink = np.ascontiguousarray(x[: self.n]), self.full_kink(x)
        hinged = self._made.kind == "straight"
        turn = kink_quaternion(kink, hinged)
        base = compose(self._tail[0], np.concatenate([np.zeros(3), turn]))
        at = self._robot.ends_and_jacobians(q, base, frames=self._names)
        positions = np.concatenate([at.positions, base[None, :3]])
        rotations = np.concatenate([at.rotations, matrix_from_quaternion(base[3:])[None]])
        data = self._data
        data[:, :3], data[:, 3:6] = positions[self._from], positions[self._to]
        data[:, 6:15] = rotations[self._from].swapaxes(1, 2).reshape(-1, 9)
        data[self._bent, 15 + self._axis] = self._scale * q[self._joint]
        wrenches = np.empty((len(data), 8))
        size = self._made.length**2
        cells = (self._segments, data, self._dense.ends, self._dense.cells)
        total, _ = integrate(self._start, self._stops, self._owners, *cells, CELL_TOLERANCE * size, wrenches)

        pull = self._pulls(wrenches)
        own = np.concatenate([pull[:-1, None, :3] @ at.rotations, pull[:-1, None, 3:] @ at.rotations], axis=2)[:, 0]
        gradient = np.zeros(len(x))
        rows = np.repeat(np.arange(len(own)), np.diff(at.offsets))
        np.add.at(gradient, at.joints, np.einsum("kc,kc->k", at.twists, own[rows]))
        np.add.at(gradient, self._joint, self._scale * wrenches[self._bent, 6 + self._axis])
        # everything turns about the base
        arms = positions - base[:3]
        about = np.einsum("fa,fb->ab", arms, pull[:, :3])
        moment = np.array([about[1, 2] - about[2, 1], about[2, 0] - about[0, 2], about[0, 1] - about[1, 0]])
        gradient[self.n :] = (self._kink_axes(kink, hinged) @ (moment + pull[:, 3:].sum(axis=0)))[self._axes]
        return total / size, gradient / size

    def metric(self, x: Array) -> Array:
        """(n + k, n + k): mean square, over the body, of how far its points move with the unknowns, in body lengths.
        Divided by the distance it is about the Hessian: what an optimiser should be told. To 1e-6 or so."""
        hinged = self._made.kind == "straight"
        all_x = np.vstack([x, x + STEP * np.eye(len(x))])
        kinks = np.stack([self.full_kink(each) for each in all_x])
        turns = np.concatenate([np.zeros((len(kinks), 3)), kink_quaternion(kinks, hinged)], axis=1)
        q = np.ascontiguousarray(all_x[:, : self.n])
        low, high = self._segments[:, 0], self._segments[:, 1]
        s = (low[:, None] + (high - low)[:, None] * np.array(GAUSS_NODES)).ravel()
        points = body_points(self._robot, self._made, q, compose(self._tail, turns), s)
        moves = (points[1:] - points[0]).reshape(len(x), -1, 3) / (STEP * self._made.length)
        weights = np.outer((high - low) / self._made.length, GAUSS_WEIGHTS).ravel()
        return np.asarray(np.einsum("asi,bsi,s->ab", moves, moves, weights, optimize=True))

    def _pulls(self, wrenches: Array) -> Array:
        """Forces and moments (F + 1, 6) on the frames and, last, on the base."""
        pull = np.zeros((len(self._frames) + 1, 6))
        np.add.at(pull[:, :3], self._from, wrenches[:, :3])
        np.add.at(pull[:, 3:], self._from[self._arc], wrenches[self._arc, 3:6])
        np.add.at(pull[:, :3], self._to[~self._arc], wrenches[~self._arc, 3:6])
        return pull

    def _kink_axes(self, kink: Array, hinged: bool) -> Array:
        """(2, 3): the axes about which the base turns with the kink's pitch and yaw."""
        frame = matrix_from_quaternion(self._tail[0, 3:])
        if not hinged:
            return np.asarray((frame @ left_jacobian(np.array([0.0, *kink])))[:, 1:].T)
        yaw = matrix_from_quaternion(kink_quaternion(np.array([0.0, kink[1]]), True))
        return np.stack([frame @ yaw[:, 1], frame[:, 2]])
