"""What a robot is made of: joints, the drives that use them, D-H rows, arc segments, contacts.

A chain is a sequence of two kinds of element:

* a :class:`Row` of the extended D-H table (paper *legs*, eqs. (1)-(3), standard/distal form):
  ``T = Rz(theta) Tz(d) Tx(a) Rx(epsilon)`` maps the new frame to the previous one;
* an :class:`Arc` (paper *acm*): a segment of constant curvature and no torsion that leaves along x
  and bends by ``pitch`` about y and ``yaw`` about z, in total over its length.

Each variable of an element (theta, d, a, epsilon; pitch, yaw) is a constant or a **drive** of one
named joint coordinate.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.errors import InputError

COS_30 = math.sqrt(0.75)


def _named(value: object, field: str) -> str:
    if not isinstance(value, str) or not value or value != value.strip() or any(c in value for c in "\n\t,/\"'"):
        raise InputError(
            f"{field}: a name must be a non-empty text without spaces around it, commas, quotes or "
            f"slashes, got {value!r}."
        )
    return value


def _interval(value: Any, field: str) -> tuple[float, float] | None:
    if value is None:
        return None
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low, high = 1.0, 0.0
    if not low < high:
        raise InputError(f"{field}: must be (low, high) with low < high, got {value!r}.")
    return low, high


@dataclass(frozen=True)
class Joint:
    """A named joint coordinate driving a variable as ``offset + scale * q``.

    The same name may drive several variables (the two axes of a double joint take half each:
    :meth:`share`). Properties of the joint itself need be given only once.

    ``limits``: (low, high) of q in rad, or m for a joint that drives a length. ``rate``: largest |dq/dt|.
    ``effort``: largest actuator torque (N m) or force (N). ``actuated``: False for a passive joint.
    Raises InputError for a non-finite number, a zero scale, reversed limits.
    """

    name: str
    offset: float = 0.0
    scale: float = 1.0
    limits: tuple[float, float] | None = None
    rate: float | None = None
    effort: float | None = None
    actuated: bool = True

    def __post_init__(self) -> None:
        _named(self.name, "Joint.name")
        where = f"Joint({self.name!r})"
        number(self.offset, f"{where}.offset")
        if number(self.scale, f"{where}.scale") == 0.0:
            raise InputError(f"{where}.scale: must not be 0, the joint would drive nothing.")
        object.__setattr__(self, "limits", _interval(self.limits, f"{where}.limits"))
        for field in ("rate", "effort"):
            if getattr(self, field) is not None:
                number(getattr(self, field), f"{where}.{field}", above=0.0)

    def share(self, fraction: float) -> Joint:
        """The same joint driving with ``fraction`` of its motion (0.5: half of a double joint)."""
        return Joint(
            self.name,
            self.offset * fraction,
            self.scale * fraction,
            self.limits,
            self.rate,
            self.effort,
            self.actuated,
        )


@dataclass(frozen=True)
class WheelRadius:
    """Radius law of a three-legged wheel (paper *wheels*, eq. (1)): ``link cos(q/2) cos(30 deg) + rubber``.

    ``joint`` is the adjusting angle q (rad, in [0, pi] unless the joint has limits), ``link`` the leg
    length w and ``rubber`` the tread thickness R_ru in m. May drive a length (``d`` or ``a``) only.
    """

    joint: Joint
    link: float
    rubber: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.joint, Joint):
            raise InputError(f"WheelRadius.joint: expected a Joint, got {self.joint!r}.")
        if (self.joint.offset, self.joint.scale) != (0.0, 1.0):
            raise InputError("WheelRadius.joint: offset must be 0 and scale 1, the law takes the angle itself.")
        number(self.link, "WheelRadius.link", above=0.0)
        number(self.rubber, "WheelRadius.rubber", at_least=0.0)

    @property
    def largest(self) -> float:
        """Radius at q = 0, m."""
        return self.link * COS_30 + self.rubber

    def radius(self, q: ArrayLike) -> Array:
        """Radius (...,) m at q (...,) rad."""
        return np.asarray(self.rubber + self.link * COS_30 * np.cos(0.5 * np.asarray(q)))

    def slope(self, q: ArrayLike) -> Array:
        """dR/dq (...,) m/rad (paper *wheels*, eq. (33))."""
        return np.asarray(-0.5 * self.link * COS_30 * np.sin(0.5 * np.asarray(q)))


Drive = Joint | WheelRadius
Variable = float | Drive


def joint_of(drive: Drive) -> Joint:
    """The joint behind a drive."""
    return drive.joint if isinstance(drive, WheelRadius) else drive


@dataclass(frozen=True, kw_only=True)
class Body:
    """Mass carried by a frame: ``mass`` kg at ``com`` (3,) m in that frame.

    ``inertia``: (6,) kg m^2 about ``com`` in frame axes: xx, yy, zz, xy, xz, yz. None: that of the
    contact shapes on the frame, or of a thin rod back to the previous frame.
    """

    mass: float
    com: tuple[float, float, float] | None = None
    inertia: tuple[float, float, float, float, float, float] | None = None

    def __post_init__(self) -> None:
        number(self.mass, "Body.mass", above=0.0)
        for field, size in (("com", 3), ("inertia", 6)):
            value = getattr(self, field)
            if value is not None:
                checked = finite(value, f"Body.{field}", (size,))
                object.__setattr__(self, field, tuple(float(x) for x in checked))

    @classmethod
    def rod(cls, mass: float, length: float, radius: float) -> Body:
        """A solid cylinder of ``radius`` m along x, from ``length`` m behind the frame's origin up to it."""
        across = mass * (3.0 * radius**2 + length**2) / 12.0
        inertia = (0.5 * mass * radius**2, across, across, 0.0, 0.0, 0.0)
        return cls(mass=mass, com=(-0.5 * length, 0.0, 0.0), inertia=inertia)


def _variable(value: Any, field: str) -> Variable:
    if isinstance(value, (Joint, WheelRadius)):
        return value
    return number(value, field)


@dataclass(frozen=True)
class Row:
    """One row of the extended D-H table: theta (rad), d (m), a (m), epsilon (rad); each constant or driven.

    ``name`` names the frame the row ends in (default: ``chain.number``). ``body`` is the mass rigidly
    attached to that frame. Raises InputError for a non-finite number or a length that is negative where
    only its size matters (``a`` may be negative: it is a coordinate).
    """

    theta: Variable = 0.0
    d: Variable = 0.0
    a: Variable = 0.0
    epsilon: Variable = 0.0
    name: str | None = None
    body: Body | None = None

    ANGLES: ClassVar[tuple[str, ...]] = ("theta", "epsilon")
    VARIABLES: ClassVar[tuple[str, ...]] = ("theta", "d", "a", "epsilon")

    def __post_init__(self) -> None:
        _check_element(self, "Row")


@dataclass(frozen=True)
class Arc:
    """A segment of ``length`` m with constant curvature and no torsion (paper *acm*, section III).

    Its tangent turns by the rotation vector (0, pitch, yaw) rad from start to end: positive yaw turns
    left (about e_y, z), positive pitch is a right-handed turn about e_p (y), nose down for x forward and
    z up, as in eq. (1) of the paper. The frame at the end is the parallel-transported one.
    """

    length: float
    pitch: Variable = 0.0
    yaw: Variable = 0.0
    name: str | None = None
    body: Body | None = None

    ANGLES: ClassVar[tuple[str, ...]] = ("pitch", "yaw")
    VARIABLES: ClassVar[tuple[str, ...]] = ("pitch", "yaw")

    def __post_init__(self) -> None:
        number(self.length, "Arc.length", above=0.0)
        _check_element(self, "Arc")


Element = Row | Arc


def _check_element(element: Element, kind: str) -> None:
    label = f"{kind}({element.name!r})" if element.name is not None else kind
    if element.name is not None:
        _named(element.name, f"{kind}.name")
    if element.body is not None and not isinstance(element.body, Body):
        raise InputError(f"{label}.body: expected a Body, got {element.body!r}.")
    for field in element.VARIABLES:
        value = _variable(getattr(element, field), f"{label}.{field}")
        object.__setattr__(element, field, value)
        if isinstance(value, WheelRadius) and field in element.ANGLES:
            raise InputError(f"{label}.{field}: a wheel radius is a length and cannot drive an angle.")


@dataclass(frozen=True)
class Chain:
    """A named sequence of elements from frame ``parent`` on: ``"base"`` or a frame of an earlier chain."""

    name: str
    elements: tuple[Element, ...]
    parent: str = "base"

    def __post_init__(self) -> None:
        _named(self.name, "Chain.name")
        _named(self.parent, f"chain {self.name!r}.parent")
        if isinstance(self.elements, (Row, Arc)) or not isinstance(self.elements, Iterable):
            raise InputError(f"chain {self.name!r}: expected a sequence of elements, got {self.elements!r}.")
        object.__setattr__(self, "elements", tuple(self.elements))
        if not self.elements:
            raise InputError(f"chain {self.name!r}: has no rows.")
        for i, element in enumerate(self.elements):
            if not isinstance(element, (Row, Arc)):
                raise InputError(f"chain {self.name!r}, element {i + 1}: expected a Row or an Arc, got {element!r}.")

    def frame_name(self, index: int) -> str:
        """Name of the frame that element ``index`` (from 0) ends in."""
        return self.elements[index].name or f"{self.name}.{index + 1}"


@dataclass(frozen=True)
class Contact:
    """A shape on a frame that may touch the ground: all that checks, forces and physics know of it.

    ``shape``: ``"capsule"`` (from ``start`` to ``end``), ``"sphere"`` (at ``start``), ``"box"``
    (centred at ``start``, ``half`` sizes), ``"rim"`` (circle of ``radius`` about the frame's z at ``start``).
    Points are (3,) m in the frame ``frame``. ``radius`` in m. ``friction``: Coulomb coefficient towards
    ground that names none of its own, or None. ``drive``: the law by which a rim's radius follows a joint; ``radius``
    is then the largest (and need not be given), :func:`bodyplan.robot.rims.contact_radii` has that at a joint angle.
    """

    name: str
    frame: str
    shape: str
    radius: float = 0.0
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    end: tuple[float, float, float] = (0.0, 0.0, 0.0)
    half: tuple[float, float, float] = (0.0, 0.0, 0.0)
    friction: float | None = None
    drive: WheelRadius | None = None

    SHAPES: ClassVar[tuple[str, ...]] = ("capsule", "sphere", "box", "rim")

    def __post_init__(self) -> None:
        where = f"Contact({_named(self.name, 'Contact.name')!r})"
        _named(self.frame, f"{where}.frame")
        if self.shape not in self.SHAPES:
            raise InputError(f"{where}.shape: must be one of {', '.join(self.SHAPES)}, got {self.shape!r}.")
        number(self.radius, f"{where}.radius", at_least=0.0)
        if self.drive is not None:
            self._check_drive(where)
        for field in ("start", "end", "half"):
            point = finite(getattr(self, field), f"{where}.{field}", (3,))
            object.__setattr__(self, field, tuple(float(x) for x in point))
        if self.shape != "box" and self.radius == 0.0:
            raise InputError(f"{where}.radius: must be > 0 for a {self.shape}, got {self.radius!r}.")
        if self.shape == "box" and min(self.half) <= 0.0:
            raise InputError(f"{where}.half: box half sizes must be > 0, got {self.half!r}.")
        if self.friction is not None:
            number(self.friction, f"{where}.friction", at_least=0.0)

    def _check_drive(self, where: str) -> None:
        if not isinstance(self.drive, WheelRadius) or self.shape != "rim":
            raise InputError(f"{where}.drive: must be the WheelRadius of a rim, got {self.drive!r} of a {self.shape}.")
        if self.radius not in (0.0, self.drive.largest):
            largest = self.drive.largest
            raise InputError(f"{where}.radius: a rim with a drive has its largest, {largest!r} m; got {self.radius!r}.")
        object.__setattr__(self, "radius", self.drive.largest)

    def points(self) -> Array:
        """Points of the shape's skeleton in its frame, (p, 3) m: add ``radius`` for its surface."""
        if self.shape == "capsule":
            return frozen([self.start, self.end])
        if self.shape == "box":
            signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, 8).T
            return frozen(np.asarray(self.start) + signs * np.asarray(self.half))
        return frozen([self.start])


def joint_properties(chains: tuple[Chain, ...]) -> Mapping[str, Joint]:
    """Every joint named in the chains, in order of first appearance: chain by chain, element by element,
    variable by variable; offset 0 and scale 1, properties merged over its appearances.

    Raises InputError where two appearances contradict each other, or where one joint drives both an
    angle and a length.
    """
    found: dict[str, Joint] = {}
    kinds: dict[str, str] = {}
    for chain in chains:
        for i, element in enumerate(chain.elements):
            for field in element.VARIABLES:
                value = getattr(element, field)
                if not isinstance(value, (Joint, WheelRadius)):
                    continue
                joint = joint_of(value)
                where = f"chain {chain.name!r}, element {i + 1}, {field}: joint {joint.name!r}"
                kind = "angle" if field in element.ANGLES or isinstance(value, WheelRadius) else "length"
                if kinds.setdefault(joint.name, kind) != kind:
                    raise InputError(f"{where} drives a {kind} here and a {kinds[joint.name]} elsewhere.")
                seen = found.get(joint.name, Joint(joint.name, actuated=joint.actuated))
                if seen.actuated != joint.actuated:
                    raise InputError(f"{where} is actuated in one place and passive in another.")
                merged: dict[str, Any] = {}
                for prop in ("limits", "rate", "effort"):
                    old, new = getattr(seen, prop), getattr(joint, prop)
                    if old is not None and new is not None and old != new:
                        raise InputError(f"{where} has {prop} {new!r} here and {old!r} elsewhere.")
                    merged[prop] = new if old is None else old
                found[joint.name] = Joint(joint.name, actuated=joint.actuated, **merged)
    return found


def joint_kinds(chains: tuple[Chain, ...]) -> dict[str, str]:
    """``"angle"`` or ``"length"`` for every joint name, in the order of :func:`joint_properties`."""
    kinds: dict[str, str] = {}
    for chain in chains:
        for element in chain.elements:
            for field in element.VARIABLES:
                value = getattr(element, field)
                if isinstance(value, (Joint, WheelRadius)):
                    angle = field in element.ANGLES or isinstance(value, WheelRadius)
                    kinds.setdefault(joint_of(value).name, "angle" if angle else "length")
    return kinds
