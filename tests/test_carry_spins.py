"""Angles of hubs: speeds integrated in panels that are halved where they must be, against closed forms, finer times."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.arrays import Array, IntArray
from bodyplan.gaits.carry.panels import ANGLE, PANEL, RADIUS, RATE, SPEED, Panels
from bodyplan.gaits.carry.spins import HALVINGS, Hubs
from bodyplan.gaits.carry.terrain import terrain
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.missions import load_mission

ROBOT = bp.tri_wheel()
Formula = Callable[[Array], Array]


@dataclass(frozen=True)
class Given(Hubs):
    """Hubs whose speeds are formulas, not a body's: the k-th one's is ``scales[k]`` times ``speed``."""

    speed: Formula = np.sin
    rate: Formula = np.cos
    scales: tuple[float, ...] = (1.0, -2.0, 0.5)

    def known(self, wheel: IntArray, when: Array, *, gains: bool) -> Array:
        scale = np.asarray(self.scales)[wheel]
        asked.append(len(when))
        # one contact angle and radius: no contact jumps
        return np.stack([scale * self.speed(when), scale * self.rate(when), 0.0 * when, 1.0 + 0.0 * when], axis=1)

    def turns(self, t: Array) -> Array:
        wheel = np.arange(len(self.scales))
        known = self.known(np.tile(wheel, len(t)), np.repeat(t, len(wheel)), gains=True)
        asked.clear()
        return self.turned(t, known.reshape(len(t), len(wheel), -1))


#: numbers of speeds that the last ``turns`` asked for
asked: list[int] = []


def given(speed: Formula, rate: Formula) -> Given:
    wheels = Wheels.of(ROBOT)
    return Given(wheels, terrain(bp.Plane()), lambda t: pytest.fail("no body"), speed, rate)


@pytest.mark.parametrize("t", [np.arange(0.0, 5.0, 0.047), np.array([0.0]), np.array([2.0, 2.0, 7.0]), np.array([0.3])])
def test_smooth_speeds_to_rounding_without_a_cut(t: Array) -> None:
    hubs = given(lambda s: 3.0 + np.sin(2.0 * s), lambda s: 2.0 * np.cos(2.0 * s))
    exact = 3.0 * t + 0.5 * (1.0 - np.cos(2.0 * t))
    np.testing.assert_allclose(hubs.turns(t), exact[:, None] * hubs.scales, rtol=1e-14, atol=1e-13)
    assert len(asked) <= 2  # inner ends and nodes


@pytest.mark.parametrize("power", [1, 2, 3, 4])
def test_speeds_that_bend(power: int) -> None:
    """max(0, s - c)^power bends at c, in the middle of nowhere."""
    t, rng = np.arange(0.0, 2.0, 0.047), np.random.default_rng(5)
    for c in rng.uniform(0.1, 1.9, 20):
        hubs = given(
            lambda s, c=c: np.maximum(0.0, s - c) ** power,
            lambda s, c=c: power * np.where(s > c, s - c, 0.0) ** (power - 1) * (s > c),
        )
        exact = np.maximum(0.0, t - c) ** (power + 1) / (power + 1)
        # the shortest panel leaves a share of the bend's own integral over it
        shortest = 0.047 / 2**HALVINGS
        atol = 1e-11 + 0.2 * shortest ** (power + 1)
        np.testing.assert_allclose(hubs.turns(t), exact[:, None] * hubs.scales, atol=atol)
        assert sum(asked) < 3 * (2 * len(t) + 12 * HALVINGS)  # only next to c


def test_speeds_that_jump() -> None:
    """A jump by 1 rad/s: off by less than it is over a quarter of the shortest panel; without halving by eight times
    as much."""
    t, rng, worst = np.arange(0.0, 2.0, 0.047), np.random.default_rng(6), 0.0
    for c in rng.uniform(0.1, 1.9, 50):
        hubs = given(lambda s, c=c: 1.0 * (s > c), lambda s: 0.0 * s)
        worst = max(worst, np.abs(hubs.turns(t)[:, 0] - np.maximum(0.0, t - c)).max())
        assert len(asked) == 1 + HALVINGS
    assert worst < 0.25 * PANEL / 2**HALVINGS


@pytest.mark.parametrize("name", ["carry-ramp", "carry-bump"])
def test_seams_of_paths_between_the_times(name: str) -> None:
    """The ease-in of a path ends within a panel: as exact as with times that leave no panel to speak of."""
    mission = load_mission(name)
    t = np.arange(0.0, 4.0, 0.047)
    fine = np.linspace(0.0, t[-1], 20 * (len(t) - 1) + 1)
    motion, finer = (bp.plan(mission.robot, mission.gait, mission.ground, times) for times in (t, fine))
    np.testing.assert_allclose(motion.q, finer.q[::20], atol=1e-10)


def test_contacts_that_jump_on_a_map() -> None:
    """A rover on rubble: contacts jump between stones, and the angles agree with ones in shorter panels."""
    mission = load_mission("carry-dem")
    t = np.arange(0.0, 5.0, 0.05)
    fine = np.linspace(0.0, t[-1], 20 * (len(t) - 1) + 1)
    motion, finer = (bp.plan(mission.robot, mission.gait, mission.ground, times) for times in (t, fine))
    columns = [motion.robot.joint_index(f"{name}.spin") for name in ("fl", "fr", "r")]
    off = motion.q[:, columns] - finer.q[::20, columns]
    assert np.abs(off).max() < 1e-3


#: a floor of narrow valleys with flanks of different slopes: rims hang between both
VALLEYS = bp.Surface("0.03*sin(40*x) + 0.02*sin(80*x + 1)")


def over_valleys(t: Array) -> bp.Motion:
    gait = bp.Carry([(0.0, 0.0), (1.0, 0.0)], height=0.16, speed=0.1)
    return bp.plan(ROBOT, gait, VALLEYS, t)


def test_contacts_that_jump_are_cut_where_they_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    """Just before and just after the time that is found the nearest contacts are those two, and as near."""
    found: list[tuple[Hubs, IntArray, Array, Array]] = []
    jumps = Hubs.jumps

    def spied(self: Hubs, panels: Panels, inner: Array) -> tuple[Array, Array]:
        when, sides = jumps(self, panels, inner)
        sure = np.isfinite(when)
        found.append((self, panels.wheel[sure], when[sure], sides[sure]))
        return when, sides

    monkeypatch.setattr(Hubs, "jumps", spied)
    over_valleys(np.arange(0.0, 4.0, 0.047))
    ((hubs, wheel, when, sides),) = found
    assert len(when) > 4
    assert np.abs(sides[:, 0, RADIUS] - sides[:, 1, RADIUS]).max() < 1e-12
    assert np.abs(sides[:, 0, ANGLE] - sides[:, 1, ANGLE]).min() > 0.1
    for side, moment in ((0, when - 1e-7), (1, when + 1e-7)):
        known = hubs.known(wheel, moment, gains=True)
        np.testing.assert_allclose(
            known[:, [SPEED, ANGLE, RADIUS]], sides[:, side][:, [SPEED, ANGLE, RADIUS]], atol=2e-6
        )
        np.testing.assert_allclose(known[:, RATE], sides[:, side, RATE], atol=1e-4)


def test_angles_over_jumps_are_exact() -> None:
    """As with panels twenty times shorter, to far less than what a jump in the middle of one would leave."""
    t = np.arange(0.0, 4.0, 0.047)
    fine = np.linspace(0.0, t[-1], 20 * (len(t) - 1) + 1)
    columns = [ROBOT.joint_index(f"{name}.spin") for name in ("fl", "fr", "r")]
    off = over_valleys(t).q[:, columns] - over_valleys(fine).q[::20, columns]
    assert np.abs(off).max() < 1e-8


def test_contacts_that_become_one_while_they_are_followed() -> None:
    """A ramp over smooth waves: no jump is found, and nothing warns."""
    path = {"kind": "line", "start": (0.0, 0.0), "heading": 0.2}
    gait = bp.Carry(path, height=0.16, speed=0.05, ramp=0.58)
    assert bp.plan(ROBOT, gait, bp.Surface("0.02*sin(6*x+y)"), np.arange(0.0, 1.2, 0.05)).ok


def off_finer(ground: bp.Surface, height: float, speed: float) -> float:
    """Largest difference rad of hub angles from those with times 40 times finer."""
    t = np.arange(0.0, 2.0, 0.05)
    fine = np.linspace(0.0, t[-1], 40 * (len(t) - 1) + 1)
    gait = bp.Carry("line", height=height, speed=speed)
    columns = [ROBOT.joint_index(f"{name}.spin") for name in ("fl", "fr", "r")]
    some, all_ = (bp.plan(ROBOT, gait, ground, times).q[:, columns] for times in (t, fine))
    return float(np.abs(some - all_[::40]).max())


def test_short_waves_at_speed() -> None:
    """Panels as long as the waves are wide: those that were good enough beside the worst ones are cut when these are
    done."""
    assert off_finer(bp.Surface("0.01*sin(20*x+3*y)"), 0.16, 2.0) < 2e-6
    assert off_finer(bp.Surface("0.01*sin(10*x+3*y)"), 0.16, 1.0) < 1e-11


def test_a_third_contact_is_nearer_than_the_two_that_were_followed() -> None:
    """Two jumps within a panel: no cut where another place is nearer."""
    assert off_finer(VALLEYS, 0.17, 1.0) < 5e-3
