"""From the steps of a crawl to a Motion: every joint exact in time, claims, loads, torques, and what to know."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bodyplan.arrays import Array, BoolArray
from bodyplan.errors import Status
from bodyplan.gaits.crawl.holding import holding
from bodyplan.gaits.crawl.legs import Legs, cross
from bodyplan.gaits.crawl.planner import Plan, Planner
from bodyplan.gaits.crawl.poses import base_of, seen_from, turned_back
from bodyplan.gaits.crawl.steps import blend, swing_path
from bodyplan.motion import Claim, Motion

if TYPE_CHECKING:
    from bodyplan.gaits.crawl.gait import Crawl

EXACT = 1e-9
#: m by which a margin may be smaller between the places at which the planner looks
BETWEEN = 1e-4


def motion_of(gait: Crawl, planner: Planner, plan: Plan, t: Array, period: float | None) -> Motion:
    """The motion of a planned crawl at times ``t`` (T,) s; ``period`` s where it repeats."""
    robot = planner.legs.robot
    at = _joints(planner.legs, plan, t)
    base, feet, standing, q, qd, placed = at.base, at.feet, at.standing, at.q, at.qd, at.placed
    solved = np.asarray(placed.all(axis=1))
    residual = np.linalg.norm(planner.legs.feet(q) - at.seen, axis=-1).max(axis=1)
    status = np.full(len(t), Status.OK.value, dtype="U24")
    limits = robot.limits
    beyond = (q < limits[:, 0] - EXACT) | (q > limits[:, 1] + EXACT)
    fast = np.abs(qd) / robot.rates
    status[beyond.any(axis=1) | (fast > 1.0 + EXACT).any(axis=1)] = Status.LIMIT.value
    status[~solved] = Status.OUT_OF_REACH.value
    if plan.status != Status.OK:
        status[t >= plan.time - 1e-12] = plan.status.value
    held = holding(planner.legs, q, base, standing)
    contacts = np.zeros((len(t), len(robot.contacts)))
    forces = None if held is None else np.zeros((len(t), len(robot.contacts), 3))
    for j, leg in enumerate(planner.legs.legs):
        contacts[:, leg.contact] = standing[:, j]
        if held is not None and forces is not None:
            forces[:, leg.contact, 2] = held.loads[:, j]
    return Motion(
        robot=robot,
        ground=planner.ground,
        gait=gait.to_dict(),
        t=t,
        base=base,
        q=q,
        qd=qd,
        qdd=at.qdd,
        residual=np.where(solved, residual, 0.0),
        status=status,
        claims=tuple(_claims(planner, plan, t, feet[..., 2], period)),
        contacts=contacts,
        forces=forces,
        torques=None if held is None else held.torques,
        facts=_facts(planner, plan, qd, period) | ({} if held is None else {"peak_holding_torque": held.peak}),
        stages=tuple(_stages(planner, plan, period)),
        notes=tuple(_notes(planner, plan, t, beyond, fast, ~placed)),
    )


def paces(planner: Planner, plan: Plan) -> tuple[float, float]:
    """Largest joint rates over their limits while a leg swings, and while the body moves, in the last cycle of a plan;
    0 without one."""
    steps = plan.steps[-len(planner.legs) :]
    if not steps:
        return 0.0, 0.0
    tau = np.linspace(0.0, 1.0, 25)
    spans = [(step.lift_off, step.touch_down) for step in steps] + [(step.begin, step.lift_off) for step in steps]
    t = np.concatenate([start + (end - start) * tau for start, end in spans])
    times, back = np.unique(t, return_inverse=True)
    fast = np.abs(_joints(planner.legs, plan, times).qd) / planner.legs.robot.rates
    most = fast.max(axis=1)[back].reshape(2, -1).max(axis=1)
    return float(most[0]), float(most[1])


class _Joints(NamedTuple):
    """A plan at times: ``base`` (T, 7); ``feet`` (T, m, 3) m in the world, ``seen`` from the base; which are
    ``standing`` (T, m); joints ``q``, ``qd``, ``qdd`` (T, n), and which feet are ``placed`` (T, m) by them."""

    base: Array
    feet: Array
    seen: Array
    standing: BoolArray
    q: Array
    qd: Array
    qdd: Array
    placed: BoolArray


def _joints(legs: Legs, plan: Plan, t: Array) -> _Joints:
    poses, first, second = _body(plan, t)
    feet, speed, change, standing = _feet(plan, t)
    base = base_of(poses)
    w, dw = (v[:, None] for v in _spin(poses, first, second))
    seen = seen_from(base, feet)
    moving = turned_back(base, speed - first[:, None, :3]) - cross(w, seen)
    rising = (
        turned_back(base, change - second[:, None, :3])
        - 2.0 * cross(w, moving)
        - cross(dw, seen)
        - cross(w, cross(w, seen))
    )
    q, placed = legs.place(seen, plan.guess)
    solved = placed.all(axis=1)
    qd, qdd = np.zeros_like(q), np.zeros_like(q)
    qd[solved], qdd[solved] = legs.rates(q[solved], moving[solved], rising[solved])
    return _Joints(base, feet, seen, standing, q, qd, qdd, placed)


def _feet(plan: Plan, t: Array) -> tuple[Array, Array, Array, BoolArray]:
    """Places m, velocities and accelerations (T, m, 3) of the feet, and which of them stand (T, m)."""
    stands = np.array([plan.feet, *(step.after for step in plan.steps)])
    done = np.searchsorted([step.touch_down for step in plan.steps], t, side="right")
    feet = stands[done]
    speed, change = np.zeros_like(feet), np.zeros_like(feet)
    standing = np.ones(feet.shape[:2], dtype=bool)
    if plan.steps:
        rows = np.flatnonzero(done < len(plan.steps))
        lift_off = np.array([step.lift_off for step in plan.steps])
        rows = rows[t[rows] > lift_off[done[rows]]]
        which = done[rows]
        leg, lift, early, span = np.array(
            [(step.leg, step.lift, step.early, step.touch_down - step.lift_off) for step in plan.steps]
        )[which].T
        swinging = rows, leg.astype(np.int64)
        tau = (t[rows] - lift_off[which]) / span
        path = swing_path(feet[swinging], stands[which + 1, swinging[1]], lift, early, tau)
        feet[swinging], speed[swinging], change[swinging] = (
            path[0],
            path[1] / span[:, None],
            path[2] / span[:, None] ** 2,
        )
        standing[swinging] = False
    return feet, speed, change, standing


def _body(plan: Plan, t: Array) -> tuple[Array, Array, Array]:
    """x, y, z, roll, pitch, yaw (T, 6) and their first and second derivatives."""
    rests = np.array([plan.first, *(step.pose for step in plan.steps)])
    if not plan.steps:
        return np.repeat(rests, len(t), axis=0), np.zeros((len(t), 6)), np.zeros((len(t), 6))
    begin, end = np.array([(step.begin, step.lift_off) for step in plan.steps]).T
    which = np.searchsorted(begin, t, side="left") - 1
    begun = which >= 0
    which = np.maximum(which, 0)
    span = (end - begin)[which]
    value, rate, gain = blend(np.clip((t - begin[which]) / span, 0.0, 1.0))
    moving = begun & (t < end[which])
    way = rests[which + 1] - rests[which]
    poses = rests[which] + value[:, None] * way
    return poses, (rate * moving / span)[:, None] * way, (gain * moving / span**2)[:, None] * way


def _spin(poses: Array, first: Array, second: Array) -> tuple[Array, Array]:
    """Angular velocity and acceleration (T, 3) in the body's axes, from roll, pitch, yaw and their derivatives."""
    roll, pitch = poses[:, 3], poses[:, 4]
    r1, p1, y1 = first[:, 3], first[:, 4], first[:, 5]
    r2, p2, y2 = second[:, 3], second[:, 4], second[:, 5]
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    turn = np.stack([r1 - y1 * sp, p1 * cr + y1 * cp * sr, y1 * cp * cr - p1 * sr], axis=1)
    gain = np.stack(
        [
            r2 - y2 * sp - y1 * p1 * cp,
            p2 * cr - p1 * r1 * sr + y2 * cp * sr - y1 * p1 * sp * sr + y1 * r1 * cp * cr,
            y2 * cp * cr - y1 * p1 * sp * cr - y1 * r1 * cp * sr - p2 * sr - p1 * r1 * cr,
        ],
        axis=1,
    )
    return turn, gain


def _stages(planner: Planner, plan: Plan, period: float | None) -> list[tuple[str, float, float]]:
    out = []
    for n, step in enumerate(plan.steps):
        if period is not None and step.begin >= period - 1e-9:
            break
        cycle = "" if period is not None else f", cycle {n // len(planner.legs) + 1}"
        name = planner.legs.names[step.leg]
        out += [(f"sway for {name}{cycle}", step.begin, step.lift_off)]
        out += [(f"{name} swings{cycle}", step.lift_off, step.touch_down)]
    return out


def _claims(planner: Planner, plan: Plan, t: Array, heights: Array, period: float | None) -> list[Claim]:
    legs = planner.legs.legs
    at_origin = [j for j, leg in enumerate(legs) if not np.any(leg.local)]
    names = [planner.legs.robot.frames[leg.frame] for leg in legs]
    out: list[Claim] = []
    for n, step in enumerate(plan.steps):
        if step.touch_down <= t[0]:
            continue
        if step.begin >= t[-1]:
            break
        stage = f"{planner.legs.names[step.leg]} swings, cycle {n // len(legs) + 1}"
        end = min(step.touch_down, float(t[-1]))
        window: dict[str, Any] = {"start": step.begin, "end": end, "every": None, "stage": stage}
        still = [names[j] for j in at_origin if j != step.leg]
        if still:
            data = {"frames": still, **window, "tolerance": EXACT}
            out.append(Claim("at_rest", f"standing feet at rest: {stage}", data))
        inside = (t > step.lift_off + EXACT) & (t < step.touch_down - EXACT)
        if step.leg in at_origin and inside.any() and t[0] <= step.lift_off and step.touch_down <= t[-1] + EXACT:
            # as far as the samples show it
            z = heights[:, step.leg]
            height = float(z[inside].max() - np.interp([step.lift_off, step.touch_down], t, z).max())
            if height > 0.0:
                data = {"frames": [names[step.leg]], **(window | {"start": step.lift_off}), "height": height,
                        "tolerance": EXACT}  # fmt: skip
                out.append(Claim("lifted", f"swinging feet clear of the ground: {stage}", data))
    if planner.legs.robot.mass > 0.0:
        asked = planner.margin - BETWEEN if planner.gait.sway == "auto" else 0.0
        out.append(Claim("supported", "the centre of mass is over the standing feet", {"required": asked}))
    out += _apart(planner)
    if period is not None and plan.status == Status.OK:
        turn = planner.course.yaw_rate * period
        (x0, y0), _ = planner.course.at(0.0)
        (x1, y1), _ = planner.course.at(period)
        c, s = np.cos(turn), np.sin(turn)
        advance = [float(x1 - (c * x0 - s * y0)), float(y1 - (s * x0 + c * y0)), 0.0]
        data = {"period": period, "advance": advance, "turn": turn, "tolerance": EXACT, "from_rest": True}
        out.append(Claim("periodic", "the cycle closes", data))
    return out


def _apart(planner: Planner) -> list[Claim]:
    """What the planner kept off the ground, by half as much as it did at the places it looked at."""
    if planner.shell is None:
        return []
    out = []
    ends_in_foot = planner.needed < planner.clearance
    for label, which in (("links and body clear of the ground", ~ends_in_foot), ("shins off the ground", ends_in_foot)):
        parts = [int(part) for part in np.flatnonzero(which)]
        if parts:
            data = {"contacts": [planner.shell.name(part) for part in parts],
                    "required": 0.5 * float(planner.needed[parts].min())}  # fmt: skip
            out.append(Claim("clears", label, data))
    return out


def _facts(planner: Planner, plan: Plan, qd: Array, period: float | None) -> dict[str, float]:
    count, cycle = len(planner.legs), planner.step_time * len(planner.legs)
    speed = float(np.hypot(*planner.course.velocity))
    out = {
        "speed": speed,
        "advance_per_cycle": speed * cycle,
        "turn_per_cycle": planner.course.yaw_rate * cycle,
        "cycle_time": cycle,
        "swing_time": planner.swing_time,
        "sway_time": planner.sway_time,
        "body_height": planner.height,
        "legs": float(count),
        "peak_joint_rate": float(np.abs(qd).max(initial=0.0)),
    }
    if period is not None:
        out["period"] = period
    if planner.shell is not None:
        out["clearance"] = planner.clearance
    if plan.steps:
        out["support_margin"] = min(step.margin for step in plan.steps)
        out["largest_sway_share"] = max(step.share for step in plan.steps)
        out["lift"] = max(step.lift for step in plan.steps)
    return out


def _notes(planner: Planner, plan: Plan, t: Array, beyond: BoolArray, fast: Array, lost: BoolArray) -> list[str]:
    notes = [
        "Feet that stand are fixed points: the joints follow from them and the body by exact inverse kinematics, so "
        "that nothing drifts (open-loop rates, as in the paper, slip by millimetres a minute).",
        "The centre of mass is that of the whole robot with its swinging leg; (19)-(22) put it at the body's frame."
        if planner.legs.robot.mass > 0.0
        else "The robot has no mass: its centre of mass is put at the body's frame, as in (19)-(22).",
    ]
    if planner.shell is None:
        notes.append(
            "Only feet are shapes of this robot: whether links or body touch anything is not looked at. Ready robots "
            "have shapes for them with shell = True."
        )
    if plan.status != Status.OK:
        notes.append(f"Stops at {plan.time:.4g} s: {plan.reason}.")
    for where, names, what in (
        (lost, planner.legs.names, "cannot reach its foothold or its way"),
        (beyond, planner.legs.robot.joints, "is beyond its limits"),
    ):
        if where.any():
            first = int(where.any(axis=1).argmax())
            name, count = names[int(where[first].argmax())], int(where.any(axis=1).sum())
            notes.append(f"From {t[first]:.4g} s on {name} {what} ({count} samples).")
    if (fast > 1.0 + EXACT).any():
        k, j = np.unravel_index(int(fast.argmax()), fast.shape)
        notes.append(
            f"{planner.legs.robot.joints[j]} is {fast[k, j]:.3g} times as fast as it may be at {t[k]:.4g} s: a slower "
            f"walk (about {100.0 / fast[k, j]:.2g} % of the speed), a lower step_height or another duty helps."
        )
    if plan.steps and planner.gait.sway != "auto" and min(step.margin for step in plan.steps) < 0.0:
        worst = min(plan.steps, key=lambda step: step.margin)
        name = planner.legs.names[worst.leg]
        notes.append(
            f"Tips: while {name} swings the centre of mass is {-1e3 * worst.margin:.4g} mm outside of its feet."
        )
    return notes
