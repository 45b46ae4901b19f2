"""Which shapes of a robot may lie in each other because the body connects them."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.model import Robot


def separate_contacts(robot: Robot) -> list[tuple[int, int]]:
    """Pairs (i, j), i < j, of indices in ``robot.contacts`` of shapes that should be clear of each other.

    Shapes are neighbours, and may overlap, on the same frame; on two frames of one branch with no other shape on a
    frame between; and where the piece of body between them is shorter than their radii together: they overlap when
    it is straight and all the more when it is bent. That piece is the way along the frames' origins at q = 0, less
    the part that the shapes themselves cover.
    """
    body = _Body(robot)
    count = len(robot.contacts)
    return [(i, j) for i in range(count) for j in range(i + 1, count) if not body.neighbours(i, j)]


class _Body:
    """The frames of a robot as a tree, with lengths."""

    def __init__(self, robot: Robot) -> None:
        self.chain, self.parent = [-1], [-1]
        for k, chain in enumerate(robot.chains):
            before = robot.frame_index(chain.parent)
            for _ in chain.elements:
                self.parent.append(before)
                before = len(self.chain)
                self.chain.append(k)
        self.roots = [robot.frame_index(chain.parent) for chain in robot.chains]
        poses = robot.forward(np.zeros(robot.n))
        self.origin = poses.positions
        self.frame = [robot.frame_index(contact.frame) for contact in robot.contacts]
        self.radius = [contact.radius for contact in robot.contacts]
        # skeleton of every shape at q = 0, seen from the origin of its frame
        self.skeleton: list[Array] = [
            contact.points() @ poses.rotations[frame].T
            for contact, frame in zip(robot.contacts, self.frame, strict=True)
        ]
        self.reach = [float(np.linalg.norm(points, axis=1).max()) for points in self.skeleton]
        carrying = set(self.frame)
        self.way, self.shapes = [0.0], [int(0 in carrying)]
        for i, before in enumerate(self.parent[1:], start=1):
            self.way.append(self.way[before] + float(np.linalg.norm(self.origin[i] - self.origin[before])))
            self.shapes.append(self.shapes[before] + int(i in carrying))

    def neighbours(self, i: int, j: int) -> bool:
        a, b = self.frame[i], self.frame[j]
        if a == b:
            return True
        fork = self._fork(a, b)
        if fork in (a, b) and abs(self.shapes[a] - self.shapes[b]) == 1:
            return True
        length, touch = self.way[a] + self.way[b] - 2.0 * self.way[fork], self.radius[i] + self.radius[j]
        if length - self.reach[i] - self.reach[j] >= touch:
            return False
        path = self._path(a, b, fork)
        return length - self._covered(i, path) - self._covered(j, path[::-1]) < touch

    def _fork(self, a: int, b: int) -> int:
        """The last frame that the ways from the base to a and to b have in common."""
        while self.chain[a] != self.chain[b]:
            if self.chain[a] > self.chain[b]:
                a = self.roots[self.chain[a]]
            else:
                b = self.roots[self.chain[b]]
        return min(a, b)

    def _path(self, a: int, b: int, fork: int) -> list[int]:
        up, down = [a], [b]
        while up[-1] != fork:
            up.append(self.parent[up[-1]])
        while down[-1] != fork:
            down.append(self.parent[down[-1]])
        return [*up, *down[-2::-1]]

    def _covered(self, i: int, path: list[int]) -> float:
        """How far shape i, on the first frame of a path, reaches along it, m."""
        for frame in path[1:]:
            ahead = self.origin[frame] - self.origin[path[0]]
            length = float(np.linalg.norm(ahead))
            if length > 0.0:
                return max(0.0, float((self.skeleton[i] @ ahead).max()) / length)
        return 0.0
