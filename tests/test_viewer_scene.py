"""What the live viewer draws and how it is served: places against the robot's own kinematics, this machine only."""

from __future__ import annotations

import gc
import io
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.robot.rims import contact_radii
from bodyplan.show.live import Viewer, meshes
from bodyplan.show.live import server as web
from bodyplan.show.live.body import Body
from bodyplan.show.live.of_motion import source_of
from bodyplan.show.live.tracks import Snapshot, Tracks, lowest
from bodyplan.spatial.rotations import rotate
from bodyplan.viewing import view
from report_cases import cart, caterpillar, diverged_trial, follower, roller, snake_motion, snake_trial, stick

pytest.importorskip("viser", reason="viser (extra view) is not installed")


@pytest.fixture(scope="module")
def walk() -> bp.Motion:
    return bp.plan(bp.silo4(), bp.Crawl((0.01, 0.0), margin=0.02), bp.Plane(), bp.times(0, 12, 0.05))


# --- places


@pytest.mark.parametrize("shape", ["sphere", "cylinder", "box", "rim"])
def test_unit_shapes_are_closed_and_face_outward(shape: str) -> None:
    points, faces = getattr(meshes, shape)()
    corners = points[faces]
    # of a closed surface that faces outward: no net area, positive volume; nothing beyond the unit size
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.abs(area.sum(axis=0)).max() < 1e-12
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    exact = {"sphere": 4.0 / 3.0 * np.pi, "cylinder": np.pi, "box": 8.0}
    assert volume > 0.0 and (shape == "rim" or 0.9 * exact[shape] < volume <= exact[shape] * (1.0 + 1e-12))
    assert np.abs(points).max() <= 1.0


def test_turns_from_z_to_any_direction() -> None:
    ways = np.array([[1.0, 2.0, -3.0], [0.0, 0.0, 2.0], [0.0, 0.0, -5.0], [1e-3, 0.0, -1.0]])
    turned = rotate(meshes.from_z(ways), np.array([0.0, 0.0, 1.0]))
    assert np.abs(turned - ways / np.linalg.norm(ways, axis=1, keepdims=True)).max() < 1e-12


def test_lines_on_fields_lie_on_them() -> None:
    x, y = np.linspace(-1.0, 1.0, 9), np.linspace(0.0, 2.0, 5)
    z = 0.5 * x[None, :] + 0.25 * y[:, None]  # a plane: interpolation is exact
    points = meshes.field_lines(x, y, z, 0.3, 0.01).reshape(-1, 3)
    assert len(points) and np.abs(points[:, 2] - 0.01 - 0.5 * points[:, 0] - 0.25 * points[:, 1]).max() < 1e-12
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.2], [0.0, 1.0, 0.0]])
    points = meshes.plane_lines(corners, 0.25, 0.0).reshape(-1, 3)
    assert np.abs(points[:, 2] - 0.2 * points[:, 0]).max() < 1e-12


def test_the_plan_is_where_the_robot_is(walk: bp.Motion) -> None:
    tracks = Tracks(walk)
    for i in (0, 17, 100, len(walk.t) - 1):
        now = tracks.planned(float(walk.t[i]))
        assert np.abs(now.poses[:, :3] - walk.robot.forward(walk.q[i], walk.base[i]).positions).max() < 1e-9
        assert tracks.sample(float(walk.t[i])) == i or i == len(walk.t) - 1
    low, high = tracks.box
    assert (low < high).all() and tracks.duration == 12.0 and tracks.executed(1.0) is None


def test_feet_that_carry_touch_the_ground_and_hold_the_weight(walk: bp.Motion) -> None:
    tracks = Tracks(walk)
    for time in (0.5, 3.0, 7.7):
        points, forces = tracks.touching(time, tracks.planned(time))
        assert len(points) in (3, 4) and np.abs(points[:, 2]).max() < 1e-3
        assert forces[:, 2].sum() == pytest.approx(walk.robot.mass * 9.81, rel=1e-6)
    feet = tracks.footholds
    assert len(feet) >= 4 and np.abs(feet[:, 2]).max() < 1e-6
    assert Tracks(stick()).touching(0.0, Tracks(stick()).planned(0.0))[0].shape == (0, 3)


def test_cycles_go_on_beside_a_trial() -> None:
    motion, trial = snake_motion(), snake_trial()
    tracks = Tracks(motion, trial)
    advance = motion.facts["advance_per_cycle"]
    first, second = tracks.planned(0.3), tracks.planned(0.3 + motion.facts["period"])
    moved = second.centre - first.centre
    assert np.linalg.norm(moved[:2]) == pytest.approx(advance, rel=1e-9) and len(tracks.stages(0.3)) >= 1
    k = len(trial.t) // 2
    there = tracks.executed(float(trial.t[k] - trial.start_time))
    assert there is not None
    assert np.abs(there.poses - motion.robot.forward(trial.q[k], trial.base[k]).array).max() < 1e-9
    lost = Tracks(motion, diverged_trial())
    last = lost.executed(1e3)  # the last record stands
    assert last is not None and np.isfinite(last.poses).all()


def test_the_body_curve_passes_through_the_body() -> None:
    for motion, frames in ((follower(), None), (snake_motion(), slice(1, None))):
        tracks = Tracks(motion)
        claim = next(c for c in motion.claims if c.kind in ("follows", "on_curve"))
        i = int(np.asarray(claim.data.get("samples", [5]))[0])
        time = float(motion.t[i] - motion.t[0])
        line = tracks.curve(time)
        assert line is not None
        names = [motion.robot.frame_index(str(f)) for f in claim.data["frames"]][frames or slice(None)]
        for place in tracks.planned(time).poses[names, :3]:
            ahead = line[1:] - line[:-1]
            s = np.clip(np.sum((place - line[:-1]) * ahead, axis=1) / np.sum(ahead**2, axis=1), 0.0, 1.0)
            off = np.linalg.norm(line[:-1] + s[:, None] * ahead - place, axis=1).min()
            assert off < 1.01 * float(claim.data["tolerance"]) + 1e-4
    assert Tracks(stick()).curve(0.0) is None


def test_rims_have_the_radius_that_their_joint_makes() -> None:
    robot = bp.tri_wheel()
    q = np.zeros(robot.n)
    for k in (0, 1):
        q[:] = 0.4 * k
        poses = robot.forward(q).array
        radii = contact_radii(robot, q)
        rims = [i for i, c in enumerate(robot.contacts) if c.shape == "rim"]
        made = Body(robot, poses).at(Snapshot(poses, radii, poses[0, :3]))["rim"]
        assert np.array_equal(made.scales, np.repeat(radii[rims][:, None], 3, axis=1))
        for i, position in zip(rims, made.positions, strict=True):
            pose = poses[robot.frame_index(robot.contacts[i].frame)]
            assert np.abs(position - pose[:3] - rotate(pose[3:], np.array(robot.contacts[i].start))).max() < 1e-12


def test_the_lowest_point_of_a_tilted_rim() -> None:
    rim = bp.Contact("w", "f", "rim", radius=0.2)
    half = 0.5 * np.radians(70.0)
    pose = np.array([0.0, 0.0, 1.0, np.cos(half), np.sin(half), 0.0, 0.0])  # tilted about x by 70 degrees
    angle = np.linspace(0.0, 2.0 * np.pi, 100001)
    ring = rotate(pose[3:], 0.2 * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1))
    assert lowest(rim, pose, 0.2)[2] == pytest.approx(1.0 + ring[:, 2].min(), abs=1e-9)


def test_every_robot_keeps_its_number_of_parts() -> None:
    for motion in (cart(), caterpillar(), stick(), follower(), roller()):
        tracks = Tracks(motion)
        body = Body(motion.robot, tracks.planned(0.0).poses)
        sizes = []
        for time in np.linspace(0.0, tracks.duration, 5):
            found = body.at(tracks.planned(float(time)))
            sizes.append({shape: len(made.positions) for shape, made in found.items()})
            assert all(np.isfinite(made.positions).all() and np.isfinite(made.turns).all() for made in found.values())
        assert all(size == sizes[0] for size in sizes)


# --- served on this machine, to its own page


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.2", "::", "example.org", ""])
def test_other_hosts_are_refused(host: str) -> None:
    with pytest.raises(InputError, match="on this machine only"):
        web.start("t", 0, host)


def test_loopback_has_several_names() -> None:
    assert web.loopback("localhost") == "127.0.0.1" and web.loopback("::1") == "::1"


@pytest.fixture
def busy() -> Iterator[int]:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        yield int(taken.getsockname()[1])


def test_a_busy_port_is_named_and_nobody_elses_is_taken(busy: int, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=f"port: {busy} is busy"):
        web.start("t", busy)
    with pytest.raises(InputError, match="port: must be"):
        web.start("t", 65536)
    monkeypatch.setattr(web, "PORT", busy)  # nobody asked for this one
    server = web.start("t")
    assert server.get_port() not in (0, busy) and server.get_host() == "127.0.0.1"
    assert server.request_share_url() is None
    web.stop(server)


def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'bodyplan\[view\]'"):
        web.start("t", 0)


def test_pages_from_elsewhere_get_nothing() -> None:
    import viser
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect

    with Viewer(source_of(stick()), port=0) as viewer:
        port = viewer.url.rpartition(":")[2]
        spoken: Any = [f"viser-v{viser.__version__}"]
        with connect(f"ws://127.0.0.1:{port}", origin=f"http://127.0.0.1:{port}", subprotocols=spoken) as own:  # type: ignore[arg-type]
            assert len(own.recv(timeout=30.0)) > 100
        for origin in ("http://example.org", f"http://example.org:{port}", "null", f"https://127.0.0.1:{port}"):
            other = connect(f"ws://127.0.0.1:{port}", origin=origin, subprotocols=spoken)  # type: ignore[arg-type]
            with other, pytest.raises(ConnectionClosed):
                other.recv(timeout=30.0)


# --- bp.show and bodyplan view


def test_show_serves_and_opens(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    viewer = bp.show(snake_motion(), snake_trial(), port=0, block=False)
    assert viewer.url.startswith("http://127.0.0.1:") and opened == [viewer.url]
    assert viewer.session.state.trial is not None and viewer.url in repr(viewer)
    assert gc.get_freeze_count() > 1000
    viewer.stop()
    viewer.stop()
    assert "stopped" in repr(viewer)
    with pytest.raises(InputError, match="motion: expected a Motion"):
        bp.show(3, block=False)  # type: ignore[arg-type]


def test_the_folder_of_a_run_is_its_motion(tmp_path: Path) -> None:
    snake_motion().save(tmp_path / "motion.npz")
    with view(tmp_path, port=0) as viewer:
        assert viewer.session.state.motion == snake_motion()


def test_view_refuses_what_it_cannot_show(busy: int) -> None:
    for arguments, said in (
        (["nosuch"], "unknown mission"),
        (["inching", "--port", str(busy)], f"port: {busy} is busy"),
        (["inching", "--set", "gait.lift=-1"], "lift"),
    ):
        result = CliRunner().invoke(app, ["view", "--no-browser", *arguments])
        assert result.exit_code == 2 and said in result.output


def test_control_c_ends_it() -> None:
    command = [sys.executable, "-m", "bodyplan", "view", "inching", "--no-browser", "--port", "0"]
    # a suite that runs in the background ignores ctrl-C, and so would what it starts
    out = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert isinstance(out.stdout, io.TextIOBase)
    lines = [out.stdout.readline(), out.stdout.readline()]
    assert "http://127.0.0.1:" in lines[1]
    out.send_signal(signal.SIGINT)
    rest, errors = out.communicate(timeout=60.0)
    assert out.returncode == 0 and errors.strip() == "stopped" and not rest.strip()
