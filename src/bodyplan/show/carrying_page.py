"""The part of a report that shows a body on wheels: what each wheel does, what holds, what else would be in reach."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.carrying import Carrying
from bodyplan.show.text import NOTHING, counted, degrees, esc, figure, picture, plot, section, table

TITLE = "On its wheels"
#: smaller values, in any unit of the table, are shown as 0
ROUNDING = 1e-9


def carrying_section(found: Carrying | None, pictures: Mapping[str, str], *, paper: bool) -> str:
    """The section; empty for other gaits. ``pictures`` are the figures as SVG by name; ``paper``: whether the mission
    names what a paper prints."""
    if found is None:
        return ""
    out = f"<p>{_standing(found)}</p>" + _table(found)
    if "wheels_above" in pictures:
        out += picture(pictures["wheels_above"], "Ground, body and the tracks of the wheels' contacts from above")
    if any(found.adjusted):
        out += (
            "<h3>Angles and radii</h3>"
            + plot("wheel_angles", "Dotted: what the paper prints." if paper else "")
            + plot("wheel_radii")
        )
    if found.motion.torques is not None:
        out += (
            "<h3>Torques</h3>"
            + plot(
                "wheel_torques",
                "Adjusting motors, negative under load. Lines: eq. (34), with the forces of least square; bands: all "
                "torques for which some forces within the friction cones hold the body; dashed: the paper’s estimate "
                "(35).",
            )
            + plot("wheel_hubs", "What the hubs’ motors give, positive forward, to hold the body where it is.")
            + "<h3>Friction</h3>"
            + plot(
                "wheel_friction", "Friction over load of the planned forces, and the least μ for which any forces hold."
            )
        )
    out += "<h3>Rolling</h3>" + plot("wheel_spins", "Hubs that roll ahead without slip.")
    out += plot("wheel_slips", "How fast the rims are dragged sideways: no spin of the hubs takes that away.")
    out += plot("hull_clearance", "The smallest height of the hull over the ground.")
    if "wheels_maps" in pictures:
        (x, y), heading, height = found.place
        out += (
            "<h3>What is in reach</h3><p>Over the place in the middle of the way, "
            f"x = {figure(float(x), 'm', 3)}, y = {figure(float(y), 'm', 3)}, by heading and height of a level body; "
            f"the plan is at {degrees(heading)} and {figure(height, 'm', 3)} (cross).</p>"
            + picture(pictures["wheels_maps"], "Maps of reach, friction needed and tipping over heading and height")
        )
    return section("wheels", TITLE, out)


def _standing(found: Carrying) -> str:
    """How it stands, in a sentence or two."""
    facts = found.motion.facts
    if "required_friction" in facts:
        need, given = facts["required_friction"], facts["friction"]
        grip = f"with a friction of <b>{figure(need, digits=3)}</b> or more" if need > ROUNDING else "without friction"
        held = (
            f"At rest the body is held {grip} ({figure(given, digits=3)} is given), and its centre of mass stays "
            f"<b>{figure(facts.get('support_margin'), 'm', 3)}</b> inside the polygon of its contacts."
        )
    elif found.motion.forces is None:
        held = "Forces and torques were not computed: the notes say why."
    else:
        held = "Nothing holds the body at rest: the notes say when and why."
    if found.problem:
        held += f" Intervals are not shown: {esc(found.problem)}"
    return held


def _table(found: Carrying) -> str:
    rows = []
    for k, name in enumerate(found.names):
        turns = found.adjusted[k]
        rows.append(
            (
                esc(name),
                _span(np.degrees(found.angle[:, k]), "°") if turns else NOTHING,
                _span(1e3 * found.radius[:, k], "mm"),
                _span(np.abs(found.torque[:, k]), "N m") if turns else NOTHING,
                _span(np.abs(found.paper[:, k]), "N m") if turns else NOTHING,
                _most(found.hub[:, k], "N m"),
                _span(found.spin[:, k], "rad/s"),
                _most(found.slip[:, k], "m/s"),
                _most(found.used[:, k], ""),
            )
        )
    head = (
        "wheel",
        "angle q",
        "radius",
        "torque, (34)",
        "torque, (35)",
        "hub torque",
        "spin",
        "sideways slip",
        "friction / load",
    )
    lost = int(np.sum(found.motion.status != "ok"))
    note = f"<p>Of {counted(len(found.motion.t) - lost, 'sample')} that were solved.</p>" if lost else ""
    what = "<p>Smallest to largest; of hub torque, slip and friction the largest.</p>"
    return table(head, rows, numbers=range(1, len(head))) + what + note


def _span(values: Array, unit: str) -> str:
    some = _settled(values)
    if not len(some):
        return NOTHING
    low, high = float(some.min()), float(some.max())
    low = 0.0 if abs(low) < 1e-4 * abs(high) else low
    if high - low <= 5e-4 * max(abs(low), abs(high)):
        return figure(high, unit, 3)
    return f"{figure(low, digits=3)} to {figure(high, unit, 3)}"


def _most(values: Array, unit: str) -> str:
    some = np.abs(_settled(values))
    return figure(float(some.max()), unit, 3) if len(some) else NOTHING


def _settled(values: Array) -> Array:
    """Those that are known, without what is rounding."""
    some = values[np.isfinite(values)]
    return np.where(np.abs(some) < ROUNDING, 0.0, some)
