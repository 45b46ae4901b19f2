"""Drives over level ground: the paper's rule, the largest stride that repeats and the fastest one, against searches by
brute force with geometry of their own; their margin of support."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import paper_drive
from bodyplan.gaits.rectilinear.demands import Demands
from bodyplan.gaits.rectilinear.holding import support_margin
from bodyplan.gaits.rectilinear.strides import cycle_of, fastest, largest_stride, start_spacings, stride_of
from rectilinear_cases import joints_by_hand, smooth

# --- the paper's rule ---


def test_the_rule_does_not_repeat_where_spacings_differ() -> None:
    np.testing.assert_allclose(paper_drive([1200, 2800]), [720, 1680, 1680], rtol=1e-15)
    gaps = np.array([1200.0, 2800.0])
    for _ in range(6):
        drives = paper_drive(gaps)
        after = gaps + np.diff(drives)
        assert after[0] == pytest.approx(0.4 * gaps[0] + 0.6 * gaps[1]) and after[1] == gaps[1]
        gaps = after
    np.testing.assert_allclose(paper_drive([2160, 2800]), [1296, 1680, 1680], rtol=1e-15)
    assert gaps[0] == pytest.approx(2800 - 1600 * 0.4**6)
    np.testing.assert_array_equal(paper_drive([2000.0] * 4), [1200.0] * 5)
    np.testing.assert_allclose(paper_drive([4000, 4000]), [2400] * 3, rtol=1e-15)
    np.testing.assert_allclose(paper_drive([1000, 2000], 0.5), [500, 1000, 1000], rtol=1e-15)


def test_fixed_drives_of_the_rule_break_in_the_third_cycle() -> None:
    """720, 1680, 1680 again and again: the middle anchor comes to 4080 mm from the tail, of 4000 that a leg has."""
    demands = Demands(np.full(4, 2000.0))
    gaps, statuses = np.array([1200.0, 2800.0]), []
    for _ in range(3):
        moves = cycle_of(gaps, np.array([720.0, 1680.0, 1680.0]), "wave", 0.0)
        statuses.append([str(s) for s in demands.met(moves)])
        longest = np.diff(moves.after[1, :, 0])[0]
        gaps = np.diff(moves.after[-1, :, 0])
    assert statuses[:2] == [["ok"] * 3] * 2 and statuses[2][:2] == ["ok", "out_of_reach"]
    assert longest == 4080.0


@pytest.mark.parametrize(("bad", "message"), [
    (([],), "spacings"), (([1.0, 0.0],), "spacings"), (([1.0, -1.0],), "spacings"), (([np.nan],), "finite"),
    (("ab",), "numbers"), (([1.0], 0.0), "share"), (([1.0], 1.0), "share"), (([1.0], "half"), "share"),
])  # fmt: skip
def test_refusals_of_the_rule(bad: Any, message: str) -> None:
    with pytest.raises(bp.InputError, match=message):
        paper_drive(*bad)


# --- geometry for brute force ---


def cycle_by_hand(long: Any, stride: float, schedule: str, lift: float, places: int) -> list[tuple[Any, Any]]:
    """Anchors (places, N, 2) of every move of a cycle, and which of them swing."""
    count = len(long) + 1
    short = np.where(np.arange(count - 1) % 2 == 1, stride, 0.0) if schedule == "two-phase" else 0.0
    x = np.concatenate([[0.0], np.cumsum(long - short)])
    u = smooth(np.linspace(0.0, 1.0, places))
    groups = [[i] for i in range(count)] if schedule == "wave" else [range(0, count, 2), range(1, count, 2)]
    out = []
    for group in map(list, groups):
        anchors = np.zeros((places, count, 2))
        anchors[..., 0] = x
        anchors[:, group, 0] += (stride * (u - np.sin(2 * np.pi * u) / (2 * np.pi)))[:, None]
        anchors[:, group, 1] = (lift * np.sin(np.pi * u) ** 2)[:, None]
        x = x.copy()
        x[group] += stride
        out.append((anchors, group))
    return out


def breaks(demands: Demands, long: Any, stride: float, schedule: str, lift: float, slack: float, places: int) -> str:
    """The demand that a cycle breaks on a dense grid, or nothing."""
    a, b = demands.links[0::2], demands.links[1::2]
    for anchors, _ in cycle_by_hand(long, stride, schedule, lift, places):
        chords = np.diff(anchors, axis=1)
        size = np.hypot(chords[..., 0], chords[..., 1])
        if (size - a - b).max() > slack:
            return "reach"
        if (np.maximum(np.abs(a - b), demands.nearest) - size).max() > slack:
            return "folded"
        joints = joints_by_hand(anchors, demands.links)
        assert np.isfinite(joints).all()
        heights = anchors[:, :-1, 1] + a * np.sin(np.cumsum(joints, axis=1)[:, 0:-1:2])
        low = np.minimum(anchors[:, :-1, 1], anchors[:, 1:, 1])
        if max((heights - low).max(), anchors[..., 1].max()) > demands.ceiling + slack:
            return "ceiling"
        if len(demands.limits):
            beyond = np.maximum(demands.limits[:, 0] - joints, joints - demands.limits[:, 1])
            if beyond.max() > slack:
                return "limit"
    return ""


def times_by_hand(demands: Demands, long: Any, stride: float, schedule: str, lift: float, least: float, n: int) -> Any:
    """s of every move, from differences of its joints."""
    out = []
    for anchors, _ in cycle_by_hand(long, stride, schedule, lift, n):
        joints = joints_by_hand(anchors, demands.links)
        out.append(max(least, (np.abs(np.diff(joints, axis=0)).max(axis=0) * (n - 1) / demands.rates).max()))
    return np.array(out)


# --- the largest stride ---


@pytest.mark.parametrize("schedule", ["wave", "two-phase"])
@pytest.mark.parametrize("count", [3, 5, 7])
def test_under_a_ceiling_the_optimum_is_what_it_leaves_between_long_and_short(count: int, schedule: str) -> None:
    """d = min(Lmax - Lmin), Lmin = sqrt(a^2 - c^2) + sqrt(b^2 - c^2): 800 and 535.90 mm under 1200 and 1000."""
    for ceiling, stride in ((1200.0, 800.0), (1000.0, 535.90)):
        demands = Demands(np.full(2 * count - 2, 2000.0), ceiling)
        assert 4000.0 - demands.least == pytest.approx(np.full(count - 1, stride), abs=5e-3)
        found = largest_stride(demands, demands.straight, schedule, 0.0)
        assert found == pytest.approx(4000.0 - 2.0 * np.sqrt(2000.0**2 - ceiling**2), rel=1e-12)
    unequal = Demands(np.resize([2000.0, 1500.0, 1800.0, 1400.0], 2 * count - 2), 1000.0)
    a, b = unequal.links[0::2], unequal.links[1::2]
    least = np.sqrt(a**2 - 1e6) + np.sqrt(b**2 - 1e6)
    assert largest_stride(unequal, unequal.straight, schedule, 0.0) == pytest.approx((a + b - least).min(), rel=1e-12)
    high = Demands(unequal.links, 1450.0)
    shorter = np.minimum(a, b)
    under = np.sqrt(np.maximum(a**2 - 1450.0**2, 0)) + np.sqrt(np.maximum(b**2 - 1450.0**2, 0))
    under = np.where(shorter > 1450.0, under, np.abs(a - b))
    np.testing.assert_allclose(high.least, under)


CASES = [
    # anchors, links, ceiling, limits, lift, share of straight
    (3, 1.0, np.inf, None, 0.15, 1.0), (3, 1.0, 0.6, None, 0.05, 1.0), (3, "unequal", 0.8, None, 0.15, 0.9),
    (5, 1.0, 0.4, None, 0.0, 1.0), (5, "unequal", 0.95, 1.0, 0.0, 1.0), (5, 1.0, np.inf, 0.9, 0.15, 1.0),
    (7, "unequal", 0.6, None, 0.05, 1.0), (7, 1.0, 0.95, 1.2, 0.05, 0.9), (5, "unequal", np.inf, None, 0.05, 1.0),
    (3, 1.0, 0.95, 1.5, 0.4, 1.0), (5, "unequal", 0.6, 1.3, 0.15, 0.7), (3, 1.0, np.inf, 0.8, 0.3, 0.98),
    (3, 1.0, 0.6, None, 0.6, 0.995), (3, 1.0, 0.9, 0.88, 0.8, 1.0),
]  # fmt: skip


@pytest.mark.parametrize("schedule", ["wave", "two-phase"])
@pytest.mark.parametrize("case", range(len(CASES)))
def test_the_largest_stride_meets_every_demand_and_a_larger_one_does_not(case: int, schedule: str) -> None:
    count, kind, ceiling, limit, lift, share = CASES[case]
    links = np.full(2 * count - 2, 1.0)
    if kind == "unequal":
        links = np.random.default_rng(case).uniform(0.8, 1.2, 2 * count - 2)
    limits = np.zeros((0, 2)) if limit is None else np.tile([-2.0 * limit, limit], (2 * count - 1, 1))
    demands = Demands(links, ceiling, limits, nearest=0.25)
    long = share * demands.straight
    found = largest_stride(demands, long, schedule, lift)
    top = float((long - demands.least).min())
    if found > 0.0:
        assert breaks(demands, long, found, schedule, lift, 1e-8, 4001) == ""
        assert breaks(demands, long, 1.001 * found, schedule, lift, 1e-10, 4001) != ""
    tried = np.linspace(0.0, max(top, 1e-3), 151)[1:]
    good = [d for d in tried if d <= top and breaks(demands, long, d, schedule, lift, 1e-10, 301) == ""]
    assert max(good, default=0.0) <= found * (1.0 + 1e-9)
    if not good:
        assert found < tried[0]


def test_no_larger_stride_than_asked_for() -> None:
    demands = Demands(np.ones(4), 0.9)
    free = largest_stride(demands, demands.straight, "wave", 0.1)
    assert largest_stride(demands, demands.straight, "wave", 0.1, 0.5 * free) == 0.5 * free
    assert largest_stride(demands, demands.straight, "wave", 0.1, 2.0 * free) == free
    assert largest_stride(demands, 0.5 * demands.straight, "wave", 0.1) == 0.0, "too tall to stand"


def test_cycles_begin_long_and_close() -> None:
    long = np.array([1.0, 1.1, 1.2, 1.3])
    np.testing.assert_array_equal(start_spacings(long, 0.3, "wave"), long)
    np.testing.assert_allclose(start_spacings(long, 0.3, "two-phase"), [1.0, 0.8, 1.2, 1.0])
    for schedule, groups in (("wave", [[0], [1], [2], [3], [4]]), ("two-phase", [[0, 2, 4], [1, 3]])):
        moves = cycle_of(start_spacings(long, 0.3, schedule), np.full(5, 0.3), schedule, 0.1)
        assert [list(np.flatnonzero(row)) for row in moves.moving] == groups
        np.testing.assert_array_equal(moves.before[1:], moves.after[:-1])
        np.testing.assert_allclose(moves.after[-1, :, 0] - moves.before[0, :, 0], 0.3, atol=1e-15)
        assert np.diff(moves.after[..., 0], axis=1).max(axis=0) == pytest.approx(long)


# --- the fastest gait ---

FAST = [
    # anchors, links, ceiling, limits, lift, rate, least s, dwell s, schedule
    (3, 1.0, np.inf, None, 0.15, 1.5, 1e-3, 0.3, "wave"), (3, 1.0, 0.8, None, 0.05, 2.5, 1e-3, 0.0, "two-phase"),
    (3, "unequal", 0.95, None, 0.0, 1.76, 1e-3, 0.3, "wave"), (5, 1.0, 0.6, 1.3, 0.05, 2.0, 1.0, 0.0, "two-phase"),
    (3, 1.0, 0.95, None, 0.15, 1.2, 1.0, 0.0, "wave"), (3, "unequal", 0.7, None, 0.05, 1.0, 0.2, 0.1, "two-phase"),
    (3, 1.0, 0.8, None, 0.0, 2.6, 1e-3, 0.0, "wave"),
]  # fmt: skip


@pytest.mark.parametrize("case", range(len(FAST)))
def test_no_gait_on_a_grid_is_faster_than_the_fastest(case: int) -> None:
    count, kind, ceiling, limit, lift, rate, least, dwell, schedule = FAST[case]
    links = np.full(2 * count - 2, 1.0)
    if kind == "unequal":
        links = np.random.default_rng(case).uniform(0.7, 1.3, 2 * count - 2)
    limits = np.zeros((0, 2)) if limit is None else np.tile([-2.0 * limit, limit], (2 * count - 1, 1))
    demands = Demands(links, ceiling, limits, np.full(2 * count - 1, rate), nearest=0.05)
    found = fastest(demands, demands.straight, schedule, lift, least, dwell)
    assert found is not None and found.status == "ok"
    long = found.spacings + (start_spacings(0 * found.spacings, 0.0, schedule) - start_spacings(
        0 * found.spacings, found.stride, schedule))  # fmt: skip
    assert np.all(long <= demands.straight * (1.0 + 1e-12))
    assert breaks(demands, long, found.stride, schedule, lift, 1e-8, 2001) == ""
    times = times_by_hand(demands, long, found.stride, schedule, lift, least, 4001)
    assert np.all(times <= found.durations * (1.0 + 1e-9)), "no joint is faster than it may"
    np.testing.assert_allclose(found.durations, times, rtol=2e-4)
    speed = found.stride / (found.durations.sum() + dwell * len(found.durations))
    assert found.speed(dwell) == pytest.approx(speed, rel=1e-12)
    scales = np.linspace(1.0, 0.25, 13)
    shapes = [(a, b) for a in scales for b in scales] if kind == "unequal" and count == 3 else [(a,) for a in scales]
    best = 0.0
    for shape in shapes:
        tried = demands.straight * np.resize(shape, count - 1)
        top = float((tried - demands.least).min())
        for stride in top * np.array([0.01, 0.1, 0.3, 0.5, 0.65, 0.8, 0.9, 0.97, 1.0]):
            if stride > 0.0 and breaks(demands, tried, stride, schedule, lift, 1e-10, 49) == "":
                time = times_by_hand(demands, tried, stride, schedule, lift, least, 97)
                best = max(best, stride / (time.sum() + dwell * len(time)))
    assert 0.0 < best <= 1.005 * speed


@pytest.mark.parametrize("schedule", ["wave", "two-phase"])
def test_without_rates_the_fastest_is_the_largest_stride(schedule: str) -> None:
    for lift, ceiling in ((0.0, 0.8), (0.2, 0.8), (0.2, np.inf)):
        demands = Demands(np.full(8, 1.0), ceiling, nearest=0.1)
        found = fastest(demands, demands.straight, schedule, lift, 1.5, 0.2)
        assert found is not None
        strides = [largest_stride(demands, s * demands.straight, schedule, lift) for s in np.linspace(0.5, 1.0, 21)]
        assert found.stride >= max(strides) * (1.0 - 1e-12)
        np.testing.assert_array_equal(found.durations, np.full(len(found.moves), 1.5))


def test_where_nothing_goes() -> None:
    demands = Demands(np.ones(4), 0.05, nearest=0.1)
    assert fastest(demands, 0.9 * demands.straight, "wave", 0.3, 1.0, 0.0) is None
    failing = stride_of(demands, 0.9 * demands.straight, 0.1, "wave", 0.3, 1.0)
    assert (failing.status, failing.failing) == ("above_ceiling", "tail moves")
    assert np.isfinite(failing.durations).all()


def test_durations_grow_with_rates_and_one_slow_joint() -> None:
    quick = Demands(np.ones(4), rates=np.full(5, 2.0))
    slow = Demands(np.ones(4), rates=np.array([2.0, 2.0, 0.5, 2.0, 2.0]))
    moves = cycle_of(np.array([1.6, 1.6]), np.full(3, 0.6), "wave", 0.1)
    first, second = quick.durations(moves, 1e-3), slow.durations(moves, 1e-3)
    assert np.all(second >= first) and second[0] > 2.0 * first[0]
    np.testing.assert_allclose(second[[0, 2]], second[[2, 0]], rtol=1e-9)  # tail and head mirror each other
    half = Demands(np.ones(4), rates=np.full(5, 1.0)).durations(moves, 1e-3)
    np.testing.assert_allclose(half, 2.0 * first, rtol=1e-12)
    np.testing.assert_array_equal(quick.durations(moves, 99.0), [99.0] * 3)
    some = Demands(np.ones(4), rates=np.array([np.inf, np.inf, 0.5, np.inf, np.inf])).durations(moves, 1e-3)
    assert np.all(some > 0.1)


# --- folding ---


def test_a_leg_of_unequal_links_does_not_fold_beyond_their_difference() -> None:
    demands = Demands(np.array([1.0, 0.4, 1.0, 0.4]))
    good = cycle_of(np.array([1.3, 1.3]), np.array([0.69, 0.5, 0.5]), "wave", 0.0)
    deep = cycle_of(np.array([1.3, 1.3]), np.array([0.71, 0.5, 0.5]), "wave", 0.0)
    assert demands.met(good)[0] == "ok" and demands.met(deep)[0] == "collapsed"


# --- support ---


def center_by_hand(anchors: Any, links: Any) -> Any:
    """Along the way, of links that are as heavy as they are long."""
    joints = joints_by_hand(anchors, links)
    at, angle, moment = anchors[:, 0, 0], 0.0, 0.0
    for k, length in enumerate(links):
        angle = angle + joints[:, k]
        moment = moment + length * (at + 0.5 * length * np.cos(angle))
        at = at + length * np.cos(angle)
    return moment / np.sum(links)


def least_margin(links: Any, long: Any, stride: float, schedule: str, lift: float) -> float:
    worst = np.inf
    for anchors, group in cycle_by_hand(long, stride, schedule, lift, 201):
        center, x = center_by_hand(anchors, links), np.delete(anchors[..., 0], group, axis=1)
        worst = min(worst, float(np.minimum(center - x.min(axis=1), x.max(axis=1) - center)[1:-1].min()))
        standing = np.ones(anchors.shape[:2], dtype=bool)
        standing[:, group] = False
        np.testing.assert_allclose(
            support_margin(anchors[..., 0], center, standing),
            np.minimum(center - x.min(axis=1), x.max(axis=1) - center), atol=1e-12,
        )  # fmt: skip
    return worst


def test_three_anchors_moved_one_by_one_never_have_a_positive_margin() -> None:
    """Where the centre of mass lies ahead of the middle anchor as the tail rises, it does as the head comes down."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        links = rng.uniform(0.5, 1.5, 4)
        low, high = np.abs(links[0::2] - links[1::2]), links[0::2] + links[1::2]
        long = low + (high - low) * rng.uniform(0.5, 0.999, 2)
        stride = rng.uniform(0.05, 0.95) * float((long - low).min())
        assert least_margin(links, long, stride, "wave", 0.01 * stride) < 1e-3 * stride


def test_published_margins() -> None:
    """-400 mm as the tail of 0.7 / 0.3 rises; 2300 mm of five anchors in two phases, legs of 3200 and 2000."""
    links = np.full(4, 2000.0)
    stance = np.array([[[0.0, 0.0], [2800.0, 0.0], [4000.0, 0.0]]])
    margin = support_margin(stance[..., 0], center_by_hand(stance, links), np.array([[False, True, True]]))
    np.testing.assert_allclose(margin, [-400.0], atol=1e-9)
    assert least_margin(np.full(8, 2000.0), np.full(4, 3200.0), 1200.0, "two-phase", 0.0) == pytest.approx(
        2300.0, abs=0.2
    )
