"""The table of a sweep's joint rates, and the warp that is made of it: no joint beyond its limit, however looked at."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.clock import Clock, constant_rate_pace
from bodyplan.gaits.rate_table import NARROW, RateTable, rate_table

SNAKE = bp.snake(26, 0.05)
UNEVEN = bp.snake(20, list(np.random.default_rng(3).uniform(0.04, 0.06, 20)))

GAITS = {
    "two waves": (SNAKE, {"body_modules": 8, "gamma_max": 0.62, "omega": 1.2, "extension": 0.33, "waves": 2}),
    "one wave": (SNAKE, {"extension": 0.4}),
    "mirror": (SNAKE, {"contraction": "mirror", "overlap": 0.3}),
    "odd mirror": (SNAKE, {"contraction": "mirror", "body_modules": 3}),
    "literal": (SNAKE, {"contraction": "literal", "gamma_max": 0.7}),
    "uneven links": (UNEVEN, {"body_modules": 2, "extension": 0.5, "rates": [1.0, 2.0, 0.6, 1.5]}),
    "three waves": (SNAKE, {"body_modules": 2, "gamma_max": 0.44, "omega": 0.75, "extension": 0.09, "waves": 3}),
    "smooth": (SNAKE, {"body_modules": 6, "extension": 0.3, "blend": "smooth"}),
}


@pytest.fixture(scope="module", params=list(GAITS), ids=list(GAITS))
def cycle(request):
    robot, options = GAITS[request.param]
    return bp.Concertina(max_joint_rate=1.0, **options).body(robot).cycle


def test_between_its_nodes_the_table_is_as_good_as_the_sweep(cycle):
    sweep = cycle.sweep
    table = rate_table(sweep)
    u = np.sort(np.random.default_rng(0).uniform(-sweep.total, sweep.total, 8000))
    rates = np.abs(np.diff(sweep.at(u)[1], axis=1)).max(axis=1)
    one = np.ones((1, u.size))
    told, sides = table.largest(u[None], one), table.largest(u[None], one, sides=True)
    jumping, floor = table.jumps(u), 0.01 * rates.mean()
    apart = np.abs(told - rates) / np.maximum(rates, floor)
    assert apart[~jumping].max() < 4e-3 and np.quantile(apart, 0.99) < 5e-4
    assert np.all(sides >= told * (1.0 - 1e-12))
    assert np.all(sides[jumping] > rates[jumping] * (1.0 - 4e-3))
    assert len(table.nodes) < 1500 and np.all(np.diff(table.nodes) > 0.0)


def test_a_sweep_is_its_own_reversal_where_it_says_so(cycle):
    sweep = cycle.sweep
    if sweep.reversal is None:
        return
    u = np.sort(np.random.default_rng(1).uniform(-sweep.total, sweep.total, 200))
    angles, first, second = sweep.at(u)
    turned = [x[::-1, ::-1] for x in sweep.at(-u[::-1])]
    np.testing.assert_allclose(sweep.reversal * turned[0], angles, atol=1e-10)
    np.testing.assert_allclose(-sweep.reversal * turned[1], first, atol=1e-8 * np.abs(first).max())
    np.testing.assert_allclose(sweep.reversal * turned[2], second, atol=1e-6 * np.abs(second).max())


def test_half_a_table_is_as_good_as_a_whole_one():
    sweep = bp.Concertina(**GAITS["one wave"][1]).body(SNAKE).sweep
    half, sign = rate_table(sweep), sweep.reversal
    try:
        sweep.reversal = None
        whole = rate_table(sweep)
    finally:
        sweep.reversal = sign
    u = np.linspace(-sweep.total, sweep.total, 3001)
    u = u[~(half.jumps(u) | whole.jumps(u))]
    one = np.ones((1, u.size))
    np.testing.assert_allclose(half.largest(u[None], one), whole.largest(u[None], one), rtol=4e-3)


def test_no_joint_is_faster_than_its_limit_anywhere(cycle):
    # at random times, and close to every node of the clock, on both sides
    edges = (cycle.clock.times[:, None] + np.array([-1e-8, 0.0, 1e-8]) * cycle.period).ravel()
    t = np.sort(np.concatenate([np.random.default_rng(2).uniform(0.0, cycle.period, 8000), edges]))
    rates = np.abs(np.diff(cycle.state(t[(t >= 0.0) & (t < cycle.period)]).rates, axis=1))
    assert 0.97 < rates.max() <= 1.0
    assert cycle.peak_rate == pytest.approx(1.0 / 1.008, rel=1e-12)


def test_the_warp_does_not_hang_on_rounding():
    options = {"max_joint_rate": 1.0, **GAITS["two waves"][1]}
    periods = [
        bp.Concertina(**{**options, "omega": omega}).period(SNAKE) for omega in 1.2 * (1.0 + 1e-13 * np.arange(6))
    ]
    assert np.ptp(periods) < 1e-6 * periods[0]


def test_largest_of_a_sum_of_waves():
    rng = np.random.default_rng(4)
    nodes, rates, changes = np.sort(rng.uniform(0.0, 5.0, 9)), rng.normal(size=(9, 4)), rng.normal(size=(9, 4))
    table = RateTable(nodes, rates, changes)
    u, speed = np.sort(rng.uniform(-0.5, 5.5, (3, 50)), axis=1), rng.uniform(0.1, 2.0, (3, 50))

    def cubic(x):
        from scipy.interpolate import CubicHermiteSpline

        return CubicHermiteSpline(nodes, rates, changes)(np.clip(x, nodes[0], nodes[-1]))

    total = sum(cubic(u[k]) * speed[k][:, None] for k in range(3))
    np.testing.assert_allclose(table.largest(u, speed), np.abs(total).max(axis=1), rtol=1e-12)


def test_a_jump_takes_the_larger_side():
    nodes = np.array([0.0, 1.0, 1.0 + 0.9 * NARROW, 2.0])
    table = RateTable(nodes, np.array([[1.0], [1.0], [-3.0], [-3.0]]), np.zeros((4, 1)))
    u, one = np.array([[0.5, 1.0 + 0.4 * NARROW, 1.5]]), np.ones((1, 3))
    assert table.jumps(u[0]).tolist() == [False, True, False]
    np.testing.assert_allclose(table.largest(u, one, sides=True), [1.0, 3.0, 3.0])
    assert table.largest(u, one)[1] < 3.0


def test_pace_is_even_across_a_jump():
    nodes, speeds = np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0]), np.array([1.0, 1.0, 5.0, 2.0, 1.0, 1.0])
    pace = constant_rate_pace(nodes, speeds, 1e-3, np.array([False, True, True, False, False]))
    np.testing.assert_allclose(pace[1:4], 5.0, rtol=1e-5)
    assert np.all(pace >= speeds)
    # where nothing is known of jumps, neighbours are slow as well
    np.testing.assert_allclose(constant_rate_pace(nodes, speeds, 1e-3), [1.0, 5.0, 5.0, 5.0, 2.0, 1.0], rtol=1e-5)


def test_clock_is_exact_both_ways():
    rng = np.random.default_rng(6)
    nodes = np.concatenate([[0.0], np.cumsum(rng.uniform(1e-7, 1.0, 40))])
    clock = Clock(nodes, rng.uniform(0.01, 3.0, 41), 7.0)
    t = np.linspace(0.0, 7.0, 901)
    position, speed, _ = clock.position(t)
    np.testing.assert_allclose(clock.time(position), t, atol=1e-12)
    np.testing.assert_allclose(clock.speed(position), speed, rtol=1e-9)
    assert clock.time(float(position[5])) == pytest.approx(t[5], abs=1e-12)
