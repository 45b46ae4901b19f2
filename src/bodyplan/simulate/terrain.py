"""Ground as MuJoCo shapes, and the pairs in which robot and ground may touch."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.errors import InputError
from bodyplan.ground.base import Solid
from bodyplan.robot.elements import Contact
from bodyplan.robot.friction import DEFAULT
from bodyplan.robot.model import Robot
from bodyplan.robot.neighbours import separate_contacts
from bodyplan.simulate.friction import Balls, Friction, Runners, Scales, pair_friction
from bodyplan.simulate.library import mujoco
from bodyplan.simulate.wheels import TIPS, tip_names
from bodyplan.spatial.rotations import rotate

#: time constant of a contact in time steps. MuJoCo's default of 20 ms lets loaded contacts creep along the ground, by
#: a tenth and more of a snake's advance; 6 steps are stiff and still smooth
CONTACT_STEPS = 6.0
#: thickness under the lowest point of a height field, m
FIELD_BASE = 0.5
LEVEL = (1.0, 0.0, 0.0, 0.0)
FLOOR_RGBA, WALL_RGBA = (0.62, 0.66, 0.70, 1.0), (0.45, 0.55, 0.65, 0.35)


def geom_name(solid: Solid) -> str:
    """Name of a solid's shape in the model."""
    return f"ground:{solid.name}"


def add_solid(spec: Any, solid: Solid) -> None:
    """One piece of ground as a fixed shape (height fields keep their heights in single precision)."""
    mj, name, at = mujoco(), geom_name(solid), np.array(solid.position)
    rgba = FLOOR_RGBA if solid.role == "floor" else WALL_RGBA
    plain: dict[str, Any] = {"name": name, "contype": 0, "conaffinity": 0, "rgba": rgba}
    if solid.kind == "plane":
        spec.worldbody.add_geom(type=mj.mjtGeom.mjGEOM_PLANE, pos=at, quat=solid.quaternion, size=[0, 0, 1.0], **plain)
    elif solid.kind == "box":
        spec.worldbody.add_geom(type=mj.mjtGeom.mjGEOM_BOX, pos=at, quat=solid.quaternion, size=solid.half, **plain)
    else:
        if solid.z is None:
            raise InputError(f"solid {solid.name!r}: a field needs heights z.")
        rows, columns = solid.z.shape
        half = 0.5 * np.array([(columns - 1) * solid.cell[0], (rows - 1) * solid.cell[1]])
        bottom, rise = float(solid.z.min()), float(np.ptp(solid.z))
        rise = rise or 1.0  # a level field: all its data are 0
        spec.add_hfield(
            name=name,
            nrow=rows,
            ncol=columns,
            size=[*half, rise, FIELD_BASE],
            userdata=((solid.z - bottom) / rise).ravel(),
        )
        spec.worldbody.add_geom(type=mj.mjtGeom.mjGEOM_HFIELD, hfieldname=name, pos=[*(at[:2] + half), bottom], **plain)


def add_pairs(
    spec: Any, robot: Robot, solids: tuple[Solid, ...], friction: float | Friction | None, tips: int = TIPS
) -> None:
    """Explicit pairs of every contact with every solid, named "contact on solid"; of a rim with a drive, of every of
    its ``tips`` balls."""
    solref = [CONTACT_STEPS * spec.option.timestep, 1.0]
    for contact in robot.contacts:
        shapes = [contact.name] if contact.drive is None else tip_names(contact.name, tips)
        for solid in solids:
            along, across = pair_friction(solid, contact, friction)
            if isinstance(friction, Friction) and solid.role == "floor":
                if not (solid.kind == "plane" or (solid.kind == "box" and solid.quaternion == LEVEL)):
                    raise InputError(
                        "friction: scales need a plane or boxes with level tops as floor, "
                        f"{solid.name!r} is a {solid.kind}."
                    )
                if contact.shape != "sphere" and not _has_axis(contact):
                    raise InputError(f"friction: scales need capsules or spheres, contact {contact.name!r} is neither.")
            for shape in shapes:
                spec.add_pair(
                    name=f"{shape} on {solid.name}",
                    geomname1=shape,
                    geomname2=geom_name(solid),
                    condim=3,
                    friction=[along, across, 0.0, 0.0, 0.0],
                    solref=solref,
                )


def add_self_pairs(spec: Any, robot: Robot) -> None:
    """Pairs of the robot's contacts with each other, except of neighbours (``robot/neighbours.py``) and of rims with a
    drive: their balls are no surface that could hold another shape off."""
    for i, j in separate_contacts(robot):
        one, other = robot.contacts[i], robot.contacts[j]
        if one.drive is not None or other.drive is not None:
            continue
        mu = max((f for f in (one.friction, other.friction) if f is not None), default=DEFAULT)
        spec.add_pair(
            name=f"{one.name} on {other.name}",
            geomname1=one.name,
            geomname2=other.name,
            condim=3,
            friction=[mu, mu, 0.0, 0.0, 0.0],
        )


def scales_of(model: Any, robot: Robot, solids: tuple[Solid, ...], friction: Friction) -> Scales:
    """The scales of every contact on every floor of a compiled model."""
    found: dict[bool, list[tuple[Contact, Solid]]] = {}
    for solid in solids:
        for contact in robot.contacts:
            if solid.role == "floor":
                found.setdefault(solid.kind == "plane" and _has_axis(contact), []).append((contact, solid))
    parts: list[Runners | Balls] = []
    for runs, pairs in found.items():
        geoms = np.array([model.geom(c.name).id for c, _ in pairs])
        arrays = (
            np.array([model.pair(f"{c.name} on {s.name}").id for c, s in pairs]),
            geoms,
            model.geom_bodyid[geoms].astype(np.int64),
            np.array([c.radius for c, _ in pairs]),
            np.array([rotate(np.array(s.quaternion), np.array([0.0, 0.0, 1.0])) for _, s in pairs]),
        )
        parts.append(Runners(*arrays) if runs else Balls(*arrays, np.array([_has_axis(c) for c, _ in pairs])))
    return Scales(friction, parts)


def _has_axis(contact: Contact) -> bool:
    return contact.shape == "capsule" and contact.start != contact.end
