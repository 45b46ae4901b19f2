"""Inequalities on rates: joint limits and rates, height of the body, reach of the feet, margin against tipping over;
over a short time ahead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, finite, number
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Element
from bodyplan.robot.model import Robot
from bodyplan.solve.components import Component
from bodyplan.solve.partitions import Partition
from bodyplan.solve.stability.margins import DOWN
from bodyplan.solve.stability.slopes import margin_slopes

Pair = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What resolved rates must respect: every position is held within its bounds ``horizon`` s ahead.

    A position p with rate dp may move at (low - p) / horizon <= dp <= (high - p) / horizon: the velocity damper of
    Faverjon and Tournassoud (1987) that lets it approach a bound no faster than exponentially, with that time constant.
    Steps up to ``horizon`` long cannot cross a bound; beyond it, a position has to come back.

    * ``joints``: the limits of the robot's joints; ``rates``: their largest rates (True: those that the robot has).
    * ``height`` (low, high) m: of the base's origin in the world.
    * ``reach`` (low, high) m: distance of a foot from where its leg begins to move (the axis of the first joint of its
      chain); one pair for all feet that are ends of chains, or pairs by foot. A highest reach a bit below the length of
      the stretched leg keeps its knee from straightening.
    * ``margin`` m: least distance, that of :func:`~bodyplan.solve.stability.tip_margins`, of the centre of mass ``com``
      from every edge of the hull of the feet ``stance`` seen along ``gravity`` (3,). stance and com are those of
      :meth:`~bodyplan.solve.stability.Objective.at`: None are all feet, and the centre of mass where there is mass. The
      edges are those of now; feet that stand still let none join.
    * ``components`` by name: largest rate by size, or (low, high), m/s or rad/s, of any foot's, body's or joint's rate
      in the partition's axes.

    A bound may be infinite. Raises InputError for bounds that are not (low, high) with low < high, a horizon that is
    not > 0, a stance, com or gravity without a margin.
    """

    horizon: float = 0.1
    joints: bool = True
    rates: bool = True
    height: Pair | None = None
    reach: Pair | Mapping[str, Pair] | None = None
    components: Mapping[str, float | Pair] = field(default_factory=dict)
    margin: float | None = None
    stance: Sequence[str] | None = None
    com: str | tuple[float, float, float] | None = None
    gravity: tuple[float, float, float] = DOWN

    def __post_init__(self) -> None:
        number(self.horizon, "Limits.horizon", above=0.0)
        for name in ("joints", "rates"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(f"Limits.{name}: must be True or False, got {getattr(self, name)!r}.")
        if self.height is not None:
            object.__setattr__(self, "height", _pair(self.height, "Limits.height"))
        if isinstance(self.reach, Mapping):
            reach: Any = {str(k): _pair(v, f"Limits.reach[{k!r}]") for k, v in self.reach.items()}
            object.__setattr__(self, "reach", reach)
        elif self.reach is not None:
            object.__setattr__(self, "reach", _pair(self.reach, "Limits.reach"))
        if not isinstance(self.components, Mapping):
            raise InputError(f"Limits.components: expected a mapping from names to rates, got {self.components!r}.")
        rates = {str(k): _rate(v, f"Limits.components[{k!r}]") for k, v in self.components.items()}
        object.__setattr__(self, "components", rates)
        if self.margin is not None:
            object.__setattr__(self, "margin", number(self.margin, "Limits.margin"))
        elif self.stance is not None or self.com is not None or tuple(self.gravity) != DOWN:
            raise InputError("Limits.margin: stance, com and gravity say of what; give the margin, too.")
        object.__setattr__(self, "gravity", _three(self.gravity, "Limits.gravity"))
        if self.com is not None and not isinstance(self.com, str):
            object.__setattr__(self, "com", _three(self.com, "Limits.com"))
        if isinstance(self.stance, (list, tuple)):
            object.__setattr__(self, "stance", tuple(self.stance))
            if len(self.stance) < 3:
                raise InputError(f"Limits.stance: a margin needs three feet or more, got {', '.join(self.stance)!r}.")


class Inequalities(NamedTuple):
    """L rows ``C X + D Y <= h`` with their ``labels``: C (..., L, x), D (..., L, y), h (..., L)."""

    labels: tuple[str, ...]
    C: Array
    D: Array
    h: Array


def inequalities(partition: Partition, limits: Limits) -> Inequalities:
    """The rows of ``limits`` for a partition. UnknownNameError for a foot or component that it does not have,
    InputError for the reach of a foot whose leg has no joint, or the margin of a stance that has none."""
    rows = _Rows(partition)
    model, horizon = partition.model, limits.horizon
    robot, q = model.robot, model.q
    joints = [Component("joint", k) for k in range(robot.n)]
    if limits.joints:
        low, high = ((bound - q) / horizon for bound in robot.limits.T)
        rows.add([f"limit of {name}" for name in robot.joints], joints, np.eye(robot.n), low, high)
    if limits.rates:
        rows.add([f"rate of {name}" for name in robot.joints], joints, np.eye(robot.n), -robot.rates, robot.rates)
    if limits.height is not None:
        # z of the world is the last row of the base's axes
        upward = model.body_rotation[..., 2:, :] @ partition.body_jacobian[..., :3, :]
        low, high = ((bound - model.base[..., 2:3]) / horizon for bound in limits.height)
        rows.add(["height"], [Component("body", k) for k in range(6)], upward, low, high)
    for foot, bounds in _reaches(partition, limits.reach).items():
        r, slope = _reach(partition, foot)
        low, high = ((bound - r[..., None]) / horizon for bound in bounds)
        rows.add([f"reach of {model.feet[foot]}"], joints, slope[..., None, :], low, high)
    for name, rate in limits.components.items():
        low, high = (np.array([bound]) for bound in _rate(rate, name))
        for component in partition.names.find(name, "Limits.components"):
            rows.add([f"rate of {partition.names.name(component)}"], [component], np.eye(1), low, high)
    if limits.margin is not None:
        found = margin_slopes(partition, limits.stance, limits.com, limits.gravity)
        # a pair of feet that is no edge bounds nothing: 0 >= -1
        low = np.where(found.real, (limits.margin - found.distance) / horizon, -1.0)
        everything = partition.X + partition.Y
        rows.add(
            [f"margin over {pair}" for pair in found.pairs], everything, found.slope, low, np.full_like(low, np.inf)
        )
    return rows.done()


class _Rows:
    """Collects inequalities low <= M v <= high on the rates v of some components; an infinite bound makes no row."""

    def __init__(self, partition: Partition) -> None:
        self.partition = partition
        self.labels: list[str] = []
        self.blocks: list[tuple[tuple[Component, ...], Array, Array]] = []

    def add(self, labels: Sequence[str], components: Sequence[Component], M: Array, low: Array, high: Array) -> None:
        """``labels`` (r), ``components`` (c), M (..., r, c), low and high (..., r)."""
        for side, sign, bound in (("lower", -1.0, low), ("upper", 1.0, high)):
            some = np.flatnonzero(np.isfinite(bound).reshape(-1, len(labels)).all(axis=0))
            if len(some):
                self.labels.extend(f"{side} {labels[int(i)]}" for i in some)
                self.blocks.append((tuple(components), sign * M[..., some, :], sign * bound[..., some]))

    def done(self) -> Inequalities:
        shape, size = self.partition.shape, len(self.labels)
        C = np.zeros((*shape, size, len(self.partition.X)))
        D = np.zeros((*shape, size, len(self.partition.Y)))
        h = np.empty((*shape, size))
        first = 0
        for components, M, bound in self.blocks:
            rows = slice(first, first + M.shape[-2])
            first = rows.stop
            h[..., rows] = bound
            places = [self.partition.place(component) for component in components]
            for side, matrix in ((True, C), (False, D)):
                mine = [i for i, (unknown, _) in enumerate(places) if unknown is side]
                matrix[..., rows, [places[i][1] for i in mine]] = M[..., mine]
        return Inequalities(tuple(self.labels), C, D, h)


def leg_root(robot: Robot, frame: int) -> int:
    """Index of the frame whose z is the axis of the first joint on the way from the start of the chain to ``frame``.
    InputError where no joint of the chain moves that frame."""
    first = 1
    for chain in robot.chains:
        last = first + len(chain.elements) - 1
        if first <= frame <= last:
            root = robot.frame_index(chain.parent)
            for i in range(first, frame + 1):
                if _driven(robot.elements[i - 1]):
                    return root
                root = i
            break
        first = last + 1
    raise InputError(f"Limits.reach: no joint of its chain moves {robot.frames[frame]!r}.")


def _driven(element: Element) -> bool:
    return any(not isinstance(getattr(element, variable), float) for variable in element.VARIABLES)


def _reaches(partition: Partition, reach: Any) -> dict[int, Pair]:
    if reach is None:
        return {}
    model = partition.model
    if not isinstance(reach, Mapping):
        return {i: reach for i, foot in enumerate(model.targets) if foot.frame in model.robot.ends}
    out = {}
    for name, pair in reach.items():
        components = partition.names.find(name, "Limits.reach")
        if len(components) != 6 or components[0].kind != "foot":
            raise UnknownNameError("foot", name, model.feet, where="Limits.reach")
        out[components[0].number // 6] = pair
    return out


def _reach(partition: Partition, foot: int) -> tuple[Array, Array]:
    """Distance r (...) m of a foot from the root of its leg, and dr/dq (..., n)."""
    model = partition.model
    robot = model.robot
    root = robot.frames[leg_root(robot, model.targets[foot].frame)]
    start = robot.ends_and_jacobians(model.q, frames=(root,))
    end_R, root_R = model.reach.rotations[..., foot, :, :], start.rotations[..., 0, :, :]
    end = model.reach.positions[..., foot, :] + end_R @ np.array(model.targets[foot].start)
    way = end - start.positions[..., 0, :]
    r = np.linalg.norm(way, axis=-1)
    # the rate of the way in base axes, for a base at rest; at r = 0 no direction is longer
    velocity = end_R @ model.Q[..., 6 * foot : 6 * foot + 3, :] - root_R @ start.stacked()[..., :3, :]
    unit = way / np.where(r > 0.0, r, 1.0)[..., None]
    return r, np.asarray((unit[..., None, :] @ velocity)[..., 0, :])


def _pair(value: Any, field_name: str) -> Pair:
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low, high = 1.0, 0.0
    if not low < high:
        raise InputError(f"{field_name}: must be (low, high) with low < high, got {value!r}.")
    return low, high


def _three(value: Any, field_name: str) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in finite(value, field_name, (3,)))
    return x, y, z


def _rate(value: Any, field_name: str) -> Pair:
    if isinstance(value, (tuple, list)):
        return _pair(value, field_name)
    most = number(value, field_name, above=0.0)
    return -most, most
