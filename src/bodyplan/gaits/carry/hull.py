"""Whether the hull of a body touches the ground: boxes fixed to the base against bounds of the height."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.gaits.carry.terrain import Terrain
from bodyplan.robot.elements import Contact
from bodyplan.robot.model import Robot

#: m: a part of a face this small is judged by its middle
SMALL = 1e-4
#: points along each side of a face at which clearances are measured
SIDE = 13
_LEVELS = 40
_CHUNK = 16_384


def boxes(robot: Robot) -> tuple[Contact, ...]:
    """The hull: contacts of shape "box" on the base."""
    return tuple(contact for contact in robot.contacts if contact.shape == "box" and contact.frame == "base")


def touches(robot: Robot, ground: Terrain, position: Array, rotation: Array) -> BoolArray:
    """(n,) True where a box of the hull reaches the ground, for bases at ``position`` (n, 3) m with orientations
    ``rotation`` (n, 3, 3). Parts of a face that bounds of the ground's height clear are dropped, the others cut into
    four; ground that rises less than 0.1 mm into a face may pass."""
    out = np.zeros(len(position), dtype=np.bool_)
    for box in boxes(robot):
        for part in np.array_split(np.arange(len(position)), max(1, -(-len(position) // _CHUNK))):
            near = part[_near(box, ground, position[part], rotation[part])]
            if len(near):
                for axis in range(3):
                    for side in (-1.0, 1.0):
                        out[near] |= _face(box, axis, side, ground, position[near], rotation[near])
    return out


def _near(box: Contact, ground: Terrain, position: Array, rotation: Array) -> BoolArray:
    """(n,) False where the box is above all ground that there is in the region."""
    if not len(position):
        return np.zeros(0, dtype=np.bool_)
    centre = position + rotation @ np.array(box.start)
    size = np.abs(rotation) @ np.array(box.half)
    low, high = (centre - size).min(axis=0), (centre + size).max(axis=0)
    highest, _ = ground.region_bounds(low[:2], high[:2])
    return np.asarray(~(centre[:, 2] - size[:, 2] > highest))


def lower_face(box: Contact) -> Array:
    """Points (p, 3) m of the lower face of a box, in the base."""
    x, y = (v.ravel() for v in np.meshgrid(*(np.linspace(-1.0, 1.0, SIDE) for _ in range(2))))
    return np.asarray(np.array(box.start) + np.stack([x, y, -np.ones_like(x)], axis=1) * np.array(box.half))


def _face(box: Contact, axis: int, side: float, ground: Terrain, position: Array, rotation: Array) -> BoolArray:
    """Of one face; those that look up or aside reach the ground only with one that looks down."""
    owner = np.flatnonzero(side * rotation[:, 2, axis] < -1e-9)
    out = np.zeros(len(position), dtype=np.bool_)
    others = [i for i in range(3) if i != axis]
    half = np.array(box.half)
    offset = np.array(box.start)
    offset[axis] += side * half[axis]
    centre = position[owner] + rotation[owner] @ offset
    spread = rotation[owner][:, :, others] * half[others]  # (k, 3, 2): half edges
    edges = ground.field_box
    with np.errstate(all="ignore"):
        for _ in range(_LEVELS):
            if not len(owner):
                break
            size = np.abs(spread).sum(axis=2)
            low, high = (centre - size)[:, :2], (centre + size)[:, :2]
            bounds = ground.field_bounds(low, high)
            near = ~(bounds.z[1] < centre[:, 2] - size[:, 2]) & ~out[owner]
            near &= np.all((low <= edges[1]) & (high >= edges[0]), axis=1)  # no ground beyond its edges
            owner, centre, spread, size = owner[near], centre[near], spread[near], size[near]
            height, slope, _ = ground.field_jet(centre[:, 0], centre[:, 1])
            here = np.all((centre[:, :2] >= edges[0]) & (centre[:, :2] <= edges[1]), axis=1)
            inside = (height >= centre[:, 2]) & here
            out[owner[inside]] = True
            # bounds of the height do not get narrower within a cell of a map: slope and bounds of the bend do
            bend = np.abs(bounds.hessian[:, near]).max(axis=0)
            falls = np.abs(spread[:, 2] - np.einsum("ki,kij->kj", slope, spread[:, :2])).sum(axis=1)
            falls += 0.5 * np.einsum("ki,kij,kj->k", size[:, :2], bend, size[:, :2])
            keep = ~out[owner] & (size.max(axis=1, initial=0.0) > SMALL) & ~(centre[:, 2] - height > falls)
            owner, centre, spread = owner[keep], centre[keep], 0.5 * spread[keep]
            signs = np.array([[i, j] for i in (-1.0, 1.0) for j in (-1.0, 1.0)])
            centre = (centre[:, None] + np.einsum("kij,sj->ksi", spread, signs)).reshape(-1, 3)
            owner, spread = np.repeat(owner, 4), np.repeat(spread, 4, axis=0)
    return out
