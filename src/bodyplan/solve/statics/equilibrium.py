"""Forces and moments on a body at its contacts, in units in which numbers are of the size of one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, BoolArray, finite
from bodyplan.errors import InputError

#: singular values of the equations below this share of the largest are rounding
RANK = 1e-10
#: share of the load that may be left over by rounding
ROUNDING = 1e-11


class Balance(NamedTuple):
    """The equilibrium A x = b of one item: x (3k,) holds (normal, two tangential) components of every contact's force.
    Rows of A (r, 3k) are orthonormal; ``left`` is the share of the load that no forces whatever can hold. Multipliers
    y (r,) of the rows stand for the twist ``axes`` y / ``sizes`` of the body, ``axes`` (6, r) and ``sizes`` (r,)."""

    A: Array
    b: Array
    left: float
    axes: Array
    sizes: Array


class Memory(NamedTuple):
    """Result of an item, apart from the bases it was found in: forces (k, 3) in the world and a twist (6,)."""

    forces: Array
    twist: Array


@dataclass(frozen=True)
class Loads:
    """A batch, flattened to n items of k contacts; ``shape`` is that of the batch.

    ``frames`` (n, k, 3, 3): columns are the normal and two tangents. ``arms`` (n, k, 3): contacts seen from their
    middle, over ``length`` (n,) m. ``load`` (n, 6): force and moment about the middle on the body, over ``force`` (n,)
    N and force times length; without load ``force`` is 0. ``touching`` (n, k).
    """

    shape: tuple[int, ...]
    frames: Array
    arms: Array
    load: Array
    force: Array
    length: Array
    touching: BoolArray

    @property
    def count(self) -> int:
        return len(self.force)

    @property
    def contacts(self) -> int:
        return int(self.arms.shape[1])

    @cached_property
    def equations(self) -> Array:
        """(n, 6, 3k): what unit components of the contact forces add to the force and the moment."""
        turned = np.cross(self.arms[..., :, None, :], np.swapaxes(self.frames, -1, -2))
        rows = np.concatenate([self.frames, np.swapaxes(turned, -1, -2)], axis=-2)
        rows = np.where(self.touching[..., None, None], rows, 0.0)
        return np.moveaxis(rows, 1, 2).reshape(self.count, 6, 3 * self.contacts)

    @cached_property
    def parts(self) -> Parts:
        """Singular parts of the equations."""
        return Parts.of(self.equations)

    def balance(self, i: int) -> Balance:
        """The equations of item i."""
        one = slice(i, i + 1)
        return balances_of(self.equations[one], self.load[one], Parts(*(part[one] for part in self.parts)))[0]

    @cached_property
    def inverse(self) -> Array:
        """(n, 6, 3k): transposed pseudo-inverses of the equations."""
        return self.parts.inverse

    @property
    def smallest(self) -> Array:
        """(n, k, 3): the smallest forces of those that leave least over, pushing or pulling."""
        x = -np.einsum("nij,ni->nj", self.inverse, self.load)
        return np.asarray(x.reshape(self.count, self.contacts, 3))

    def newtons(self, x: Array) -> Array:
        """(n, k, 3) N in the world, of components (n, k, 3)."""
        return np.asarray((self.frames @ x[..., None])[..., 0] * self.force[:, None, None])

    def remember(self, i: int, held: Balance, x: Array, y: Array) -> Memory:
        """Components x (k, 3) and multipliers y of item i, for a similar item."""
        return Memory((self.frames[i] @ x[..., None])[..., 0], held.axes @ (y / held.sizes))

    def recall(self, i: int, held: Balance, memory: Memory) -> tuple[Array, Array]:
        """(x, y) for item i."""
        x = np.einsum("kji,kj->ki", self.frames[i], memory.forces)
        return x, held.sizes * (held.axes.T @ memory.twist)

    def left_over(self, x: Array) -> Array:
        """(n,): the largest entry of force and moment that components (n, k, 3) leave over, as a share of the load."""
        rest = np.einsum("nij,nj->ni", self.equations, x.reshape(self.count, 3 * self.contacts)) + self.load
        return np.asarray(np.abs(rest).max(axis=-1))

    @staticmethod
    def of(
        points: ArrayLike,
        normals: ArrayLike,
        com: ArrayLike,
        weight: ArrayLike,
        wrench: ArrayLike | None,
        touching: ArrayLike | None,
        *others: tuple[str, tuple[int, ...]],
    ) -> Loads:
        """Checked and broadcast, also with batch shapes of ``others`` (name, shape)."""
        touch = None if touching is None else _touching(touching)
        p, out = _points(points, "points", touch), _points(normals, "normals", touch)
        middle, force = _vectors(com, "com", 3), _weight(weight)
        extra = np.zeros(6) if wrench is None else _vectors(wrench, "wrench", 6)
        k = p.shape[-2]
        if k == 0:
            raise InputError("points: expected at least one contact, got none.")
        for name, size in [("normals", out.shape[-2]), ("touching", k if touch is None else touch.shape[-1])]:
            if size != k:
                raise InputError(f"{name}: {k} points have {size} {name}.")
        batches = {
            "points": p.shape[:-2],
            "normals": out.shape[:-2],
            "com": middle.shape[:-1],
            "weight": force.shape[:-1],
            "wrench": extra.shape[:-1],
            "touching": () if touch is None else touch.shape[:-1],
        } | dict(others)
        shape = batch_shape(batches)
        flat_p, flat_n = (np.broadcast_to(a, (*shape, k, 3)).reshape(-1, k, 3) for a in (p, out))
        flat_c, flat_f = (np.broadcast_to(a, (*shape, 3)).reshape(-1, 3) for a in (middle, force))
        flat_w = np.broadcast_to(extra, (*shape, 6)).reshape(-1, 6)
        on = np.ones((len(flat_c), k), dtype=bool)
        if touch is not None:
            on = np.broadcast_to(touch, (*shape, k)).reshape(-1, k).copy()
        return _scaled(shape, flat_p, flat_n, flat_c, flat_f, flat_w, on)


def _scaled(
    shape: tuple[int, ...], points: Array, normals: Array, com: Array, weight: Array, wrench: Array, on: BoolArray
) -> Loads:
    length = np.linalg.norm(normals, axis=-1)
    zero = on & (length == 0.0)
    if zero.any():
        item, contact = (int(i) for i in np.argwhere(zero)[0])
        where = tuple(int(i) for i in np.unravel_index(item, shape)) if shape else ()
        raise InputError(f"normals: the normal at {(*where, contact)} is zero; every normal needs a direction.")
    unit = np.where(on[..., None], normals, [0.0, 0.0, 1.0]) / np.where(on, length, 1.0)[..., None]
    # the middle of the contacts that touch, by steps from the centre of mass: exact far from the world's origin
    arms = np.where(on[..., None], points - com[:, None], 0.0)
    middle = arms.sum(axis=1) / np.maximum(on.sum(axis=1), 1)[:, None]
    arms = np.where(on[..., None], arms - middle[:, None], 0.0)
    size = np.maximum(np.linalg.norm(arms, axis=-1).max(axis=1), np.linalg.norm(middle, axis=-1))
    size = np.where(size > 0.0, size, 1.0)
    force = weight + wrench[:, :3]
    moment = (wrench[:, 3:] - np.cross(middle, force)) / size[:, None]
    unit_force = np.linalg.norm(np.concatenate([force, moment], axis=1), axis=1)
    # what the parts of the load add up from may be larger than the load: rounding of it is not a load
    parts = np.linalg.norm(weight, axis=1) + np.linalg.norm(wrench[:, :3], axis=1)
    parts += np.linalg.norm(wrench[:, 3:], axis=1) / size
    unit_force = np.where(unit_force > 1e-15 * parts, unit_force, 0.0)
    load = np.concatenate([force, moment], axis=1) / np.where(unit_force > 0.0, unit_force, 1.0)[:, None]
    return Loads(
        shape,
        frames_of(unit),
        arms / size[:, None, None],
        np.where(unit_force[:, None] > 0.0, load, 0.0),
        unit_force,
        size,
        on,
    )


def frames_of(normals: Array) -> Array:
    """(..., 3, 3) with the columns normal, tangent, tangent, right-handed and orthonormal."""
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=-1)]
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=-1)


def balance(equations: Array, load: Array) -> Balance:
    """Orthonormal equations of one item, without those that say the same twice: equations (6, 3k), load (6,)."""
    return balances_of(equations[None], load[None])[0]


class Parts(NamedTuple):
    """Singular parts of the equations of n items: U (n, 6, m), s (n, m), V (n, m, 3k)."""

    U: Array
    s: Array
    V: Array

    @staticmethod
    def of(equations: Array) -> Parts:
        """Of equations (n, 6, 3k)."""
        return Parts(*np.linalg.svd(equations, full_matrices=False))

    @property
    def counts(self) -> BoolArray:
        """(n, m): which of them are more than rounding."""
        return np.asarray(self.s > RANK * self.s.max(axis=1, keepdims=True, initial=0.0))

    @property
    def inverse(self) -> Array:
        """(n, 6, 3k): transposed pseudo-inverses of the equations."""
        share = np.where(self.counts, 1.0 / np.where(self.counts, self.s, 1.0), 0.0)
        return np.asarray((self.U * share[:, None]) @ self.V)


def balances_of(equations: Array, load: Array, parts: Parts | None = None) -> list[Balance]:
    """:func:`balance` of n items: equations (n, 6, 3k), load (n, 6); ``parts`` of the equations, if they are known."""
    parts = Parts.of(equations) if parts is None else parts
    U, s, V = parts
    turned = np.einsum("nij,ni->nj", U, -load)
    out = []
    for i, rank in enumerate(parts.counts.sum(axis=1).tolist()):
        left = float(np.linalg.norm(load[i] + U[i, :, :rank] @ turned[i, :rank]))
        out.append(Balance(V[i, :rank], turned[i, :rank] / s[i, :rank], left, U[i, :, :rank], s[i, :rank]))
    return out


# --- checked input ------------------------------------------------------------------------------------------


def batch_shape(batches: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The common batch shape, or InputError with the one that does not fit."""
    shape: tuple[int, ...] = ()
    for name, other in batches.items():
        try:
            shape = np.broadcast_shapes(shape, other)
        except ValueError as error:
            raise InputError(f"{name}: batch shape {other} does not broadcast with {shape}.") from error
    return shape


def friction(mu: ArrayLike, k: int, field: str = "mu") -> Array:
    """Coefficients (..., k), all >= 0."""
    given = finite(mu, field)
    if given.ndim and given.shape[-1] not in (1, k):
        raise InputError(f"{field}: expected one number or (..., {k}), one for each contact, got shape {given.shape}.")
    bad = given < 0.0
    if bad.any():
        raise InputError(f"{field}: must be >= 0, got {given[bad].flat[0]}.")
    return np.broadcast_to(given, (*given.shape[:-1], k))


def _vectors(values: ArrayLike, field: str, size: int) -> Array:
    out = finite(values, field)
    if out.ndim == 0 or out.shape[-1] != size:
        raise InputError(f"{field}: expected shape (..., {size}), got {out.shape}.")
    return out


def _touching(touching: ArrayLike) -> BoolArray:
    out = np.asarray(touching)
    if out.dtype != np.bool_ or out.ndim == 0:
        raise InputError(f"touching: expected True or False for each contact, (..., k), got {touching!r}.")
    return out


def _points(values: ArrayLike, field: str, touching: BoolArray | None) -> Array:
    """(..., k, 3), those that do not touch 0 whatever they were."""
    if touching is not None:
        try:
            given = np.asarray(values, dtype=np.float64)
            values = np.where(touching[..., None], given, 0.0)
        except (TypeError, ValueError) as error:
            raise InputError(f"{field}: expected numbers (..., k, 3) that go with touching.") from error
    out = finite(values, field)
    if out.ndim < 2 or out.shape[-1] != 3:
        raise InputError(f"{field}: expected shape (..., k, 3), got {out.shape}.")
    return out


def _weight(weight: ArrayLike) -> Array:
    """(..., 3) N."""
    given = finite(weight, "weight")
    if given.ndim == 0:
        if given < 0.0:
            raise InputError(f"weight: newtons downwards, must be >= 0, got {given}; a force is (x, y, z).")
        return np.array([0.0, 0.0, -float(given)])
    if given.shape[-1] != 3:
        raise InputError(f"weight: expected newtons downwards, one number, or a force (..., 3), got {given.shape}.")
    return given
