"""The report of a walk: where it stands, its figure, and what the null space buys."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.crawl import null_space
from bodyplan.show.crawling import crawling_plots, crawling_section
from bodyplan.show.crawling_figures import walk_figure
from bodyplan.show.crawling_loads import is_crawl, loads_of, loads_plots, loads_text


@pytest.fixture(scope="module")
def walk():
    gait = bp.Crawl(velocity=(0.012, 0.0), cycle_time=12.0)
    return bp.plan(bp.silo4(), gait, bp.Surface("0.02*sin(6*x)*cos(5*y)"), bp.times(0, 6, dt=0.05))


@pytest.fixture(scope="module")
def benefits():
    gait = bp.Crawl(velocity=(0.012, 0.0), cycle_time=12.0)
    return {row.choice: row for row in null_space(bp.silo4(), gait, bp.Plane(), 12.0)}


def test_the_margin_is_said_and_drawn(walk):
    page = crawling_section(walk, {"walk": "<svg></svg>"})
    margin = bp.check(walk)["the centre of mass"].value
    assert f"{1e3 * margin:.4g}" in page and "What the null space buys" in page
    plot = crawling_plots(walk)["walk_margin"]
    assert min(y for y in plot["data"][0]["y"] if y is not None) == pytest.approx(1e3 * margin, rel=1e-3)


def test_the_figure_has_every_foothold(walk):
    from matplotlib.figure import Figure

    made = walk_figure(walk, lambda height: Figure(figsize=(8.0, height)))
    labels = made.axes[0].get_legend_handles_labels()[1]
    assert [label for label in labels if label.endswith(".foot")] == ["fl.foot", "fr.foot", "hl.foot", "hr.foot"]


def test_of_a_shell_only_feet_are_meant_to_touch():
    from bodyplan.show.playback import Playback
    from bodyplan.show.schedule import schedule

    motion = bp.plan(bp.silo4(shell=True), bp.Crawl(), bp.Plane(), bp.times(0, 12, dt=0.1))
    _, names, touching = schedule(Playback.of(motion, None))
    assert names == ("fl.foot", "fr.foot", "hl.foot", "hr.foot") and touching.shape[1] == 4
    assert touching.sum(axis=1).min() == 3


def test_other_gaits_have_no_such_part():
    snake = bp.snake(12, 0.1, axes="pitch")
    motion = bp.plan(snake, bp.Rectilinear(3, lift=0.0), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert not is_crawl(motion)
    assert crawling_section(motion, {}) == "" and crawling_plots(motion) == {}


def test_the_null_space_cannot_mend_a_lost_margin(benefits):
    """With x, y and yaw commanded evenly the margin is negative whatever is done with z, roll and pitch."""
    margins = [row.margin for row in benefits.values()]
    assert max(margins) < -0.005 and np.ptp(margins) < 0.002
    assert all(row.status == "ok" for row in benefits.values())


def test_equation_22_crouches_and_the_barrier_keeps_height(benefits):
    # in one cycle of 12 s by half, in two to the ground
    assert benefits["printed"].low < 0.55 * benefits["off"].low
    assert benefits["text"].low < 0.55 * benefits["off"].low
    assert benefits["barrier"].low > 0.95 * benefits["off"].low


def test_levelling_is_real(benefits):
    for choice in ("printed", "text", "barrier"):
        assert benefits[choice].pitch < 0.7 * benefits["off"].pitch


def test_loads_balance_and_friction_is_the_slope():
    gait = bp.Crawl(velocity=(0.012, 0.0), cycle_time=12.0)
    level, slope = (
        loads_of(bp.plan(bp.silo4(), gait, bp.Plane(slope=tilt), bp.times(0, 6, dt=0.05)))
        for tilt in ((0.0, 0.0), (0.15, 0.1))
    )
    assert np.abs(np.nansum(level.normal, axis=1) - 30.0 * 9.81).max() < 1e-6
    assert np.abs(level.needed).max() < 1e-6
    # all normals are one: the friction is the tangent of the slope, the loads carry what is across it
    steep = np.hypot(0.15, 0.1)
    assert np.abs(slope.needed - steep).max() < 1e-6
    assert np.abs(np.nansum(slope.normal, axis=1) - 30.0 * 9.81 / np.hypot(1.0, steep)).max() < 1e-6
    assert np.isnan(slope.normal).any() and np.nanmin(slope.normal) > 0.0


def test_loads_are_said_and_drawn(walk):
    page, found = crawling_section(walk, {}), loads_of(walk)
    assert "What the feet carry" in page and f"{np.nanmax(found.normal):.3g}" in page
    plots = loads_plots(walk)
    assert [curve["name"] for curve in plots["walk_loads"]["data"]] == list(found.feet)
    assert set(plots) == {"walk_loads", "walk_friction"} and set(plots) <= set(crawling_plots(walk))
    level = bp.plan(bp.silo4(), bp.Crawl(), bp.Plane(), bp.times(0, 3, dt=0.1))
    assert set(loads_plots(level)) == {"walk_loads"} and "without friction" in loads_text(level)


def test_where_it_tips_no_friction_is_enough():
    gait = bp.Crawl((0.01, 0.0), sway=0, sequence=("fl", "hl", "fr", "hr"))
    motion = bp.plan(bp.silo4(), gait, bp.Plane(), bp.times(0, 12, dt=0.05))
    assert np.isinf(loads_of(motion).needed).any() and "there it tips" in loads_text(motion)
