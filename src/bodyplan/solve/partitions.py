"""Known and unknown motions of feet, body and joints: paper *legs* eqs. (15)-(17), by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.model import Robot
from bodyplan.solve.components import Component, Names, further_feet, speaks_of_coordinates
from bodyplan.solve.configuration import Model
from bodyplan.solve.configuration import model as model_of

AXES = ("own", "world")
BODIES = ("twist", "world", "coordinates")


class Partition:
    """The velocity equation split into ``G X = H Y``: unknown rates X on the left, known rates Y on the right.

    Made by :func:`partition`; ``...`` is the batch shape. ``G`` (..., 6m, x) = [Q_u, -I_u, P_u] and ``H`` (..., 6m, y)
    = [I_k, -P_k, -Q_k]: rows and columns of eq. (9) selected, which corrects the block-diagonal (15)-(16) of the paper.

    * ``unknown`` (x names) is the order of X: joints, feet, body; ``known`` (y names) that of Y: feet, body, joints;
      each in the order of the robot. ``unknown_units``, ``known_units``: "m/s" or "rad/s".
    * ``rows`` (6m names): the component of a foot that each equation is about.
    * ``axes`` of the feet and ``body`` as asked for; ``model`` the robot at its configuration.
    """

    def __init__(self, at: Model, names: Names, known: tuple[Component, ...], axes: str, body: str) -> None:
        self.model, self.axes, self.body = at, axes, body
        self.names = names
        chosen = set(known)
        sizes = {kind: range(len(names.of[kind])) for kind in names.of}
        every = {kind: [Component(kind, i) for i in size] for kind, size in sizes.items()}
        self.X = tuple(c for kind in ("joint", "foot", "body") for c in every[kind] if c not in chosen)
        self.Y = tuple(c for kind in ("foot", "body", "joint") for c in every[kind] if c in chosen)
        self.unknown, self.known = (tuple(names.name(c) for c in side) for side in (self.X, self.Y))
        self.unknown_units, self.known_units = (tuple(names.unit(c) for c in side) for side in (self.X, self.Y))
        self.rows = names.of["foot"]
        self._columns = {c: i for i, c in enumerate(self.X)}
        self._places = {c: i for i, c in enumerate(self.Y)}

    @property
    def shape(self) -> tuple[int, ...]:
        """Batch shape."""
        return self.model.shape

    def at(self, q: ArrayLike | Mapping[str, ArrayLike], base: ArrayLike | None = None) -> Partition:
        """The same split at another configuration, without looking up names again: for loops."""
        other = copy(self)
        for name in ("PQ", "body_jacobian", "G", "H"):
            other.__dict__.pop(name, None)
        other.model = self.model.at(q, base)
        return other

    @cached_property
    def PQ(self) -> tuple[Array, Array]:
        """(P (..., 6m, 6), Q (..., 6m, n)) of eq. (9) in the axes of the feet and for the body as asked for."""
        P, Q = self.model.P, self.model.Q
        if self.axes == "world":
            P, Q = (self._turned(M) for M in (P, Q))
        if self.body != "twist":
            P = P @ self.body_jacobian
        return P, Q

    @cached_property
    def body_jacobian(self) -> Array:
        """(..., 6, 6): body-fixed base twist per unit rate of the body's components here."""
        if self.body == "coordinates":
            return self.model.coordinate_jacobian
        if self.body == "twist":
            return np.eye(6)
        back = np.swapaxes(self.model.body_rotation, -1, -2)
        J = np.zeros((*back.shape[:-2], 6, 6))
        J[..., :3, :3] = J[..., 3:, 3:] = back
        return J

    @cached_property
    def G(self) -> Array:
        """(..., 6m, x) = [Q_u, -I_u, P_u]."""
        return self._side(self.X, {"joint": 1.0, "foot": -1.0, "body": 1.0})

    @cached_property
    def H(self) -> Array:
        """(..., 6m, y) = [I_k, -P_k, -Q_k]."""
        return self._side(self.Y, {"foot": 1.0, "body": -1.0, "joint": -1.0})

    def column(self, name: str) -> int:
        """Place of one unknown in X; UnknownNameError for a name that is none."""
        found = self.names.find(name, "unknown")
        if len(found) != 1 or found[0] not in self._columns:
            raise UnknownNameError("unknown", name, self.unknown)
        return self._columns[found[0]]

    def place(self, component: Component) -> tuple[bool, int]:
        """(True, place in X) of an unknown component, (False, place in Y) of a known one."""
        unknown = component in self._columns
        return unknown, (self._columns if unknown else self._places)[component]

    def values(self, Y: ArrayLike | Mapping[str, ArrayLike]) -> Array:
        """Y as an array (..., y): from such an array, in the order of ``known``; or from a mapping from names to rates
        (...), for a group such as "fl.foot.v" to (..., its size) or one number for all.

        InputError for a shape that is wrong, a rate that is missing or not finite; UnknownNameError for a name.
        """
        if not isinstance(Y, Mapping):
            out = finite(Y, "Y")
            if out.ndim == 0 or out.shape[-1] != len(self.Y):
                raise InputError(
                    f"Y: expected shape (..., {len(self.Y)}), one column for each of {_listed(self.known)}; "
                    f"got {out.shape}."
                )
            return out
        columns: dict[int, Array] = {}
        for name, value in Y.items():
            components, rate = self.names.find(name, "Y"), finite(value, f"Y[{name!r}]")
            if len(components) > 1 and rate.ndim and rate.shape[-1] != len(components):
                raise InputError(f"Y[{name!r}]: expected shape (..., {len(components)}), got {rate.shape}.")
            for k, component in enumerate(components):
                if component not in self._places:
                    raise InputError(f"Y: {self.names.name(component)!r} is not known in this partition.")
                at = self._places[component]
                if at in columns:
                    raise InputError(f"Y: {self.known[at]!r} is given twice.")
                columns[at] = rate[..., k] if len(components) > 1 and rate.ndim else rate
        missing = [name for i, name in enumerate(self.known) if i not in columns]
        if missing:
            raise InputError(f"Y: no rate for {_listed(missing)}.")
        try:
            ordered = np.broadcast_arrays(*(columns[i] for i in range(len(self.Y))))
        except ValueError as error:
            raise InputError(f"Y: shapes of the rates do not broadcast: {error}.") from error
        return np.stack(ordered, axis=-1) if ordered else np.zeros((0,))

    def _side(self, components: tuple[Component, ...], sign: Mapping[str, float]) -> Array:
        P, Q = self.PQ
        rows = len(self.rows)
        out = np.zeros((*self.shape, rows, len(components)))
        for kind, full in (("joint", Q), ("body", P), ("foot", None)):
            mine = [i for i, c in enumerate(components) if c.kind == kind]
            index = [components[i].number for i in mine]
            if full is None:
                out[..., index, mine] = sign[kind]
            elif mine:
                out[..., mine] = sign[kind] * full[..., index]
        out.flags.writeable = False
        return out

    def _turned(self, M: Array) -> Array:
        """Rows of body-fixed foot twists -> the same twists in world axes."""
        m = len(self.model.targets)
        R = self.model.rotations[..., :, None, :, :]
        blocks = R @ M.reshape(*M.shape[:-2], m, 2, 3, M.shape[-1])
        return np.asarray(blocks.reshape(*blocks.shape[:-4], 6 * m, M.shape[-1]))

    def __repr__(self) -> str:
        return (
            f"Partition({len(self.rows)} rows, {len(self.X)} unknown, {len(self.Y)} known, axes {self.axes!r}, "
            f"body {self.body!r}, batch {self.shape})"
        )


def partition(
    model: Model | Robot,
    q: ArrayLike | Mapping[str, ArrayLike] | None = None,
    base: ArrayLike | None = None,
    *,
    known: Iterable[str],
    feet: Any = None,
    axes: str = "own",
    body: str | None = None,
) -> Partition:
    """Split the velocity equation (9) of paper *legs* into unknown and known rates, by name.

    ``model``: a :func:`bodyplan.solve.model`, or a robot with ``q`` (..., n), ``base`` (..., 7) and ``feet`` as there.

    ``known``: names of the rates that will be given; all others of the feet, the body and the joints are unknown:

    * feet: "fl.foot.vx", "vy", "vz" m/s, "wx", "wy", "wz" rad/s: velocity of the foot's point, angular velocity of its
      frame. "fl.foot.v" stands for vx, vy, vz, "fl.foot.w" for wx, wy, wz, "fl.foot" for all six. A foot that the model
      does not have yet (any frame or contact) gets six more rows.
    * body: "body.vx" .. "body.wz" for the twist, or "body.x", "y", "z" m/s, "body.roll", "pitch", "yaw" rad/s for rates
      of coordinates (R = Rz Ry Rx); "body" for all six.
    * joints: "fl.knee", rad/s or m/s. (A joint's name counts before a frame's.)

    ``axes`` of the feet: "own", each foot's twist in the axes of that foot, as in P and Q of
    :meth:`Robot.velocity_model` and everywhere in bodyplan; or "world". A foot at rest is at rest in both; the velocity
    of a swing foot is usually meant in the world.

    ``body``: "twist" in its own axes, "world" (velocity of the base's origin and angular velocity, in world axes) or
    "coordinates". When None, "coordinates" if ``known`` names one of them, else "twist".

    Raises InputError for a choice that does not exist, a name used twice, body given as twist and as coordinates;
    UnknownNameError for a name.
    """
    at = _model(model, q, base, feet)
    if isinstance(known, str):
        raise InputError(f"known: expected a sequence of names, got the text {known!r}.")
    names = tuple(known)
    if axes not in AXES:
        raise InputError(f"axes: must be one of {', '.join(AXES)}, got {axes!r}.")
    if body is not None and body not in BODIES:
        raise InputError(f"body: must be one of {', '.join(BODIES)}, got {body!r}.")
    coordinates = speaks_of_coordinates(at.robot, names)
    kind = body or ("coordinates" if coordinates else "twist")
    at = at.with_feet(more) if (more := further_feet(at, names)) else at
    valid = Names(at, kind == "coordinates")
    return Partition(at, valid, valid.flat(names, "known"), axes, kind)


def _model(at: Any, q: Any, base: Any, feet: Any) -> Model:
    if isinstance(at, Model):
        if q is not None or base is not None or feet is not None:
            raise InputError("q, base and feet belong to the model; give them to bodyplan.solve.model.")
        return at
    if not isinstance(at, Robot):
        raise InputError(f"model: expected a Model or a Robot, got {type(at).__name__}.")
    if q is None:
        raise InputError("q: a robot needs joint coordinates.")
    return model_of(at, q, base, feet=feet)


def _listed(names: Iterable[str], most: int = 12) -> str:
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
