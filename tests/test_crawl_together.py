"""What a crawl's planner finds for many steps, samples or places at once is what it finds for each alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.gaits.crawl import planner as planning
from bodyplan.gaits.crawl.footholds import Footholds
from bodyplan.gaits.crawl.holding import GRAVITY, _shares, holding
from bodyplan.gaits.crawl.legs import Legs, legs_of
from bodyplan.gaits.crawl.motion import paces
from bodyplan.gaits.crawl.shell import shell_of
from bodyplan.gaits.crawl.steps import clear_swings, first_swings, swing_path
from bodyplan.robot.elements import Body
from bodyplan.robot.masses import center_of_mass
from bodyplan.robot.neighbours import separate_contacts
from bodyplan.spatial import apply
from bodyplan.spatial.segments import segment_box_clearance, segment_distance
from crawl_cases import ROUGH, five_legs, random_legs

STAIRS = bp.Profile([(None, 0.0), (0.45, 0.05), (0.7, 0.1)])
EDGE = bp.HeightMap(np.random.default_rng(0).uniform(0.0, 0.03, (21, 21)), 0.05, (-0.5, -0.5))


# --- steps ---


@pytest.mark.parametrize(
    ("robot", "gait", "ground", "until"),
    [
        (bp.silo4(shell=True), bp.Crawl((0.012, 0.0), foothold="search"), STAIRS, 60.0),
        (bp.hexapod(shell=True), bp.Crawl((0.012, 0.002), 0.02, clearance=0.015, foothold="search"), STAIRS, 40.0),
        (bp.silo4(shell=True), bp.Crawl((0.01, 0.0), foothold="search"),
         bp.Surface("0.175*exp(-60*((x-0.3)*(x-0.3)+y*y))"), 40.0),  # the body rises
        (bp.silo4(shell=True), bp.Crawl((0.01, 0.0), foothold="search", body="follow"), EDGE, 60.0),  # to the edge
        (five_legs(), bp.Crawl((0.01, -0.005), stability="barrier"), bp.Surface(ROUGH), 30.0),
    ],
)  # fmt: skip
def test_steps_planned_at_once_are_those_planned_one_by_one(monkeypatch, robot, gait, ground, until) -> None:
    found = []
    for at_once in (16, 3, 1):
        monkeypatch.setattr(planning, "AT_ONCE", at_once)
        found.append(gait.planner(robot, ground).made(until))
    one = found[-1]
    assert one.steps
    for plan in found[:-1]:
        assert (plan.status, plan.reason, plan.time) == (one.status, one.reason, one.time)
        assert np.abs(plan.first - one.first).max() < 1e-12 and np.abs(plan.feet - one.feet).max() < 1e-12
        for a, b in zip(plan.steps, one.steps, strict=True):
            assert (a.leg, a.lift, a.early, a.share) == (b.leg, b.lift, b.early, b.share)
            assert np.abs(a.pose - b.pose).max() < 1e-12 and np.abs(a.after - b.after).max() < 1e-12


def test_as_many_steps_as_there_is_time_for() -> None:
    planner = bp.Crawl((0.01, 0.0)).planner(bp.silo4(), bp.Plane())
    T = planner.step_time
    for until in (0.0, 1e-9, T, 2.0 * T, 3 * T, 7.0 * T, 2.5 * T, np.nextafter(3 * T, 9.0)):
        count = len(planner.made(until).steps)
        assert count * T >= until and (count == 0 or (count - 1) * T < until)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_one_cycle_tells_the_pace_of_all(seed: int) -> None:
    """Of walks that repeat, on level ground."""
    rng = np.random.default_rng(seed)
    robot = [bp.silo4(shell=True), bp.hexapod(shell=True), five_legs()][rng.integers(3)]
    gait = bp.Crawl(tuple(rng.uniform(-0.02, 0.02, 2)), rng.uniform(-0.05, 0.05), heading=rng.uniform(-3, 3), duty=0.9)
    planner = gait.planner(robot, bp.Plane())
    one, two = (planner.made((k * len(planner.legs) - 0.5) * planner.step_time) for k in (1, 2))
    if two.status == "ok":
        assert planner.repeats(one) and planner.repeats(two)
        assert paces(planner, one) == pytest.approx(paces(planner, two), abs=1e-12)
        # as it would not from another pose
        other = planning.Plan(one.legs, one.first + 1e-6, one.feet, one.steps, one.guess)
        assert not planner.repeats(other)


# --- footholds and swings ---


@pytest.mark.parametrize("ground", [bp.Plane(slope=(0.1, 0.3)), STAIRS, bp.Surface(ROUGH), EDGE])
@pytest.mark.parametrize("search", [0.0, 0.06])
def test_footholds_judged_at_once(ground, search) -> None:
    rng = np.random.default_rng(3)
    places, radii = rng.uniform(-0.6, 0.8, (40, 2)), rng.uniform(0.005, 0.03, 40)
    several, alone = (
        [Footholds(ground, place, radius, 0.3, search) for place, radius in zip(places, radii, strict=True)]
        for _ in range(2)
    )
    Footholds.look_ahead(several)
    for a, b in zip(several, alone, strict=True):
        assert a.first[1] == b.first[1]
        assert np.abs(a.first[0] - b.first[0]).max() < 1e-12


@pytest.mark.parametrize("ground", [STAIRS, bp.Surface("0.05*sin(9*x)*cos(8*y)"), bp.Profile(0.0, 0.08)])
def test_first_swings_are_the_first_of_all_clear_ones(ground) -> None:
    rng = np.random.default_rng(4)
    starts, ends = rng.uniform(0.2, 0.6, (2, 40, 3))
    ends[:, :2] = starts[:, :2] + rng.uniform(-0.35, 0.35, (40, 2))
    radii = rng.uniform(0.005, 0.02, 40)
    for at in (starts, ends):
        at[:, 2] = ground.height(at[:, :2])
        at += radii[:, None] * ground.normal(at)
    good = first_swings(ground, starts, ends, 0.04, radii)
    for a, b, radius, is_good in zip(starts, ends, radii, good, strict=True):
        every = list(clear_swings(ground, a, b, 0.04, radius))
        assert is_good == (every[:1] == [(0.04, 1.0)])
        # the least raised first, and as each is found alone
        assert [lift for lift, _ in every] == sorted(lift for lift, _ in every)
        for lift, early in every:
            place, _, _ = swing_path(a, b, lift, early, np.linspace(0.0, 1.0, 49)[1:-1])
            assert (ground.clearance(place) - radius).min() > -1e-8
    assert good.any() and not good.all()


def test_swings_beyond_the_edge() -> None:
    """A way that leaves the ground is none; ways before it are found."""
    start = np.array([[0.4, 0.0, float(EDGE.height(0.4, 0.0)) + 0.01]])
    with pytest.raises(InputError):
        first_swings(EDGE, start, start + np.array([0.2, 0.0, 0.0]), 0.05, np.array([0.01]))
    assert list(clear_swings(EDGE, start[0], start[0] + np.array([0.2, 0.0, 0.0]), 0.05, 0.01)) == []


def test_many_swings_are_those_alone() -> None:
    rng = np.random.default_rng(5)
    starts, ends = rng.normal(size=(2, 6, 1, 3))
    lifts, earlies = rng.uniform(0.0, 0.1, (6, 1)), rng.choice([1.0, 0.6, 0.35], (6, 1))
    tau = np.linspace(0.0, 1.0, 33)
    every = swing_path(starts, ends, lifts, earlies, tau)
    for k in range(6):
        alone = swing_path(starts[k, 0], ends[k, 0], float(lifts[k, 0]), float(earlies[k, 0]), tau)
        assert all(np.array_equal(a[k], b) for a, b in zip(every, alone, strict=True))


# --- shapes ---


def some_poses(robot, count: int, seed: int, widest: float = 0.8) -> np.ndarray:
    """Poses (S, F, 7) of a robot over the ground, some of which are as the one before."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-widest, widest, (count, robot.n))
    base = np.zeros((count, 7))
    base[:, :3] = rng.uniform([-0.4, -0.4, 0.1], [0.4, 0.4, 0.3], (count, 3))
    base[:, 3:] = rng.normal([1.0, 0.0, 0.0, 0.0], 0.1, (count, 4))
    base[:, 3:] /= np.linalg.norm(base[:, 3:], axis=1, keepdims=True)
    for k in np.flatnonzero(rng.random(count) < 0.6):
        if k > 0:
            base[k] = base[k - 1]
            stay = rng.random(robot.n) < 0.8
            q[k, stay] = q[k - 1, stay]
    return robot.forward(q, base).array


@pytest.mark.parametrize("ground", [bp.Plane(0.02, slope=(0.1, 0.0)), STAIRS, bp.Surface(ROUGH), EDGE])
def test_gaps_of_samples_that_repeat(ground) -> None:
    robot = bp.silo4(shell=True)
    shell = shell_of(legs_of(robot))
    poses = some_poses(robot, 60, 7)
    most = np.random.default_rng(8).uniform(0.0, 0.05, len(shell.parts))
    every = shell.gaps(ground, poses, most)
    alone = np.concatenate([shell.gaps(ground, poses[k : k + 1], most) for k in range(len(poses))])
    off = np.isinf(alone)
    assert np.array_equal(off, np.isinf(every)) and np.abs(every[~off] - alone[~off]).max() < 1e-12
    assert off.any() == (ground is EDGE)
    wanted = np.random.default_rng(9).random(every.shape) < 0.4
    some = shell.gaps(ground, poses, most, wanted)
    assert np.array_equal(some[wanted & off], every[wanted & off])
    assert np.abs(some[wanted & ~off] - every[wanted & ~off]).max() < 1e-12


def test_overlaps_against_all_pairs() -> None:
    robot = bp.silo4(shell=True)
    shell = shell_of(legs_of(robot))
    poses = some_poses(robot, 40, 11, 2.5)
    gaps = []
    for a, b in separate_contacts(robot):
        one, two = robot.contacts[a], robot.contacts[b]
        if one.shape == "box":
            one, two = two, one
        ends = world_ends(robot, poses, one)
        if two.shape == "box":
            pose = poses[:, robot.frame_index(two.frame)]
            back = np.concatenate([np.zeros((len(pose), 3)), pose[:, 3:] * [1.0, -1.0, -1.0, -1.0]], axis=1)
            local = apply(back[:, None], ends - pose[:, None, :3]) - np.array(two.start)
            gaps.append(segment_box_clearance(local, np.array(two.half)) - one.radius)
        else:
            gaps.append(segment_distance(ends, world_ends(robot, poses, two)) - one.radius - two.radius)
    least = float(np.min(gaps))
    assert least < 0.0
    for most in (np.inf, least + 1e-3):
        found, names = shell.overlap(poses, most)
        assert found == pytest.approx(least, abs=1e-12) and all(names)
    assert shell.overlap(poses, least - 1e-3) == (least - 1e-3, ("", ""))


def world_ends(robot, poses, contact) -> np.ndarray:
    """Ends (S, 2, 3) of the middle line of a capsule or ball."""
    ends = np.array([contact.start, contact.end if contact.shape == "capsule" else contact.start])
    return apply(poses[:, robot.frame_index(contact.frame), None], ends)


# --- statics ---


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-9, 1e-5, 1e-3, 0.1, 1.0]))
@settings(max_examples=60)
def test_shares_of_least_square(seed: int, width: float) -> None:
    """Feet all over the place, and all but in a line: as by the pseudoinverse of the balance."""
    rng = np.random.default_rng(seed)
    away = rng.normal(size=(7, 5, 2)) * [1.0, width] + rng.normal(size=(7, 1, 2)) * [1.0, width]
    turn = rng.uniform(0.0, 7.0) if width > 0.0 else 0.0
    away = away @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    standing = rng.random((7, 5)) < 0.6
    standing[:, :2] = True
    found = _shares(away, standing)
    assert not found[~standing].any()
    for at, on, share in zip(away, standing, found, strict=True):
        balance = np.concatenate([np.ones((1, on.sum())), at[on].T])
        want = np.linalg.pinv(balance)[:, 0]
        # as exact as the balance is well posed
        sizes = np.linalg.svd(balance, compute_uv=False)
        worst = sizes[0] / sizes[sizes > 1e-13 * sizes[0]].min()
        assert np.abs(share[on] - want).max() <= 1e-13 * worst * (1.0 + np.abs(want).max())


@pytest.mark.parametrize("seed", range(6))
def test_what_joints_hold_is_the_slope_of_the_energy(seed: int) -> None:
    """Virtual work: the weight of the legs, less the loads at the feet; any joints, scales, and slides."""
    rng = np.random.default_rng(seed)
    robot = [random_legs(rng), bp.silo4(), five_legs()][seed % 3]
    if robot.mass == 0.0:
        fields = ("theta", "d", "a", "epsilon")
        chains = {
            c.name: [
                bp.Row(**{f: getattr(row, f) for f in fields}, body=Body(mass=rng.uniform(0.5, 2.0)))
                for row in c.elements
            ]
            for c in robot.chains
        }
        robot = bp.Robot.from_rows(chains, contacts=robot.contacts, base_body=Body(mass=3.0))
    legs = Legs.of(robot)
    q = rng.uniform(-0.5, 0.5, (1, robot.n))
    base = np.array([[0.1, 0.2, 0.3, *rng.normal([1.0, 0.0, 0.0, 0.0], 0.2)]])
    base[:, 3:] /= np.linalg.norm(base[:, 3:])
    held = holding(legs, q, base, np.ones((1, len(legs)), dtype=bool))
    # at rest: the loads carry the weight, without a moment about the centre of mass
    center, feet = center_of_mass(robot, q, base)[0], apply(base[:, None], legs.feet(q))[0]
    assert held.loads.sum() == pytest.approx(robot.mass * GRAVITY)
    assert np.abs(held.loads[0] @ (feet - center)[:, :2]).max() < 1e-9 * robot.mass * GRAVITY

    def energy(at: np.ndarray) -> float:
        height = apply(base[:, None], legs.feet(at))[0, :, 2]
        return float(robot.mass * GRAVITY * center_of_mass(robot, at, base)[0, 2] - held.loads[0] @ height)

    h = 1e-6
    slope = [(energy(q + h * step) - energy(q - h * step)) / (2 * h) for step in np.eye(robot.n)]
    assert np.abs(held.torques[0] - slope).max() < 1e-6 * held.peak + 1e-7 * robot.mass * GRAVITY
