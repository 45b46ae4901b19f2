"""Test of the claim that shapes keep off the ground."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.check.report import Line
from bodyplan.check.shapes import EXACT, box_gaps, skeleton
from bodyplan.errors import InputError
from bodyplan.ground.near import segment_clearance_up_to
from bodyplan.motion import Claim, Motion


def clears(motion: Motion, positions: Array, claim: Claim) -> Line:
    """Smallest gap between the claimed boxes, capsules and spheres and the ground, at the claimed samples (all).

    Along capsules that of ``ground.segment_clearance``: exact, but on curved ground at 9 points of each; of boxes as in
    :func:`bodyplan.check.shapes.box_gaps`.
    """
    robot, given = motion.robot, claim.data.get("samples")
    samples = np.arange(len(motion.t)) if given is None else np.asarray(given).astype(np.int64)
    if not len(samples):
        return Line(claim.label, None, None, "", None, "no sample falls into it", kind=claim.kind)
    poses = robot.forward(motion.q[samples], motion.base[samples])
    contacts = {contact.name: contact for contact in robot.contacts}
    least, when, which = np.inf, 0, ""
    try:
        for name in map(str, claim.data["contacts"]):
            contact = contacts.get(name)
            if contact is None or contact.shape == "rim":
                why = "no box, capsule or sphere of the robot"
                return Line(claim.label, None, None, "", False, f"{name!r} is {why}", kind=claim.kind)
            if contact.shape == "box":
                gap = box_gaps(motion.ground, robot, contact, poses)
            else:
                gap = _slim(motion, skeleton(contact, robot, poses), contact.radius, least)
            if not which or gap.min() < least:
                least, when, which = float(gap.min()), int(gap.argmin()), name
    except InputError as error:  # beyond the edge of the ground
        return Line(claim.label, None, None, "", False, str(error), kind=claim.kind)
    limit = float(claim.data["required"])
    detail = f"{len(samples)} samples; closest: {which} at {motion.t[samples[when]]:.4g} s"
    return Line(claim.label, least, limit, "m", least >= limit - EXACT, detail, at_least=True, kind=claim.kind)


def _slim(motion: Motion, ends: Array, radius: float, least: float) -> Array:
    """Gaps (T,) m of a capsule around ``ends`` (T, 2, 3); any that are larger than ``least`` or than another's are not
    told apart."""
    over = ends[..., 2] - motion.ground.height(ends)
    i, k = np.unravel_index(int(over.argmin()), over.shape)
    most = min(least, float(motion.ground.clearance(ends[i, k])) - radius)
    each, back = np.unique(ends.reshape(len(ends), 6), axis=0, return_inverse=True)  # a leg that stands rests
    found = segment_clearance_up_to(motion.ground, each.reshape(-1, 2, 3), most + radius + EXACT) - radius
    return np.asarray(found[back.ravel()])
