"""Markers in the log, read back by rosbags: shapes lie where the robot's shapes are, in the frames of /tf."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.robot.rims import contact_radii
from export_cases import CASES, small, world_matrices
from robot_cases import screw

STORE = get_typestore(Stores.ROS2_HUMBLE)
CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST, TRIANGLE_LIST = 1, 2, 3, 4, 5, 11


def read(path: Path) -> dict[str, list[tuple[int, list[Any]]]]:
    """(log time ns, markers) by topic."""
    out: dict[str, list[tuple[int, list[Any]]]] = {}
    with Reader(path) as log:
        for connection, at, raw in log.messages():
            if connection.msgtype == "visualization_msgs/msg/MarkerArray":
                out.setdefault(connection.topic, []).append(
                    (at, STORE.deserialize_cdr(raw, connection.msgtype).markers)
                )
    return out


def pose(marker: Any) -> np.ndarray:
    p, r = marker.pose.position, marker.pose.orientation
    out = np.eye(4)
    out[:3, 3] = p.x, p.y, p.z
    out[:3, :3] = Rotation.from_quat([r.x, r.y, r.z, r.w]).as_matrix()
    return out


def points(marker: Any) -> np.ndarray:
    T = pose(marker)
    return np.array([[p.x, p.y, p.z] for p in marker.points]) @ T[:3, :3].T + T[:3, 3]


def scale(marker: Any) -> list[float]:
    return [marker.scale.x, marker.scale.y, marker.scale.z]


@pytest.fixture(scope="module", params=CASES)
def logged(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[bp.Motion, Any]:
    motion = small(request.param)
    return motion, read(motion.save(tmp_path_factory.mktemp("mcap") / "m.mcap"))


def test_every_contact_has_its_shape(logged: tuple[bp.Motion, Any]) -> None:
    motion, topics = logged
    still = topics["/markers/robot"][0][1] if "/markers/robot" in topics else []
    for c, contact in enumerate(motion.robot.contacts):
        if contact.drive is not None:
            for at, moving in topics["/markers/moving"]:
                k = int(np.argmin(np.abs(motion.t - at * 1e-9)))
                (found,) = (m for m in moving if m.ns == contact.name)
                outside = np.hypot(*(points(found) - contact.start)[:, :2].T).max() + 0.5 * found.scale.x
                assert outside == pytest.approx(contact_radii(motion.robot, motion.q)[k, c], rel=1e-12)
            continue
        found = [m for m in still if m.ns == contact.name]
        assert found and all(m.header.frame_id == contact.frame and m.frame_locked for m in found)
        assert sorted(m.id for m in found) == list(range(len(found)))
        wide = 2.0 * contact.radius
        if contact.shape == "box":
            assert found[0].type == CUBE and scale(found[0]) == [2.0 * h for h in contact.half]
            np.testing.assert_allclose(pose(found[0])[:3, 3], contact.start)
        elif contact.shape == "rim":
            assert found[0].type == LINE_LIST
            ring = np.linalg.norm(points(found[0]) - contact.start, axis=1)
            assert ring.max() + 0.5 * found[0].scale.x == pytest.approx(contact.radius, rel=1e-12)
        elif contact.shape == "sphere":
            assert [m.type for m in found] == [SPHERE] and scale(found[0]) == [wide] * 3
            np.testing.assert_allclose(pose(found[0])[:3, 3], contact.start)
        else:
            ends = np.array([pose(m)[:3, 3] for m in found if m.type == SPHERE])
            np.testing.assert_allclose(ends, [contact.start, contact.end], atol=1e-15)
            (middle,) = (m for m in found if m.type == CYLINDER)
            T, half = pose(middle), 0.5 * middle.scale.z
            tips = [T[:3, 3] - half * T[:3, 2], T[:3, 3] + half * T[:3, 2]]
            np.testing.assert_allclose(tips, [contact.start, contact.end], atol=1e-12)
            assert scale(middle)[:2] == [wide, wide]


def test_links_end_at_the_frames(logged: tuple[bp.Motion, Any]) -> None:
    """In the world, whatever frame they are drawn in."""
    motion, topics = logged
    before = {c.frame_name(i): c.frame_name(i - 1) if i else c.parent for c in motion.robot.chains
              for i in range(len(c.elements))}  # fmt: skip
    seen = 0
    for topic in ("/markers/robot", "/markers/moving"):
        for at, markers in topics.get(topic, ()):
            frames = world_matrices(motion, int(np.argmin(np.abs(motion.t - at * 1e-9))))
            for m in markers:
                name = m.ns.removesuffix(" link")
                if name == m.ns:
                    continue
                T = frames[m.header.frame_id]
                ends = [frames[name][:3, 3], frames[before[name]][:3, 3]]
                if m.type == LINE_LIST:
                    np.testing.assert_allclose(points(m) @ T[:3, :3].T + T[:3, 3], ends, atol=1e-12)
                    seen += 1
                elif m.type == SPHERE:
                    at_end = (T @ pose(m))[:3, 3]
                    assert min(np.linalg.norm(at_end - end) for end in ends) < 1e-12
                    seen += 1
    assert seen or motion.robot.name == "snake"


@pytest.mark.parametrize("case", ["serpentine arcs", "everything"])
def test_arcs_are_bent(case: str, tmp_path: Path) -> None:
    motion = small(case)
    moving = read(motion.save(tmp_path / "m.mcap"))["/markers/moving"]
    assert len(moving) == len(motion.t)
    column = {name: k for k, name in enumerate(motion.joints)}
    arcs = {c.frame_name(i): e for c in motion.robot.chains for i, e in enumerate(c.elements) if isinstance(e, bp.Arc)}
    for k in (0, len(motion.t) - 1):
        found = {m.ns.removesuffix(" arc"): m for m in moving[k][1] if m.type == LINE_STRIP}
        assert set(found) == set(arcs)
        for name, arc in arcs.items():
            pitch, yaw = (
                v.offset + v.scale * motion.q[k, column[v.name]] if isinstance(v, bp.Joint) else v
                for v in (arc.pitch, arc.yaw)
            )
            bend = screw(np.array([arc.length, 0.0, 0.0, 0.0, pitch, yaw])).real
            expected = [expm(u * bend)[:3, 3] for u in np.linspace(0.0, 1.0, 13)]
            np.testing.assert_allclose(points(found[name]), expected, atol=1e-12)


def test_the_ground_is_triangles(logged: tuple[bp.Motion, Any]) -> None:
    motion, topics = logged
    ((at, markers),) = topics["/markers/ground"]
    (floor,) = (m for m in markers if m.ns == "floor")
    assert at == round(motion.t[0] * 1e9) and floor.type == TRIANGLE_LIST and floor.header.frame_id == "world"
    corners = points(floor)
    assert len(corners) % 3 == 0 and scale(floor) == [1.0, 1.0, 1.0]
    if isinstance(motion.ground, (bp.Plane, bp.Surface)):
        np.testing.assert_allclose(corners[:, 2], motion.ground.height(corners), atol=1e-9)


def test_shapes_come_again_for_who_comes_late(tmp_path: Path) -> None:
    motion = small("concertina")
    assert motion.t[-1] == 4.0
    topics = read(motion.save(tmp_path / "m.mcap"))
    assert [at for at, _ in topics["/markers/robot"]] == [k * 10**9 for k in range(5)]
    assert "/markers/moving" not in topics
    stamps = {m.header.stamp.sec for m in topics["/markers/robot"][3][1]}
    assert stamps == {3}


def test_what_moves_is_drawn_thirty_times_a_second_and_at_the_end(tmp_path: Path) -> None:
    motion = small("everything")
    dense = np.linspace(0.0, 0.1, 5 * 20 + 1)
    fields = {n: np.repeat(getattr(motion, n)[:1], 101, axis=0) for n in ("base", "q", "qd", "qdd")}
    many = motion.replace(t=dense, residual=np.zeros(101), status=["ok"] * 101, torques=None, **fields)
    stamps = [at for at, _ in read(many.save(tmp_path / "m.mcap"))["/markers/moving"]]
    assert stamps == [0, 34_000_000, 68_000_000, 100_000_000]


def test_markers_can_be_left_out(tmp_path: Path) -> None:
    motion = small("crawl")
    assert read(bp.save(motion, tmp_path / "m.mcap", markers="no")) == {}
    with pytest.raises(bp.InputError, match="markers: must be yes or no, got 'maybe'"):
        bp.save(motion, tmp_path / "m.mcap", markers="maybe")
