"""What a concertina plan claims of itself, for the judge to test; and what it says about the paper."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.cycle import CycleState
from bodyplan.gaits.stretching import StretchingBody
from bodyplan.gaits.sweep import ExtensionSweep, LiteralSweep, Sweep, Window
from bodyplan.motion import Claim

if TYPE_CHECKING:
    from bodyplan.gaits.concertina import Concertina, ConcertinaBody

#: m of drift allowed to a part that is at rest exactly
STILL = 1e-9
#: share of a link by which a smooth blend, which rounds the kinks of the curve, may leave the curve
ROUNDED = 0.2
#: share of a link that the front may drift while it and the rear are anchored together: the sum of two shapes keeps
#: its length exactly only where they do not overlap
NEARLY_STILL = 0.005


def claims_of(
    body: ConcertinaBody, state: CycleState, t: Array, tail: Array, joints: Array, walls: float | None
) -> tuple[Claim, ...]:
    """All claims of the plan sampled at ``t`` with the tail end at ``tail`` (T, 2) and joints (T, n + 1, 2), m."""
    return (
        *_on_curve(body, state, tail, joints),
        *_at_rest(body, t, joints),
        *_on_floor(),
        *_closes(body, t),
        *_presses(body, walls),
    )


def _on_curve(body: ConcertinaBody, state: CycleState, tail: Array, joints: Array) -> list[Claim]:
    """With one wave the launching body lies on the stretching curve, the landing one on the contracting curve."""
    sweep = body.sweep
    if body.gait.waves > 1:
        return []
    u, total = state.u, sweep.total
    out = []
    start = np.column_stack([tail, np.zeros(len(u))])
    launching, landing = np.flatnonzero(u <= sweep.launch_end), np.flatnonzero(u >= sweep.landing_start)
    out.append(
        _curve_claim(
            body,
            "joints on the stretching curve",
            sweep.front,
            launching,
            u[launching] + total,
            start,
            list(body.snake.frames),
        )
    )
    if isinstance(sweep, LiteralSweep):
        out.append(
            _curve_claim(
                body,
                "joints on the contracting curve",
                sweep.contraction,
                landing,
                u[landing],
                start,
                list(body.snake.frames),
            )
        )
    elif isinstance(sweep, ExtensionSweep):
        # read from the head: turned round by pi, and for odd N_B also flipped
        head = np.column_stack([joints[:, -1], np.full(len(u), np.pi)])
        out.append(
            _curve_claim(
                body,
                "joints on the contracting curve",
                sweep.back,
                landing,
                total - u[landing],
                head,
                list(body.snake.frames[::-1]),
                body.gait.reversal_sign,
            )
        )
    return [claim for claim in out if len(claim.data["samples"])]


def _curve_claim(
    body: ConcertinaBody,
    label: str,
    chain: StretchingBody,
    samples: IntArray,
    progress: Array,
    pose: Array,
    frames: list[str],
    flip: float = 1.0,
) -> Claim:
    p = chain.stages.parameters(np.clip(progress, 0.0, chain.stages.total))
    return Claim(
        "on_curve",
        label,
        {
            "curve": "concertina",
            "samples": samples.astype(np.float64),
            "parameters": {
                "body_gammas": p[:, 1:-1],
                "head_gamma": p[:, -1],
                "tail": p[:, 0],
                "omega": chain.omega,
                "crossing": chain.crossing,
                "rule": "cut",
                "lead": chain.lead,
            },
            "unit": body.unit,
            "pose": pose[samples],
            "flip": flip,
            "frames": frames,
            "tolerance": ROUNDED * float(body.snake.lengths.min())
            if body.gait.blend == "smooth"
            else 1e-9 * body.snake.length,
        },
    )


def _at_rest(body: ConcertinaBody, t: Array, joints: Array) -> list[Claim]:
    """Stage by stage, the joints that stand still: behind the extension, and ahead of it."""
    gait, cycle, sweep = body.gait, body.cycle, body.sweep
    n = len(body.snake.lengths)
    switch = cycle.time_of(cycle.switch)
    stations = body.contracted[:, 0]
    mirrored = stations[-1] - stations[::-1]
    begins = np.concatenate([[0.0], (0.5 + np.arange(gait.body_modules + 1)) * np.pi / gait.omega])
    nearly = NEARLY_STILL * float(body.snake.lengths.min())
    still = nearly if gait.blend == "smooth" else STILL
    out = []
    for window, wave, start, end in cycle.windows(_undisturbed(sweep)):
        if window.stretching:
            if wave != gait.waves - 1 or start >= switch - 1e-12:
                continue
            end = min(end, switch)
            resting = np.flatnonzero(stations <= begins[window.parameter] + 1e-12)
            tolerance, part = still, "rear"
        elif isinstance(sweep, LiteralSweep):
            # y = 0 upstream keeps everything flat until the tail's own stage
            resting = np.array([n]) if window.parameter == 0 else np.arange(n + 1)
            tolerance, part = still, "front"
        else:
            if wave != 0:
                continue
            resting = n - np.flatnonzero(mirrored <= begins[window.parameter] + body.lead + 1e-12)[::-1]
            tolerance, part = nearly, "front"
        if start >= t[-1] or end <= start:
            continue
        # where stretching and contracting parts overlap, their sum does not keep its length: no claim for what drifts
        inside = np.flatnonzero((t >= start - 1e-9) & (t <= end + 1e-9))
        if len(inside):
            drift = np.linalg.norm(joints[inside][:, resting] - joints[inside[:1]][:, resting], axis=-1).max(axis=0)
            resting = resting[drift <= tolerance]
        if not len(resting):
            continue
        out.append(
            Claim(
                "at_rest",
                f"{part} at rest: {window.name}",
                {
                    "frames": [body.snake.frames[int(i)] for i in resting],
                    "start": start,
                    "end": min(end, float(t[-1])),
                    "every": cycle.period,
                    "stage": window.name,
                    "tolerance": tolerance,
                },
            )
        )
    return out


def _undisturbed(sweep: Sweep) -> list[Window]:
    """Stages cut to the time in which no stage nearer to the resting part moves: stages may overlap."""
    literal = isinstance(sweep, LiteralSweep)
    out = []
    for stretch in (True, False):
        group = [w for w in sweep.windows if w.stretching == stretch]
        if stretch or literal:  # the moving part grows towards the anchor
            out += [replace(w, end=min(w.end, after.start)) for w, after in pairwise(group)] + group[-1:]
        else:  # the resting part grows behind the anchored head
            out += group[:1] + [replace(w, start=max(w.start, before.end)) for before, w in pairwise(group)]
    return [w for w in out if w.end > w.start]


def _on_floor() -> list[Claim]:
    return [Claim("on_floor", "the body lies on the floor", {"tolerance": 1e-9})]


def _closes(body: ConcertinaBody, t: Array) -> list[Claim]:
    advance = [float(x) * body.unit for x in body.cycle.advance] + [0.0]
    return [
        Claim(
            "periodic",
            "the cycle closes",
            {
                "period": body.cycle.period,
                "advance": advance,
                "turn": 0.0,
                "tolerance": 1e-9,
            },
        )
    ]


def _presses(body: ConcertinaBody, walls: float | None) -> list[Claim]:
    if walls is None or walls <= 0.0:
        return []
    return [Claim("presses", "folds press on the walls", {"role": "wall", "depth": walls})]


def notes_of(gait: Concertina, body: ConcertinaBody, walls: float | None) -> tuple[str, ...]:
    """Corrections of the paper that applied, and what to know about this plan."""
    notes = [
        "Eq. (2) is taken with its sign corrected (+sin): as printed the tail ends at -1 where module 1 starts at +1.",
        "Eq. (3): the value at a junction already carries the sign, so the factor (-1)^(i+1) is not applied again.",
        "A module that no longer crosses zero (gamma >= 0.676454) is followed to its own first zero and then y = 0; "
        "starting the straight line at the junction would jump by up to 0.0777 curve units.",
        "The tail multiplier changes at the same rate as gamma, so its stage lasts 1/gamma_max times a module's.",
    ]
    if gait.contraction == "literal":
        notes.append(
            "Section IV.B as printed: with y = 0 upstream the body stays flat until the last stage of the "
            "contraction and then folds at once, with nothing anchored but the head."
        )
    elif gait.contraction == "mirror":
        notes.append(
            "Contraction: the point reflection of the time-reversed stretching instead of section IV.B, whose "
            "printed order keeps the body flat for most of the contraction."
        )
    else:
        notes.append(
            "Contraction: a travelling extension wave instead of section IV: the whole body is never stretched "
            "at once, so that folds grip behind the wave and ahead of it."
        )
    if gait.blend == "smooth":
        notes.append(
            "The body curve has kinks where modules and the flat part meet. gamma changes by a C2 quintic, and "
            "the joint angles are a C2 spline through the fitted ones, so that accelerations are finite; joints "
            "leave the curve by a few per cent of a link while they round a kink."
        )
    if body.lead > 0.0:
        notes.append(
            f"The links are longer than the contracted curve: {body.lead * body.unit * 1e3:.3g} mm of the body "
            "stay straight."
        )
    if walls is not None and walls > 0.0:
        notes.append(
            f"The contracted body is {body.width * 1e3:.4g} mm wide, {walls * 2e3:.3g} mm more than the corridor: that "
            "squeeze is what grips."
        )
    elif walls is not None:
        notes.append(
            f"Warning: the contracted body is {body.width * 1e3:.4g} mm wide, {-walls * 2e3:.3g} mm less than the "
            "corridor: it does not touch the walls and has nothing to push against."
        )
    return tuple(notes)
