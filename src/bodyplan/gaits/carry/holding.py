"""Statics along a carried motion: what the ground gives every wheel, what motors hold, and where nothing holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, BoolArray, TextArray
from bodyplan.errors import MissingExtraError, Status
from bodyplan.gaits.carry.balance import LEAST_WHEELS, Stance, friction_of, ready, stands
from bodyplan.gaits.carry.carriage import Carriage
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.ground.base import Ground
from bodyplan.motion import Claim
from bodyplan.solve.statics.equilibrium import Loads

if TYPE_CHECKING:
    from bodyplan.gaits.carry.motion import Rolled
    from bodyplan.gaits.carry.verdict import Verdict

#: share of the weight, of a torque, and friction that the judge, who finds contacts by sampling rims, may be off by
BALANCE = 1e-5


@dataclass(frozen=True, eq=False)
class Holding:
    """Statics at T samples. ``contacts`` (T, c, 3) N, ``torques`` (T, n) N m for the Motion, zero where there are none;
    ``adjust``, ``hub`` (T, k) N m and ``ratio`` (T, k) of friction to load by wheel, nan there; ``friction`` (k,) that
    is given; ``required`` (T,) the least that would do, nan where it was not looked for; ``status`` (T,) of the forces,
    ok where nobody asked; ``held`` (T,) where there are some; ``unknown`` says why ``required`` is not known."""

    contacts: Array
    torques: Array
    adjust: Array
    hub: Array
    ratio: Array
    friction: Array
    required: Array
    status: TextArray
    held: BoolArray
    unknown: str


def hold(wheels: Wheels, ground: Ground, body: Carriage, rolled: Rolled, ok: BoolArray) -> Holding | str:
    """Statics where samples are ``ok`` (T,), with the forces of least square; or why there are none."""
    robot, size = wheels.robot, len(ok)
    if robot.mass <= 0.0:
        return f"No forces and torques: robot {robot.name!r} has no mass."
    if not stands(wheels):
        return f"No forces and torques: {len(wheels)} wheels hold nothing up at rest, {LEAST_WHEELS} or more do."
    friction = friction_of(wheels, ground)
    stance = Stance.of(wheels, rolled.wheels, body.base, np.nan_to_num(rolled.q), friction)
    rows = np.flatnonzero(ok & ready(stance))
    status = np.full(size, Status.OK.value, dtype="U24")
    found = np.full((size, len(wheels), 3), np.nan)
    ratio, required = np.full((size, len(wheels)), np.nan), np.full(size, np.nan)
    unknown = ""
    if len(rows):
        from bodyplan.solve.statics.forces import forces_of
        from bodyplan.solve.statics.friction import LeastFriction

        some = stance.take(rows)
        loads = Loads.of(some.points, some.normals, some.center, some.weight, None, None)
        try:
            solved = forces_of(loads, friction)
            found[rows], status[rows], ratio[rows] = solved.forces, solved.status, solved.ratio
        except MissingExtraError as error:
            return f"No forces and torques: {error}"
        required[rows] = np.where(np.isfinite(solved.needed), solved.needed, np.nan)
        try:
            stood = solved.status == Status.OK.value
            least = LeastFriction(loads).largest(np.where(stood, solved.ratio.max(axis=1), -np.inf))
            required[rows] = np.where(stood, least, required[rows])
        except MissingExtraError as error:
            unknown = f"The least friction that holds the body is not known: {error}"
    held = np.isfinite(found).all(axis=(1, 2))
    contacts = np.zeros((size, len(robot.contacts), 3))
    contacts[:, [wheel.rim for wheel in wheels]] = np.nan_to_num(found)
    torques = np.where(held[:, None], stance.joints(wheels, np.nan_to_num(found)), 0.0)
    return Holding(
        contacts,
        np.nan_to_num(torques),
        stance.adjust(found),
        stance.hub(found),
        ratio,
        friction,
        required,
        status,
        held,
        unknown,
    )


def judged(verdict: Verdict, holding: Holding | str, t: Array) -> Verdict:
    """The verdict on every sample with what statics say of those that are otherwise fine."""
    if isinstance(holding, str):
        return verdict
    status, reasons = verdict.status.copy(), list(verdict.reasons)
    fine = status == Status.OK.value
    given = " and ".join(f"{mu:.4g}" for mu in dict.fromkeys(holding.friction.tolist()))
    texts = {
        Status.SLIPS: f"the wheels slide: nothing holds the body with a friction of {given}",
        Status.TIPS_OVER: "the body tips over: no forces between wheels and ground hold it",
        Status.NOT_CONVERGED: "the search for the forces that hold the body did not converge",
    }
    for what, text in texts.items():
        bad = np.flatnonzero(fine & (holding.status == what.value))
        if len(bad):
            need = holding.required[bad]
            if what == Status.SLIPS and np.isfinite(need).any():
                text += f", {np.nanmax(np.where(np.isfinite(need), need, np.nan)):.4g} would"
            reasons.append(f"At {t[bad[0]]:.4g} s {text} ({what.value}, {len(bad)} of {len(t)} samples).")
            status[bad] = what.value
    return replace(verdict, status=status, reasons=tuple(reasons))


def holding_claims(wheels: Wheels, holding: Holding | str) -> Iterator[Claim]:
    """What the judge is to test of the forces, at the samples that are held."""
    if isinstance(holding, str) or not holding.held.any():
        return
    names = [wheels.robot.contacts[wheel.rim].name for wheel in wheels]
    some = {} if holding.held.all() else {"samples": np.flatnonzero(holding.held).astype(np.float64)}
    yield Claim("holds", "forces on the rims hold the weight", {"contacts": names, "tolerance": BALANCE, **some})
    yield Claim(
        "grips_ground",
        "friction that the forces need, share of what there is",
        {"contacts": names, "friction": holding.friction, "tolerance": BALANCE, **some},
    )
    yield Claim("bears", "torques are those of virtual work", {"contacts": names, "tolerance": BALANCE, **some})


def holding_facts(wheels: Wheels, holding: Holding | str) -> dict[str, float]:
    """Numbers of the statics: sizes of torques N m, coefficients of friction; of the samples that are held."""
    if isinstance(holding, str) or not holding.held.any():
        return {}
    held = holding.held
    out: dict[str, float] = {}
    torques = {
        wheel.name: np.abs(holding.adjust[held, k]) for k, wheel in enumerate(wheels) if wheel.adjust is not None
    }
    for name, torque in torques.items():
        out[f"{name}_smallest_torque"], out[f"{name}_largest_torque"] = float(torque.min()), float(torque.max())
    if torques:
        out["smallest_adjust_torque"] = min(float(torque.min()) for torque in torques.values())
        out["largest_adjust_torque"] = max(float(torque.max()) for torque in torques.values())
    out["largest_hub_torque"] = float(np.abs(holding.hub[held]).max())
    if np.isfinite(holding.required).any():
        out["required_friction"] = float(holding.required[np.isfinite(holding.required)].max())
    out["friction_used"] = float(holding.ratio[held].max())
    out["friction"] = float(holding.friction.min())
    return out


def holding_notes(wheels: Wheels, holding: Holding | str, facts: dict[str, float]) -> Iterator[str]:
    """What to know of them."""
    if isinstance(holding, str):
        yield holding
        return
    if not holding.held.any():
        return
    if "largest_adjust_torque" in facts:
        yield (
            "Torques are those that hold the body at rest: eq. (34), with its sign mended so that torque times rate is "
            "power, of the forces of least square that balance the weight within their friction cones. Eq. (35), shown "
            "beside them, takes an equal share of the weight for every wheel and is not conservative."
        )
    if holding.unknown:
        yield holding.unknown
    efforts = wheels.robot.efforts
    with np.errstate(invalid="ignore"):
        share = np.abs(holding.torques) / efforts
    for column in np.flatnonzero(share.max(axis=0) > 1.0):
        yield (
            f"Joint {wheels.robot.joints[column]} would have to hold "
            f"{np.abs(holding.torques[:, column]).max():.4g} N m and gives {efforts[column]:.4g} N m."
        )
