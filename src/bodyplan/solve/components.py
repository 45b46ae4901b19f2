"""Names of what a velocity equation relates: components of feet and body, and joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.model import Robot
from bodyplan.solve.configuration import Foot, Model
from bodyplan.solve.coordinates import COORDINATES

TWIST = ("vx", "vy", "vz", "wx", "wy", "wz")
#: shorter names for several components at once
GROUPS = {"": range(6), "v": range(3), "w": range(3, 6)}
BODY = "body"
KINDS = ("foot", "body", "joint")


class Component(NamedTuple):
    """One scalar: ``kind`` "foot", "body" or "joint"; ``number`` its place among those of its kind (a row of P and Q, a
    component of the body, a column of q)."""

    kind: str
    number: int


class Names:
    """The components of one model: their names, what a name stands for, and their units.

    ``coordinates``: the body has the components x, y, z, roll, pitch, yaw instead of vx .. wz.
    """

    def __init__(self, model: Model, coordinates: bool) -> None:
        self.robot, self.feet, self.coordinates = model.robot, model.targets, coordinates
        of_body = COORDINATES if coordinates else TWIST
        self.of: dict[str, tuple[str, ...]] = {
            "foot": tuple(f"{foot.name}.{part}" for foot in self.feet for part in TWIST),
            "body": tuple(f"{BODY}.{part}" for part in of_body),
            "joint": self.robot.joints,
        }
        self._places = {(foot.frame, foot.start): i for i, foot in enumerate(self.feet)}
        self._aliases = model.aliases

    def name(self, component: Component) -> str:
        """The one name under which a component is reported."""
        return self.of[component.kind][component.number]

    def unit(self, component: Component) -> str:
        """Unit of a component's rate."""
        if component.kind == "joint":
            return "m/s" if self.robot.kinds[component.number] == "length" else "rad/s"
        return "m/s" if component.number % 6 < 3 else "rad/s"

    def find(self, name: object, where: str) -> tuple[Component, ...]:
        """The components that a name stands for: one, or those of a group such as "fl.foot.v" or "body"."""
        if name in self.robot.joints:
            return (Component("joint", self.robot.joint_index(str(name))),)
        if isinstance(name, str):
            if name in self.of["body"]:
                return (Component("body", self.of["body"].index(name)),)
            if name == BODY or (not self.coordinates and name in (f"{BODY}.v", f"{BODY}.w")):
                return tuple(Component("body", k) for k in GROUPS[name[len(BODY) + 1 :]])
            found = foot_and_part(self._aliases, name)
            if found is not None and (place := self._places.get((found[0].frame, found[0].start))) is not None:
                return tuple(Component("foot", 6 * place + k) for k in found[1])
        raise UnknownNameError("component", name, (n for kind in KINDS for n in self.of[kind]), where)

    def flat(self, names: Iterable[object], where: str) -> tuple[Component, ...]:
        """The components of all ``names``, in their order; InputError for one that is named twice."""
        out: dict[Component, object] = {}
        for name in names:
            for component in self.find(name, where):
                if component in out:
                    raise InputError(f"{where}: {self.name(component)!r} is named twice.")
                out[component] = name
        return tuple(out)


def foot_and_part(aliases: Mapping[str, Foot], name: str) -> tuple[Foot, Iterable[int]] | None:
    """The foot that a name such as "fl.foot.vx", "fl.foot.v" or "fl.foot" is about, and which components of it."""
    stem, _, part = name.rpartition(".")
    if stem in aliases:
        if part in TWIST:
            return aliases[stem], (TWIST.index(part),)
        if part in ("v", "w"):
            return aliases[stem], GROUPS[part]
    return (aliases[name], GROUPS[""]) if name in aliases else None


def further_feet(model: Model, names: Iterable[object]) -> list[Foot]:
    """Feet that ``names`` speak of and that the model does not have yet."""
    aliases = model.aliases
    have = {(foot.frame, foot.start) for foot in model.targets}
    out: list[Foot] = []
    for name in names:
        if not isinstance(name, str) or name in model.robot.joints or name.partition(".")[0] == BODY:
            continue
        found = foot_and_part(aliases, name)
        if found is not None and (found[0].frame, found[0].start) not in have:
            have.add((found[0].frame, found[0].start))
            out.append(found[0])
    return out


def speaks_of_coordinates(robot: Robot, names: Iterable[object]) -> bool:
    """Whether ``names`` have the body as x, y, z, roll, pitch, yaw; InputError where they also have it as a twist."""
    parts = [
        str(name).partition(".")[2]
        for name in names
        if str(name).partition(".")[0] == BODY and name not in robot.joints and name != BODY
    ]
    coordinates = sorted(set(parts) & set(COORDINATES))
    twist = sorted(set(parts) & {*TWIST, "v", "w"})
    if coordinates and twist:
        raise InputError(
            f"known: the body is either a twist or coordinates, got body.{twist[0]} and body.{coordinates[0]}."
        )
    return bool(coordinates)
