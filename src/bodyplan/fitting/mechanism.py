"""A robot of one chain as a mechanism that follows a curve: where along the body it bends, and about which axes.

Everything is read off the chain at q = 0, where it must lie straight along x: turning axes as lines in space, arcs as
stretches of the body. No robot is known by name.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bodyplan.arrays import Array, IntArray, frozen
from bodyplan.errors import InputError
from bodyplan.robot.elements import Arc, Element, Joint
from bodyplan.robot.model import Robot
from bodyplan.robot.rows import row_transform

PITCH, YAW = 0, 1
AXIS_NAMES = ("pitch", "yaw")
#: how far from straight, from an axis or from a common place still counts as rounding (relative to the length)
SLACK = 1e-9


class Segment(NamedTuple):
    """A stretch of the body between the origins of frames ``first`` and ``first + 1``, from ``start`` to ``end`` m."""

    first: int
    start: float
    end: float
    arc: bool


class _Drive(NamedTuple):
    """One use of a joint coordinate: it bends by ``gain`` rad per rad about ``axis`` from ``start`` to ``end`` m."""

    joint: str
    axis: int
    gain: float
    start: float
    end: float


@dataclass(frozen=True)
class Mechanism:
    """A straight chain of M places where it bends.

    ``kind``: "straight" (hinges), "arc" (units of constant curvature) or "double" (units of two hinges an axis with
    equal shares). ``length`` m. ``places`` (M,) m: hinges, or the middles of units. ``units`` (M, 2) m: their ends
    (for hinges the place twice). ``hinges`` (M, 2) m: the two of a double joint (else as ``units``). ``joint_axis``
    (n,) 0 pitch or 1 yaw, ``joint_place`` (n,) and ``gain`` (n,), rad of bend per rad of the coordinate: one of each
    for every joint coordinate, in the robot's order. ``outer`` (M,): the axis of a double joint's outer hinges.
    ``segments``: the body as lines and arcs between frame origins.
    """

    kind: str
    length: float
    places: Array
    units: Array
    hinges: Array
    joints: tuple[str, ...]
    joint_axis: IntArray
    joint_place: IntArray
    gain: Array
    outer: IntArray
    segments: tuple[Segment, ...]

    def joints_of(self, axis: int) -> IntArray:
        """Joint coordinates that bend about ``axis``, from the tail on."""
        found = np.flatnonzero(self.joint_axis == axis)
        return found[np.argsort(self.joint_place[found], kind="stable")]

    @property
    def axes(self) -> tuple[int, ...]:
        """The axes that some joint bends about."""
        return tuple(axis for axis in (PITCH, YAW) if np.any(self.joint_axis == axis))


_CACHE: dict[int, tuple[weakref.ref[Robot], Mechanism]] = {}


def mechanism(robot: Robot) -> Mechanism:
    """The mechanism of a robot; InputError that names the robot and why, where no rule for curves is known."""
    if not isinstance(robot, Robot):
        raise InputError(f"robot: expected a Robot, got {type(robot).__name__}.")
    # by identity: comparing two robots of many links costs more than a fit
    held = _CACHE.get(id(robot))
    if held is not None and held[0]() is robot:
        return held[1]
    made = _read(robot)
    key = id(robot)
    _CACHE[key] = (weakref.ref(robot, lambda _: _CACHE.pop(key, None)), made)
    return made


def _refuse(robot: Robot, why: str) -> InputError:
    return InputError(f"robot {robot.name!r} cannot be fitted to a curve: {why}.")


def _read(robot: Robot) -> Mechanism:
    if len(robot.chains) != 1:
        names = ", ".join(chain.name for chain in robot.chains)
        raise _refuse(robot, f"it must be one chain, and has {len(robot.chains)} ({names})")
    if robot.n == 0:
        raise _refuse(robot, "it has no joints")
    segments, drives = _walk(robot)
    length = segments[-1].end if segments else 0.0
    by_joint = {name: [d for d in drives if d.joint == name] for name in robot.joints}
    counts = {name: len(uses) for name, uses in by_joint.items()}
    arcs = {name for name, uses in by_joint.items() if any(d.end > d.start for d in uses)}
    for name, uses in by_joint.items():
        if len({d.axis for d in uses}) > 1:
            raise _refuse(robot, f"joint {name!r} bends about two axes")
        if counts[name] > 2 or (counts[name] == 2 and (name in arcs or abs(uses[0].gain - uses[1].gain) > SLACK)):
            raise _refuse(robot, f"joint {name!r} drives {counts[name]} bends that are not two hinges of equal shares")
    doubles = {name for name, count in counts.items() if count == 2}
    if len(arcs) not in (0, robot.n) or len(doubles) not in (0, robot.n):
        raise _refuse(robot, "hinges, arcs and double joints in one chain are not handled")
    if arcs:
        kind, spans = "arc", [(by_joint[name][0].start, by_joint[name][0].end) for name in robot.joints]
    else:
        kind = "double" if doubles else "straight"
        spans = [(uses[0].start, uses[-1].start) for uses in by_joint.values()]
    place, ends = _grouped(spans, SLACK * length)
    axis = np.array([uses[0].axis for uses in by_joint.values()], dtype=np.int64)
    for p in range(len(ends)):
        at = np.flatnonzero(place == p)
        if len({int(axis[j]) for j in at}) != len(at):
            names = ", ".join(robot.joints[j] for j in at)
            raise _refuse(robot, f"joints {names} bend about the same axis at the same place")
    outer, hinges = np.full(len(ends), YAW, dtype=np.int64), ends
    if kind == "double":
        outer = _outer_axes(robot, drives, place, ends)
        ends = _unit_ends(robot, ends, length)
    elif np.any(ends[1:, 0] < ends[:-1, 1] - SLACK * length):
        raise _refuse(robot, "its bending units overlap")
    gain = [sum(d.gain for d in uses) for uses in by_joint.values()]
    return Mechanism(
        kind,
        length,
        frozen(ends.mean(axis=1)),
        frozen(ends),
        frozen(hinges),
        robot.joints,
        _fixed(axis),
        _fixed(place),
        frozen(gain),
        _fixed(outer),
        tuple(segments),
    )


def _fixed(values: IntArray) -> IntArray:
    values.flags.writeable = False
    return values


def _walk(robot: Robot) -> tuple[list[Segment], list[_Drive]]:
    """The chain at q = 0: its segments, and every use of a joint in order."""
    at, turn = np.zeros(3), np.eye(3)
    size = 0.0
    segments: list[Segment] = []
    drives: list[_Drive] = []
    for i, element in enumerate(robot.elements):
        where = f"element {i + 1} ({robot.frames[i + 1]!r})"
        values = [_at_zero(robot, element, field, where) for field in element.VARIABLES]
        before = at
        if isinstance(element, Arc):
            if max(map(abs, values)) > SLACK:
                raise _refuse(robot, f"{where} is bent at q = 0")
            at = at + element.length * turn[:, 0]
            for field, column in (("pitch", 1), ("yaw", 2)):
                drives += _drive(robot, getattr(element, field), turn[:, column], before[0], at[0], where)
        else:
            drives += _drive(robot, element.theta, turn[:, 2], at[0], at[0], where)
            step, rotation = row_transform(*values)
            about = turn @ np.array([np.cos(values[0]), np.sin(values[0]), 0.0])
            at = at + turn @ step
            drives += _drive(robot, element.epsilon, about, at[0], at[0], where)
            turn = turn @ rotation
        size = max(size, float(np.abs(at).max()))
        if np.abs(at[1:]).max() > SLACK * size or at[0] < before[0] - SLACK * size:
            raise _refuse(robot, f"at q = 0 it must lie straight along x, and {where} leaves that line")
        if at[0] > before[0] + SLACK * size:
            segments.append(Segment(i, float(before[0]), float(at[0]), isinstance(element, Arc)))
    if not segments:
        raise _refuse(robot, "it has no length")
    # the segments join exactly
    joined, end = [], 0.0
    for segment in segments:
        joined.append(segment._replace(start=end))
        end = segment.end
    return joined, drives


def _at_zero(robot: Robot, element: Element, field: str, where: str) -> float:
    value = getattr(element, field)
    if isinstance(value, (int, float)):
        return float(value)
    if field not in element.ANGLES or not isinstance(value, Joint):
        raise _refuse(robot, f"{field} of {where} is driven: joints that slide or change a length follow no curve")
    return value.offset


def _drive(robot: Robot, value: object, about: Array, start: float, end: float, where: str) -> list[_Drive]:
    if not isinstance(value, Joint):
        return []
    for axis, component in ((PITCH, 1), (YAW, 2)):
        sign = float(np.round(about[component]))
        if sign and np.abs(about - sign * np.eye(3)[component]).max() <= SLACK:
            return [_Drive(value.name, axis, sign * value.scale, float(start), float(end))]
    if abs(abs(about[0]) - 1.0) <= SLACK:
        raise _refuse(robot, f"joint {value.name!r} rolls about the body's own line in {where}")
    raise _refuse(robot, f"joint {value.name!r} turns about {np.round(about, 6).tolist()} in {where}, not about y or z")


def _grouped(spans: list[tuple[float, float]], slack: float) -> tuple[IntArray, Array]:
    """Number of the place (n,) of every span, from the tail on, and the places (M, 2)."""
    given = np.array(spans)
    order = np.lexsort((given[:, 1], given[:, 0]))
    place = np.empty(len(given), dtype=np.int64)
    ends: list[Array] = []
    for j in order:
        if not ends or np.abs(given[j] - ends[-1]).max() > slack:
            ends.append(given[j])
        place[j] = len(ends) - 1
    return place, np.array(ends)


def _outer_axes(robot: Robot, drives: list[_Drive], place: IntArray, hinges: Array) -> IntArray:
    """The axis of the outer hinges of every double joint; its axes must come back in the reverse order."""
    column = {name: i for i, name in enumerate(robot.joints)}
    outer = np.full(len(hinges), YAW, dtype=np.int64)
    for unit in range(len(hinges)):
        axes = [d.axis for d in drives if place[column[d.joint]] == unit]
        if axes != axes[::-1]:
            order = ", ".join(AXIS_NAMES[a] for a in axes)
            raise _refuse(robot, f"double joint {unit + 1} turns in the order {order}, not mirrored about its middle")
        outer[unit] = axes[0]
    return outer


def _unit_ends(robot: Robot, hinges: Array, length: float) -> Array:
    """Ends (M, 2) of double joints, symmetric about their hinges (M, 2)."""
    first, second = hinges.T
    slack = SLACK * length
    if np.any(second <= first) or np.any(first[1:] < second[:-1] - slack):
        raise _refuse(robot, "its double joints overlap")
    # end to end from tail to head, each mirrored about its middle
    ends = np.zeros(len(hinges) + 1)
    for i, both in enumerate(hinges.sum(axis=1)):
        ends[i + 1] = both - ends[i]
    inside = np.all(ends[:-1] <= first + slack) and np.all(ends[1:] >= second - slack)
    if inside and abs(ends[-1] - length) <= 1e3 * slack:
        return np.stack([ends[:-1], ends[1:]], axis=1)
    # a longer head or tail: the shorter of the rigid parts on the two sides of a joint counts on both
    parts = np.append(0.5 * (first[1:] - second[:-1]), np.inf)
    own = np.minimum(np.roll(parts, 1), parts)
    own = np.minimum(own, np.minimum(first, length - second))
    return np.stack([first - own, second + own], axis=1)
