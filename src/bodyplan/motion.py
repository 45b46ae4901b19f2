"""Motion: what every planner returns and everything downstream takes; and the claims that it makes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module  # the writers live on a higher floor and are looked up by name
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, TextArray, finite, frozen
from bodyplan.errors import InputError, SolveError, Status, UnknownNameError
from bodyplan.ground.base import Ground
from bodyplan.robot.model import Robot


@dataclass(frozen=True)
class Claim:
    """A statement of the planner that the judge tests from forward kinematics and ground alone.

    ``kind`` names the test in ``bodyplan.check``; ``data`` holds what it needs: numbers, texts, lists or
    arrays (JSON types and float arrays). ``label`` is how the report names it. Kinds in use:

    * ``at_rest``: frames ``frames`` do not move from ``start`` to ``end`` (s); ``stage`` names the phase;
      ``tolerance`` m.
    * ``on_curve``: origins of ``frames`` lie on a body curve from ``start`` to ``end``; ``curve`` is its
      name in ``bodyplan.curves``, ``parameters`` arrays with one entry a sample, ``unit`` m per curve unit,
      ``pose`` (T, 3) x, y, heading of the curve in the world, ``tolerance`` m.
    * ``periodic``: after ``period`` s the joints repeat and the base is displaced: a point p of it goes to
      R(``turn``) p + ``advance`` (3,) m; ``turn`` rad about the world's z, or a rotation vector (3,);
      ``from_rest``: true where every cycle begins and ends at rest.
    * ``follows``: origins of ``frames`` (F,) stay within ``tolerance`` m of a curve in space: that of
      frame f at sample k lies at arc length ``places`` (T, F) m of ``curve`` (a table for
      :func:`bodyplan.curves.from_dict`), whose frame at s = 0 lies at ``pose`` (7,), or (T, 7).
    * ``no_slip``: origins of ``frames``, in order along the body, move along the body with ``speed`` (T,)
      m/s; the rest (root mean square) is at most the share ``tolerance`` of it.
    * ``grips``: points of the surface that come within ``height`` m of the floor, or of ``pole`` (a table of
      ``point``, ``direction`` (3,) and ``radius``), are at rest: their mean speed is at most the share
      ``tolerance`` of ``speed`` m/s. ``contacts``: names, all where there are none.
    * ``on_floor``: every capsule and sphere touches the floor all the time, to ``tolerance`` m.
    * ``supported``: the centre of mass stays between the lowest points of the contacts that carry load
      (``Motion.contacts``), by at least ``required`` m: seen along the unit vector ``along`` (3,), or without one
      inside their hull seen from above; from ``start`` to ``end`` s where they are given.
    * ``lifted``: between ``start`` and ``end`` (s), and again every ``every`` s (None: once), each of ``frames`` rises
      to ``height`` m above the higher of its places at both; ``stage`` names the phase; ``tolerance`` m.
    * ``rim_touches``: every rim of ``contacts`` (names) touches the ground, to ``tolerance`` m, and is nowhere below
      it, at the ``samples`` given (indices; all where there are none).
    * ``rolls``: where the rims of ``contacts`` touch they slip along their way at most the share ``tolerance`` of the
      speed of their hubs, in 95 % of the samples.
    * ``clears``: the boxes of ``contacts`` keep ``required`` m from the ground, at the ``samples`` given.
    * ``holds``: the ``forces`` of the motion on the rims of ``contacts``, where they touch, and the weight are in
      balance, but for the share ``tolerance`` of the weight; at the ``samples`` given.
    * ``grips_ground``: these forces push and stay within cones of ``friction`` (k,) + ``tolerance``.
    * ``bears``: ``torques`` of the wheels' motors are those of virtual work under these forces.
    * ``presses``: contacts press on ground of ``role`` by at most ``depth`` m (planned overlap that makes grip).
    """

    kind: str
    label: str
    data: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "data", {k: _settle(v) for k, v in self.data.items()})

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Claim)
            and (self.kind, self.label, self.data.keys()) == (other.kind, other.label, other.data.keys())
            and all(_same(self.data[k], other.data[k]) for k in self.data)
        )

    def __hash__(self) -> int:
        return hash((self.kind, self.label))


@dataclass(frozen=True, eq=False)
class Motion:
    """A planned motion of one robot on one ground. All arrays are read-only.

    ``t`` (T,) s, strictly increasing. ``base`` (T, 7) pose of the base: position m, quaternion wxyz,
    world_from_base. ``q``, ``qd``, ``qdd`` (T, n) joint coordinates and derivatives, columns as
    ``robot.joints``. ``contacts`` (T, c) True where the planner means contact c of ``robot.contacts`` to
    carry load, or None. ``forces`` (T, c, 3) N and ``torques`` (T, n) N m where the gait gives them.
    ``residual`` (T,) largest error of the planner's own equations; ``status`` (T,) a
    :class:`bodyplan.Status` text a sample. ``facts``: named numbers of the plan (SI; the key says the unit
    where it is not plain). ``stages``: (name, start, end) in s. ``notes``: corrections and remarks to show.
    """

    robot: Robot
    ground: Ground
    gait: Mapping[str, Any]
    t: Array
    base: Array
    q: Array
    qd: Array
    qdd: Array
    residual: Array
    status: TextArray
    claims: tuple[Claim, ...] = ()
    contacts: Array | None = None
    forces: Array | None = None
    torques: Array | None = None
    facts: Mapping[str, float] = field(default_factory=dict)
    stages: tuple[tuple[str, float, float], ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        t = finite(self.t, "Motion.t", (None,))
        if len(t) < 2 or np.any(np.diff(t) <= 0.0):
            raise InputError("Motion.t: needs at least two times, strictly increasing.")
        size, n = len(t), self.robot.n
        shapes: dict[str, tuple[int, ...]] = {
            "t": (size,),
            "base": (size, 7),
            "q": (size, n),
            "qd": (size, n),
            "qdd": (size, n),
            "residual": (size,),
        }
        c = len(self.robot.contacts)
        for name, optional_shape in (("contacts", (size, c)), ("forces", (size, c, 3)), ("torques", (size, n))):
            if getattr(self, name) is not None:
                shapes[name] = optional_shape
        for name, shape in shapes.items():
            object.__setattr__(self, name, frozen(finite(getattr(self, name), f"Motion.{name}", shape)))
        status = np.array(self.status, dtype="U24")
        if status.shape != (size,):
            raise InputError(f"Motion.status: expected shape ({size},), got {status.shape}.")
        status.flags.writeable = False
        object.__setattr__(self, "status", status)
        norms = np.linalg.norm(self.base[:, 3:], axis=1)
        if np.any(np.abs(norms - 1.0) > 1e-9):
            raise InputError("Motion.base: quaternions must have length 1.")
        object.__setattr__(self, "claims", tuple(self.claims))
        object.__setattr__(self, "stages", tuple((str(a), float(b), float(c)) for a, b, c in self.stages))
        object.__setattr__(self, "notes", tuple(self.notes))
        object.__setattr__(self, "facts", {k: float(v) for k, v in self.facts.items()})

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the columns of ``q``."""
        return self.robot.joints

    @property
    def ok(self) -> bool:
        """True where every sample was solved."""
        return bool(np.all(self.status == Status.OK.value))

    def joint(self, name: str) -> Array:
        """The column of ``q`` of one joint, (T,)."""
        if name not in self.robot.joints:
            raise UnknownNameError("joint", name, self.robot.joints)
        return self.q[:, self.robot.joints.index(name)]

    def raise_if_failed(self) -> Motion:
        """This motion, or SolveError naming the first sample that was not solved, and of joints beyond their limits the
        farthest one."""
        bad = np.flatnonzero(self.status != Status.OK.value)
        if len(bad):
            i = int(bad[0])
            said = f"at t = {self.t[i]:.6g} s ({len(bad)} of {len(self.t)} samples){self.beyond_limits(bad)}"
            raise SolveError(str(self.status[i]), said, i)
        return self

    def beyond_limits(self, samples: IntArray) -> str:
        """In words which joint is farthest beyond its limits, by how much (rad or m) and when, at those of some
        ``samples`` (k,) whose status says "limit"; "" where there are none."""
        rows = samples[self.status[samples] == Status.LIMIT.value]
        low, high = self.robot.limits.T
        beyond = np.maximum(low - self.q[rows], self.q[rows] - high)
        if not beyond.size or not beyond.max() > 0.0:
            return ""
        row, column = (int(k) for k in np.unravel_index(beyond.argmax(), beyond.shape))
        by, when = beyond[row, column], self.t[rows[row]]
        return f"; the farthest joint beyond its limits is {self.robot.joints[column]!r}, by {by:.4g} at {when:.4g} s"

    def replace(self, **changes: Any) -> Motion:
        """A copy with some fields changed (and checked again)."""
        return replace(self, **changes)

    def poses(self) -> Any:
        """Poses of every frame at every sample: ``robot.forward(q, base)``."""
        return self.robot.forward(self.q, self.base)

    def save(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Write the motion in the format of the path's suffix and return the path: ``.npz`` (everything), ``.csv``,
        ``.yaml`` (ROS 2 JointTrajectory), ``.mcap`` (ROS 2 log), ``.glb`` (animated 3D scene), ``.xml`` (MJCF),
        ``.h`` (C99 trajectory), ``.c`` (C99 kinematics), ...: all of ``bodyplan.export.FORMATS``, with the ``options``
        of its writer. Errors as of :func:`bodyplan.save`."""
        saved: Path = import_module("bodyplan.export").save(self, path, **options)
        return saved

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Motion:
        """The motion in an ``.npz`` file written by :meth:`save`; equal to the one saved."""
        loaded: Motion = import_module("bodyplan.export").load(path)
        return loaded

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Motion):
            return NotImplemented
        plain = ("robot", "ground", "gait", "claims", "facts", "stages", "notes")
        arrays = ("t", "base", "q", "qd", "qdd", "residual", "status", "contacts", "forces", "torques")
        return all(getattr(self, f) == getattr(other, f) for f in plain) and all(
            _same(getattr(self, f), getattr(other, f)) for f in arrays
        )

    __hash__ = None  # type: ignore[assignment]


#: most samples that :func:`times` makes: a mistyped dt should not eat the machine
MOST_TIMES = 10_000_000


def times(start: float, stop: float, dt: float) -> Array:
    """Evenly spaced times from ``start`` to ``stop`` s, both included; the step is the largest that is
    <= ``dt`` (s) and divides the interval."""
    from bodyplan.arrays import number

    number(start, "start")
    number(stop, "stop", above=start)
    number(dt, "dt", above=0.0)
    if (stop - start) / dt > MOST_TIMES:
        raise InputError(f"dt: {(stop - start) / dt:.3g} samples are more than the {MOST_TIMES} allowed.")
    steps = max(1, int(np.ceil((stop - start) / dt * (1.0 - 1e-12))))
    return np.linspace(start, stop, steps + 1)


def _settle(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return frozen(value)
    if isinstance(value, Mapping):
        return {str(k): _settle(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_settle(v) for v in value]
    if isinstance(value, np.generic):
        return value.item()
    return value


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return a is not None and b is not None and np.array_equal(_array(a), _array(b))
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    return bool(a == b)


def _array(a: ArrayLike) -> Any:
    return np.asarray(a)
