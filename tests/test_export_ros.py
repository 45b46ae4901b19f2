"""MCAP logs and JointTrajectory files, read back by rosbags, PyYAML and ruamel.yaml: by none that wrote them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from ruamel.yaml import YAML
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.export import joint_trajectory
from bodyplan.export.messages import definition
from bodyplan.export.ros import nanoseconds
from bodyplan.export.sampled import between, sampled
from export_cases import CASES, small, world_matrices

STORE = get_typestore(Stores.ROS2_HUMBLE)


def messages(path: Path, topic: str) -> list[tuple[int, Any]]:
    """(log time ns, message) of a topic, by ROS 2's own definitions of the types."""
    with Reader(path) as log:
        connections = [c for c in log.connections if c.topic == topic]
        return [(at, STORE.deserialize_cdr(raw, c.msgtype)) for c, at, raw in log.messages(connections)]


def matrix(transform: Any) -> np.ndarray:
    p, r = transform.translation, transform.rotation
    out = np.eye(4)
    out[:3, 3] = p.x, p.y, p.z
    out[:3, :3] = Rotation.from_quat([r.x, r.y, r.z, r.w]).as_matrix()
    return out


@pytest.mark.parametrize("case", CASES)
def test_joint_states_are_those_of_the_motion(case: str, tmp_path: Path) -> None:
    motion = small(case)
    read = messages(motion.save(tmp_path / "m.mcap"), "/joint_states")
    assert [list(m.name) for _, m in read] == [list(motion.joints)] * len(motion.t)
    np.testing.assert_array_equal([m.position for _, m in read], motion.q)
    np.testing.assert_array_equal([m.velocity for _, m in read], motion.qd)
    assert case not in ("inching", "crawl", "wheels", "everything") or motion.torques is not None
    if motion.torques is None:
        assert [len(m.effort) for _, m in read] == [0] * len(motion.t)
    else:
        np.testing.assert_array_equal([m.effort for _, m in read], motion.torques)
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in read]
    assert stamps == [at for at, _ in read] == [round(t * 1e9) for t in motion.t]


@pytest.mark.parametrize("case", CASES)
def test_the_tree_of_frames_gives_forward_kinematics(case: str, tmp_path: Path) -> None:
    motion = small(case)
    read = messages(motion.save(tmp_path / "m.mcap"), "/tf")
    assert len(read) == len(motion.t)
    for k, (_, message) in enumerate(read):
        found = {"world": np.eye(4)}
        for tf in message.transforms:
            # frames come after the frame that they hang on, once each
            assert tf.child_frame_id not in found
            found[tf.child_frame_id] = found[tf.header.frame_id] @ matrix(tf.transform)
        expected = world_matrices(motion, k)
        assert set(found) == {"world", *expected}
        for name, T in expected.items():
            np.testing.assert_allclose(found[name], T, atol=1e-12)


def test_frames_hang_on_the_frame_before_them(tmp_path: Path) -> None:
    motion = small("everything")
    _, message = messages(motion.save(tmp_path / "m.mcap"), "/tf")[0]
    parents = {tf.child_frame_id: tf.header.frame_id for tf in message.transforms}
    assert parents == {
        "base": "world",
        "one": "base",
        "two": "one",
        "three": "two",
        "tail.1": "two",
        "tail.2": "tail.1",
        "axle": "base",
        "hub": "axle",
        "touching": "axle",
    }


def test_the_log_is_one_of_ros_2(tmp_path: Path) -> None:
    from mcap.reader import make_reader

    path = small("crawl").save(tmp_path / "m.mcap")
    with path.open("rb") as file:
        reader = make_reader(file)
        summary = reader.get_summary()
        assert reader.get_header().profile == "ros2" and summary is not None
        names = {s.name: s for s in summary.schemas.values()}
        assert {s.encoding for s in names.values()} == {"ros2msg"}
        assert {c.message_encoding for c in summary.channels.values()} == {"cdr"}
        assert [m.metadata for m in reader.iter_metadata()] == [{"robot": "silo4", "gait": "crawl"}]
    kinds = ("sensor_msgs/JointState", "tf2_msgs/TFMessage", "visualization_msgs/MarkerArray")
    assert set(names) == {kind.replace("/", "/msg/") for kind in kinds}
    for kind in kinds:
        name, text = kind.replace("/", "/msg/"), definition(kind)
        assert names[name].data.decode() == text
        # field by field what ROS 2 says, for the message and all that it is made of
        types = get_types_from_msg(text, name)
        assert len(types) >= 3
        for part, (_, fields) in types.items():
            for store in (STORE, get_typestore(Stores.ROS2_JAZZY)):
                assert fields == store.fielddefs[part][1]


def test_stamps_may_start_elsewhere_and_the_world_have_another_name(tmp_path: Path) -> None:
    motion = small("everything")
    path = bp.save(motion, tmp_path / "m.mcap", start=1.7e9, fixed_frame="map")
    read = messages(path, "/tf")
    assert [at - 1_700_000_000 * 10**9 for at, _ in read] == [0, 250_000_000, 500_000_000, 600_000_000, 1_000_000_000]
    assert read[0][1].transforms[0].header.frame_id == "map"
    with pytest.raises(bp.InputError, match=r"fixed_frame.*'base'"):
        bp.save(motion, path, fixed_frame="base")
    with pytest.raises(bp.InputError, match=r"start.*2147483647"):
        bp.save(motion, path, start=2.0**31 - 0.5)
    early = motion.replace(t=motion.t - 1.0)
    with pytest.raises(bp.InputError, match=r"before 0.*start"):
        early.save(path)
    assert messages(bp.save(early, path, start=0), "/tf")[0][0] == 0


@pytest.mark.parametrize("case", CASES)
def test_a_trajectory_reads_back_equal(case: str, tmp_path: Path) -> None:
    motion = small(case)
    text = bp.save(motion, tmp_path / "m.yaml", joints="all").read_text("utf-8")
    read = yaml.safe_load(text)
    assert read == YAML(typ="safe").load(io.StringIO(text))
    assert read["joint_names"] == list(motion.joints)
    for key, values in (("positions", motion.q), ("velocities", motion.qd), ("accelerations", motion.qdd)):
        np.testing.assert_array_equal([point[key] for point in read["points"]], values)
    times = [p["time_from_start"]["sec"] * 10**9 + p["time_from_start"]["nanosec"] for p in read["points"]]
    assert times == [round(t * 1e9) - round(motion.t[0] * 1e9) for t in motion.t]
    assert all(0 <= p["time_from_start"]["nanosec"] < 10**9 for p in read["points"])


def test_a_trajectory_is_a_message_of_ros_2(tmp_path: Path) -> None:
    motion = small("crawl")
    read = yaml.safe_load(motion.save(tmp_path / "m.yml").read_text("utf-8"))
    made = {name.split("/")[-1]: kind for name, kind in STORE.types.items()}
    stamp = made["Time"](**read["header"]["stamp"])
    points = [
        made["JointTrajectoryPoint"](
            np.array(p["positions"]),
            np.array(p["velocities"]),
            np.array(p["accelerations"]),
            np.array([]),
            made["Duration"](**p["time_from_start"]),
        )
        for p in read["points"]
    ]
    assert set(read) == {"header", "joint_names", "points"}
    message = made["JointTrajectory"](made["Header"](stamp, read["header"]["frame_id"]), read["joint_names"], points)
    name = "trajectory_msgs/msg/JointTrajectory"
    back = STORE.deserialize_cdr(STORE.serialize_cdr(message, name), name)
    assert back.joint_names == list(motion.joints)
    np.testing.assert_array_equal([p.positions for p in back.points], motion.q)
    assert back.points[-1].time_from_start.sec == 2 and back.points[1].time_from_start.nanosec == 250_000_000


def test_a_trajectory_commands_what_has_an_actuator(tmp_path: Path) -> None:
    motion = small("everything")
    read = yaml.safe_load(motion.save(tmp_path / "m.yaml").read_text())
    assert read["joint_names"] == ["bend", "slide", "nod", "wag", "spin", "adjust"]
    columns = [motion.robot.joint_index(name) for name in read["joint_names"]]
    np.testing.assert_array_equal([p["positions"] for p in read["points"]], motion.q[:, columns])
    with pytest.raises(bp.InputError, match="joints: must be actuated or all, got 'some'"):
        bp.save(motion, tmp_path / "m.yaml", joints="some")
    fixed = bp.Robot.from_rows({"a": [bp.Row(theta=bp.Joint("free", actuated=False), a=0.1)]})
    zero = np.zeros((2, 1))
    base = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (2, 1))
    passive = bp.Motion(fixed, bp.Plane(), {}, [0.0, 1.0], base, zero, zero, zero, [0.0, 0.0], ["ok", "ok"])
    with pytest.raises(bp.InputError, match="no actuated joints"):
        passive.save(tmp_path / "m.yaml")


@given(st.lists(st.floats(-1e12, 1e12), min_size=1, max_size=9), st.text(min_size=1, max_size=12))
def test_any_number_and_any_text_read_back_equal(values: list[float], name: str) -> None:
    row = joint_trajectory._row(np.array(values))
    for load in (yaml.safe_load, YAML(typ="safe").load):
        assert np.array(load(row)).tobytes() == np.array(values).tobytes()
        assert load(joint_trajectory._text(name)) == name


@given(st.lists(st.integers(0, 10**17), min_size=1, max_size=9, unique=True).map(sorted))
def test_nanoseconds_are_the_nearest(stamps: list[int]) -> None:
    t = np.array(stamps) / 1e9
    exact = [np.longdouble(x) * 10**9 for x in t]
    if len({round(x) for x in exact}) < len(stamps):
        return
    assert all(abs(found - x) <= 0.5 for found, x in zip(nanoseconds(t).tolist(), exact, strict=True))


def test_times_that_ros_cannot_tell_apart_are_refused(tmp_path: Path) -> None:
    motion = small("everything")
    for t, words in (
        (np.array([0.0, 1e-10, 1.0, 2.0, 3.0]), "samples 0 and 1 are less than a nanosecond apart"),
        (np.array([0.0, 1.0, 2.0, 3.0, 2.0**31]), "2147483647 s"),
    ):
        for name in ("m.yaml", "m.mcap"):
            with pytest.raises(bp.InputError, match=words):
                motion.replace(t=t).save(tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_rate_samples_the_motion_evenly(tmp_path: Path) -> None:
    """Polynomials of degree 5 are met exactly; both ends and their derivatives are kept."""
    rng = np.random.default_rng(5)
    c = rng.normal(size=(6, 3))
    t = np.array([0.0, 0.3, 0.35, 1.0])

    def at(t: np.ndarray, order: int) -> np.ndarray:
        return np.stack([np.polynomial.Polynomial(col).deriv(order)(t) for col in c.T], axis=-1)

    fine = np.linspace(0.0, 1.0, 41)
    found = between(t, at(t, 0), at(t, 1), at(t, 2), fine)
    for order, values in enumerate(found):
        np.testing.assert_allclose(values, at(fine, order), atol=1e-11)
    motion = small("everything")
    track = sampled(motion, rate=24.5)
    assert track.step == pytest.approx(0.04, rel=1e-15) and len(track.t) == 26 and track.t[-1] == 1.0
    assert sampled(motion).step is None
    read = yaml.safe_load(bp.save(motion, tmp_path / "m.yaml", rate=10, joints="all").read_text())
    assert len(read["points"]) == 11 and read["points"][3]["time_from_start"] == {"sec": 0, "nanosec": 300_000_000}
    # the motion's samples at 0.5, 0.75, 1.0, 1.1 and 1.5 s: all but the second are at tenths
    for place, sample in ((0, 0), (5, 2), (6, 3), (10, 4)):
        np.testing.assert_allclose(read["points"][place]["positions"], motion.q[sample], atol=1e-12)
        np.testing.assert_allclose(read["points"][place]["accelerations"], motion.qdd[sample], atol=1e-10)
    for rate in (0, -1.0, float("nan"), "fast"):
        with pytest.raises(bp.InputError, match="rate"):
            bp.save(motion, tmp_path / "m.yaml", rate=rate)
    with pytest.raises(bp.InputError, match=r"rate: 1e\+12 samples"):
        bp.save(motion, tmp_path / "m.yaml", rate=1e12)
