"""What a report says of a snake on its anchors: how it stands and tips, pictures, torques, speeds under ceilings."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.gaits.rectilinear import under_ceilings
from bodyplan.show import inching as shown
from bodyplan.show.figures import new_figure, write_figures
from bodyplan.show.inching import FiveAnchors, Inching, Levels, NotShown
from bodyplan.show.inching_figures import MOST, footholds, keys, side_views
from bodyplan.show.inching_page import inching_section, move_rows
from bodyplan.show.inching_plots import inching_plots, tilts
from bodyplan.show.playback import Playback
from bodyplan.show.report import page
from bodyplan.show.scene import scene
from bodyplan.show.stages import MANY_ROWS, StageRow, cycle_number, gathered_rows, plain_name, stage_rows
from inching_report_cases import climber, five, five_trial, footed, inching, long_way, steered, three
from report_cases import outcome, snake_motion

#: heights in the tables of these tests: every one is a search
FEW = 3


@pytest.fixture(autouse=True)
def few_heights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shown, "HEIGHTS", FEW)
    monkeypatch.setattr(shown, "FEW_HEIGHTS", 2)


def section(motion: bp.Motion, trial: bp.Trial | None = None) -> str:
    """The text of the section, without what is drawn."""
    made = outcome(trial, motion)
    return inching_section(made, Playback.of(motion, trial), {}).replace("\u00a0", " ")


# --- what it shows is where the robot is


@pytest.mark.parametrize("motion", [five, three, climber], ids=["five", "three", "steps"])
def test_points_and_centre_of_mass_are_those_of_the_links(motion) -> None:  # type: ignore[no-untyped-def]
    found = inching(motion())
    made = np.linalg.norm(np.diff(found.points, axis=1), axis=-1)
    np.testing.assert_allclose(made[:, 1:-1], np.broadcast_to(found.snake.links, made[:, 1:-1].shape), atol=1e-12)
    np.testing.assert_allclose(made[:, [0, -1]], np.broadcast_to([found.snake.tail, found.snake.head], (len(made), 2)))
    # even links: their middles, weighed by their lengths
    middles = 0.5 * (found.points[:, 1:] + found.points[:, :-1])
    centre = np.einsum("tl,tlk->tk", made, middles) / made.sum(axis=1)[:, None]
    assert found.centre is not None
    np.testing.assert_allclose(found.centre, centre, atol=1e-12)


@pytest.mark.parametrize("motion", [five, three, climber], ids=["five", "three", "steps"])
def test_the_margin_is_the_judges(motion) -> None:  # type: ignore[no-untyped-def]
    found, line = inching(motion()), bp.check(motion())["the centre of mass is over the standing anchors"]
    assert found.margin is not None and line.value is not None
    assert found.margin.min() == pytest.approx(line.value, abs=1e-9)
    x = np.where(found.standing, found.anchors[..., 0], np.nan)
    np.testing.assert_allclose(found.rear, np.nanmin(x, axis=1), atol=1e-12)
    np.testing.assert_allclose(found.front, np.nanmax(x, axis=1), atol=1e-12)


def test_three_anchors_tip_forward_and_five_do_not() -> None:
    found = inching(three())
    assert found.margin is not None
    k = int(found.margin.argmin())
    assert found.tips(k) == "forward" and found.move_at(float(found.t[k])) == "head moves, cycle 1"
    # the other way round the tail is lifted with the weight behind the middle
    gait = bp.Rectilinear(3, drive="paper", spacing=(0.7, 0.3), lift=0.1, move_time=1.0)
    other = inching(bp.plan(footed(10, 1.0), gait, bp.Plane(), bp.times(0.0, 3.0, dt=0.02)))
    assert other.margin is not None
    worst = int(other.margin.argmin())
    assert other.tips(worst) == "backward" and other.move_at(float(other.t[worst])).startswith("tail")
    assert not any(inching(five()).tips(i) for i in range(len(inching(five()).t)))


def test_the_rule_does_not_repeat_and_the_fastest_drive_does() -> None:
    np.testing.assert_allclose(inching(three()).drives, [[0.72, 1.68, 1.68], [1.296, 1.68, 1.68]], atol=1e-9)
    stride = five().facts["advance_per_cycle"]
    np.testing.assert_allclose(inching(five()).drives, [[stride] * 5], atol=1e-9)
    # a cycle that is not whole does not count
    cut = bp.plan(three().robot, bp.Rectilinear(**{k: v for k, v in three().gait.items() if k != "kind"}), bp.Plane(),
                  bp.times(0.0, 17.0, dt=0.02))  # fmt: skip
    assert len(inching(cut).drives) == 1


def test_five_anchors_on_the_same_links() -> None:
    # legs of 3200 and 2000 mm, strides of 1200: with two phases the weight is in the middle of the body
    gait = bp.Rectilinear(3, drive=[1.2] * 3, spacing=0.8, lift=0.1, move_time=1.0)
    found = inching(bp.plan(footed(10, 1.0), gait, bp.Plane(), bp.times(0.0, 3.0, dt=0.02)))
    five_anchors = found.five
    assert isinstance(five_anchors, FiveAnchors)
    assert five_anchors.spacing == pytest.approx(3.2) and five_anchors.stride == pytest.approx(1.2)
    robot = footed(18, 1.0)
    same = bp.Rectilinear(5, drive=[1.2] * 5, spacing=0.8, schedule="two-phase", lift=0.1, move_time=1.0)
    margin = bp.plan(robot, same, bp.Plane(), bp.times(0.0, 2.0, dt=0.01)).facts["support_margin"]
    assert five_anchors.margin == pytest.approx(margin, abs=1e-3) and five_anchors.margin > 2.2


def test_levels_of_floor_and_ceiling() -> None:
    found = inching(climber())
    np.testing.assert_allclose(found.floor.breaks, [1.2, 1.5, 2.0])
    np.testing.assert_allclose(found.floor.z, [0.0, 0.03, 0.03, 0.0])
    np.testing.assert_allclose(found.ceiling.z, [0.3, 0.3, 0.35, 0.35])
    assert found.floor.between(1.0, 1.4) == [(1.0, 1.2, 0.0), (1.2, 1.4, 0.03)]
    assert Levels(np.zeros(0), np.array([0.5])).between(-1.0, 1.0) == [(-1.0, 1.0, 0.5)]
    level = inching(five())
    assert level.floor.z.tolist() == [0.0] and level.ceiling.z.tolist() == [0.16]


def test_the_gap_below_a_ceiling() -> None:
    found = inching(five())
    poses = five().robot.forward(five().q, five().base).array[: len(found.t)]
    gap = found.ceiling_gap(poses)
    assert gap is not None
    np.testing.assert_allclose(gap, 0.16 - found.elbows[..., 1].max(axis=1) - found.snake.top, atol=1e-12)
    # the fastest gait takes all the room that there is, at some time between two samples
    assert -1e-9 < gap.min() < 1e-4
    assert inching(three()).ceiling_gap(three().robot.forward(three().q[:2]).array) is None


def test_only_this_gait_has_the_section_and_one_that_cannot_be_read_says_why() -> None:
    assert Playback.of(snake_motion(), None).inching is None
    assert section(snake_motion()) == ""
    broken = five().replace(gait={**five().gait, "anchors": 2})
    assert isinstance(Playback.of(broken, None).inching, NotShown) and "anchors" in section(broken)
    unknown = five().replace(gait={**five().gait, "legs": 2})
    assert isinstance(Playback.of(unknown, None).inching, NotShown)


def test_without_masses_nobody_can_tell() -> None:
    bare = five().replace(contacts=None)
    assert inching(bare).margin is None and inching(bare).standing.shape == (len(inching(bare).t), 5)
    # then an anchor stands where it touches the floor
    np.testing.assert_array_equal(inching(bare).standing, inching(five()).standing)
    assert "nobody can tell" in section(bare)


# --- pictures


def test_key_times_of_a_cycle_and_where_it_tips() -> None:
    assert [round(float(inching(five()).t[key.index]), 9) for key in keys(inching(five()))] == [0.0, 0.5, 1.0, 1.5, 2.0]
    found = inching(three())
    times = [round(float(found.t[key.index]), 9) for key in keys(found)]
    assert times == [0.0, 1.5, 3.0, 4.5, 6.0, 7.5, 8.98, 9.0]
    assert keys(found)[6].caption == "8.98 s   head moves"


def test_key_times_over_steps_are_spread_over_the_whole_way() -> None:
    found = inching(climber())
    shown = keys(found)
    assert len(shown) <= MOST and shown[0].index == 0 and found.t[shown[-1].index] == found.moves[-1][2]
    where = [float(found.anchors[key.index, :, 0].mean()) for key in shown]
    assert np.diff(where).max() < 0.4 * (where[-1] - where[0])


@pytest.mark.parametrize("motion", [five, three, climber, steered], ids=["five", "three", "steps", "steered"])
def test_side_views(motion) -> None:  # type: ignore[no-untyped-def]
    found = inching(motion())
    figure = side_views(found, new_figure)
    assert figure is not None
    axes = [ax for ax in figure.axes if ax.get_visible()]
    assert len(axes) == len(keys(found))
    for ax, key in zip(axes, keys(found), strict=True):
        assert ax.get_aspect() == 1.0
        (low, high), (bottom, top) = ax.get_xlim(), ax.get_ylim()
        x, z = found.points[key.index].T
        assert low < x.min() and x.max() < high and bottom < z.min() and z.max() < top
        marks = [line for line in ax.lines if line.get_marker() == "o" and line.get_markersize() == 6.0]
        hollow = sum(len(line.get_xdata()) for line in marks if line.get_markerfacecolor() == "white")
        assert hollow == int((~found.standing[key.index]).sum())
        assert ("tips" in ax.get_title(loc="left") + ax.get_title()) == bool(found.tips(key.index))
    assert (footholds(found, new_figure) is None) == found.track.level


def test_footholds_are_where_the_anchors_stood() -> None:
    found = inching(climber())
    figure = footholds(found, new_figure)
    assert figure is not None
    side, below = figure.axes
    assert side.get_aspect() == 1.0 and side.get_xlim() == below.get_xlim()
    dots = [line for line in below.lines if line.get_marker() == "o"]
    assert len(dots) == 5
    for i, line in enumerate(dots):
        stood = found.anchors[found.standing[:, i], i, 0]
        assert set(np.round(stood, 6)) == set(np.round(np.asarray(line.get_xdata()), 6))


# --- words, tables, plots


def test_words_of_five_anchors_in_physics() -> None:
    text, trial, found = section(five(), five_trial()), five_trial(), inching(five())
    assert found.margin is not None and trial.lift_ratio is not None and trial.tilt is not None
    assert f"<b>{1e3 * found.margin.min():.3g} mm</b> inside" in text and "tips" not in text
    assert "never have a positive support margin" not in text and "does not repeat" not in text
    assert "clear the floor" in text and f"{100.0 * trial.lift_ratio:#.3g} %" in text
    slip = max(abs(s.along) for s in trial.slips)
    assert f"{100.0 * slip / five().facts['advance_per_cycle']:#.3g} % of the stroke" in text
    measured = tilts(Playback.of(five(), trial))
    assert measured is not None and measured[1].max() == pytest.approx(trial.tilt, rel=0.1)
    torques = np.abs(np.asarray(five().torques))
    assert f"<b>{torques.max():.3g} N m</b>" in text


def test_words_of_anchors_that_drag() -> None:
    trial = five_trial()
    low = tuple(replace(lift, executed=0.05 * lift.planned) for lift in trial.lifts)
    assert "<b>drag</b>" in section(five(), replace(trial, lifts=low))
    half = tuple(replace(lift, executed=0.5 * lift.planned) for lift in trial.lifts)
    assert "rise less than they should" in section(five(), replace(trial, lifts=half))


def test_words_of_the_papers_gait() -> None:
    text = section(three())
    assert "This gait tips forward" in text and "at 8.98 s, head moves, cycle 1" in text and "<b>192 mm</b>" in text
    assert "never have a positive support margin" in text and "Five anchors in two phases" in text
    assert "720 mm, 1.68 m and 1.68 m in the first cycle, 1.296 m, 1.68 m and 1.68 m in the second" in text
    assert "does not repeat" in text
    # sliding anchors carry all the time
    sliding = bp.Rectilinear(3, drive="paper", spacing=(0.3, 0.7), lift=0.0, move_time=1.0)
    slides = section(bp.plan(three().robot, sliding, bp.Plane(), bp.times(0.0, 3.0, dt=0.02)))
    assert "never have" not in slides and "tips" not in slides


def test_moves_of_one_name_are_one_row() -> None:
    rows = move_rows(inching(three()), None)
    assert [(row.name, row.times) for row in rows] == [("tail moves", 2), ("middle moves", 2), ("head moves", 2)]
    assert rows[2].margin == pytest.approx(-0.192, abs=1e-6) and rows[2].front
    executed = move_rows(inching(five()), five_trial())
    lifts = [lift for lift in five_trial().lifts if lift.stage == "odd anchors move"]
    least = min(lifts, key=lambda lift: lift.executed / lift.planned)
    assert (executed[0].planned, executed[0].executed) == (least.planned, least.executed)
    slips = [slip for slip in five_trial().slips if slip.stage == "odd anchors move"]
    assert executed[0].slip == max((slip.along for slip in slips), key=abs)
    assert executed[0].far == max(slip.largest for slip in slips)


def test_speeds_under_ceilings_are_the_gaits() -> None:
    found = inching(five())
    heights = np.linspace(0.25, 1.0, FEW) * float(found.snake.links.min())
    assert found.under == under_ceilings(five().robot, bp.Rectilinear(5, **_options(five())), heights.tolist())
    made = inching_plots(outcome(None, five()), Playback.of(five(), None))["ceilings"]
    assert made is not None
    fastest = next(trace for trace in made["data"] if trace["name"] == "fastest")
    speeds = [row.speed["fastest"] for row in found.under]
    np.testing.assert_allclose(fastest["y"], 1e3 * np.array([s for s in speeds if s is not None]), rtol=1e-4)
    # the room here: what the ceiling leaves over the anchors
    assert made["layout"]["shapes"][0]["x0"] == pytest.approx(1e3 * (0.16 - found.snake.rest - found.snake.top))
    text = section(five())
    assert f"Table of {FEW} heights" in text and "60% rule fits from" in text


def test_speeds_of_uneven_legs_are_those_of_straight_ones() -> None:
    found = inching(three())
    assert found.even_gait.spacing == (1.0, 1.0) and any(row.speed["fastest"] is not None for row in found.under)
    assert "differ, so that it has no even speed" in section(three())


def test_where_every_height_is_a_search_there_are_few() -> None:
    gait = bp.Rectilinear(3, lift=0.02, spacing=0.9)
    motion = bp.plan(footed(10, rate=6.0), gait, bp.Plane(), bp.times(0.0, 1.0, dt=0.01))
    assert len(inching(motion).under) == 2


def _options(motion: bp.Motion) -> dict[str, object]:
    return {k: v for k, v in motion.gait.items() if k not in ("kind", "anchors", "steer")}


def test_the_plots_are_of_what_they_say() -> None:
    playback = Playback.of(five(), five_trial())
    made = inching_plots(outcome(five_trial(), five()), playback)
    assert all(plot is not None for plot in made.values())
    margin = np.array(made["support"]["data"][0]["y"])  # type: ignore[index]
    found = inching(five())
    assert found.margin is not None
    assert margin.min() == pytest.approx(1e3 * found.margin.min(), rel=1e-4)
    planned, executed = made["holding"]["data"][:2]  # type: ignore[index]
    assert max(planned["y"]) == pytest.approx(np.abs(np.asarray(five().torques)).max(), rel=1e-4)
    assert planned["x"][-1] > 3.9 and max(planned["y"][100:]) == pytest.approx(max(planned["y"][:99]), rel=1e-6)
    assert max(executed["y"]) <= float(np.asarray(five_trial().torque_peak).max()) * (1.0 + 1e-4)
    gaps = made["under_ceiling"]["data"]  # type: ignore[index]
    assert [trace["name"] for trace in gaps] == ["planned", "executed"]
    red = inching_plots(outcome(None, three()), Playback.of(three(), None))["support"]
    assert red is not None and [trace["name"] for trace in red["data"]] == ["margin", "tips"]
    low = [y for y in red["data"][1]["y"] if y is not None]
    assert low and max(low) < 0.0 and min(low) == pytest.approx(-192.0, rel=1e-3)


# --- long motions


def test_stages_of_many_cycles_are_one_row_a_move() -> None:
    playback = Playback.of(long_way(), None)
    assert len(long_way().stages) > 60
    made = [name.partition(",")[0] for name, start, _ in long_way().stages if start < 16.0]
    rows = stage_rows(playback, None)
    names = ("tail moves", "middle moves", "head moves")
    assert [row.name for row in rows] == [f"{who} ({made.count(who)} times)" for who in names]
    assert len(stage_rows(Playback.of(three(), None), None)) == 6 <= MANY_ROWS
    assert plain_name("tail moves, cycle 12") == "tail moves" and cycle_number("tail moves, cycle 12") == 12
    assert plain_name("fold") == "fold" and cycle_number("fold") == 1


def test_gathered_rows_add_up() -> None:
    rows = [
        StageRow("a, cycle 1", 0.0, 1.0, 0.1, 0.5, -1.0),
        StageRow("b", 0.5, 2.0, None, None, None),
        StageRow("a, cycle 2", 2.0, 3.0, 0.2, 0.4, -2.0),
    ]
    first, second = gathered_rows(rows)
    assert (first.name, first.start, first.end) == ("a (2 times)", 0.0, 3.0)
    assert first.along == pytest.approx(0.3) and first.largest == 0.5 and first.lag == -3.0
    assert second == rows[1]


# --- the replay


def test_feet_hang_on_bars_and_ceilings_are_thin() -> None:
    data = scene(Playback.of(five(), None))
    feet = [c for c in five().robot.contacts if c.shape == "sphere"]
    assert len(data["shapes"]) == len(five().robot.contacts) + len(feet)
    bars = data["shapes"][len(five().robot.contacts) :]
    assert all(bar["end"] == [0.0, 0.0, 0.0] and bar["radius"] < feet[0].radius for bar in bars)
    for motion in (five(), climber()):
        faces = [f for f in scene(Playback.of(motion, None))["ground"]["faces"] if f["role"] == "ceiling"]
        z = np.array([corner[2] for face in faces for corner in face["corners"]])
        assert z.max() - z.min() < 0.3 and len({face["box"] for face in faces}) == len(set(z.tolist())) - 1


# --- the whole


@pytest.mark.parametrize("motion", [five, three, climber, steered, long_way],
                         ids=["five", "three", "steps", "steered", "long"])  # fmt: skip
def test_page_and_figures(motion, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    trial = five_trial() if motion is five else None
    made = outcome(trial, motion())
    playback = Playback.of(made.motion, trial)
    drawn = write_figures(made, playback, tmp_path)
    assert "side_views" in drawn and ("footholds" in drawn) == (motion is climber)
    text = page(made, playback, drawn)
    assert 'id="anchors"' in text and 'alt="The body on its anchors from the side' in text
    visible = re.sub(r"<(script|style).*?</\1>", "", text, flags=re.S)
    assert not re.search(r"\b(nan|None|null|undefined|inf)\b", re.sub(r'src="[^"]*"', "", visible))
    plots = json.loads(re.search(r'id="plots-data">(.*?)</script>', text, re.S)[1])  # type: ignore[index]
    assert ("support" in plots) and ("tilt" in plots) == (trial is not None)
    assert len(text) < 9_000_000


def test_a_plan_that_cannot_go_says_so_at_the_top(tmp_path: Path) -> None:
    gait = bp.Rectilinear(5, schedule="two-phase", lift=0.03, ceiling=0.02)
    motion = bp.plan(footed(), gait, bp.Plane(), bp.times(0.0, 1.0, dt=0.02))
    assert not motion.ok
    made = outcome(None, motion)
    playback = Playback.of(motion, None)
    text = page(made, playback, write_figures(made, playback, tmp_path))
    head = text[: text.index('id="motion"')]
    assert "Stops at 0 s" in head and "above_ceiling" in head


def test_the_sentence_tells_of_steps() -> None:
    text = page(outcome(None, climber()), Playback.of(climber(), None), {})
    assert "a <b>profile</b> (floor with 2 steps and ceiling with 1 step)" in text
    assert "<b>profile</b> (ceiling 160\u00a0mm)" in page(outcome(None, five()), Playback.of(five(), None), {})


def test_what_failed_stands_beside_the_verdict() -> None:
    made = outcome(None, three())
    text = page(made, Playback.of(three(), None), {})
    assert "<small>the centre of mass is over the standing anchors: tips forward at 8.98 s</small>" in text
    assert isinstance(Inching.of(three(), 18.0, False), Inching)
