"""A tree of links cut down to the ways to some of them; what is fixed elsewhere becomes part of what carries it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Body
from bodyplan.robot.reading.shapes import Shape
from bodyplan.robot.reading.tree import Link, Tree


@dataclass
class _Part:
    """What a link that stays carries in the end."""

    body: Body | None
    shapes: tuple[Shape, ...]


def pruned(tree: Tree, ends: Iterable[str]) -> Tree:
    """The tree with the links on the ways from the base to ``ends`` alone; other links, all fixed, are merged into the
    link that carries them, with their masses and shapes, and so is what is fixed on the base, unless it is an end:
    what moves on it begins at the base. Raises UnknownNameError for an end that is no link, InputError
    where a joint moves a link that would go."""
    links = {link.name: link for link in tree.links}
    kept: set[str | None] = {None, tree.base}
    named = tuple(ends)
    for end in named:
        if end not in links and end != tree.base:
            raise UnknownNameError("link", end, links, where="ends")
        at: str | None = end
        while at is not None and at not in kept:
            kept.add(at)
            at = links[at].parent
    parts: dict[str | None, _Part] = {tree.base: _Part(tree.base_body, tree.base_shapes), None: _Part(None, ())}
    # for every link that goes, what carries it and where it is on that
    carried: dict[str, tuple[str | None, Array]] = {}
    left: list[Link] = []
    for link in tree.links:
        carrier, place = carried.get(link.parent or "", (link.parent, np.eye(4)))
        on_base = carrier in (None, tree.base) and not link.screws
        if link.name in kept and (link.name in named or not on_base):
            parts[link.name] = _Part(link.body, link.shapes)
            left.append(_moved(link, carrier, place))
            continue
        if link.screws:
            moving = link.screws[0].drive.name
            raise InputError(f"ends: joint {moving!r} moves link {link.name!r}, on the way to no end; name it as well.")
        place = place @ link.after
        carried[link.name] = carrier, place
        part = parts[carrier]
        if link.body is not None:
            part.body = joined(part.body, link.body, place)
        part.shapes += tuple(replace(shape, place=place @ shape.place) for shape in link.shapes)
    links_left = tuple(replace(x, body=parts[x.name].body, shapes=parts[x.name].shapes) for x in left)
    base = parts[tree.base]
    return replace(tree, links=links_left, base_body=base.body, base_shapes=base.shapes)


def joined(one: Body | None, other: Body, place: Array) -> Body:
    """One body for two, the other at ``place`` (4, 4); an inertia that is not known counts as that of a point."""
    centre = place[:3, :3] @ np.array(other.com or (0.0, 0.0, 0.0)) + place[:3, 3]
    parts = [(other.mass, centre, place[:3, :3] @ _tensor(other) @ place[:3, :3].T)]
    if one is not None:
        parts.append((one.mass, np.array(one.com or (0.0, 0.0, 0.0)), _tensor(one)))
    mass = sum(m for m, _, _ in parts)
    com = np.sum([m * c for m, c, _ in parts], axis=0) / mass
    whole = np.zeros((3, 3))
    for m, c, moment in parts:
        whole += moment + m * ((c - com) @ (c - com) * np.eye(3) - np.outer(c - com, c - com))
    x, y, z = com.tolist()
    xx, yy, zz = np.diag(whole).tolist()
    inertia = (xx, yy, zz, float(whole[0, 1]), float(whole[0, 2]), float(whole[1, 2]))
    return Body(mass=mass, com=(x, y, z), inertia=inertia if whole.any() else None)


def _tensor(body: Body) -> Array:
    xx, yy, zz, xy, xz, yz = body.inertia or (0.0,) * 6
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _moved(link: Link, carrier: str | None, place: Array) -> Link:
    """The link on ``carrier``, where its parent is at ``place``."""
    if not link.screws:
        return replace(link, parent=carrier, after=place @ link.after)
    first = replace(link.screws[0], before=place @ link.screws[0].before)
    return replace(link, parent=carrier, screws=(first, *link.screws[1:]))
