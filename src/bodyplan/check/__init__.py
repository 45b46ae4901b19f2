"""The judge: tests a Motion's claims from forward kinematics and the ground alone; never trusts the planner."""

from __future__ import annotations

from dataclasses import replace

from bodyplan.check import body
from bodyplan.check.claims import test_claim
from bodyplan.check.report import Line, Report
from bodyplan.check.shapes import self_clearance
from bodyplan.check.statics import torques_within
from bodyplan.errors import InputError
from bodyplan.motion import Motion

__all__ = ["Line", "Report", "check"]


def check(motion: Motion) -> Report:
    """Test a motion and everything it claims. Returns a :class:`Report`, one line a test; nothing raises."""
    if not isinstance(motion, Motion):
        raise InputError(f"motion: expected a Motion, got {motion!r}.")
    positions = motion.robot.forward(motion.q, motion.base).positions
    lines: list[Line | None] = [
        body.solved(motion),
        body.plan_residual(motion),
        body.link_lengths(motion, positions),
    ]
    lines += _gathered([test_claim(motion, positions, claim) for claim in motion.claims])
    lines += [
        *body.rates_agree(motion),
        *body.joint_limits(motion),
        torques_within(motion),
        self_clearance(motion),
    ]
    try:
        lines += body.ground_clearance(motion)
    except InputError as error:  # off the map
        lines.append(Line("on the ground's map", None, None, "", False, str(error), kind="ground"))
    return Report(tuple(line for line in lines if line is not None))


def _gathered(lines: list[Line | None]) -> list[Line]:
    """Lines called "part: stage" become one line a part: the worst of its stages, any failure first."""
    groups: dict[str, list[Line]] = {}
    for line in lines:
        if line is not None:
            groups.setdefault(line.what.partition(":")[0], []).append(line)
    out = []
    for part, group in groups.items():
        worst = min(group, key=lambda line: (line.passed is not False, line.passed is None, -_strain(line)))
        count = f"{len(group)} stages; " if len(group) > 1 else ""
        out.append(replace(worst, what=part, detail=f"{count}worst: {worst.detail}" if count else worst.detail))
    return out


def _strain(line: Line) -> float:
    if line.at_least and line.value is not None:
        return (line.limit or 0.0) - line.value
    return abs(line.value) / line.limit if line.value is not None and line.limit else 0.0
