"""From moves in time to a Motion: joints, base, contacts, claims, loads and what to know of the plan."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import Status
from bodyplan.gaits.rectilinear.extremes import Extremes, extremes
from bodyplan.gaits.rectilinear.holding import Holding, holding
from bodyplan.gaits.rectilinear.moves import bends
from bodyplan.gaits.rectilinear.sequence import Moment, Sequence
from bodyplan.gaits.rectilinear.snake import InchingSnake
from bodyplan.gaits.rectilinear.track import Track
from bodyplan.motion import Claim, Motion

if TYPE_CHECKING:
    from bodyplan.gaits.rectilinear.gait import Rectilinear

#: m or rad of error of a plan that is exact
EXACT = 1e-9
#: share of a lift that may lie between two samples, at least
BETWEEN = 0.02
#: places along a move at which its height is taken
PLACES = 201


def motion_of(gait: Rectilinear, snake: InchingSnake, track: Track, sequence: Sequence, t: Array) -> Motion:
    """The motion of ``snake`` on ``track`` at times ``t`` (T,) s."""
    robot = snake.robot
    moment = sequence.at(t)
    state = sequence.moves.state(snake.links, moment.which, moment.tau)
    shift = 0.0 if sequence.advance is None else moment.turns * sequence.advance
    anchors = state.anchors.copy()
    anchors[..., 0] += np.asarray(shift)[..., None]
    duration = moment.duration[:, None]
    q, qd, qdd = (
        snake.q(bends(values))
        for values in (state.angles, state.first / duration, state.second / (duration * duration))
    )
    base = np.zeros((len(t), 7))
    base[:, :3] = track.world(anchors[:, 0] - [snake.tail, 0.0])
    base[:, 3], base[:, 6] = np.cos(0.5 * gait.heading), np.sin(0.5 * gait.heading)
    poses = robot.forward(q, base)
    frames = [robot.frame_index(name) for name in snake.frames[0::2]]
    residual = np.linalg.norm(poses.positions[:, frames] - track.world(anchors), axis=-1).max(axis=1)
    status = np.full(len(t), Status.OK.value, dtype="U24")
    if sequence.status != Status.OK:
        failed = t >= (sequence.length - 1e-12 if _moves(sequence) else 0.0)
        status[failed] = sequence.status.value
    standing = _standing(sequence, moment)
    held = holding(snake, poses.array, track.along, track.world(anchors) @ track.along, standing)
    contacts, forces = carrying(snake, standing, held)
    most = extremes(sequence.moves, snake.links, PLACES)
    return Motion(
        robot=robot,
        ground=track.ground,
        gait=gait.to_dict(),
        t=t,
        base=base,
        q=q,
        qd=qd,
        qdd=qdd,
        residual=residual,
        status=status,
        claims=tuple(_claims(snake, track, sequence, most, t)) if _moves(sequence) else (),
        contacts=contacts,
        forces=forces,
        torques=None if held is None else held.torques,
        facts=_facts(gait, snake, sequence, most, held),
        stages=_stages(sequence),
        notes=tuple(_notes(gait, sequence, held, t)),
    )


def _moves(sequence: Sequence) -> bool:
    return bool(sequence.moves.moving.any())


def _standing(sequence: Sequence, moment: Moment) -> BoolArray:
    """(T, N) True for the anchors that carry: all but those that are lifted; at both ends of a move all stand."""
    under_way = (moment.tau > 0.0) & (moment.tau < 1.0)
    return np.asarray(~(sequence.moves.swinging[moment.which] & under_way[:, None]))


def carrying(snake: InchingSnake, standing: BoolArray, held: Holding | None) -> tuple[Array | None, Array | None]:
    """(T, c) 1 where a contact carries, and its force (T, c, 3) N: that of its anchor in equal shares."""
    count = len(snake.robot.contacts)
    if not any(snake.contacts[0::2]):
        return None, None
    carries, forces = np.zeros((len(standing), count)), np.zeros((len(standing), count, 3))
    for k, mine in enumerate(snake.contacts[0::2]):
        for contact in mine:
            carries[:, contact] = standing[:, k]
            if held is not None:
                forces[:, contact, 2] = held.loads[:, k] / len(mine)
    return carries, None if held is None else forces


def _stages(sequence: Sequence) -> tuple[tuple[str, float, float], ...]:
    starts = sequence.starts
    several = sequence.advance is None and len(sequence.cycle) > 0 and int(sequence.cycle.max()) > 0
    return tuple(
        (f"{name}, cycle {cycle + 1}" if several else name, float(a), float(a + d))
        for name, cycle, a, d in zip(sequence.moves.names, sequence.cycle, starts[:-1], sequence.durations, strict=True)
    )


def _claims(snake: InchingSnake, track: Track, sequence: Sequence, most: Extremes, t: Array) -> list[Claim]:
    moves = sequence.moves
    length, steps = sequence.length, _stages(sequence)
    every = length if sequence.advance is not None and sequence.repeats is None else None
    moving, swinging = moves.moving, moves.swinging
    over = most.height - np.maximum(moves.before[..., 1], moves.after[..., 1])
    between = float(np.diff(t).max(initial=0.0)) ** 2 / 8.0
    again = 1 if sequence.repeats is None else sequence.repeats
    names = snake.frames[0::2]
    out = []
    for turn in range(again):
        for m, (stage, start, end) in enumerate(steps):
            begin, stop = start + turn * length, end + turn * length
            if begin >= t[-1]:
                continue
            window: dict[str, Any] = {"start": begin, "end": min(stop, float(t[-1])), "every": every, "stage": stage}
            still = [names[i] for i in np.flatnonzero(~moving[m])]
            if still:
                data = {"frames": still, **window, "tolerance": EXACT}
                out.append(Claim("at_rest", f"standing anchors at rest: {stage}", data))
            lifted = np.flatnonzero(swinging[m])
            if len(lifted) and stop <= t[-1] + 1e-9:
                height = float(over[m, lifted].min())
                if height > 0.0:
                    # the top of a course that bends by z'' lies at most z'' dt^2 / 8 above the samples around it
                    bend = float(most.bend[m, lifted].max()) * ((PLACES - 1) / (end - start)) ** 2
                    missed = max(BETWEEN * height, bend * between)
                    data = {"frames": [names[i] for i in lifted], **window, "height": height,
                            "tolerance": min(missed, height)}  # fmt: skip
                    out.append(Claim("lifted", f"swinging anchors clear of the floor: {stage}", data))
    if every is not None and sequence.advance is not None:
        advance = [float(x) for x in sequence.advance * track.along]
        data = {"period": every, "advance": advance, "turn": 0.0, "tolerance": EXACT, "from_rest": True}
        out.append(Claim("periodic", "the cycle closes", data))
    if any(snake.contacts[0::2]) and snake.robot.mass > 0.0:
        data = {"along": [float(x) for x in track.along], "required": 0.0}
        out.append(Claim("supported", "the centre of mass is over the standing anchors", data))
    return out


def _facts(
    gait: Rectilinear, snake: InchingSnake, sequence: Sequence, most: Extremes, held: Holding | None
) -> dict[str, float]:
    """Numbers of the plan, SI."""
    moves = sequence.moves
    gone = float((moves.after[-1, :, 0] - moves.before[0, :, 0]).mean())
    cycles = 1 if sequence.advance is not None else int(sequence.cycle.max()) + 1
    low = np.minimum(moves.before[..., 1].min(axis=1), moves.after[..., 1].min(axis=1))
    high = most.elbow - low
    out = {
        "advance": gone * (sequence.repeats or 1),
        "advance_per_cycle": gone / cycles,
        "cycle_time": sequence.length / cycles,
        "speed": gone / sequence.length,
        "anchors": float(snake.anchors),
        "peak_elbow_height": float(high.max()),
        "peak_body_height": float(high.max()) + snake.top + snake.rest,
        "peak_joint_rate": float((most.rate / sequence.durations).max()),
        "lift": float(moves.lift.max(initial=0.0)),
    }
    if sequence.advance is not None:
        out["period"] = sequence.length
    for i, gap in enumerate(np.diff(moves.before[0, :, 0])):
        out[f"spacing_{i + 1}_length"] = float(gap)
    if snake.anchors == 3 and gait.schedule == "wave":
        out |= _table(snake, sequence)
    if held is not None:
        out["support_margin"] = float(held.margin.min())
        out["peak_holding_torque"] = float(np.abs(held.torques).max(initial=0.0))
    return out


def _table(snake: InchingSnake, sequence: Sequence) -> dict[str, float]:
    """The figures of the paper's tables (Figs. 8 and 11) for the first cycle: drives, and after each move the distances
    L1 and the joint angles 1 to 4, all printed as magnitudes."""
    moves = sequence.moves
    out = {}
    for m, who in enumerate(("tail", "middle", "head")[: len(moves)]):
        out[f"{who}_drive"] = float((moves.after[m, :, 0] - moves.before[m, :, 0]).max())
        after = moves.after[m]
        out[f"{who}_move_left_length"], out[f"{who}_move_right_length"] = (float(x) for x in np.diff(after[:, 0]))
        state = moves.state(snake.links, np.array([m]), np.ones(1))
        for k, angle in enumerate(np.abs(bends(state.angles)[0])[:4], start=1):
            out[f"{who}_move_joint_{k}_angle"] = float(angle)
    return out


def _notes(gait: Rectilinear, sequence: Sequence, held: Holding | None, t: Array) -> list[str]:
    notes = [
        "alpha of (35)-(38) is signed, and the joints are psi_L + psi_R - alpha_L + alpha_R in the middle and "
        "beta_R - alpha_R at the head: (58) and (65) as printed miss the head on stairs.",
        "(47)-(50) are taken with the denominators 2 a2 a3 and 2 a4 a5, (51) and (53) with the links of their side.",
    ]
    if gait.drive == "paper":
        notes.append(
            f"The {gait.share:.0%} rule: every anchor goes {gait.share:.0%} of the way to the next one ahead."
            + ("" if sequence.advance is not None else " With unequal spacings it does not repeat.")
        )
    if sequence.status != Status.OK:
        notes.append(f"Stops at {sequence.length if _moves(sequence) else 0.0:.4g} s. {sequence.reason}.")
    if gait.anchors == 3 and gait.schedule == "wave" and np.any(sequence.moves.lift > 0.0):
        notes.append(
            "Three anchors moved one by one never have a positive support margin: as far as the centre of mass lies "
            "ahead of the middle anchor when the tail is lifted, it lies ahead of it again when the head comes down."
        )
    if held is not None:
        k = int(held.margin.argmin())
        margin = float(held.margin[k])
        if margin < -EXACT:
            notes.append(
                f"Tips: at {t[k]:.4g} s the centre of mass is {-1e3 * margin:.4g} mm beyond the standing anchors."
                + (
                    ' Five anchors in two phases (anchors=5, schedule="two-phase") can stand around it all the time.'
                    if gait.anchors == 3
                    else ""
                )
            )
    return notes
