"""What a report says of a body that follows a curve: the overlay, the fit over a cycle, who touches when, arcs."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.metrics import metrics_of
from bodyplan.show.figures import write_figures
from bodyplan.show.fitted import Drawn
from bodyplan.show.following import Following
from bodyplan.show.following_page import following_section
from bodyplan.show.path import planned_path
from bodyplan.show.playback import Playback
from bodyplan.show.report import page
from bodyplan.show.scene import scene
from bodyplan.show.schedule import schedule, schedule_part
from bodyplan.show.shapes import arc_bones, arc_points, bones, ribbon
from report_cases import follower, outcome, roller, snake_motion, stick


@pytest.fixture(scope="module")
def playback() -> Playback:
    return Playback.of(follower(), None)


# --- curve and mechanism


def test_the_figures_are_those_of_the_fit(playback: Playback) -> None:
    motion, found = follower(), playback.following
    assert found is not None and found.cyclic and len(found.t) == 25 and len(found.keys) == 4
    gait = bp.SinusLifting(**{k: v for k, v in motion.gait.items() if k != "kind"})
    for i in (0, 7, 24):
        fit = gait.fit_at(motion.robot, float(found.t[i]))
        assert found.error[i] == fit.error and found.distance[i] == fit.max_distance
    text = following_section(found, {}).replace("\u00a0", " ")
    low, high = found.error.min(), found.error.max()
    assert f"between {low:.4g} and {high:.4g}" in text
    assert f"{1e3 * found.distance.max():.4g} mm" in text
    for drawn in found.keys:
        assert f"{1e3 * drawn.max_distance:.4g} mm" in text


def test_the_overlay_lies_where_the_robot_lies(playback: Playback) -> None:
    motion, found = follower(), playback.following
    assert found is not None
    for t, drawn in zip(found.key_times, found.keys, strict=True):
        i = int(np.abs(motion.t - t).argmin())
        origins = motion.robot.forward(motion.q[i], motion.base[i]).positions
        # every hinge is the origin of a frame
        gaps = np.linalg.norm(drawn.joints[:, None] - origins, axis=-1).min(axis=1)
        assert gaps.max() < 1e-9
        np.testing.assert_allclose(np.linalg.norm(drawn.curve - drawn.body, axis=1), drawn.distance, atol=1e-8)
        assert drawn.distance.max() <= drawn.max_distance * (1 + 1e-6)
        # E_nm is the mean distance over the length
        mean = np.trapezoid(drawn.distance, drawn.s) / drawn.s[-1] ** 2
        assert mean == pytest.approx(drawn.error, rel=2e-3)


def test_only_gaits_that_follow_a_curve_have_the_section() -> None:
    assert Playback.of(snake_motion(), None).following is None
    assert Playback.of(stick(), None).following is None
    assert following_section(None, {}) == ""


def test_a_motion_whose_gait_cannot_be_made_again_says_why() -> None:
    gait = {**follower().gait, "alpha": -1e9, "wavelength": -1.0}
    found = Following.of(follower().replace(gait=gait), 1.0, True)
    assert found is not None and "wavelength" in found.problem
    assert "wavelength" in following_section(found, {})


@pytest.mark.parametrize("joint", ["straight", "arc", "double"])
def test_turnings_meet_at_the_head(joint: str) -> None:
    robot = bp.snake(12, 0.1, joint, axes="universal")
    fit = bp.fit(bp.Spiral(length=1.2), robot)
    drawn = Drawn.of(fit)
    assert {turning.axis for turning in drawn.turnings} == {"pitch", "yaw"}
    for turning in drawn.turnings:
        mine = [i for i, name in enumerate(robot.joints) if name.startswith(turning.axis)]
        kink = fit.kink[0 if turning.axis == "pitch" else 1]
        assert turning.mechanism[-1] == pytest.approx(np.asarray(fit.q)[mine].sum() + kink, abs=1e-12)
        # eq. (7): the integral of the curvature
        _, pitch, yaw = fit.curve.integral(0.0, 1.2)
        assert turning.curve[-1] == pytest.approx(float(pitch if turning.axis == "pitch" else yaw), abs=1e-12)
    assert drawn.views == ("above", "the side", "the front")


def test_flat_curves_are_seen_from_above_or_from_the_side() -> None:
    for plane, view in (("yaw", "above"), ("pitch", "the side")):
        fit = bp.fit(bp.Serpenoid(1.0, plane=plane), bp.snake(8, 0.125, "arc", axes=plane))
        assert Drawn.of(fit).views == (view,)


# --- the curve in the replay


def test_the_path_is_the_curve_that_the_frames_lie_on(playback: Playback) -> None:
    path = planned_path(playback)
    assert path is not None
    claim = next(c for c in follower().claims if c.kind == "follows")
    origins = follower().poses().positions[:, [follower().robot.frame_index(f) for f in claim.data["frames"]]]
    step = np.linalg.norm(np.diff(path, axis=0), axis=1).max()
    gaps = np.linalg.norm(origins[::20, :, None] - path, axis=-1).min(axis=-1)
    assert gaps.max() < claim.data["tolerance"] + step
    assert scene(playback)["path"] is not None
    assert scene(Playback.of(snake_motion(), None))["path"] is None


def test_a_longer_replay_has_a_longer_path(playback: Playback) -> None:
    short = planned_path(playback)
    longer = Playback(**{**vars_of(playback), "t": playback.t * 3.0})
    path = planned_path(longer)
    assert short is not None and path is not None and path[-1, 0] > short[-1, 0] + 0.3


def vars_of(playback: Playback) -> dict[str, object]:
    return {name: getattr(playback, name) for name in Playback.__dataclass_fields__}


# --- who touches when


def test_the_schedule_is_the_plans(playback: Playback) -> None:
    found = schedule(playback)
    assert found is not None and follower().contacts is not None
    t, names, touching = found
    assert names == tuple(c.name for c in follower().robot.contacts)
    picked = np.searchsorted(follower().t, t - 1e-9)
    np.testing.assert_array_equal(touching, np.asarray(follower().contacts)[picked] > 0.5)
    text = schedule_part(playback).replace("\u00a0", " ")
    count = touching.sum(axis=1)
    assert f"{count.min():.4g} to {count.max():.4g} are" in text and f"{100 * touching.mean():#.3g} %" in text


def test_where_all_touch_there_is_no_schedule() -> None:
    motion = follower()
    everything = motion.replace(contacts=np.ones((len(motion.t), len(motion.robot.contacts))))
    assert schedule(Playback.of(everything, None)) is None
    assert schedule_part(Playback.of(motion.replace(contacts=None), None)) == ""


# --- arcs


@settings(max_examples=60, deadline=None)
@given(st.floats(-2.2, 2.2), st.floats(-2.2, 2.2), st.integers(0, 2**31))
def test_arcs_are_drawn_as_arcs(pitch: float, yaw: float, seed: int) -> None:
    robot = bp.snake(1, 0.3, "arc", axes="universal")
    turn = np.random.default_rng(seed).normal(size=4)
    base = np.array([0.1, -0.2, 0.3, *(turn / np.linalg.norm(turn))])
    q = [pitch, yaw] if robot.joints[0].startswith("pitch") else [yaw, pitch]
    start, end = robot.forward(q, base).array
    points = arc_points(start, end, 0.3, 401)
    np.testing.assert_allclose(points[[0, -1]], [start[:3], end[:3]], atol=1e-12)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert np.ptp(steps) < 1e-12 and steps.sum() == pytest.approx(0.3, rel=1e-4)
    # the middle is where an arc of half the length and half the bend ends
    half = bp.snake(1, 0.15, "arc", axes="universal").forward(0.5 * np.asarray(q), base).array[-1]
    np.testing.assert_allclose(points[200], half[:3], atol=1e-12)


def test_arcs_know_their_length_and_thickness() -> None:
    robot = bp.snake(3, [0.1, 0.2, 0.3], "arc", radius=0.04)
    assert arc_bones(robot) == {(0, 1): (0.1, 0.04), (1, 2): (0.2, 0.04), (2, 3): (0.3, 0.04)}
    assert list(arc_bones(robot)) == bones(robot)
    assert arc_bones(bp.snake(3, 0.1)) == {}
    data = scene(Playback.of(roller(), None))
    assert all(len(bone) == 4 for bone in data["bones"])


def test_a_ribbon_has_its_width() -> None:
    angle = np.linspace(0.0, 1.0, 201)
    line = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    polygon = ribbon(line, 0.1)
    sizes = np.hypot(*polygon.T)
    np.testing.assert_allclose(np.abs(sizes - 1.0), 0.1, atol=1e-4)


# --- the whole


@pytest.mark.parametrize("motion", [follower, roller], ids=["lifting", "rolling"])
def test_page_and_figures_of_a_follower(motion, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    made = outcome(None, motion())
    playback = Playback.of(made.motion, None)
    drawn = write_figures(made, playback, tmp_path)
    assert "curve_and_mechanism" in drawn
    text = page(made, playback, drawn)
    assert 'id="following"' in text and 'alt="Curve and mechanism at key times' in text
    visible = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    assert not re.search(r"\b(nan|None|null|undefined)\b", re.sub(r'src="[^"]*"', "", visible))
    plots = json.loads(re.search(r'id="plots-data">(.*?)</script>', text, re.S)[1])  # type: ignore[index]
    assert {"overlay", "turning", "fit_error"} <= set(plots)
    for name in re.findall(r'data-plot="(\w+)"', text):
        if name in ("overlay", "turning", "fit_error", "contacts"):
            assert name in plots
    assert metrics_of(made).plan == dict(made.motion.facts)
