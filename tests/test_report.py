"""What a report is made of: numbers as text, one time axis for plan and trial, losses by stage, shapes."""

from __future__ import annotations

import base64
import re
import subprocess
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.metrics import metrics_of
from bodyplan.show.figures import write_figures
from bodyplan.show.keyframes import SIDE, TOP, view_of
from bodyplan.show.outcome import five_point_gaps
from bodyplan.show.playback import MOST_FRAMES, Playback, centre_of_mass
from bodyplan.show.remarks import gathered
from bodyplan.show.scene import scene
from bodyplan.show.series import compact, crest, loads
from bodyplan.show.shapes import bones, extent, outline, scenery
from bodyplan.show.stages import lag_by_phase, lanes, shades, stage_rows, stages_of, worst
from bodyplan.show.text import NOTHING, counted, figure, listed, plain, table, unit_of
from report_cases import (
    CYCLES,
    LOST,
    START,
    cart,
    caterpillar,
    diverged_trial,
    full_outcome,
    outcome,
    snake_motion,
    snake_trial,
    stick,
)

# --- warnings of the physics


def test_the_same_trouble_of_many_joints_is_one_line() -> None:
    pytest.importorskip("mujoco")
    gait = bp.Concertina(body_modules=2, gamma_max=0.8, stretch_time=1.0, contraction="mirror")
    times = bp.times(0.0, 2.0, dt=0.05)
    weak = bp.plan(bp.snake(8, 0.1, effort=0.02), gait, bp.Corridor(0.16, friction=0.3), times)
    trial = bp.simulate(weak, cycles=1, settle=0.2, ramp=0.0, dt=2e-3, servo=(20.0, 0.4))
    single = [text for text in trial.warnings if "at its effort" in text]
    assert len(single) > 3
    (line,) = [text for text in gathered(trial, weak.robot) if "effort" in text]
    shares = {re.findall(r"'(.*?)'", text)[0]: float(re.findall(r"for (\S+) %", text)[0]) for text in single}
    assert line.startswith(f"{len(single)} servos are at their effort 0.02, most: ")
    named = {name: float(share) for name, share in re.findall(r"(\w+) \((\S+) % of the time\)", line)}
    assert len(named) == 3 and all(shares[name] == share for name, share in named.items())
    assert min(named.values()) >= max(share for name, share in shares.items() if name not in named)


def test_joints_at_their_limits_are_one_line_with_the_farthest() -> None:
    robot = bp.snake(5, 0.1, limits=(-0.5, 0.5))
    q = np.zeros((2, 4))
    q[1] = 0.51, -0.53, 0.1, 0.52
    effort = "servo of joint 'yaw1' is at its effort 1 for 2.0 % of the time"
    texts = [f"joint 'yaw{i}' is pushed against its limit" for i in (1, 2, 4)]
    trial = replace(snake_trial(), q=q, warnings=("a", *texts, effort))
    assert gathered(trial, robot) == [
        "a",
        "3 joints are pushed against their limits, "
        "yaw2 (by 1.72\u00a0°), yaw4 (by 1.15\u00a0°) and yaw1 (by 0.573\u00a0°)",
        effort,
    ]
    assert gathered(replace(trial, warnings=texts[:1]), robot) == texts[:1]


# --- text


def test_figures_carry_units_and_never_show_what_is_not_a_number() -> None:
    assert figure(0.18446, "m") == "184.5\u00a0mm"
    assert figure(-0.004075, "m") == "−4.075\u00a0mm"
    assert figure(1.3, "m") == "1.3\u00a0m"
    assert figure(1.18e-16, "m", 3) == "1.18×10⁻¹⁶\u00a0m"
    assert figure(0.0184, "m/s") == "18.4\u00a0mm/s"
    assert figure(0.5, "N m") == "0.5\u00a0N\u00a0m"
    assert figure(0.0, "m") == "0\u00a0m"
    assert [figure(x, digits=3, zeros=True) for x in (1.0, 184.0, 0.44, 0.99951)] == [
        "1.00",
        "184",
        "0.440",
        "1.00",
    ]
    for value in (None, float("nan"), float("inf"), -float("inf")):
        assert figure(value, "m") == NOTHING


def test_words_of_values() -> None:
    assert [counted(n, "check") for n in (0, 1, 2)] == ["0 checks", "1 check", "2 checks"]
    assert [listed(x) for x in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]
    assert plain({"kp": [20.0, 0.4], "on": True, "x": None}) == "kp 20, 0.4, on yes, x –"
    units = {"peak_joint_rate": "rad/s", "advance_per_cycle": "m", "advance_per_body_length": "", "count": ""}
    assert {name: unit_of(name) for name in units} == units
    assert '<th scope="col" class="n">a</th>' in table(("a",), [("1",)], numbers=(0,))


# --- plan and trial on one time axis


def test_the_playback_repeats_the_plan_and_follows_the_trial() -> None:
    motion, trial = snake_motion(), snake_trial()
    playback = Playback.of(motion, trial)
    period, advance = motion.facts["period"], motion.facts["advance_per_cycle"]
    assert (playback.period, playback.cycles, playback.span) == (period, CYCLES, period)
    assert playback.t[0] == 0.0 and playback.t[-1] == pytest.approx(CYCLES * period, abs=1e-12)
    np.testing.assert_allclose(playback.planned_advance, advance, rtol=1e-12)
    # at the beginning of each cycle the planned body stands in its first pose, moved on by the advance
    first = motion.poses().array[0]
    for cycle in range(CYCLES + 1):
        i = int(np.abs(playback.t - cycle * period).argmin())
        assert playback.t[i] == pytest.approx(cycle * period, abs=1e-12)
        np.testing.assert_allclose(playback.planned[i, :, :3] - first[:, :3], [[cycle * advance, 0, 0]] * 9, atol=1e-12)
    assert playback.executed is not None and playback.executed.shape == playback.planned.shape
    records = motion.robot.forward(trial.q, trial.base).array
    at = np.searchsorted(trial.t, playback.t + START - 1e-9)
    np.testing.assert_array_equal(playback.executed, records[at])


def test_advance_and_lag_are_those_that_the_trial_was_made_with() -> None:
    playback = Playback.of(snake_motion(), snake_trial())
    period, advance = playback.span, snake_motion().facts["advance_per_cycle"]
    lag = playback.lag()
    assert lag is not None
    np.testing.assert_allclose(lag, -LOST * playback.t / period, atol=1e-12)
    planned = playback.advance(playback.planned_centre)
    assert planned[0] == 0.0 and planned[-1] == pytest.approx(CYCLES * advance, abs=1e-12)


def test_a_diverged_trial_plays_from_its_settling_to_its_end() -> None:
    playback = Playback.of(snake_motion(), diverged_trial())
    assert playback.t[0] == -START and playback.t[-1] == pytest.approx(1.5)
    assert playback.executed is not None and len(playback.executed) == len(playback.t)
    assert lag_by_phase(playback) is None
    assert all(row.lag is None and row.along is None for row in stage_rows(playback, diverged_trial()))
    assert loads(snake_motion(), diverged_trial()) is None


def test_a_trial_without_records_shows_the_plan_alone() -> None:
    whole = diverged_trial()
    empty = {name: getattr(whole, name)[:0] for name in ("t", "base", "q", "torque", "com")}
    none = bp.Trial(
        joints=whole.joints,
        kinds=whole.kinds,
        **empty,
        start_time=START,
        period=whole.period,
        cycles=1,
        planned_advance=whole.planned_advance[:1],
        status="diverged",
        reason="at once",
    )
    playback = Playback.of(snake_motion(), none)
    assert playback.executed is None and playback.lag() is None and playback.cycles == 1


def test_long_motions_are_thinned_ends_included() -> None:
    t = np.linspace(0.0, 600.0, 20_001)
    motion = stick().replace(
        t=t,
        base=np.tile(stick().base[0], (len(t), 1)),
        q=np.zeros((len(t), 0)),
        qd=np.zeros((len(t), 0)),
        qdd=np.zeros((len(t), 0)),
        residual=np.zeros(len(t)),
        status=np.full(len(t), "ok"),
    )
    playback = Playback.of(motion, None)
    assert len(playback.t) == MOST_FRAMES and playback.t[0] == 0.0 and playback.t[-1] == 600.0
    assert playback.planned_advance[0] == 0.0


def test_centre_of_mass_of_equal_links_is_the_mean_of_their_middles() -> None:
    motion = snake_motion()
    poses = motion.poses().array
    middles = 0.5 * (poses[:, 1:, :3] + poses[:, :-1, :3])
    np.testing.assert_allclose(centre_of_mass(motion.robot, poses), middles.mean(axis=1), atol=1e-15)
    poses = stick().poses().array
    np.testing.assert_allclose(centre_of_mass(stick().robot, poses), [[0.05, 0.0, 0.0]] * 3)


# --- stages


def test_every_stage_loses_its_share_of_a_steady_slide() -> None:
    trial, playback = snake_trial(), Playback.of(snake_motion(), snake_trial())
    rows = stage_rows(playback, trial)
    assert [row.name for row in rows] == [name for name, _, _ in snake_motion().stages]
    for row in rows:
        share = LOST * (row.end - row.start) / playback.span
        assert row.along == pytest.approx(-share, rel=1e-9)
        assert row.largest == pytest.approx(share, rel=1e-9)
        assert row.lag == pytest.approx(-share, rel=1e-6)
    assert sum(row.lag or 0.0 for row in rows) == pytest.approx(-LOST, rel=1e-6)
    longest = max(rows, key=lambda row: row.end - row.start)
    assert worst(rows)[0].end - worst(rows)[0].start == pytest.approx(longest.end - longest.start)


def test_without_a_trial_stages_have_times_only() -> None:
    rows = stage_rows(Playback.of(caterpillar(), None), None)
    assert [(r.name, r.start, r.end, r.along, r.lag) for r in rows] == [
        ("lift", 0.0, 2.5, None, None),
        ("<b>put</b>", 2.0, 4.0, None, None),
    ]


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0.01, 5)), max_size=12))
def test_stages_on_one_line_never_overlap(pairs: list[tuple[float, float]]) -> None:
    stages = sorted((("s", a, a + length) for a, length in pairs), key=lambda s: (s[1], s[2]))
    found = lanes(stages)
    for lane in set(found):
        mine = [stage for stage, at in zip(stages, found, strict=True) if at == lane]
        assert all(b[1] >= a[2] - 1e-9 for a, b in pairwise(mine))
        shade = [s for s, at in zip(shades(stages), found, strict=True) if at == lane]
        assert all(a != b for a, b in pairwise(shade))


# --- shapes


def _area(polygon: np.ndarray) -> float:
    x, y = polygon.T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def test_outlines_have_the_area_of_their_shapes() -> None:
    pose = np.array([1.0, 2.0, 3.0, np.cos(0.4), 0.0, 0.0, np.sin(0.4)])
    capsule = bp.Contact("c", "f", "capsule", 0.1, start=(-0.5, 0.0, 0.0))
    (polygon,) = outline(capsule, pose, TOP)
    assert _area(polygon) == pytest.approx(0.5 * 0.2 + np.pi * 0.01, rel=0.01)
    np.testing.assert_allclose(
        polygon.mean(axis=0), pose[:2] + 0.5 * (polygon[0] + polygon[13] - 2 * pose[:2]), atol=0.2
    )
    (circle,) = outline(bp.Contact("s", "f", "sphere", 0.2), pose, SIDE)
    assert _area(circle) == pytest.approx(np.pi * 0.04, rel=0.01)
    np.testing.assert_allclose(circle.mean(axis=0), [1.0, 3.0], atol=1e-12)
    (rim,) = outline(bp.Contact("r", "f", "rim", 0.2), pose, TOP)
    assert _area(rim) == pytest.approx(np.pi * 0.04, rel=0.01)
    faces = outline(bp.Contact("b", "f", "box", half=(0.1, 0.2, 0.3)), pose, TOP)
    assert len(faces) == 6 and max(map(_area, faces)) == pytest.approx(0.2 * 0.4, rel=1e-12)


def test_every_frame_without_a_capsule_has_a_bone() -> None:
    assert bones(snake_motion().robot) == []
    assert len(bones(cart().robot)) == 7


def test_the_extent_holds_every_outline() -> None:
    for motion in (snake_motion(), cart(), caterpillar()):
        poses = motion.poses().array
        low, high = extent([poses], motion.robot)
        for axes in (TOP, SIDE):
            for contact in motion.robot.contacts:
                for pose in poses[:, motion.robot.frame_index(contact.frame)][::10]:
                    points = np.concatenate(outline(contact, pose, axes))
                    assert np.all(points >= low[list(axes)]) and np.all(points <= high[list(axes)])


def test_ground_becomes_planes_faces_and_grids() -> None:
    low, high = extent([snake_motion().poses().array], snake_motion().robot)
    around = scenery(snake_motion().ground, low, high)
    assert len(around.planes) == 1 and len(around.faces) == 12 and not around.fields
    np.testing.assert_allclose(around.planes[0][:, 2], 0.0, atol=1e-12)
    inner = [f for f in around.faces if np.allclose(np.abs(f.corners[:, 1]), 0.08)]
    assert len(inner) == 2 and all(f.normal @ f.corners[0] < 0.0 for f in inner)
    assert min(float(f.corners[:, 2].min()) for f in around.faces) == pytest.approx(0.0, abs=1e-12)
    slope = scenery(bp.Plane(0.1, slope=(0.2, -0.3)), low, high).planes[0]
    np.testing.assert_allclose(slope[:, 2], 0.1 + 0.2 * slope[:, 0] - 0.3 * slope[:, 1], atol=1e-12)
    ((x, y, z),) = scenery(cart().ground, *extent([cart().poses().array], cart().robot)).fields
    np.testing.assert_allclose(z, cart().ground.height(x[None, :], y[:, None]), atol=1e-12)


def test_the_view_is_from_the_side_of_a_body_that_bends_upwards() -> None:
    assert view_of(Playback.of(snake_motion(), None)) == TOP
    assert view_of(Playback.of(caterpillar(), None)) == SIDE


# --- series and scene


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=300), st.integers(1, 40))
def test_thinned_curves_keep_their_peak(values: list[float], most: int) -> None:
    t, y = crest(np.arange(len(values), dtype=float), np.array(values), most)
    assert len(t) == len(y) <= most and y.max() == max(values)


def test_compact_numbers_are_json() -> None:
    assert compact(np.array([[1.23456789, np.nan], [np.inf, -2e-9]])) == [[1.2346, None], [None, -2e-9]]


def test_the_scene_carries_the_poses() -> None:
    playback = Playback.of(snake_motion(), snake_trial())
    data = scene(playback)
    poses = np.frombuffer(base64.b64decode(data["executed"]["poses"]), "<f4").reshape(-1, data["bodies"], 7)
    np.testing.assert_allclose(poses, playback.executed, atol=1e-6)
    advance = np.frombuffer(base64.b64decode(data["planned"]["advance"]), "<f4")
    np.testing.assert_allclose(advance, playback.advance(playback.planned_centre), atol=1e-6)
    assert [shape["kind"] for shape in data["shapes"]] == ["capsule"] * 8
    assert data["stages"] == [
        {"name": name, "start": start, "end": end, "lane": lane, "shade": shade}
        for (name, start, end), lane, shade in zip(
            stages_of(playback), lanes(stages_of(playback)), shades(stages_of(playback)), strict=True
        )
    ]


# --- numbers shared with metrics.json


def test_gaps_of_the_five_point_formula() -> None:
    assert five_point_gaps(stick()) == {}
    uneven = snake_motion()
    keep = np.r_[0:10, 12:40]
    names = ("t", "base", "q", "qd", "qdd", "residual", "status")
    assert five_point_gaps(uneven.replace(claims=(), **{n: getattr(uneven, n)[keep] for n in names})) == {}
    # q = t^3: the formula is exact for its rate, and for the rate's rate
    t = np.linspace(0.0, 1.0, 21)[:, None]
    robot = bp.snake(2, 0.1)
    base = np.tile([0.0, 0, 0, 1, 0, 0, 0], (21, 1))
    cubic = bp.Motion(robot, bp.Plane(), {}, t[:, 0], base, t**3, 3 * t**2, 6 * t, np.zeros(21), np.full(21, "ok"))
    gaps = five_point_gaps(cubic)
    assert set(gaps) == {"rate_gap_rms", "rate_gap_max", "acceleration_gap_rms", "acceleration_gap_max"}
    assert max(gaps.values()) < 1e-11
    assert metrics_of(full_outcome()).five_point == five_point_gaps(snake_motion())
    assert metrics_of(full_outcome()).versions["mujoco"] == "4.0.0"


# --- figures


ALL = {"advance", "body_keyframes", "joint_angles", "joint_rates", "slip_by_stage", "torque"}


@pytest.mark.parametrize(
    ("case", "missing"),
    [
        (full_outcome, set()),
        (lambda: outcome(diverged_trial()), {"slip_by_stage", "torque"}),
        (lambda: outcome(None), {"slip_by_stage", "torque"}),
        (lambda: outcome(None, cart()), {"slip_by_stage"}),
        (lambda: outcome(None, caterpillar()), {"slip_by_stage", "torque"}),
        (lambda: outcome(None, stick()), {"joint_angles", "joint_rates", "slip_by_stage", "torque"}),
    ],
    ids=["trial", "diverged", "plan", "cart", "caterpillar", "stick"],
)
def test_figures_are_written_and_show_something(case, missing, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    from matplotlib.image import imread

    made = case()
    texts = write_figures(made, Playback.of(made.motion, made.trial), tmp_path / "figures")
    assert set(texts) == ALL - missing
    for name, text in texts.items():
        root = ElementTree.fromstring(text)
        assert root.tag.endswith("svg") and len(list(root.iter())) > 30
        picture = imread(tmp_path / "figures" / f"{name}.png")
        assert picture.shape[0] > 150 and picture.shape[1] > 800
        assert float(picture[..., :3].std()) > 0.02


def test_equal_runs_give_equal_figures(tmp_path: Path) -> None:
    made = outcome(None, stick())
    one, two = (write_figures(made, Playback.of(made.motion, None), tmp_path / name) for name in "ab")
    assert one == two and not re.search(r"<dc:date>", one["advance"])


def test_drawing_leaves_pyplot_alone() -> None:
    code = (
        "import sys, bodyplan as bp; bp.show; import bodyplan.show.report;"
        "assert not {'matplotlib', 'plotly', 'mujoco', 'scipy.optimize'} & set(sys.modules);"
        "from bodyplan.show.figures import new_figure; new_figure(2.0);"
        "assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
