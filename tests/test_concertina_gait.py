"""The concertina gait: published advance, exact rates, anchors, closure, the travelling wave, refusals."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.gaits.stretching import StretchingBody, stretching

SNAKE = bp.snake(26, 0.05)
LENGTH = 26 * 0.05

GAITS = {
    "travelling": {},
    "eight modules": {"body_modules": 8, "omega": 1.2},
    "two waves": {"body_modules": 8, "omega": 1.2, "extension": 0.3, "waves": 2},
    "mirror": {"contraction": "mirror"},
    "literal": {"contraction": "literal"},
    "smooth mirror": {"contraction": "mirror", "blend": "smooth"},
    "smooth travelling": {"blend": "smooth"},
    "odd mirror": {"contraction": "mirror", "body_modules": 3},
    "one module": {"contraction": "mirror", "body_modules": 1},
    "longer links": {"length_unit": 0.05},
    "longer links mirrored": {"length_unit": 0.05, "contraction": "mirror"},
    "overlapping": {"overlap": 0.4, "contraction": "mirror"},
    "uneven": {"rates": [1, 2, 1, 1.5, 1, 0.5], "contraction": "mirror"},
    "weak": {"gamma_max": 0.5, "contraction": "mirror"},
}


def cycle_motion(options, samples=160, ground=None, robot=SNAKE):
    gait = bp.Concertina(**options)
    return bp.plan(robot, gait, ground or bp.Plane(), np.linspace(0.0, gait.period(robot), samples + 1))


@pytest.fixture(scope="module", params=list(GAITS), ids=list(GAITS))
def motion(request):
    return cycle_motion(GAITS[request.param])


def test_passes_its_checks(motion):
    report = bp.check(motion)
    assert report.ok, str(report)
    assert {"at_rest", "periodic"} <= {line.kind for line in report if line.passed}


def test_joints_follow_the_links_positions(motion):
    positions = motion.poses().positions
    steps = np.diff(positions, axis=1)
    np.testing.assert_allclose(np.linalg.norm(steps, axis=-1), 0.05, rtol=1e-12)
    headings = np.arctan2(steps[..., 1], steps[..., 0])
    np.testing.assert_allclose(np.diff(headings, axis=1), motion.q, atol=1e-10)


def test_cycle_closes_and_advances_as_its_facts_say(motion):
    np.testing.assert_allclose(motion.q[-1], motion.q[0], atol=1e-10)
    moved = motion.base[-1, :3] - motion.base[0, :3]
    assert moved[0] == pytest.approx(motion.facts["advance_per_cycle"], abs=1e-12)
    assert moved[1] == pytest.approx(motion.facts["sideways_per_cycle"], abs=1e-12)
    np.testing.assert_allclose(motion.base[-1, 3:], motion.base[0, 3:], atol=1e-10)


def test_published_advance():
    facts = cycle_motion({"contraction": "mirror"}).facts
    unit = facts["length_unit"]
    assert 0.05 / unit == pytest.approx(0.873938881878, abs=1e-12)
    assert facts["advance_per_cycle"] / unit == pytest.approx(3.87286, abs=5e-6)
    assert facts["advance_per_body_length"] == pytest.approx(0.1704, abs=5e-5)
    assert cycle_motion({"contraction": "literal"}).facts["advance_per_cycle"] == pytest.approx(
        facts["advance_per_cycle"]
    )
    longer = cycle_motion({"contraction": "mirror", "length_unit": 0.05}).facts
    assert longer["advance_per_cycle"] / 0.05 == pytest.approx(3.7398, abs=5e-5)


def test_extension_is_the_share_of_the_advance():
    full = cycle_motion({"contraction": "mirror"}).facts["advance_per_cycle"]
    for extension in (0.4, 0.7, 1.0):
        part = cycle_motion({"extension": extension}).facts["advance_per_cycle"]
        assert part == pytest.approx(extension * full, rel=1e-9)
    # extension 1 is the mirrored gait, at another pace
    whole, mirror = (bp.Concertina(**o).body(SNAKE).sweep for o in ({"extension": 1.0}, {"contraction": "mirror"}))
    u = np.linspace(-whole.total, whole.total, 41)
    np.testing.assert_array_equal(whole.at(u)[0], mirror.at(u)[0])


def test_transit_keeps_the_length_and_both_ends():
    motion = cycle_motion({"body_modules": 8, "omega": 1.2})
    sweep = bp.Concertina(body_modules=8, omega=1.2).body(SNAKE).sweep
    u = np.linspace(sweep.launch_end, sweep.landing_start, 60)
    angles = sweep.at(u)[0]
    assert np.ptp(np.cos(angles).sum(axis=1)) < 1e-11
    heads = motion.poses()["link26"][:, :2]
    gait_time = bp.Concertina(body_modules=8, omega=1.2).body(SNAKE).cycle
    a, b = (gait_time.time_of(x + sweep.total) for x in (sweep.launch_end, sweep.landing_start))
    during = (motion.t >= a) & (motion.t <= b)
    assert during.sum() > 20
    assert np.ptp(heads[during], axis=0).max() < 1e-12 and np.ptp(motion.base[during, :2], axis=0).max() < 1e-12


def test_literal_contraction_stays_flat_for_four_fifths():
    motion = cycle_motion({"contraction": "literal"}, samples=400)
    contracting = motion.t > 0.5 * motion.t[-1]
    flat = np.abs(motion.q).max(axis=1) < 1e-9
    share = flat[contracting].mean()
    assert share == pytest.approx(0.8, abs=0.01)


@pytest.mark.parametrize(
    "name",
    ["travelling", "two waves", "mirror", "literal", "smooth mirror", "smooth travelling", "uneven", "longer links"],
)
def test_rates_and_accelerations_are_exact(name):
    gait = bp.Concertina(**GAITS[name])
    period, h = gait.period(SNAKE), 2e-5
    middle = np.linspace(0.013, 0.987, 61) * period
    t = np.sort(np.concatenate([middle - h, middle, middle + h]))
    motion = bp.plan(SNAKE, gait, bp.Plane(), t)
    q, qd, qdd = motion.q, motion.qd, motion.qdd
    rate = (q[2::3] - q[0::3]) / (2 * h)
    acceleration = (qd[2::3] - qd[0::3]) / (2 * h)
    # where a joint passes a kink of the curve within 2h the difference says nothing: allow that for one sample in ten
    rate_error = np.sort(np.abs(rate - qd[1::3]).max(axis=1))
    acceleration_error = np.sort(np.abs(acceleration - qdd[1::3]).max(axis=1))
    assert rate_error[54] < 1e-5 * max(1.0, np.abs(qd).max())
    assert acceleration_error[54] < 1e-4 * max(1.0, np.abs(qdd).max())


@pytest.mark.parametrize("options", [{"contraction": "mirror"}, {"contraction": "literal"}])
def test_smooth_blend_keeps_the_accelerations_finite(options):
    def five_point_peak(blend, h):
        t = np.arange(0.0, 10.0 + h / 2, h)
        q = bp.plan(SNAKE, bp.Concertina(blend=blend, **options), bp.Plane(), t).q
        return np.abs(bp.rates.five_point(bp.rates.five_point(q, h), h)).max()

    # with the linear blend rates jump and the formula's acceleration grows as 1/h; with the C2 one it settles
    assert five_point_peak("linear", 0.0025) > 1.9 * five_point_peak("linear", 0.005)
    assert five_point_peak("smooth", 0.0025) < 1.1 * five_point_peak("smooth", 0.005)
    motion = bp.plan(SNAKE, bp.Concertina(blend="smooth", **options), bp.Plane(), np.arange(0.0, 10.0, 0.0025))
    assert five_point_peak("smooth", 0.0025) == pytest.approx(np.abs(motion.qdd).max(), rel=0.02)


def test_rounding_stays_near_the_curve():
    sharp, smooth = (cycle_motion({"contraction": "mirror", "blend": b}) for b in ("linear", "smooth"))
    stretch = bp.check(smooth)["joints on the stretching curve"]
    assert 1e-6 < stretch.value < 0.0005  # of links of 0.05 m; the sharp one follows to rounding
    assert bp.check(sharp)["joints on the stretching curve"].value < 1e-12


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rate=st.floats(0.2, 5.0), options=st.sampled_from([{}, {"contraction": "mirror"}, {"body_modules": 6}]))
def test_max_joint_rate_is_the_largest_rate_and_nearly_constant(rate, options):
    gait = bp.Concertina(max_joint_rate=rate, **options)
    motion = bp.plan(SNAKE, gait, bp.Plane(), np.linspace(0.0, gait.period(SNAKE), 1501))
    largest = np.abs(motion.qd).max(axis=1)
    assert largest.max() <= rate * (1 + 1e-6)
    assert largest.max() > 0.9 * rate
    middle = np.quantile(largest, [0.05, 0.5, 0.95])
    assert middle[2] < 1.1 * middle[1] and middle[0] > 0.8 * middle[1]


def test_unwarped_runs_evenly_through_the_stages():
    motion = cycle_motion({"contraction": "mirror", "stretch_time": 6.25})
    ends = {name: (start, end) for name, start, end in motion.stages}
    assert ends["stretch head"] == pytest.approx((0.0, 1.0))
    assert ends["stretch tail"] == pytest.approx((5.0, 6.25))  # 1/gamma_max of a module's stage
    assert ends["contract tail"] == pytest.approx((11.5, 12.5))  # the mirrored head stage


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    lengths=st.lists(st.floats(0.03, 0.07), min_size=16, max_size=28),
    contraction=st.sampled_from(["mirror", "travelling"]),
)
def test_unequal_links_close_and_stay_anchored(lengths, contraction):
    robot = bp.snake(len(lengths), lengths)
    motion = cycle_motion({"contraction": contraction, "extension": 0.9}, samples=60, robot=robot)
    if motion.ok:
        report = bp.check(motion)
        assert report["the cycle closes"].passed and report["rear at rest"].passed and report["joints on"].passed, str(
            report
        )


def test_other_snakes_and_grounds():
    alternating = bp.snake(60, 0.03, axes="alternating")
    motion = cycle_motion({"contraction": "mirror"}, samples=40, robot=alternating)
    pitch = [i for i, name in enumerate(motion.joints) if name.startswith("pitch")]
    assert np.all(motion.q[:, pitch] == 0.0) and bp.check(motion).ok
    universal = bp.snake(26, 0.05, axes="universal")
    same = cycle_motion({"contraction": "mirror"}, robot=universal)
    yaw = [i for i, name in enumerate(same.joints) if name.startswith("yaw")]
    np.testing.assert_allclose(same.q[:, yaw], cycle_motion({"contraction": "mirror"}).q, atol=1e-12)
    high = cycle_motion({}, samples=20, ground=bp.Plane(1.5))
    assert np.all(high.base[:, 2] == pytest.approx(1.515, abs=1e-12)) and bp.check(high).ok


def test_corridor_states_the_squeeze():
    motion = cycle_motion({"contraction": "mirror"}, ground=bp.Corridor(0.135))
    assert motion.facts["contracted_width"] == pytest.approx(0.143, abs=2e-4)
    assert motion.facts["squeeze"] == pytest.approx(0.0082, abs=2e-4)
    assert bp.check(motion)["presses on the wall"].passed
    loose = cycle_motion({"contraction": "mirror"}, ground=bp.Corridor(0.2))
    assert any("does not touch" in note for note in loose.notes) and bp.check(loose).ok
    with pytest.raises(bp.InputError, match=r"corridor has 0\.1 m"):
        cycle_motion({"contraction": "mirror"}, ground=bp.Corridor(0.1))
    assert cycle_motion({"body_modules": 8, "omega": 1.2}).facts["contracted_width"] == pytest.approx(0.108, abs=2e-4)


def test_too_tight_is_a_status():
    motion = cycle_motion({"contraction": "mirror", "omega": 2.0}, samples=10, robot=bp.snake(10, 0.05))
    assert set(motion.status) == {"too_tight"} and not motion.ok and not bp.check(motion).ok
    with pytest.raises(bp.SolveError, match="too_tight"):
        motion.raise_if_failed()


def test_stretching_gain_grows():
    stages = stretching(4, 0.8, np.ones(6), 0.0, "linear")
    body = StretchingBody(stages, np.full(26, float(bp.exact_link_length(26, 4))), 1.0)
    extents = body.at(np.linspace(0, stages.total, 200)).extents
    assert np.all(np.diff(extents[:, 0]) > 0.0)
    h = 1e-6
    a, b = body.at(np.linspace(0.01, 6.2, 30) - h).extents, body.at(np.linspace(0.01, 6.2, 30) + h).extents
    np.testing.assert_allclose(
        (b[:, 0] - a[:, 0]) / (2 * h), body.at(np.linspace(0.01, 6.2, 30)).extents[:, 1], atol=1e-6
    )


@pytest.mark.parametrize(
    "options,match",
    [
        ({"body_modules": 3}, "even"),
        ({"body_modules": 0}, "body_modules"),
        ({"body_modules": 2.5}, "body_modules"),
        ({"gamma_max": 0.0}, "gamma_max"),
        ({"gamma_max": 1.0}, "gamma_max"),
        ({"gamma_max": np.nan}, "gamma_max"),
        ({"omega": -1.0}, "omega"),
        ({"stretch_time": 0.0}, "stretch_time"),
        ({"contraction": "mirrored"}, "mirror"),
        ({"extension": 0.0}, "extension"),
        ({"extension": 1.1}, "extension"),
        ({"waves": 0}, "waves"),
        ({"waves": 2, "contraction": "mirror"}, "waves"),
        ({"blend": "cubic"}, "linear"),
        ({"overlap": 1.0}, "overlap"),
        ({"rates": [1, 1]}, "rates"),
        ({"rates": [1, 1, 1, 1, 1, -1]}, "rates"),
        ({"max_joint_rate": 0.0}, "max_joint_rate"),
        ({"length_unit": -0.05}, "length_unit"),
        ({"warp": "yes"}, "warp"),
    ],
)
def test_refuses_options(options, match):
    with pytest.raises(bp.InputError, match=match):
        bp.Concertina(**options)


def test_refuses_what_cannot_be():
    t = bp.times(0, 1, dt=0.1)
    with pytest.raises(bp.InputError, match="too short"):  # links of 0.8: the head off the axis
        bp.plan(SNAKE, bp.Concertina(length_unit=0.05 / 0.8), bp.Plane(), t)
    with pytest.raises(bp.SolveError, match="no_exact_length"):
        bp.plan(bp.snake(6, 0.05), bp.Concertina(4, omega=2.0), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="waves"):
        bp.plan(SNAKE, bp.Concertina(waves=2, extension=0.9), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="level"):
        bp.plan(SNAKE, bp.Concertina(), bp.Plane(slope=(0.1, 0.0)), t)
    with pytest.raises(bp.InputError, match="vertical"):
        bp.plan(bp.snake(26, 0.05, axes="pitch"), bp.Concertina(), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="straight"):
        bp.plan(bp.snake(26, 0.05, joint="arc"), bp.Concertina(), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="one chain"):
        bp.plan(bp.Robot.from_rows({"a": [bp.Row(a=1.0)], "b": [bp.Row(a=1.0)]}), bp.Concertina(), bp.Plane(), t)
    with pytest.raises(bp.InputError, match="t = 0"):
        bp.plan(SNAKE, bp.Concertina(), bp.Plane(), [-1.0, 0.0])
    for wrong in ((None, bp.Concertina(), bp.Plane()), (SNAKE, "concertina", bp.Plane()), (SNAKE, bp.Concertina(), 3)):
        with pytest.raises(bp.InputError, match="expected a"):
            bp.plan(*wrong, t)
    for wrong in ([0.0], [0.0, 0.0], [0.0, np.nan], [1.0, 0.0]):
        with pytest.raises(bp.InputError):
            bp.plan(SNAKE, bp.Concertina(), bp.Plane(), wrong)


@pytest.mark.parametrize("modules,crossing", [(4, 1), (4, 3), (3, 1), (3, 3), (2, 2), (5, 2)])
def test_cycle_closes_whatever_the_parity_of_the_half_waves(modules, crossing):
    gait = bp.Concertina(modules, crossing=crossing, contraction="mirror")
    period = gait.period(SNAKE)
    motion = bp.plan(SNAKE, gait, bp.Plane(), [period - 1e-7, period, period + 1e-7])
    assert motion.ok and np.abs(np.diff(motion.q, axis=0)).max() < 1e-5
    if (modules + crossing) % 2:
        with pytest.raises(bp.InputError, match="even"):
            bp.Concertina(modules, crossing=crossing)
    else:
        bp.Concertina(modules, crossing=crossing)


def test_a_body_that_lies_differently_from_head_and_tail_is_too_tight():
    robot = bp.snake(10, 0.05, radius=0.002)
    unit = 0.05 / bp.exact_link_length(10, 2, 2.5) * 0.8
    gait = bp.Concertina(2, omega=2.5, contraction="mirror", length_unit=unit)
    assert set(bp.plan(robot, gait, bp.Plane(), [0.0, 1.0]).status) == {"too_tight"}


@pytest.mark.parametrize("options", [
    {"extension": 0.35, "waves": 2}, {"extension": 0.2}, {"overlap": 0.9}, {"gamma_max": 0.1}, {"extension": 0.05},
    {"body_modules": 8, "omega": 1.2, "blend": "smooth"}, {"body_modules": 2, "blend": "smooth"},
    {"body_modules": 8, "omega": 2.0, "contraction": "literal", "blend": "smooth"},
])  # fmt: skip
def test_claims_no_rest_that_is_not_planned(options):
    report = bp.check(cycle_motion(options, samples=300))
    assert report.ok, str(report)


def test_facts_do_not_depend_on_the_samples():
    coarse, fine = (cycle_motion({"blend": "smooth"}, samples=n).facts["peak_joint_acceleration"] for n in (60, 900))
    assert coarse == fine
    assert fine < 250.0


def test_options_round_trip():
    for options in GAITS.values():
        gait = bp.Concertina(**options)
        data = gait.to_dict()
        assert data.pop("kind") == "concertina"
        assert bp.Concertina(**data) == gait and hash(bp.Concertina(**data)) == hash(gait)
