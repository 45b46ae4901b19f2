"""A tree of links, as URDF and MJCF describe robots, as chains of rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError
from bodyplan.robot.elements import Body, Chain, Contact
from bodyplan.robot.reading.rows import Screw, most_rows, rows_of
from bodyplan.robot.reading.shapes import Shape, contact_of

Parts = tuple[str, tuple[Chain, ...], tuple[Contact, ...], Body | None]
#: frame names that a robot gives itself
RESERVED = ("base", "world")


@dataclass(frozen=True)
class Link:
    """A rigid part: ``parent`` (None: the base), ``screws`` and the fixed transform ``after`` (4, 4) from the parent's
    frame to its own; what it carries."""

    name: str
    parent: str | None
    screws: tuple[Screw, ...] = ()
    after: Array = field(default_factory=lambda: np.eye(4))
    body: Body | None = None
    shapes: tuple[Shape, ...] = ()


@dataclass(frozen=True)
class Tree:
    """``links``: parents before their children. ``base``: name of the link that is the base, or None where it is the
    world; ``base_body`` and ``base_shapes``: what the base carries."""

    name: str
    links: tuple[Link, ...]
    base: str | None = None
    base_body: Body | None = None
    base_shapes: tuple[Shape, ...] = ()


def parts_of(tree: Tree, contacts: Sequence[Contact] | None = None) -> Parts:
    """Arguments of Robot for a tree; ``contacts`` in place of its own shapes.

    A chain is named like its last frame; it follows the child that moves most joints, and the others begin chains of
    their own. All children of the base do. Raises InputError for a tree without links and names that no frame can have.
    """
    if not tree.links and tree.base is None:
        raise InputError("the model has no links.")
    return _Writer(tree, contacts is None).parts(contacts)


class _Writer:
    def __init__(self, tree: Tree, shapes: bool) -> None:
        self.tree, self.shapes = tree, shapes
        self.children: dict[str | None, list[Link]] = {}
        for link in tree.links:
            self.children.setdefault(None if link.parent == tree.base else link.parent, []).append(link)
        self.alias = tree.base if tree.base is not None and tree.base not in RESERVED else None
        names = [*([self.alias] if self.alias else []), *(link.name for link in tree.links)]
        self.taken = {*RESERVED, *names}
        self.frames = {name: self._allowed(name) for name in names}
        self.weight = self._weights()
        self.chains: list[Chain] = []
        self.contacts: list[Contact] = []
        self.hung: list[Chain] = []

    def parts(self, contacts: Sequence[Contact] | None) -> Parts:
        for shape in self.tree.base_shapes:
            self._touch(shape, "base")
        starts = [(link, "base") for link in reversed(self.children.get(None, []))]
        first = None if self.alias is None else self.frames[self.alias]
        while starts:
            link, parent = starts.pop()
            sides = self._chain(link, parent, first)
            starts += reversed(sides)
            first = None
        if first is not None:
            self.chains.append(Chain(first, tuple(rows_of((), np.eye(4), first, None, ()))))
        given = self.contacts if contacts is None else contacts
        return self.tree.name, (*self.chains, *self.hung), tuple(given), self.tree.base_body

    def _chain(self, link: Link, parent: str, alias: str | None) -> list[tuple[Link, str]]:
        """Add the chain that starts with a link; returns links that start chains from its frames."""
        rows = [] if alias is None else rows_of((), np.eye(4), alias, None, ())
        sides: list[tuple[Link, str]] = []
        following: Link | None = link
        while following is not None:
            link, frame = following, self.frames[following.name]
            inner = [self._free(f"{frame}.row{k + 1}") for k in range(most_rows(link.screws))]
            rows += rows_of(link.screws, link.after, frame, link.body, inner)
            for shape in link.shapes:
                self._touch(shape, frame)
            below = self.children.get(link.name, [])
            following = max(below, key=lambda child: self.weight[child.name]) if below else None
            sides += [(child, frame) for child in below if child is not following]
        self.chains.append(Chain(frame, tuple(rows), parent))
        return sides

    def _weights(self) -> Mapping[str, tuple[int, int]]:
        """For every link how many joints and how many links move with it."""
        weight = {link.name: (len(link.screws), 1) for link in self.tree.links}
        for link in reversed(self.tree.links):
            if link.parent in weight:
                (joints, links), (more, others) = weight[link.parent], weight[link.name]
                weight[link.parent] = (joints + more, links + others)
        return weight

    def _touch(self, shape: Shape, frame: str) -> None:
        """Add a shape on a frame, with a frame of its own where it is turned against that of its link."""
        if not self.shapes:
            return
        contact, turned = contact_of(shape, frame)
        if turned is not None:
            own = self._free(f"{shape.name}.frame")
            inner = [self._free(f"{own}.row{k + 1}") for k in range(most_rows(()))]
            self.hung.append(Chain(own, tuple(rows_of((), turned, own, None, inner)), frame))
            contact = replace(contact, frame=own)
        self.contacts.append(contact)

    def _allowed(self, name: str) -> str:
        """The frame of a link; one whose name is the robot's own, or has a slash in it, gets another."""
        out = name.replace("/", ".")
        return name if out == name and name not in RESERVED else self._free(f"{out}.link" if name in RESERVED else out)

    def _free(self, name: str) -> str:
        while name in self.taken:
            name += "~"
        self.taken.add(name)
        return name


def unique(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """The names, with a number behind each that came before."""
    seen, out = set(taken), []
    for name in names:
        new, k = name, 1
        while new in seen:
            k += 1
            new = f"{name}.{k}"
        seen.add(new)
        out.append(new)
    return out
