"""From the course of a body to a Motion: every joint exact in time, claims, facts, statuses and what to know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import Status
from bodyplan.gaits.carry import contact, hull
from bodyplan.gaits.carry.carriage import Carriage, carriage
from bodyplan.gaits.carry.contact import Contacts
from bodyplan.gaits.carry.heights import height_of
from bodyplan.gaits.carry.holding import hold, holding_claims, holding_facts, holding_notes, judged
from bodyplan.gaits.carry.panels import ANGLE, KNOWN, RADIUS, RATE, SPEED
from bodyplan.gaits.carry.pose import WheelContact, planes_of, wheel_contact
from bodyplan.gaits.carry.rates import Rates, rates
from bodyplan.gaits.carry.report import claims, facts, notes
from bodyplan.gaits.carry.spins import Hubs
from bodyplan.gaits.carry.terrain import Terrain, terrain
from bodyplan.gaits.carry.verdict import judge
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.elements import WheelRadius
from bodyplan.robot.model import Robot

if TYPE_CHECKING:
    from bodyplan.gaits.carry.gait import Carry

#: m/rad: an adjusting joint next to its singular end q = 0, where the radius has no slope
FLAT = 1e-9


@dataclass(frozen=True)
class Rolled:
    """Everything about the wheels at T times: contacts by wheel, their rates (wheel after wheel), the joints."""

    wheels: tuple[WheelContact, ...]
    found: Contacts
    rates: Rates
    q: Array
    qd: Array
    qdd: Array

    def of(self, values: Array, k: int) -> Array:
        """The part (T, ...) of wheel ``k`` in values (k T, ...)."""
        size = len(self.q)
        return values[k * size : (k + 1) * size]


def motion_of(gait: Carry, robot: Robot, ground: Ground, t: Array) -> Motion:
    """The motion of a carried body at times ``t`` (T,) s."""
    wheels, land = Wheels.of(robot), terrain(ground)
    ahead = reference(gait, wheels)
    height = height_of(gait, wheels, ground, land, ahead, float(t[-1]))

    def at(times: Array) -> Carriage:
        return carriage(gait, land, ahead, height, times)

    body = at(t)
    rolled = roll(wheels, land, body)
    spin(wheels, land, at, t, rolled)
    under = hull.touches(robot, land, body.position, body.turn.matrix)
    verdict = judge(gait, wheels, body, rolled, under, t)
    ok = verdict.ok
    held = hold(wheels, ground, body, rolled, ok)
    verdict = judged(verdict, held, t)
    stood = holding_facts(wheels, held)
    contacts = np.zeros((len(t), len(robot.contacts)))
    contacts[:, [wheel.rim for wheel in wheels]] = 1.0
    residual = np.nan_to_num(np.max([one.residual for one in rolled.wheels], axis=0))
    return Motion(
        robot=robot,
        ground=ground,
        gait=gait.to_dict(),
        t=t,
        base=body.base,
        q=np.nan_to_num(rolled.q, posinf=0.0, neginf=0.0),
        qd=np.nan_to_num(rolled.qd, posinf=0.0, neginf=0.0),
        qdd=np.nan_to_num(rolled.qdd, posinf=0.0, neginf=0.0),
        residual=np.where(ok, residual, 0.0),
        status=verdict.status,
        claims=(*claims(wheels, ok), *holding_claims(wheels, held)),
        contacts=contacts,
        forces=None if isinstance(held, str) else held.contacts,
        torques=None if isinstance(held, str) else held.torques,
        facts=facts(gait, wheels, land, body, rolled, ok, t) | stood,
        notes=(*notes(gait, wheels, body, rolled, ok, t, verdict.reasons), *holding_notes(wheels, held, stood)),
    )


def reference(gait: Carry, wheels: Wheels) -> float:
    """Where on the body's x axis the point is that follows the path, m."""
    if not isinstance(gait.reference, str):
        return gait.reference
    x = wheels.centres[:, 0]
    return {"center": 0.0, "front_axle": float(x.max()), "rear_axle": float(x.min())}[gait.reference]


def roll(wheels: Wheels, land: Terrain, body: Carriage) -> Rolled:
    """Contacts, rates and joints of all wheels; hubs at 0."""
    size, robot = len(body.position), wheels.robot
    found = contact.find(land, planes_of(wheels, body.position, body.turn.matrix))
    moved = rates(land, found, body.carried(wheels))
    q, qd, qdd = (np.zeros((size, robot.n)) for _ in range(3))
    made = []
    with np.errstate(all="ignore"):
        for k, wheel in enumerate(wheels):
            part = slice(k * size, (k + 1) * size)
            one = wheel_contact(wheel, found, part)
            made.append(one)
            q[:, wheel.angle] = _unwrapped(wheel.joint_angle(np.nan_to_num(one.angle)), wheel.scale)
            # the row turns the other way round: from ahead to down
            qd[:, wheel.angle] = -moved.angle[part] / wheel.scale
            qdd[:, wheel.angle] = -moved.angle_rate[part] / wheel.scale
            if isinstance(wheel.law, WheelRadius) and wheel.adjust is not None:
                q[:, wheel.adjust] = one.q
                slope, bend = wheel.law.slope(one.q), -0.25 * (wheel.law.radius(one.q) - wheel.law.rubber)
                grows, gains = moved.radius[part], moved.radius_rate[part]
                endless = np.where(grows == 0.0, 0.0, np.inf)
                first = np.where(np.abs(slope) > FLAT, grows / slope, endless)
                qd[:, wheel.adjust] = first
                qdd[:, wheel.adjust] = np.where(np.abs(slope) > FLAT, (gains - bend * first**2) / slope, 0.0)
            qd[:, wheel.spin] = moved.rolling[part] / wheel.turn
            qdd[:, wheel.spin] = moved.rolling_rate[part] / wheel.turn
            # what is not in contact rests; what is out of reach stays at its limit
            for rows, columns in (
                (found.outcome[part] != contact.TOUCHES, wheel.columns),
                (one.status == Status.OUT_OF_REACH.value, wheel.columns[2:]),
            ):
                for rate in (qd, qdd):
                    rate[np.ix_(rows, columns)] = 0.0
    return Rolled(tuple(made), found, moved, q, qd, qdd)


def _unwrapped(angle: Array, scale: float) -> Array:
    """Contact angles that run on across pi, wherever they do."""
    return np.asarray(np.unwrap(angle, period=2.0 * np.pi / abs(scale))) if len(angle) else angle


def spin(wheels: Wheels, land: Terrain, at: Callable[[Array], Carriage], t: Array, rolled: Rolled) -> None:
    """The hubs' turns since t = 0 into ``rolled.q``."""
    columns, signs = [wheel.spin for wheel in wheels], np.array([wheel.turn for wheel in wheels])
    known = np.empty((len(t), len(columns), KNOWN))
    known[:, :, SPEED], known[:, :, RATE] = rolled.qd[:, columns] * signs, rolled.qdd[:, columns] * signs
    known[:, :, ANGLE], known[:, :, RADIUS] = (
        v.reshape(len(columns), len(t)).T for v in (rolled.found.phi, rolled.found.radius)
    )
    known[:, :, [SPEED, RATE]] = np.nan_to_num(known[:, :, [SPEED, RATE]], nan=0.0, posinf=0.0, neginf=0.0)
    rolled.q[:, columns] = Hubs(wheels, land, at).turned(t, known) / signs
