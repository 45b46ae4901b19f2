"""Claims of gaits that lift and stand: support of the centre of mass, and frames that rise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.check.claims import footing
from bodyplan.check.report import Line
from bodyplan.motion import Claim, Motion
from bodyplan.spatial import rotations

T = np.linspace(0.0, 4.0, 401)
ACROSS = [0.0, 1.0, 0.0]


def table(spread: float = 0.3, **body: Any) -> bp.Robot:
    """A body on four balls at x = +-spread, y = +-0.1, its mass at (0.05, 0.02, 0.1); a mast of two frames."""
    balls = [
        bp.Contact(name, "base", "sphere", 0.02, start=(spread * x, 0.1 * y, 0.0))
        for name, x, y in (("rl", -1, 1), ("rr", -1, -1), ("fl", 1, 1), ("fr", 1, -1))
    ]
    rows = {"mast": [bp.Row(d=bp.Joint("lift"), name="low"), bp.Row(d=bp.Joint("more"), name="high")]}
    mass = bp.Body(mass=2.0, com=(0.05, 0.02, 0.1), **body)
    return bp.Robot.from_rows(rows, contacts=balls, base_body=mass)


def motion_of(
    robot: bp.Robot, *claims: Claim, q: Any = None, base: Any = None, contacts: Any = None, t: Any = T
) -> Motion:
    shape = np.zeros((len(t), robot.n)) if q is None else np.asarray(q)
    pose = np.tile([0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0], (len(t), 1)) if base is None else np.asarray(base)
    zero, ok = np.zeros_like(shape), np.full(len(t), "ok")
    return Motion(robot, bp.Plane(), {}, t, pose, shape, zero, zero, np.zeros(len(t)), ok, claims, contacts)


def line_of(motion: Motion, what: str) -> Line:
    return bp.check(motion)[what]


# --- supported ---


def support(required: float = 0.0, along: Any = (1.0, 0.0, 0.0)) -> Claim:
    return Claim("supported", "stands", {"along": list(along), "required": required})


def test_the_margin_is_that_to_the_nearer_end() -> None:
    loaded = np.ones((len(T), 4), dtype=bool)
    line = line_of(motion_of(table(), support(0.1), contacts=loaded), "stands")
    assert line.passed and line.value == pytest.approx(0.25, abs=1e-12)
    assert line.limit == 0.1 and line.at_least and line.unit == "m" and "front" in line.detail
    loaded[:, 3] = False  # still a front foot on the other side
    assert line_of(motion_of(table(), support(), contacts=loaded), "stands").value == pytest.approx(0.25, abs=1e-12)
    sideways = line_of(motion_of(table(), support(along=ACROSS), contacts=np.ones((len(T), 4))), "stands")
    assert sideways.value == pytest.approx(0.08, abs=1e-12) and sideways.passed
    # turned with the robot
    turned = np.tile([1.0, 2.0, 0.02, *rotations.quaternion_exp([0.0, 0.0, 0.5 * np.pi])], (len(T), 1))
    there = line_of(motion_of(table(), support(along=ACROSS), base=turned, contacts=np.ones((len(T), 4))), "stands")
    assert there.value == pytest.approx(0.25, abs=1e-12)


def test_the_mass_moves_with_the_joints() -> None:
    rows = {"arm": [bp.Row(a=bp.Joint("out"), name="hand", body=bp.Body(mass=1.0, com=(0.0, 0.0, 0.0)))]}
    robot = bp.Robot.from_rows(rows, contacts=table().contacts, base_body=bp.Body(mass=1.0, com=(0.0, 0.0, 0.0)))
    out = np.linspace(0.0, 0.5, len(T))
    line = line_of(motion_of(robot, support(), q=out[:, None], contacts=np.ones((len(T), 4))), "stands")
    assert line.passed and line.value == pytest.approx(0.3 - 0.25, abs=1e-12) and "at 4 s" in line.detail


@pytest.mark.parametrize(("carrying", "way", "value"), [
    (("rl", "rr"), "forward", -0.35), (("fl", "fr"), "backward", -0.25),
])  # fmt: skip
def test_where_it_tips_and_which_way(carrying: tuple[str, ...], way: str, value: float) -> None:
    loaded = np.ones((len(T), 4), dtype=bool)
    loaded[250:300] = [c.name in carrying for c in table().contacts]
    line = line_of(motion_of(table(), support(-1.0), contacts=loaded), "stands")
    # it is below zero, and the claim allows that
    assert line.passed and line.value == pytest.approx(value, abs=1e-12)
    assert f"tips {way} at {T[250]:.4g} s" in line.detail
    failed = line_of(motion_of(table(), support(), contacts=loaded), "stands")
    assert failed.passed is False and failed.kind == "supported"


def test_the_margin_is_required_to_a_nanometre() -> None:
    loaded = np.ones((len(T), 4))
    assert line_of(motion_of(table(), support(0.25 + 5e-10), contacts=loaded), "stands").passed
    assert line_of(motion_of(table(), support(0.25 + 2e-9), contacts=loaded), "stands").passed is False


def test_nothing_that_carries_is_a_failure_and_nothing_to_tell_is_not_tested() -> None:
    loaded = np.ones((len(T), 4), dtype=bool)
    loaded[100:103] = False
    line = line_of(motion_of(table(), support(), contacts=loaded), "stands")
    assert line.passed is False and line.value is None and "at 1 s nothing carries" in line.detail
    without = line_of(motion_of(table(), support()), "stands")
    assert without.passed is None and "which contacts" in without.detail
    bare = bp.Robot.from_rows({"a": [bp.Row(theta=bp.Joint("x"), a=0.1)]}, contacts=table().contacts)
    massless = line_of(motion_of(bare, support(), contacts=np.ones((len(T), 4))), "stands")
    assert massless.passed is None and "no mass" in massless.detail


def pose(turn: Any, at: Any = (1.0, 2.0, 3.0)) -> np.ndarray:
    return np.array([[*at, *rotations.quaternion_exp(turn)]])


def test_the_lowest_points_of_shapes() -> None:
    x = np.array([1.0, 0.0, 0.0])
    capsule = bp.Contact("c", "f", "capsule", 0.1, start=(-0.4, 0.0, 0.0), end=(0.6, 0.0, 0.0))
    for turn, want in (
        (0.0, (0.6, 1.6)),
        (0.3, (1.0 + 0.6 * np.cos(0.3),) * 2),
        (-0.3, (1.0 - 0.4 * np.cos(0.3),) * 2),
    ):
        assert np.ravel(footing(capsule, pose([0.0, turn, 0.0]), x)) == pytest.approx(want, abs=1e-12)
    box = bp.Contact("b", "f", "box", start=(0.1, 0.0, 0.0), half=(0.2, 0.3, 0.1))
    assert np.ravel(footing(box, pose([0.0, 0.0, 0.0]), x)) == pytest.approx([0.9, 1.3], abs=1e-12)
    tipped = 1.0 + 0.3 * np.cos(0.2) - 0.1 * np.sin(0.2)  # nose down on its front edge
    assert np.ravel(footing(box, pose([0.0, 0.2, 0.0]), x)) == pytest.approx([tipped] * 2, abs=1e-12)
    rim = bp.Contact("r", "f", "rim", 0.2, start=(0.1, 0.0, 0.0))
    assert np.ravel(footing(rim, pose([0.0, 0.0, 0.0]), x)) == pytest.approx([0.9, 1.3], abs=1e-12)
    upright = pose([0.5 * np.pi, 0.0, 0.0])
    assert np.ravel(footing(rim, upright, x)) == pytest.approx([1.1, 1.1], abs=1e-12)
    leaning = footing(rim, pose([0.0, 0.4, 0.0]), x)
    assert np.ravel(leaning) == pytest.approx([1.0 + 0.3 * np.cos(0.4)] * 2, abs=1e-12)


# --- lifted ---


def lift(height: float, **changes: Any) -> Claim:
    data = {"frames": ["low", "high"], "start": 0.0, "end": 1.0, "every": None, "stage": "swing", "height": height,
            "tolerance": 1e-6} | changes  # fmt: skip
    return Claim("lifted", "lifts", data)


def risen(low: Any, more: Any = 0.0) -> np.ndarray:
    return np.stack(np.broadcast_arrays(low, np.asarray(more)), axis=1).astype(float)


def test_every_frame_rises_above_the_higher_of_both_ends() -> None:
    # from 0 over 0.10 to 0.04 in the first second: 0.06 above the higher end
    x = np.clip(T, 0.0, 1.0)
    q = risen(0.04 * x + 4.0 * x * (1 - x) * 0.078)
    rise = float(q[:101, 0].max() - 0.04)
    line = line_of(motion_of(table(), lift(0.05), q=q), "lifts")
    assert line.passed and line.value == pytest.approx(rise, abs=1e-12) and line.at_least
    assert line.limit == pytest.approx(0.05 - 1e-6) and "swing" in line.detail
    assert line_of(motion_of(table(), lift(rise + 5e-7), q=q), "lifts").passed
    failed = line_of(motion_of(table(), lift(rise + 2e-6), q=q), "lifts")
    assert failed.passed is False and failed.kind == "lifted"


def test_a_frame_that_stays_behind_is_named() -> None:
    x = np.clip(T, 0.0, 1.0)
    up = 0.1 * np.sin(np.pi * x) ** 2
    line = line_of(motion_of(table(), lift(0.09), q=risen(up, -0.3 * up)), "lifts")
    assert line.passed is False and line.value == pytest.approx(0.07, abs=1e-12) and "least: high" in line.detail
    # a frame that rises at another time is as good
    late = 0.1 * np.sin(np.pi * x) ** 4
    assert line_of(motion_of(table(), lift(0.09), q=risen(late)), "lifts").passed


def test_every_occurrence_inside_the_motion_counts() -> None:
    up = 0.1 * np.sin(np.pi * T) ** 2
    up[T > 2.0] *= 0.5  # the third and the fourth second
    line = line_of(motion_of(table(), lift(0.1, every=1.0), q=risen(up)), "lifts")
    assert line.passed is False and line.value == pytest.approx(0.05, abs=1e-12)
    assert "4 times" in line.detail and "from 2 s" in line.detail
    assert line_of(motion_of(table(), lift(0.1), q=risen(up)), "lifts").passed
    # windows that begin before or end after the motion are not there
    cut = line_of(motion_of(table(), lift(0.1, start=-0.5, end=0.5, every=2.0), q=risen(up)), "lifts")
    assert cut.passed is False and "1 times" in cut.detail  # 1.5 to 2.5 s
    beyond = line_of(motion_of(table(), lift(0.1, start=3.5, end=4.5), q=risen(up)), "lifts")
    assert beyond.passed is None and "no sample" in beyond.detail


def test_ends_between_samples_are_interpolated() -> None:
    t = np.linspace(0.0, 4.0, 41)
    z = 0.1 * t
    line = line_of(motion_of(table(), lift(0.0, start=0.05, end=1.05), q=risen(z), t=t), "lifts")
    assert line.value == pytest.approx(0.1 - 0.105, abs=1e-12)


def test_the_worst_of_several_stages_is_the_one_that_rises_least() -> None:
    up = np.where(T < 1.0, 0.1, 0.06) * np.sin(np.pi * T) ** 2
    claims = [
        Claim("lifted", f"feet are lifted: {i}", dict(lift(0.05, start=float(i), end=i + 1.0).data)) for i in (0, 1)
    ]
    line = line_of(motion_of(table(), *claims, q=risen(up)), "feet are lifted")
    assert line.what == "feet are lifted" and line.value == pytest.approx(0.06, abs=1e-12) and line.passed
    assert line.detail.startswith("2 stages; worst")
