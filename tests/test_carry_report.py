"""The report of a body on wheels: its table, plots, figures and maps tell what the plan and the statics say."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import bodyplan as bp
from bodyplan.check import check
from bodyplan.gaits.carry import hull, orientation, report, wheel_rates
from bodyplan.gaits.carry.wheels import Wheels
from bodyplan.show.beside import beside, check_facts
from bodyplan.show.carrying import Carrying, _twists
from bodyplan.show.carrying_figures import wheels_above, wheels_maps
from bodyplan.show.carrying_page import carrying_section
from bodyplan.show.carrying_plots import carrying_plots
from bodyplan.show.outcome import Outcome
from bodyplan.show.overview import verdict
from bodyplan.show.playback import Playback
from bodyplan.simulate.trial import Trial

ROBOT = bp.tri_wheel()
HILLS = bp.Surface("sin(0.5*(x+y))/15")


class Row:
    """A row of a mission's table beside a paper."""

    def __init__(self, ours: str, printed: float, unit: str) -> None:
        self.what, self.printed, self.unit, self.ours, self.source = "one", printed, unit, ours, "a page"


@pytest.fixture(scope="module")
def motion() -> bp.Motion:
    return bp.plan(ROBOT, bp.Carry(("sin(t)", "cos(t)"), height=0.15), HILLS, bp.times(0, 3, dt=0.05))


@pytest.fixture(scope="module")
def found(motion: bp.Motion) -> Carrying:
    made = Carrying.of(motion)
    assert made is not None
    return made


def outcome(motion: bp.Motion, rows: tuple[Row, ...] = (), trial: Trial | None = None) -> Outcome:
    figures = {None: {f"plan.{name}": value for name, value in motion.facts.items()}}
    return Outcome("m", "m", "", "", (), motion, check(motion), trial, paper=beside(rows, figures))


def draw(height: float) -> Figure:
    return Figure(figsize=(8.0, height))


def test_what_is_shown_is_what_was_planned(motion: bp.Motion, found: Carrying) -> None:
    assert motion.torques is not None
    for k, name in enumerate(("fl", "fr", "r")):
        column = ROBOT.joint_index(f"{name}.adjust")
        np.testing.assert_allclose(found.angle[:, k], motion.q[:, column], atol=1e-12)
        np.testing.assert_allclose(found.torque[:, k], motion.torques[:, column])
        np.testing.assert_allclose(found.spin[:, k], motion.qd[:, ROBOT.joint_index(f"{name}.spin")])
        assert np.abs(found.paper[:, k]).max() == pytest.approx(motion.facts[f"{name}_paper_torque"], rel=1e-9)
    assert np.nanmax(np.abs(found.slip)) == pytest.approx(motion.facts["peak_slip_speed"], rel=1e-3)
    assert np.nanmax(found.used) == pytest.approx(motion.facts["friction_used"], rel=1e-9)
    assert found.clearance is not None and found.clearance.min() == pytest.approx(motion.facts["hull_clearance"])


def test_velocities_by_differences_are_those_of_the_path(motion: bp.Motion) -> None:
    """Also at the first and the last sample, and to second order."""
    fine = bp.plan(ROBOT, bp.Carry(("sin(t)", "cos(t)"), height=0.15), HILLS, bp.times(0, 1, dt=0.01))
    twists = _twists(fine)
    np.testing.assert_allclose(twists, np.tile([1.0, 0, 0, 0, 0, -1.0], (len(twists), 1)), atol=2e-4)
    from bodyplan.gaits.carry import pose_of

    slip = wheel_rates(pose_of(ROBOT, HILLS, fine.base), twists)["r"].slip
    assert np.ptp(slip) < 0.01


def test_the_table_names_ranges_and_the_plots_the_paper(motion: bp.Motion, found: Carrying) -> None:
    rows = (Row("plan.smallest_adjust_angle", 20.0, "deg"), Row("plan.r_largest_angle", 115.0, "deg"))
    page = carrying_section(found, {"wheels_maps": "<svg></svg>"}, paper=True)
    assert "On its wheels" in page and "What is in reach" in page and "Dotted: what the paper prints" in page
    assert f"{motion.facts['fl_largest_torque']:.3g}" in page and "nan" not in page
    plots = carrying_plots(outcome(motion, rows), found)
    names = [one["name"] for one in plots["wheel_angles"]["data"]]  # type: ignore[index]
    assert names == ["fl", "fr", "r", "the paper: 20°", "the paper: 115°"]
    assert all(plot is not None for plot in plots.values())
    torques = plots["wheel_torques"]["data"]  # type: ignore[index]
    assert [one["name"] for one in torques if one.get("line", {}).get("dash") == "dash"] == [
        "fl by (35)",
        "fr by (35)",
        "r by (35)",
    ]
    assert sum("fill" in one for one in torques) == 3


def test_figures_show_tracks_and_maps(found: Carrying, motion: bp.Motion) -> None:
    above = wheels_above(Playback.of(motion, None), draw)
    assert above is not None
    labels = above.axes[0].get_legend_handles_labels()[1]
    assert labels == ["contact of fl", "contact of fr", "contact of r", "body"]
    made = wheels_maps(found, draw)
    assert made is not None and [ax.get_xlabel() for ax in made.axes[:3]] == ["heading (°)"] * 3
    place, heading, height = found.place
    np.testing.assert_allclose(place, motion.base[len(motion.t) // 2, :2])
    assert height == pytest.approx(0.15) and np.cos(heading) == pytest.approx(np.cos(motion.t[len(motion.t) // 2]))


def test_other_gaits_have_no_such_part() -> None:
    snake = bp.plan(bp.snake(8, 0.1), bp.Serpentine(bp.Serpenoid(0.5), speed=0.1), bp.Plane(), bp.times(0, 1, dt=0.1))
    assert Carrying.of(snake) is None and carrying_section(None, {}, paper=False) == ""
    assert carrying_plots(outcome(snake), None) == {} and wheels_maps(None, draw) is None


@pytest.mark.parametrize(
    ("gait", "ground", "said"),
    [
        (bp.Carry("line", height=0.5), bp.Plane(), "Nothing holds the body at rest"),
        (bp.Carry("line", height="0.15+0.1*t"), bp.Plane(), "samples that were solved"),
        (bp.Carry("line", height_mode="vertical"), bp.Plane(slope=(0.0, 0.15), friction=0.1), "Nothing holds"),
        (bp.Carry("line"), bp.Profile([(-9.0, 0.0), (0.8, 0.02)]), "inside the polygon"),
        (bp.Carry({"kind": "line", "start": (0.9, 1.0)}), bp.HeightMap(np.zeros((9, 9)), 0.25), "inside the polygon"),
    ],
)
def test_what_cannot_be_done_has_a_page_too(gait: bp.Carry, ground: bp.Plane, said: str) -> None:
    made = bp.plan(ROBOT, gait, ground, bp.times(0, 2, dt=0.1))
    found = Carrying.of(made)
    assert found is not None
    page = carrying_section(found, {}, paper=False)
    assert said in page and "nan" not in page
    carrying_plots(outcome(made), found)
    assert wheels_above(Playback.of(made, None), draw) is not None
    wheels_maps(found, draw)


def test_two_fixed_wheels_have_a_page() -> None:
    cart = bp.rover({"a": (0.0, 0.3), "b": (0.0, -0.3)}, radius=0.1, thickness=0.0)
    made = bp.plan(cart, bp.Carry("line", height=0.1), bp.Plane(), bp.times(0, 1, dt=0.1))
    found = Carrying.of(made)
    assert found is not None and "the notes say why" in carrying_section(found, {}, paper=False)
    plots = carrying_plots(outcome(made), found)
    assert {name for name, plot in plots.items() if plot} == {"wheel_spins"}


def test_a_turn_that_is_not_made_is_the_verdict(motion: bp.Motion) -> None:
    trial = bp.simulate(motion, settle=0.2, ramp=0.0, dt=2e-3)
    text = verdict(outcome(motion, trial=trial))
    assert "of the planned turn: it cannot turn" in text
    assert "planned advance" in verdict(outcome(motion, trial=replace(trial, yaw_ratio=1.0)))


def test_facts_that_need_a_library_may_be_missing() -> None:
    check_facts("plan.r_largest_torque", ["speed"], "m", bp.Carry.OPTIONAL_FACTS)
    with pytest.raises(bp.UnknownNameError, match="largest_angel"):
        check_facts("plan.largest_angel", ["speed"], "m", bp.Carry.OPTIONAL_FACTS)


@pytest.mark.parametrize("ground", [bp.Surface("0.1*exp(-((x-0.3)**2 + y**2)/0.05)"), bp.Surface("0.03*sin(9*x)*y")])
def test_the_clearance_is_that_of_all_points_of_all_samples(ground: bp.Surface) -> None:
    wheels, rng, count = Wheels.of(bp.tri_wheel()), np.random.default_rng(4), 90
    (box,) = hull.boxes(wheels.robot)
    place = np.column_stack([rng.uniform(-1.0, 1.0, (count, 2)), rng.uniform(0.25, 0.4, count)])
    turn = orientation.matrix(*rng.uniform(-0.3, 0.3, (3, count)))
    ok = rng.random(count) < 0.8
    at = place[:, None] + np.einsum("tij,pj->tpi", turn, hull.lower_face(box))
    wanted = (at[..., 2] - ground.height(at[..., 0], at[..., 1]))[ok].min()
    body = SimpleNamespace(position=place, turn=SimpleNamespace(matrix=turn))
    assert report._clearance(wheels, ground, body, ok) == pytest.approx(wanted, abs=1e-14)
