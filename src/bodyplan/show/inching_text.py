"""How a snake stands on its anchors, in words (HTML)."""

from __future__ import annotations

import numpy as np

from bodyplan.arrays import Array
from bodyplan.gaits.rectilinear import UnderCeiling
from bodyplan.show.inching import EXACT, Inching
from bodyplan.show.stages import plain_name
from bodyplan.show.text import counted, degrees, esc, figure, listed, percent
from bodyplan.simulate.trial import Trial

#: of a planned lift: what counts as clear of the floor, and as dragging
CLEARS, DRAGS = 0.8, 0.1
#: share of a link below which a margin is none
EDGE = 1e-6
#: cycles whose drives are told one by one
TOLD = 2


def standing(found: Inching) -> list[str]:
    """The margin, where it tips, what three anchors can never do and five can."""
    if found.margin is None:
        return ["Without masses, or feet under its anchors, nobody can tell where this robot tips."]
    k = int(found.margin.argmin())
    t, margin = float(found.t[k]), float(found.margin[k])
    when = f"at {figure(t, 's', 3)}" + (f", {esc(found.move_at(t))}" if found.move_at(t) else "")
    assert found.centre is not None
    if not found.tips(k):
        ahead = found.front[k] - found.centre[k, 0] < found.centre[k, 0] - found.rear[k]
        inside = f"<b>{figure(margin, 'm', 3)}</b> inside them at the least"
        if margin < EDGE * float(found.snake.links.max()):
            inside = "but <b>without any margin</b>"
        out = [
            f"The centre of mass is over the standing anchors all the time, {inside} "
            f"({when}, to the {'front' if ahead else 'rear'})."
        ]
    else:
        share = float(np.mean(found.margin < -EXACT))
        out = [
            f'<b class="bad">This gait tips {found.tips(k)}</b>: {when}, the centre of mass is '
            f"<b>{figure(-margin, 'm', 3)}</b> beyond the standing anchors. It is beyond them for {percent(share)} of "
            f"the time: {_where(found)}. Meanwhile the robot falls onto the anchors that swing; no torque of a joint "
            "can hold it."
        ]
    if found.gait.anchors == 3 and found.gait.schedule == "wave" and found.motion.facts.get("lift", 0.0) > 0.0:
        out.append(
            "Three anchors moved one by one never have a positive support margin in a gait that repeats: the tail can "
            "be lifted only while the centre of mass is ahead of the middle anchor, the head be set down only while it "
            "is behind it, and the body has the same shape at both times."
        )
    five = found.five if found.tips(k) or found.gait.anchors == 3 else None
    if five is not None:
        out.append(
            "<b>Five anchors in two phases</b> on links as long and as heavy, with legs of up to "
            f"{figure(five.spacing, 'm', 3)} and strides of {figure(five.stride, 'm', 3)}, keep it "
            f"{figure(five.margin, 'm', 3)} inside or more (anchors = 5, schedule = “two-phase”)."
        )
    return out


def _where(found: Inching) -> str:
    """The moves in which it tips, with the times; moves of one name are one item."""
    assert found.margin is not None
    groups: dict[str, list[Array]] = {}
    for move in found.moves:
        inside = found.inside(move)
        bad = found.t[inside][found.margin[inside] < -EXACT]
        if len(bad):
            groups.setdefault(plain_name(move[0]), []).append(bad)
    said = []
    for name, spells in groups.items():
        first = f"from {spells[0][0]:.3g} to {figure(float(spells[0][-1]), 's', 3)}"
        more = f" and {len(spells) - 1} times more" if len(spells) > 2 else ""
        if len(spells) == 2:
            more = f" and from {spells[1][0]:.3g} to {figure(float(spells[1][-1]), 's', 3)}"
        said.append(f"{esc(name)} {first}{more}")
    return listed(said)


def drives(found: Inching) -> str:
    """That the drives repeat, or how they change; empty where there is no whole cycle."""
    made = found.drives
    if not len(made):
        return ""
    if found.cyclic:
        each = figure(float(made[0].mean()), "m", 4)
        return f"In a cycle every anchor goes {each}, and the next cycle is like it."
    if made.shape[1] > 3 and not isinstance(found.gait.drive, tuple) and found.gait.drive != "paper":
        mean, low, high = (figure(float(x), "m", 3) for x in (made.mean(), made.min(), made.max()))
        return (
            f"In the mean of {counted(len(made), 'cycle')} an anchor goes {mean}, between {low} and {high}: where it "
            "lands depends on the ground."
        )
    told = [listed(figure(float(x), "m", 4) for x in row) for row in made[:TOLD]]
    said = f"The anchors go {told[0]} in the first cycle"
    if len(told) > 1:
        said += f", {told[1]} in the second"
        if found.gait.drive == "paper" and not np.allclose(made[0], made[1]):
            said += f": the {found.gait.share:.0%} rule <b>does not repeat</b> where the spacings differ"
    return said + "."


def physics(found: Inching, trial: Trial | None, peak: tuple[float, float] | None) -> str:
    """What physics says of lifts, slip and tilt; ``peak``: time s and angle rad of the largest tilt."""
    if trial is None:
        return ""
    if not trial.ok:
        return f'<span class="bad">The physics {esc(trial.status)}.</span>'
    parts = []
    lifts = [lift for lift in trial.lifts if lift.planned > 0.0]
    if lifts:
        least = min(lifts, key=lambda lift: lift.executed / lift.planned)
        ratio = least.executed / least.planned
        how = "clear the floor" if ratio >= CLEARS else "drag" if ratio < DRAGS else "rise less than they should"
        parts.append(
            f"the swinging anchors <b>{how}</b>: the lowest rises by {percent(ratio)} of what is planned "
            f"({figure(least.executed, 'm', 3)} of {figure(least.planned, 'm', 3)}, {esc(least.stage)})"
        )
    stroke = found.motion.facts.get("advance_per_cycle", 0.0)
    if trial.slips and stroke > 0.0:
        mean, far = max(abs(slip.along) for slip in trial.slips), max(slip.largest for slip in trial.slips)
        parts.append(
            f"those that stand slip by at most {figure(mean, 'm', 3)} along the way in a move, "
            f"<b>{percent(mean / stroke)} of the stroke</b> (none strays farther than {figure(far, 'm', 3)})"
        )
    if peak is not None:
        parts.append(f"the base tilts by up to {degrees(peak[1])} from the plan, at {figure(peak[0], 's', 3)}")
    return f"In physics {'; '.join(parts)}." if parts else ""


def holding(found: Inching, trial: Trial | None) -> str:
    """Peak torques, planned and executed."""
    torques = found.motion.torques
    if torques is None:
        return ""
    at = np.unravel_index(int(np.abs(torques).argmax()), torques.shape)
    said = (
        f"To hold the planned poses takes up to <b>{figure(float(np.abs(torques[at])), 'N m', 3)}</b> "
        f"({esc(found.motion.joints[at[1]])}, at {figure(float(found.motion.t[at[0]] - found.motion.t[0]), 's', 3)}): "
        "weights and loads of the anchors, without friction and without acceleration."
    )
    if trial is not None and trial.torque_peak is not None:
        k = int(trial.torque_peak.argmax())
        said += f" The servos give up to {figure(float(trial.torque_peak[k]), 'N m', 3)} ({esc(trial.joints[k])})."
    return said


def speeds(found: Inching, rows: list[UnderCeiling]) -> str:
    """What the table of speeds is of, and which drive fits from which height on."""
    gait = found.even_gait
    legs = "straight" if min(gait.spacing) == 1.0 else f"at most {min(gait.spacing):.3g} of straight"
    lift = figure(gait.lift_of(found.snake.demands(np.inf)), "m", 3)
    moving = "one after another" if gait.schedule == "wave" else "in two phases"
    body = found.snake.rest + found.snake.top
    fits = {
        drive: next((figure(row.ceiling, "m", 3) for row in rows if row.speed[drive] is not None), None)
        for drive in ("fastest", "periodic", "paper")
    }
    names = {"fastest": "the fastest drive", "periodic": "the periodic one", "paper": f"the {gait.share:.0%} rule"}
    said = [f"{names[d]} fits from {h} on" if h else f"{names[d]} fits under none of them" for d, h in fits.items()]
    other = "" if gait.spacing == found.gait.spacing else " (this gait’s own differ, so that it has no even speed)"
    return (
        f"{counted(gait.anchors, 'anchor')} {moving} over level ground, with legs that are {legs} at their "
        f"longest{other} and a lift of {lift}. Heights are those of the elbows’ axes above the anchors’; between floor "
        f"and ceiling the body needs {figure(body, 'm', 3)} more. Of the heights tried {listed(said)}: the rule takes "
        "the same share of a leg under every ceiling."
    )
