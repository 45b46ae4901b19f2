"""Runs to report on: a small snake with a trial made by hand, whose figures are known; and other robots."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import bodyplan as bp
from bodyplan.check import check
from bodyplan.show.outcome import Comparison, Outcome, Variant
from bodyplan.show.report import write_report
from bodyplan.simulate.trial import Slip, Trial

#: m that the trial made by hand falls behind its plan in each cycle, evenly
LOST = 0.05
CYCLES, START, DT = 2, 1.0, 0.02
#: a text that would do harm if it were taken for HTML
EVIL = "<script>document.documentElement.dataset.problems='hacked'</script><img src=x onerror=alert(1)>"


@lru_cache
def snake_motion() -> bp.Motion:
    gait = bp.Concertina(body_modules=2, gamma_max=0.8, stretch_time=1.0, contraction="mirror")
    return bp.plan(bp.snake(8, 0.1), gait, bp.Corridor(0.16, friction=0.05), bp.times(0.0, 2.0, dt=0.02))


@lru_cache
def snake_trial() -> Trial:
    """The plan, followed exactly but for a steady slide backwards of LOST a cycle."""
    motion = snake_motion()
    period, advance = motion.facts["period"], motion.facts["advance_per_cycle"]
    n = motion.robot.n
    t = np.arange(round((START + CYCLES * period) / DT) + 1) * DT
    late = np.maximum(t - START, 0.0)  # waits in the first pose until START
    sample = np.round(np.mod(late, period) / DT).astype(int)
    sample[-1] = 0
    base = motion.base[sample].copy()
    cycle = np.floor(late / period + 1e-9)
    base[:, 0] += cycle * advance - LOST * late / period
    stages = [(name, a, b) for name, a, b in motion.stages if b - a > 1e-9]
    slips = tuple(
        Slip(
            name,
            f"rest: {name}",
            c,
            START + c * period + a,
            START + c * period + b,
            -LOST * (b - a) / period,
            LOST * (b - a) / period,
        )
        for name, a, b in stages
        for c in range(CYCLES)
    )
    ratio = 1.0 - LOST / advance
    torque = np.sin(np.outer(t, np.arange(1.0, n + 1.0)))
    return Trial(
        joints=motion.joints,
        kinds=motion.robot.kinds,
        t=t,
        base=base,
        q=motion.q[sample],
        torque=torque,
        com=base[:, :3],
        start_time=START,
        period=period,
        cycles=CYCLES,
        planned_advance=np.tile([advance, 0.0, 0.0], (CYCLES, 1)),
        advance=np.tile([advance - LOST, 0.0, 0.0], (CYCLES, 1)),
        advance_ratios=np.full(CYCLES, ratio),
        sideways=np.zeros(CYCLES),
        speed=(advance - LOST) / period,
        slips=slips,
        tracking_rms=np.full(n, 0.01),
        tracking_max=np.full(n, 0.02),
        torque_rms=np.full(n, 0.3),
        torque_peak=np.linspace(0.5, 0.7331, n),
        positive_work=1.5,
        absolute_work=2.5,
        cost_of_transport=0.81,
        warnings=("the <floor> is wet",),
        settings={
            "friction": None,
            "servo": [20.0, 0.4],
            "dt": 1e-3,
            "settle": START,
            "ramp": 0.0,
            "record_dt": DT,
            "mujoco": "4.0.0",
        },
    )


@lru_cache
def diverged_trial() -> Trial:
    """The same, lost after 1.5 s of the measured part."""
    whole = snake_trial()
    kept = whole.t <= START + 1.5
    records = {name: getattr(whole, name)[kept] for name in ("t", "base", "q", "torque", "com")}
    measures = (
        "advance",
        "advance_ratios",
        "sideways",
        "speed",
        "tracking_rms",
        "tracking_max",
        "torque_rms",
        "torque_peak",
        "positive_work",
        "absolute_work",
        "cost_of_transport",
    )
    nothing = dict.fromkeys(measures)
    return replace(
        whole,
        **records,
        **nothing,
        slips=(),
        warnings=(),
        status="diverged",
        reason="the velocity of joint 'yaw3' is 1e+07",
    )


def outcome(trial: Trial | None, motion: bp.Motion | None = None, **changes: Any) -> Outcome:
    motion = snake_motion() if motion is None else motion
    fields: dict[str, Any] = {
        "name": "small",
        "title": "A small snake",
        "about": "Eight links.",
        "mission_text": 'title = "x"\n[robot]\n',
        "overrides": ("gait.omega=1.2",),
        "motion": motion,
        "report": check(motion),
        "trial": trial,
    }
    return Outcome(**{**fields, **changes})


def full_outcome(**changes: Any) -> Outcome:
    others = (
        Comparison("other", "Another", 0.4321, 0.0123, 0.03, 4.56, 0.789, 1.23, "ok"),
        Comparison("lost", "Lost", None, None, None, 1.0, None, None, "diverged"),
    )
    return outcome(snake_trial(), others=others, variants=(Variant.of("linear", snake_motion()),), **changes)


@lru_cache
def evil_report(scratch: Path) -> Path:
    """The whole report of the small snake under a hostile title, written once into a folder in ``scratch``."""
    folder = scratch / "evil-report"
    folder.mkdir()
    return write_report(full_outcome(title=f"Mine {EVIL}"), folder)


def motion_of(robot: bp.Robot, ground: Any, t: Any, base: Any, q: Any, **more: Any) -> bp.Motion:
    """A motion from samples alone; its rates are differences."""
    rate = np.gradient(q, t, axis=0) if q.size else q
    bend = np.gradient(rate, t, axis=0) if q.size else q
    return bp.Motion(
        robot=robot,
        ground=ground,
        gait={"kind": "by hand"},
        t=t,
        base=base,
        q=q,
        qd=rate,
        qdd=bend,
        residual=np.zeros(len(t)),
        status=np.full(len(t), "ok"),
        **more,
    )


def bases(t: Any, velocity: tuple[float, float, float], height: Any = 0.0) -> Any:
    base = np.zeros((len(t), 7))
    base[:, 3] = 1.0
    base[:, :3] = np.outer(t, velocity)
    base[:, 2] += height
    return base


@lru_cache
def cart() -> bp.Motion:
    """A box on two rims, a foot on a sliding leg and an arc for an arm, far over hills; loads are planned."""
    half = 0.5 * np.pi
    rows = {
        "left": [bp.Row(d=0.0, a=0.0, epsilon=-half), bp.Row(theta=bp.Joint("left.spin"), d=0.2)],
        "right": [bp.Row(d=0.0, a=0.0, epsilon=half), bp.Row(theta=bp.Joint("right.spin"), d=0.2)],
        "leg": [bp.Row(a=0.3, epsilon=np.pi), bp.Row(d=bp.Joint("leg.slide"))],
        "arm": [bp.Arc(0.2, pitch=bp.Joint("arm.bend"))],
    }
    contacts = [
        bp.Contact("hull", "base", "box", half=(0.2, 0.1, 0.05)),
        bp.Contact("left.rim", "left.2", "rim", 0.1),
        bp.Contact("right.rim", "right.2", "rim", 0.1),
        bp.Contact("foot", "leg.2", "sphere", 0.03),
    ]
    robot = bp.Robot.from_rows(rows, contacts=contacts, base_body=bp.Body(mass=3.0), name="cart")
    t = np.linspace(0.0, 10.0, 101)
    ground = bp.Surface("0.05*sin(x)*cos(2*y)")
    base = bases(t, (0.5, 0.0, 0.0))
    base[:, 2] = ground.height(base[:, 0], base[:, 1]) + 0.1
    q = np.stack([5.0 * t, 5.0 * t, 0.05 + 0.01 * np.sin(t), 0.3 * np.sin(t)], axis=1)
    return motion_of(robot, ground, t, base, q, torques=np.cos(np.outer(t, [1.0, 2.0, 3.0, 4.0])))


@lru_cache
def caterpillar() -> bp.Motion:
    """A snake that bends up and down under a ceiling, with stages that overlap."""
    robot = bp.snake(6, 0.1, axes="pitch")
    t = np.linspace(0.0, 4.0, 81)
    q = 0.3 * np.sin(t[:, None] - 0.8 * np.arange(5))
    ground = bp.Profile(floor=[(None, 0.0), (0.3, 0.02)], ceiling=0.4)
    stages = (("lift", 0.0, 2.5), ("<b>put</b>", 2.0, 4.0))
    return motion_of(robot, ground, t, bases(t, (0.01, 0.0, 0.0), 0.15), q, stages=stages)


@lru_cache
def stick() -> bp.Motion:
    """A body without joints, contacts or mass that stands still, at uneven times."""
    robot = bp.Robot.from_rows({"only": [bp.Row(a=0.1)]}, name="stick")
    t = np.array([0.0, 1.0, 1.5])
    return motion_of(robot, bp.Plane(), t, bases(t, (0.0, 0.0, 0.0)), np.zeros((3, 0)))


@lru_cache
def follower() -> bp.Motion:
    """ACM-L2, whose double joints follow a curve with lifted bends, for two cycles."""
    robot, gait = bp.acm_l2(), bp.SinusLifting(1.3, 0.3, 0.64, speed=0.16)
    return bp.plan(robot, gait, bp.Plane(), bp.times(0.0, 8.0, dt=0.04))


@lru_cache
def roller() -> bp.Motion:
    """Arc-shaped joints that bend a body into a helix, which rolls."""
    gait = bp.Rolling(6.0, 1.5, 8.0)
    robot = bp.snake(8, 0.06, joint="arc", axes="universal", radius=0.02)
    period = gait.period(robot)
    assert period is not None
    return bp.plan(robot, gait, bp.Plane(), bp.times(0.0, period, dt=period / 100))
