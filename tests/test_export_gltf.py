"""Animated glTF: read by the specification, by trimesh and by pygltflib; poses are those of forward kinematics."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
import pytest
import trimesh
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import bodyplan as bp
from bodyplan.export import meshes
from bodyplan.robot.rims import contact_radii
from export_cases import CASES, small, world_matrices
from gltf_cases import Read
from robot_cases import screw

#: z up -> y up
C = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]])


@pytest.fixture(scope="module", params=CASES)
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[bp.Motion, Path]:
    motion = small(request.param)
    return motion, motion.save(tmp_path_factory.mktemp("glb") / "m.glb")


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[bp.Motion, Read]:
    motion = small("everything")
    return motion, Read(motion.save(tmp_path_factory.mktemp("glb") / "m.glb"))


def test_nodes_are_where_forward_kinematics_says(written: tuple[bp.Motion, Path]) -> None:
    motion, read = written[0], Read(written[1])
    assert set(motion.robot.frames) <= set(read.names)
    for k, t in enumerate(motion.t - motion.t[0]):
        for name, T in world_matrices(motion, k).items():
            np.testing.assert_allclose(read.world(name, float(t)), C @ T, atol=1e-6)
            if k == 0:
                # programs that do not animate show the first sample
                np.testing.assert_allclose(read.world(name, None), C @ T, atol=1e-12)


def test_every_frame_has_its_channels(written: tuple[bp.Motion, Path]) -> None:
    motion, read = written[0], Read(written[1])
    for name in motion.robot.frames:
        for path, wide in (("translation", 3), ("rotation", 4)):
            times, values = read.tracks[read.names.index(name), path]
            np.testing.assert_array_equal(times, (motion.t - motion.t[0]).astype(np.float32))
            assert values.shape == (len(motion.t), wide)
    for (_, path), (_, values) in read.tracks.items():
        if path == "rotation":
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
            assert np.all(np.sum(values[1:] * values[:-1], axis=1) > 0.0)


def test_signs_follow_a_whole_turn(everything: tuple[bp.Motion, Read]) -> None:
    motion, read = everything
    canonical = motion.poses()["base"][:, 3:]
    assert np.any(np.sum(canonical[1:] * canonical[:-1], axis=1) < 0.0)
    # half way between two samples the base has turned half way: 6 rad/s about one axis
    for a, b in zip(motion.t[:-1], motion.t[1:], strict=True):
        middle = 0.5 * (a + b)
        turned = C[:3, :3] @ Rotation.from_rotvec(6.0 * middle * np.array([0.6, 0.0, 0.8])).as_matrix()
        np.testing.assert_allclose(read.world("base", middle - motion.t[0])[:3, :3], turned, atol=1e-6)


def test_trimesh_reads_the_scene(written: tuple[bp.Motion, Path]) -> None:
    motion, path = written
    scene = trimesh.load_scene(path)
    expected = world_matrices(motion, 0)
    for name, T in expected.items():
        np.testing.assert_allclose(scene.graph[name][0], C @ T, atol=1e-12)
    seen = 0
    for name in scene.graph.nodes_geometry:
        mesh = scene.geometry[scene.graph[name][1]].copy()
        if "ground" not in name:
            mesh.merge_vertices(merge_norm=True, merge_tex=True)
            assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.0
            seen += 1
    assert seen >= len(motion.robot.contacts)


def test_pygltflib_reads_the_file(written: tuple[bp.Motion, Path]) -> None:
    motion, path = written
    read = pygltflib.GLTF2().load(str(path))
    assert read.asset.generator.startswith("bodyplan ") and read.animations[0].name == "motion"
    assert len(read.animations) == 1 and len(read.scenes) == 1
    targets = {(read.nodes[c.target.node].name, c.target.path) for c in read.animations[0].channels}
    assert {(name, path) for name in motion.robot.frames for path in ("translation", "rotation")} <= targets
    index = read.animations[0].samplers[0].output
    mine = Read(path)
    view = read.bufferViews[read.accessors[index].bufferView]
    part = read.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    assert part == mine.numbers(index).tobytes()


def test_shapes_are_those_of_the_contacts(written: tuple[bp.Motion, Path]) -> None:
    """Corners of every shape lie on its surface, at every sample."""
    motion, read = written[0], Read(written[1])
    radii = contact_radii(motion.robot, motion.q)
    for c, contact in enumerate(motion.robot.contacts):
        name = f"{contact.name} ({contact.shape})"
        start, end = np.array(contact.start), np.array(contact.end if contact.shape == "capsule" else contact.start)
        for k in (0, len(motion.t) // 2, -1):
            T = world_matrices(motion, k)[contact.frame]
            at = (read.points(name, float(motion.t[k] - motion.t[0])) - T[:3, 3]) @ T[:3, :3]
            if contact.shape == "box":
                np.testing.assert_allclose(np.abs(at - start), np.tile(contact.half, (len(at), 1)), atol=2e-6)
            elif contact.shape == "rim":
                np.testing.assert_allclose(np.hypot(*(at - start)[:, :2].T).max(), radii[k, c], rtol=5e-6)
                # and lies in the frame's plane, through its centre
                np.testing.assert_allclose(at[:, 2].max() + at[:, 2].min(), 2.0 * start[2], atol=2e-6)
            else:
                along = end - start
                share = np.clip((at - start) @ along / max(along @ along, 1e-30), 0.0, 1.0)
                away = np.linalg.norm(at - start - share[:, None] * along, axis=1)
                np.testing.assert_allclose(away, contact.radius, atol=2e-6)


def test_a_wheel_grows_and_shrinks(everything: tuple[bp.Motion, Read]) -> None:
    motion, read = everything
    radii = 0.3 * np.cos(0.5 * motion.joint("adjust")) * np.sqrt(0.75) + 0.02
    assert np.ptp(radii) > 0.05
    for t, radius in zip(motion.t - motion.t[0], radii, strict=True):
        hub = read.world("hub", float(t))
        wide = read.points("tyre (rim)", float(t)) - np.array([hub[0, 3], -hub[2, 3], hub[1, 3]])
        # the tyre's outside, seen along the axle 10 mm from the frame
        assert np.linalg.norm(wide, axis=1).max() == pytest.approx(np.hypot(radius, 0.01), rel=1e-4)


def test_links_join_the_frames(everything: tuple[bp.Motion, Read]) -> None:
    """A slide's link grows; a stiff one is a capsule between two origins."""
    motion, read = everything
    ends = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]])
    lengths = []
    for k, t in enumerate(motion.t - motion.t[0]):
        at = world_matrices(motion, k)
        for after, before in (("two", "one"), ("touching", "axle")):
            found = (read.world(f"{after} (link)", float(t)) @ ends.T)[:3].T
            np.testing.assert_allclose(found, [(C @ at[after])[:3, 3], (C @ at[before])[:3, 3]], atol=2e-6)
        lengths.append(np.linalg.norm(found[1] - found[0]))
        stiff = read.points("one (link)", float(t))
        a, b = at["base"][:3, 3], at["one"][:3, 3]
        share = np.clip((stiff - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away = np.linalg.norm(stiff - a - share[:, None] * (b - a), axis=1)
        np.testing.assert_allclose(away, away[0], atol=2e-6)
    np.testing.assert_allclose(lengths, contact_radii(motion.robot, motion.q)[:, 4], atol=2e-6)


@pytest.mark.parametrize("case", ["serpentine arcs", "everything"])
def test_arcs_are_bent(case: str, tmp_path: Path) -> None:
    """Pieces lie where the exponential of a share of the arc's screw says."""
    motion = small(case)
    read = Read(motion.save(tmp_path / "m.glb"))
    joints = motion.robot.joints
    samples = {k: world_matrices(motion, k) for k in (0, len(motion.t) // 2, len(motion.t) - 1)}
    seen = 0
    for chain in motion.robot.chains:
        before = chain.parent
        for i, element in enumerate(chain.elements):
            name = chain.frame_name(i)
            if isinstance(element, bp.Arc):
                for k, at in samples.items():
                    pitch, yaw = (
                        v.offset + v.scale * motion.q[k, joints.index(v.name)] if isinstance(v, bp.Joint) else v
                        for v in (element.pitch, element.yaw)
                    )
                    bend = screw(np.array([element.length, 0.0, 0.0, 0.0, pitch, yaw])).real
                    for piece in (1, 3, 8):
                        expected = at[before] @ expm((piece - 0.5) / 8.0 * bend)
                        found = read.world(f"{name} (arc {piece})", float(motion.t[k] - motion.t[0]))
                        np.testing.assert_allclose(found, C @ expected, atol=1e-6)
                        seen += 1
            before = name
    assert seen >= 18


def test_the_ground_is_there(written: tuple[bp.Motion, Path]) -> None:
    motion, read = written[0], Read(written[1])
    points = read.points("ground (floor)", None)
    if isinstance(motion.ground, bp.Corridor):
        np.testing.assert_array_equal(points[:, 2], 0.0)
    elif not isinstance(motion.ground, bp.Profile):
        np.testing.assert_allclose(points[:, 2], motion.ground.height(points), atol=1e-6)
    # under the robot all the way, and a floor looks up
    way = motion.poses().positions.reshape(-1, 3)
    assert np.all(points[:, :2].min(axis=0) < way[:, :2].min(axis=0))
    assert np.all(points[:, :2].max(axis=0) > way[:, :2].max(axis=0))
    vertices, normals, faces = read.mesh("ground (floor)")
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    assert np.all(np.sum(across * normals[faces[:, 0]], axis=1) > 0.9)
    assert np.all(across[:, 2][np.abs(across[:, 2]) > 0.5] > 0.0) or isinstance(motion.ground, bp.Profile)
    if isinstance(motion.ground, bp.Corridor) and motion.ground.width < 1.0:
        walls = read.points("ground (wall)", None)
        np.testing.assert_allclose(np.abs(walls[:, 1]).min(), 0.5 * motion.ground.width, atol=1e-7)


def test_the_ground_can_be_left_out(tmp_path: Path) -> None:
    motion = small("crawl")
    assert not any("ground" in name for name in Read(bp.save(motion, tmp_path / "m.glb", ground="no")).names)
    with pytest.raises(bp.InputError, match="ground: must be yes or no, got 'maybe'"):
        bp.save(motion, tmp_path / "m.glb", ground="maybe")


def test_times_that_single_precision_cannot_tell_apart(tmp_path: Path) -> None:
    motion = small("everything")
    with pytest.raises(bp.InputError, match="too close to each other for glTF"):
        motion.replace(t=[0.0, 100.0, 100.000001, 101.0, 102.0]).save(tmp_path / "m.glb")
    assert list(tmp_path.iterdir()) == []


def test_turning_is_the_shortest_rotation() -> None:
    rng = np.random.default_rng(3)
    x = np.array([1.0, 0.0, 0.0])
    to = np.concatenate([rng.normal(size=(50, 3)), [[-2.0, 0.0, 0.0], [3.0, 0.0, 0.0], [-1.0, 1e-9, 0.0], [0, 0, 0]]])
    found = Rotation.from_quat(meshes.turning(x, to), scalar_first=True)
    length = np.linalg.norm(to, axis=1)
    np.testing.assert_allclose(found.apply(x)[:-1], to[:-1] / length[:-1, None], atol=1e-9)
    np.testing.assert_allclose(found.magnitude()[:-1], np.arccos(np.clip(to[:-1, 0] / length[:-1], -1, 1)), atol=1e-7)
    assert found.magnitude()[-1] == 0.0
