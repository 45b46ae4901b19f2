"""Segment inverse kinematics: printed angles, landing on every anchor, near straight and folded, stairs, refusals."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.gaits.rectilinear import Transform, pose
from rectilinear_cases import anchors_of, chain, joints_by_hand

#: deg: angles 1 to 4 as printed, for anchors in mm after the tail's, the middle's and the head's move
PRINTED = {
    "Fig. 8, tail": ([1720, 2200, 5000], [83.107897, 166.21579, 128.68089, 91.145992]),
    "Fig. 8, middle": ([1720, 3880, 5000], [57.316361, 114.63272, 131.05616, 147.47959]),
    "Fig. 8, head": ([1720, 3880, 6680], [57.316361, 114.63272, 102.88936, 91.145992]),
    "Fig. 11, tail": ([3400, 5000, 9000], [66.421822, 132.84364, 66.421822, 0.0]),
    "Fig. 11, middle": ([3400, 7400, 9000], [0.0, 0.0, 66.421822, 132.84364]),
    "Fig. 11, head": ([3400, 7400, 11400], [0.0, 0.0, 0.0, 0.0]),
}


def printed(value: float) -> float:
    """To the eight digits that the figures have."""
    return float(f"{value:.8g}")


def landing(found: Any, anchors: Any, links: Any) -> float:
    """How far forward kinematics of the joints is from the anchors, relative to the longest link."""
    anchors = np.asarray(anchors, float)
    at = chain(anchors[..., 0, :], found.all_joints, np.broadcast_to(links, (2 * anchors.shape[-2] - 2,)))
    return float(np.abs(at[..., 0::2, :] - anchors).max() / np.max(links))


@pytest.mark.parametrize("figure", PRINTED)
def test_printed_angles(figure: str) -> None:
    x, angles = PRINTED[figure]
    found = pose([(v, 0.0) for v in x], 2000.0).raise_if_failed()
    signed = np.degrees(found.joints)
    assert [printed(v) for v in np.abs(signed)] == angles
    # nose-up, down at the elbow, up again at the middle anchor
    assert np.all(signed * [1, -1, 1, -1] >= 0.0) and found.closing >= 0.0
    assert found.all_joints.sum() == pytest.approx(0.0, abs=1e-15)
    assert landing(found, [(v, 0.0) for v in x], 2000.0) < 1e-15


def test_the_highest_configuration_is_not_the_straight_one() -> None:
    """0.3 / 0.7 needs 1985.55 mm of clearance, "config 1 is the highest" 1833.03."""
    peaks = {}
    for name, stances in {
        "1 / 1": ([3400, 5000, 9000], [3400, 7400, 9000], [3400, 7400, 11400]),
        "0.3 / 0.7": ([1720, 2200, 5000], [1720, 3880, 5000], [1720, 3880, 6680]),
    }.items():
        found = pose([[(v, 0.0) for v in x] for x in stances], 2000.0)
        peaks[name] = found.elbows[..., 1].max()
    assert peaks["1 / 1"] == pytest.approx(1833.03, abs=5e-3)
    assert peaks["0.3 / 0.7"] == pytest.approx(1985.55, abs=5e-3)


# --- forward kinematics of the joints lands on the anchors ---


@st.composite
def stances(draw: Any) -> tuple[np.ndarray, np.ndarray]:
    """Anchors (N, 2) and links (2 N - 2,) with legs from near folded to exactly straight, at any heights."""
    count = draw(st.integers(2, 9))
    scale = draw(st.sampled_from([1e-3, 0.2, 1.0, 2000.0]))
    least = draw(st.sampled_from([1.0, 0.5, 0.05]))
    lengths = st.floats(least, 1.0) if least < 1.0 else st.just(1.0)
    links = scale * np.array(draw(st.lists(lengths, min_size=2 * count - 2, max_size=2 * count - 2)))
    spans, rises = [], []
    for a, b in zip(links[0::2], links[1::2], strict=True):
        low, high = abs(a - b), a + b
        short = draw(st.one_of(
            st.floats(0.05, 0.95), st.sampled_from([1e-15, 1e-13, 1e-11, 1e-9, 1e-6, 1e-3]), st.just(0.0)
        ))  # fmt: skip
        length = high * (1.0 - short) if short <= 1e-3 else low + (high - low) * short
        slope = draw(st.floats(-1.4, 1.4))
        spans.append(length * np.cos(slope))
        rises.append(length * np.sin(slope))
    start = scale * np.array([draw(st.floats(-3, 3)), draw(st.floats(-3, 3))])
    return anchors_of(spans, rises, start), links


@given(stances())
def test_lands_on_every_anchor(stance: Any) -> None:
    anchors, links = stance
    found = pose(anchors, links)
    assert found.status in ("ok", "links_crossing")
    assert landing(found, anchors, links) < 1e-12
    at = chain(anchors[0], found.all_joints, links)
    size = links.max()
    np.testing.assert_allclose(found.points[:, [0, 2]], at, atol=1e-12 * size)
    np.testing.assert_allclose(found.elbows, at[1::2], atol=1e-12 * size)
    np.testing.assert_allclose(found.angles, np.cumsum(found.joints), atol=1e-12)
    assert abs(found.all_joints.sum()) < 1e-13
    # elbows are above the chords
    chords, arms = np.diff(anchors, axis=0), at[1::2] - anchors[:-1]
    assert np.all(chords[:, 0] * arms[:, 1] - chords[:, 1] * arms[:, 0] >= -1e-12 * size**2)


@given(st.lists(st.floats(-16.0, -5.0), min_size=1, max_size=6), st.floats(0.05, 1.0), st.floats(-1.0, 1.0))
def test_near_straight_and_near_folded_keep_their_digits(shares: list[float], ratio: float, slope: float) -> None:
    """Legs that are straight, or folded, but for 1e-16 to 1e-5 of their length: the elbow is as high as it must be."""
    gaps = 10.0 ** np.array(shares)
    links = np.tile([1.0, ratio], len(gaps))
    for length in ((1.0 + ratio) * (1.0 - gaps), abs(1.0 - ratio) + gaps * (1.0 + ratio)):
        if np.any(length**2 - (1.0 - ratio) ** 2 <= 2e-12 * (1.0 + ratio) ** 2):
            continue  # counts as collapsed
        anchors = anchors_of(length * np.cos(slope), length * np.sin(slope))
        found = pose(anchors, links)
        assert landing(found, anchors, links) < 1e-12
        # (4 area)^2 by Heron from the anchors as they are, against twice the area from the elbows
        chords, arms = np.diff(anchors, axis=0), found.elbows - anchors[:-1]
        twice = chords[:, 0] * arms[:, 1] - chords[:, 1] * arms[:, 0]
        for k, ((x0, z0), (x1, z1)) in enumerate(pairwise(anchors)):
            square = (mp.mpf(x1) - mp.mpf(x0)) ** 2 + (mp.mpf(z1) - mp.mpf(z0)) ** 2
            heron = ((1 + mp.mpf(ratio)) ** 2 - square) * (square - (1 - mp.mpf(ratio)) ** 2)
            assert abs(4.0 * twice[k] ** 2 - float(max(heron, 0))) < 1e-14


@given(stances(), st.floats(-np.pi, np.pi))
def test_any_heading_gives_the_same_joints(stance: Any, heading: float) -> None:
    anchors, links = stance
    flat = pose(anchors, links)
    along = np.array([np.cos(heading), np.sin(heading)])
    turned = np.concatenate([anchors[:, :1] * along, anchors[:, 1:]], axis=1)
    found = pose(turned, links, heading=heading)
    assert found.status == flat.status
    assert found.elbows.shape == (len(anchors) - 1, 3)
    size = links.max() + np.abs(anchors).max()
    np.testing.assert_allclose(found.elbows[:, :2], flat.elbows[:, :1] * along, atol=1e-7 * size)
    spread = np.linalg.norm(np.diff(found.points, axis=0), axis=1)
    np.testing.assert_allclose(spread, links, atol=1e-12 * size)
    np.testing.assert_allclose(found.points[0::2], turned, atol=1e-12 * size)
    if abs(np.cos(heading)) > 1e-6:  # without a heading the way nearest to +x is taken
        ahead = pose(turned, links)
        assert (ahead.status == "wrong_order") == (np.cos(heading) < 0.0)


def test_unequal_links_and_heights_against_the_law_of_cosines() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        count = int(rng.integers(2, 8))
        links = rng.uniform(0.5, 1.5, 2 * count - 2)
        low, high = np.abs(links[0::2] - links[1::2]), links[0::2] + links[1::2]
        length = low + (high - low) * rng.uniform(0.2, 0.9, count - 1)
        slope = rng.uniform(-1.2, 1.2, count - 1)
        anchors = anchors_of(length * np.cos(slope), length * np.sin(slope), rng.normal(size=2))
        np.testing.assert_allclose(pose(anchors, links).all_joints, joints_by_hand(anchors, links), atol=1e-12)


def test_batches_are_what_single_poses_are() -> None:
    rng = np.random.default_rng(8)
    links = rng.uniform(0.8, 1.2, 6)
    anchors = np.zeros((5, 3, 4, 2))
    anchors[..., 1:, 0] = np.cumsum(rng.uniform(0.1, 2.3, (5, 3, 3)), axis=-1)
    anchors[..., 1] = rng.uniform(-0.3, 0.3, (5, 3, 4))
    many = pose(anchors, links, floor=-0.5, ceiling=0.9, limits=(-2.4, 2.4), radius=0.05)
    assert many.joints.shape == (5, 3, 6) and many.closing.shape == (5, 3) and many.all_joints.shape == (5, 3, 7)
    assert many.elbows.shape == (5, 3, 3, 2) and many.points.shape == (5, 3, 7, 3) and many.angles.shape == (5, 3, 6)
    assert len(set(np.ravel(many.status))) >= 4, "the statuses of a batch are its own"
    for i, j in np.ndindex(5, 3):
        one = pose(anchors[i, j], links, floor=-0.5, ceiling=0.9, limits=(-2.4, 2.4), radius=0.05)
        assert one.status == many.status[i, j]
        np.testing.assert_array_equal(one.all_joints, many.all_joints[i, j])
        np.testing.assert_array_equal(one.elbows, many.elbows[i, j])
    assert not many.ok and not many.joints.flags.writeable
    first = int(np.flatnonzero(np.ravel(many.status) != "ok")[0])
    with pytest.raises(bp.SolveError) as caught:
        many.raise_if_failed()
    assert caught.value.index == first and caught.value.status == np.ravel(many.status)[first]


def test_no_poses_at_all() -> None:
    none = pose(np.zeros((0, 3, 2)), 1.0, floor=0.0, ceiling=2.0, limits=(-3, 3))
    assert none.joints.shape == (0, 4) and none.points.shape == (0, 5, 3) and none.ok


def test_points_in_space_and_transforms_are_the_same_anchors() -> None:
    flat = np.array([[0.0, 0.1], [1.5, 0.3], [2.6, 0.0]])
    spatial = np.insert(flat, 1, 0.7, axis=1)
    frames = np.tile(np.eye(4), (3, 1, 1))
    frames[:, :3, 3] = spatial
    frames[1, :3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]  # how an anchor is turned does not matter
    by_plane = pose(flat, 1.0)
    for anchors in (spatial, frames, Transform(frames)):
        found = pose(anchors, 1.0)
        np.testing.assert_array_equal(found.joints, by_plane.joints)
        np.testing.assert_allclose(found.elbows[:, [0, 2]], by_plane.elbows, atol=1e-15)
        np.testing.assert_allclose(found.elbows[:, 1], 0.7, atol=1e-15)


# --- stairs ---


def as_printed(anchors: np.ndarray, links: np.ndarray, *, equation: int) -> np.ndarray:
    """Joints with the middle one as printed in (58) or (65), all else signed and corrected."""
    found = pose(anchors, links)
    rises = np.diff(anchors, axis=0)
    left, right = np.arctan2(rises[:, 1], rises[:, 0])
    joints = found.all_joints.copy()
    both = joints[2] + left - right  # psi_L + psi_R
    joints[2] = both - left - right if equation == 58 else both + left + right
    return joints


@pytest.mark.parametrize("equation", [58, 65])
def test_the_printed_middle_joint_misses_the_head_on_stairs(equation: int) -> None:
    """It is out by twice the slope of one leg: with a step of 350 mm by 700 mm."""
    links = np.full(4, 2.0)
    up, down = ([0.0, 0.35], [0.35, 0.0])
    anchors = anchors_of([2.0, 2.0], up if equation == 58 else down)
    missed = np.linalg.norm(chain(anchors[0], as_printed(anchors, links, equation=equation), links)[-1] - anchors[-1])
    slope = np.arctan2(0.35, 2.0)
    assert missed == pytest.approx(2.0 * np.hypot(*np.diff(anchors, axis=0)[1]) * np.sin(slope), rel=1e-12)
    assert missed == pytest.approx(0.7, abs=0.012)
    ours = pose(anchors, links).raise_if_failed()
    assert np.abs(chain(anchors[0], ours.all_joints, links)[0::2] - anchors).max() < 1e-14
    # over level ground both are right
    level = anchors_of([2.0, 2.0], [0.0, 0.0])
    np.testing.assert_allclose(as_printed(level, links, equation=equation), pose(level, links).all_joints, atol=1e-15)


def test_signed_joints_on_stairs() -> None:
    """Joint 5 = psi_L + psi_R - alpha_L + alpha_R, the closing one beta_R - alpha_R."""
    a2, a3, a4, a5 = links = np.array([2.0, 1.8, 1.7, 2.1])
    anchors = anchors_of([2.5, 2.2], [0.4, -0.6])
    (l_left, l_right), (alpha_l, alpha_r) = (
        np.hypot(*np.diff(anchors, axis=0).T), np.arctan2(*np.diff(anchors, axis=0).T[::-1])
    )  # fmt: skip
    psi_l = np.arccos((a3**2 + l_left**2 - a2**2) / (2 * a3 * l_left))
    psi_r = np.arccos((a4**2 + l_right**2 - a5**2) / (2 * a4 * l_right))
    beta_l = np.arccos((a2**2 + l_left**2 - a3**2) / (2 * a2 * l_left))
    beta_r = np.arccos((a5**2 + l_right**2 - a4**2) / (2 * a5 * l_right))
    phi_l = np.arccos((a2**2 + a3**2 - l_left**2) / (2 * a2 * a3))
    phi_r = np.arccos((a4**2 + a5**2 - l_right**2) / (2 * a4 * a5))
    wanted = [beta_l + alpha_l, phi_l - np.pi, psi_l + psi_r - alpha_l + alpha_r, phi_r - np.pi, beta_r - alpha_r]
    np.testing.assert_allclose(pose(anchors, links).all_joints, wanted, atol=1e-14)


# --- one refusal after another ---

LEG = [2.0, 2.0]
A, B = (0.0, 0.0), (3.0, 0.0)


def status(anchors: Any, links: Any = 2.0, **options: Any) -> str:
    return str(pose(anchors, links, **options).status)


@pytest.mark.parametrize("unequal", [(2.0, 2.0), (2.0, 0.7), (0.3, 1.9)])
def test_out_of_reach(unequal: Any) -> None:
    a, b = unequal
    for slope in (0.0, 0.5):
        way = (a + b) * np.array([np.cos(slope), np.sin(slope)])
        assert status([A, way * (1.0 + 1e-13)], unequal) == "ok", "rounding is not out of reach"
        straight = pose([A, way], unequal)
        np.testing.assert_allclose(straight.all_joints, [slope, 0.0, -slope], atol=1e-7)
        beyond = pose([A, way * (1.0 + 1e-11)], unequal)
        assert beyond.status == "out_of_reach" and np.isnan(beyond.all_joints).all() and np.isnan(beyond.elbows).all()
        assert np.isfinite(beyond.points[0::2]).all()
    with pytest.raises(bp.SolveError, match="farther apart"):
        beyond.raise_if_failed()


def test_collapsed() -> None:
    assert status([A, (1e-7, 0.0)]) == "collapsed"
    assert status([A, (1e-5, 0.0)]) == "ok"
    assert status([A, A]) == status([A, B, B]) == "collapsed"
    assert status([A, (1.3, 0.0)], [2.0, 0.7]) == status([A, (1.2, 0.0)], [2.0, 0.7]) == "collapsed"
    assert status([A, (1.3 + 1e-6, 0.0)], [2.0, 0.7]) == "ok"
    assert np.isnan(pose([A, (1.2, 0.0)], [2.0, 0.7]).joints).all()


def test_wrong_order() -> None:
    assert status([B, A]) == status([A, B, (2.0, 0.0)]) == status([A, (0.0, 1.0)]) == "wrong_order"
    assert status([A, (-1e-9, 1.0)]) == "wrong_order"
    assert status([A, (1e-9, 1.0)]) == "ok"
    assert status([A, B, (3.0 + 1e-9, 1.0)]) in ("ok", "links_crossing")


def test_not_coplanar() -> None:
    level = np.array([[0.0, 0, 0], [1.5, 0, 0], [3.0, 0, 0]])
    for axis, off, wanted in ((1, 1e-8, "not_coplanar"), (1, 1e-10, "ok"), (2, 0.3, "ok")):
        anchors = level.copy()
        anchors[1, axis] += off
        assert status(anchors, 1.0) == wanted
    assert status(level, 1.0, heading=0.1) == "not_coplanar"
    assert status(level[:, [1, 0, 2]], 1.0) == status(level[:, [1, 0, 2]], 1.0, heading=np.pi / 2) == "ok"
    assert status(-level[:, [1, 0, 2]], 1.0) == "wrong_order"
    assert status(-level[:, [1, 0, 2]], 1.0, heading=-np.pi / 2) == "ok"


def test_joint_limits() -> None:
    anchors = [A, (2.0, 0.3), (4.5, 0.0)]
    joints = pose(anchors, 2.0).all_joints
    around = np.stack([joints - 1e-9, joints + 1e-9], axis=-1)
    assert status(anchors, limits=around) == "ok"
    assert status(anchors, limits=np.stack([joints, joints], axis=-1)) == "ok", "limits are closed"
    for k in range(5):
        for side in (0, 1):
            tight = around.copy()
            tight[k, side] = joints[k] + (1e-9 if side == 0 else -1e-9)
            assert status(anchors, limits=tight) == "limit", (k, side)
            tight[k, side] = -np.inf if side == 0 else np.inf
            assert status(anchors, limits=tight) == "ok"
    assert status(anchors, limits=(-3.0, 3.0)) == "ok" and status(anchors, limits=(-1.0, 1.0)) == "limit"


def test_above_ceiling() -> None:
    height = np.sqrt(2.0**2 - 1.5**2)
    assert status([A, B], ceiling=height * (1.0 + 1e-13)) == "ok"
    assert status([A, B], ceiling=height * (1.0 - 1e-11)) == "above_ceiling"
    assert status([A, B], ceiling=height + 0.1, radius=0.1) == "ok"
    assert status([A, B], ceiling=height + 0.1, radius=0.1001) == "above_ceiling"
    for open_sky in (None, np.inf, [(None, None), (9.0, 0.5)]):
        assert status([A, B], ceiling=open_sky) == "ok"
    # a lintel between the elbow and an anchor: no joint is near it, the link goes through
    at = 2.4
    link = height / 1.5 * (3.0 - at)
    for off, wanted in ((1e-6, "ok"), (-1e-6, "above_ceiling")):
        assert status([A, B], ceiling=[(None, 9.0), (at, link + off), (2.5, 9.0)]) == wanted
    assert status([A, B], ceiling=np.array([[0.0, 9.0], [at, link - 1e-6]])) == "above_ceiling"
    assert status([A, B], ceiling=-1.0) == "above_ceiling"


def test_below_floor_by_the_middle_of_a_link_over_an_edge() -> None:
    """All joints are clear of the floor, and the edge of a step reaches through a link."""
    height = np.sqrt(3.0)  # of an equilateral triangle
    anchors = [A, (2.0, 0.0)]

    def block(top: float) -> list[tuple[float, float]]:
        return [(-9.0, 0.0), (0.3, top), (0.6, 0.0)]

    edge = 0.3 * height
    found = pose(anchors, 2.0, floor=block(edge + 1e-6))
    assert found.status == "below_floor"
    clear = bp.Profile(block(edge + 1e-6)).clearance(found.points)
    assert clear.min() >= 0.0, "no joint touches"
    assert status(anchors, floor=block(edge - 1e-6)) == "ok"
    away = 0.05 / np.cos(np.pi / 3)  # the link is 0.05 from the edge when it passes that far above it
    lifted = [(x, z + 0.05) for x, z in anchors]
    assert status(lifted, floor=block(edge + 0.05 - away - 1e-6), radius=0.05) == "ok"
    assert status(lifted, floor=block(edge + 0.05 - away + 1e-6), radius=0.05) == "below_floor"
    assert status(anchors, floor=block(edge - 0.1), radius=0.05) == "below_floor", "the anchors' own radius counts"
    assert status(anchors, floor=-1e-9) == "ok" and status(anchors, floor=1e-9) == "below_floor"


def test_any_ground() -> None:
    assert status([A, B], ground=bp.Plane()) == "ok"
    assert status([A, B], ground=bp.Plane(slope=(0.01, 0.0))) == "below_floor"
    assert status([A, B], ground=bp.Surface("0.1 + 0*x")) == "below_floor"
    both = bp.Profile(floor=-0.1, ceiling=1.0)
    assert status([A, B], ground=both) == "above_ceiling" and status([A, (3.9, 0.0)], ground=both) == "ok"
    assert status([(0.0, -0.2), B], ground=both) == "below_floor"


def crossing(points: np.ndarray) -> bool:
    """Two links without a common joint meet, by solving for where their lines do."""
    segments = list(pairwise(points))
    for i, (p, q) in enumerate(segments):
        for r, s in segments[i + 2 :]:
            u, v = np.linalg.solve(np.stack([q - p, r - s], axis=-1), r - p)
            if 0.0 <= u <= 1.0 and 0.0 <= v <= 1.0:
                return True
    return False


def test_links_crossing() -> None:
    """Elbows of unequal links hang over the next leg, and over the one behind."""
    facing = pose([A, (1.0, 0.0), (2.0, 0.0)], [2.0, 1.2, 1.2, 2.0])
    assert facing.status == "links_crossing" and np.isfinite(facing.joints).all()
    assert facing.elbows[0, 0] > 1.0 > facing.elbows[1, 0]
    assert status([A, (1.0, 0.0), (2.0, 0.0)], [2.0, 1.2, 2.0, 1.2]) == "ok", "they lean the same way"
    assert status([A, (2.2, 0.0), (4.4, 0.0)], [2.0, 1.2, 1.2, 2.0]) == "ok", "they lean, and do not meet"
    touching = 2.0 * (2.0**2 - 1.2**2) ** 0.5  # elbows upright over the middle anchor
    assert status([A, (touching / 2, 0.0), (touching, 0.0)], [2.0, 1.2, 1.2, 2.0]) == "links_crossing"


def test_crossings_against_plain_intersections() -> None:
    rng = np.random.default_rng(2)
    count = {True: 0, False: 0}
    for _ in range(400):
        legs = int(rng.integers(2, 5))
        links = rng.uniform(0.2, 1.0, 2 * legs)
        low, high = np.abs(links[0::2] - links[1::2]), links[0::2] + links[1::2]
        spans = low + (high - low) * rng.uniform(0.02, 0.6, legs)
        found = pose(anchors_of(spans, np.zeros(legs)), links)
        expected = crossing(found.points[:, [0, 2]])
        assert found.status == ("links_crossing" if expected else "ok")
        count[expected] += 1
    assert min(count.values()) > 50
    # equal links keep their elbows between their anchors: they never cross
    for _ in range(50):
        legs = int(rng.integers(2, 6))
        links = np.repeat(rng.uniform(0.2, 1.0, legs), 2)
        assert pose(anchors_of(2 * links[::2] * rng.uniform(0.02, 1.0, legs), np.zeros(legs)), links).ok


def test_the_first_of_several_reasons_is_told() -> None:
    """In the order of the docstring: each stance breaks all later demands that it can, too."""
    tight = {"limits": (-0.01, 0.01), "floor": 0.5, "ceiling": 0.6}
    bent = np.array([[0.0, 0, 0], [1.0, 0.5, 0], [-1.0, 0, 0], [9.0, 0, 0]])
    assert status(bent, 2.0, **tight) == "not_coplanar"
    assert status(bent * [1, 0, 1], 2.0, **tight) == "wrong_order"
    folded = [0.0, 0.0], [9.0, 0.0], [9.0, 0.0]
    assert status(folded, 2.0, **tight) == "out_of_reach"
    assert status([A, A, (1.0, 0.0)], 2.0, **tight) == "collapsed"
    over = [A, (1.0, 0.0), (2.0, 0.0)]
    links = [2.0, 1.2, 1.2, 2.0]
    assert status(over, links, **tight) == "limit"
    assert status(over, links, floor=0.5, ceiling=0.6) == "links_crossing"
    assert status(over, 2.0, floor=0.5, ceiling=0.6) == "below_floor"
    assert status(over, 2.0, ceiling=0.6) == "above_ceiling"
    assert status(over, 2.0) == "ok"


REFUSED = {
    "no numbers": (("ab", 2.0), {}, "anchors: expected numbers"),
    "ragged": (([[0, 0], [1]], 2.0), {}, "anchors: expected numbers"),
    "not finite": (([A, (np.nan, 0.0)], 2.0), {}, "anchors: every value must be finite"),
    "one anchor": (([A], 2.0), {}, "anchors: needs at least two"),
    "four columns": (([[0, 0, 0, 0], [1, 0, 0, 0]], 2.0), {}, "anchors: expected points"),
    "no rows": (([0.0, 1.0], 2.0), {}, "anchors: expected points"),
    "no transforms": ((np.ones((2, 4, 4)), 2.0), {}, "anchors: not a rigid transform"),
    "links of no length": (([A, B], 0.0), {}, "links: must be > 0"),
    "a backward link": (([A, B], [2.0, -2.0]), {}, "links: must be > 0"),
    "a link too many": (([A, B], [2.0, 2.0, 2.0]), {}, "links: 2 anchors need one length or 2"),
    "no link": (([A, B], None), {}, "links"),
    "endless link": (([A, B], np.inf), {}, "links: every value must be finite"),
    "negative radius": (([A, B], 2.0), {"radius": -0.1}, "radius"),
    "no radius": (([A, B], 2.0), {"radius": np.nan}, "radius"),
    "no heading": (([A, B], 2.0), {"heading": "north"}, "heading"),
    "three limits": (([A, B], 2.0), {"limits": (1, 2, 3)}, r"limits: expected shape \(2,\) or \(3, 2\)"),
    "limits reversed": (([A, B], 2.0), {"limits": (1.0, -1.0)}, "limits: every low must be <= its high"),
    "limits no numbers": (([A, B], 2.0), {"limits": ("a", "b")}, "limits: expected numbers"),
    "limits nan": (([A, B], 2.0), {"limits": (np.nan, 1.0)}, "limits"),
    "two grounds": (([A, B], 2.0), {"floor": 0.0, "ground": bp.Plane()}, "ground: give either"),
    "no ground": (([A, B], 2.0), {"ground": "flat"}, "ground: expected a Ground"),
    "ceiling in the floor": (([A, B], 2.0), {"floor": 0.0, "ceiling": -1.0}, "ceiling: must be above the floor"),
    "steps backward": (([A, B], 2.0), {"floor": [(1.0, 0.0), (0.0, 1.0)]}, "ascending x"),
    "no levels": (([A, B], 2.0), {"ceiling": "high"}, "expected one z or steps"),
    "ceiling nan": (([A, B], 2.0), {"ceiling": np.nan}, "finite"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals(name: str) -> None:
    given_, options, message = REFUSED[name]
    with pytest.raises(bp.InputError, match=message):
        pose(*given_, **options)


@settings(max_examples=50)
@given(st.integers(2, 9), st.data())
def test_no_request_makes_a_traceback(count: int, data: Any) -> None:
    """Any finite anchors: a status and arrays of the right shape, NaN only in legs that cannot be."""
    anchors = data.draw(st.lists(st.tuples(st.floats(-4, 4), st.floats(-1, 1)), min_size=count, max_size=count))
    found = pose(anchors, 1.0, floor=-1.0, ceiling=1.5, limits=(-2.5, 2.5), radius=0.01)
    assert found.joints.shape == (2 * count - 2,) and found.points.shape == (2 * count - 1, 3)
    if found.ok:
        assert landing(found, anchors, 1.0) < 1e-12
    if np.isnan(found.all_joints).any():
        assert found.status in ("out_of_reach", "wrong_order", "collapsed")
