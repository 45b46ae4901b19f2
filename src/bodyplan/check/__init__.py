"""The judge: tests a Motion's claims from forward kinematics and the ground alone; never trusts the planner."""

from __future__ import annotations

from bodyplan.check import body
from bodyplan.check.claims import test_claim
from bodyplan.check.report import Line, Report
from bodyplan.motion import Motion

__all__ = ["Line", "Report", "check"]


def check(motion: Motion) -> Report:
    """Test a motion and everything it claims. Returns a :class:`Report`, one line a test; nothing raises."""
    positions = motion.robot.forward(motion.q, motion.base).positions
    lines: list[Line | None] = [
        body.solved(motion),
        body.plan_residual(motion),
        body.link_lengths(motion, positions),
    ]
    lines += [test_claim(motion, positions, claim) for claim in motion.claims]
    lines += [body.rates_agree(motion), *body.joint_limits(motion), body.self_clearance(motion)]
    lines += body.ground_clearance(motion)
    return Report(tuple(line for line in lines if line is not None))
