"""Inching from bp.plan to bp.check: Figs. 8 and 11; for robots and gaits of many kinds anchors at rest by forward
kinematics of our own, and exact rates."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.motion import Motion
from rectilinear_cases import FEET, TIPS, failures, paper_snake, planned, snake, unit_ends

# --- the paper ---

FIGURES = {
    # spacing, drives mm; L1 left and right mm and angles deg after the tail's, the middle's, the head's move
    "Fig. 8": ((0.3, 0.7), [720, 1680, 1680], [(480, 2800), (2160, 1120), (2160, 2800)], [
        [83.107897, 166.21579, 128.68089, 91.145992],
        [57.316361, 114.63272, 131.05616, 147.47959],
        [57.316361, 114.63272, 102.88936, 91.145992],
    ]),
    "Fig. 11": ((1.0, 1.0), [2400, 2400, 2400], [(1600, 4000), (4000, 1600), (4000, 4000)], [
        [66.421822, 132.84364, 66.421822, 0.0],
        [0.0, 0.0, 66.421822, 132.84364],
        [0.0, 0.0, 0.0, 0.0],
    ]),
}  # fmt: skip


def printed(value: float) -> float:
    """To the eight digits that the figures have; what is below them is 0."""
    return float(f"{value:.8g}") if abs(value) > 1e-9 else 0.0


@pytest.mark.parametrize("figure", FIGURES)
def test_figures_through_the_whole_gait(figure: str) -> None:
    spacing, drives, lengths, angles = FIGURES[figure]
    gait = bp.Rectilinear(drive="paper", spacing=spacing, cycles=1)
    motion = bp.plan(paper_snake(), gait, bp.Plane(), np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0]))
    motion.raise_if_failed()
    facts = motion.facts
    at = unit_ends(motion, np.ones(10))
    for m, who in enumerate(("tail", "middle", "head")):
        assert printed(1e3 * facts[f"{who}_drive"]) == drives[m]
        found = [printed(1e3 * facts[f"{who}_move_{side}_length"]) for side in ("left", "right")]
        assert found == list(lengths[m])
        found = [printed(np.degrees(facts[f"{who}_move_joint_{k}_angle"])) for k in (1, 2, 3, 4)]
        assert found == angles[m]
        # and as a user sees them: joints 1, 3, 5, 7 after the move, and where the anchors are
        sample = 2 * (m + 1)
        signed = np.degrees([motion.q[sample, motion.robot.joints.index(f"pitch{i}")] for i in (1, 3, 5, 7)])
        np.testing.assert_allclose(np.abs(signed), angles[m], atol=5e-6)
        anchors = at[sample, [1, 5, 9], 0]
        np.testing.assert_allclose(1e3 * np.diff(anchors), lengths[m], atol=1e-9)
        np.testing.assert_allclose(1e3 * (at[sample] - at[sample - 2])[[1, 5, 9], 0][m], drives[m], atol=1e-9)
    assert failures(motion) <= {TIPS}


def test_the_rule_goes_on_with_other_drives() -> None:
    """720 in the first cycle, 1296 in the second, and on towards the head's 1680; equal spacings repeat."""
    gait = bp.Rectilinear(drive="paper", spacing=(0.3, 0.7))
    motion = bp.plan(paper_snake(), gait, bp.Plane(), np.arange(13.0)).raise_if_failed()
    tail = unit_ends(motion, np.ones(10))[:, 1, 0]
    steps = 1e3 * np.diff(tail)[0::3]
    np.testing.assert_allclose(steps[:2], [720, 1296], atol=1e-9)
    np.testing.assert_allclose(1680 - steps, (1680 - 720) * 0.4 ** np.arange(4), atol=1e-9)
    assert gait.period(paper_snake()) is None and "period" not in motion.facts
    equal = bp.Rectilinear(drive="paper")
    assert equal.period(paper_snake()) == 3.0
    assert failures(planned(paper_snake(), equal, cycles=2)) <= {TIPS}


def test_fixed_drives_stop_in_the_third_cycle() -> None:
    gait = bp.Rectilinear(drive=[0.72, 1.68, 1.68], spacing=(0.3, 0.7), lift=0)
    motion = bp.plan(paper_snake(), gait, bp.Plane(), bp.times(0, 12, dt=0.1))
    assert set(motion.status[motion.t < 7.0 - 1e-9]) == {"ok"}
    assert set(motion.status[motion.t > 7.0 - 1e-9]) == {"out_of_reach"}
    assert any("middle moves in cycle 3: out_of_reach" in note for note in motion.notes)
    assert np.isfinite(motion.q).all() and np.ptp(motion.q[motion.t > 7.0], axis=0).max() == 0.0
    with pytest.raises(bp.SolveError, match="out_of_reach"):
        motion.raise_if_failed()


def test_clearances_of_the_configurations() -> None:
    """1985.55 for 0.3 / 0.7, 1833.03 for 1 / 1, and 1998.2 where the middle is lifted by 150."""
    for spacing, lift, height in (((0.3, 0.7), 0.0, 1985.55), ((1.0, 1.0), 0.0, 1833.03)):
        gait = bp.Rectilinear(drive="paper", spacing=spacing, lift=lift, cycles=1)
        facts = bp.plan(paper_snake(), gait, bp.Plane(), np.arange(4.0)).facts
        assert 1e3 * facts["peak_elbow_height"] == pytest.approx(height, abs=0.01)
        assert facts["peak_body_height"] == pytest.approx(facts["peak_elbow_height"] + 2e-3)
    lifted = bp.Rectilinear(drive="paper", spacing=(0.3, 0.7), lift=0.15, cycles=1)
    motion = bp.plan(paper_snake(), lifted, bp.Plane(), np.linspace(1.0, 2.0, 1001))
    assert 1e3 * (unit_ends(motion, np.ones(10))[..., 2].max() - 1e-3) == pytest.approx(1998.2, abs=0.05)


# --- all gaits ---

GAITS: dict[str, tuple[Any, Any]] = {
    "fastest": (snake, {}),
    "sliding": (snake, {"lift": 0}),
    "five in a wave": (lambda: snake(5), {"anchors": 5}),
    "five in two phases": (lambda: snake(5), {"anchors": 5, "schedule": "two-phase"}),
    "seven in two phases": (lambda: snake(7, foot_radius=0.005), {"anchors": 7, "schedule": "two-phase"}),
    "four": (lambda: snake(4), {"anchors": 4}),
    "under a ceiling": (lambda: snake(5), {"anchors": 5, "schedule": "two-phase", "ceiling": 0.12, "dwell": 0.2}),
    "periodic": (snake, {"drive": "periodic", "spacing": 0.8}),
    "paper": (lambda: snake(5), {"anchors": 5, "drive": "paper", "spacing": 0.7}),
    "numbers": (snake, {"drive": [0.05] * 3, "spacing": (0.8, 0.9)}),
    "joint limits": (lambda: snake(limits=(-1.0, 1.0)), {}),
    "rates": (lambda: snake(rate=2.0), {}),
    "slow moves": (lambda: snake(rate=5.0), {"move_time": 2.0, "dwell": 0.5}),
    "to the left": (snake, {"heading": 2.0, "start": (0.3, -1.0)}),
    "thick": (lambda: bp.snake(10, 0.1, axes="alternating", first="pitch"), {}),
    "feet": (lambda: bp.snake(10, 0.1, **FEET), {}),
    "pitch only": (lambda: bp.snake(6, 0.1, axes="pitch", radius=0.01), {}),
    "universal": (lambda: bp.snake(6, 0.1, axes="universal", radius=0.01), {}),
    "more joints": (lambda: bp.snake(9, 0.1, axes="pitch", radius=0.01), {}),
    "unequal": (lambda: bp.snake(6, [0.1, 0.2, 0.08, 0.15, 0.12, 0.05], axes="pitch", radius=0.008), {}),
    "unequal under a ceiling": (
        lambda: bp.snake(6, [0.1, 0.2, 0.18, 0.15, 0.12, 0.05], axes="pitch", radius=0.008), {"ceiling": 0.09},
    ),
}  # fmt: skip


def lengths_of(robot: bp.Robot) -> np.ndarray:
    rest = robot.forward(np.zeros(robot.n)).positions[:, 0]
    return np.diff(np.unique(np.round(rest, 12)))


#: the gait objects of the fixture: one gait of one robot is searched once
MADE: dict[str, Any] = {}


@pytest.fixture(scope="module", params=list(GAITS), ids=list(GAITS))
def motion(request: Any) -> Motion:
    make, options = GAITS[request.param]
    gait = bp.Rectilinear(**options)
    found = planned(make(), gait, samples=181, cycles=1.5)
    MADE[repr(found.gait)] = gait
    return found


def test_passes_its_checks(motion: Motion) -> None:
    report = bp.check(motion)
    assert {line.what for line in report.failures} <= ({TIPS} if motion.facts["support_margin"] < 0.0 else set())
    passed = {line.kind for line in report if line.passed}
    assert "at_rest" in passed
    assert ("lifted" in passed) == (motion.facts["lift"] > 0.0)
    if "period" in motion.facts:
        assert "periodic" in passed


def test_anchors_rest_and_every_joint_is_where_the_motion_says(motion: Motion) -> None:
    """By forward kinematics of our own: all anchors but those that move, in every stage of the first cycle."""
    lengths = lengths_of(motion.robot)
    at = unit_ends(motion, lengths)
    poses = motion.poses()
    for unit in range(len(lengths)):
        np.testing.assert_allclose(poses[f"link{unit + 1}"][:, :3], at[:, unit + 1], atol=1e-12)
    count = int(motion.facts["anchors"])
    resting = [claim for claim in motion.claims if claim.kind == "at_rest"]
    assert len(resting) == len(motion.stages)
    for claim, (_, start, end) in zip(resting, motion.stages, strict=True):
        inside = (motion.t >= start) & (motion.t <= end)
        units = [int(name.removeprefix("link")) for name in claim.data["frames"]]
        moving = 1 if len(motion.stages) == count else (count + 1) // 2 if "odd" in claim.label else count // 2
        assert len(units) == count - moving
        assert np.ptp(at[inside][:, units], axis=0).max() < 1e-12
        # they stand on the floor, and the body is nowhere below it
        radius = -min(c.start[2] - c.radius for c in motion.robot.contacts)
        np.testing.assert_allclose(at[inside][:, units, 2], radius, atol=1e-12)
    assert at[..., 2].min() > radius - 1e-12


def test_rates_and_accelerations_are_exact(motion: Motion) -> None:
    gait = MADE[repr(motion.gait)]
    h = 1e-5 * motion.facts["cycle_time"]
    middle = np.linspace(0.007, 0.993, 47) * motion.facts["cycle_time"]
    edges = np.ravel([[start, end] for _, start, end in motion.stages])
    middle = middle[np.abs(middle[:, None] - edges).min(axis=1) > 20 * h]
    t = np.sort(np.concatenate([middle - h, middle, middle + h]))
    found = bp.plan(motion.robot, gait, motion.ground, np.concatenate([[0.0], t]))
    q, qd, qdd = found.q[1:], found.qd[1:], found.qdd[1:]
    scale = np.abs(motion.qd).max()
    np.testing.assert_allclose((q[2::3] - q[0::3]) / (2 * h), qd[1::3], atol=1e-6 * scale)
    np.testing.assert_allclose((qd[2::3] - qd[0::3]) / (2 * h), qdd[1::3], atol=1e-5 * np.abs(motion.qdd).max())
    at_edges = bp.plan(motion.robot, gait, motion.ground, np.unique(edges))
    assert np.abs(at_edges.qd).max() < 1e-9 * scale and np.abs(at_edges.qdd).max() < 1e-6 * np.abs(motion.qdd).max()


def test_joints_keep_their_limits_and_rates(motion: Motion) -> None:
    low, high = motion.robot.limits.T
    assert np.all(motion.q >= low - 1e-12) and np.all(motion.q <= high + 1e-12)
    assert np.all(np.abs(motion.qd) <= motion.robot.rates * (1.0 + 1e-12))
    if np.isfinite(motion.robot.rates).all() and motion.gait["move_time"] is None:
        used = np.abs(planned(motion.robot, MADE[repr(motion.gait)], samples=4001).qd) / motion.robot.rates
        assert used.max() > 0.999, "and use them"


def test_facts_are_those_of_the_motion(motion: Motion) -> None:
    facts, at = motion.facts, unit_ends(motion, lengths_of(motion.robot))
    k = int(np.argmin(np.abs(motion.t - facts["cycle_time"])))
    if "period" in facts and abs(motion.t[k] - facts["period"]) < 1e-9:
        moved = at[k, 0, :2] - at[0, 0, :2]
        along = np.array([np.cos(motion.gait["heading"]), np.sin(motion.gait["heading"])])
        np.testing.assert_allclose(moved, facts["advance_per_cycle"] * along, atol=1e-12)
        np.testing.assert_allclose(motion.q[k], motion.q[0], atol=1e-9)
        assert facts["speed"] == pytest.approx(facts["advance_per_cycle"] / facts["cycle_time"])
    np.testing.assert_allclose(at[0, 0, :2], motion.gait["start"], atol=1e-12)
    radius = max(c.radius for c in motion.robot.contacts)
    # facts are taken at places of their own, so that the highest of either may be missed by a little
    assert at[..., 2].max() - radius == pytest.approx(facts["peak_elbow_height"], rel=1e-3)
    assert np.abs(motion.qd).max() <= facts["peak_joint_rate"] * (1.0 + 1e-3)
    if motion.gait["ceiling"] is not None:
        assert facts["peak_elbow_height"] <= motion.gait["ceiling"] + 1e-12
