"""What physics makes of planned lifts, and how far a base tilts from the plan: known records, and small robots."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.motion import Claim, Motion
from bodyplan.simulate.measure import Records, lifts_of, tilt_of
from bodyplan.simulate.reference import Reference
from bodyplan.simulate.trial import Trial
from bodyplan.spatial.rotations import multiply, quaternion_exp

PERIOD = 2.0


def mast(height: float = 0.1, cycles: float = 1.0, *, every: float | None = PERIOD, start: float = 0.5) -> Motion:
    """A box of 1 kg with two vertical slides; between 0.5 and 1.5 s "low" rises by ``height`` and "high", which stands
    on it, by half of that more; the whole is planned to be carried 0.05 m ahead and 0.02 m up a cycle."""
    body = {"com": (0.0, 0.0, 0.0), "inertia": (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)}
    rows = [
        bp.Row(d=bp.Joint("a", offset=0.1), name="low", body=bp.Body(mass=0.3, **body)),  # type: ignore[arg-type]
        bp.Row(d=bp.Joint("b", offset=0.1), name="high", body=bp.Body(mass=0.2, **body)),
    ]  # type: ignore[arg-type]
    foot = bp.Contact("foot", "base", "box", half=(0.1, 0.1, 0.03))
    robot = bp.Robot.from_rows({"mast": rows}, contacts=[foot], base_body=bp.Body(mass=1.0))
    t = bp.times(0.0, cycles * PERIOD, 0.01)
    u = np.clip(t % PERIOD - 0.5, 0.0, 1.0)
    up = height * 16.0 * (u * (1.0 - u)) ** 2
    rate = height * 32.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    q, qd = np.stack([up, 0.5 * up], axis=1), np.stack([rate, 0.5 * rate], axis=1)
    base = np.tile([0.0, 0.0, 0.03, 1.0, 0.0, 0.0, 0.0], (len(t), 1))
    base[:, 0] += 0.025 * t
    base[:, 2] += 0.01 * t
    data = {"frames": ["low", "high"], "start": start, "end": start + 1.0, "every": every, "stage": "swing",
            "height": height, "tolerance": 1e-6}  # fmt: skip
    periodic = {"period": PERIOD, "advance": [0.05, 0.0, 0.02], "turn": 0.0, "tolerance": 1e-9}
    claims = (Claim("lifted", "the mast rises", data), Claim("periodic", "cycle", periodic))
    zero, ok = np.zeros(len(t)), np.full(len(t), "ok")
    return Motion(robot, bp.Plane(), {}, t, base, q, qd, np.zeros_like(q), zero, ok, claims)


def records(motion: Motion, share: float = 1.0, sunk: float = 0.0, seconds: float = 4.0) -> tuple[Records, Any, Any]:
    """A run of which 1 s settles; the joints make a share of the plan, the base is too low."""
    reference = Reference.of(motion)
    t = np.linspace(0.0, 1.0 + seconds, round((1.0 + seconds) * 50) + 1)

    def phase(x: Any) -> Any:
        return np.maximum(np.asarray(x) - 1.0, 0.0)

    base = reference.bases(phase(t))
    base[:, 2] -= sunk
    q = share * reference.joints(phase(t))
    return Records(t, base, q, 0.0 * q, base[:, :3]), reference, phase


def lifts(motion: Motion, share: float = 1.0, sunk: float = 0.0, cycles: int = 2) -> Any:
    made, reference, phase = records(motion, share, sunk, cycles * reference_span(motion))
    return lifts_of(motion, made, reference, phase, lambda x: 1.0 + x, reference_span(motion), cycles)


def reference_span(motion: Motion) -> float:
    return Reference.of(motion).duration


def test_a_run_that_is_the_plan_lifts_as_planned() -> None:
    found = lifts(mast())
    assert [(lift.cycle, lift.start, lift.end) for lift in found] == [(0, 1.5, 2.5), (1, 3.5, 4.5)]
    # "low" rises least: 0.1 m, less what the whole climbs from the middle of the interval to its end
    for lift in found:
        assert lift.stage == "swing" and lift.label == "the mast rises"
        assert lift.planned == pytest.approx(0.1 - 0.005, abs=1e-5)
        assert lift.executed == pytest.approx(lift.planned, abs=1e-12)


def test_rises_are_measured_from_where_the_plan_stands() -> None:
    # to 0.2 mm: climbing moves the top of a flat rise a little beyond the middle
    for share, sunk in ((0.5, 0.0), (1.0, 0.03), (0.8, 0.03), (0.0, 0.03)):
        for lift in lifts(mast(), share, sunk):
            top = share * 0.1 - sunk - 0.005 if share else -sunk
            assert lift.executed == pytest.approx(top, abs=2e-4)
    # the frame that rises least counts
    slack, reference, phase = records(mast())
    q = slack.q * [1.0, -1.6]
    stuck = Records(slack.t, slack.base, q, slack.torque, slack.com)
    first = lifts_of(mast(), stuck, reference, phase, lambda x: 1.0 + x, PERIOD, 2)[0]
    assert first.planned == pytest.approx(0.095, abs=1e-5)
    assert first.executed == pytest.approx(0.1 - 0.08 - 0.005, abs=2e-4)


def test_intervals_come_again_as_those_of_slips_do() -> None:
    # one that begins before the motion is that of the first cycle, one that is cut in two is left out
    early = lifts(mast(start=-1.5))
    assert [(lift.cycle, lift.start) for lift in early] == [(0, 1.5), (1, 3.5)]
    assert lifts(mast(start=-1.5, every=None)) == ()
    made, reference, phase = records(mast(), seconds=2.3)  # the second interval ends after the records
    assert len(lifts_of(mast(), made, reference, phase, lambda x: 1.0 + x, PERIOD, 2)) == 1
    assert lifts(mast().replace(claims=())) == ()


@pytest.mark.parametrize("turn", [0.0, 0.3, -1.2])
def test_the_tilt_is_that_from_the_plan_at_the_same_phase(turn: float) -> None:
    t = np.linspace(0.0, 2.0, 41)
    base = np.zeros((41, 7))
    # a base that is planned to rock by 0.4 rad and to turn about z
    base[:, 3:] = multiply(
        quaternion_exp(np.outer(t, [0, 0, 1])), quaternion_exp(np.outer(np.sin(np.pi * t), [0, 0.4, 0]))
    )
    claim = Claim("periodic", "p", {"period": 2.0})
    plan = mast().replace(t=t, base=base, claims=[claim], status=np.full(41, "ok"), residual=np.zeros(41),
                          **dict.fromkeys(("q", "qd", "qdd"), np.zeros((41, 2))))  # fmt: skip
    reference = Reference.of(plan)
    times = np.linspace(0.0, 5.0, 251)
    executed = reference.bases(times - 1.0)
    none = np.zeros((251, 2))
    # turned about the world's z, or about its own: no tilt of its own
    about = executed.copy()
    about[:, 3:] = multiply(executed[:, 3:], quaternion_exp([0.0, 0.0, turn]))
    assert tilt_of(Records(times, about, none, none, none), reference, lambda x: x - 1.0, 1.0) < 1e-7
    tilted = executed.copy()
    lean = turn * np.where(times < 1.0, 2.0, np.exp(-times))  # the settling does not count
    tilted[:, 3:] = multiply(executed[:, 3:], quaternion_exp(np.outer(lean, [1.0, 0.0, 0.0])))
    got = tilt_of(Records(times, tilted, none, none, none), reference, lambda x: x - 1.0, 1.0)
    assert got == pytest.approx(abs(turn) * np.exp(-1.0), abs=1e-12)


def test_the_base_at_many_phases_is_that_at_each() -> None:
    motion = mast(cycles=1.3)
    reference = Reference.of(motion)
    phases = np.array([-3.1, -2.0, 0.0, 0.7, 2.0, 2.5, 7.9])
    each = np.array([reference.base(float(p)) for p in phases])
    np.testing.assert_array_equal(reference.bases(phases), each)
    np.testing.assert_allclose(each[:, 0], 0.025 * phases, atol=1e-12)
    np.testing.assert_allclose(each[:, 2], 0.03 + 0.01 * phases, atol=1e-12)


# --- in physics ---


def run(motion: Motion, **options: Any) -> Trial:
    return bp.simulate(motion, **({"cycles": 2, "settle": 0.3, "ramp": 0.2, "servo": (4000.0, 80.0)} | options))


def level(motion: Motion) -> Motion:
    """The same without any way: it stands where it is."""
    base = np.tile([0.0, 0.0, 0.03, 1.0, 0.0, 0.0, 0.0], (len(motion.t), 1))
    return motion.replace(base=base)


def test_a_stiff_servo_lifts_as_planned_and_a_weak_one_does_not() -> None:
    stiff = run(level(mast()))
    assert len(stiff.lifts) == 2 and [lift.cycle for lift in stiff.lifts] == [0, 1]
    assert stiff.lift_ratio == pytest.approx(1.0, abs=0.05)
    assert stiff.lift_ratio == min(lift.executed / lift.planned for lift in stiff.lifts)
    assert stiff.tilt is not None and stiff.tilt < 1e-3
    metrics = json.loads(json.dumps(stiff.metrics(), allow_nan=False))
    assert metrics["lift_ratio"] == stiff.lift_ratio and metrics["tilt_rad"] == stiff.tilt
    # under its own weight a weak servo hangs 0.5 kg g / kp = 0.049 m low
    weak = run(level(mast()), servo=(100.0, 20.0), settle=2.0)
    assert weak.lift_ratio is not None and 0.2 < weak.lift_ratio < 0.65


def test_a_robot_that_tips_over_has_a_tilt() -> None:
    body = bp.Body(mass=1.0, com=(0.2, 0.0, 0.2))  # far beyond its foot
    foot = bp.Contact("foot", "base", "box", half=(0.05, 0.05, 0.02))
    robot = bp.Robot.from_rows({"mark": [bp.Row(a=0.1)]}, contacts=[foot], base_body=body)
    base = np.tile([0.0, 0.0, 0.02, 1.0, 0.0, 0.0, 0.0], (2, 1))
    none = np.zeros((2, 0))
    motion = Motion(robot, bp.Plane(), {}, [0.0, 0.3], base, none, none, none, np.zeros(2), np.full(2, "ok"))
    trial = bp.simulate(motion, settle=0.0, ramp=0.0)
    assert trial.tilt is not None and trial.tilt > 0.3
    assert trial.lifts == () and trial.lift_ratio is None and trial.metrics()["lift_ratio"] is None


def test_a_run_that_diverges_has_neither() -> None:
    trial = run(level(mast()), servo=(1e9, 0.0), dt=0.01, record_dt=0.02)
    assert not trial.ok and trial.tilt is None and trial.lifts == () and trial.lift_ratio is None
    assert trial.metrics()["tilt_rad"] is None
